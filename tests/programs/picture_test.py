"""flexel picture from the outside: the file that it writes, what it says, what it refuses."""

import os

from harness import body, bracket, box, expect, expect_error, expect_ok, expect_only, main, run, scene, shell, write
from pictures import read_png


BEND = """material = "PLA"
[[fix]]
where = "xmin"
[[move]]
where = "xmax"
displacement = ["0 mm", "0 mm", "-12 mm"]
"""


def colours(rows):
    return {row[i : i + 3] for row in rows for i in range(0, len(row), 3)}


def deformed(name="bent.vtu"):
    body("rest.vtu")
    expect_ok(run("flexel-simulate", scene(), "rest.vtu", "-o", name))
    return name


def test_picture_of_a_part():
    result = expect_ok(run("flexel", "picture", box(), "-o", "box.png", "--size", "320x200"))
    expect(result.out == b"", "everything that is said goes to stderr")
    width, height, rows = read_png(open("box.png", "rb").read())
    expect((width, height) == (320, 200), f"{width} x {height}")
    paper = rows[0][:3]
    drawn = sum(row[i : i + 3] != paper for row in rows for i in range(0, len(row), 3))
    expect(0.08 * width * height < drawn < 0.9 * width * height, f"the part takes up a fair share: {drawn}")
    expect(len(colours(rows)) > 30, "shades, not one colour")
    expect_only("box.png", "box.stl")


def test_picture_of_a_body_is_coloured():
    _, _, rows = read_png_of(deformed(), "--size", "480x360")
    strong = [c for c in colours(rows) if max(c) - min(c) > 120]
    expect(len(strong) > 100, "the colour map shows")
    _, _, plain = read_png_of("bent.vtu", "--size", "480x360", "--color", "none", "--no-outline")
    expect(len([c for c in colours(plain) if max(c) - min(c) > 120]) < 20, "only the axes are coloured without")


def read_png_of(*arguments):
    return read_png(expect_ok(run("flexel", "picture", *arguments, "-o", "-", "--quiet")).out)


def test_a_coarse_surface_bends_in_the_picture():
    """Twelve triangles, drawn as they are written: split where the bar bends. Whole, they would show it straight."""
    box()
    scene("bend.toml", BEND)
    expect_ok(run("flexel-voxelize", "box.stl", "--size", "2.5 mm", "-o", "rest.vtu", "--quiet"))
    expect_ok(run("flexel-simulate", "bend.toml", "rest.vtu", "-o", "bent.vtu", "--no-estimate", "--quiet"))
    expect_ok(run("flexel-map", "bent.vtu", "-o", "split.stl", "--quiet"))
    expect_ok(run("flexel-map", "bent.vtu", "-o", "whole.stl", "--keep-vertices", "--quiet"))
    view = ("--size", "320x200", "--view", "0,0", "--color", "none", "--no-outline", "--scale", "1")
    dark = lambda name: [[sum(row[3 * i:3 * i + 3]) < 700 for i in range(320)] for row in read_png_of(name, *view)[2]]
    body, split, whole = dark("bent.vtu"), dark("split.stl"), dark("whole.stl")
    apart = lambda a, b: sum(x != y for row, other in zip(a, b) for x, y in zip(row, other))
    expect(apart(body, split) < 0.1 * apart(body, whole), f"{apart(body, split)} pixels differ from the split part, {apart(body, whole)} from the whole one")


def test_every_kind_of_picture():
    deformed()
    for options in (["--color", "strain"], ["--color", "fill"], ["--color", "thickness"], ["--cells"], ["--elements"],
                    ["--scale", "auto"], ["--scale", "0"], ["--color", "displacement", "--range", "1:20 um"], ["--view", "top"],
                    ["--view", "-30,15"], ["--cells", "--color", "displacement"], ["--elements", "--color", "strain"],
                    ["--color", "displacement.z"], ["--cells", "--color", "displacement.2"], ["--up", "y"]):
        read_png_of("bent.vtu", "--size", "160x120", *options)
    read_png_of("bent.vtu", box(), "rest.vtu", "--size", "400x300")


def test_picture_at_the_end_of_a_pipe():
    deformed()
    box()
    expect_ok(shell("set -o pipefail; cat bent.vtu | flexel picture - -o a.png --size 200x150"))
    expect_ok(shell("set -o pipefail; flexel-map bent.vtu --format stl | flexel picture - -o b.png --size 200x150"))
    expect_ok(shell("flexel picture <(cat box.stl) -o c.png --size 200x150"))
    for name in ("a.png", "b.png", "c.png"):
        read_png(open(name, "rb").read())


def test_any_number_of_threads_gives_the_same_file():
    deformed()
    one, three = (expect_ok(run("flexel", "picture", "bent.vtu", "-o", "-", "--quiet", "--size", "300x200", "--threads", n)).out
                  for n in ("1", "3"))
    expect(one == three, "the same bytes")


def test_faces_of_a_step_part():
    bracket()
    read_png_of("bracket.step", "--size", "300x200")


def test_refused_and_nothing_written():
    box()
    deformed()
    write("empty.stl", "")
    for arguments, words in (
            (["box.stl"], ["--output"]),
            (["box.stl", "-o", "box.jpg"], ["box.jpg", "png"]),
            (["box.stl", "-o", "x.png", "--color", "displacement"], ["box.stl", "displacement", "thickness"]),
            (["rest.vtu", "-o", "x.png", "--color", "strian"], ["strian", "did you mean \"strain\"", "fill"]),
            (["rest.vtu", "-o", "x.png", "--color", "strain", "--range", "1:0"], ["--range"]),
            (["rest.vtu", "-o", "x.png", "--color", "displacement", "--range", "1:5"], ["--range", "unit"]),
            (["rest.vtu", "-o", "x.png", "--color", "displacement", "--range", "5 mm"], ["--range", "LOW:HIGH"]),
            (["box.stl", "-o", "x.png", "--cells"], ["box.stl", "body"]),
            (["rest.vtu", "-o", "x.png", "--cells", "--elements"], ["--cells", "--elements"]),
            (["box.stl", "-o", "x.png", "--size", "1600"], ["--size", "1600x1200"]),
            (["box.stl", "-o", "x.png", "--size", "10x10"], ["--size", "64"]),
            (["box.stl", "-o", "x.png", "--size", "99999x99999"], ["--size"]),
            (["box.stl", "-o", "x.png", "--view", "fornt"], ["fornt", "did you mean \"front\""]),
            (["box.stl", "-o", "x.png", "--scale", "big"], ["--scale", "big"]),
            (["box.stl", "-o", "x.png", "--scale", "-1"], ["--scale"]),
            (["bent.vtu", "-o", "x.png", "--scale", "1e300"], ["bent.vtu", "--scale"]),
            (["bent.vtu", "-o", "x.png", "--color", "displacement.3"], ["displacement.3"]),
            (["box.stl", "-o", "x.png", "--up", "w"], ["--up"]),
            (["missing.stl", "-o", "x.png"], ["missing.stl"]),
            (["empty.stl", "-o", "x.png"], ["empty.stl", "empty"]),
            (["box.stl", "-o", "no/such/folder/x.png"], ["no/such/folder"])):
        expect_error(run("flexel", "picture", *arguments), "flexel", *words)
    expect_error(run("flexel", "picture", "-", "-o", "x.png", stdin=b""), "flexel", "stdin", "before it")
    expect_error(run("flexel", "picture", "-", "-o", "x.png", stdin=b"\0\1\2"), "flexel", "stdin")
    expect(not os.path.exists("x.png"), "nothing is written")


if __name__ == "__main__":
    main(globals())

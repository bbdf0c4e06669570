"""flexel compensate, judged from outside: what it says is made, is run through flexel deform on another lattice."""

import json
import math
import pathlib
import re

from harness import ascii_stl, box_triangles, expect, expect_error, expect_ok, expect_only, main, run

SAG = ["--fix", "xmin", "--gravity", "60 g", "--material", "PLA", "--model", "quadratic"]


def vertices(path):
    return [tuple(map(float, line.split()[1:])) for line in pathlib.Path(path).read_text().splitlines() if line.strip().startswith("vertex")]


def off_box(point, size):
    """Distance to the surface of a box from the origin."""
    inside = min(min(x, s - x) for x, s in zip(point, size))
    if inside >= 0:
        return inside
    return math.sqrt(sum(max(-x, 0, x - s) ** 2 for x, s in zip(point, size)))


def test_a_shelf_sags_into_shape():
    size = (80.0, 10.0, 3.0)
    pathlib.Path("shelf.stl").write_bytes(ascii_stl(box_triangles(size)))
    expect_ok(run("flexel", "compensate", "shelf.stl", *SAG, "--size", "2mm", "-o", "make.stl", "--ascii", "--summary", "s.json"))
    told = json.loads(pathlib.Path("s.json").read_text())
    largest = 1e3 * told["largest_displacement"]
    expect(largest > 0.3, f"it hardly sags: {largest} mm")
    expect(told["remaining_share"] < 0.01, told)
    made = vertices("make.stl")
    expect(max(z for _, _, z in made) > 3 + 0.5 * largest, "nothing was bent up")
    expect_ok(run("flexel", "deform", "make.stl", *SAG, "--size", "1.7mm", "-o", "back.stl", "--ascii", "--keep-vertices", "--no-estimate"))
    left = max(off_box(v, size) for v in vertices("back.stl"))
    expect(left < 0.01 * largest, f"{left} mm remain of {largest} mm")


def test_shrinkage_is_undone():
    size = (40.0, 10.0, 10.0)
    pathlib.Path("part.stl").write_bytes(ascii_stl(box_triangles(size)))
    pathlib.Path("s.toml").write_text(
        'material = "steel"\nmodel = "quadratic"\n[thermal]\nchange = "-500 K"\n[[fix]]\nwhere = "xmin"\naxes = "x"\n'
        '[[fix]]\nwhere = "ymin"\naxes = "y"\n[[fix]]\nwhere = "zmin"\naxes = "z"\n')
    expect_ok(run("flexel", "compensate", "part.stl", "--scene", "s.toml", "--size", "2.5mm", "-o", "make.obj"))
    longest = max(float(line.split()[1]) for line in pathlib.Path("make.obj").read_text().splitlines() if line.startswith("v "))
    expect(abs(longest - 40 / (1 - 12e-6 * 500)) < 1e-3, f"{longest} mm long")


def test_what_cannot_be_is_one_line():
    pathlib.Path("shelf.stl").write_bytes(ascii_stl(box_triangles((80.0, 10.0, 3.0))))
    expect_error(run("flexel", "compensate", "shelf.stl", *SAG, "--size", "1.5mm"), "flexel", "-o")
    done = run("flexel", "compensate", "shelf.stl", "--fix", "xmin", "--move", "xmax: 100 0 0 mm", "--material", "PLA", "--size", "3mm", "-o", "make.stl")
    expect_error(done, "flexel", "fold")  # twice as long from no length at all
    expect(not pathlib.Path("make.stl").exists(), "a part was written")


def test_stages_warn():
    size = (40.0, 10.0, 10.0)
    pathlib.Path("box.stl").write_bytes(ascii_stl(box_triangles(size)))
    scene = ["--fix", "xmin", "--push", "xmax: 0 0 -1500 N", "--material", "PLA", "--model", "quadratic", "--size", "4mm"]
    deformed = expect_ok(run("flexel", "deform", "box.stl", *scene, "-o", "bent.stl", "--no-estimate"))
    expect("warning: " in deformed.err and "matter is strained by" in deformed.err, deformed)
    done = run("flexel", "compensate", "box.stl", *scene, "-o", "make.stl", "--quiet")
    told = [line for line in done.err.splitlines() if "matter is strained by" in line]
    expect(len(told) == 1 and told[0].startswith("flexel: warning: "), done)


def test_what_was_healed_is_said_once():
    pathlib.Path("shelf.stl").write_bytes(ascii_stl(box_triangles((80.0, 10.0, 3.0))[:-1]))  # a triangle is missing
    done = expect_ok(run("flexel", "compensate", "shelf.stl", *SAG, "--size", "3mm", "-o", "make.stl", "--quiet"))
    expect(sum("healed" in line for line in done.err.splitlines()) == 1, done)


def test_a_worse_part_is_not_written():
    pathlib.Path("column.stl").write_bytes(ascii_stl(box_triangles((100.0, 4.0, 4.0))))
    column = ["--fix", "xmin", "--push", "xmax: -14 0.01 0 N", "--material", "PLA", "--size", "2mm"]
    done = run("flexel", "compensate", "column.stl", *column, "--model", "quadratic", "-o", "make.stl", "--summary", "s.json")
    expect_error(done, "flexel", "remain", code=3)
    expect("--model" not in done.err, done)  # it has that
    expect_only("column.stl")


def test_runs_in_time_are_refused():
    pathlib.Path("shelf.stl").write_bytes(ascii_stl(box_triangles((80.0, 10.0, 3.0))))
    scene = 'material = "PLA"\n[[fix]]\nwhere = "xmin"\n[gravity]\nacceleration = ["0 m/s2", "0 m/s2", "-9.81 m/s2"]\n'
    for name, more, word in (("contact", "[contact]\n", "[contact]"), ("rigid", "[parts.shelf]\nrigid = true\n", "rigid parts"),
                             ("timed", '[run]\ntime = "1 s"\n', "timed run")):
        pathlib.Path(f"{name}.toml").write_text(scene + more)
        done = run("flexel", "compensate", "shelf.stl", "--scene", f"{name}.toml", "--size", "3mm", "-o", "make.stl")
        expect_error(done, "flexel", f"{name}.toml", word, "equilibrium")
    pathlib.Path("pushed.toml").write_text(scene + '[[indenter]]\nball = { centre = ["40 mm", "5 mm", "10 mm"], radius = "6 mm" }\n')
    done = run("flexel", "compensate", "shelf.stl", "--scene", "pushed.toml", "--size", "3mm", "-o", "make.stl")
    expect_error(done, "flexel", "pushed.toml", "[[indenter]]")


def test_a_part_on_stdout_is_refused():
    pathlib.Path("shelf.stl").write_bytes(ascii_stl(box_triangles((80.0, 10.0, 3.0))))
    done = run("flexel", "compensate", "shelf.stl", *SAG, "--size", "3mm", "-o", "-")
    expect_error(done, "flexel", "-o -", "make.stl")
    expect("--format" not in done.err, done)


def test_a_side_is_that_of_the_shape_that_is_wanted():
    """The top of a shelf that is made bent up would be its tip: what presses on "zmax" presses on the whole top, as on the face by its number."""
    size = (80.0, 10.0, 3.0)
    pathlib.Path("shelf.stl").write_bytes(ascii_stl(box_triangles(size)))
    how = ["--fix", "xmin", "--material", "PLA", "--model", "quadratic", "--size", "3mm", "--ascii", "--quiet"]
    faces = re.findall(r"(\S+/\d+) .*normal \+z", expect_ok(run("flexel", "info", "shelf.stl")).out.decode())
    for where, out in (("zmax", "side.stl"), (faces[0], "face.stl")):
        expect_ok(run("flexel", "compensate", "shelf.stl", *how, "--push", f"{where}: 0 0 -2 N", "-o", out, "--summary", "s.json"))
        expect(json.loads(pathlib.Path("s.json").read_text())["remaining_share"] < 0.01, where)
    apart = max(math.dist(a, b) for a, b in zip(vertices("side.stl"), vertices("face.stl")))
    expect(apart < 1e-5, f"{apart} mm")
    made = expect_ok(run("flexel", "compensate", "shelf.stl", *how, "-o", "make.vtu", "--push", "zmax: 0 0 -2 N"))
    expect(b"side_places" not in pathlib.Path("make.vtu").read_bytes(), made)


if __name__ == "__main__":
    main(globals())

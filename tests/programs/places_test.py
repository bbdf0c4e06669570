"""A place that a scene names is of the matter there, whatever rounding, gaps under a cell and other parts' cells make of it."""

import json
import pathlib

from harness import ascii_stl, box_triangles, expect, expect_error, expect_ok, main, run, scene, shell, write
from shapes import turn, turned

LOAD = """material = "steel"
bond = false
[[fix]]
where = "left/xmin"
[[fix]]
where = "right/xmax"
[[load]]
where = "left/ymax"
force = [0, "-100 N", 0]
[[load]]
where = "right/ymax"
force = [0, "1000 N", 0]
"""


def summary(text, body):
    expect_ok(run("flexel-simulate", scene("s.toml", text), body, "-o", "o.vtu", "--summary", "s.json", "--no-estimate"))
    return json.loads(pathlib.Path("s.json").read_text())


def probe(name, *at):
    return f'[[probe]]\nname = "{name}"\nat = [{", ".join(f"{chr(34)}{x} mm{chr(34)}" for x in at)}]\n'


def boxes(name, *boxes_of_parts):
    """An STL of boxes: (name of the part, where it begins, where it ends) along x."""
    text = b""
    for part, begin, end in boxes_of_parts:
        text += ascii_stl([[(x + begin, y, z) for x, y, z in triangle] for triangle in box_triangles((end - begin, 20.0, 10.0))], part)
    return write(name, text)


def test_a_box_from_plane_to_plane_holds_both():
    """The lattice's planes are the box's sides: how the part lies decides nothing."""
    found = []
    for degrees, axis in ((0, (0, 0, 1)), (90, (0, 0, 1)), (90, (1, 0, 0)), (120, (1, 1, 1)), (240, (1, 1, 1))):
        rotation = turn(degrees, axis)
        triangles = [[turned(rotation, corner) for corner in triangle] for triangle in box_triangles((60.0, 20.0, 10.0))]
        write("bar.stl", ascii_stl(triangles))
        expect_ok(run("flexel-voxelize", "bar.stl", "--size", "2.5 mm", "-o", "bar.vtu"))
        corners = (turned(rotation, (0, 0, 0)), turned(rotation, (10, 20, 10)))
        low, high = ([f"{round(pick(pair), 6)} mm" for pair in zip(*corners)] for pick in (min, max))
        end = "xyz"[max(range(3), key=lambda i: abs(rotation[i][0]))] + "max"
        force = [f"{round(-100 * row[2])} N" for row in rotation]
        text = f'material = "steel"\n[[fix]]\nwhere = {{ box = {{ min = {low}, max = {high} }} }}\n'
        found.append(summary(text + f'[[load]]\nwhere = "{end}"\nforce = {force}\n', "bar.vtu"))
    free = {each["unknowns"] for each in found}
    expect(free == {3 * 20 * 9 * 5}, f"five planes of 9 x 5 elements are held of 25: {free}")
    far = [each["largest_displacement"] for each in found]
    expect(max(far) < min(far) * (1 + 1e-5), f"the part bends alike however it lies: {far}")


def test_a_probe_is_of_the_part_that_it_lies_in():
    """The last cells of the left part reach into the right one."""
    boxes("two.stl", ("left", 0, 29), ("right", 29.3, 60))
    for options, model in ((), "cells"), (("--moments",), "quadratic"), ((), "springs"), (("--placement", "centre"), "paper"):
        expect_ok(run("flexel-voxelize", "two.stl", "--size", "2.5 mm", "--align", "none", "-o", "two.vtu", *options))
        probes = probe("left", 28.9, 10, 5) + probe("first", 29.31, 10, 5) + probe("second", 29.5, 10, 5) + probe("third", 32.5, 10, 5)
        found = summary(f'model = "{model}"\n' + LOAD + probes, "two.vtu")["probes"]
        left, *right = (each["displacement"][1] for each in found)
        expect(left < 0 and all(y > 0 for y in right), f"{model}: the left part goes down, the right one up: {found}")
    boxes("two.stl", ("left", 0, 30), ("right", 30, 60))  # they touch
    expect_ok(run("flexel-voxelize", "two.stl", "--size", "2.5 mm", "-o", "two.vtu"))
    found = summary(LOAD + probe("left", 29.99, 10, 5) + probe("right", 30.01, 10, 5), "two.vtu")["probes"]
    expect(found[0]["displacement"][1] < 0 < found[1]["displacement"][1], f"on either side of the plane: {found}")
    write("points.csv", "x,y,z\n29.9,10,5\n30.1,10,5\n31,10,5\n")
    expect_ok(run("flexel-map", "o.vtu", "--points", "points.csv", "-o", "moved.csv"))
    moved = [float(line.split(",")[1]) - 10 for line in pathlib.Path("moved.csv").read_text().split()[1:]]
    expect(moved[0] < 0 < min(moved[1:]), f"points of a table likewise: {moved}")


def leaves(low=4.0, high=4.6, y=10.0, root=10.0):
    """Two leaves on one root, with a slit from z = low to high between them."""
    outline = [(0, 0), (60, 0), (60, low), (root, low), (root, high), (60, high), (60, 8.6), (0, 8.6)]
    lines = [f"v {x} {at} {z}" for at in (0, y) for x, z in outline]
    lines += ["f 1 2 3 4 5 6 7 8", "f 16 15 14 13 12 11 10 9"]
    lines += [f"f {i + 1} {i + 9} {(i + 1) % 8 + 9} {(i + 1) % 8 + 1}" for i in range(8)]
    write("leaves.obj", "\n".join(lines) + "\n")


UPPER_IS_PUSHED = 'material = "steel"\n[[fix]]\nwhere = "xmin"\n[[load]]\nwhere = "zmax"\nforce = [0, 0, "50 N"]\n'


def moved_points(points):
    """z displacements [mm] of points, by flexel-map."""
    write("points.csv", "x,y,z\n" + "".join(f"{x!r},{y!r},{z!r}\n" for x, y, z in points))
    expect_ok(run("flexel-map", "o.vtu", "--points", "points.csv", "-o", "moved.csv"))
    lines = pathlib.Path("moved.csv").read_text().split()[1:]
    return [float(line.split(",")[2]) - point[2] for line, point in zip(lines, points)]


def test_probes_and_points_are_of_the_wall_that_they_lie_in():
    """Two leaves, nearer to each other than a cell: that which is pushed moves, the other hardly."""
    leaves()
    heights = (.01, 2, 3.99, 4.61, 4.8, 6, 8.59)
    for size in ("2 mm", "3 mm", "4 mm"):
        for options, model in ((), "cells"), (("--moments",), "quadratic"):
            expect_ok(run("flexel-voxelize", "leaves.obj", "--size", size, "-o", "leaves.vtu", *options))
            for y in (0, 5):
                probes = "".join(probe(f"at {z}", 60, y, z) for z in heights)
                found = summary(f'model = "{model}"\n' + UPPER_IS_PUSHED + probes, "leaves.vtu")["probes"]
                moved = [each["displacement"][2] for each in found]
                expect(max(moved[:3]) < .3 * min(moved[3:]), f"{model}, {size}: the lower leaf rests, the upper one goes up: {moved}")
                mapped = moved_points([(60, y, z) for z in heights])
                expect(max(mapped[:3]) < .3 * min(mapped[3:]), f"{model}, {size}: and so do points of a table: {mapped}")


def test_probes_and_points_in_slivers_go_with_the_matter_there():
    """Of the lower leaf's top too little is in the voxels that hold the upper leaf for a cell of its own."""
    leaves(low=4.03, high=4.7, y=8.0)
    expect_ok(run("flexel-voxelize", "leaves.obj", "--size", "4 mm", "--align", "none", "-o", "leaves.vtu"))
    points = [(x, y, z) for x in (22.0, 39.0, 58.0) for y in (1.0, 4.5) for z in (3.9, 4.01, 4.03, 4.72, 6.0)]
    probes = "".join(probe(f"p {i}", *point) for i, point in enumerate(points))
    found = [each["displacement"][2] for each in summary(UPPER_IS_PUSHED + probes, "leaves.vtu")["probes"]]
    mapped = moved_points(points)
    for at in range(0, len(points), 5):
        expect(max(found[at:at + 3]) < .3 * min(found[at + 3:at + 5]), f"probes at {points[at]}: {found[at:at + 5]}")
        expect(max(mapped[at:at + 3]) < .3 * min(mapped[at + 3:at + 5]), f"points at {points[at]}: {mapped[at:at + 5]}")


def test_places_at_odds_are_refused():
    boxes("bar.stl", ("bar", 0, 60))
    expect_ok(run("flexel-voxelize", "bar.stl", "--size", "5 mm", "-o", "bar.vtu"))
    start = '{ box = { min = ["-1 mm", "-1 mm", "-1 mm"], max = ["6 mm", "21 mm", "11 mm"] } }'

    def refused(text, *fragments):
        scene("s.toml", 'material = "steel"\n' + text)
        expect_error(run("flexel-simulate", "s.toml", "bar.vtu", "-o", "o.vtu"), "flexel-simulate", *fragments)

    move = f'[[move]]\nwhere = {start}\ndisplacement = ["1 um", 0, 0]\n'
    refused('[[fix]]\nwhere = "xmin"\n' + move, "s.toml:2", "a [[move]] of elements leads 100 % of the place that is held")
    refused(move + '[[move]]\nwhere = "xmin"\ndisplacement = ["2 um", 0, 0]\n', "a [[move]] of elements leads 100 %", "is to move")
    refused('[[fix]]\nwhere = "xmin"\n[[load]]\nwhere = "xmax"\nforce = [0, 0, "-1 N"]\n[[probe]]\nname = "p"\n'
            f'where = ["xmax", {start}]\n', 'probe "p" mixes surface and elements; write two probes')
    held = '[[fix]]\nwhere = "xmin"\n'
    for same in ('[[fix]]\nwhere = "xmin"\naxes = "yz"\n' + move,
                 move + '[[move]]\nwhere = "xmin"\ndisplacement = ["1 um", 0, 0]\n', held):
        expect_ok(run("flexel-simulate", scene("s.toml", 'material = "steel"\n' + same), "bar.vtu", "-o", "o.vtu", "--no-estimate", "--force"))
    narrow = move.replace("6 mm", "5.5 mm")  # 5 mm of 60: a smaller share of the place is a warning
    done = expect_ok(run("flexel-simulate", scene("s.toml", 'material = "steel"\n[[fix]]\nwhere = "zmin"\n' + narrow), "bar.vtu", "-o", "o.vtu", "--force"))
    expect("warning: s.toml:2: " in done.err and "a [[move]] of elements leads 8" in done.err and "neither gets its way" in done.err, done.err)
    hot = '[[temperature]]\nwhere = "xmin"\nname = "hot"\nvalue = "100 degC"\n'
    heat = held + '[thermal]\nreference = "20 degC"\n' + hot
    refused(heat + '[[temperature]]\nwhere = ["xmin", "ymin"]\nname = "cold"\nvalue = "50 degC"\n', '"cold" and "hot"', "two temperatures")
    refused(heat + '[[heat]]\nwhere = "xmin"\nname = "in"\npower = "5 W"\n', '"in" does nothing', "select another face")
    refused(held + '[thermal]\nchange = "10 K"\n' + hot, 'reference = "20 degC"')


def test_stiffness_by_moves_of_one_name():
    """flexel compare: what the moves take, and not what supports of the same name do, nor one of them twice."""
    boxes("bar.stl", ("bar", 0, 60))
    scene("s.toml", 'material = "steel"\n[[fix]]\nwhere = "xmin"\n'
          '[[fix]]\nwhere = "xmax"\naxes = "yz"\n[[move]]\nwhere = "xmax"\ndisplacement = ["1 um", "free", "free"]\n'
          '[[load]]\nwhere = "ymax"\nforce = [0, "1000 N", 0]\n')
    found = shell("flexel compare bar.stl bar.stl --scene s.toml --size 5mm --json")
    force = json.loads(expect_ok(found).out)["parts"][0]["force"]
    stretch = 210e9 * 2e-4 * 1e-6 / .06
    expect(abs(force / stretch - 1) < .1, f"E A / L u = {stretch} N wanted, found {force}")


if __name__ == "__main__":
    main(globals())

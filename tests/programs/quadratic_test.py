"""Model `quadratic` through the whole chain: thin and slanted walls against references, the mapped surface, what is refused."""

import json
import math
import pathlib

from harness import expect, expect_error, expect_ok, main, run, write

MATERIAL = """material = "gum"
model = "quadratic"
[materials.gum]
young = "1 MPa"
poisson = {poisson}
density = "1000 kg/m3"
"""
HELD = """[[fix]]
where = "held"
[[load]]
where = "end"
force = ["{0:.12g} N", "{1:.12g} N", "{2:.12g} N"]
[[probe]]
name = "end"
where = "end"
"""


def turn(degrees, axis=(1, 2, 3)):
    """Rotation matrix (Rodrigues)."""
    length, angle = math.hypot(*axis), math.radians(degrees)
    x, y, z = (each / length for each in axis)
    c, s = math.cos(angle), math.sin(angle)
    return [[c + x * x * (1 - c), x * y * (1 - c) - z * s, x * z * (1 - c) + y * s],
            [y * x * (1 - c) + z * s, c + y * y * (1 - c), y * z * (1 - c) - x * s],
            [z * x * (1 - c) - y * s, z * y * (1 - c) + x * s, c + z * z * (1 - c)]]


def turned(rotation, point):
    return [sum(a * b for a, b in zip(row, point)) for row in rotation]


def bar(name, sizes, degrees=0, gaps=()):
    """OBJ of a bar along x, turned, with groups held (x = 0), end and side; and copies of it shifted along z by each of `gaps`."""
    rotation, lines, first = turn(degrees), [], 1
    x, y, z = sizes
    for shift in (0, *gaps):
        for c in (0, z):
            for b in (0, y):
                for a in (0, x):
                    lines.append("v {:.15g} {:.15g} {:.15g}".format(*turned(rotation, (a, b, c + shift))))
        quads = {"held": [(0, 4, 6, 2)], "end": [(1, 3, 7, 5)], "side": [(0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)]}
        for group, faces in quads.items():
            lines += [f"g {group}"] + ["f " + " ".join(str(i + first) for i in face) for face in faces]
        first += 8
    return write(name, "\n".join(lines) + "\n"), rotation


def deflection(part, size, scene, *options):
    write("scene.toml", scene)
    expect_ok(run("flexel-voxelize", part, "--size", size, "--align", "none", "--moments", "-o", "body.vtu"))
    done = expect_ok(run("flexel-simulate", "scene.toml", "body.vtu", "-o", "bent.vtu", "--summary", "s.json", *options))
    return json.loads(pathlib.Path("s.json").read_text()), done


def work(summary, direction):
    return sum(a * b for a, b in zip(summary["probes"][0]["displacement"], direction))


# 2 x .5 x .5, E = 1: 528.2 (nu .3) and 519.1 (nu .45) by CalculiX's C3D20R, extrapolated
def turned_beam(poisson, reference, cells, within):
    part, rotation = bar("beam.obj", (200, 50, 50), 33)
    force = 1e-4
    direction = turned(rotation, (0, 0, 1))
    scene = MATERIAL.format(poisson=poisson) + HELD.format(*(force * each for each in direction))
    summary, _ = deflection(part, f"{50 / cells} mm", scene, "--no-estimate")
    error = work(summary, direction) / (reference * force / (1e6 * 0.1)) - 1
    expect(abs(error) < within, f"{cells} cells, nu {poisson}: {100 * error:+.2f} %")
    load = math.hypot(*summary["loads"][0]["force"])
    expect(math.hypot(*summary["imbalance"]) < 1e-6 * load, summary["imbalance"])


def test_turned_beam_of_one_cell():
    turned_beam(0.3, 528.2, 1, 0.02)


def test_turned_beam_of_two_cells():
    turned_beam(0.3, 528.2, 2, 0.007)


def test_turned_beam_nearly_incompressible():
    turned_beam(0.45, 519.1, 2, 0.02)


def test_wall_a_quarter_of_a_cell_thick():
    """16 x 4 x t, cells of 1, t = 1/4, turned; reference: 4009 t^-3 (C3D20R, notes of the study: some 4000)."""
    part, rotation = bar("strip.obj", (160, 40, 2.5), 33)
    force = 1e-8
    direction = turned(rotation, (0, 0, 1))
    scene = MATERIAL.format(poisson=0.3) + HELD.format(*(force * each for each in direction))
    summary, _ = deflection(part, "10 mm", scene, "--no-estimate")
    beam = 4 * 16**3 / 4 / 0.25**3  # F L^3 / (3 E I) with I = 4 t^3 / 12
    ratio = work(summary, direction) / (beam * force / (1e6 * 0.01))
    expect(0.93 < ratio < 1.0, f"{ratio} of the slender beam")  # a wide strip is stiffer at its clamp


def test_strips_that_do_not_touch_are_not_welded():
    """Two strips a quarter of a cell apart, both loaded, bend as one alone under half the load."""
    alone, rotation = bar("one.obj", (160, 40, 10), 0)
    pair, _ = bar("two.obj", (160, 40, 10), 0, (12.5,))
    single = deflection(alone, "10 mm", MATERIAL.format(poisson=0.3) + HELD.format(0, 0, 1e-6), "--no-estimate")[0]
    both = deflection(pair, "10 mm", MATERIAL.format(poisson=0.3) + HELD.format(0, 0, 2e-6), "--no-estimate")[0]
    ratio = both["probes"][0]["displacement"][2] / single["probes"][0]["displacement"][2]
    expect(abs(ratio - 1) < 0.05, f"{ratio}")


def test_the_mapped_surface_is_the_field():
    part, rotation = bar("beam.obj", (200, 50, 50), 33)
    direction = turned(rotation, (0, 0, 1))
    scene = MATERIAL.format(poisson=0.3) + HELD.format(*(1e-3 * each for each in direction))
    summary, _ = deflection(part, "40 mm", scene, "--no-estimate")
    done = expect_ok(run("flexel-map", "bent.vtu", "-o", "bent.obj", "--report", "r.json"))
    report = json.loads(pathlib.Path("r.json").read_text())
    expect(report["method"] == "shape-functions", report["method"])
    vertices = lambda name: [[1e-3 * float(word) for word in line.split()[1:4]] for line in open(name) if line.startswith("v ")]
    moved = [[b - a for a, b in zip(*pair)] for pair in zip(vertices("beam.obj"), vertices("bent.obj"))]
    held, end = [0, 2, 4, 6], [1, 3, 5, 7]
    tip = sum(sum(a * b for a, b in zip(moved[v], direction)) for v in end) / 4
    asked = work(summary, direction)
    expect(abs(tip / asked - 1) < 0.01, f"{tip} mapped, {asked} probed")
    expect(max(math.hypot(*moved[v]) for v in held) < 0.02 * tip, "held vertices stay")
    largest = max(math.hypot(*each) for each in moved)
    expect(abs(largest / summary["largest_displacement"] - 1) < 1e-3, f"{largest}, {summary['largest_displacement']}")
    expect(done.code == 0, done)


def test_deform_takes_the_model():
    part, _ = bar("beam.obj", (200, 50, 50), 33)
    write("s.toml", MATERIAL.format(poisson=0.3) + HELD.format(0, 0, 1e-4))
    expect_ok(run("flexel", "deform", part, "--scene", "s.toml", "--size", "25 mm", "-o", "bent.stl", "--summary", "s.json"))
    found = json.loads(pathlib.Path("s.json").read_text())
    expect(found["map"]["method"] == "shape-functions", found["map"])
    bars = found["simulate"]["error_bars"]
    expect(bars.get("bars"), bars)
    expect_ok(run("flexel", "deform", part, "--model", "quadratic", "--material", "steel", "--fix", "held", "--push", "end: 0 0 -10 N", "--size",
                  "50 mm", "-o", "pushed.stl"))


def test_a_body_without_moments_is_refused():
    part, _ = bar("beam.obj", (200, 50, 50), 33)
    write("s.toml", MATERIAL.format(poisson=0.3) + HELD.format(0, 0, 1e-4))
    expect_ok(run("flexel-voxelize", part, "--size", "50 mm", "--align", "none", "-o", "body.vtu"))
    expect_error(run("flexel-simulate", "s.toml", "body.vtu", "-o", "bent.vtu"), "flexel-simulate", "voxelize with --moments")


def test_too_large_a_load_is_refused():
    part, _ = bar("beam.obj", (200, 50, 50), 33)
    write("s.toml", MATERIAL.format(poisson=0.3) + HELD.format(0, 0, 50))
    expect_ok(run("flexel-voxelize", part, "--size", "50 mm", "--align", "none", "--moments", "-o", "body.vtu"))
    expect_error(run("flexel-simulate", "s.toml", "body.vtu", "-o", "bent.vtu"), "flexel-simulate", "is linear", "model \"cells\"", code=3)


if __name__ == "__main__":
    main(globals())

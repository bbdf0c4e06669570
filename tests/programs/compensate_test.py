"""flexel compensate, judged from outside: what it says is made, is run through flexel deform on another lattice."""

import json
import math
import pathlib

from harness import ascii_stl, box_triangles, expect, expect_error, expect_ok, main, run

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
    expect_ok(run("flexel", "compensate", "shelf.stl", *SAG, "--size", "1.5mm", "-o", "make.stl", "--ascii", "--summary", "s.json"))
    told = json.loads(pathlib.Path("s.json").read_text())
    largest = 1e3 * told["largest_displacement"]
    expect(largest > 0.3, f"it hardly sags: {largest} mm")
    expect(told["remaining_share"] < 0.01, told)
    made = vertices("make.stl")
    expect(max(z for _, _, z in made) > 3 + 0.5 * largest, "nothing was bent up")
    expect_ok(run("flexel", "deform", "make.stl", *SAG, "--size", "1.3mm", "-o", "back.stl", "--ascii", "--keep-vertices", "--no-estimate"))
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


if __name__ == "__main__":
    main(globals())

"""flexel coarsen: 2 x 2 x 2 elements as one, of model `paper` with their state, of cells at rest."""

import json

from harness import binary_stl, box_triangles, expect, expect_error, expect_ok, main, run, scene, write

BENT = """material = "gum"
[materials.gum]
young = "1 MPa"
poisson = 0.25
density = "1000 kg/m3"
[[fix]]
where = "xmin"
[[load]]
where = "xmax"
force = [0, 0, "-0.2 N"]
[[probe]]
name = "end"
where = "xmax"
"""


def voxelized(placement, size, name):
    write("bar.stl", binary_stl(box_triangles((80.0, 16.0, 16.0))))
    expect_ok(run("flexel-voxelize", "bar.stl", "--size", size, "--align", "none", "--placement", placement, "-o", name, "--quiet"))


def ended(body):
    expect_ok(run("flexel-simulate", scene("bent.toml", BENT), body, "-o", "out.vtu", "--summary", "out.json", "--quiet", "--force"))
    with open("out.json", encoding="utf-8") as text:
        found = json.load(text)
    return found["elements"], found["mass"], found["probes"][0]["displacement"][2]


def test_even_bars_become_those_of_twice_the_size():
    """Where every group is whole, what is made is what a voxelizer makes of twice the size."""
    for placement in ("centre", "corner"):
        voxelized(placement, "2 mm", "fine.vtu")
        voxelized(placement, "4 mm", "coarse.vtu")
        done = expect_ok(run("flexel", "coarsen", "fine.vtu", "-o", "made.vtu"))
        expect("elements of 2 mm became" in done.err, done.err)
        made, coarse = ended("made.vtu"), ended("coarse.vtu")
        expect(made[0] == coarse[0] and abs(made[1] / coarse[1] - 1) < 1e-12 and abs(made[2] / coarse[2] - 1) < 1e-6, f"{placement}: {made} {coarse}")


def test_twice_and_through_pipes():
    voxelized("centre", "2 mm", "fine.vtu")
    expect_ok(run("flexel", "coarsen", "fine.vtu", "-o", "once.vtu", "--quiet"))
    expect_ok(run("flexel", "coarsen", "once.vtu", "-o", "twice.vtu", "--quiet"))
    piped = expect_ok(run("flexel", "coarsen", "--times", "2", "--quiet", stdin=open("fine.vtu", "rb")))
    with open("twice.vtu", "rb") as twice:
        expect(piped.out == twice.read(), "twice is not two times")


def test_a_deformed_body_keeps_its_state():
    voxelized("centre", "2 mm", "fine.vtu")
    before = ended("fine.vtu")
    expect_ok(run("flexel", "coarsen", "out.vtu", "-o", "made.vtu", "--quiet"))
    expect_ok(run("flexel-map", "made.vtu", "-o", "made.stl", "--quiet"))
    after = ended("made.vtu")
    expect(abs(after[1] / before[1] - 1) < 1e-12 and 0.5 < after[2] / before[2] < 2, f"{before} {after}")
    voxelized("corner", "2 mm", "fine.vtu")
    ended("fine.vtu")
    expect_error(run("flexel", "coarsen", "out.vtu", "-o", "no.vtu"), "flexel", "coarsened at rest")


def test_cells_at_rest_are_mapped_and_carved_ones_refused():
    voxelized("corner", "2 mm", "fine.vtu")
    expect_ok(run("flexel", "coarsen", "fine.vtu", "-o", "made.vtu", "--quiet"))
    expect_ok(run("flexel-map", "made.vtu", "-o", "made.stl", "--quiet"))
    carve = '[[event]]\ndo = "carve"\nwhere = { sphere = { centre = ["40 mm", "8 mm", "16 mm"], radius = "5 mm" } }\n'
    bare = "\n".join(line for line in BENT.splitlines() if not line.startswith(("[[load", "force"))).replace('where = "xmax"\n[[probe', "[[probe")
    expect_ok(run("flexel-simulate", scene("carved.toml", bare + "\n" + carve), "fine.vtu", "-o", "carved.vtu", "--quiet", "--force"))
    expect_error(run("flexel", "coarsen", "carved.vtu", "-o", "no.vtu"), "flexel", "carved")


def test_what_it_refuses():
    voxelized("corner", "4 mm", "fine.vtu")
    expect_error(run("flexel", "coarsen", "fine.vtu", "-o", "fine.vtu"), "flexel", "--force")
    expect_error(run("flexel", "coarsen", "fine.vtu", "--times", "0", "-o", "o.vtu"), "flexel", "--times")
    expect_error(run("flexel", "coarsen", "missing.vtu", "-o", "o.vtu"), "flexel", "missing.vtu")
    expect_error(run("flexel", "coarsen", "bar.stl", "-o", "o.vtu"), "flexel", "bar.stl")


if __name__ == "__main__":
    main(globals())

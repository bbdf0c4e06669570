"""[run] modes and [run] buckling from the outside: closed forms, scaling, turning, rigid motions, loads, and what is refused."""

import json
import math
import pathlib

from harness import expect, expect_error, expect_ok, main, run, write
from shapes import binary_stl, box_triangles, obj_bar

SCENE = """material = "it"
model = "{model}"
[materials.it]
young = "{young} GPa"
poisson = {poisson}
density = "{density} kg/m3"
[run]
{asks}
"""
HELD = '[[fix]]\nwhere = "held"\n'


def along(force):
    return f'[[load]]\nwhere = "end"\nforce = ["{force} N", "0 N", "0 N"]\n'


def scene(asks, *more, model="quadratic", young=200, poisson=0.3, density=8000):
    return SCENE.format(model=model, young=young, poisson=poisson, density=density, asks=asks) + "".join(more)


def voxels(part, size, *options):
    expect_ok(run("flexel-voxelize", part, "--size", size, "--align", "none", "--moments", *options, "-o", "body.vtu"))


def solve(text, *options, output="out.vtu"):
    write("scene.toml", text)
    expect_ok(run("flexel-simulate", "scene.toml", "body.vtu", "-o", output, "--summary", "s.json", *options))
    summary = json.loads(pathlib.Path("s.json").read_text())
    return summary["shapes"], summary


def frequencies(text):
    return [mode["frequency"] for mode in solve(text)[0]["modes"]]


def beam(sizes=(200, 20, 10), degrees=0):
    return write("beam.obj", obj_bar(sizes, degrees)[0])


def close(found, wanted, within, what):
    for a, b in zip(found, wanted, strict=True):
        expect(abs(a / b - 1) < within, f"{what}: {a:.6g} instead of {b:.6g}")


def test_free_cube():
    """Six rigid motions, and Lame's exact shapes (all faces free of stress, no change of volume): f = sqrt(mu / rho) / (sqrt(2) L), three times
    beside a pair of others."""
    write("cube.stl", binary_stl(box_triangles((100.0, 100.0, 100.0))))
    for model, size, within in (("quadratic", "25 mm", 2e-3), ("cells", "10 mm", 0.02)):
        voxels("cube.stl", size)
        shapes, _ = solve(scene("modes = 16", model=model))
        expect(shapes["rigid"] == 6, shapes["rigid"])
        found = [mode["frequency"] for mode in shapes["modes"]]
        exact = math.sqrt(200e9 / 2.6 / 8000) / math.sqrt(2) / 0.1
        near = sorted(abs(each / exact - 1) for each in found)
        expect(near[1] < within, f"{model}: {found}, none of which is {exact:.5g}")
        close(found[2:4], found[3:5], 1e-4, "three directions are the same")
        for mode in shapes["modes"]:
            expect(max(mode["effective_mass"]) < 1e-9 * 8, "a free body moves along with nothing")


def test_clamped_beam():
    """Timoshenko's cantilever is within 1 % of Bernoulli's first frequency at this slenderness; along it a bar of Poisson's ratio 0 is exact."""
    voxels(beam(), "5 mm")
    found = frequencies(scene("modes = 7", HELD, poisson=0))
    speed = math.sqrt(200e9 / 8000)
    bent = [1.875104**2 / (2 * math.pi) * speed * t / math.sqrt(12) / 0.2**2 for t in (0.01, 0.02)]
    close(found[:2], bent, 0.01, "bending")
    axial = min(found, key=lambda each: abs(each - speed / 0.8))
    close([axial], [speed / 0.8], 2e-3, "along")


def test_frequencies_scale():
    voxels(beam(), "10 mm")
    for model in ("quadratic", "cells"):
        asks = ("modes = 5", HELD)
        usual = frequencies(scene(*asks, model=model))
        close(frequencies(scene(*asks, model=model, young=800, density=2000)), [4 * each for each in usual], 1e-6, "sqrt(E / rho)")
    voxels(beam((400, 40, 20)), "20 mm")
    close(frequencies(scene(*asks, model="cells")), [each / 2 for each in usual], 1e-6, "1 / size")


def test_turned():
    voxels(beam(), "10 mm")
    usual = frequencies(scene("modes = 5", HELD))
    voxels(beam(degrees=33), "10 mm")
    close(frequencies(scene("modes = 5", HELD)), usual, 0.03, "turned by 33 degrees")


def test_effective_masses():
    """Of all shapes they are the mass but for what a support holds; here of 40 of them."""
    voxels(beam(), "20 mm")
    shapes, summary = solve(scene("modes = 40", HELD))
    for axis in range(3):
        sums = [sum(mode["effective_mass"][axis] for mode in shapes["modes"][:count]) for count in (5, 20, 40)]
        expect(sums == sorted(sums) and 0.9 < sums[2] / summary["mass"] <= 1 + 1e-6, f"axis {axis}: {sums} of {summary['mass']}")


def test_stiffness_is_positive_under_loads():
    """A dead load along a cantilever: the exact frequencies of Bernoulli's beam (det of cosh, sinh, cos, sin) are 202.0, 327.5 and 108.3 Hz."""
    voxels(beam(), "5 mm")
    for force, exact, within in ((0, 202.0, 0.01), (40000, 327.5, 0.01), (-15000, 108.3, 0.015)):
        loads = along(force) if force else ""
        shapes, _ = solve(scene("modes = 1", HELD, loads))
        expect(shapes["prestressed"] == (force != 0), shapes)
        close([shapes["modes"][0]["frequency"]], [exact], within, f"{force} N")
    for model in ("quadratic", "cells"):
        write("scene.toml", scene("modes = 1", HELD, along(-25000), model=model))
        expect_error(run("flexel-simulate", "scene.toml", "body.vtu", "-o", "past.vtu"), "flexel-simulate", "stiffness is not positive", code=3)
        expect(not pathlib.Path("past.vtu").exists(), "a result of what failed")


def test_euler_column():
    voxels(beam((400, 20, 10)), "10 mm")
    shapes, _ = solve(scene("buckling = 2", HELD, along(-1), poisson=0))
    bending = 200e9 * 0.02 * 0.01**3 / 12
    close([each["load_factor"] for each in shapes["buckling"]], [bending * (k * math.pi / 0.8)**2 for k in (1, 2)], 0.02, "Euler")
    write("scene.toml", scene("buckling = 1", HELD, along(1)))
    expect_error(run("flexel-simulate", "scene.toml", "body.vtu", "-o", "x.vtu"), "flexel-simulate", "nothing buckles")


def test_series_has_a_frame_for_each_shape():
    voxels(beam(), "10 mm")
    text = scene("modes = 3", HELD, '[[probe]]\nname = "end"\nwhere = "end"\n')
    shapes, _ = solve(text, output="m.pvd")
    frames = sorted(pathlib.Path(".").glob("m_*.vtu"))
    expect(len(frames) == 3 and pathlib.Path("m.pvd").read_text().count("DataSet") == 3, frames)
    largest = shapes["largest_displacement"]
    expect(0.5 * largest < math.hypot(*shapes["modes"][0]["probes"][0]) < 1.001 * largest, shapes)
    expect_ok(run("flexel-map", "m.pvd", "-o", "bent.obj"))
    bent = {path.read_text() for path in pathlib.Path(".").glob("bent_*.obj")}
    expect(len(bent) == 3, f"{len(bent)} different surfaces")


def test_what_is_refused():
    voxels(beam(), "20 mm")
    cases = [(scene("modes = 100000", HELD), "1000"), (scene("modes = 1000", HELD), "more than the body has"),
             (scene('modes = 3\ntime = "1 s"', HELD), "timed run"), (scene("modes = 3\nbuckling = 2", HELD), "give one"),
             (scene("modes = 3\nrenormalise = true", HELD), "renormalise"), (scene("modes = 0", HELD), "whole number"),
             (scene("modes = 3", '[[load]]\nwhere = "end"\nforce = ["1 N", "0 N", "0 N"]\n'), "fix"),
             (scene("modes = 3", HELD, "[contact]\n"), "contact"), (scene("buckling = 1", HELD), "nothing does"),
             (scene("modes = 3", "[parts.beam]\nrigid = true\n"), "has no rigid parts"),
             (scene("buckling = 1", HELD, along(-1), model="cells"), "quadratic")]
    for text, fragment in cases:
        write("scene.toml", text)
        expect_error(run("flexel-simulate", "scene.toml", "body.vtu", "-o", "x.vtu"), "flexel-simulate", fragment)
    write("scene.toml", scene("modes = 3", HELD))
    for option, value in (("--history", "h.csv"), ("--isa", "portable")):
        expect_error(run("flexel-simulate", "scene.toml", "body.vtu", option, value, "-o", "x.vtu"), "flexel-simulate", option)
    expect_error(run("flexel", "deform", "beam.obj", "--scene", "scene.toml", "-o", "x.stl"), "flexel", "flexel-simulate")


def test_two_loose_pieces():
    """Each has six rigid motions, and each shape of one is there twice."""
    near, far = box_triangles((60.0, 20.0, 10.0)), [[(x, y, z + 40) for x, y, z in t] for t in box_triangles((60.0, 20.0, 10.0))]
    for model in ("quadratic", "cells", "springs"):
        counts = []
        for name, triangles in (("one", near), ("two", near + far)):
            write(f"{name}.stl", binary_stl(triangles))
            voxels(f"{name}.stl", "5 mm")
            shapes, _ = solve(scene("modes = 4", model=model, poisson=0.25))
            counts.append((shapes["rigid"], [mode["frequency"] for mode in shapes["modes"]]))
        (alone, usual), (both, found) = counts
        expect((alone, both) == (6, 12), f"{model}: {alone} and {both} rigid motions")
        close(found, [usual[0], usual[0], usual[1], usual[1]], 1e-4, model)


def test_bonded_halves_vibrate_as_the_whole():
    """Parts that touch are bonded: one body with six rigid motions, free, and its frequencies, free and held."""
    for name, low, high in (("whole", 0, 120), ("left", 0, 60), ("right", 60, 120)):
        box = box_triangles((high - low, 20.0, 10.0))
        write(f"{name}.stl", binary_stl([[(x + low, y, z) for x, y, z in t] for t in box]))
    held = '[[fix]]\nwhere = "{}/xmin"\n'
    for model, size, within in (("quadratic", "10 mm", 2e-3), ("cells", "5 mm", 5e-3)):
        found = {}
        for parts in (("whole.stl",), ("left.stl", "right.stl")):
            expect_ok(run("flexel-voxelize", *parts, "--size", size, "--align", "none", "--moments", "-o", "body.vtu"))
            free, _ = solve(scene("modes = 4", model=model))
            expect(free["rigid"] == 6, f"{model}, {parts}: {free['rigid']}")
            clamped = frequencies(scene("modes = 4", held.format(parts[0][:-4]), model=model))
            found[parts] = [mode["frequency"] for mode in free["modes"]] + clamped
        whole, halves = found.values()
        close(halves, whole, within, model)


def test_fused_points_hold():
    """Bars that an earlier run fused over a gap vibrate as one: a single bar of that length is within 3 %."""
    near = box_triangles((40.0, 8.0, 8.0))
    write("near.stl", binary_stl(near))
    write("far.stl", binary_stl([[(x + 40.2, y, z) for x, y, z in t] for t in near]))
    write("one.stl", binary_stl(box_triangles((80.2, 8.0, 8.0))))
    write("fuse.toml", 'material = "steel"\n[run]\ntime = "0.1 us"\n[[event]]\nat = "0 s"\ndo = "fuse"\nwithin = "0.5 mm"\n')
    held = '[[fix]]\nwhere = "xmin"\n'
    asks = scene("modes = 2", held, model="cells")
    expect_ok(run("flexel-voxelize", "one.stl", "--size", "2 mm", "-o", "body.vtu"))
    whole = frequencies(asks)
    expect_ok(run("flexel-voxelize", "near.stl", "far.stl", "--size", "2 mm", "-o", "gap.vtu"))
    expect_ok(run("flexel-simulate", "fuse.toml", "gap.vtu", "-o", "body.vtu"))
    close(frequencies(asks), whole, 0.03, "fused bars")


def test_study_refuses_modes():
    write("scene.toml", scene("modes = 3", '[[fix]]\nwhere = "xmin"\n'))
    write("bar.stl", binary_stl(box_triangles((40.0, 8.0, 8.0))))
    expect_error(run("flexel", "study", "bar.stl", "--scene", "scene.toml", "-o", "s"), "flexel", "[run] modes is for flexel-simulate")


def test_stops_in_time():
    write("cube.stl", binary_stl(box_triangles((100.0, 100.0, 100.0))))
    voxels("cube.stl", "4 mm")
    write("scene.toml", scene("modes = 40", model="cells"))
    done = run("flexel-simulate", "scene.toml", "body.vtu", "-o", "x.pvd", "--timeout", "0.3 s")
    expect(done.code == 5 and not list(pathlib.Path(".").glob("x*")), f"{done}")


def test_bits_do_not_depend_on_threads():
    voxels(beam(), "5 mm")
    text = scene("modes = 4", HELD)
    one = solve(text, "--threads", "1")[0]
    two = solve(text, "--threads", "2")[0]
    expect(one == two, "other figures by two threads")


def test_walls_thinner_than_the_cells_are_told():
    """A strip of 1 mm in cells of 2.5 mm: model cells gives more than twice the frequency."""
    beam((100, 10, 1))
    voxels("beam.obj", "2.5 mm")
    for model, told in (("cells", True), ("quadratic", False)):
        write("scene.toml", scene("modes = 2", model=model))
        said = expect_ok(run("flexel-simulate", "scene.toml", "body.vtu", "-o", "out.vtu")).err
        expect(("walls under 2 cells" in said) == told, f"{model}: {said}")


if __name__ == "__main__":
    main(globals())

"""flexel export --lammps: LAMMPS steps what flexel-simulate steps, and flexel import-lammps brings it back."""

import json
import os
import pathlib

import numpy as np
from files import vtu_arrays
from lammps import run_lammps

from harness import binary_stl, body, box_triangles, expect, expect_error, expect_ok, expect_only, main, need, run, scene, write

os.environ["OMPI_MCA_mpi_yield_when_idle"] = "1"  # ranks that wait leave the processor to others
STEPS = 1000
MATTER = """material = "gum"
model = "MODEL"
[materials.gum]
young = "1.2 MPa"
poisson = 0.25
density = "930 kg/m3"
"""
# All that is exported at once: weight, loads with and without a course, a face that is held, an axis that is, a rotation that
# turns back between two steps, a move with a free axis, and matter that is flung.
ALL = MATTER + """[gravity]
acceleration = ["1 m/s2", 0, "-9.81 m/s2"]
[[fix]]
where = "xmin"
[[fix]]
where = { box = { min = ["15 mm", "-1 mm", "-1 mm"], max = ["35 mm", "6 mm", "6 mm"] } }
axes = "y"
[[move]]
where = { box = { min = ["51 mm", "-1 mm", "-1 mm"], max = ["61 mm", "41 mm", "6 mm"] } }
displacement = ["2 mm", "1 mm", "3 mm"]
rotation = { axis = [0, 1, 0], through = ["60 mm", 0, "10 mm"], angle = "20 deg" }
time = ["0 ms", "30.05 ms", "60 ms"]
factor = [0.1, 1, 0.5]
[[move]]
where = { box = { min = ["15 mm", "31 mm", "21 mm"], max = ["35 mm", "41 mm", "31 mm"] } }
displacement = ["free", "3 mm", "-2 mm"]
[[load]]
where = "zmax"
force = ["0.5 N", "1 N", "-2 N"]
[[load]]
where = "ymax"
force = ["0 N", "1 N", "0 N"]
time = ["0 s", "20.03 ms", "40 ms"]
factor = [0, 1, -1]
[[velocity]]
where = { half_space = { point = ["35 mm", 0, 0], normal = [1, 0, 0] } }
velocity = ["1 m/s", "-1 m/s", "2 m/s"]
[run]
time = "60 ms"
step = "60 us"
frames = 3
method = "METHOD"
"""
DAMPING = """[damping]
time = "20 us"
"""


def lattice(placement="corner", size="10 mm"):
    write("block.stl", binary_stl(box_triangles((60.0, 40.0, 30.0))))
    expect_ok(run("flexel-voxelize", "block.stl", "--size", size, "--align", "none", "--placement", placement, "-o", "rest.vtu"))


def compare(text, processes=1, frames=3, steps=STEPS):
    """Spacings that LAMMPS and flexel-simulate are apart by at most, over all frames, and how far matter has moved."""
    scene("scene.toml", text)
    expect_ok(run("flexel", "export", "rest.vtu", "--scene", "scene.toml", "--lammps", "-o", "run.in", "--summary", "export.json"))
    expect_ok(run("flexel-simulate", "scene.toml", "rest.vtu", "-o", "ours.pvd", "--summary", "ours.json"))
    taken, planned = (json.loads(pathlib.Path(name).read_text(encoding="utf-8")) for name in ("ours.json", "export.json"))
    expect(taken["timed"]["steps"] == planned["run"]["steps"] == steps, f"{steps} steps wanted: {taken['timed']}, {planned['run']}")
    run_lammps("run.in", processes)
    expect_ok(run("flexel", "import-lammps", "run.dump", "run.vtu", "-o", "theirs.pvd"))
    apart = []
    for n in range(frames + 1):
        ours, theirs = (vtu_arrays(f"{who}_{n:05}.vtu")["points/position"] for who in ("ours", "theirs"))
        apart.append(np.linalg.norm(ours - theirs, axis=1).max() / 0.01)
    expect(not os.path.exists(f"theirs_{frames + 1:05}.vtu"), "more frames than ours")
    moved = np.linalg.norm(ours - vtu_arrays("rest.vtu")["points/position"], axis=1).max() / 0.01
    print(f"{processes} process(es): {max(apart):.3g} spacings apart, moved by {moved:.3g}")
    expect(moved > 0.1, f"the test wants motion: {moved} spacings")
    return max(apart)


def agree(model, method, placement="corner", extra="", processes=(1,)):
    need("lmp", *(["mpirun"] if max(processes) > 1 else []))
    lattice(placement)
    for count in processes:
        apart = compare(ALL.replace("MODEL", model).replace("METHOD", method) + extra, count)
        expect(apart < 1e-9, f"{apart} spacings apart after {STEPS} steps")


def test_springs_by_verlet():
    agree("springs", "verlet")
    # the last frame is a body that maps, and goes on
    expect_ok(run("flexel", "import-lammps", "run.dump", "run.vtu", "-o", "last.vtu"))
    for who in ("last", "ours_00003"):
        expect_ok(run("flexel-map", f"{who}.vtu", "-o", f"{who}.stl"))
    last = vtu_arrays("last.vtu")["point/velocity"]
    expect(np.isfinite(last).all() and np.abs(last).max() > 0, "velocities come along")
    from files import any_stl_triangles
    ours, theirs = any_stl_triangles("ours_00003.stl"), any_stl_triangles("last.stl")
    expect(np.abs(ours - theirs).max() < 1e-5, f"mapped, {np.abs(ours - theirs).max()} mm apart")  # STL has single precision
    expect_ok(run("flexel-simulate", "scene.toml", "last.vtu", "-o", "further.vtu"))


def test_springs_by_symplectic_euler():
    agree("springs", "symplectic", processes=(2,))


def test_paper():
    agree("paper", "symplectic", "centre")


def test_damping():
    need("lmp", "mpirun")
    lattice()
    text = ALL.replace("MODEL", "springs").replace("METHOD", "verlet").replace('60 us"', '30 us"').replace('time = "60 ms"\nstep', 'time = "30 ms"\nstep')
    expect(compare(text + DAMPING) < 1e-9, "apart")
    damped = vtu_arrays("ours_00003.vtu")["points/position"]
    scene("bare.toml", text)
    expect_ok(run("flexel-simulate", "bare.toml", "rest.vtu", "-o", "bare.vtu"))
    off = np.linalg.norm(damped - vtu_arrays("bare.vtu")["points/position"], axis=1).max() / 0.01
    expect(off > 1e-3, f"damping changes nothing: {off} spacings")
    short = text.replace("verlet", "symplectic").replace('time = "30 ms"\nstep', 'time = "3 ms"\nstep')
    expect(compare(short + DAMPING, 2, steps=100) < 1e-9, "apart on two ranks")


def test_damping_of_the_paper_that_is_long():
    need("lmp")
    lattice("centre")
    text = ALL.replace("MODEL", "paper").replace("METHOD", "verlet").replace('60 us"', '6 us"').replace('time = "60 ms"\nstep', 'time = "6 ms"\nstep')
    expect(compare(text + DAMPING.replace("20 us", "200 us")) < 1e-9, "apart")


def test_a_part_partly_filled_and_turned():
    need("lmp")
    write("block.stl", binary_stl(box_triangles((60.0, 37.0, 27.0))))
    expect_ok(run("flexel-voxelize", "block.stl", "--size", "10 mm", "--align", "none", "-o", "rest.vtu"))
    text = MATTER.replace("MODEL", "springs") + """[[velocity]]
where = "block"
spin = { axis = [1, 2, 3], through = ["30 mm", "20 mm", "15 mm"], angle_per_second = "3 turn" }
[[load]]
where = "xmax"
force = ["1 N", 0, "1 N"]
time = ["0 ms", "10 ms", "20 ms"]
factor = [0, 1, 0]
[run]
time = "60 ms"
step = "60 us"
frames = 3
method = "verlet"
"""
    expect(compare(text) < 1e-9, "apart")


def test_from_the_part_itself():
    """A part is voxelised, files are named after the output, and the data of an earlier export are not replaced half."""
    write("block.stl", binary_stl(box_triangles((60.0, 40.0, 30.0))))
    scene("scene.toml", ALL.replace("MODEL", "springs").replace("METHOD", "verlet"))
    os.mkdir("out")
    done = expect_ok(run("flexel", "export", "block.stl", "--scene", "scene.toml", "--size", "10 mm", "--lammps", "-o", "out/a run.in", "--json"))
    told = json.loads(done.out)
    expect(told["atoms"] == 140 and told["bonds"] == 1165 and abs(told["mass"] - 930 * 72e-6) < 1e-12, f"{told}")
    expect(told["gravity"] == [1, 0, -9.81] and len(told["loads"]) == 2 and len(told["supports"]) == 4, f"{told}")
    expect_only("a run.data", "a run.in", "a run.vtu", folder="out")
    need("lmp")
    os.chdir("out")
    run_lammps("a run.in")
    expect_ok(run("flexel", "import-lammps", "a run.dump", "a run.vtu", "-o", "end.vtu"))


def test_names_that_lammps_reads_otherwise():
    """What a file's name holds does not become a command, and a name that LAMMPS would change is refused."""
    lattice()
    text = scene("scene.toml", ALL.replace("MODEL", "springs").replace("METHOD", "symplectic").replace('60 ms"\nstep = "60 us', '0.3 ms"\nstep = "30 us') + DAMPING)
    for name in ("a%d", "a*b", "b\u00fc", "a\u00a0b", "a\u201cb", "a\u2212b", "a&", "a$b", 'a"b', "a#b", "a\rb"):
        expect_error(run("flexel", "export", "rest.vtu", "--scene", text, "--lammps", "-o", f"{name}.in"), "flexel", "LAMMPS takes no name")
    for name in ('p"""q', "p &", "$(shell touch written)", "\u201d\u00fc"):
        os.rename("scene.toml", f"{name}.toml")
        expect_ok(run("flexel", "export", "rest.vtu", "--scene", f"{name}.toml", "--lammps", "-o", "it's {a} \\n.in", "--force"))
        os.rename(f"{name}.toml", "scene.toml")
        need("lmp")
        said = run_lammps("it's {a} \\n.in")
        expect("ASCII" not in said and not os.path.exists("written"), said)
        expect_ok(run("flexel", "import-lammps", "it's {a} \\n.dump", "it's {a} \\n.vtu", "-o", "end.vtu"))
        os.remove("it's {a} \\n.dump")


REFUSED = [
    ('[run]\n', "[contact]\nself = true\n[run]\n", "contact"), ('[run]\n', '[drag]\nmedium = "water"\n[run]\n', "drag"),
    ('[run]\n', '[plasticity]\nyield = "1 MPa"\n[run]\n', "plasticity"), ('[run]\n', '[fracture]\nstrength = "1 MPa"\n[run]\n', "fracture"),
    ('[gravity]\n', '[gravity]\nmutual = true\n', "mutual"), ('method = "METHOD"', 'method = "implicit"', "implicit"),
    ('method = "METHOD"', 'method = "explicit"', "explicit"), ('model = "MODEL"', 'model = "cells"', '--model springs'),
    ('force = ["0.5 N", "1 N", "-2 N"]', 'force = ["0.5 N", "1 N", "-2 N"]\nfollower = true', "follower"),
    (ALL[ALL.index("[run]"):], "", "timed runs"), ('[run]\n', '[damping]\ntime = "1 ms"\n[run]\n', "stages"),
    ('[run]\n', '[[event]]\nat = "10 ms"\ncarve = { box = { min = [0, 0, 0], max = ["1 mm", "1 mm", "1 mm"] } }\n[run]\n', "event"),
    ('"20 deg" }', '"20 deg", arc_from = ["0 mm", "0 mm", "10 mm"] }', "arc_from"),
]


def test_what_lammps_lacks_is_refused_by_name():
    lattice()
    for old, new, word in REFUSED:
        text = ALL.replace(old, new, 1)
        expect(text != ALL, old)
        scene("scene.toml", text.replace("MODEL", "springs").replace("METHOD", "verlet"))
        expect_error(run("flexel", "export", "rest.vtu", "--scene", "scene.toml", "--lammps", "-o", "run.in", "--quiet"), "flexel", word)
        expect(not os.path.exists("run.in") and not os.path.exists("run.data"), f"{word}: files are left")


def test_bonded_parts_are_refused():
    box = lambda low: [[[x + low, y, z] for x, y, z in corners] for corners in box_triangles((20.0, 20.0, 20.0))]
    for name, low in (("left", 0.0), ("right", 20.0)):
        write(f"{name}.stl", binary_stl(box(low)))
    head = MATTER.replace("MODEL", "springs")
    ask = ["flexel", "export", "left.stl", "right.stl", "--size", "10 mm", "--scene", "scene.toml", "--lammps", "-o", "run.in", "--quiet"]
    end = '[gravity]\nacceleration = [0, 0, "-9.81 m/s2"]\n[run]\ntime = "1 ms"\nstep = "20 us"\n'
    scene("scene.toml", head + end)
    expect_error(run(*ask), "flexel", "bonds", "bond = false")
    scene("scene.toml", "bond = false\n" + head + end)
    expect_ok(run(*ask))


def test_a_surface_through_cells_is_refused():
    write("block.stl", binary_stl(box_triangles((57.0, 40.0, 30.0))))
    expect_ok(run("flexel-voxelize", "block.stl", "--size", "10 mm", "--align", "none", "-o", "rest.vtu"))
    text = ALL.replace("MODEL", "springs").replace("METHOD", "verlet")
    scene("scene.toml", text.replace('where = "xmin"', 'where = "xmax"').replace("51 mm", "31 mm").replace("61 mm", "41 mm"))
    expect_error(run("flexel", "export", "rest.vtu", "--scene", "scene.toml", "--lammps", "-o", "run.in", "--quiet"), "flexel", "cuts through cells")


def test_options_of_the_wrong_program_are_refused():
    lattice()
    text = scene("scene.toml", ALL.replace("MODEL", "springs").replace("METHOD", "verlet"))
    both = ["flexel", "export", "rest.vtu", "--scene", text, "-o", "run.in"]
    for extra, word in ((["--lammps", "--calculix"], "not both"), ([], "--lammps"), (["--lammps", "--mesh", "tet"], "--mesh"),
                        (["--lammps", "--size", "5 mm"], "--size"), (["--calculix", "--placement", "centre"], "--placement")):
        expect_error(run(*both, *extra), "flexel", word)
    expect_error(run(*both[:-1], "run.inp", "--lammps"), "flexel", "OUT.in")
    expect_error(run(*both[:-1], "rest.in", "--lammps"), "flexel", "--force")  # its body would replace rest.vtu


DUMP = "ITEM: TIMESTEP\n{}\nITEM: NUMBER OF ATOMS\n{}\nITEM: BOX BOUNDS ss ss ss\n0 1\n0 1\n0 1\nITEM: ATOMS id x y z\n"


def test_dumps_of_another_run_are_refused():
    body("rest.vtu")
    positions = vtu_arrays("rest.vtu")["points/position"]
    lines = lambda places: "".join(f"{n} {x!r} {y!r} {z!r}\n" for n, (x, y, z) in enumerate(places.tolist(), 1))
    ask = lambda text, out: (write("run.dump", text), run("flexel", "import-lammps", "run.dump", "rest.vtu", "-o", out))[1]
    count = len(positions)
    good = DUMP.format(0, count) + lines(positions)
    expect_ok(ask(good, "out.vtu"))
    expect_error(ask(DUMP.format(0, count) + lines(positions + 1e-5), "other.vtu"), "flexel", "run.dump", "another run")
    expect_error(ask(DUMP.format(0, count - 1) + lines(positions[1:]), "other.vtu"), "flexel", "run.dump:4", "elements")
    expect_error(ask(good[:-9], "other.vtu"), "flexel", "run.dump", "ends within a frame")
    expect_error(ask(good, "other.pvd"), "flexel", "run.dump", "time yes")
    expect_error(ask(" ", "other.vtu"), "flexel", "no frame")
    expect_error(run("flexel", "import-lammps", "missing.dump", "rest.vtu", "-o", "other.vtu"), "flexel", "missing.dump")
    expect_error(run("flexel", "import-lammps", "rest.vtu", "rest.vtu", "-o", "other.vtu"), "flexel", "rest.vtu")
    expect(not os.path.exists("other.vtu"), "a file is left")
    expect_error(ask(good + good, "other.vtu"), "flexel", "run.dump", "not later")
    expect("at rest" in ask(good, "out.vtu").err and "whatever its name" in ask(good, "out.stl").err, "no warning")
    late = ask(good.replace("TIMESTEP\n0", "TIMESTEP\n5"), "late.vtu")
    expect(late.code == 0 and "step 5" in late.err, f"{late}")
    folded = ask(good + DUMP.format(7, count) + lines(positions * [-1, 1, 1]), "folded.vtu")
    expect(folded.code == 0 and "step 7" in folded.err and "inside out" in folded.err, f"{folded}")


def test_a_dump_of_another_scene_on_the_same_lattice_is_refused():
    need("lmp")
    lattice(size="20 mm")
    flung = '[[velocity]]\nwhere = { half_space = { point = [0, 0, 0], normal = [-1, 0, 0] } }\nvelocity = ["SPEED m/s", 0, 0]\n'
    scenes = [MATTER.replace("MODEL", "springs") + flung.replace("SPEED", str(speed)) + '[run]\ntime = "0.1 ms"\nstep = "10 us"\nframes = 2\n' for speed in (1, 2)]
    def export(number):
        scene("scene.toml", scenes[number])
        expect_ok(run("flexel", "export", "rest.vtu", "--scene", "scene.toml", "--lammps", "-o", "run.in"))
    take = lambda dump, out: run("flexel", "import-lammps", dump, "run.vtu", "-o", out)
    export(0)
    run_lammps("run.in", 1)
    export(1)
    expect_error(take("run.dump", "end.vtu"), "flexel", "run.dump", "another run", "again after an export")
    export(0)
    ended = expect_ok(take("run.dump", "end.vtu"))
    expect("cannot be told" not in ended.err, f"{ended}")
    dump = pathlib.Path("run.dump").read_text(encoding="utf-8")
    head = next(line for line in dump.splitlines() if line.startswith("ITEM: ATOMS"))
    write("bare.dump", "\n".join(line if line.startswith("ITEM: ") or len(line.split()) < 8 else line.rsplit(" ", 1)[0]
                                 for line in dump.replace(head, head.rsplit(" ", 1)[0]).splitlines()) + "\n")
    ended = expect_ok(take("bare.dump", "bare.vtu"))
    expect("no column v_flexel" in ended.err and "cannot be told" in ended.err, f"{ended}")
    ended = expect_ok(run("flexel", "import-lammps", "run.dump", "rest.vtu", "-o", "other.vtu"))
    expect("not the one beside that script" in ended.err, f"{ended}")
    expect("v_flexel" not in pathlib.Path("end.vtu").read_text(encoding="latin-1"), "what goes on from here is another run")


def test_a_series_does_not_replace_its_inputs():
    """By the names of its frames, a link's too; flexel-simulate as well."""
    body("rest.vtu")
    positions = vtu_arrays("rest.vtu")["points/position"]
    write("run.dump", DUMP.format(0, len(positions)).replace("ITEM: TIMESTEP", "ITEM: TIME\n0\nITEM: TIMESTEP") +
          "".join(f"{n} {x!r} {y!r} {z!r}\n" for n, (x, y, z) in enumerate(positions.tolist(), 1)))
    os.rename("rest.vtu", "run_00000.vtu")
    os.symlink("run_00000.vtu", "link_00007.vtu")
    scene("scene.toml", 'material = "rubber"\n[run]\ntime = "0.1 ms"\nframes = 1\n')
    for command in (["flexel", "import-lammps", "run.dump", "run_00000.vtu"], ["flexel-simulate", "scene.toml", "run_00000.vtu"]):
        for series, frame in (("run.pvd", "run_00000.vtu"), ("link.pvd", "link_00007.vtu")):
            expect_error(run(*command, "-o", series), command[0], series, frame, "--force")
        expect_ok(run(*command, "-o", "ru.pvd"))
    expect((vtu_arrays("run_00000.vtu")["points/position"] == positions).all(), "the body was replaced")
    expect_ok(run("flexel", "import-lammps", "run.dump", "run_00000.vtu", "--force", "-o", "run.pvd"))


if __name__ == "__main__":
    main(globals())

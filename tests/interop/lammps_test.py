"""LAMMPS (bond_style harmonic, fix nve) steps the same free lattice of springs and comes to the same place."""

import json
import pathlib

import numpy as np
from lammps import Lattice, read_dump, run_lammps, write_data, write_input

from harness import binary_stl, box_triangles, expect, expect_ok, main, need, run, scene, write

YOUNG, DENSITY, STEPS = 1.2e6, 930, 1000

# One end is flung aside and the whole spins: bending, twisting, stretching by tens of percent, and a large rotation. What is compared
# begins where that has led to, in a deformed state.
MATTER = """material = "gum"
[materials.gum]
young = "1.2 MPa"
poisson = 0.25
density = "930 kg/m3"
[parts.block]
model = "springs"
"""
FLING = MATTER + """[[velocity]]
where = "block"
spin = { axis = [1, 2, 3], through = ["30 mm", "20 mm", "15 mm"], angle_per_second = "20 turn" }
[[velocity]]
where = { half_space = { point = ["45 mm", 0, 0], normal = [1, 0, 0] } }
velocity = ["4 m/s", "-3 m/s", "6 m/s"]
[run]
time = "4 ms"
"""
FREE = MATTER + """[run]
time = "80 ms"
step = "80 us"
method = "METHOD"
"""


def stepped(method):
    """The lattice at the start and where Flexel has it after STEPS steps."""
    write("block.stl", binary_stl(box_triangles((60.0, 40.0, 30.0))))
    scene("fling.toml", FLING)
    scene("free.toml", FREE.replace("METHOD", method))
    expect_ok(run("flexel-voxelize", "block.stl", "--size", "10 mm", "--align", "none", "-o", "rest.vtu"))
    expect_ok(run("flexel-simulate", "fling.toml", "rest.vtu", "-o", "flung.vtu"))
    done = expect_ok(run("flexel-simulate", "free.toml", "flung.vtu", "-o", "free.pvd", "--summary", "summary.json"))
    steps = json.loads(pathlib.Path("summary.json").read_text(encoding="utf-8"))["timed"]["steps"]
    expect(steps == STEPS, f"{STEPS} steps wanted, {steps} taken")
    start = Lattice("free_00000.vtu", YOUNG, DENSITY)
    expect(len(start.rest) == 7 * 5 * 4 and np.ptp(start.mass) > 0, f"6 x 4 x 3 cells wanted: {len(start.rest)} elements; {done}")
    return start, Lattice("free_00050.vtu", YOUNG, DENSITY).position


def by_lammps(start):
    write_data(start, "lattice.data")
    write_input(start, "lattice.data", "lattice.in", 80e-6, STEPS, "end.dump")
    run_lammps("lattice.in")
    return read_dump("end.dump")


def strain(lattice, position):
    ends = position[lattice.bonds]
    return np.abs(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) / lattice.length - 1).max()


def test_a_thousand_steps_agree():
    need("lmp")
    start, ours = stepped("verlet")
    theirs = by_lammps(start)
    moved = np.linalg.norm(ours - start.rest, axis=1).max() / start.spacing
    apart = np.linalg.norm(ours - theirs, axis=1).max() / start.spacing
    print(f"moved by up to {moved:.3g} spacings, strained by {strain(start, ours):.2g}; {apart:.3g} spacings apart")
    expect(moved > 5 and strain(start, ours) > 0.01, f"the test wants motion: {moved} spacings, strain {strain(start, ours)}")
    expect(apart < 1e-9, f"{apart} spacings apart after {STEPS} steps")


def test_the_comparison_tells_half_a_step():
    # Symplectic Euler kicks by a whole step at the start where velocity Verlet kicks by half of one: that has to show.
    need("lmp")
    start, ours = stepped("symplectic")
    apart = np.linalg.norm(ours - by_lammps(start), axis=1).max() / start.spacing
    expect(apart > 1e-6, f"{apart} spacings apart: the comparison sees nothing")


if __name__ == "__main__":
    main(globals())

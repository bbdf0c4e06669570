#!/usr/bin/python3
"""Prints element-steps a second of bench_step's block of 47^3 elements, model springs without damping (and cells beside it), and of LAMMPS on the same
lattice (bond_style harmonic, fix nve), taken in turn on this machine: medians of three, as a table. LAMMPS gets what suits it: no
output, no lists of neighbours built anew, and a process a core (Debian's build has no threads).

    PATH=build/release/bin:$PATH bench/step/lammps.py
"""

import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile

sys.path[:0] = [str(pathlib.Path(__file__).resolve().parents[2] / "tests" / folder) for folder in ("interop", "programs")]
from lammps import Lattice, loop_seconds, run_lammps, write_data, write_input  # noqa: E402
from shapes import binary_stl, box_triangles  # noqa: E402

CELLS, SPACING, YOUNG, DENSITY = 46, 1e-3, 1.2e6, 930  # those of step_bench.cpp
STEPS, REPEATS = 200, 3


def flexel_rate(springs, threads):
    """M element-steps a second."""
    done = subprocess.run(["bench_step", f"--benchmark_filter=^step_block/springs:{springs}/damped:0/threads:{threads}/",
                           "--benchmark_format=json"], check=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, timeout=120)
    row = json.loads(done.stdout)["benchmarks"][0]
    return row["M_elements/s"], row["label"]


def lammps_rate(elements, processes):
    return 1e-6 * elements * STEPS / loop_seconds(run_lammps("block.in", processes, timeout=300))


def make_block(folder):
    """The block as bench_step has it, displaced alike; gives its number of elements."""
    os.chdir(folder)
    pathlib.Path("block.stl").write_bytes(binary_stl(box_triangles(3 * (1e3 * CELLS * SPACING,))))
    subprocess.run(["flexel-voxelize", "block.stl", "--size", f"{1e3 * SPACING} mm", "--align", "none", "--quiet", "-o", "block.vtu"],
                   check=True, timeout=120)
    block = Lattice("block.vtu", YOUNG, DENSITY)
    block.position = block.rest + 1e-3 * block.rest[:, [1, 2, 0]]
    write_data(block, "block.data")
    # four fifths of the step at which the stiffest spring between two of the lightest elements would be unstable
    step = 0.8 * (2 * block.mass.min() / block.stiffness.max()) ** 0.5
    write_input(block, "block.data", "block.in", step, STEPS)
    return len(block.rest)


def main():
    with tempfile.TemporaryDirectory(prefix="flexel-") as folder:
        elements = make_block(folder)
        runs = {"Flexel, springs": lambda n: flexel_rate(1, n), "LAMMPS, bonds": lambda n: (lammps_rate(elements, n), ""),
                "Flexel, cells": lambda n: flexel_rate(0, n)}
        kernel = ""
        rates = {(who, n): [] for who in runs for n in (1, 2)}
        for _ in range(REPEATS):
            for who, n in rates:
                rate, label = runs[who](n)
                kernel = label or kernel
                rates[who, n].append(rate)
        os.chdir("/")
    median = {row: statistics.median(values) for row, values in rates.items()}
    print(f"kernel {kernel}\n\n| M element-steps/s, {elements} elements, not damped | 1 thread or process | 2 |\n|---|---|---|")
    for who in runs:
        print(f"| {who} | {median[who, 1]:.1f} | {median[who, 2]:.1f} |")
    print("| springs over bonds | " + " | ".join(f"{median['Flexel, springs', n] / median['LAMMPS, bonds', n]:.1f}" for n in (1, 2)) + " |")


if __name__ == "__main__":
    main()

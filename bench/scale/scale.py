#!/usr/bin/env python3
"""Writes docs/measurements/scale.md to stdout: flexel-simulate-mpi on several ranks, its time, memory and messages.

    PATH=build/release/bin:$PATH bench/scale/scale.py [--large] >docs/measurements/scale.md

The case is a bar of steel, 4:1:1, held at one end with a small load across the other. --large adds a million cells. Wall seconds mean something on
a quiet machine only; iterations, bytes and memory mean the same on any.
"""

import argparse
import json
import os
import pathlib
import platform
import re
import subprocess
import sys
import tempfile
import time

RANKS = (1, 2, 4)
ENVIRONMENT = dict(os.environ, OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1", OMPI_MCA_rmaps_base_oversubscribe="1",
                   OMPI_MCA_hwloc_base_binding_policy="none", OMPI_MCA_mpi_yield_when_idle="1")
SCENE = ('material = "steel"\n[[fix]]\nwhere = "xmin"\n[[load]]\nwhere = "xmax"\nforce = ["0 N", "0 N", "-100 N"]\n'
         '[[probe]]\nname = "end"\nwhere = "xmax"\n')


def box(path, sides):
    """A box as OBJ, lengths in mm."""
    x, y, z = sides
    corners = [(a, b, c) for c in (0, z) for b in (0, y) for a in (0, x)]
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    path.write_text("".join(f"v {a} {b} {c}\n" for a, b, c in corners) + "".join("f " + " ".join(str(i + 1) for i in quad) + "\n" for quad in quads))


def bar(folder, sides, pieces=0, force=100):
    """A bar of so many cells along x, y and z; in pieces, a list of them. The load is so many newtons."""
    body = folder / (f"bar-{sides[0]}-{sides[1]}-{pieces}.pvtu" if pieces else f"bar-{sides[0]}-{sides[1]}.vtu")
    if not body.exists():
        box(folder / "bar.obj", sides)
        subprocess.run(["flexel-voxelize", folder / "bar.obj", "--size", "1 mm", "--quiet", "-o", body, *(["--pieces", str(pieces)] if pieces else [])], check=True,
                       stderr=subprocess.DEVNULL)
    (folder / "scene.toml").write_text(SCENE.replace("-100 N", f"-{force} N"))
    return body


def run(command):
    """Wall and processor seconds, and what it said."""
    began, usage = time.monotonic(), os.times()
    done = subprocess.run([str(each) for each in command], env=ENVIRONMENT, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"scale.py: {' '.join(map(str, command))} ended with {done.returncode}:\n{done.stderr}")
    now = os.times()
    return time.monotonic() - began, now.children_user + now.children_system - usage.children_user - usage.children_system, done.stderr


def bytes_of(text):
    number, unit = text.split()
    return float(number.replace(",", "")) * {"B": 1, "kB": 1e3, "KB": 1e3, "MB": 1e6, "GB": 1e9}[unit]


def solve(folder, body, ranks, stress=False):
    """One run of flexel-simulate-mpi (ranks 0: of flexel-simulate): its summary and figures."""
    out, log = folder / "out.vtu", folder / "log.txt"
    program = ["mpirun", "-n", ranks, "flexel-simulate-mpi", "--petsc", f"-log_view :{log}"] if ranks else ["flexel-simulate", "--threads", 1]
    wall, processor, said = run([*program, folder / "scene.toml", body, "--no-estimate", *([] if stress else ["--no-stress"]), "--explain", "--summary", folder / "s.json",
                                 "-o", out.with_suffix(body.suffix), "--force"])
    if "puts the body together" in said:
        sys.exit(f"scale.py: rank 0 has the whole of {body}:\n{said}")
    found = json.loads((folder / "s.json").read_text())
    linear = re.search(r"linear solver\D*([\d.]+) s", said)
    found.update(wall=wall, processor=processor, linear=float(linear[1]) if linear else float("nan"), ranks=ranks,
                 memory=[bytes_of(each) for each in re.findall(r"rank \d+: [\d,]+ cells, ([\d.,]+ \w+) at most", said)])
    found["rank_cells"] = [int(each.replace(",", "")) for each in re.findall(r"rank \d+: ([\d,]+) cells", said)]
    found["tip"] = sum(x * x for x in found["probes"][0]["displacement"]) ** 0.5
    if ranks:
        found["events"], found["ksp"] = events(log.read_text()), event_seconds(log.read_text(), "KSPSolve")
    return found


def events(log):
    """PETSc's -log_view: {event: (calls, messages, bytes of one on average, reductions)}, over all ranks."""
    found = {}
    for line in log.splitlines():
        words = re.split(r"\s+", line.strip())
        if len(words) > 10 and re.fullmatch(r"[A-Z]\w+", words[0]) and words[1].isdigit():
            try:
                found[words[0]] = (int(words[1]), float(words[7]), float(words[8]), float(words[9]))
            except ValueError:
                continue
    return found


def row(*cells):
    print("| " + " | ".join(str(each) for each in cells) + " |", flush=True)


def head(*cells):
    row(*cells)
    row(*["---"] * len(cells))


def processor_name():
    for line in pathlib.Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            return line.split(":")[1].strip()
    return platform.machine()


def hierarchy_table(folder, sizes):
    print("\n## Beside flexel-simulate\n\nOne process, one thread each. `flexel-simulate` has Flexel's hierarchy on all levels "
          "([theory/solver.md](../theory/solver.md)), `flexel-simulate-mpi` has it on the elements, and PETSc's GAMG below. Linear seconds: preconditioner and conjugate "
          "gradients; with PETSc also assembly, forces and energies.\n")
    head("cells", "unknowns", "CG", "CG of flexel-simulate", "linear s", "linear s of flexel-simulate", "largest difference of the end, relative")
    for sides in sizes:
        body = bar(folder, sides)
        petsc, own = solve(folder, body, 1), solve(folder, body, 0)
        row(f"{petsc['cells']:,}", f"{petsc['unknowns']:,}", petsc["cg_iterations"], own["cg_iterations"], f"{petsc['linear']:.1f}", f"{own['linear']:.1f}",
            f"{abs(petsc['tip'] - own['tip']) / own['tip']:.0e}")


def memory_words(found):
    return f"{found['memory'][0] / 1e6:,.0f}", f"{max(found['memory'][1:], default=0) / 1e6:,.0f}" if found["ranks"] > 1 else "-"


def memory_table(folder, cases):
    print("\n## Memory\n\nPeak of each process (the kernel's ru_maxrss). Base: what a rank takes for a bar of 16 cells, which is PETSc, MPI and the program. Share: the largest "
          "rank's peak times the ranks over the peak of one rank alone, both less their base: 1 is what cutting can give at best, 1.3 is asked. Of a body in one file rank 0 has the whole besides its cells.\n")
    base = {ranks: max(solve(folder, bar(folder, (16, 1, 1)), ranks)["memory"]) for ranks in RANKS}
    head("cells", "ranks", "base MB", "MB of rank 0", "MB of the largest other", "share")
    results = []
    for sides in cases:
        one = None
        for ranks in RANKS:
            found = solve(folder, bar(folder, sides), ranks)
            results.append((sides, found))
            own = max(found["memory"]) - base[ranks]
            one = one or own
            row(f"{found['cells']:,}", ranks, f"{base[ranks] / 1e6:,.0f}", *memory_words(found), f"{own * ranks / one:.2f}")
    return results


def pieces_table(folder, cases, force=100):
    """Rows of the memory of a body in pieces beside that of one file on one rank."""
    results = []
    for sides in cases:
        alone = solve(folder, bar(folder, sides, 0, force), 1)["memory"][0] - solve(folder, bar(folder, (16, 1, 1)), 1)["memory"][0]
        bar(folder, sides).unlink()
        for ranks in RANKS[1:]:
            base = max(solve(folder, bar(folder, (16, 1, 1), ranks), ranks)["memory"])
            found = solve(folder, bar(folder, sides, ranks, force), ranks)
            results.append((sides, found))
            row(f"{found['cells']:,}", ranks, f"{base / 1e6:,.0f}", *memory_words(found), f"{(max(found['memory']) - base) * ranks / alone:.2f}")
    return results


def pieces_head():
    print("\n## Memory of a body in pieces\n\nAs many pieces as ranks (`.pvtu`): no rank has the whole ([guide/mpi.md](../guide/mpi.md#where-no-rank-has-the-whole)). Each has its own "
          "cells, their elements and two layers of cells beside them, besides what is made of its cells. Base and share as above, one rank being that of one file.\n")
    head("cells", "ranks", "base MB", "MB of rank 0", "MB of the largest other", "share")


def huge_tables(folder):
    """What takes 20 GB and half an hour."""
    print("\nFour million cells, 400 x 100 x 100:\n")
    head("cells", "ranks", "base MB", "MB of rank 0", "MB of the largest other", "share")
    pieces_table(folder, [(400, 100, 100)])
    print("\nA thin part, a plate of 400 x 200 x 2 cells under a hundredth of a newton:\n")
    head("cells", "ranks", "base MB", "MB of rank 0", "MB of the largest other", "share")
    pieces_table(folder, [(400, 200, 2)], 0.01)


def scaling_table(folder, title, words, cases):
    print(f"\n## {title}\n\n{words}\n")
    head("cells", "ranks", "CG", "wall s", "linear s", "processor s", "MB of rank 0", "MB of the largest other")
    results = []
    for sides, ranks in cases:
        found = solve(folder, bar(folder, sides), ranks)
        results.append((sides, found))
        row(f"{found['cells']:,}", ranks, found["cg_iterations"], f"{found['wall']:.1f}", f"{found['linear']:.1f}", f"{found['processor']:.1f}", *memory_words(found))
    return results


def message_table(results):
    print("\n## What ranks exchange\n\nBy PETSc's `-log_view`, between all ranks together. A product sends the displacements of the elements of a slab's end faces: "
          "24 bytes for each of theirs, each way, so (cells across)² x 24 bytes a face and direction, whatever the slab's length. `computed` is that; measured is the mean over the products of all levels of GAMG, of which the coarser ones send less.\n")
    head("cells", "ranks", "cells a rank", "products", "bytes a product, mean of all levels", "computed, finest level alone", "messages a product", "reductions a CG iteration")
    for sides, found in results:
        ranks, ev = found["ranks"], found["events"]
        if ranks == 1 or "MatMult" not in ev:
            continue
        calls, messages, length, _ = ev["MatMult"]
        reductions = sum(ev[name][3] for name in ("VecNorm", "VecTDot", "VecDot") if name in ev)
        faces = 2 * (ranks - 1)
        row(f"{found['cells']:,}", ranks, f"{found['cells'] // ranks:,}", f"{calls:,}", f"{messages * length / calls:,.0f}",
            f"{24 * (sides[1] + 1) * (sides[2] + 1) * faces:,}", f"{messages / calls:.1f}", f"{reductions / max(1, found['cg_iterations']):.1f}")
    print("\nA new tangent sends the diagonal blocks of those faces' elements, 72 bytes each, and what a rank's cells make of the groups of others there; a residual forces, "
          "24 bytes an element. Of a body in one file rank 0 hands out and takes back all displacements once a load step, 24 bytes an element, and sends each rank its piece once a run; of one in "
          "pieces, ranks tell each other those of two layers of cells beside their own.")


def memory_fit(results):
    """Bytes a cell: of a rank's piece, and of the whole body on rank 0; and a rank's base: from the largest and the smallest piece."""
    rows = [(found["cells"], found["rank_cells"], found["memory"]) for _, found in results if found["ranks"] > 1]
    biggest, smallest = max(rows, key=lambda each: each[1][1]), min(rows, key=lambda each: each[1][1])
    piece = (max(biggest[2][1:]) - max(smallest[2][1:])) / (biggest[1][1] - smallest[1][1])
    base = max(smallest[2][1:]) - piece * smallest[1][1]
    whole = max(biggest[2][0] - base - piece * biggest[1][0], 0) / biggest[0]
    return piece, whole, base


def billion(results, in_pieces):
    """`in_pieces`: of runs in which no rank had the whole."""
    _, whole, _ = memory_fit(results)
    piece, _, base = memory_fit(in_pieces)
    more = max(found["memory"][0] - max(found["memory"][1:]) for _, found in in_pieces)
    cells, ranks = 1e9, 1000
    each = cells / ranks
    side = (cells / 4) ** (1 / 3)
    iterations = max(found["cg_iterations"] for _, found in results)
    least = min(found["processor"] / found["cg_iterations"] / found["cells"] for _, found in results if found["ranks"] == 1)
    face = 24 * side * side
    print(f"""
## A billion cells on 1,000 ranks, from these

| figure | value | from |
|---|---|---|
| cells a rank | {each:,.0f} | 1e9 / 1,000 |
| memory a rank, its piece | {(base + piece * each) / 1e9:.1f} GB | {base / 1e6:,.0f} MB and {piece:,.0f} bytes a cell: the difference of the largest and the smallest rank above |
| memory of rank 0 besides, body in pieces | none | it has its own pieces, as the others; above it took {more / 1e6:,.0f} MB more than the largest of them at most |
| memory of rank 0 besides, body in one file | {whole * cells / 1e9:,.0f} GB | {whole:,.0f} bytes a cell of the whole body, rank 0 above less its piece |
| bytes a product and rank, finest level | {2 * face / 1e6:.1f} MB | two faces of {side:,.0f} x {side:,.0f} elements, 24 bytes each |
| bytes a tangent and rank | {2 * 72 * side * side / 1e6:.1f} MB | a block of 72 bytes an element of those faces |
| processor seconds a rank | {least * each * iterations:,.0f} s | {least * 1e6:.1f} us a cell and CG iteration, all of the run on one rank above, and {iterations} iterations, the most above |

So the body has to come in pieces: where rank 0 holds the whole, a machine of 1 TB ends near {1e12 / max(whole, 1) / 1e9:.1f} billion cells. For error bars rank 0 holds the lattice twice as
coarse besides, an eighth of the cells, which is not in this. Each rank has the whole surface, of which the bar has 12 triangles. Slabs of a bar 4:1:1 cut in 1,000 are {4 * side / 1000:.1f} cells
thick, with as many elements on their faces as within: so many ranks want another cut. And PETSc as Debian builds it counts unknowns in 32 bits, which end at 2.1e9 (3e9 are needed):
`libpetsc64-real-dev` has 64.""")


def yardstick(folder, source, results):
    print("\n## The yardstick\n\nPETSc's own example ksp/tutorials/ex56 is elasticity on 8-node cells in a cube, by the same conjugate gradients with GAMG and the rigid motions "
          "(`-use_mat_nearnullspace`), to a relative residual of 1e-8; Debian's `libpetsc3.18-dev-examples` has its source. ")
    if not source:
        print("It was not run (`--ex56`).")
        return
    flags = subprocess.run(["pkg-config", "--cflags", "--libs", "petsc"], check=True, capture_output=True, text=True).stdout.split()
    subprocess.run(["mpicc", "-O2", "-o", folder / "ex56", source, *flags, "-lm"], check=True, capture_output=True)
    head("", "ranks", "unknowns", "CG", "KSPSolve s", "us an unknown and CG iteration")
    for ranks in (1, 2):
        ne, log = 35, folder / "ex56.txt"  # cells along a side
        _, _, said = run(["mpirun", "-n", ranks, folder / "ex56", "-ne", ne, "-alpha", "1e-3", "-ksp_type", "cg", "-pc_type", "gamg", "-use_mat_nearnullspace",
                          "-ksp_rtol", "1e-8", "-ksp_monitor", f"ascii:{log}", "-pc_gamg_coarse_eq_limit", "1000", "-log_view", f":{folder / 'ex56.log'}"])
        iterations = len(re.findall(r"KSP Residual norm", log.read_text())) - 1
        seconds = event_seconds((folder / "ex56.log").read_text(), "KSPSolve")
        unknowns = 3 * (ne + 1) ** 3
        row("ex56", ranks, f"{unknowns:,}", iterations, f"{seconds:.1f}", f"{1e6 * seconds / unknowns / max(iterations, 1):.2f}")
    for _, found in results:
        if found["ranks"] <= 2:
            row("flexel-simulate-mpi", found["ranks"], f"{found['unknowns']:,}", found["cg_iterations"], f"{found['ksp']:.1f}",
                f"{1e6 * found['ksp'] / found['unknowns'] / found['cg_iterations']:.2f}")
    print("\nSeconds of the event KSPSolve, by the wall's clock, on a machine with the load above; it holds GAMG's setup too.")


def event_seconds(log, name):
    line = re.search(rf"^{name}\s+\d+ \d+\.\d ([\d.e+-]+)", log, re.M)
    return float(line[1]) if line else float("nan")


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--large", action="store_true", help="a million cells too")
    arguments.add_argument("--last", action="store_true", help="only the sections after the first on memory")
    arguments.add_argument("--huge", action="store_true", help="nothing but the memory of four million cells in pieces, and of a thin part (20 GB)")
    arguments.add_argument("--ex56", type=pathlib.Path, help="source of PETSc's example ksp/tutorials/ex56.c (Debian's libpetsc3.18-dev-examples has it)")
    options = arguments.parse_args()
    with tempfile.TemporaryDirectory() as place:
        folder = pathlib.Path(place)
        if options.huge:
            return huge_tables(folder)
        print(f"""# Many processes

Printed by `bench/scale/scale.py{' --large' if options.large else ''}` on {os.cpu_count()} cores ({processor_name()}), load average {os.getloadavg()[0]:.1f} when it began. A bar of steel, 4:1:1, held at one end, with a small
load across the other; `flexel-simulate-mpi` without error bars and stresses. Wall and linear seconds are those of a machine with that load; more ranks than cores
share them.""")
        large = []
        if not options.last:
            hierarchy_table(folder, [(56, 14, 14), (116, 29, 29)] + ([(252, 63, 63)] if options.large else []))
            large = memory_table(folder, [(56, 14, 14), (116, 29, 29), (168, 42, 42)])
        pieces_head()
        in_pieces = pieces_table(folder, [(56, 14, 14), (116, 29, 29)])
        results = scaling_table(folder, "Strong scaling", "The same body on more ranks.", [((88, 22, 22), ranks) for ranks in (1, 2, 4)])
        results += scaling_table(folder, "Weak scaling", "As many cells for each rank: the bar grows along its length.",
                                 [((40 * ranks, 16, 16), ranks) for ranks in (1, 2, 4)])
        message_table(results)
        billion(results + large, in_pieces)
        yardstick(folder, options.ex56, results)


if __name__ == "__main__":
    main()

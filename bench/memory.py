#!/usr/bin/env python3
"""What flexel-simulate says that a run needs (`--explain`), beside the most memory that it had: docs/measurements/memory.md.

    PATH=build/release/bin:$PATH bench/memory.py [--size 1 --size 0.7] [--keep DIR] [-o docs/measurements/memory.md] [ROW...]

Each row is a scene on a lattice of each size [mm], those that take long on the coarsest. --keep: results in a folder, with which a run that was stopped
goes on. Without -o the table is printed. Exit code 1: a figure is off by more than 1.3. Five minutes.
"""

import argparse
import os
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "tests/programs"), str(ROOT / "bench/accuracy")]
from kept import Kept  # noqa: E402
from shapes import binary_stl, box_triangles  # noqa: E402

OFF = 1.3
PARTS = {"bar": [((40, 10, 10), (0, 0, 0))], "plate": [((40, 40, 6), (0, 0, 0))], "block": [((16, 16, 16), (12, 12, 6))], "sheet": [((60, 60, 1), (0, 0, 0))]}
MATTER = 'material = "rubber"\n'
BENT = '[[fix]]\nwhere = "xmin"\n[[load]]\nwhere = "xmax"\nforce = ["0 N", "0 N", "-1 N"]\n'
HELD = '[[fix]]\nwhere = "plate/zmin"\n'
MOVING = '[run]\ntime = "TIME us"\n'
IMPLICIT = '[run]\ntime = "2 ms"\nmethod = "implicit"\nstep = "1 ms"\n'
TOUCH = MATTER + "contact = true\n" + HELD + '[gravity]\nacceleration = [0, 0, "-9.81 m/s2"]\n'
TOOL = MATTER + "contact = true\n[parts.block]\nrigid = true\n" + HELD + '''[[manipulator]]
part = "block"
time = ["0 s", "10 ms"]
displacement = [["0 mm", "0 mm", "0 mm"], ["0 mm", "0 mm", "-0.2 mm"]]
'''
BALL = MATTER + HELD + '[[indenter]]\nball = { centre = ["20 mm", "20 mm", "14.1 mm"], radius = "8 mm" }\ndisplacement = ["0 mm", "0 mm", "-1 mm"]\n'
ROWS = {  # parts, options of flexel-voxelize, scene
    "`cells`": (["bar"], [], MATTER + BENT),
    "`springs`": (["bar"], [], 'model = "springs"\n' + MATTER + BENT),
    "`paper`": (["bar"], ["--placement", "centre"], 'model = "paper"\n' + MATTER + BENT),
    "`cells` and `springs`": (["plate", "block"], [], MATTER + '[parts.block]\nmodel = "springs"\n' + HELD + '[[load]]\nwhere = "block/zmax"\nforce = ["0 N", "0 N", "-1 N"]\n'),
    "`quadratic`, small deflection": (["bar"], ["--moments"], 'model = "quadratic"\n' + MATTER + BENT.replace("-1 N", "-1e-9 N")),
    "`quadratic`, large deflection": (["bar"], ["--moments"], 'model = "quadratic"\n' + MATTER + BENT),
    "eight modes": (["bar"], [], MATTER + BENT[:BENT.index("[[load]]")] + "[run]\nmodes = 8\n"),
    "in time, `cells`": (["bar"], [], MATTER + BENT + MOVING),
    "in time, `paper`": (["bar"], ["--placement", "centre"], 'model = "paper"\n' + MATTER + BENT + MOVING),
    "in time, with drag": (["bar"], [], MATTER + BENT + '[drag]\ndensity = "1.2 kg/m3"\n' + MOVING),
    "implicit steps, `cells`": (["bar"], [], MATTER + BENT + IMPLICIT),
    "implicit steps, `springs`": (["bar"], [], 'model = "springs"\n' + MATTER + BENT + IMPLICIT),
    "on a plane": (["bar"], [], MATTER + '[[plane]]\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\n[gravity]\nacceleration = [0, 0, "-9.81 m/s2"]\n' + MOVING),
    "contact, `cells`": (["plate", "block"], [], TOUCH + MOVING),
    "contact, `springs`": (["plate", "block"], [], 'model = "springs"\n' + TOUCH + MOVING),
    "contact, `paper`": (["plate", "block"], ["--placement", "centre"], 'model = "paper"\n' + TOUCH + MOVING),
    "contact at equilibrium": (["plate", "block"], [], TOUCH),
    "contact in implicit steps": (["plate", "block"], [], TOUCH + IMPLICIT),
    "contact of a sheet": (["sheet"], [], MATTER + 'contact = true\n[[fix]]\nwhere = "xmin"\n' + MOVING),
    "a rigid part": (["plate", "block"], [], TOUCH.replace(HELD, "[parts.block]\nrigid = true\n" + HELD) + MOVING),
    "a tool": (["plate", "block"], [], TOOL + MOVING),
    "a tool in implicit steps": (["plate", "block"], [], TOOL + IMPLICIT),
    "an indenter, `cells`": (["plate"], [], BALL),
    "an indenter, `springs`": (["plate"], [], 'model = "springs"\n' + BALL),
}
LONG = ("contact at equilibrium", "contact in implicit steps", "a tool in implicit steps", "`quadratic`, large deflection")
UNITS = {"kB": 1e3, "MB": 1e6, "GB": 1e9}


def peak(*command):
    """Bytes that a command had at most, and what it said."""
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    said = process.stderr.read().decode()
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode != 0:
        sys.exit(f"bench/memory.py: {' '.join(map(str, command))} ended with {process.returncode}: {said}")
    return 1024 * usage.ru_maxrss, said


def measure(name, size, folder):
    """Elements, bytes told, bytes taken."""
    parts, options, text = ROWS[name]
    files = [folder / f"{part}.stl" for part in parts]
    for part, file in zip(parts, files):
        file.write_bytes(binary_stl([[tuple(a + b for a, b in zip(corner, at)) for corner in triangle] for sides, at in PARTS[part] for triangle in box_triangles(sides)]))
    body, scene = folder / "body.vtu", folder / "scene.toml"
    _, said = peak("flexel-voxelize", *files, "--size", f"{size} mm", "--align", "none", *options, "--force", "-o", body)
    scene.write_text(text.replace("TIME", str(max(20.0, 400 * size))), encoding="utf-8")
    taken, told = peak("flexel-simulate", scene, body, "--explain", "--force", "-o", folder / "out.vtu")
    found = re.search(r"memory: about ([\d.]+) (.B)(?:, with large deflections up to ([\d.]+) (.B))?", told)
    if not found:
        sys.exit(f"bench/memory.py: {name}: nothing is told: {told}")
    large = "large" in name
    elements = re.search(r"([\d,]+) elements", said)
    return elements[1], float(found[3 if large else 1]) * UNITS[found[4 if large else 2]], taken


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("rows", nargs="*", metavar="ROW", help="those whose name has this in it; all without")
    parser.add_argument("--size", type=float, action="append", help="of cells, mm (1 and 0.7)")
    parser.add_argument("--keep", type=pathlib.Path)
    parser.add_argument("-o", "--output", type=pathlib.Path)
    arguments = parser.parse_args()
    sizes, kept = arguments.size or [1, .7], Kept(arguments.keep)
    names = [name for name in ROWS if not arguments.rows or any(row in name for row in arguments.rows)]
    lines, ratios = [], []
    with tempfile.TemporaryDirectory() as place:
        for name in names:
            for size in [max(sizes)] if name in LONG else sizes:
                elements, told, taken = kept(f"{name} {size:g}", lambda: measure(name, size, pathlib.Path(place)))
                ratios.append(told / taken)
                lines.append(f"| {name} | {size:g} | {elements} | {told / 1e6:.1f} | {taken / 1e6:.1f} | {told / taken:.2f} |")
                print(lines[-1], flush=True)
    wrong = sum(not 1 / OFF < ratio < OFF for ratio in ratios)
    text = f"""# Memory: told before a run, and taken

Written by `bench/memory.py`: what `flexel-simulate --explain` says beside the largest resident size of the process. Parts: a bar of 40 x 10 x 10 mm, a plate of 40 x 40 x 6 with a block of 16 x 16 x 16 on it, a sheet of 60 x 60 x 1,
on lattices that fit their faces (1 mm) and do not (0.7 mm). What `--max-memory` refuses before a run is what is told here, by more than {OFF} ([exit-codes.md](../reference/exit-codes.md)).

{len(ratios)} runs: {min(ratios):.2f} to {max(ratios):.2f} of what was taken; {wrong} off by more than {OFF}. With model `quadratic` a run between small and large deflections takes something between.

| scene | cells, mm | elements | told, MB | taken, MB | ratio |
|---|---|---|---|---|---|
""" + "\n".join(lines) + "\n"
    if arguments.output:
        arguments.output.write_text(text, encoding="utf-8")
    else:
        print(text)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())

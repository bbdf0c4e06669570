#!/usr/bin/env python3
"""Time and memory of statics: three runs of flexel-simulate at equilibrium, without error bars unless --bars asks for them.

    PATH=build/release/bin:$PATH bench/statics.py [--threads N] [--bars] [--parts DIR] [ROW...]

  solid   a bar of 1,048,576 cells, 4:1:1, held at one end, a small load across the other
  cover   the housing cover of the real parts at 200,000 cells, held below, a small load on top
  large   a bar of 131,072 cells, 16:2:1, bent until its end has gone half its length

Prints cells, wall and processor seconds and MB of the whole program (reading and writing included), and its Newton and CG iterations.
Wall seconds mean something on a quiet machine only; half the processor's are a bound for them on two threads.
"""

import argparse
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time


def box(path, sides):
    """A box as OBJ, lengths in mm."""
    x, y, z = sides
    corners = [(a, b, c) for c in (0, z) for b in (0, y) for a in (0, x)]
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    path.write_text("".join(f"v {a} {b} {c}\n" for a, b, c in corners) + "".join("f " + " ".join(str(i + 1) for i in quad) + "\n" for quad in quads))


def pushed(material, held, drawn, force):
    return (f'material = "{material}"\n[[fix]]\nwhere = "{held}"\n[[load]]\nwhere = "{drawn}"\nforce = ["0 N", "0 N", "{force} N"]\n'
            f'[[probe]]\nname = "end"\nwhere = "{drawn}"\n')


ROWS = {
    "solid": ((256, 64, 64), ["--size", "1 mm"], pushed("steel", "xmin", "xmax", -100)),
    "cover": ("hip_aa_module_shell_cover.STL", ["--count", "200000"], pushed("PLA", "zmin", "zmax", -10)),
    "large": ((256, 32, 16), ["--size", "1 mm"], pushed("PLA", "xmin", "xmax", -1030)),
}


def run(name, parts, threads, bars):
    what, size, scene = ROWS[name]
    with tempfile.TemporaryDirectory() as place:
        folder = pathlib.Path(place)
        part = folder / "bar.obj" if isinstance(what, tuple) else parts / what
        if isinstance(what, tuple):
            box(part, what)
        elif not part.exists():
            print(f"| {name} | left out: no {part} |")
            return
        (folder / "scene.toml").write_text(scene)
        subprocess.run(["flexel-voxelize", part, *size, "--quiet", "-o", folder / "body.vtu"], check=True, stderr=subprocess.DEVNULL)
        began = time.monotonic()
        process = subprocess.Popen(["flexel-simulate", folder / "scene.toml", folder / "body.vtu", *([] if bars else ["--no-estimate"]),
                                    "--threads", str(threads), "--quiet", "--summary", folder / "s.json", "-o", folder / "out.vtu"])
        _, status, usage = os.wait4(process.pid, 0)
        wall = time.monotonic() - began
        if status:
            sys.exit(f"statics.py: {name}: flexel-simulate ended with {os.waitstatus_to_exitcode(status)}")
        found = json.loads((folder / "s.json").read_text())
        moved = sum(x * x for x in found["probes"][0]["displacement"]) ** 0.5
        print(f"| {name} | {found['cells']:,} | {found['newton_iterations']} | {found['cg_iterations']} | {wall:.1f} |"
              f" {usage.ru_utime + usage.ru_stime:.1f} | {usage.ru_maxrss / 1000:,.0f} | {1e3 * moved:.3g} mm |", flush=True)


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--threads", default=2, type=int)
    arguments.add_argument("--bars", action="store_true", help="with error bars, as flexel-simulate does by default")
    arguments.add_argument("--parts", default=pathlib.Path(__file__).resolve().parents[1] / "../shared/parts", type=pathlib.Path)
    arguments.add_argument("rows", nargs="*", metavar="ROW", help=", ".join(ROWS))
    options = arguments.parse_args()
    if unknown := [row for row in options.rows if row not in ROWS]:
        arguments.error(f"unknown row {unknown[0]}; there are {', '.join(ROWS)}")
    print("| row | cells | Newton | CG | wall s | processor s | MB | end moved |\n|---|---|---|---|---|---|---|---|")
    for row in options.rows or ROWS:
        run(row, options.parts, options.threads, options.bars)


if __name__ == "__main__":
    main()

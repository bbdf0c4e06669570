#!/usr/bin/env python3
"""The closed STEP parts, each solved with an error bar and nothing set by hand but the number of cells.

    PATH=build/release/bin:$PATH bench/accuracy/step_parts.py [--parts DIR] [--cells N[,N...]] [--list] [PART...]

Every solid of a part is held by the flat face at one end of its longest side and drawn by 10 N along (1, 1, 1) on that at the other
(end_faces.py); the material is aluminium. Prints, for each number of cells (default 30000): the cells
that came out, processor seconds and MB of voxelising and of solving with its error bar, iterations of Newton and of conjugate gradients,
the largest displacement, its bar and what the bar says. Exit code 1 where a part fails or comes out without a bar.
"""

import argparse
import json
import math
import os
import pathlib
import subprocess
import sys
import tempfile

from end_faces import end_faces

PARTS = ["4040_base_mount.step", "Moving_Jaw_SO101.step", "base_interface_AP203.STEP", "featuretype.STEP",
         "lower_leg_structure_fork.STEP", "red_cube_blue_cylinder.step"]
FORCE = 10  # N


def measured(command, limit):
    """Processor seconds and MB of a process; its last line where it fails."""
    process = subprocess.Popen(["timeout", str(limit), *map(str, command)], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    text = process.stderr.read().decode(errors="replace").strip()
    _, status, usage = os.wait4(process.pid, 0)
    if status != 0:
        raise RuntimeError(f"exit {os.waitstatus_to_exitcode(status)}: {text.splitlines()[-1] if text else 'no message'}")
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1000


def scene_of(part):
    """Holds and draws every solid of a part."""
    info = json.loads(subprocess.run(["flexel", "info", part, "--json"], capture_output=True, check=True).stdout)
    text = 'material = "aluminium 6061"\n'
    for solid in (solid for file in info["files"] for solid in file["parts"]):
        if not solid["closed"]:
            raise RuntimeError(f"{solid['name']} is not closed")
        held, drawn = end_faces(solid)
        force = ", ".join([f'"{FORCE / math.sqrt(3):.6g} N"'] * 3)
        text += f'[[fix]]\nwhere = "{held["selection"]}"\n[[load]]\nwhere = "{drawn["selection"]}"\nforce = [{force}]\n'
    return text


def metres(value):
    return f"{value * 1e6:.4g} um" if value < 1e-3 else f"{value * 1e3:.4g} mm"


def row(part, cells, limit):
    with tempfile.TemporaryDirectory() as place:
        folder = pathlib.Path(place)
        (folder / "scene.toml").write_text(scene_of(part))
        first = measured(["flexel-voxelize", part, "--count", cells, "--quiet", "-o", folder / "body.vtu"], limit)
        second = measured(["flexel-simulate", folder / "scene.toml", folder / "body.vtu", "--quiet", "-o", folder / "out.vtu",
                           "--summary", folder / "s.json"], limit)
        found = json.loads((folder / "s.json").read_text())
    errors = found.get("error_bars", {})
    largest = next((each for each in errors.get("bars", []) if each["of"] == "largest_displacement"), None)
    if not largest:
        raise RuntimeError(f"no error bar: {errors.get('note', '')}")
    value = largest["value"]
    note = errors.get("note", "") or (f"order {largest['order']:.1f}" if largest.get("order") else "no order")
    print(f"| {part.name} | {found['cells']:,} | {first[0]:.1f} | {second[0]:.1f} | {max(first[1], second[1]):.0f} |"
          f" {found['unknowns']:,}; {found['newton_iterations']}, {found['cg_iterations']} | {metres(value)} | {metres(largest['bar'])} |"
          f" {100 * largest['bar'] / value:.1f} | {note} |", flush=True)


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--parts", default=pathlib.Path(__file__).resolve().parents[2] / "../shared/parts", type=pathlib.Path)
    arguments.add_argument("--cells", default="30000", help="numbers of cells, separated by commas")
    arguments.add_argument("--timeout", default=3600, type=int, help="s, of each program")
    arguments.add_argument("--list", action="store_true", help="name the parts")
    arguments.add_argument("names", nargs="*", metavar="PART")
    options = arguments.parse_args()
    if options.list:
        print("\n".join(PARTS))
        return 0
    if not options.parts.is_dir():
        print(f"step_parts.py: {options.parts} is not there: give --parts DIR", file=sys.stderr)
        return 2
    print("| part | cells | voxelize s | solve s | MB | unknowns; Newton, CG | largest displacement | bar | bar % | said |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    good = True
    for cells in options.cells.split(","):
        for name in options.names or PARTS:
            try:
                row(options.parts / name, cells, options.timeout)
            except (RuntimeError, subprocess.SubprocessError, ValueError) as error:
                good = False
                print(f"| {name} | {cells} asked for | failed: {error} |", flush=True)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
"""largest.py [--bin FOLDER] [--write]: the most cells that keep up with a hand, by material.

A plate is pressed into a block that lies on a floor, by a fifth of its height, and held. Measured is the processor time of up to a
tenth of a second of motion while it is held down, on one thread: a long run less a short one, the least of three. A block keeps up
where a second of motion takes at most a second. Prints a table; with --write into docs/measurements/live-latency.md too.
"""

import argparse
import math
import os
import pathlib
import re
import resource
import subprocess
import sys
import tempfile

SOURCE = pathlib.Path(__file__).resolve().parents[2]
MATERIALS = (("soft gel", "20 kPa", 0.4, 1000, 5.0), ("rubber", "1 MPa", 0.4, 1100, 5.0), ("PLA", "3.5 GPa", 0.35, 1240, 2.0))
PART = """import sys
sys.path.insert(0, sys.argv[1])
from solids import block
n, h = int(sys.argv[2]), float(sys.argv[3])
w, t = n * h, max(n // 2, 1) * h
block("block", (0, w), (0, w), (0, t))
block("plate", (.25 * w, .75 * w), (.25 * w, .75 * w), (t + .02 * h, t + 1.02 * h))
"""
SCENE = """bond = false
material = "stuff"
[materials.stuff]
young = "{young}"
poisson = {poisson}
density = "{density} kg/m3"
[[manipulator]]
part = "plate"
time = ["0 s", "{down} s"]
displacement = [[0, 0, 0], [0, 0, "-{depth} mm"]]
[contact]
self = false
friction = 0.3
[[plane]]
point = ["0 mm", "0 mm", "0 mm"]
normal = [0, 0, 1]
[run]
time = "{time} s"
"""


def processor_time(programs, text):
    pathlib.Path("scene.toml").write_text(text, encoding="utf-8")
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([programs / "flexel-simulate", "scene.toml", "body.vtu", "-o", "out.vtu", "--quiet", "--no-stress", "--threads", "1"], check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def load(programs, material, across):
    """Processor seconds of a second of motion, and how many cells the block has."""
    _, young, poisson, density, h = material
    number, unit = young.split()
    sound = math.sqrt(float(number) * {"kPa": 1e3, "MPa": 1e6, "GPa": 1e9}[unit] / density)
    part = subprocess.run([sys.executable, "-c", PART, str(SOURCE / "samples"), str(across), str(h)], check=True, capture_output=True).stdout
    pathlib.Path("part.stl").write_bytes(part)
    subprocess.run([programs / "flexel-voxelize", "part.stl", "--size", f"{h} mm", "--align", "none", "-o", "body.vtu", "--quiet"], check=True, stderr=subprocess.DEVNULL)
    layers = max(across // 2, 1)
    depth = 0.2 * layers * h
    down = depth * 1e-3 / (0.05 * sound)  # slowly against sound
    span = min(0.1, 2 * h / sound)        # some thousand steps
    needed = []
    for _ in range(3):
        short, long = (processor_time(programs, SCENE.format(young=young, poisson=poisson, density=density, down=down, depth=depth, time=time)) for time in (down, down + span))
        needed.append((long - short) / span)
    return min(needed), across * across * layers


def most(programs, material):
    """The largest block that keeps up: by doubling, then by halving."""
    good, bad, found = 0, None, None
    across = 2
    while bad is None or bad - good > max(1, good // 16):
        needed, cells = load(programs, material, across)
        print(f"{material[0]}: {cells} cells, {needed:.2f} s a second", file=sys.stderr)
        if needed <= 1:
            good, found = across, (cells, needed)
        else:
            bad = across
        across = 2 * across if bad is None else (good + bad) // 2
        if across <= good or across < 2:
            break
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bin", type=pathlib.Path, default=SOURCE / "build/release/bin")
    parser.add_argument("--write", action="store_true", help="into docs/measurements/live-latency.md")
    arguments = parser.parse_args()
    programs = arguments.bin.resolve()
    rows = ["| material | E | cells' size | most cells | s of processor a second |", "|---|---|---|---|---|"]
    for material in MATERIALS:
        with tempfile.TemporaryDirectory(prefix="flexel-") as folder:
            os.chdir(folder)
            found = most(programs, material)
            os.chdir("/")
        rows.append(f"| {material[0]} | {material[1]} | {material[4]:g} mm | " + (f"{found[0]} | {found[1]:.2f} |" if found else "none: 4 cells are too many | |"))
    table = "\n".join(rows)
    print(table)
    if arguments.write:
        page = SOURCE / "docs/measurements/live-latency.md"
        text = page.read_text(encoding="utf-8")
        page.write_text(re.sub(r"(<!-- largest\.py -->\n).*?(<!-- end -->)", lambda m: m[1] + table + "\n" + m[2], text, flags=re.DOTALL), encoding="utf-8")


if __name__ == "__main__":
    main()

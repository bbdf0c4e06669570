#!/usr/bin/env python3
"""largest.py [--bin FOLDER] [--method explicit|implicit] [--step TIME] [--write]: the most cells that keep up with a hand, by material and method.

A plate is pressed into a block that lies on a floor, by a fifth of its height. Explicit steps: then it is held; measured is the
processor time of up to a tenth of a second of motion, on one thread. Implicit steps cost what Newton's method needs, which is
little at rest: the plate is pressed in within .2 s, then moved by a hand's way, to and fro by a tenth of the block's height four times
a second; measured is half a second of that. Each is a long run less a short one, the least of three (implicit: of two). A block
keeps up where a second of motion takes at most a second. Prints a table for each; with --write into
docs/measurements/live-latency.md too.
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
time = [{times}]
displacement = [{places}]
[contact]
self = false
friction = 0.3
[[plane]]
point = ["0 mm", "0 mm", "0 mm"]
normal = [0, 0, 1]
[run]
time = "{time} s"
{method}"""


def processor_time(programs, text):
    pathlib.Path("scene.toml").write_text(text, encoding="utf-8")
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([programs / "flexel-simulate", "scene.toml", "body.vtu", "-o", "out.vtu", "--quiet", "--no-stress", "--threads", "1"], check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def path_of(method, height, sound, h):
    """Times [s], places [mm] of the plate, the time when measuring begins, for how long."""
    depth = 0.2 * height
    if method == "explicit":
        down = depth * 1e-3 / (0.05 * sound)  # slowly against sound
        return [0, down], [[0, 0, 0], [0, 0, -depth]], down, min(0.1, 2 * h / sound)  # some thousand steps
    times, places = [0, 0.2], [[0, 0, 0], [0, 0, -depth]]
    for quarter in range(8):
        times.append(times[-1] + 0.0625)
        side = (0.1 * height, 0, -0.1 * height, 0)[quarter % 4]
        places.append([side, 0, -depth + (0.02 * height if quarter % 2 else 0)])
    return times, places, 0.2, 0.5


def load(programs, material, across, method, step):
    """Processor seconds of a second of motion, and how many cells the block has."""
    _, young, poisson, density, h = material
    number, unit = young.split()
    sound = math.sqrt(float(number) * {"kPa": 1e3, "MPa": 1e6, "GPa": 1e9}[unit] / density)
    part = subprocess.run([sys.executable, "-c", PART, str(SOURCE / "samples"), str(across), str(h)], check=True, capture_output=True).stdout
    pathlib.Path("part.stl").write_bytes(part)
    subprocess.run([programs / "flexel-voxelize", "part.stl", "--size", f"{h} mm", "--align", "none", "-o", "body.vtu", "--quiet"], check=True, stderr=subprocess.DEVNULL)
    layers = max(across // 2, 1)
    times, places, begin, span = path_of(method, layers * h, sound, h)
    keys = {
        "young": young,
        "poisson": poisson,
        "density": density,
        "times": ", ".join(f'"{time} s"' for time in times),
        "places": ", ".join("[" + ", ".join(f'"{value} mm"' for value in place) + "]" for place in places),
        "method": "" if method == "explicit" else f'method = "implicit"\nstep = "{step}"\ntolerance = 1e-4\n',
    }
    needed = []
    for _ in range(3 if method == "explicit" else 2):
        short, long = (processor_time(programs, SCENE.format(time=time, **keys)) for time in (begin, begin + span))
        needed.append((long - short) / span)
    return min(needed), across * across * layers


def most(programs, material, method, step):
    """The largest block that keeps up: by doubling, then by halving."""
    good, bad, found = 0, None, None
    across = 2
    while bad is None or bad - good > max(1, good // 16):
        needed, cells = load(programs, material, across, method, step)
        print(f"{material[0]}, {method}: {cells} cells, {needed:.2f} s a second", file=sys.stderr)
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
    parser.add_argument("--method", choices=("explicit", "implicit"), help="default: both")
    parser.add_argument("--step", default="5 ms", help='of implicit steps; default "5 ms"')
    parser.add_argument("--write", action="store_true", help="into docs/measurements/live-latency.md")
    arguments = parser.parse_args()
    programs = arguments.bin.resolve()
    for method in (arguments.method,) if arguments.method else ("explicit", "implicit"):
        rows = ["| material | E | cells' size | most cells | s of processor a second |", "|---|---|---|---|---|"]
        for material in MATERIALS:
            with tempfile.TemporaryDirectory(prefix="flexel-") as folder:
                os.chdir(folder)
                found = most(programs, material, method, arguments.step)
                os.chdir("/")
            rows.append(f"| {material[0]} | {material[1]} | {material[4]:g} mm | " + (f"{found[0]} | {found[1]:.2f} |" if found else "none: 4 cells are too many | |"))
        table = "\n".join(rows)
        print(f"{method}\n{table}")
        if arguments.write:
            page = SOURCE / "docs/measurements/live-latency.md"
            block = re.compile(rf"(<!-- largest\.py {method} -->\n).*?(<!-- end -->)", re.DOTALL)
            page.write_text(block.sub(lambda m: m[1] + table + "\n" + m[2], page.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main()

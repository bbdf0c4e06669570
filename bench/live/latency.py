#!/usr/bin/env python3
"""latency.py [--rate HZ] [--seconds S] [--size MM] [--bin FOLDER]: a scripted hand on a live run.

A plate pats a block of gel on a floor. The hand sends a pose a millisecond (by default) and notes when; a frame tells the last
line that the run has taken up. Printed: the time from a pose to the first frame that knows of it (the round trip), the time between
two frames, late frames, and the force that came back.
"""

import argparse
import json
import math
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "samples"))
from client import Run  # noqa: E402

SCENE = """material = "gel"
[materials.gel]
young = "20 kPa"
poisson = 0.4
density = "1000 kg/m3"
[[manipulator]]
part = "plate"
path = "stdin"
[contact]
friction = 0.3
[[plane]]
point = ["0 mm", "0 mm", "0 mm"]
normal = [0, 0, 1]
[damping]
time = "200 us"
[run]
time = "1000 s"
"""
PART = """import sys
sys.path.insert(0, sys.argv[1])
from solids import block
block("block", (0, 40), (0, 40), (0, 30))
block("plate", (-5, 45), (-5, 45), (30.2, 40.2))
"""


def body(programs, size, samples):
    part = subprocess.run([sys.executable, "-c", PART, samples], check=True, capture_output=True).stdout
    pathlib.Path("part.stl").write_bytes(part)
    subprocess.run([programs / "flexel-voxelize", "part.stl", "--size", f"{size} mm", "-o", "body.vtu", "--quiet"], check=True)
    pathlib.Path("scene.toml").write_text(SCENE, encoding="utf-8")


def hand(at):
    """The pose at a time, as the middle of a line: down 3 mm and up again, twice a second, with a slight turn."""
    depth = 1.5e-3 * (1 - math.cos(4 * math.pi * at))
    turn = 0.02 * math.sin(4 * math.pi * at)
    return f"0 0 {-depth:.9g} {turn:.9g} 0 0"


def lead(run, rate, seconds):
    """Sends poses on time and reads frames in between. The times that lines left, and frames with the time each came."""
    sent, came = {}, []
    while not came:  # the first frame: the run is under way
        frames = run.take(60)
        if frames is None:
            raise SystemExit(run.finish()[1])
        came += [(time.perf_counter(), frame) for frame in frames]
    began = time.perf_counter()
    for line in range(1, int(seconds * rate) + 1):
        due = began + line / rate
        while (left := due - time.perf_counter()) > 0:
            now_frames = run.take(left)
            if now_frames is None:
                raise SystemExit(run.finish()[1])
            came += [(time.perf_counter(), frame) for frame in now_frames]
        run.pose(f"0 {hand(line / rate)}")  # time 0: now
        sent[line] = time.perf_counter()
    return sent, came


def quantile(values, share):
    return sorted(values)[min(len(values) - 1, int(share * len(values)))]


def tell(name, values):
    print(f"{name}: median {1e3 * statistics.median(values):.3f} ms, 95 % {1e3 * quantile(values, 0.95):.3f} ms, "
          f"99 % {1e3 * quantile(values, 0.99):.3f} ms, largest {1e3 * max(values):.3f} ms, deviation {1e3 * statistics.pstdev(values):.3f} ms")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rate", type=float, default=1000, help="poses and frames a second")
    parser.add_argument("--seconds", type=float, default=10)
    parser.add_argument("--size", type=float, default=10, help="of the cells, in mm")
    parser.add_argument("--bin", type=pathlib.Path, default=pathlib.Path("build/release/bin"))
    arguments = parser.parse_args()
    programs = arguments.bin.resolve()
    samples = str(pathlib.Path(__file__).resolve().parents[2] / "samples")
    with tempfile.TemporaryDirectory(prefix="flexel-") as folder:
        os.chdir(folder)
        body(programs, arguments.size, samples)
        run = Run(programs / "flexel-simulate", "scene.toml", "body.vtu", "-o", "out.vtu", "--live", "--live-rate", str(arguments.rate),
                  "--threads", "1", "--summary", "s.json")
        sent, came = lead(run, arguments.rate, arguments.seconds)
        run.pose("end")
        code, said = run.finish()
        if code:
            raise SystemExit(said)
        summary = json.load(open("s.json", encoding="utf-8"))
        os.chdir("/")
    trips, known = [], 0
    for at, frame in came:
        for line in range(known + 1, min(frame["line"], len(sent)) + 1):
            trips.append(at - sent[line])
        known = max(known, frame["line"])
    gaps = [b[0] - a[0] for a, b in zip(came, came[1:])]
    force = [frame["felt"][0][2] for _, frame in came]
    live = summary["timed"]["live"]
    print(f"{summary['cells']} cells, {summary['elements']} elements, {live['frames']} frames at {arguments.rate:g} a second, {live['poses']} poses, "
          f"{summary['timed']['step'] * 1e6:.3g} us a step")
    tell("from a pose to its first frame", trips)
    tell("from frame to frame", gaps)
    print(f"late {live['late']}, missed {live['missed']}, dropped {live['dropped']}, behind {1e3 * live['behind']:.3g} ms; "
          f"at the run's side the time between frames is off by {1e3 * live['jitter']:.3f} ms (root mean square), at most {1e3 * live['worst_jitter']:.3f} ms")
    print(f"force on the plate: 0 to {max(force):.4g} N")


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""What `flexel deform` answers where no size is given, over the real parts: size, error bar and time.

    PATH=build/release/bin:$PATH bench/accuracy/default_answer.py [--parts DIR] [--count N] [NAME...]

Each part is held at one end of its longest side and pushed across at the other, with a force that suits its size (steel; what is
known only by its shape moves little). --count N runs every part at about N cells in place of the default. Prints the median of the
bars, as shares of the largest displacement.
"""

import argparse
import json
import pathlib
import resource
import statistics
import subprocess
import tempfile
import time

UNITS = {"ADIS16480.STL": "m", "conrod.stl": "in", "angle_block.STL": "in", "flange.stl": "m", "stirrer.obj": "m",
         "spot_triangulated.obj": "m", "spot_quadrangulated.obj": "m", "self_intersectA.obj": "m", "rabbit.obj": "in",
         "multibody.stl": "in", "cycloidal.ply": "in"}
PARTS = {".step", ".stp", ".stl", ".obj", ".off", ".ply", ".glb", ".3mf"}


def sides(part, unit):
    """Names of the ends of the longest side, the axis across it, and the shortest side [m]."""
    done = subprocess.run(["flexel", "info", str(part), "--json", *unit], capture_output=True, text=True, timeout=120)
    if done.returncode:
        raise RuntimeError(done.stderr.strip().splitlines()[-1])
    solids = [solid for file in json.loads(done.stdout)["files"] for solid in file["parts"]]
    low = [min(solid["min"][k] for solid in solids) for k in range(3)]
    high = [max(solid["max"][k] for solid in solids) for k in range(3)]
    extent = [b - a for a, b in zip(low, high)]
    along = extent.index(max(extent))
    across = extent.index(min(extent))
    return f"{'xyz'[along]}min", f"{'xyz'[along]}max", across, min(extent)


def answer(part, count, folder):
    unit = ["--unit", UNITS[part.name]] if part.name in UNITS else []
    low, high, across, least = sides(part, unit)
    force = ["0"] * 3
    force[across] = f"{1e4 * least ** 2:.6g}"  # 10 kPa over the square of the shortest side
    command = ["flexel", "deform", str(part), *unit, "--material", "steel", "--fix", low, "--push", f"{high}: {' '.join(force)} N",
               "--summary", str(folder / "s.json"), "-o", str(folder / "out.stl"), *(["--count", str(count)] if count else [])]
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    done = subprocess.run(command, capture_output=True, text=True, timeout=400)
    after, wall = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic() - began
    if done.returncode:
        raise RuntimeError(f"exit code {done.returncode}: {done.stderr.strip().splitlines()[-1]}")
    summary = json.loads((folder / "s.json").read_text())
    bars = [bar for bar in summary["simulate"].get("error_bars", {}).get("bars", []) if bar["of"] == "largest_displacement"]
    share = bars[0]["bar"] / abs(bars[0]["value"]) if bars and bars[0]["value"] else None
    box = [line for line in done.stderr.splitlines() if "warning" not in line]
    cells = sum(solid["cells"] for solid in summary["voxelize"]["parts"])
    processor = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return share, cells, bars[0]["value"] if bars else summary["simulate"]["largest_displacement"], wall, processor, box


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--parts", type=pathlib.Path, default=pathlib.Path("../shared/parts"))
    parser.add_argument("--count", type=int)
    parser.add_argument("--box", action="store_true", help="print what each run said")
    parser.add_argument("names", nargs="*")
    given = parser.parse_args()
    parts = [given.parts / name for name in given.names] or sorted(p for p in given.parts.iterdir() if p.suffix.lower() in PARTS)
    print("| part | cells | largest displacement mm | bar % | s | processor s |\n|---|---|---|---|---|---|", flush=True)
    shares = []
    with tempfile.TemporaryDirectory() as folder:
        for part in parts:
            try:
                share, cells, moved, wall, processor, box = answer(part, given.count, pathlib.Path(folder))
            except (RuntimeError, subprocess.TimeoutExpired) as error:
                print(f"| {part.name} | {str(error)[:150]} | | | | |", flush=True)
                continue
            shares.append(share if share is not None else float("inf"))
            print(f"| {part.name} | {cells:,} | {1e3 * moved:.4g} | {'none' if share is None else f'{100 * share:.2g}'} | {wall:.1f} |"
                  f" {processor:.1f} |", flush=True)
            if given.box:
                print("\n".join(box), flush=True)
    if shares:
        print(f"\n{len(shares)} parts: median bar {100 * statistics.median(shares):.2g} %")


if __name__ == "__main__":
    main()

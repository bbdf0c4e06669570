#!/usr/bin/env python3
"""Memory of flexel-voxelize --pieces and of flexel-map on what it wrote; prints docs/measurements/pieces.md.

    bench/scale/pieces.py [--bin build/release/bin] [--cells 4e6] [--only block] [--no-map] > docs/measurements/pieces.md

Peak: the kernel's count of the process (ru_maxrss), over all of its pieces. Shares are of the peak without --pieces, over the
number of pieces."""

import argparse
import os
import pathlib
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "tests/programs"))
from shapes import binary_stl, box_triangles  # noqa: E402

COUNTS = (2, 4, 8)


def parts(cells):
    """Name, sides in cells of 1 mm; each of about so many cells."""
    edge = (cells / 4) ** (1 / 3)
    thin = (cells / 4) ** 0.5
    return [("block", [round(4 * edge), round(edge), round(edge)]), ("plate two cells thick", [round(2 * thin), round(thin), 2])]


def measured(command):
    """Peak in MB and processor seconds."""
    process = subprocess.Popen(command)
    _, status, usage = os.wait4(process.pid, 0)
    if status != 0:
        sys.exit(f"{command} failed")
    return usage.ru_maxrss / 1e3, usage.ru_utime + usage.ru_stime


def rows(programs, sides, with_map):
    pathlib.Path("part.stl").write_bytes(binary_stl(box_triangles(sides)))
    common = [str(programs / "flexel-voxelize"), "part.stl", "--size", "1 mm", "--align", "box", "--quiet", "--max-memory", "1000GB"]
    mapped = [str(programs / "flexel-map"), "--keep-vertices", "--quiet", "-o", "out.stl", "--force"]
    whole, seconds = measured(common + ["-o", "whole.vtu"])
    map_of = lambda path: f"{measured(mapped + [path])[0]:.0f}" if with_map else ""
    yield f"| whole | {whole:.0f} | | {seconds:.1f} | {map_of('whole.vtu')} |"
    os.remove("whole.vtu")
    for count in COUNTS:
        peak, seconds = measured(common + ["--pieces", str(count), "-o", "body.pvtu"])
        yield f"| {count} pieces | {peak:.0f} | {peak * count / whole:.2f} | {seconds:.1f} | {map_of('body.pvtu')} |"
        for path in pathlib.Path(".").glob("body*.*vtu"):
            path.unlink()


def main():
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--bin", default="build/release/bin", type=pathlib.Path)
    arguments.add_argument("--cells", default=4e6, type=float)
    arguments.add_argument("--only", help="one of the parts: block, plate")
    arguments.add_argument("--no-map", action="store_true", help="leave flexel-map out")
    given = arguments.parse_args()
    programs = given.bin.resolve()
    print("# Lattices in pieces: memory\n")
    print(f"`bench/scale/pieces.py` prints this page ({time.strftime('%Y-%m-%d')}). Peak memory of a process; \"share\" is the peak "
          "times the number of pieces over the peak of the whole: 1 is what cutting can give at best. `flexel-map` reads pieces "
          "one after another and keeps the cells near the surface: of a thin part these are all.\n")
    for name, sides in parts(given.cells):
        if given.only and not name.startswith(given.only):
            continue
        shown = " x ".join(map(str, sides))
        print(f"## A {name}: {shown} cells, {sides[0] * sides[1] * sides[2] / 1e6:.2f} million\n")
        print("| | flexel-voxelize, peak MB | share | processor seconds | flexel-map, peak MB |\n|---|---|---|---|---|")
        with tempfile.TemporaryDirectory() as folder:
            os.chdir(folder)
            for row in rows(programs, sides, not given.no_map):
                print(row, flush=True)
            os.chdir("/")
        print()


if __name__ == "__main__":
    main()

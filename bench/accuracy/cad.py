#!/usr/bin/python3
"""STEP in, the same STEP out: bends parts by 20 % of their size and has gmsh mesh what is written. Writes docs/measurements/cad.md.

    PATH=build/release/bin:$PATH bench/accuracy/cad.py [--parts ../shared/parts] [--held-out FOLDER] [--keep FOLDER] [-o FILE] [--again] [NAME ...]

Each part is cut into some 6,000 cells, held over 6 % of its longest side at one end, and moved across by 20 % of that side at the other. `flexel-map
-o bent.step` writes its faces; gmsh meshes the part and the result with tetrahedra of one size, a tenth of the longest side, or where it cannot in 40
s a 25th. Volumes: by how much that of gmsh's mesh changed, and that of the mapped triangles (`flexel-map --report`). Seconds: flexel-map, reading and
mapping included, its two threads and flexel-cad together; all seconds are of processor time, which other work on the machine does not lengthen much.
With names only these parts run, which the page says; with --again the page keeps its rows of the others. With --keep
each row is written to FOLDER as soon as it is measured, and a later run takes it from there. The held-out parts of the page as it stands: all STEP
files under 1.5 MB in three public repositories on GitHub, TheRobotStudio/SO-ARM100, tpaviot/pythonocc-demos and Kofferkulli/full-size-models, but for
those in ../shared/parts; chosen before the first run.
"""

import argparse
import json
import math
import pathlib
import re
import resource
import signal
import subprocess
import sys
import tempfile

import meshio
import numpy

from kept import Kept

ROOT = pathlib.Path(__file__).resolve().parents[2]
CELLS = 6000
END, BEND = .06, .2  # shares of the longest side
GMSH_SECONDS = 40
GMSH_SIZES = 10, 25  # of the longest side, one of them


def run(*words, cwd, seconds=3600):
    """(exit code, stderr, processor s); 124 where a process of it takes more than `seconds`."""
    used = lambda: sum(resource.getrusage(resource.RUSAGE_CHILDREN)[:2])
    before = used()
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, cwd=cwd,
                          preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 1)))
    if -done.returncode in (signal.SIGXCPU, signal.SIGKILL):
        return 124, "out of time", seconds
    return done.returncode, done.stderr, used() - before


def box_of(part, cwd):
    text = subprocess.run(["flexel", "info", str(part)], capture_output=True, text=True, cwd=cwd, check=True).stdout
    number = r"([-+\d.e]+)"
    corners = re.findall(rf"from \({number}, {number}, {number}\) to \({number}, {number}, {number}\)", text)
    low = [min(float(each[i]) for each in corners) for i in range(3)]
    return low, [max(float(each[i + 3]) for each in corners) for i in range(3)]


def scene_of(low, high):
    size = [b - a for a, b in zip(low, high)]
    long, short = size.index(max(size)), size.index(min(size))
    diagonal = sum(each * each for each in size) ** .5

    def box(begin, end):
        at = lambda shares: ", ".join(f'"{value:.9g} mm"' for value in shares)
        lower = [low[i] - diagonal if i != long or begin == 0 else low[i] + begin * size[i] for i in range(3)]
        upper = [high[i] + diagonal if i != long or end == 1 else low[i] + end * size[i] for i in range(3)]
        return f"{{ box = {{ min = [{at(lower)}], max = [{at(upper)}] }} }}"

    move = ", ".join(f'"{BEND * size[long] if i == short else 0:.9g} mm"' for i in range(3))
    return (f'material = "rubber"\n[[fix]]\nwhere = {box(0, END)}\n'
            f"[[move]]\nwhere = {box(1 - END, 1)}\ndisplacement = [{move}]\n"), max(size), diagonal


def tet_volume(step, size, cwd):
    """Volume of gmsh's tetrahedra, mm^3; None and why where there are none."""
    geo, mesh = cwd / "mesh.geo", cwd / "mesh.msh"
    geo.write_text(f'SetFactory("OpenCASCADE"); Merge "{step}"; Mesh.MeshSizeMax = {size}; Mesh.MeshSizeFromCurvature = 6; Mesh.Algorithm3D = 10;\n')
    mesh.unlink(missing_ok=True)
    code, said, _ = run("gmsh", "-3", geo, "-o", mesh, "-format", "msh2", "-v", "1", cwd=cwd, seconds=GMSH_SECONDS)
    if code != 0:
        return None, "out of time" if code == 124 else (said.strip().splitlines() or ["fails"])[0]
    read = meshio.read(mesh)
    tets = [block.data for block in read.cells if block.type == "tetra"]
    if not tets:
        return None, "no tetrahedra"
    p = read.points[numpy.concatenate(tets)]
    return abs(numpy.einsum("ij,ij->i", numpy.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), p[:, 3] - p[:, 0])).sum() / 6, ""


def measure(part, cwd):
    """A row: what happened to one part."""
    row = {"part": part.name}
    scene, longest, diagonal = scene_of(*box_of(part, cwd))
    (cwd / "scene.toml").write_text(scene)
    code, said, _ = run("flexel-voxelize", part, "--count", CELLS, "-o", "rest.vtu", "--quiet", cwd=cwd)
    if code == 0:
        code, said, _ = run("flexel-simulate", "scene.toml", "rest.vtu", "-o", "bent.vtu", "--no-estimate", cwd=cwd)
    if code != 0:
        return {**row, "why": said.strip().splitlines()[-1]}
    (cwd / "bent.step").unlink(missing_ok=True)
    code, said, row["seconds"] = run("flexel-map", "bent.vtu", "-o", "bent.step", "--report", "report.json", "--threads", 2, cwd=cwd)
    if code != 0:
        return {**row, "why": said.strip().splitlines()[-1]}
    row["warnings"] = [line.split("warning: ")[1] for line in said.splitlines() if "warning: " in line]
    told = re.search(r"STEP: ([\d,]+) solids? of ([\d,]+) faces?, (?:all|([\d,]+)) as before(?:, moved|, the others within (\S+ \S+) of the deformation.*); (.*)", said)
    row["solids"], row["faces"], row["kept"] = (int(each.replace(",", "")) for each in (told[1], told[2], told[3] or told[2]))
    row["deviation"] = told[4] or "none"
    row["valid"], row["tolerance"] = told[5].startswith("valid"), 1e-4 * diagonal
    row["size"] = (cwd / "bent.step").stat().st_size / part.stat().st_size
    quality = json.loads((cwd / "report.json").read_text())
    row["triangles"] = quality["volume_after"] / quality["volume_before"] - 1
    why = []
    for share in GMSH_SIZES:
        after, why_after = tet_volume(cwd / "bent.step", longest / share, cwd)
        why.append(why_after)
        if after:
            break
    before, why_before = tet_volume(part, longest / (share if after else GMSH_SIZES[0]), cwd)
    row["gmsh_before"] = why_before or "yes"
    row["gmsh"] = why[0] if not after else "yes" if len(why) == 1 else f"yes, at a {share}th (at a {GMSH_SIZES[0]}th: {why[0]})"
    if before and after:
        row["tets"] = after / before - 1
    return row


def measured(part):
    with tempfile.TemporaryDirectory() as scratch:
        try:
            return measure(part, pathlib.Path(scratch))
        except subprocess.CalledProcessError as error:
            return {"part": part.name, "why": error.stderr.strip().splitlines()[-1]}


def line_of(row):
    if "line" in row:
        return row["line"]
    if "why" in row:
        row["why"] = re.sub(r"\S*/", "", row["why"])  # no folders
        return f"| {row['part']} | | | | | | | | | {row['why']} |"
    percent = lambda name: f"{100 * row[name]:+.2f} %" if name in row else ""
    return (f"| {row['part']} | {row['solids']} | {row['faces']} ({row['kept']}) | {row['deviation']} | {1e3 * row['tolerance']:.3g} um | "
            f"{'yes' if row['valid'] else 'no'} | {row['gmsh']}{'' if row['gmsh_before'] == 'yes' else ' (the part itself: ' + row['gmsh_before'] + ')'} | "
            f"{percent('tets')} / {percent('triangles')} | {row['seconds']:.1f} s, x {row['size']:.1f} | {'; '.join(row['warnings'])} |")


def row_of(line):
    """The row that line_of() wrote, as far as page() needs it; its line stays as it is."""
    cells = [cell.strip() for cell in line.strip().strip("|").split(" | ")]
    row = {"part": cells[0], "line": line}
    if len(cells) < 10 or not cells[1]:
        return {**row, "why": cells[-1]}
    row["valid"], row["gmsh"] = cells[5] == "yes", cells[6].split(" (the part")[0]
    row["gmsh_before"] = "no" if "(the part itself" in cells[6] else "yes"
    row["seconds"] = float(cells[8].split(" s")[0])
    shares = [each.strip() for each in cells[7].split("/")]
    row["triangles"] = float(shares[1].rstrip(" %")) / 100
    if shares[0]:
        row["tets"] = float(shares[0].rstrip(" %")) / 100
    return row


def page(rows, groups):
    done = [row for row in rows if "why" not in row]
    valid = sum(row["valid"] for row in done)
    meshed = sum(row["gmsh"].startswith("yes") for row in done)
    meshable = sum(row["gmsh_before"] == "yes" for row in done)
    seconds = sorted(row["seconds"] for row in done)
    apart = sorted(abs(row["tets"] - row["triangles"]) for row in done if "tets" in row) or [math.nan]
    lines = ["# STEP in, the same STEP out", "", "Written by `bench/accuracy/cad.py`: do not edit.", "",
             " ".join(__doc__.split("\n\n", 2)[2].split()), "",
             f"{len(done)} of {len(rows)} parts were bent. OpenCASCADE's check finds {valid} valid, written and read again; gmsh meshes {meshed} of them, and {meshable} "
             f"of the parts as they were, at the same sizes. The volumes of gmsh's meshes and of the mapped triangles changed by the same to {100 * apart[len(apart) // 2]:.3f} % (median; "
             f"largest {100 * apart[-1]:.2f} %). Median {seconds[len(seconds) // 2]:.1f} s, longest {seconds[-1]:.1f} s.", ""]
    for title, group in groups:
        lines += [f"## {title}", "", "| part | solids | faces (kept as they were) | farthest from the deformation | tolerance | valid | gmsh meshes it | "
                  "volume: gmsh / triangles | time, file size | warnings |", "|---|---|---|---|---|---|---|---|---|---|", *map(line_of, group), ""]
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--parts", type=pathlib.Path, default=ROOT / "../shared/parts")
    parser.add_argument("--held-out", type=pathlib.Path, help="parts that nothing was tuned to")
    parser.add_argument("-o", "--output", type=pathlib.Path, default=ROOT / "docs/measurements/cad.md")
    parser.add_argument("--again", action="store_true", help="keep the rows of parts that are not named")
    parser.add_argument("--keep", type=pathlib.Path, metavar="FOLDER", help="write each row there when it is measured; go on from what is there")
    parser.add_argument("names", nargs="*")
    arguments = parser.parse_args()
    keep = Kept(arguments.keep)
    kept = {}
    if arguments.again:
        lines = [line for line in arguments.output.read_text().splitlines() if line.startswith("| ") and not line.startswith("| part ")]
        kept = {row["part"]: row for row in map(row_of, lines)}
    groups = []
    for title, folder in (("Parts of ../shared/parts", arguments.parts), ("Held-out parts", arguments.held_out)):
        if folder is None or not folder.is_dir():
            continue
        found = sorted(path.resolve() for path in folder.iterdir() if path.suffix.lower() in (".step", ".stp"))
        rows = []
        for part in found:
            if arguments.names and part.name not in arguments.names:
                if part.name in kept:
                    rows.append(kept[part.name])
                continue
            rows.append(keep(f"{title} {part.name}", lambda: measured(part)))
            print(line_of(rows[-1]), file=sys.stderr, flush=True)
        groups.append((title, rows))
    if arguments.names and not arguments.again:
        groups = [(f"{title}, some of them", rows) for title, rows in groups]
    arguments.output.write_text(page([row for _, rows in groups for row in rows], groups))


if __name__ == "__main__":
    main()

#!/usr/bin/python3
"""Model `quadratic` on slanted and thin walls, beside model `cells` and CalculiX: writes docs/measurements/quadratic.md.

    PATH=build/release/bin:$PATH bench/accuracy/quadratic.py [--parts ../shared/parts] [-o FILE]

Bars and strips are turned by 33 degrees about (1, 2, 3) in the lattice (`--align none`), held at one end and pushed across at the other;
what is compared is the mean displacement of the end along the push; slender bars stand beside the elastica. References: the beam, CalculiX's C3D20R at n = 4, 6 and 9, extrapolated
(528.2 at Poisson's ratio .3, 519.1 at .45 for 2 x .5 x .5 and E = 1); strips, C3D20R of 32 x 8 x 2 run here (ccx); STEP parts stand
beside CalculiX's second-order tetrahedra (`flexel export --calculix --mesh tet`) of a 40th of the diagonal. Seconds: the whole process of flexel-simulate, one thread.
"""

import argparse
import json
import math
import os
import pathlib
import resource
import subprocess
import sys
import tempfile
import time

from kept import write_whole
from step_parts import scene_of

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "tests/programs"))
from shapes import obj_bar, turned  # noqa: E402


def call(*words, cwd=None, accept=(0,)):
    """(stdout, wall s, MB)"""
    before = time.monotonic()
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, cwd=cwd, env={**os.environ, "OMP_NUM_THREADS": "1"})
    if done.returncode not in accept:
        raise RuntimeError(f"{' '.join(map(str, words))}: {(done.stderr.strip().splitlines() or ['no message'])[-1]}")
    return done.stdout, time.monotonic() - before, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024


def bar(path, sizes, degrees):
    text, rotation = obj_bar(sizes, degrees)
    path.write_text(text)
    return rotation


def scene(model, poisson, direction, force):
    vector = ", ".join(f'"{force * each:.12g} N"' for each in direction)
    return (f'material = "gum"\nmodel = "{model}"\n[materials.gum]\nyoung = "1 MPa"\npoisson = {poisson}\ndensity = "1000 kg/m3"\n'
            f'[[fix]]\nwhere = "held"\n[[load]]\nwhere = "end"\nforce = [{vector}]\n[[probe]]\nname = "end"\nwhere = "end"\n')


def solve(folder, part, size, text, direction, estimate=False):
    """(displacement along the push m, bar m, cells, unknowns, iterations, s)"""
    (folder / "scene.toml").write_text(text)
    call("flexel-voxelize", part, "--size", f"{size} mm", "--align", "none", "--moments", "--threads", "1", "--quiet", "-o", folder / "body.vtu")
    _, seconds, _ = call("flexel-simulate", folder / "scene.toml", folder / "body.vtu", "--threads", "1", "--quiet", "--no-stress",
                         *([] if estimate else ["--no-estimate"]), "--summary", folder / "s.json", "-o", folder / "out.vtu")
    found = json.loads((folder / "s.json").read_text())
    bars = [each["bar"] for each in found.get("error_bars", {}).get("bars", []) if each["of"] == "probe end"]
    return (sum(a * b for a, b in zip(found["probes"][0]["displacement"], direction)), bars[0] if bars else None, found["cells"],
            found["cg_iterations"], seconds)


def reference_strip(folder, sizes, counts, poisson):
    """u = F . u / F of a box held at x = 0 under an even traction along z at its end, E = 1: CalculiX's C3D20R."""
    (length, width, thick), (nx, ny, nz) = sizes, counts
    number, points = {}, []

    def node(i, j, k):
        if (i, j, k) not in number:
            number[i, j, k] = len(number) + 1
            points.append((length * i / 2 / nx, width * j / 2 / ny, thick * k / 2 / nz))
        return number[i, j, k]

    order = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2), (1, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0),
             (1, 0, 2), (2, 1, 2), (1, 2, 2), (0, 1, 2), (0, 0, 1), (2, 0, 1), (2, 2, 1), (0, 2, 1)]
    elements = [[node(2 * i + a, 2 * j + b, 2 * k + c) for a, b, c in order] for k in range(nz) for j in range(ny) for i in range(nx)]
    force = {}
    for j in range(ny):
        for k in range(nz):
            for b, c, share in ((0, 0, -1 / 12), (2, 0, -1 / 12), (0, 2, -1 / 12), (2, 2, -1 / 12), (1, 0, 1 / 3), (0, 1, 1 / 3), (2, 1, 1 / 3), (1, 2, 1 / 3)):
                at = node(2 * nx, 2 * j + b, 2 * k + c)
                force[at] = force.get(at, 0) + share / ny / nz
    text = "*NODE,NSET=ALL\n" + "".join(f"{i + 1},{x:.12g},{y:.12g},{z:.12g}\n" for i, (x, y, z) in enumerate(points))
    text += "*ELEMENT,TYPE=C3D20R,ELSET=ALL\n" + "".join(f"{e + 1}," + ",".join(map(str, n[:12])) + ",\n" + ",".join(map(str, n[12:])) + "\n" for e, n in enumerate(elements))
    text += "*NSET,NSET=H\n" + "".join(f"{v},\n" for key, v in number.items() if key[0] == 0) + "*NSET,NSET=L\n" + "".join(f"{i},\n" for i in force)
    text += f"*MATERIAL,NAME=M\n*ELASTIC\n1,{poisson}\n*SOLID SECTION,ELSET=ALL,MATERIAL=M\n*STEP\n*STATIC\n*BOUNDARY\nH,1,3\n*CLOAD\n"
    text += "".join(f"{i},3,{f:.12g}\n" for i, f in force.items()) + "*NODE PRINT,NSET=L\nU\n*END STEP\n"
    (folder / "strip.inp").write_text(text)
    call("ccx", "strip", cwd=folder)
    rows = [line.split() for line in (folder / "strip.dat").read_text().splitlines()]
    return sum(force[int(row[0])] * float(row[3]) for row in rows if len(row) == 4 and row[0].isdigit())


def beams(folder):
    text = ("## A turned beam\n\n2 x .5 x .5, turned by 33 degrees, n cells through its thickness. Error of the end's displacement in %; error bar,\n"
            "cells, iterations and seconds of `quadratic`.\n\n| nu | n | `cells` | `quadratic` | bar | cells | iterations | s |\n|---|---|---|---|---|---|---|---|\n")
    for poisson, reference in ((0.3, 528.2), (0.45, 519.1)):
        for n in (1, 2, 3, 4, 6):
            rotation = bar(folder / "beam.obj", (200, 50, 50), 33)
            direction, force = turned(rotation, (0, 0, 1)), 1e-4
            true = reference * force / (1e6 * 0.1)
            old = solve(folder, folder / "beam.obj", 50 / n, scene("cells", poisson, direction, force), direction)
            new = solve(folder, folder / "beam.obj", 50 / n, scene("quadratic", poisson, direction, force), direction, estimate=n > 1)
            barred = f"{100 * new[1] / true:.2f}" if new[1] else ""
            text += f"| {poisson} | {n} | {100 * (old[0] / true - 1):+.1f} | {100 * (new[0] / true - 1):+.2f} | {barred} | {new[2]:,} | {new[3]} | {new[4]:.2f} |\n"
    return text


def strips(folder):
    text = ("\n## Turned strips\n\n16 x 4 x t in cells of 1, turned by 33 degrees, Poisson's ratio .3: walls of a quarter of a cell to two cells. Error in %.\n\n"
            "| t / h | `cells` | `quadratic` | cells | iterations | s |\n|---|---|---|---|---|---|\n")
    for thick in (0.25, 0.5, 1, 2):
        reference = reference_strip(folder, (16, 4, thick), (32, 8, 2), 0.3)
        rotation = bar(folder / "strip.obj", (160, 40, 10 * thick), 33)
        direction = turned(rotation, (0, 0, 1))
        force = 1e-6 * thick**3
        true = reference * force / (1e6 * 0.01)
        old = solve(folder, folder / "strip.obj", 10, scene("cells", 0.3, direction, force), direction)
        new = solve(folder, folder / "strip.obj", 10, scene("quadratic", 0.3, direction, force), direction)
        text += f"| {thick} | {100 * (old[0] / true - 1):+.1f} | {100 * (new[0] / true - 1):+.2f} | {new[2]:,} | {new[3]} | {new[4]:.2f} |\n"
    return text


def elastica(load, steps=4000):
    """(x, z) of the tip of an inextensible cantilever of length 1, load = F L^2 / (E I) across: theta'' = -load cos(theta), by shooting."""
    def shoot(slope):
        theta = x = z = 0.0
        for _ in range(steps):
            middle = theta + slope / 2 / steps
            x, z = x + math.cos(middle) / steps, z + math.sin(middle) / steps
            theta, slope = theta + (slope - load * math.cos(theta) / 2 / steps) / steps, slope - load * math.cos(middle) / steps
        return slope, x, z

    low, high = 0.0, 2 * load + 2
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (low, middle) if shoot(middle)[0] > 0 else (middle, high)
    return shoot(low)[1:]


def cantilevers(folder):
    text = ("\n## Large deflections\n\nA cantilever of 40 x 1 x 1 cells of 1, Poisson's ratio 0, under a force across that keeps its direction, beside the elastica: where its tip is, off by\n"
            "so much of the length in %. F L^2 / (E I) of 1, 4 and 10.\n\n| lattice | load | tip, of the length | `cells` | `quadratic` | Newton | iterations | s |\n|---|---|---|---|---|---|---|---|\n")
    for words, degrees in (("along the bar", 0), ("turned by 33 degrees", 33)):
        rotation = bar(folder / "slender.obj", (400, 10, 10), degrees)
        across, along = turned(rotation, (0, 0, 1)), turned(rotation, (1, 0, 0))
        for load in (1, 4, 10):
            force, (x, z) = load * (1e6 * 0.01**4 / 12) / 0.4**2, elastica(load)
            row = []
            for model in ("cells", "quadratic"):
                seconds = solve(folder, folder / "slender.obj", 10, scene(model, 0, across, force), across)[4]
                found = json.loads((folder / "s.json").read_text())
                moved = found["probes"][0]["displacement"]
                tip = [1 + sum(a * b for a, b in zip(moved, along)) / 0.4, sum(a * b for a, b in zip(moved, across)) / 0.4]
                row.append(f"{100 * math.dist(tip, (x, z)):.2f}")
            text += f"| {words} | {load} | ({x:.4f}, {z:.4f}) | {' | '.join(row)} | {found['newton_iterations']} | {found['cg_iterations']} | {seconds:.2f} |\n"
    return text


def piece(path, rotation, low, high):
    """OBJ text of a box with the groups x0 and x1, turned [mm]."""
    corners = [turned(rotation, (a, b, c)) for c in (low[2], high[2]) for b in (low[1], high[1]) for a in (low[0], high[0])]
    quads = {"x0": [(0, 4, 6, 2)], "x1": [(1, 3, 7, 5)], "side": [(0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)]}
    path.write_text("".join("v {:.15g} {:.15g} {:.15g}\n".format(*corner) for corner in corners) + "".join(
        f"g {group}\n" + "".join("f " + " ".join(str(i + 1) for i in face) + "\n" for face in faces) for group, faces in quads.items()))


def solve_pieces(folder, pieces, rotation, force, poisson, stiffer=1):
    """(the end's displacement, its reading of the summary) of boxes in a row, `pieces` [(name, from, to, size) mm along the bar]; the last one has so many
    times the stiffness."""
    bodies = []
    for name, low, high, size in pieces:
        piece(folder / f"{name}.obj", rotation, (low, 0, 0), (high, 50, 50))
        bodies.append(folder / f"{name}.vtu")
        call("flexel-voxelize", folder / f"{name}.obj", "--size", f"{size} mm", "--align", "none", "--moments", "--threads", "1", "--quiet", "-o", bodies[-1], "--force")
    first, last = pieces[0][0], pieces[-1][0]
    vector = ", ".join(f'"{each:.12g} N"' for each in turned(rotation, force))
    (folder / "scene.toml").write_text(
        f'model = "quadratic"\nmaterial = "gum"\n[materials.gum]\nyoung = "1 MPa"\npoisson = {poisson}\ndensity = "1000 kg/m3"\n'
        f'[materials.other]\nyoung = "{stiffer} MPa"\npoisson = {poisson}\ndensity = "1000 kg/m3"\n[parts.{last}]\nmaterial = "other"\n'
        f'[[fix]]\nwhere = "{first}/x0"\n[[load]]\nwhere = "{last}/x1"\nforce = [{vector}]\n[[probe]]\nname = "end"\nwhere = "{last}/x1"\n')
    call("flexel-simulate", folder / "scene.toml", *bodies, "--threads", "1", "--quiet", "--no-stress", "--no-estimate", "--summary", folder / "s.json",
         "--force", "-o", folder / "out.vtu")
    found = json.loads((folder / "s.json").read_text())
    return found["probes"][0]["displacement"], found


def bonded(folder):
    text = ("\n## Bonded parts\n\nA bar of 200 x 50 x 50, n cells thick, cut across in the middle and bonded again; the far half with the same cells, or with cells of .7 of them. Bent: the end beside\n"
            "that of the whole bar. Drawn, Poisson's ratio 0, the far half of so many times the stiffness: beside the series of the two. What it is off by in %; iterations of the whole bar and of the\n"
            "bonded one.\n\n| bar | n | cells of the far half | off % | whole, iterations | iterations |\n|---|---|---|---|---|---|\n")
    off = lambda found, exact: 100 * math.dist(found, exact) / math.hypot(*exact)
    for words, degrees in (("bent", 0), ("bent, turned by 33 degrees", 33)):
        rotation = obj_bar((1, 1, 1), degrees)[1]
        for n in (1, 2, 3, 4):
            exact, whole = solve_pieces(folder, [("whole", 0, 200, 50 / n)], rotation, (0, 0, 1e-3), 0.3)
            for finer in (1, 0.7):
                end, found = solve_pieces(folder, [("near", 0, 100, 50 / n), ("far", 100, 200, finer * 50 / n)], rotation, (0, 0, 1e-3), 0.3)
                text += f"| {words} | {n} | {'the same' if finer == 1 else '.7'} | {off(end, exact):.3f} | {whole['cg_iterations']} | {found['cg_iterations']} |\n"
    for words, degrees in (("drawn", 0), ("drawn, turned by 33 degrees", 33)):
        rotation = obj_bar((1, 1, 1), degrees)[1]
        for stiffer in (1, 10, 1000):
            for finer in (1, 0.7):
                exact = turned(rotation, (1e-2 / 0.0025 / 1e6 * 0.1 * (1 + 1 / stiffer), 0, 0))
                end, found = solve_pieces(folder, [("near", 0, 100, 25), ("far", 100, 200, finer * 25)], rotation, (1e-2, 0, 0), 0, stiffer)
                text += f"| {words}, {stiffer} times | 2 | {'the same' if finer == 1 else '.7'} | {off(end, exact):.4f} | | {found['cg_iterations']} |\n"
    return text


def calculix(folder, part, text, edge):
    """(displacement of the probe along the push m, elements, s of meshing, s of solving): second-order tetrahedra."""
    (folder / "scene.toml").write_text(text)
    _, meshing, _ = call("flexel", "export", part, "--scene", folder / "scene.toml", "--calculix", "--mesh", "tet", "--size", f"{edge} mm", "--nlgeom", "off",
                         "--quiet", "--summary", folder / "export.json", "--force", "-o", folder / "job.inp")
    _, solving, _ = call("timeout", "200", "ccx", "job", cwd=folder)
    export = json.loads((folder / "export.json").read_text())
    probe = export["probes"][0]
    weight, moved = dict(zip(probe["nodes"], probe["weights"])), {}
    for line in (folder / "job.dat").read_text().splitlines():
        row = line.split()
        if len(row) == 4 and row[0].isdigit():
            moved[int(row[0])] = [float(value) for value in row[1:]]
    return [1e-3 * sum(weight[n] * moved[n][axis] for n in weight) for axis in range(3)], export["elements"], meshing, solving


PARTS = ["4040_base_mount.step", "base_interface_AP203.STEP", "featuretype.STEP", "lower_leg_structure_fork.STEP"]


def step_parts(folder, parts):
    text = ("\n## STEP parts\n\nHeld at the flat face at one end of the longest side, drawn by 10 N along (1, 1, 1) at the other; aluminium. How far that face moves, in um;\n"
            "in brackets seconds of solving on one thread (CalculiX: of meshing and of solving).\n\n"
            "| part | `cells`, 30,000 | `quadratic`, 1,000 | `quadratic`, 4,000 | CalculiX, C3D10 |\n|---|---|---|---|---|\n")
    for name in PARTS:
        part = parts / name
        if not part.exists():
            text += f"| {name} | left out: not there | | | |\n"
            continue
        plain = scene_of(part)
        drawn = plain.split("[[load]]\nwhere = ")[1].splitlines()[0]
        row = []
        for model, count in (("cells", 30000), ("quadratic", 1000), ("quadratic", 4000)):
            (folder / "scene.toml").write_text(f'model = "{model}"\n{plain}[[probe]]\nname = "end"\nwhere = {drawn}\n')
            call("flexel-voxelize", part, "--count", count, "--threads", "1", "--quiet", *(["--moments"] if model == "quadratic" else []), "-o", folder / "body.vtu")
            _, seconds, _ = call("flexel-simulate", folder / "scene.toml", folder / "body.vtu", "--threads", "1", "--quiet", "--no-stress", "--no-estimate",
                                 "--summary", folder / "s.json", "-o", folder / "out.vtu")
            moved = json.loads((folder / "s.json").read_text())["probes"][0]["displacement"]
            row.append(f"{1e6 * math.hypot(*moved):.4g} ({seconds:.1f} s)")
        solid = json.loads(call("flexel", "info", part, "--json")[0])["files"][0]["parts"][0]
        diagonal = 1e3 * math.dist(solid["min"], solid["max"])
        try:
            moved, elements, meshing, solving = calculix(folder, part, f"{plain}[[probe]]\nname = \"end\"\nwhere = {drawn}\n", diagonal / 40)
            row.append(f"{1e6 * math.hypot(*moved):.4g} ({elements:,} elements, {meshing:.0f} + {solving:.0f} s)")
        except RuntimeError as error:
            row.append(f"none: {str(error)[-60:]}")
        text += f"| {name} | {' | '.join(row)} |\n"
        print(text.splitlines()[-1], file=sys.stderr, flush=True)
    return text


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("-o", "--output", default=ROOT / "docs/measurements/quadratic.md", type=pathlib.Path)
    arguments.add_argument("--parts", default=ROOT / "../shared/parts", type=pathlib.Path)
    options = arguments.parse_args()
    with tempfile.TemporaryDirectory() as place:
        folder = pathlib.Path(place)
        text = ("# Model `quadratic`, measured\n\nWritten by `bench/accuracy/quadratic.py`, which says what is run and what the references are; the model is in\n"
                "[quadratic.md](../theory/quadratic.md). Above 0 is too soft. One thread.\n\n" + beams(folder) + strips(folder) + cantilevers(folder) + bonded(folder) + step_parts(folder, options.parts))
    write_whole(options.output, text)
    return 0


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/python3
"""Bars of each elastic law, at equilibrium and in time, beside CalculiX: the section "Elastic laws" of docs/measurements/verification.md.

    PATH=build/release/bin:$PATH bench/accuracy/laws.py

A bar of 100 x 20 x 20 mm is held at one end and pushed at the other. CalculiX gets the part from `flexel export --calculix --mesh tet`
(second-order tetrahedra of 3 mm, so the cards of the law are tested too), Flexel cells of 2.5 mm; in time the same scene with damping, until it
is at rest. What is compared is the mean displacement of the end. Needs ccx and gmsh.
"""

import json
import math
import os
import pathlib
import subprocess
import sys
import tempfile

GRAIN = """law = "orthotropic"
young = ["2 MPa", "0.4 MPa", "0.2 MPa"]
poisson = [0.37, 0.42, 0.47]
shear = ["0.3 MPa", "0.28 MPa", "0.1 MPa"]
density = "500 kg/m3"
"""
ELASTOMER = """law = "mooney-rivlin"
c10 = "0.15 MPa"
c01 = "0.05 MPa"
bulk = "1.6 MPa"
density = "1000 kg/m3"
"""
CHAINS = """law = "arruda-boyce"
mu = "0.4 MPa"
lambda_m = 3
bulk = "1.6 MPa"
density = "1000 kg/m3"
"""
GUM = """young = "1.2 MPa"
poisson = 0.3
density = "1000 kg/m3"
"""
ASKEW = f"[parts.bar]\naxes = [[{math.sqrt(0.75):.12f}, 0.5, 0], [-0.5, {math.sqrt(0.75):.12f}, 0]]\n"
CASES = [("neo-Hooke", "bent, small", GUM, "", (0, 0, 1e-3)),
         ("Mooney-Rivlin", "bent, small", ELASTOMER, "", (0, 0, 1e-3)),
         ("Mooney-Rivlin", "drawn and bent, large", ELASTOMER, "", (100, 0, 2)),
         ("Arruda-Boyce", "bent, small", CHAINS, "", (0, 0, 1e-3)),
         ("Arruda-Boyce", "drawn and bent, large", CHAINS, "", (100, 0, 2)),
         ("orthotropic, along the bar", "bent, small", GRAIN, "", (0, 0, 1e-3)),
         ("orthotropic, 30 degrees askew", "bent, small", GRAIN, ASKEW, (0, 1e-3, 0)),
         ("orthotropic, 30 degrees askew", "drawn, large", GRAIN, ASKEW, (20, 0, 0))]


def call(*words, cwd=None):
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, cwd=cwd, env={**os.environ, "OMP_NUM_THREADS": "1"})
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(map(str, words))}: {(done.stderr.strip().splitlines() or ['no message'])[-1]}")
    return done.stdout


def box(path, x, y, z):
    corners = [(a, b, c) for c in (0, z) for b in (0, y) for a in (0, x)]
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    path.write_text("\n".join([f"v {a} {b} {c}" for a, b, c in corners] + ["f " + " ".join(str(i + 1) for i in quad) for quad in quads]) + "\n")


def scene(material, axes, force):
    vector = ", ".join(f'"{each:.9g} N"' for each in force)
    return (f'material = "it"\n[materials.it]\n{material}{axes}[[fix]]\nwhere = "xmin"\n[[load]]\nwhere = "xmax"\nforce = [{vector}]\n'
            '[[probe]]\nname = "end"\nwhere = "xmax"\n')


def calculix(folder, text):
    (folder / "scene.toml").write_text(text)
    call("flexel", "export", folder / "bar.obj", "--scene", folder / "scene.toml", "--calculix", "--mesh", "tet", "--size", "3 mm", "--quiet",
         "--summary", folder / "export.json", "-o", folder / "job.inp", "--force")
    call("ccx", "job", cwd=folder)
    probe = json.loads((folder / "export.json").read_text())["probes"][0]
    weight = dict(zip(probe["nodes"], probe["weights"]))
    moved = {}
    for line in (folder / "job.dat").read_text().splitlines():
        row = line.split()
        if len(row) == 4 and row[0].isdigit():
            moved[int(row[0])] = [float(value) for value in row[1:]]  # the last increment's stay
    return [1e-3 * sum(weight[n] * moved[n][axis] for n in weight) for axis in range(3)]


def flexel(folder, text):
    """(displacement of the end m, its error bar m or None)"""
    (folder / "scene.toml").write_text(text)
    call("flexel-simulate", folder / "scene.toml", folder / "body.vtu", "--quiet", "--no-stress", "--summary", folder / "s.json", "-o", folder / "out.vtu")
    found = json.loads((folder / "s.json").read_text())
    bars = [each["bar"] for each in found.get("error_bars", {}).get("bars", []) if each["of"] == "probe end"]
    return found["probes"][0]["displacement"], bars[0] if bars else None


def main():
    print("| law | load | CalculiX, end moves mm | equilibrium, error % | bar % | in time, error % |\n|---|---|---|---|---|---|")
    worst = 0
    with tempfile.TemporaryDirectory() as place:
        folder = pathlib.Path(place)
        box(folder / "bar.obj", 100, 20, 20)
        call("flexel-voxelize", folder / "bar.obj", "--size", "2.5 mm", "--quiet", "-o", folder / "body.vtu")
        for law, load, material, axes, force in CASES:
            text = scene(material, axes, force)
            theirs = calculix(folder, text)
            ours, bar = flexel(folder, text)
            rest, _ = flexel(folder, text + '[run]\ntime = "1.5 s"\nmethod = "implicit"\nstep = "10 ms"\n[damping]\ntime = "30 ms"\n')
            size = math.hypot(*theirs)
            off = lambda found: 100 * math.dist(found, theirs) / size * (1 if math.hypot(*found) > size else -1)
            worst = max(worst, abs(off(ours)))
            print(f"| {law} | {load} | {1e3 * size:.5g} | {off(ours):+.2f} | {100 * bar / size if bar else math.nan:.2f} | {off(rest):+.2f} |", flush=True)
    return 0 if worst < 2 else 1


if __name__ == "__main__":
    sys.exit(main())

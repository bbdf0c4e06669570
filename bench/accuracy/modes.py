#!/usr/bin/python3
"""Natural frequencies and buckling loads against published values, closed forms and CalculiX: docs/measurements/modes.md.

    PATH=build/release/bin:$PATH bench/accuracy/modes.py > docs/measurements/modes.md

CalculiX gets the parts from `flexel export --calculix --mesh tet` (second-order tetrahedra), the step replaced by *FREQUENCY. Needs ccx and gmsh.
"""

import json
import math
import os
import pathlib
import re
import resource
import subprocess
import sys
import tempfile

STEEL = 'young = "200 GPa"\npoisson = 0.3\ndensity = "8000 kg/m3"\n'
LEAN = STEEL.replace("0.3", "0")
FV32 = [44.623, 130.03, 162.70, 246.05, 379.90, 391.44]
FV52 = [45.897, 109.44, 109.44, 167.89, 193.59, 206.19, 206.19]


def call(*words, cwd=None):
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, cwd=cwd, env={**os.environ, "OMP_NUM_THREADS": "2"})
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(map(str, words))}: {(done.stderr.strip().splitlines() or ['no message'])[-1]}")
    return done.stdout


def prism(outline, height):
    """OBJ of quads (x, y) raised to `height`: `outline` is rows of points, cells between them are filled where `filled` says so. mm"""
    rows, filled, groups = outline
    vertices, faces, number = [], {}, {}

    def vertex(i, j, top):
        key = (i, j, top)
        if key not in number:
            vertices.append((*rows[j][i], height if top else 0))
            number[key] = len(vertices)
        return number[key]

    def face(group, corners):
        faces.setdefault(group, []).append([vertex(*corner) for corner in corners])

    width = len(rows[0]) - 1
    inside = lambda i, j: 0 <= i < width and 0 <= j < len(rows) - 1 and filled(i, j)
    for j in range(len(rows) - 1):
        for i in range(width):
            if not inside(i, j):
                continue
            a, b, c, d = (i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)
            face("bottom", [(*p, 0) for p in (a, d, c, b)])
            face("top", [(*p, 1) for p in (a, b, c, d)])
            for (p, q), beside in (((a, b), (i, j - 1)), ((b, c), (i + 1, j)), ((c, d), (i, j + 1)), ((d, a), (i - 1, j))):
                if not inside(*beside):
                    face(groups(p, q), [(*p, 0), (*q, 0), (*q, 1), (*p, 1)])
    lines = [f"v {x:.12g} {y:.12g} {z:.12g}" for x, y, z in vertices]
    for group, quads in faces.items():
        lines += [f"g {group}"] + ["f " + " ".join(map(str, quad)) for quad in quads]
    return "\n".join(lines) + "\n"


def box(x, y, z):
    def name(p, q):
        return "held" if p[0] == q[0] == 0 else "end" if p[0] == q[0] == 1 else "low" if p[1] == q[1] == 0 else "high"
    return prism(([[(0, 0), (x, 0)], [(0, y), (x, y)]], lambda i, j: True, name), z)


def tapered():
    """FV32: 10 m long, 5 m wide at the root and 1 m at the tip, 50 mm thick."""
    def name(p, q):
        return "held" if p[0] == q[0] == 0 else "end" if p[0] == q[0] == 1 else "low" if p[1] == q[1] == 0 else "high"
    return prism(([[(0, -2500), (10000, -500)], [(0, 2500), (10000, 500)]], lambda i, j: True, name), 50)


def fork():
    """Prongs 80 x 5 mm, 10 mm apart, on a handle 40 x 5 mm; 5 mm thick."""
    xs, ys = (0, 40, 50, 130), (0, 5, 7.5, 12.5, 15, 20)
    filled = lambda i, j: (i == 0 and j == 2) or i == 1 or (i == 2 and j in (0, 4))
    return prism(([[(x, y) for x in xs] for y in ys], filled, lambda p, q: "held" if p[0] == q[0] == 0 else "side"), 5)


def quarter_tube(inner, outer, length, sides=24):
    """OBJ along x of what lies at y > 0, z > 0; groups ends, low (z = 0), high (y = 0), outside, inside. mm"""
    at = lambda r, k: (r * math.cos(math.pi / 2 * k / sides), r * math.sin(math.pi / 2 * k / sides))
    lines = [f"v {x} {y:.12g} {z:.12g}" for x in (0, length) for r in (outer, inner) for y, z in (at(r, k) for k in range(sides + 1))]
    n = sides + 1
    quads = {"low": [(1, 1 + n, 1 + 3 * n, 1 + 2 * n)], "high": [(n, 3 * n, 4 * n, 2 * n)], "ends": [], "outside": [], "inside": []}
    for k in range(1, n):
        o, i, fo, fi = k, k + n, k + 2 * n, k + 3 * n
        quads["ends"] += [(o, i, i + 1, o + 1), (fo, fo + 1, fi + 1, fi)]
        quads["outside"].append((o, o + 1, fo + 1, fo))
        quads["inside"].append((i, fi, fi + 1, i + 1))
    for group, faces in quads.items():
        lines += [f"g {group}"] + ["f " + " ".join(map(str, face)) for face in faces]
    return "\n".join(lines) + "\n"


def fix(where, axes="xyz"):
    return f'[[fix]]\nwhere = {where}\naxes = "{axes}"\n'


def group(name):
    return f'"{name}"'


def near(low, high):
    """A box selection, mm."""
    show = lambda point: "[" + ", ".join(f'"{each} mm"' for each in point) + "]"
    return f"{{ box = {{ min = {show(low)}, max = {show(high)} }} }}"


def push(where, force):
    vector = ", ".join(f'"{each} N"' for each in force)
    return f"[[load]]\nwhere = {where}\nforce = [{vector}]\n"


class Case:
    def __init__(self, folder, text):
        self.folder = folder
        (folder / "part.obj").write_text(text)

    def flexel(self, size, asks, scene, material=STEEL, model="quadratic"):
        """(modes or shapes of buckling, rigid motions, cells, seconds)"""
        exact = ["--moments"] if model == "quadratic" else []
        call("flexel-voxelize", self.folder / "part.obj", "--size", size, *exact, "--quiet", "-o", self.folder / "body.vtu", "--force")
        (self.folder / "scene.toml").write_text(f'material = "it"\nmodel = "{model}"\n[materials.it]\n{material}{scene}[run]\n{asks}\n')
        call("flexel-simulate", self.folder / "scene.toml", self.folder / "body.vtu", "--quiet", "--summary", self.folder / "s.json",
             "-o", self.folder / "out.vtu", "--force")
        found = json.loads((self.folder / "s.json").read_text())
        shapes = found["shapes"]
        values = [each.get("frequency", each.get("load_factor")) for each in shapes.get("modes", shapes.get("buckling"))]
        return values, shapes["rigid"], found["cells"], found["seconds"]

    def calculix(self, size, scene, modes, free):
        # an export needs a load and a fix; the step is replaced, and of a free body the fix goes
        text = f'material = "it"\n[materials.it]\n{STEEL}{scene or fix(group("held"))}{push(group("top"), (0, 0, 1))}'
        (self.folder / "ccx.toml").write_text(text)
        call("flexel", "export", self.folder / "part.obj", "--scene", self.folder / "ccx.toml", "--calculix", "--mesh", "tet", "--size", size,
             "--quiet", "-o", self.folder / "job.inp", "--force")
        job = (self.folder / "job.inp").read_text()
        job = job[:job.index("*STEP")]
        if free:
            job = re.sub(r"\*BOUNDARY\n(?:[^*].*\n)*", "", job)
        (self.folder / "job.inp").write_text(job + f"*STEP\n*FREQUENCY\n{modes + (6 if free else 0)}\n*END STEP\n")
        call("ccx", "job", cwd=self.folder)
        found = []
        for line in (self.folder / "job.dat").read_text().splitlines():
            row = line.split()
            if len(row) == 5 and row[0].isdigit():
                found.append(float(row[3]))
            elif "P A R T I C I P A T I O N" in line:
                break
        return found[6:] if free else found


def table(title, found, wanted, what="reference Hz", ours="Flexel Hz"):
    print(f"\n{title}\n\n| mode | {what} | {ours} | error % |\n|---|---|---|---|")
    worst = 0
    for n, (a, b) in enumerate(zip(found, wanted), 1):
        worst = max(worst, abs(a / b - 1))
        print(f"| {n} | {b:.5g} | {a:.5g} | {100 * (a / b - 1):+.2f} |", flush=True)
    return worst


def frequencies(folder):
    worst = []
    found, _, cells, _ = Case(folder, tapered()).flexel("400 mm", "modes = 6", fix(group("held")) + fix(group("bottom"), "z"))
    worst.append(table(f"NAFEMS FV32, a tapered membrane held at its root; cells of 400 mm ({cells}), 50 mm thick. Published: plane stress.", found, FV32))
    plate = Case(folder, box(10000, 10000, 1000))
    edges = "".join(fix(near(low, high), "z") for low, high in (((-1, -1, -1), (1, 10001, 1)), ((9999, -1, -1), (10001, 10001, 1)),
                                                               ((-1, -1, -1), (10001, 1, 1)), ((-1, 9999, -1), (10001, 10001, 1))))
    found, rigid, cells, _ = plate.flexel("1000 mm", "modes = 7", edges)
    theirs = plate.calculix("1000 mm", edges, 10, False)[3:]
    worst.append(table(f"NAFEMS FV52, a solid plate of 10 x 10 x 1 m held along the lower edges; cells of 1 m ({cells}); {rigid} rigid motions at 0 Hz, "
                       "as published. Reference: CalculiX, C3D10 of 1 m, held at the same edges.", found, theirs))
    print(f"\nNAFEMS gives {', '.join(map(str, FV52))} Hz (quoted from memory): 4.7 % more in the first mode than CalculiX and Flexel find. A solid that "
          "a line holds is the softer the finer its mesh. Held over the whole height of its sides it has " +
          ", ".join(f"{each:.5g}" for each in plate.flexel("1000 mm", "modes = 7", "".join(fix(group(name), "z") for name in ("held", "end", "low", "high")))[0]) +
          " Hz.")
    for title, part, size, mesh, free in (("A free cube of 100 mm", box(100, 100, 100), "25 mm", "12 mm", True),
                                          ("A bar of 200 x 20 x 10 mm, free", box(200, 20, 10), "5 mm", "5 mm", True),
                                          ("The same bar, held at one end", box(200, 20, 10), "5 mm", "4 mm", False),
                                          ("A tuning fork, free", fork(), "2.5 mm", "2.5 mm", True)):
        case = Case(folder, part)
        theirs = case.calculix(mesh, "", 8, free)[:8]
        scene = "" if free else fix(group("held"))
        found, rigid, cells, _ = case.flexel(size, "modes = 8", scene)
        worst.append(table(f"{title}; cells of {size} ({cells}){f'; {rigid} rigid motions at 0 Hz' if free else ''}. Reference: CalculiX, C3D10 of {mesh}.",
                           found, theirs))
    cube = Case(folder, box(100, 100, 100))
    exact = math.sqrt(200e9 / 2.6 / 8000) / math.sqrt(2) / 0.1
    found = min(cube.flexel("25 mm", "modes = 16", "")[0], key=lambda each: abs(each - exact))
    print(f"\nLamé's shape of a free cube is exact: {exact:.6g} Hz; cells of 25 mm give {found:.6g} Hz ({100 * (found / exact - 1):+.3f} %).")
    return worst


def buckling(folder):
    rows = []
    bar = Case(folder, box(400, 20, 10))
    bending = 200e9 * 0.02 * 0.01**3 / 12
    euler = lambda k: math.pi**2 * bending / (k * 0.4)**2
    still = fix(near((199, 9, 4), (201, 11, 6)), "x")  # a node half way, where there is no force
    pinned = fix(group("held"), "yz") + fix(group("end"), "yz")
    one = push(group("end"), (-1, 0, 0))
    rows.append(("Euler, held and free", bar.flexel("5 mm", "buckling = 1", fix(group("held")) + one, LEAN)[0][0], euler(2)))
    rows.append(("Euler, hinged at both ends", bar.flexel("5 mm", "buckling = 1", pinned + still + one + push(group("held"), (1, 0, 0)), LEAN)[0][0], euler(1)))
    rows.append(("Euler, held and hinged", bar.flexel("5 mm", "buckling = 1", fix(group("held")) + fix(group("end"), "yz") + one, LEAN)[0][0],
                 20.1907 * bending / 0.16))
    move = '[[move]]\nwhere = "end"\ndisplacement = ["-0.001 mm", "0 mm", "0 mm"]\n'
    rows.append(("Euler, held at both ends, led together", bar.flexel("5 mm", "buckling = 1", fix(group("held")) + move, LEAN)[0][0] * 200e9 * 2e-4 * 1e-6 / 0.4,
                 euler(0.5)))
    plate = Case(folder, box(100, 100, 1))
    sides = "".join(fix(group(name), "z") for name in ("held", "end", "low", "high"))
    still = fix(near((49, 49, -1), (51, 51, 3)), "xy") + fix(near((99, 49, -1), (101, 51, 3)), "y")
    found = plate.flexel("5 mm", "buckling = 1", sides + still + one + push(group("held"), (1, 0, 0)))[0][0]
    rows.append(("a square plate, simply supported, pushed one way", found, 4 * math.pi**2 * 200e9 * 0.001**3 / 12 / (1 - 0.09) / 0.1))
    ring = Case(folder, quarter_tube(49, 51, 20))
    flat = fix(group("ends"), "x") + fix(group("low"), "z") + fix(group("high"), "y")
    found = ring.flexel("5 mm", "buckling = 1", flat + '[[load]]\nwhere = "outside"\npressure = "1 MPa"\n')[0][0]
    rows.append(("a long tube, pressed from outside by a pressure that keeps its direction, MPa", found, 4 * 200e3 * 2**3 / 12 / (1 - 0.09) / (50**2 * 51)))
    print("\n## Buckling\n\nBars of 400 x 20 x 10 mm (cells of 5 mm), a plate of 100 x 100 x 1 mm and a quarter of a tube of radius 50 mm, 2 mm thick (cells of 5 mm). Closed forms of thin bars, "
          "plates and rings (the ring: 4 E I / R^3, Bodner 1958, the pressure on its outside).\n\n| case | closed form N | Flexel | error % |\n|---|---|---|---|")
    for name, ours, exact in rows:
        print(f"| {name} | {exact:.5g} | {ours:.5g} | {100 * (ours / exact - 1):+.2f} |", flush=True)
    return [abs(ours / exact - 1) for _, ours, exact in rows]


def times(folder):
    print("\n## Time\n\nTen modes of a bar of 200 x 20 x 10 mm held at one end, two threads; processor time is of all threads, with voxelizing, reading and writing. Wall time "
          "says little where the machine has other work.\n\n| model | cells | wall s | processor s |\n|---|---|---|---|")
    bar = Case(folder, box(200, 20, 10))
    spent = lambda: sum(resource.getrusage(resource.RUSAGE_CHILDREN)[:2])
    for model, size in (("cells", "0.737 mm"), ("quadratic", "2 mm")):
        before = spent()
        _, _, cells, seconds = bar.flexel(size, "modes = 10", fix(group("held")), model=model)
        print(f"| {model} | {cells} | {seconds:.1f} | {spent() - before:.1f} |", flush=True)


def main():
    print("# Natural frequencies and buckling\n\n`bench/accuracy/modes.py` prints this page. Model `quadratic`, E = 200 GPa, density 8000 kg/m3, "
          "Poisson's ratio 0.3 (bars that buckle: 0).\n\n## Natural frequencies")
    with tempfile.TemporaryDirectory() as place:
        folder = pathlib.Path(place)
        worst = frequencies(folder)
        buckled = buckling(folder)
        times(folder)
    return 0 if max(worst) < 0.01 and max(buckled) < 0.02 else 1


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/python3
"""The largest stress of model `quadratic` and its bar, beside known answers: writes docs/measurements/stresses.md.

    PATH=build/release/bin:$PATH bench/accuracy/stresses.py [--only CASE] [--random COUNT] [--closer] [--jobs N] [-o FILE]

Parts are blocks bent to shape (OBJ), on lattices that do not follow them. References: Lame's solutions of thick tubes and spheres;
NAFEMS LE1 and LE10 (sigma_yy at point D, 92.7 and -5.38 MPa); plates with a hole and with fillets, CalculiX's CPE8 run here (ccx),
refined until two meshes differ by less than .2 %. Seconds: the whole process of flexel-simulate with its bars, one thread.
--closer makes the section "Looked at closer" alone, and puts it in place of the page's.
"""

import argparse
import concurrent.futures
import json
import math
import os
import pathlib
import random
import statistics
import subprocess
import sys
import tempfile
import time

import meshio
from kept import write_whole

ROOT = pathlib.Path(__file__).resolve().parents[2]
YOUNG, POISSON = 210e9, 0.3


def call(*words, cwd=None):
    before = time.monotonic()
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, cwd=cwd, env={**os.environ, "OMP_NUM_THREADS": "1"})
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(map(str, words))}: {(done.stderr.strip().splitlines() or ['no message'])[-1]}")
    return time.monotonic() - before


def write_block(path, counts, point, group=lambda face, i, j: face):
    """OBJ (mm) of the image of [0, 1]^3 under `point`, in `counts` steps; groups s0, s1, t0, t1, z0, z1, or as `group` has them."""
    number, lines, groups = {}, [], {}
    middle, step = point(0.45, 0.45, 0.45), 1e-3
    edges = [[(b - a) for a, b in zip(middle, point(*(0.45 + step * (k == axis) for k in range(3))))] for axis in range(3)]
    mirrored = sum(edges[0][i] * (edges[1][i - 2] * edges[2][i - 1] - edges[1][i - 1] * edges[2][i - 2]) for i in range(3)) < 0

    def vertex(key):
        at = tuple(round(x, 9) for x in point(*(k / n for k, n in zip(key, counts))))
        if at not in number:
            number[at] = len(number) + 1
            lines.append("v {:.12g} {:.12g} {:.12g}".format(*at))
        return number[at]

    for axis, letter in enumerate("stz"):
        b, c = (axis + 1) % 3, (axis + 2) % 3
        for end in (0, 1):
            for i in range(counts[b]):
                for j in range(counts[c]):
                    corners = []
                    for di, dj in ((0, 0), (1, 0), (1, 1), (0, 1)):
                        key = [0, 0, 0]
                        key[axis], key[b], key[c] = end * counts[axis], i + di, j + dj
                        corners.append(vertex(key))
                    corners = [v for n, v in enumerate(corners) if v != corners[n - 1]]
                    if len(corners) > 2:
                        groups.setdefault(group(f"{letter}{end}", i, j), []).append(corners if bool(end) != mirrored else corners[::-1])
    for name, faces in groups.items():
        lines += [f"g {name}"] + ["f " + " ".join(map(str, face)) for face in faces]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def between(low, high, height):
    """Straight lines from the curve low(s) to high(s) in the plane, drawn out to `height`."""
    def point(s, t, z):
        a, b = low(s), high(s)
        return (a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), z * height)
    return point


def arc(a, b):
    """A quarter of an ellipse from (a, 0) to (0, b)."""
    return lambda s: (a * math.cos(s * math.pi / 2), b * math.sin(s * math.pi / 2))


def square(side):
    """The outer sides of a square, at the angle of the quarter circle."""
    def point(s):
        angle = s * math.pi / 2
        scale = side / max(math.cos(angle), math.sin(angle))
        return (scale * math.cos(angle), scale * math.sin(angle))
    return point


def stepped(narrow, wide, radius, length):
    """The upper side of a bar that widens at its middle: `narrow` to s = .4, the fillet to .7, the shoulder to .8, `wide`."""
    middle = length / 2

    def point(s):
        if s <= 0.4:
            return (middle * s / 0.4, narrow)
        if s <= 0.7:
            angle = (s - 0.4) / 0.3 * math.pi / 2
            return (middle + radius * math.sin(angle), narrow + radius * (1 - math.cos(angle)))
        if s <= 0.8:
            return (middle + radius, narrow + radius + (wide - narrow - radius) * (s - 0.7) / 0.1)
        return (middle + radius + (middle - radius) * (s - 0.8) / 0.2, wide)
    return point


def fix(face, axes):
    return f'[[fix]]\nwhere = "{face}"\naxes = "{axes}"\n'


def press(face, pressure):
    return f'[[load]]\nwhere = "{face}"\npressure = "{pressure:.12g} Pa"\n'


def octant(s, t, z):
    """A point of a shell of radii 20 and 40 mm: t is the radius, s the azimuth, z the polar angle."""
    radius, azimuth, polar = 20 + 20 * t, s * math.pi / 2, z * math.pi / 2
    return (radius * math.cos(azimuth) * math.cos(polar), radius * math.sin(azimuth) * math.cos(polar), radius * math.sin(polar))


def mises_of_plane_strain(radial, hoop):
    axial = POISSON * (radial + hoop)
    return math.sqrt(0.5 * ((radial - hoop)**2 + (hoop - axial)**2 + (axial - radial)**2))


PLANE_STRAIN = fix("z0", "z") + fix("z1", "z")
QUARTER = fix("s0", "y") + fix("s1", "x")


def cases():
    """Name: (counts of the surface, its points, groups or None, scene, sizes mm, reference); the reference is ("mises", Pa), ("plane", curves) or
    ("principal", which, Pa, point D mm)."""
    inner, outer, pressure = 20.0, 40.0, 10e6
    hoop = pressure * (outer**2 + inner**2) / (outer**2 - inner**2)
    hole = (arc(5, 5), square(50))
    fillet = (lambda s: (100 * s, 0.0), stepped(15, 30, 6, 100))
    bands = [0, 0.29, 0.31, 0.6]

    def le10(s, t, z):
        x, y, _ = between(arc(2000, 1000), arc(3250, 2750), 1)(s, t, 0)
        return (x, y, 1000 * bands[round(3 * z)])

    return {
        "tube": ((48, 1, 1), between(arc(inner, inner), arc(outer, outer), 10), None, QUARTER + PLANE_STRAIN + press("t0", pressure), (20, 13, 10, 7, 5, 3.4, 2.5),
                 ("mises", mises_of_plane_strain(-pressure, hoop))),
        "sphere": ((32, 1, 32), octant, None, fix("s0", "y") + fix("s1", "x") + fix("z0", "z") + press("t0", pressure), (13, 10, 7, 5, 3.4),
                   ("mises", 1.5 * pressure * outer**3 / (outer**3 - inner**3))),
        "hole": ((48, 1, 1), between(*hole, 5), None, QUARTER + PLANE_STRAIN + '[[load]]\nwhere = "xmax"\npressure = "-10 MPa"\n', (5, 3.4, 2.5, 1.7, 1.25), ("plane", hole)),
        "fillet": ((60, 1, 1), between(*fillet, 5), None, fix("s0", "x") + fix("t0", "y") + PLANE_STRAIN + press("s1", -10e6), (6, 4, 3, 2, 1.5), ("plane", fillet)),
        "LE1": ((48, 1, 1), between(arc(2000, 1000), arc(3250, 2750), 100), None, QUARTER + fix("z0", "z") + press("t1", -10e6), (400, 280, 200, 140, 100), ("principal", 0, 92.7e6, (2000, 0, 50))),
        "LE10": ((48, 1, 3), le10, lambda face, i, j: "band" if face == "t1" and i == 1 else "t1" if face == "t1" else face,
                 QUARTER + '[[fix]]\nwhere = ["t1", "band"]\naxes = "xy"\n' + fix("band", "z") + press("z1", 1e6), (600, 400, 300, 200, 150, 100), ("principal", 2, -5.38e6, (2000, 0, 600))),
    }


class Shapes:
    """Cases as of cases(), under 10 MPa, by their name. Of a "plane" the third says which loads: "hole" or "fillet"."""

    def __init__(self):
        self.made = {}

    def tube(self, inner, outer, sizes, outside=False):
        share = 10e6 / (outer**2 - inner**2)
        true = mises_of_plane_strain(0, -2 * share * outer**2) if outside else mises_of_plane_strain(-10e6, share * (outer**2 + inner**2))
        self.made[f"tube {inner:g}, {outer:g}, {'outer' if outside else 'inner'}"] = (
            (48, 1, 1), between(arc(inner, inner), arc(outer, outer), 0.4 * inner), None,
            QUARTER + PLANE_STRAIN + press("t1" if outside else "t0", 10e6), sizes, ("mises", true))

    def sphere(self, inner, outer, sizes):
        def point(s, t, z):
            return tuple(x * (inner + (outer - inner) * t) / (20 + 20 * t) for x in octant(s, t, z))
        self.made[f"sphere {inner:g}, {outer:g}"] = (
            (32, 1, 32), point, None, fix("s0", "y") + fix("s1", "x") + fix("z0", "z") + press("t0", 10e6), sizes,
            ("mises", 15e6 * outer**3 / (outer**3 - inner**3)))

    def hole(self, a, b, side, sizes):
        curves = (arc(a, b), square(side))
        self.made[f"hole {a:g}, {b:g} in {side:g}"] = (
            (48, 1, 1), between(*curves, 0.8 * min(a, b)), None,
            QUARTER + PLANE_STRAIN + '[[load]]\nwhere = "xmax"\npressure = "-10 MPa"\n', sizes, ("plane", curves, "hole"))

    def fillet(self, narrow, wide, radius, sizes):
        curves = (lambda s: (100 * s, 0.0), stepped(narrow, wide, radius, 100))
        self.made[f"fillet {radius:g}, {narrow:g} to {wide:g}"] = (
            (60, 1, 1), between(*curves, radius), None, fix("s0", "x") + fix("t0", "y") + PLANE_STRAIN + press("s1", -10e6),
            sizes, ("plane", curves, "fillet"))


def unseen_cases():
    """The bars' factors were not chosen on these."""
    shapes = Shapes()
    shapes.tube(16, 28, (7.3, 4.2))
    shapes.tube(22, 44, (10.5, 6.1))
    shapes.tube(14, 26, (7.1, 4.3), True)
    shapes.sphere(18, 34, (8.7, 5.7))
    shapes.sphere(14, 40, (9.3, 6.3))
    shapes.hole(7, 7, 45, (5.3, 3.3))
    shapes.hole(9, 6, 42, (4.9, 3.1))
    shapes.hole(10, 12, 40, (6.7, 4.4))
    shapes.fillet(14, 26, 8, (5.3, 3.4))
    shapes.fillet(16, 36, 14, (7.7, 5.1))
    return shapes.made


def random_cases(count):
    """As many of each of four shapes, measures and sizes by chance, the same ones in every run: walls of 1 to 5 cells, notches whose radius is 1 to 4 cells."""
    chance, shapes = random.Random(21), Shapes()
    between_them = lambda low, high: round(chance.uniform(low, high), 2)
    cells = lambda low, high: math.exp(chance.uniform(math.log(low), math.log(high)))
    while len(shapes.made) < count:
        kind = len(shapes.made) % 4
        inner = between_them(12, 24)
        if kind == 0:
            outer = round(inner * chance.uniform(1.5, 2.3), 2)
            shapes.tube(inner, outer, (round((outer - inner) / cells(1, 5), 2),), chance.random() < 0.5)
        elif kind == 1:
            outer = round(inner * chance.uniform(1.6, 2.6), 2)
            shapes.sphere(inner, outer, (round((outer - inner) / cells(1.5, 4), 2),))
        elif kind == 2:
            along = between_them(6, 11)
            across = round(along * chance.uniform(0.6, 1.4), 2)
            shapes.hole(along, across, between_them(36, 50), (round(min(along, across) / cells(1, 4), 2),))
        else:
            narrow, radius = between_them(12, 17), between_them(6, 14)
            shapes.fillet(narrow, round(narrow + radius + chance.uniform(3, 9), 2), radius, (round(radius / cells(1, 4), 2),))
    return shapes.made


def plane_reference(folder, low, high, loaded, held, counts, graded):
    """Largest von Mises stress (Pa) of the shape between two curves (mm) in plane strain: CalculiX's CPE8, nodal values. `loaded`(i, j, n, m): whether the
    edge from node (i, j) on bears 10 MPa outwards along x; `held`(x, y): the axes that a node at (x, y) is held along;
    `graded`: elements get smaller towards `low` with this power."""
    n, m = counts
    number, points = {}, []

    def node(i, j):
        if (i, j) not in number:
            a, b, t = low(i / 2 / n), high(i / 2 / n), (j / 2 / m)**graded
            number[i, j] = len(number) + 1
            points.append((a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])))
        return number[i, j]

    at = lambda i, j: points[node(i, j) - 1]
    area = lambda quad: sum(at(*quad[k - 1])[0] * at(*quad[k])[1] - at(*quad[k])[0] * at(*quad[k - 1])[1] for k in range(4))
    elements = []
    for i in range(0, 2 * n, 2):
        for j in range(0, 2 * m, 2):
            corners = [(i, j), (i + 2, j), (i + 2, j + 2), (i, j + 2)]
            corners = corners if area(corners) > 0 else corners[::-1]
            elements.append([node(*c) for c in corners] + [node((a[0] + b[0]) // 2, (a[1] + b[1]) // 2) for a, b in zip(corners, corners[1:] + corners[:1])])
    force = {}
    for i, j in list(number):
        for a, b in (((i + 1, j), (i + 2, j)), ((i, j + 1), (i, j + 2))):
            if i % 2 or j % 2 or b not in number or not loaded(i, j, b, n, m):
                continue
            width = 10 * abs(at(*b)[1] - at(i, j)[1])  # N for 1 mm of thickness
            for key, share in (((i, j), 1 / 6), (a, 2 / 3), (b, 1 / 6)):
                force[number[key]] = force.get(number[key], 0) + share * width
    text = "*NODE,NSET=ALL\n" + "".join(f"{k + 1},{x:.12g},{y:.12g},0\n" for k, (x, y) in enumerate(points))
    text += "*ELEMENT,TYPE=CPE8,ELSET=ALL\n" + "".join(f"{e + 1}," + ",".join(map(str, each)) + "\n" for e, each in enumerate(elements))
    text += f"*MATERIAL,NAME=M\n*ELASTIC\n{YOUNG / 1e6},{POISSON}\n*SOLID SECTION,ELSET=ALL,MATERIAL=M\n1.\n*STEP\n*STATIC\n*BOUNDARY\n"
    text += "".join(f"{k + 1},{axis}\n" for k, place in enumerate(points) for axis in held(*place))
    text += "*CLOAD\n" + "".join(f"{k},1,{f:.12g}\n" for k, f in force.items()) + "*EL FILE,OUTPUT=2D\nS\n*END STEP\n"
    (folder / "plane.inp").write_text(text)
    call("ccx", "plane", cwd=folder)
    largest, inside = 0, False
    for line in (folder / "plane.frd").read_text().splitlines():
        if line.startswith(" -4"):
            inside = "STRESS" in line
        elif inside and line.startswith(" -1"):
            xx, yy, zz, xy, yz, zx = (float(line[13 + 12 * k:25 + 12 * k]) for k in range(6))
            largest = max(largest, 0.5 * ((xx - yy)**2 + (yy - zz)**2 + (zz - xx)**2) + 3 * (xy**2 + yz**2 + zx**2))
        elif inside and line.startswith(" -3"):
            inside = False
    return 1e6 * math.sqrt(largest)


def reference(folder, name, given):
    """Pa"""
    if given[0] != "plane":
        return given[1] if given[0] == "mises" else given[2]
    low, high = given[1]
    kind = given[2] if len(given) > 2 else name
    if kind == "hole":
        loaded = lambda i, j, b, n, m: j == 2 * m and b[1] == j and b[0] <= n
    else:
        loaded = lambda i, j, b, n, m: i == 2 * n and b[0] == i
    held = lambda x, y: ([1] if abs(x) < 1e-9 else []) + ([2] if abs(y) < 1e-9 else [])
    found = []
    for n, m in ((20, 20), (40, 40), (80, 80), (160, 160)):
        found.append(plane_reference(folder, low, high, loaded, held, (n, m), 2 if kind == "hole" else 1))
        print(f"{name}: CPE8 {n} x {m}: {found[-1] / 1e6:.4f} MPa", file=sys.stderr, flush=True)
        if len(found) > 1 and abs(found[-1] / found[-2] - 1) < 2e-3:
            return found[-1]
    raise RuntimeError(f"{name}: CalculiX does not settle")


def at_point(folder, where, which):
    """The principal stress at the vertex that rests at `where` (mm), Pa."""
    call("flexel-map", folder / "out.vtu", "--quiet", "--attributes", "--force", "-o", folder / "mapped.vtu")
    mesh = meshio.read(folder / "mapped.vtu")
    rest = mesh.points * 1e-3 - mesh.point_data["displacement"]
    nearest = min(range(len(rest)), key=lambda v: math.dist(rest[v], [1e-3 * x for x in where]))
    return mesh.point_data["principal_stress"][nearest][which]


def run_case(folder, name, case, sizes):
    """Rows: size mm, cells, value, bar (or None) and what it lies beside, seconds; a run that failed has its message in place of them."""
    write_case(folder, case)
    given, rows = case[5], []
    for size in sizes:
        call("flexel-voxelize", folder / "part.obj", "--size", f"{size} mm", "--align", "none", "--moments", "--threads", "1", "--quiet", "--force", "-o", folder / "body.vtu")
        try:
            seconds = call("flexel-simulate", folder / "scene.toml", folder / "body.vtu", "--threads", "1", "--quiet", "--force", "--summary", folder / "s.json", "-o", folder / "out.vtu")
        except RuntimeError as error:
            rows.append((size, str(error).rsplit("error: ", 1)[-1]))
            print(name, *rows[-1], file=sys.stderr, flush=True)
            continue
        found = json.loads((folder / "s.json").read_text())
        said = found.get("error_bars", {}).get("largest_von_mises")
        value = at_point(folder, given[3], given[1]) if given[0] == "principal" else found["largest_von_mises"]
        # the peak and the point of LE1 are one place; LE10's largest stress is elsewhere
        bar = said["bar"] if said and name != "LE10" else None
        rows.append((size, found["cells"], value, bar, found.get("largest_von_mises_beside", ""), seconds))
        print(name, *rows[-1], said and said["values"], file=sys.stderr, flush=True)
    return rows


CLOSER = "## Looked at closer"
CLOSER_SIZES = {"tube": (20, 13, 10), "sphere": (13, 10), "hole": (5, 3.4, 2.5), "fillet": (6, 4, 3), "hole 7, 7 in 45": (5.3, 3.3), "hole 9, 6 in 42": (4.9,),
                "hole 10, 12 in 40": (6.7, 4.4), "fillet 8, 14 to 26": (5.3, 3.4), "fillet 14, 16 to 36": (7.7, 5.1)}


def write_case(folder, case):
    counts, points, group, loads, _, _ = case
    write_block(folder / "part.obj", counts, points, *([group] if group else []))
    (folder / "scene.toml").write_text(f'material = "steel"\nmodel = "quadratic"\n[materials.steel]\nyoung = "{YOUNG} Pa"\npoisson = {POISSON}\n'
                                       f'density = "7800 kg/m3"\nyield = "250 MPa"\n{loads}')


def run_closer(folder, name, case, size):
    """Size mm, then of a run and of one that looks closer: cells, value Pa, bar Pa or None, seconds, cells of all finer lattices."""
    write_case(folder, case)
    row = [size]
    for more in ((), ("--refine-stress",)):
        seconds = call("flexel", "deform", folder / "part.obj", "--scene", folder / "scene.toml", "--size", f"{size} mm", "--threads", "1", "--quiet", "--force", *more,
                       "--summary", folder / "s.json", "-o", folder / "out.stl")
        found = json.loads((folder / "s.json").read_text())["simulate"]
        said = found.get("error_bars", {}).get("largest_von_mises")
        row.append((found["cells"], found["largest_von_mises"], said["bar"] if said else None, seconds, found.get("largest_von_mises_local", {}).get("cells", 0)))
    print(name, *row, found.get("largest_von_mises_local", found.get("largest_von_mises_local_none")), file=sys.stderr, flush=True)
    return row


def closer_table(results):
    """Its lines; the bars' widths in %, how many hold, the largest error."""
    text = ("| case | reference MPa | size mm | cells | error % | bar % | s | closer: error % | bar % | holds | cells more | s |\n|---|---|---|---|---|---|---|---|---|---|---|---|\n")
    widths, held, worst = [], 0, 0
    for name, (true, rows) in results.items():
        for size, (cells, value, bar, seconds, _), (_, closer, narrow, longer, more) in rows:
            share = lambda width, of: f"{100 * width / of:.1f}" if width else "none"
            holds = narrow and abs(closer - true) <= narrow
            widths += [100 * narrow / closer] if narrow else []
            held, worst = held + bool(holds), max(worst, abs(closer / true - 1))
            text += (f"| {name} | {true / 1e6:.4g} | {size} | {cells:,} | {100 * (value / true - 1):+.1f} | {share(bar, value)} | {seconds:.1f} | "
                     f"{100 * (closer / true - 1):+.1f} | {share(narrow, closer)} | {'yes' if holds else 'no' if narrow else ''} | {more:,} | {longer:.1f} |\n")
    return text, widths, held, worst


def closer_section(results):
    text, widths, held, worst = closer_table(results)
    return (f"{CLOSER}\n\n`flexel deform --refine-stress` ([local-stress.md](../theory/local-stress.md)) beside `flexel deform` without it, on coarse lattices aligned to the\n"
            f"part. Seconds: the whole process, bars included; cells more: of all finer lattices together.\n\n{text}\n{held} of {len(widths)} bars hold; their median is {statistics.median(widths):.1f} %, the largest error {100 * worst:.1f} %.\n")


def measure_closer(options, in_a_folder):
    chosen = {name: case for name, case in {**cases(), **unseen_cases()}.items() if name in CLOSER_SIZES and (not options.only or name in options.only)}
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        runs = {(name, size): pool.submit(in_a_folder, run_closer, name, case, size) for name, case in chosen.items() for size in CLOSER_SIZES[name]}
        true = {name: pool.submit(in_a_folder, reference, name, case[5]) for name, case in chosen.items()}
        return {name: (true[name].result(), [runs[name, size].result() for size in CLOSER_SIZES[name]]) for name in chosen}


def table(results):
    """The cases that the bars' factors were chosen on, then the others."""
    listed = {"": cases(), "## Other cases\n\nThe bars' factors were not chosen on these. Radii and widths in mm.": unseen_cases()}
    left, text = dict(results), ""
    for head, which in listed.items():
        some = {name: left.pop(name) for name in which if name in left}
        if some or not head:  # the page's head, whatever was run
            text += (f"\n{head}\n\n" + one_table(some).split("\n\n", 2)[2]) if head else one_table(some)
    if left:
        text += ("\n## Cases at random\n\nMeasures (mm) and sizes by chance (`--random`); the bars' factors were not chosen on these.\n\n" +
                 one_table(left).split("\n\n", 2)[2])
    return text


def one_table(results):
    text = ("# Stresses of model `quadratic`, measured\n\nWritten by `bench/accuracy/stresses.py`, which says what is run and what the references are. Value: the largest von Mises\n"
            "stress; of LE1 and LE10 sigma_yy at point D. Bar: that of the run, of the largest von Mises stress. One thread, bars included, on a machine that other jobs used.\n\n"
            "| case | reference MPa | size mm | cells | value MPa | error % | bar % | holds | s |\n|---|---|---|---|---|---|---|---|---|\n")
    held, barred, widths = 0, 0, []
    for name, (true, rows) in results.items():
        for row in rows:
            if len(row) == 2:
                text += f"| {name} | {true / 1e6:.4g} | {row[0]} | | {row[1]} | | | | |\n"
                continue
            size, cells, value, bar, beside, seconds = row
            said = f"{100 * bar / value:.1f}" if bar else f"none, beside {beside}" if beside else "none"
            holds = bar and abs(value - true) <= bar
            widths += [100 * bar / value] if bar else []
            barred, held = barred + bool(bar), held + bool(holds)
            text += (f"| {name} | {true / 1e6:.4g} | {size} | {cells:,} | {value / 1e6:.4g} | {100 * (value / true - 1):+.1f} | {said} | "
                     f"{'yes' if holds else 'no' if bar else ''} | {seconds:.1f} |\n")
    return text + (f"\n{held} of {barred} bars hold; their median is {statistics.median(widths):.1f} %.\n" if widths else "")


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("-o", "--output", default=ROOT / "docs/measurements/stresses.md", type=pathlib.Path)
    arguments.add_argument("--only", action="append")
    arguments.add_argument("--random", type=int, default=0, metavar="COUNT", help="add so many cases, of measures and sizes by chance")
    arguments.add_argument("--jobs", type=int, default=1, help="cases at a time")
    arguments.add_argument("--closer", action="store_true", help="the section of the closer look alone")
    arguments.add_argument("--closer-table", metavar="CASE", help="print that section's table of one case, and write nothing")
    arguments.add_argument("--list", action="store_true", help="print the cases of that section")
    options = arguments.parse_args()
    if options.list:
        print("\n".join(CLOSER_SIZES))
        return 0

    def in_a_folder(function, *words):
        with tempfile.TemporaryDirectory() as place:
            return function(pathlib.Path(place), *words)

    if options.closer_table:
        options.only = [options.closer_table]
        print(closer_table(measure_closer(options, in_a_folder))[0], end="")
        return 0
    closer = closer_section(measure_closer(options, in_a_folder))
    if options.closer:
        page = options.output.read_text(encoding="utf-8") if options.output.exists() else ""
        write_whole(options.output, page.split(CLOSER)[0].rstrip("\n") + "\n\n" + closer)
        return 0
    chosen = {name: case for name, case in {**cases(), **unseen_cases(), **random_cases(options.random)}.items()
              if not options.only or name in options.only}
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        # the finest first: they take longest
        runs = {(name, size): pool.submit(in_a_folder, run_case, name, case, [size])
                for back in range(1, 8) for name, case in chosen.items() for size in case[4][-back:][:1] if back <= len(case[4])}
        true = {name: pool.submit(in_a_folder, reference, name, case[5]) for name, case in chosen.items()}
        results = {name: (true[name].result(), [row for size in case[4] for row in runs[name, size].result()]) for name, case in chosen.items()}
    write_whole(options.output, table(results) + "\n" + closer)
    return 0


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/python3
"""Flexel beside published measurements: writes docs/measurements/experiments.md with its figures.

    PATH=build/release/bin:$PATH bench/accuracy/experiments.py [--only NAME] [--keep FOLDER] [-o FILE]

What was measured stands in bench/accuracy/measured/NAME.toml: dimensions, constants, values, where they were published, where they were read and
what was not read. The scenes stand here. Every value is computed on two lattices, so that an error of the lattice is seen beside that of the model;
nothing is fitted. With --keep each experiment is written to FOLDER when it is done, and a later run takes it from there. Figures are SVG by gnuplot,
in a folder beside FILE named after it.
"""

import argparse
import csv
import json
import math
import pathlib
import shutil
import subprocess
import sys
import tempfile
import tomllib

from kept import Kept, write_whole

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path.insert(0, str(ROOT / "tests/programs"))
from shapes import ascii_stl, box_triangles, obj_bar  # noqa: E402

THREADS = []  # what --threads asks for
FIELDS = ("title", "kind", "source", "read", "not_read", "what", "remarks")


def command(*words):
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(map(str, words))}: {(done.stderr.strip().splitlines() or ['no message'])[-1]}")
    return done.stdout


def measured(name):
    """What was measured, of measured/NAME.toml; every one tells the same of its source."""
    data = tomllib.loads((HERE / "measured" / f"{name}.toml").read_text(encoding="utf-8"))
    missing = [field for field in FIELDS if not data.get(field)]
    if missing:
        raise RuntimeError(f"measured/{name}.toml has no {', '.join(missing)}")
    return data


# Scenes


def quoted(values, unit):
    return "[" + ", ".join(f'"{value:.12g} {unit}"' for value in values) + "]"


def box(low, high):
    """Selection of what lies in a box, mm."""
    return f"{{ box = {{ min = {quoted(low, 'mm')}, max = {quoted(high, 'mm')} }} }}"


def fix(where, axes="xyz"):
    return f'[[fix]]\nwhere = {where if where.startswith("{") else chr(34) + where + chr(34)}\naxes = "{axes}"\n'


def probe(name, at):
    return f'[[probe]]\nname = "{name}"\nat = {quoted(at, "mm")}\n'


def material(name, **keys):
    return f"[materials.{name}]\n" + "".join(f"{key} = {json.dumps(value)}\n" for key, value in keys.items())


class Case:
    """A part in a folder of its own, on a lattice of a given spacing [mm], and runs of scenes on it."""

    def __init__(self, part, size, *options, suffix="obj"):
        self.place = tempfile.TemporaryDirectory()
        self.folder = pathlib.Path(self.place.name)
        file = self.folder / f"part.{suffix}"
        file.write_bytes(part if isinstance(part, bytes) else part.encode())
        command("flexel-voxelize", file, "--size", f"{size}mm", "--quiet", *options, "-o", self.folder / "rest.vtu")

    def run(self, scene):
        """Summary; timed runs also leave their books."""
        (self.folder / "scene.toml").write_text(scene)
        history = ["--history", self.folder / "h.csv"] if "\ntime =" in scene.split("[run]")[-1] else []
        command("flexel-simulate", self.folder / "scene.toml", self.folder / "rest.vtu", "-o", self.folder / "out.vtu", "--force", "--quiet",
                "--summary", self.folder / "s.json", "--no-estimate", "--no-stress", *THREADS, *history)
        return json.loads((self.folder / "s.json").read_text())

    def books(self):
        with (self.folder / "h.csv").open(newline="") as file:
            return [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]


def probes(summary):
    return {each["name"]: each["displacement"] for each in summary["probes"]}


# The experiments: each gives rows (series, what, measured, on the coarser lattice, on the finer one), curves to draw (x, measured, computed), and how it was run


def block(data):
    """Natural frequencies [kHz] of a free block."""
    of = data["block"]
    mu, lam = of["c44"], of["c11"] - 2 * of["c44"]
    scene = 'material = "it"\nmodel = "quadratic"\n' + material(
        "it", young=f"{mu * (3 * lam + 2 * mu) / (lam + mu)!r} GPa", poisson=lam / 2 / (lam + mu), density=f"{of['density']} kg/m3")
    scene += f"[run]\nmodes = {len(of['frequencies'])}\n"
    found = []
    for size in (2.5, 1.7):
        case = Case(ascii_stl(box_triangles(of["size"])), size, "--moments", suffix="stl")
        summary = case.run(scene)
        found.append([mode["frequency"] / 1e3 for mode in summary["shapes"]["modes"]])
    rows = [("frequency", f"mode {k}", *each) for k, each in enumerate(zip(of["frequencies"], *found), 1) if k not in of["doubtful"]]
    points = [(float(title.split()[1]), value, fine) for _, title, value, _, fine in rows]
    return {"rows": rows, "unit": "kHz", "across": "mode", "curves": {"frequency": points}, "how": "Model `quadratic`, cells of 2.5 and 1.7 mm, `modes = 42`."}


def beam(data):
    """Fall [mm] of markers at the end of a soft beam."""
    of = data["beam"]
    length, _, high = of["size"]
    cases = [Case(obj_bar(of["size"])[0], size) for size in (5, 3)]
    rows, curves = [], {name: [] for name in of["markers"]}
    for case in data["case"]:
        scene = 'material = "it"\n' + material("it", young=f"{of['young']} Pa", poisson=of["poisson"], density=f"{of['density']} kg/m3")
        scene += fix("held") + f'[gravity]\nacceleration = [0, 0, "-{of["gravity"]} m/s2"]\n'
        if case["force"]:
            edge = box((length - 0.01, -1, high - 0.01), (length + 0.01, of["size"][1] + 1, high + 0.01))
            scene += f'[[load]]\nwhere = {edge}\nforce = ["0 N", "0 N", "-{case["force"]} N"]\n'
        scene += "".join(probe(name, at) for name, at in of["markers"].items()) + "[run]\nload_steps = 4\n"
        found = [probes(each.run(scene)) for each in cases]
        for name in of["markers"]:
            ours = [-1e3 * each[name][2] for each in found]
            mean = sum(case["down"][name]) / len(case["down"][name])
            rows.append((case["name"], f"{name} marker ({' and '.join(map(str, case['down'][name]))})", mean, *ours))
            curves[name].append((case["force"], mean, ours[1]))
    return {"rows": rows, "unit": "mm", "across": "hung weight [N]", "curves": curves,
            "how": "Equilibrium, model `cells`, cells of 5 and 3 mm, four load steps, everything else by default."}


def drawn(data):
    """Nominal stress [MPa] of rubber under pulls along one and two axes, by three laws."""
    of = data["rubber"]
    unit = of["unit"] / 1e6
    stress_at = {stretch: stress * unit for stretch, stress in of["uniaxial"]}
    reduced = [stress_at[a] / (a - a**-2) for a in (of["first"], of["second"])]
    slope = (reduced[0] - reduced[1]) / (1 / of["first"] - 1 / of["second"])  # Mooney's plot: 2 C10 + 2 C01 / a
    constants = {"neo-Hooke": (reduced[0] / 2, 0.0), "Mooney-Rivlin": ((reduced[0] - slope / of["first"]) / 2, slope / 2)}
    matter = {law: {"law": "mooney-rivlin", "c10": f"{c10!r} MPa", "c01": f"{c01!r} MPa", "bulk": f"{of['bulk'] * 2 * (c10 + c01)!r} MPa"}
              for law, (c10, c01) in constants.items()}
    matter["Arruda-Boyce"] = {"law": "arruda-boyce", "mu": f"{of['chains']!r} MPa", "lambda_m": math.sqrt(of["links"]), "bulk": f"{of['bulk'] * of['chains']!r} MPa"}
    lengths = (10.0, 10.0, 10.0)
    cases = [Case(ascii_stl(box_triangles(lengths)), size, suffix="stl") for size in (5, 2.5)]
    rows, curves = [], {}
    for law, keys in matter.items():
        head = 'material = "it"\n' + material("it", density="950 kg/m3", **keys)
        for test, axes in (("one way", "x"), ("two ways", "xy")):
            points = []
            for stretch, stress in of["uniaxial" if axes == "x" else "biaxial"]:
                scene = head + fix("xmin", "x") + fix("ymin", "y") + fix("zmin", "z")
                for axis in axes:
                    led = ", ".join(f'"{10 * (stretch - 1)!r} mm"' if each == axis else '"free"' for each in "xyz")
                    scene += f'[[move]]\nname = "pull {axis}"\nwhere = "{axis}max"\ndisplacement = [{led}]\n'
                scene += f"[run]\nload_steps = {max(1, math.ceil(4 * (stretch - 1)))}\n"
                ours = []
                for case in cases:
                    pull = next(each for each in case.run(scene)["reactions"] if each["name"] == "pull x")
                    ours.append(abs(pull["force"][0]) / 100e-6 / 1e6)
                rows.append((f"{law}, {test}", f"to {stretch}", stress * unit, *ours))
                points.append((stretch, stress * unit, ours[1]))
            curves[f"{test}, {law}"] = points
    told = "; ".join(f"{law} C10 = {c10:.4f}, C01 = {c01:.4f} MPa" for law, (c10, c01) in constants.items())
    return {"rows": rows, "unit": "MPa", "across": "stretch", "curves": curves,
            "how": f"Equilibrium, model `cells`, laws `mooney-rivlin` ({told}) and `arruda-boyce`, a cube of 8 cells and of 64."}


def quarter_rod(radius, length, sides=24):
    """OBJ of a quarter of a cylinder along z, mm, with groups bottom, top, side, xz and yz."""
    ring = [(0.0, 0.0)] + [(radius * math.cos(math.pi / 2 * k / sides), radius * math.sin(math.pi / 2 * k / sides)) for k in range(sides + 1)]
    lines = [f"v {x:.12g} {y:.12g} {z:.12g}" for z in (0, length) for x, y in ring]
    up = len(ring)
    faces = {"xz": [(1, 2, 2 + up, 1 + up)], "yz": [(1, 1 + up, 2 * up, up)], "bottom": [], "top": [], "side": []}
    for k in range(2, up):
        faces["bottom"].append((1, k + 1, k))
        faces["top"].append((1 + up, k + up, k + 1 + up))
        faces["side"].append((k, k + 1, k + 1 + up, k + up))
    for group, each in faces.items():
        lines += [f"g {group}"] + ["f " + " ".join(map(str, face)) for face in each]
    return "\n".join(lines) + "\n"


def line_through(points):
    """Intercept, slope and root mean square deviation of the line of least squares."""
    n, sx, sy = len(points), sum(x for x, _ in points), sum(y for _, y in points)
    slope = (n * sum(x * y for x, y in points) - sx * sy) / (n * sum(x * x for x, _ in points) - sx * sx)
    start = (sy - slope * sx) / n
    return start, slope, math.sqrt(sum((y - start - slope * x) ** 2 for x, y in points) / n)


def rod(data):
    """By how much [%] rods that hit a wall are shorter after it."""
    of = data["rod"]
    library = next(each for each in json.loads(command("flexel", "materials", "--json")) if each["name"] == "aluminium 6061")
    start, slope, off = line_through([(strain - stress * 1e6 / library["young"], stress) for strain, stress in of["flow"]])
    scene = 'material = "aluminium 6061"\n' + f'[plasticity]\nyield = "{start!r} MPa"\nhardening = "{slope!r} MPa"\n'
    scene += fix("xz", "y") + fix("yz", "x") + '[[plane]]\npoint = ["0 mm", "0 mm", "0 mm"]\nnormal = [0, 0, 1]\n'
    scene += probe("top", (0, 0, of["length"])) + probe("foot", (0, 0, 0))
    found, stopped = [], []
    for across in (6, 8):
        case = Case(quarter_rod(of["diameter"] / 2, of["length"]), of["diameter"] / 2 / across)
        lengths = []
        for speed, _ in of["wilkins"]:
            everything = box((-1e3, -1e3, -1e3), (1e3, 1e3, 1e3))
            try:
                case.run(scene + f'[[velocity]]\nwhere = {everything}\nvelocity = ["0 m/s", "0 m/s", "-{speed} m/s"]\n' +
                         '[run]\ntime = "55 us"\nhistory_every = "0.5 us"\n')
            except RuntimeError as error:  # cells at the rim of the foot fold: told on the page
                if ": error: step " not in str(error):
                    raise
                stopped.append(f"{speed} m/s with {across} cells ({str(error).split(': error: ')[-1].split(':')[0]})")
                lengths.append(None)
                continue
            after = [row for row in case.books() if row["time [s]"] > 38e-6]  # it has left the wall and swings about its final length
            lengths.append(-1e5 * sum(row["top z [m]"] - row["foot z [m]"] for row in after) / len(after) / of["length"])
        found.append(lengths)
    shorter = {name: [(speed, 100 * (1 - share)) for speed, share in of[name]] for name in ("wilkins", "gust", "house")}
    rows = [("shortening", f"{speed} m/s", value, *ours) for (speed, value), *ours in zip(shorter["wilkins"], *found) if None not in ours]
    curves = {"Wilkins and Guinan": [(*each, ours) for each, ours in zip(shorter["wilkins"], found[1])],
              "Gust": [(*each, None) for each in shorter["gust"]], "House": [(*each, None) for each in shorter["house"]]}
    return {"rows": rows, "unit": "% shorter", "across": "speed [m/s]", "curves": curves,
            "how": f"Explicit steps, model `cells`, a quarter of the rod, 6 and 8 cells through its radius, the run's own steps. Yield stress {start:.1f} MPa, "
                   f"hardening {slope:.1f} MPa: the measured curve is off that line by {off:.1f} MPa (root mean square). Stopped with exit code 3: "
                   f"{', '.join(stopped) or 'none of these'}."}


def half_ball(radius, lift, rings=32):
    """Triangles of the half y > 0 of a sphere, mm, its lowest point at z = lift."""
    at = lambda i, j: (radius * math.sin(math.pi * i / rings) * math.cos(math.pi * j / rings), radius * math.sin(math.pi * i / rings) * math.sin(math.pi * j / rings),
                       radius * math.cos(math.pi * i / rings) + radius + lift)
    exact = lambda i, j: (at(i, j)[0], 0.0 if j in (0, rings) else at(i, j)[1], at(i, j)[2]) if 0 < i < rings else (0.0, 0.0, at(i, j)[2])
    triangles = []
    for i in range(rings):
        for j in range(rings):
            a, b, c, d = exact(i, j), exact(i + 1, j), exact(i + 1, j + 1), exact(i, j + 1)
            triangles += ([] if i == rings - 1 else [[a, b, c]]) + ([] if i == 0 else [[a, c, d]])
    rim = [exact(i, 0) for i in range(rings + 1)] + [exact(i, rings) for i in range(rings - 1, 0, -1)]
    middle = (0.0, 0.0, radius + lift)
    return triangles + [[middle, q, p] for p, q in zip(rim, rim[1:] + rim[:1])]


def after_bounce(books, since):
    """Mean velocity [m/s] along x and z, and spin [rad/s] about y, of the ball after it has left."""
    first, last = next(row for row in books if row["time [s]"] >= since), books[-1]
    time = last["time [s]"] - first["time [s]"]
    speed = lambda name, axis: (last[f"{name} {axis} [m]"] - first[f"{name} {axis} [m]"]) / time
    x = (speed("left", "x") + speed("right", "x")) / 2
    return x, (speed("left", "z") + speed("right", "z")) / 2, speed("left", "z") - speed("right", "z")


def ball(data):
    """Tangential velocity after over before, and spin after [rad/s], of a ball that hits glass at an angle."""
    of = data["ball"]
    radius = of["diameter"] / 2
    glass = [[(x - 1.5, y, z - 1.5) for x, y, z in triangle] for triangle in box_triangles((3.0, 1.5, 1.5))]
    part = ascii_stl(half_ball(radius, 0.002), "ball") + ascii_stl(glass, "glass")
    scene = ('[parts.ball]\nmaterial = "alumina"\n[parts.glass]\nmaterial = "glass"\n' +
             material("alumina", young="380 GPa", poisson=0.23, density="4000 kg/m3", friction=of["friction"]) +
             material("glass", young="70 GPa", poisson=0.25, density="2500 kg/m3", friction=of["friction"]) + "[contact]\nself = false\n" +
             fix(box((-9, -0.001, -9), (9, 0.001, 9)), "y") + fix(box((-9, -1, -1.501), (9, 9, -1.499))) +
             probe("left", (-radius * 0.99, 0.001, radius + 0.002)) + probe("right", (radius * 0.99, 0.001, radius + 0.002)))
    wanted = sorted({angle for angle, _ in of["tangential"]} | {angle for angle, _ in of["spin"]})
    found = []
    for size in (0.25, 0.15):
        case = Case(part, size, suffix="stl")
        results = {}
        for angle in wanted:
            along, down = (of["speed"] * f(math.radians(angle)) for f in (math.sin, math.cos))
            case.run(scene + f'[[velocity]]\nwhere = "ball"\nvelocity = ["{along!r} m/s", "0 m/s", "-{down!r} m/s"]\n' +
                     '[run]\ntime = "30 us"\nhistory_every = "0.5 us"\n')
            x, _, spin = after_bounce(case.books(), 18e-6)
            results[angle] = (x / along, spin / (2 * 0.99e-3 * radius))
        found.append(results)
    rows = [("tangential restitution", f"{angle} degrees", value, *(each[angle][0] for each in found)) for angle, value in of["tangential"]]
    rows += [("spin [rad/s]", f"{angle} degrees", value, *(each[angle][1] for each in found)) for angle, value in of["spin"]]
    curves = {"tangential restitution": [(angle, value, found[1][angle][0]) for angle, value in of["tangential"]],
              "spin [1000 rad/s]": [(angle, value / 1e3, found[1][angle][1] / 1e3) for angle, value in of["spin"]]}
    return {"rows": rows, "unit": "", "across": "angle from the normal [degrees]", "curves": curves,
            "how": "Explicit steps with contact, model `cells`, half of the ball and of the glass, cells of 0.25 and 0.15 mm (the contact is about 0.4 mm wide); "
                   "velocities from 18 to 30 us."}


def common_size(layers, cells):
    """A spacing of about `cells` through all layers at which each of them is nearly a whole number of cells, which the lattice then snaps to."""
    off = lambda size: max(abs(layer / size / max(1, round(layer / size)) - 1) for layer in layers)
    return min((sum(layers) / (cells - 0.6 + k / 80) for k in range(97)), key=off)


def timoshenko(strain, thick, stiff):
    """Curvature of two layers, the second of which shrinks (Analysis of bi-metal thermostats, J. Opt. Soc. Am. 11, 1925)."""
    m, n = thick[1] / thick[0], stiff[1] / stiff[0]
    return 6 * strain * (1 + m) ** 2 / (sum(thick) * (3 * (1 + m) ** 2 + (1 + m * n) * (m * m + 1 / (m * n))))


def bilayer(data):
    """Change of curvature [1/m] of two-layer strips by heat."""
    of = data["bilayer"]
    length, wide, far = 6.0, 2.0, 3.0
    rows, curves, beside, dense = [], {}, [], []
    for sample in data["sample"]:
        low, whole = sample["thickness"] * (1 - sample["share"]), sample["thickness"]
        upper = [[(x, y, z + low) for x, y, z in triangle] for triangle in box_triangles((length, wide / 2, whole - low))]
        part = ascii_stl(box_triangles((length, wide / 2, low)), "pdms") + ascii_stl(upper, "elastomer")
        cases = [Case(part, common_size((low, whole - low), cells), suffix="stl") for cells in (4, 6)]
        points = []
        for k, temperature in enumerate(of["temperature"]):
            strain = of["contraction"][k]
            modulus = sum(of["modulus"][k]) / len(of["modulus"][k])
            scene = ('[parts.pdms]\nmaterial = "pdms"\n[parts.elastomer]\nmaterial = "elastomer"\n' +
                     material("pdms", young=f"{of['pdms']} Pa", poisson=0.3, density="1000 kg/m3") +
                     material("elastomer", young=f"{modulus!r} MPa", poisson=0.3, density="1000 kg/m3") +
                     '[shrinkage]\npart = "elastomer"\naxis = [1, 0, 0]\nlayer = "1 mm"\n' +
                     f'along = "{-100 * strain!r} %"\nacross = "{100 * ((1 - strain) ** -0.5 - 1)!r} %"\n' +
                     fix(box((-1, -1, -1), (0.001, wide, 9)), "x") + fix(box((-1, -0.001, -1), (length + 1, 0.001, 9)), "y") +
                     fix(box((-0.001, -0.001, low - 0.001), (0.001, 0.001, low + 0.001)), "z") +
                     probe("root", (0, 0, low)) + probe("far", (far, 0, low)))

            def curl(case, scene):
                moved = probes(case.run(scene))
                along, up = (1e-3 * far + moved["far"][0] - moved["root"][0], moved["far"][2] - moved["root"][2])
                return 2 * up / (along * along + up * up)  # of the circle that is level at the root

            ours = [curl(case, scene) for case in cases]
            if sample is data["sample"][0]:
                dense.append(curl(cases[0], scene.replace("poisson = 0.3", "poisson = 0.49")) / ours[0] - 1)
            value = sample["curvature"][k] - sample["room"]
            beside.append(ours[1] / timoshenko(strain, (1e-3 * low, 1e-3 * (whole - low)), (of["pdms"], 1e6 * modulus)) - 1)
            rows.append((f"strip {sample['name']}", f"{temperature} degC (+- {sample['deviation'][k]})", value, *ours))
            points.append((temperature, value, ours[1]))
        curves[sample["name"]] = points
    return {"rows": rows, "unit": "1/m", "across": "temperature [degC]", "curves": curves,
            "how": "Equilibrium, model `cells`, a quarter of the strip, about 4 and 6 cells through its thickness; the contraction as `[shrinkage]` along the strip. "
                   f"They are {100 * min(beside):+.0f} to {100 * max(beside):+.0f} % off Timoshenko's formula for two layers with the same figures. "
                   f"At a Poisson's ratio of 0.49 the first strip curls by {100 * min(dense):+.2f} to {100 * max(dense):+.2f} % more on the coarser lattice."}


EXPERIMENTS = {"block": block, "beam": beam, "rubber": drawn, "rod": rod, "ball": ball, "bilayer": bilayer}


# The page


def number(value):
    return f"{value:.4g}"


def errors(rows):
    """Of each row: error in % of what was measured, error and change from the coarser lattice in % of the largest measured value of its series."""
    largest = {}
    for series, _, value, *_ in rows:
        largest[series] = max(largest.get(series, 0.0), abs(value))
    return [(100 * (fine - value) / abs(value), 100 * (fine - value) / largest[series], 100 * (fine - coarse) / largest[series])
            for series, _, value, coarse, fine in rows]


def plot(path, title, across, unit, curves):
    """Points measured and lines computed; nothing where gnuplot is missing."""
    if not shutil.which("gnuplot"):
        return ""
    path.parent.mkdir(parents=True, exist_ok=True)
    blocks, drawing = [], []
    for k, (name, points) in enumerate(curves.items()):
        blocks.append(f"$d{k} << EOD\n" + "\n".join(f"{x!r} {value!r} {'NaN' if ours is None else repr(ours)}" for x, value, ours in points) + "\nEOD\n")
        drawing.append(f"$d{k} using 1:2 with points linecolor {k + 1} pointtype 6 title '{name}, measured'")
        if any(ours is not None for *_, ours in points):
            drawing.append(f"$d{k} using 1:3 with lines linecolor {k + 1} title '{name}, Flexel'")
    top = 1.5 * max(value for points in curves.values() for _, value, _ in points)  # a curve that runs away leaves the others to be seen
    cut = f"set yrange [:{top!r}]\n" if any(ours is not None and ours > top for points in curves.values() for *_, ours in points) else ""
    script = (f"set terminal svg size 720,420 background 'white'\nset output '{path}'\nset grid\nset key outside right\nset title \"{title}\"\n"
              f"set xlabel '{across}'\nset ylabel '{unit}'\n{cut}{''.join(blocks)}plot {', '.join(drawing)}\n")
    subprocess.run(["gnuplot"], input=script, text=True, check=True)
    return f"![{title}]({path.parent.name}/{path.name})\n\n"


def section(name, data, found, output):
    rows = found["rows"]
    text = f"## {data['title']}\n\n{data['what']}\n\n- Measured by: {data['source']}.\n- Read at: {data['read']}.\n- Not read: {data['not_read']}.\n"
    text += f"- Run: {found['how']}\n\n" + plot(output.with_suffix("") / f"{name}.svg", data["title"], found["across"], found["unit"], found["curves"])
    unit = f" [{found['unit']}]" if found["unit"] else ""
    text += f"| | measured{unit} | Flexel, coarser lattice | Flexel | error % |\n|---|---|---|---|---|\n"
    for (series, title, value, coarse, fine), (error, share, _) in zip(rows, errors(rows)):
        told = f"{error:+.1f}" if abs(error) <= 20 * abs(share) else "small"  # measured: under a twentieth of the largest
        text += f"| {series}, {title} | {number(value)} | {number(coarse)} | {number(fine)} | {told} |\n"
    return text + f"\n{data['remarks']}\n"


def overview(results):
    text = "| experiment | of | series | values | mean error | largest | lattice |\n|---|---|---|---|---|---|---|\n"
    for data, found in results.values():
        by_series = {}
        for row, off in zip(found["rows"], errors(found["rows"])):
            by_series.setdefault(row[0], []).append(off)
        for k, (series, off) in enumerate(by_series.items()):
            first = f"[{data['title']}](#{anchor(data['title'])}) | {data['kind']}" if k == 0 else "|"
            share = [abs(each[1]) for each in off]
            text += f"| {first} | {series} | {len(off)} | {sum(share) / len(off):.1f} % | {max(share):.1f} % | {max(abs(each[2]) for each in off):.1f} % |\n"
    return text


def anchor(title):
    return "".join(c for c in title.lower().replace(" ", "-") if c.isalnum() or c == "-")


def page(results, output):
    head = ("# Measured experiments\n\n"
            "Written by `bench/accuracy/experiments.py`; what was measured stands in `bench/accuracy/measured`. Nothing is fitted to a measured value that is "
            "compared, but where a section says so. Numbers were taken from public texts that quote the measurements; each section says which, and what was not read "
            "in the original. The paper's own experiment: [paper-experiment.md](paper-experiment.md). Exact answers instead of measured ones: "
            "[verification.md](verification.md).\n\n"
            "Errors here are in % of the largest value of their series, on average and at most; \"lattice\" is the most that the answer changes from the coarser "
            "lattice to the finer one, in the same measure. The tables below have each error in % of its own value, but where that is under a twentieth of the largest.\n\n")
    return head + overview(results) + "\n" + "\n".join(section(name, data, found, output) for name, (data, found) in results.items())


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--only", action="append", choices=EXPERIMENTS, help="this experiment; may be given several times")
    arguments.add_argument("--keep", type=pathlib.Path, metavar="FOLDER", help="write each experiment there when it is done; go on from what is there")
    arguments.add_argument("-o", "--output", default=ROOT / "docs/measurements/experiments.md", type=pathlib.Path)
    arguments.add_argument("--threads", metavar="N", help="of each run; every core by default (1 is faster on a busy machine)")
    options = arguments.parse_args()
    if options.threads:
        THREADS.extend(["--threads", options.threads])
    try:
        kept = Kept(options.keep)
        results = {}
        for name in options.only or EXPERIMENTS:
            data = measured(name)
            results[name] = data, kept(name, lambda: EXPERIMENTS[name](data))
            print(f"experiments.py: {name}", file=sys.stderr)
        text = page(results, options.output)
    except (OSError, RuntimeError, subprocess.SubprocessError) as error:
        print(f"experiments.py: {error}", file=sys.stderr)
        return 1
    write_whole(options.output, text)
    return 0


if __name__ == "__main__":
    sys.exit(main())

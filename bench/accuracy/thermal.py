#!/usr/bin/python3
"""Heat, conduction, shrinkage of prints and compensation beside exact answers: writes docs/measurements/thermal.md.

    PATH=build/release/bin:$PATH bench/accuracy/thermal.py [-o FILE]

References: alpha dT and E alpha dT (/ (1 - 2 nu)); Timoshenko, Analysis of bi-metal thermostats (J. Opt. Soc. Am. 11, 1925); thick tube under a radial temperature
difference, plane strain (Timoshenko and Goodier, Theory of Elasticity, 1970, section 151); a straight fin with a convective tip (Incropera and DeWitt);
NAFEMS LE11, solid cylinder, taper and sphere under T = r + z (The Standard NAFEMS Benchmarks, 1990; dimensions as tests/nafems-le11.geo of
github.com/seamplex/feenox has them), stress along z at the inner corner of the lowest face; a printed bar by beam theory, kappa = 12 / h^3 sum of the layers' strain times their arm.
"""

import argparse
import json
import math
import pathlib
import re
import struct
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/programs"))
from shapes import ascii_stl, box_triangles, obj_bar  # noqa: E402

YOUNG, POISSON, ALPHA, CONDUCTIVITY = 200e9, 0.3, 12e-6, 50.0
MATERIAL = f"""[materials.m]
young = "{YOUNG / 1e9} GPa"
poisson = {POISSON}
density = "7800 kg/m3"
expansion = "12e-6 /K"
conductivity = "50 W/(m K)"
"""
QUADRATIC = 'material = "m"\nmodel = "quadratic"\n' + MATERIAL


def call(*words):
    done = subprocess.run([str(word) for word in words], capture_output=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(map(str, words))}: {done.stderr.decode()}")
    return done.stderr.decode()


def fix(where, axes=""):
    quoted = where if where.startswith("{") else f'"{where}"'
    return f"[[fix]]\nwhere = {quoted}\n" + (f'axes = "{axes}"\n' if axes else "")


def probe(name, *at):
    return f'[[probe]]\nname = "{name}"\nat = [{", ".join(f"{chr(34)}{x!r} mm{chr(34)}" for x in at)}]\n'


def at_node(point, axes=""):
    """Holds the element at a point [mm]."""
    centre = ", ".join(f'"{x!r} mm"' for x in point)
    return fix(f'{{ sphere = {{ centre = [{centre}], radius = "0.05 mm" }} }}', axes)


def simulate(folder, part, scene, size, moments=True, align="snap"):
    """Summary and what was said, of a part's text or bytes."""
    name = folder / ("part.obj" if isinstance(part, str) else "part.stl")
    name.write_bytes(part.encode() if isinstance(part, str) else part)
    (folder / "scene.toml").write_text(scene)
    call("flexel-voxelize", name, "--size", f"{size}mm", *(["--moments"] if moments else []), "--align", align, "-o", folder / "rest.vtu", "--force")
    said = call("flexel-simulate", folder / "scene.toml", folder / "rest.vtu", "-o", folder / "bent.vtu", "--no-estimate", "--verbose",
                "--summary", folder / "summary.json", "--force")
    return json.loads((folder / "summary.json").read_text()), said


def heat(said, name):
    return float(re.search(rf'heat through "{name}": (-?[\d.,]+) W', said).group(1).replace(",", ""))


def probes(summary):
    return {each["name"]: each["displacement"] for each in summary["probes"]}


def free_expansion(folder, change=100.0):
    """Largest error of displacements and largest stress, as shares of alpha dT L and E alpha dT."""
    import meshio
    part, _ = obj_bar((20.0, 10.0, 6.0), 33)
    (folder / "part.obj").write_text(part)
    call("flexel-voxelize", folder / "part.obj", "--size", "2mm", "--moments", "--align", "none", "-o", folder / "rest.vtu")
    points = meshio.read(folder / "rest.vtu").points
    middle = points.mean(axis=0)
    first = points[((points - middle) ** 2).sum(axis=1).argmin()]

    def along(axis):
        on_line = [p for p in points if all(abs(p[k] - first[k]) < 1e-9 for k in range(3) if k != axis)]
        return max(on_line, key=lambda p: abs(p[axis] - first[axis]))

    held = "".join(at_node([float(1e3 * x) for x in point], axes) for point, axes in ((first, ""), (along(0), "yz"), (along(1), "z")))
    summary, _ = simulate(folder, part, QUADRATIC + f'[thermal]\nchange = "{change} K"\n' + held, 2, align="none")
    bent = meshio.read(folder / "bent.vtu")
    rest = meshio.read(folder / "rest.vtu").points
    moved = bent.points - rest if "displacement" not in bent.point_data else bent.point_data["displacement"]
    wrong = abs(moved - ALPHA * change * (rest - first)).max() / (ALPHA * change * 0.02)
    return wrong, summary["largest_von_mises"] / (YOUNG * ALPHA * change)


def between_walls(folder):
    scene = QUADRATIC + '[thermal]\nchange = "100 K"\n' + fix("xmin", "x") + fix("xmax", "x") + fix("ymin", "y") + fix("zmin", "z")
    summary, _ = simulate(folder, ascii_stl(box_triangles()), scene, 2.5)
    return summary["largest_von_mises"], YOUNG * ALPHA * 100


def held_all_around(folder):
    scene = QUADRATIC + '[thermal]\nchange = "100 K"\n' + "".join(fix(f"{a}{s}", a) for a in "xyz" for s in ("min", "max"))
    summary, _ = simulate(folder, ascii_stl(box_triangles()), scene, 2.5)
    reaction = next(each for each in summary["reactions"] if each["name"] == "xmin")
    return abs(reaction["force"][0]), YOUNG * ALPHA * 100 / (1 - 2 * POISSON) * 1e-4


def bimetal(folder, length=30.0, thick=1.0, size=0.25, far=20.0):
    """Curvature [1/m] of two bonded strips, model cells."""
    def strip(bottom):
        return [[(x, y, z + bottom) for x, y, z in t] for t in box_triangles((length, 4.0, thick))]
    part = ascii_stl(strip(0.0), "low") + ascii_stl(strip(thick), "high")
    scene = ('material = "m"\n[parts.high]\nmaterial = "n"\n' + MATERIAL + MATERIAL.replace("materials.m", "materials.n").replace("200.0 GPa", "100 GPa")
             .replace("12e-6", "24e-6") + '[thermal]\nchange = "100 K"\n' + fix("xmin", "x") + fix("ymin", "y") + at_node((0.0, 0.0, 0.0), "z"))
    scene += probe("root", 0.0, 0.0, thick) + probe("far", far, 0.0, thick)
    summary, _ = simulate(folder, part, scene, size, moments=False)
    moved = probes(summary)
    found = -2 * (moved["far"][2] - moved["root"][2]) / (1e-3 * far) ** 2
    m, n = 1.0, 0.5  # thickness and modulus of the upper over the lower
    exact = 6 * (24e-6 - ALPHA) * 100 * (1 + m) ** 2 / (2e-3 * thick * (3 * (1 + m) ** 2 + (1 + m * n) * (m * m + 1 / (m * n))))
    return found, exact


def tube(folder, inner=10.0, outer=20.0, size=1.25):
    """Displacement of the inner wall [m] and largest von Mises stress [Pa]: conduction from 100 to 20 degC, plane strain."""
    steps, lines, quads = 24, [], {}
    at = lambda r, i, z: (r * math.cos(i * math.pi / 2 / steps), r * math.sin(i * math.pi / 2 / steps), z)
    index = lambda w, i, k: 1 + w + 2 * (i + (steps + 1) * k)
    for k, z in enumerate((0.0, 5.0)):
        for i in range(steps + 1):
            for r in (inner, outer):
                lines.append("v {:.12g} {:.12g} {:.12g}".format(*at(r, i, z)))
    quads["start"] = [[index(0, 0, 0), index(1, 0, 0), index(1, 0, 1), index(0, 0, 1)]]
    quads["end"] = [[index(0, steps, 0), index(0, steps, 1), index(1, steps, 1), index(1, steps, 0)]]
    for name, face in (("inner", lambda i: [index(0, i, 0), index(0, i, 1), index(0, i + 1, 1), index(0, i + 1, 0)]),
                       ("outer", lambda i: [index(1, i, 0), index(1, i + 1, 0), index(1, i + 1, 1), index(1, i, 1)]),
                       ("bottom", lambda i: [index(0, i, 0), index(0, i + 1, 0), index(1, i + 1, 0), index(1, i, 0)]),
                       ("top", lambda i: [index(0, i, 1), index(1, i, 1), index(1, i + 1, 1), index(0, i + 1, 1)])):
        quads[name] = [face(i) for i in range(steps)]
    for name, faces in quads.items():
        lines += [f"g {name}"] + ["f " + " ".join(map(str, face)) for face in faces]
    scene = (QUADRATIC + '[thermal]\nreference = "20 degC"\n[[temperature]]\nwhere = "inner"\nvalue = "100 degC"\n'
             '[[temperature]]\nwhere = "outer"\nvalue = "20 degC"\n' + fix("start", "y") + fix("end", "x") + fix("bottom", "z") + fix("top", "z"))
    scene += probe("wall", inner, 0.0, 2.5)
    summary, said = simulate(folder, "\n".join(lines) + "\n", scene, size)
    a, b, hot = inner / 1e3, outer / 1e3, 80.0
    log = math.log(b / a)
    whole = hot / log * ((b * b - a * a) / 4 - a * a / 2 * log)  # int_a^b T r dr, T = hot ln(b/r) / ln(b/a)
    moved = 2 * ALPHA * (1 + POISSON) * a / (b * b - a * a) * whole
    hoop = YOUNG * ALPHA * hot / (2 * (1 - POISSON) * log) * (1 - 2 * b * b / (b * b - a * a) * log)
    axial = POISSON * hoop - YOUNG * ALPHA * hot
    flow = math.pi / 2 * CONDUCTIVITY * 5e-3 * hot / log
    return [("tube, inner wall moves [um]", 1e6 * probes(summary)["wall"][0], 1e6 * moved),
            ("tube, largest von Mises stress [MPa]", summary["largest_von_mises"] / 1e6,
             math.sqrt(hoop * hoop - hoop * axial + axial * axial) / 1e6),
            ("tube, heat [W]", heat(said, "inner"), flow)]


def profile():
    """Radius and height [m] of LE11's section, inner side up, then outer side down."""
    slope, arc = math.sqrt(0.5), 24
    inner = [(math.cos(k * math.pi / 4 / arc), math.sin(k * math.pi / 4 / arc)) for k in range(arc + 1)]
    top = slope + 0.345 + 0.345
    least = math.asin(slope / 1.4)
    outer = [(1.4 * math.cos(k * least / arc), 1.4 * math.sin(k * least / arc)) for k in range(arc + 1)]
    steps = lambda a, b, n: [(a[0] + (b[0] - a[0]) * k / n, a[1] + (b[1] - a[1]) * k / n) for k in range(1, n + 1)]
    end = (slope, top + 0.4)
    inner += steps(inner[-1], (slope, top), arc // 2) + steps((slope, top), end, arc // 2)
    outer += steps(outer[-1], (1.0, top), arc // 2) + steps((1.0, top), (1.0, end[1]), arc // 2)
    return inner, outer


def quarter_turned(inner, outer, steps=48):
    """OBJ [mm] of the section turned by a quarter about z, with groups start, end, bottom, top, inner and outer."""
    sides = [inner, outer]
    lines, count = [], len(inner)
    for i in range(steps + 1):
        turn = i * math.pi / 2 / steps
        for side in sides:
            lines += [f"v {1e3 * r * math.cos(turn):.12g} {1e3 * r * math.sin(turn):.12g} {1e3 * z:.12g}" for r, z in side]
    at = lambda side, k, i: 1 + k + count * (side + 2 * i)
    quads = {"start": [[at(0, k, 0), at(1, k, 0), at(1, k + 1, 0), at(0, k + 1, 0)] for k in range(count - 1)],
             "end": [[at(0, k, steps), at(0, k + 1, steps), at(1, k + 1, steps), at(1, k, steps)] for k in range(count - 1)]}
    quads["bottom"] = [[at(0, 0, i), at(0, 0, i + 1), at(1, 0, i + 1), at(1, 0, i)] for i in range(steps)]
    quads["top"] = [[at(0, count - 1, i), at(1, count - 1, i), at(1, count - 1, i + 1), at(0, count - 1, i + 1)] for i in range(steps)]
    quads["inner"] = [[at(0, k, i), at(0, k + 1, i), at(0, k + 1, i + 1), at(0, k, i + 1)] for i in range(steps) for k in range(count - 1)]
    quads["outer"] = [[at(1, k, i), at(1, k, i + 1), at(1, k + 1, i + 1), at(1, k + 1, i)] for i in range(steps) for k in range(count - 1)]
    for name, faces in quads.items():
        lines += [f"g {name}"] + ["f " + " ".join(map(str, face)) for face in faces]
    return "\n".join(lines) + "\n"


def add_column(path, name, values):
    """Adds a column of the elements to a body file: to its header, and to the end of what is appended."""
    data = path.read_bytes()
    start, end = data.index(b"_", data.index(b"<AppendedData")) + 1, data.rindex(b"</AppendedData>")
    end -= len(data[start:end]) - len(data[start:end].rstrip(b"\n"))
    array = f'<DataArray type="Float64" Name="{name}" format="appended" offset="{end - start}"/>\n'.encode()
    at = data.index(b"</PointData>")
    path.write_bytes(data[:at] + array + data[at:end] + struct.pack(f"<Q{len(values)}d", 8 * len(values), *values) + data[end:])


def le11(folder, size=60):
    """Stress along z [MPa] at (1, 0, 0) m, the least principal stress there: that along the radius is 0, the hoop stress a pull."""
    import meshio
    (folder / "part.obj").write_text(quarter_turned(*profile()))
    call("flexel-voxelize", folder / "part.obj", "--size", f"{size}mm", "--moments", "-o", folder / "rest.vtu", "--force")
    places = meshio.read(folder / "rest.vtu").points
    add_column(folder / "rest.vtu", "temperature", [math.hypot(x, y) + z for x, y, z in places])
    matter = MATERIAL.replace(f"{YOUNG / 1e9} GPa", "210 GPa").replace("12e-6", "2.3e-4")
    (folder / "scene.toml").write_text('material = "m"\nmodel = "quadratic"\n' + matter + '[thermal]\ncolumn = "temperature"\nreference = "0 K"\n' + fix("start", "y") +
                                       fix("end", "x") + fix("bottom", "z") + fix("top", "z"))
    call("flexel-simulate", folder / "scene.toml", folder / "rest.vtu", "-o", folder / "bent.vtu", "--no-estimate", "--force")
    call("flexel-map", folder / "bent.vtu", "-o", folder / "mapped.vtu", "--refine", "off", "--force")
    return meshio.read(folder / "mapped.vtu").point_data["principal_stress"][0].min() / 1e6, -105.0


def rod(folder):
    """Heat [W] of a rod between two temperatures."""
    scene = QUADRATIC + '[[temperature]]\nwhere = "xmin"\nvalue = "80 degC"\n[[temperature]]\nwhere = "xmax"\nvalue = "30 degC"\n' + fix("xmin")
    _, said = simulate(folder, ascii_stl(box_triangles()), scene, 3)
    return heat(said, "xmin"), CONDUCTIVITY * 1e-4 * 50 / 0.04


def wall(folder):
    """Heat [W] from a hot face through the wall to air."""
    scene = (QUADRATIC + '[[temperature]]\nwhere = "xmin"\nvalue = "80 degC"\n[[convection]]\nwhere = "xmax"\ncoefficient = "2000 W/(m2 K)"\n'
             'ambient = "20 degC"\n' + fix("xmin"))
    _, said = simulate(folder, ascii_stl(box_triangles()), scene, 3)
    return heat(said, "xmin"), 1e-4 * 60 / (0.04 / CONDUCTIVITY + 1 / 2000)


def fin(folder):
    """Heat [W] of a straight fin with a convective tip."""
    scene = QUADRATIC + '[[temperature]]\nwhere = "xmin"\nvalue = "100 degC"\n' + fix("xmin")
    for side in ("xmax", "ymin", "ymax", "zmin", "zmax"):
        scene += f'[[convection]]\nwhere = "{side}"\ncoefficient = "100 W/(m2 K)"\nambient = "20 degC"\n'
    _, said = simulate(folder, ascii_stl(box_triangles((60.0, 4.0, 4.0))), scene, 1)
    h, perimeter, area, length = 100, 0.016, 16e-6, 0.06
    m = math.sqrt(h * perimeter / (CONDUCTIVITY * area))
    tip = h / (m * CONDUCTIVITY)
    exact = math.sqrt(h * perimeter * CONDUCTIVITY * area) * 80 * (math.sinh(m * length) + tip * math.cosh(m * length)) / (
        math.cosh(m * length) + tip * math.sinh(m * length))
    return heat(said, "xmin"), exact


def printed_bar(folder, model="quadratic"):
    """Curvature [1/m] of a released bar, 4 mm high, whose layers of .2 mm shrink by .15 to .3 % from the bottom to the top."""
    scene = (QUADRATIC.replace("quadratic", model) + '[shrinkage]\naxis = [0, 0, 1]\nlayer = "0.2 mm"\nalong = "-0.1 %"\nacross = "-0.3 %"\n'
             'height = ["0 mm", "4 mm"]\nfactor = [0.5, 1]\n' + fix("xmin", "x") + fix("ymin", "y") + at_node((0.0, 0.0, 0.0), "z"))
    scene += probe("root", 0.0, 0.0, 2.0) + probe("far", 50.0, 0.0, 2.0)
    summary, _ = simulate(folder, ascii_stl(box_triangles((60.0, 6.0, 4.0))), scene, 1, model == "quadratic")
    moved = probes(summary)
    found = 2 * (moved["far"][2] - moved["root"][2]) / 0.05 ** 2
    layers = [(0.2e-3 * (i + 0.5), -0.003 * (0.5 + 0.5 * (i + 0.5) / 20)) for i in range(20)]
    return found, -12 / 4e-3 ** 3 * sum(strain * (z - 2e-3) * 0.2e-3 for z, strain in layers)


CASES = [("bar between walls, stress [Pa]", between_walls), ("held all around, force on a wall [N]", held_all_around),
         ("bimetal strip, model cells, curvature [1/m]", bimetal), ("rod, heat [W]", rod), ("wall with convection, heat [W]", wall),
         ("fin, heat [W]", fin), ("NAFEMS LE11, stress along z at A [MPa]", le11), ("printed bar, curvature [1/m]", printed_bar),
         ("printed bar, model cells, curvature [1/m]", lambda folder: printed_bar(folder, "cells"))]


def main():
    arguments = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    arguments.add_argument("-o", default=str(ROOT / "docs/measurements/thermal.md"))
    where = arguments.parse_args().o
    rows = []
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        wrong, stress = free_expansion(folder)
        for title, case in CASES:
            rows.append((title, *case(folder)))
        rows += tube(folder)
    text = ["# Heat and shrinkage", "",
            "Written by `bench/accuracy/thermal.py`, which names the references; what the keys mean: [thermal.md](../reference/thermal.md).", "",
            "A free bar, turned by 33 degrees against its lattice and heated evenly: displacements are off by "
            f"{wrong:.1e} of the largest expansion, the largest stress is {stress:.1e} of E alpha dT.", "",
            "| case | found | exact | error |", "|---|---|---|---|"]
    text += [f"| {title} | {found:.5g} | {exact:.5g} | {100 * (found / exact - 1):+.2f} % |" for title, found, exact in rows]
    pathlib.Path(where).write_text("\n".join(text) + "\n")
    print("\n".join(text))


if __name__ == "__main__":
    main()

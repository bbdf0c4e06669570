#!/usr/bin/python3
"""What Flexel's answers are off by, measured and written as docs/measurements/verification.md with its figures.

    PATH=build/release/bin:$PATH bench/accuracy/verification.py [--quick] [--keep FOLDER] [--leave-out CASE] [-o FILE]

Always: the lattice tested as a material (`flexel measure`), the paper's cantilever against its reference and a thick tube against Lame's
solution, each at several spacings with its error bar. Without --quick also the tables of accuracy_table and error_bars (a
build with FLEXEL_BENCH=ON), of bench/accuracy/laws.py, stresses.py, step_parts.py and calculix.py (ccx and gmsh). A section whose programs or
parts are not there says so. With --keep every case is written to FOLDER as soon as it is done, and a later run takes it from there: a run
of half an hour can be stopped and goes on. Figures are SVG by gnuplot, in a folder beside FILE named after it. Exit code 1 when a true error lies outside
its bar in more than one case of ten, or a material is off by more than 1 %.
"""

import argparse
import concurrent.futures
import json
import math
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

from kept import Kept, write_whole

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]


def command(*words, accept=(0,)):
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True)
    if done.returncode not in accept:
        raise RuntimeError(f"{' '.join(map(str, words))}: {(done.stderr.strip().splitlines() or ['no message'])[-1]}")
    return done.stdout


# The lattice as a material


def materials():
    text = ("## The lattice as a material\n\nE, Poisson's ratio and G that a lattice has, by `flexel measure` ([accuracy.md](accuracy.md)), in % of the "
            "material's. Even strains: drawn bars and\nbars sheared in a frame. In the limit: bent and twisted bars of 4 and 8 cells, extrapolated.\n\n"
            "| model | nu | worst direction, E | nu off by | G | drawn, 8 cells, E | sheared, G | bent, 8 cells, E | limit | twisted, 8 cells, G | limit |\n"
            "|---|---|---|---|---|---|---|---|---|---|---|\n")
    good = True
    for model, poisson in (("cells", 0.0), ("cells", 0.3), ("cells", 0.45), ("springs", 0.25)):
        found = json.loads(command("flexel", "measure", "--model", model, "--size", "2 mm", "--poisson", poisson, "--json"))
        young, shear = found["young"], found["shear"]
        off = lambda value, wanted: 100 * (value / wanted - 1)
        inside = [max((off(each[key], wanted) for each in found["inside"]), key=abs) for key, wanted in (("young", young), ("shear", shear))]
        ratio = max(abs(each["poisson"] - poisson) for each in found["inside"])
        bar, limit = found["bars"][-1], found["limit"]
        held = inside + [off(bar["young_drawn"], young), off(bar["shear_sheared"], shear), off(limit["young_bent"], young),
                         off(limit["shear_twisted"], shear)]
        good &= max(map(abs, held)) <= 1 and ratio <= 0.01
        text += (f"| `{model}` | {poisson:g} | {inside[0]:+.2f} | {ratio:.4f} | {inside[1]:+.2f} | {held[2]:+.2f} | {held[3]:+.2f} |"
                 f" {off(bar['young_bent'], young):+.2f} | {held[4]:+.2f} | {off(bar['shear_twisted'], shear):+.2f} | {held[5]:+.2f} |\n")
    return text, good


# Bodies whose answer is known


def box(path, sides):
    x, y, z = sides
    corners = [(a, b, c) for c in (0, z) for b in (0, y) for a in (0, x)]
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    lines = [f"v {a} {b} {c}" for a, b, c in corners] + ["f " + " ".join(str(i + 1) for i in quad) for quad in quads]
    path.write_text("\n".join(lines) + "\n")


def quarter_tube(path, inner, outer, high, steps=180):
    """Faces: inner, outer, low, high, along (y = 0), across (x = 0)."""
    lines = []
    for i in range(steps + 1):
        angle = math.pi / 2 * i / steps
        lines += [f"v {r * math.cos(angle):.9g} {r * math.sin(angle):.9g} {z}" for z in (0, high) for r in (inner, outer)]
    at = lambda i, up, out: 4 * i + 2 * up + out + 1
    quads = {"inner": [(at(i, 0, 0), at(i, 1, 0), at(i + 1, 1, 0), at(i + 1, 0, 0)) for i in range(steps)],
             "outer": [(at(i, 0, 1), at(i + 1, 0, 1), at(i + 1, 1, 1), at(i, 1, 1)) for i in range(steps)],
             "low": [(at(i, 0, 0), at(i + 1, 0, 0), at(i + 1, 0, 1), at(i, 0, 1)) for i in range(steps)],
             "high": [(at(i, 1, 0), at(i, 1, 1), at(i + 1, 1, 1), at(i + 1, 1, 0)) for i in range(steps)],
             "along": [(at(0, 0, 0), at(0, 0, 1), at(0, 1, 1), at(0, 1, 0))],
             "across": [(at(steps, 0, 0), at(steps, 1, 0), at(steps, 1, 1), at(steps, 0, 1))]}
    for name, group in quads.items():
        lines += [f"g {name}"] + ["f " + " ".join(map(str, quad)) for quad in group]
    path.write_text("\n".join(lines) + "\n")


def solve(folder, part, size, scene):
    """The probe's displacement [m] and its error bar (None where there is none), the number of cells."""
    (folder / "scene.toml").write_text(scene)
    command("flexel-voxelize", part, "--size", size, "--quiet", "-o", folder / "body.vtu")
    command("flexel-simulate", folder / "scene.toml", folder / "body.vtu", "--quiet", "--no-stress", "--summary", folder / "s.json",
            "-o", folder / "out.vtu")
    found = json.loads((folder / "s.json").read_text())
    bars = [each["bar"] for each in found["error_bars"].get("bars", []) if each["of"] == "probe asked"]
    return math.hypot(*found["probes"][0]["displacement"]), bars[0] if bars else None, found["cells"]


def cantilever(folder, n):
    """The paper's beam (section 5), 2 x 0.75 x 0.5 m, n cells through the 0.5 m: displacement, bar, cells, reference. The reference is
    Timoshenko's beam times 0.98522, its ratio to C3D20R runs of CalculiX, extrapolated (docs/measurements/accuracy.md)."""
    box(folder / "beam.obj", (2000, 750, 500))
    young, nu, force, width, height, length = 12.1e5, 0.25, 1e-3, 0.75, 0.5, 2.0
    inertia, shear, factor = width * height**3 / 12, young / 2 / (1 + nu), 10 * (1 + nu) / (12 + 11 * nu)
    reference = 0.98522 * force * (length**3 / (3 * young * inertia) + length / (factor * shear * width * height))
    scene = (f'material = "gum"\n[materials.gum]\nyoung = "{young} Pa"\npoisson = {nu}\ndensity = "580 kg/m3"\n[[fix]]\nwhere = "xmin"\n'
             f'[[load]]\nwhere = "xmax"\nforce = ["0 N", "0 N", "{force} N"]\n[[probe]]\nname = "asked"\nwhere = "xmax"\n')
    return *solve(folder, folder / "beam.obj", f"{500 / n} mm", scene), reference


def tube(folder, n):
    """A quarter of a thick tube under inner pressure in plane strain, n cells through its wall of 20 mm; Lame's solution."""
    quarter_tube(folder / "tube.obj", 20, 40, 4)
    young, nu, inner, outer, pressure = 210e9, 0.3, 0.02, 0.04, 1e6
    radial = (1 + nu) * pressure * inner**2 / (young * (outer**2 - inner**2)) * ((1 - 2 * nu) * inner + outer**2 / inner)
    fixes = "".join(f'[[fix]]\nwhere = "{face}"\naxes = "{axis}"\n' for face, axis in (("along", "y"), ("across", "x"), ("low", "z"), ("high", "z")))
    scene = (f'material = "metal"\n[materials.metal]\nyoung = "{young} Pa"\npoisson = {nu}\ndensity = "7850 kg/m3"\n{fixes}'
             f'[[load]]\nwhere = "inner"\npressure = "{pressure} Pa"\n[[probe]]\nname = "asked"\nwhere = "inner"\n')
    return *solve(folder, folder / "tube.obj", f"{20 / n} mm", scene), radial * 2 * math.sqrt(2) / math.pi


def plot(path, title, across, rows):
    """Error and bar [%] over the cells through the part, both axes logarithmic; nothing where gnuplot is missing."""
    if not shutil.which("gnuplot"):
        return ""
    path.parent.mkdir(parents=True, exist_ok=True)
    data = "\n".join(f"{n} {max(abs(error), 1e-3)} {bar if bar else 'NaN'}" for n, _, error, bar in rows)
    script = (f"set terminal svg size 560,360 background 'white'\nset output '{path}'\nset logscale xy\nset grid\nset title \"{title}\"\n"
              f"set xlabel '{across}'\nset ylabel '% of the answer'\nset xtics ({', '.join(str(row[0]) for row in rows)})\n$data << EOD\n{data}\nEOD\n"
              "plot $data using 1:2 with linespoints title 'true error', $data using 1:3 with linespoints dashtype 2 title 'error bar'\n")
    subprocess.run(["gnuplot"], input=script, text=True, check=True)
    return f"![{title}]({path.parent.name}/{path.name})\n\n"


def known(name, title, what, across, run, counts, output, kept):
    def row(n):
        with tempfile.TemporaryDirectory() as place:
            value, bar, cells, reference = run(pathlib.Path(place), n)
        return n, cells, 100 * (value / reference - 1), 100 * bar / reference if bar is not None else None

    rows = [kept(f"{name} {n}", lambda n=n: row(n)) for n in counts]
    inside = sum(bar is not None and abs(error) <= bar for _, _, error, bar in rows)
    text = f"## {title}\n\n{what}\n\n" + plot(output.with_suffix("") / f"{name}.svg", title, across, rows)
    text += f"| {across} | cells | error % | bar % | holds |\n|---|---|---|---|---|\n"
    for n, cells, error, bar in rows:
        text += f"| {n} | {cells:,} | {error:+.2f} | {f'{bar:.2f}' if bar is not None else 'none'} | {'yes' if bar is not None and abs(error) <= bar else 'no'} |\n"
    return text, inside, len(rows)


# Tables of the other programs


def captured(kept, leave_out, title, what, words, needs=(), cases=None):
    """The table that a program prints. `cases` lists what it is run for one by one, each kept, but for those to `leave_out`."""
    missing = [need for need in (words[0], *needs) if not (shutil.which(str(need)) or pathlib.Path(need).exists())]
    if missing:
        return f"## {title}\n\n{what}\n\nLeft out: {', '.join(pathlib.Path(each).name for each in missing)} is not there.\n"
    lines = []
    for case in cases() if cases else [None]:
        if case in leave_out:
            lines.append(f"| {case} | left out |")
            continue
        print(f"verification.py: {title}" + (f", {case}" if case else ""), file=sys.stderr)
        # 1 is a finding of theirs, which their table shows
        more = kept(f"{title} {case or ''}", lambda case=case: command(*words, *([case] if case else []), accept=(0, 1))).strip().splitlines()
        lines += more[2:] if lines else more  # one head
    return f"## {title}\n\n{what}\n\n" + "\n".join(lines) + "\n"


def shortfalls(table):
    """What of the table beside CalculiX is more than 5 % off, and where Flexel takes more than a tenth of CalculiX's time for an error of 1 %."""
    far, slow, fast = [], [], 0
    parts = {}
    for line in table.splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if len(cells) == 9 and re.fullmatch(r"[+-]\d+\.\d+", cells[3]):
            parts.setdefault(cells[0], []).append((cells[1], float(cells[3]), float(cells[5] or 0) + float(cells[6])))
    for part, rows in parts.items():
        far += [f"- {part}, {by[8:]}: {error:+.2f} %" for by, error, _ in rows if by.startswith("Flexel") and abs(error) > 5]
        least = {who: min((seconds for by, error, seconds in rows if by.startswith(who) and abs(error) <= 1), default=None) for who in ("CalculiX", "Flexel")}
        if least["Flexel"] is not None and (least["CalculiX"] is None or least["Flexel"] <= least["CalculiX"] / 10):
            fast += 1
        else:
            slow.append(f"- {part}: " + ", ".join(f"{who} {'at none of these sizes' if seconds is None else f'{seconds:.2f} s'}" for who, seconds in least.items()))
    if not parts:
        return ""
    return ("### What falls short\n\nRows of Flexel's that are more than 5 % off:\n\n" + ("\n".join(far) or "- none") +
            f"\n\nFor an error of 1 % or less Flexel takes a tenth of CalculiX's time (mesh included), or CalculiX has none, with {fast} of {len(parts)} parts, not with these:\n\n" +
            ("\n".join(slow) or "- none") + "\n")


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--quick", action="store_true", help="leave out what takes more than a minute")
    arguments.add_argument("--jobs", default=1, type=int, help="programs that run at once")
    arguments.add_argument("--leave-out", default=[], action="append", metavar="CASE", help="of the STEP parts or beside CalculiX; the page says so")
    arguments.add_argument("--keep", type=pathlib.Path, metavar="FOLDER", help="write each case there when it is done; go on from what is there")
    arguments.add_argument("--parts", default=ROOT / "../shared/parts", type=pathlib.Path)
    arguments.add_argument("-o", "--output", default=ROOT / "docs/measurements/verification.md", type=pathlib.Path)
    options = arguments.parse_args()
    sections = ["# Verification\n\nWritten by `bench/accuracy/verification.py`" + (" --quick" if options.quick else "") +
                f", {command('flexel', '--version').strip()}. Errors are against the named reference; above 0 is too soft. What error\n"
                "bars are is in [error-bars.md](../theory/error-bars.md), what the models are in [accuracy.md](accuracy.md).\n"]
    try:
        kept = Kept(options.keep)
        text, good = kept("materials", materials)
        sections.append(text)
        cases = [known("cantilever", "The paper's cantilever",
                       "2 x 0.75 x 0.5 m, Poisson's ratio 1/4, held at one end and pushed across at the other, small deflection. Mean deflection of the end\n"
                       "against Timoshenko's beam times its ratio to CalculiX's C3D20R, extrapolated.",
                       "cells through 0.5 m", cantilever, (2, 4, 6, 8) if options.quick else (2, 4, 6, 8, 12, 16), options.output,
                       kept),
                 known("tube", "A thick tube under pressure",
                       "Radii 20 and 40 mm, plane strain, a quarter of it; the lattice does not follow its walls. Mean displacement of the inner face against\n"
                       "Lame's solution.", "cells through the wall", tube, (10, 20) if options.quick else (10, 20, 40), options.output,
                       kept)]
        sections += [case[0] for case in cases]
        inside, count = sum(case[1] for case in cases), sum(case[2] for case in cases)
        sections.append(f"In {inside} of these {count} runs the true error lies within the bar.\n")
        if not options.quick:
            tables = [("Models", "Tip of the same cantilever by model, elements on its faces ([accuracy.md](accuracy.md)).", ["accuracy_table"]),
                      ("Error bars", "Cases whose answer is known ([error-bars.md](../theory/error-bars.md)).", ["error_bars"]),
                      ("Elastic laws", "A bar of 100 x 20 x 20 mm, held at one end and pushed at the other, beside second-order tetrahedra of 3 mm by CalculiX\n"
                       "([laws.md](../theory/laws.md)); \"in time\": the same scene with damping until it is at rest.", [HERE / "laws.py"], ["ccx", "gmsh"]),
                      ("Peak stresses", "The largest von Mises stress of model `quadratic` without and with `--refine-stress` ([local-stress.md](../theory/local-stress.md)), beside\n"
                       "CalculiX or Lame. Seconds: the whole process, bars included; cells more: of all finer lattices together.",
                       [HERE / "stresses.py", "--closer-table"], ["ccx"], lambda: command(HERE / "stresses.py", "--list").splitlines()),
                      ("STEP parts", "Every closed STEP part with an error bar, nothing set by hand; processor seconds.",
                       [HERE / "step_parts.py", "--parts", options.parts, "--cells", "30000,300000"], [options.parts],
                       lambda: command(HERE / "step_parts.py", "--list").split()),
                      ("Beside CalculiX", "The same parts by CalculiX and by Flexel; processor seconds, one thread each ([accuracy.md](accuracy.md)).",
                       [HERE / "calculix.py", "--parts", options.parts], ["ccx", "gmsh"],
                       lambda: command(HERE / "calculix.py", "--list").splitlines())]
            with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
                sections += pool.map(lambda table: captured(kept, options.leave_out, *table), tables)
            sections.append(shortfalls(sections[-1]))
    except (OSError, RuntimeError, subprocess.SubprocessError) as error:
        print(f"verification.py: {error}", file=sys.stderr)
        return 1
    write_whole(options.output, "\n".join(sections))
    print(f"verification.py: wrote {options.output}; {inside} of {count} bars hold", file=sys.stderr)
    return 0 if good and 10 * inside >= 9 * count else 1


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/python3
"""The experiment of Jansson and Vergeest's section 5 (their figures 6 and 7): a beam of 2 x 0.7 x 0.5 m, E = 12.1e5 Pa, 580 kg/m3, held
at one end, across which the other is loaded; load against displacement at two resolutions. Writes docs/measurements/paper-experiment.md's table and,
where gnuplot is installed, its graph; the two lattices as `flexel picture` shows them.

    PATH=build/release/bin:$PATH bench/paper/beam.py
"""

import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

import numpy as np

SOURCE = pathlib.Path(__file__).resolve().parents[2]
sys.path.append(str(SOURCE / "tests/programs"))
from shapes import binary_stl, box_triangles  # noqa: E402

LENGTH, WIDTH, HEIGHT, YOUNG, POISSON = 2.0, 0.7, 0.5, 12.1e5, 0.25
LOADS = np.linspace(5, 50, 10)  # N
RESOLUTIONS = (4, 8)            # cubes through the height
MODELS = {"paper": "centre", "cells": "corner"}

SCENE = """material = "gum"
[materials.gum]
young = "{young} Pa"
poisson = {poisson}
density = "580 kg/m3"
[parts.beam]
model = "{model}"
[[fix]]
where = "xmin"
[[load]]
where = "xmax"
force = ["0 N", "0 N", "{force} N"]
[[probe]]
name = "end"
where = "xmax"
"""


def run(*command):
    """Silently, but for what goes wrong."""
    done = subprocess.run(command, stderr=subprocess.PIPE, timeout=120, check=False)
    if done.returncode != 0:
        sys.exit(f"beam.py: {command[0]} ended with {done.returncode}:\n{done.stderr.decode()}")


def displacements(model, n):
    """Of the loaded end, downwards, by load [m]; at equilibrium."""
    body = f"{model}-{n}.vtu"
    run("flexel-voxelize", "beam.stl", "--size", f"{1e3 * HEIGHT / n} mm", "--placement", MODELS[model], "--align", "none", "-o", body)
    found = []
    for load in LOADS:
        pathlib.Path("beam.toml").write_text(SCENE.format(young=YOUNG, poisson=POISSON, model=model, force=-load), encoding="utf-8")
        run("flexel-simulate", "beam.toml", body, "--summary", "beam.json", "-o", "bent.vtu")
        found.append(-json.loads(pathlib.Path("beam.json").read_text(encoding="utf-8"))["probes"][0]["displacement"][2])
    return np.array(found)


def line(u):
    """Slope [m/N] and R^2 of the least squares line through load and displacement."""
    slope, start = np.polyfit(LOADS, u, 1)
    rest = u - (slope * LOADS + start)
    return slope, 1 - np.sum(rest**2) / np.sum((u - u.mean())**2)


def theory(model, n):
    """Timoshenko's deflection [m/N] of the beam that the lattice is: elements at centres are whole cubes, as many as have their centre
    in the part, and the held and the loaded layer are one cube less than the length apart."""
    h = HEIGHT / n
    width, length = (round(WIDTH / h) * h, LENGTH - h) if model == "paper" else (WIDTH, LENGTH)
    shear, factor = YOUNG / 2 / (1 + POISSON), 10 * (1 + POISSON) / (12 + 11 * POISSON)
    return length**3 / (3 * YOUNG * width * HEIGHT**3 / 12) + length / (factor * shear * width * HEIGHT)


def experiment():
    curves = {(model, n): displacements(model, n) for model in MODELS for n in RESOLUTIONS}
    lines = ["| model | cubes through the height | displacement a newton | R^2 of the line | beam theory of this lattice |", "|---|---|---|---|---|"]
    slopes = {}
    for (model, n), u in curves.items():
        slopes[model, n], r2 = line(u)
        lines.append(f"| `{model}` | {n} | {1e3 * slopes[model, n]:.5f} mm | 1 - {1 - r2:.1e} | {1e3 * theory(model, n):.5f} mm |")
    low, high = RESOLUTIONS
    lines += ["", f"| model | displacement at {high} over that at {low} | the same, each over its beam theory |", "|---|---|---|"]
    for model in MODELS:
        ratio = slopes[model, high] / slopes[model, low]
        lines.append(f"| `{model}` | {ratio:.4f} | {ratio * theory(model, low) / theory(model, high):.4f} |")
    return curves, "\n".join(lines)


def graph(curves, path):
    """Load against displacement, as the paper's figure 6."""
    if not shutil.which("gnuplot"):
        print("beam.py: no graph: gnuplot is not installed (Debian: gnuplot-nox)", file=sys.stderr)
        return
    for (model, n), u in curves.items():
        np.savetxt(f"{model}-{n}.dat", np.stack([1e3 * u, LOADS], axis=1))
    series = ", ".join(f"'{model}-{n}.dat' with linespoints linewidth 2 pointtype {7 if n == RESOLUTIONS[0] else 6} linecolor rgb '{colour}' "
                       f"title '{model}, {n} cubes'" for (model, n), colour in zip(curves, ("#b35806", "#f1a340", "#542788", "#998ec3")))
    script = (f"set terminal svg size 800,500 background 'white' font 'DejaVu Sans,14'; set output '{path}'; set grid; set key right bottom; "
              f"set xlabel 'displacement of the end [mm]'; set ylabel 'load [N]'; set xrange [0:]; set yrange [0:]; plot {series}")
    run("gnuplot", "-e", script)


def main():
    with tempfile.TemporaryDirectory(prefix="flexel-") as folder:
        os.chdir(folder)
        pathlib.Path("beam.stl").write_bytes(binary_stl(box_triangles((1e3 * LENGTH, 1e3 * WIDTH, 1e3 * HEIGHT))))
        curves, tables = experiment()
        graph(curves, SOURCE / "docs/pictures/paper-beam.svg")
        run("flexel", "picture", "paper-4.vtu", "paper-8.vtu", "--elements", "--view", "30,25", "--size", "640x280", "-o",
            SOURCE / "docs/pictures/paper-beams.png")
        os.chdir("/")
    print(tables)
    page = SOURCE / "docs/measurements/paper-experiment.md"
    before, _, rest = page.read_text(encoding="utf-8").partition("<!-- beam.py -->\n")
    _, _, after = rest.partition("<!-- end -->\n")
    page.write_text(f"{before}<!-- beam.py -->\n{tables}\n<!-- end -->\n{after}", encoding="utf-8")


if __name__ == "__main__":
    main()

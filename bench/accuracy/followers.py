#!/usr/bin/python3
"""Loads that turn with what they act on, against the elastica: docs/measurements/followers.md.

    PATH=build/release/bin:$PATH bench/accuracy/followers.py

Cantilevers 80 x 1 x 1 mm (E = 1 GPa, no contraction across, but 1/4 in model `springs`). Under an end moment theta E I / L the exact shape is an arc of the
angle theta. Under a force or a pressure that stays square to the bar it is the elastica, integrated from the free end by Runge and
Kutta's method (Timoshenko and Gere 1961, section 2.7, with loads that turn); the pressure acts half a thickness off the axis.
"""

import argparse
import json
import math
import pathlib
import tempfile
import time

from modes import box, call

ROOT = pathlib.Path(__file__).resolve().parents[2]
LENGTH, SIDE, YOUNG = 0.08, 1e-3, 1e9
INERTIA = SIDE ** 4 / 12


def elastica(end_force, pressure, steps=4000):
    """(x, z) m of the free end of a cantilever along x: an end force [N] and a pressure [Pa] against its lower side, both square to the bar."""
    def slopes(state):
        # from the free end back: place, angle, moment, force of the part beyond, all in the frame of the free end
        x, z, angle, moment, fx, fz = state
        curvature = moment / (YOUNG * INERTIA)
        # the lower side is the outer one where the bar bends up
        line = pressure * SIDE * (1 + curvature * SIDE / 2)
        return (-math.cos(angle), -math.sin(angle), -curvature,
                math.cos(angle) * fz - math.sin(angle) * fx, -line * math.sin(angle), line * math.cos(angle))

    state, step = (0.0, 0.0, 0.0, 0.0, 0.0, end_force), LENGTH / steps
    for _ in range(steps):
        a = slopes(state)
        b = slopes([y + step / 2 * k for y, k in zip(state, a)])
        c = slopes([y + step / 2 * k for y, k in zip(state, b)])
        d = slopes([y + step * k for y, k in zip(state, c)])
        state = [y + step / 6 * (p + 2 * q + 2 * r + s) for y, p, q, r, s in zip(state, a, b, c, d)]
    x, z, angle = state[:3]
    # the held end is the origin and looks along x
    return (-x * math.cos(angle) - z * math.sin(angle), x * math.sin(angle) - z * math.cos(angle))


def arc(angle):
    radius = LENGTH / angle
    return radius * math.sin(angle), radius * (1 - math.cos(angle))


def run(folder, model, across, load):
    """The probed end (x, z) m, seconds and Newton iterations."""
    (folder / "bar.obj").write_text(box(80, 1, 1))
    options = ["--moments"] if model == "quadratic" else []
    call("flexel-voxelize", "bar.obj", "--size", f"{1 / across}mm", *options, "-o", "bar.vtu", cwd=folder)
    poisson = 0.25 if model == "springs" else 0
    (folder / "s.toml").write_text(
        f'model = "{model}"\nmaterial = "it"\n[materials.it]\nyoung = "1 GPa"\npoisson = {poisson}\ndensity = "1000 kg/m3"\n'
        f'[[fix]]\nwhere = "xmin"\n[[load]]\n{load}\n[[probe]]\nname = "end"\nat = ["80 mm", "0.5 mm", "0.5 mm"]\n')
    began = time.monotonic()
    found = json.loads(call("flexel-simulate", "s.toml", "bar.vtu", "-o", "out.vtu", "--json", "--no-estimate", cwd=folder))
    moved = found["probes"][0]["displacement"]
    return LENGTH + moved[0], moved[2], time.monotonic() - began, found["newton_iterations"]


def cases():
    for name, angle in (("a quarter of a circle", math.pi / 2), ("half a circle", math.pi), ("a whole circle", 2 * math.pi)):
        torque = f'where = "xmax"\ntorque = ["0 N m", "{-YOUNG * INERTIA * angle / LENGTH!r} N m", "0 N m"]\n'
        yield f"end moment, {name}", torque, arc(angle)
    force = 8 * YOUNG * INERTIA / LENGTH ** 2
    yield "end force, F L^2 / (E I) = 8", f'where = "xmax"\nforce = ["0 N", "0 N", "{force!r} N"]\n', elastica(force, 0)
    pressure = 20 * YOUNG * INERTIA / LENGTH ** 3 / SIDE
    yield "pressure, p w L^3 / (E I) = 20", f'where = "zmin"\npressure = "{pressure!r} Pa"\n', elastica(0, pressure)


def main():
    arguments = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    arguments.add_argument("-o", default=str(ROOT / "docs/measurements/followers.md"))
    where = arguments.parse_args().o
    text = ["# Loads that turn with what they act on", "",
            "Written by `bench/accuracy/followers.py`, which names the references: cantilevers 80 x 1 x 1 mm and how far the middle of their free end is from its "
            "exact place, in shares of the length; what the keys mean: [scene.md](../reference/scene.md). Times are of a machine that did other work beside.", "",
            "| load | model | cells through the thickness | follower | dead | Newton iterations | s |", "|---|---|---|---|---|---|---|"]
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for title, load, (x, z) in cases():
            for model, across in (("cells", 4), ("quadratic", 1), ("quadratic", 2), ("springs", 4)):
                off = lambda end: math.hypot(end[0] - x, end[1] - z) / LENGTH
                row = run(folder, model, across, load + "follower = true")
                try:
                    dead = f"{100 * off(run(folder, model, across, load)):.0f} %"
                except RuntimeError:
                    dead = "no equilibrium found"
                text.append(f"| {title} | `{model}` | {across} | {100 * off(row):.2f} % | {dead} | {row[3]} | {row[2]:.1f} |")
                print(text[-1], flush=True)
    pathlib.Path(where).write_text("\n".join(text) + "\n")


if __name__ == "__main__":
    main()

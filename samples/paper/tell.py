#!/usr/bin/env python3
"""tell.py FILE WHAT...: figures of a run. Of books (CSV): the last value of a column, named without its unit. Of a summary or report (JSON): the
displacement of a probe along an axis ("end x"), a natural frequency ("mode 1"), or a number by its keys ("timed.steps"). tell.py FILE alone, of `flexel measure --json`: Young's
modulus, Poisson's ratio and the shear modulus by direction, moduli over those of the material."""

import csv
import json
import sys


def of_books(file):
    last = list(csv.DictReader(file))[-1]
    return {name.rpartition(" [")[0]: (float(value), name.rpartition(" [")[2][:-1]) for name, value in last.items()}


def of_summary(summary, prefix=""):
    values = {}
    for name, value in summary.items():
        if isinstance(value, dict):
            values.update(of_summary(value, f"{prefix}{name}."))
        elif isinstance(value, (int, float)):
            values[prefix + name] = (value, "")
    for number, mode in enumerate(summary.get("modes", []), 1):
        values[f"mode {number}"] = (mode["frequency"], "Hz")
    for probe in summary.get("probes", []):
        values.update({f"{probe['name']} {axis}": (1e3 * u, "mm") for axis, u in zip("xyz", probe["displacement"])})
    return values


def tell_moduli(measured):
    for each in measured["inside"]:
        print(f"{each['along']} across {each['across']}: E {each['young'] / measured['young']:.3f}, nu {each['poisson']:.3f}, "
              f"G {each['shear'] / measured['shear']:.3f}")


with open(sys.argv[1], encoding="utf-8") as opened:
    data = of_books(opened) if sys.argv[1].endswith(".csv") else json.load(opened)
if len(sys.argv) == 2:
    tell_moduli(data)
figures = data if sys.argv[1].endswith(".csv") else of_summary(data)
for what in sys.argv[2:]:
    number, unit = figures[what]
    print(f"{what}: {number:.4g} {unit}".rstrip())

#!/usr/bin/env python3
"""measure.py SUPPORTS.csv: how far everything gives way and how it flies apart, from the books of a run."""

import csv
import sys

with open(sys.argv[1], encoding="utf-8") as file:
    rows = [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]
for name in ("cylinder", "beam", "shelf"):
    lowest = min(rows, key=lambda row: row[f"{name} z [m]"])
    print(f"{name}: lowest by {-1e3 * lowest[f'{name} z [m]']:.2f} mm at {1e3 * lowest['time [s]']:.1f} ms")
first, last = rows[-100], rows[-1]
for name in ("cylinder", "beam"):
    speed = (last[f"{name} z [m]"] - first[f"{name} z [m]"]) / (last["time [s]"] - first["time [s]"])
    print(f"{name}: {speed:.2f} m/s upwards in the end")

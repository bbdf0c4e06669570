#!/usr/bin/env python3
"""peaks.py BOOKS.csv: the largest force on each tool and the largest way of each probe, when, and the last, from the books of a run.

Forces are medians over 2 ms: at the corners of its path a tool's own inertia takes a large one for a step.
"""

import csv
import math
import statistics
import sys

with open(sys.argv[1], encoding="utf-8") as file:
    rows = [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]

TIMES = [row["time [s]"] for row in rows]


def settle(column):
    """Running medians of a column, in its place."""
    values = [row[column] for row in rows]
    every = (TIMES[-1] - TIMES[0]) / (len(rows) - 1)
    reach = round(1e-3 / every)
    for i, row in enumerate(rows):
        row[column] = statistics.median(values[max(0, i - reach):i + reach + 1])


def tell(name, unit, shown, scale):
    def size(row):
        return math.hypot(*(row[f"{name} {axis} [{unit}]"] for axis in "xyz"))

    most = max(rows, key=size)
    x, y, z = (scale * most[f"{name} {axis} [{unit}]"] for axis in "xyz")
    print(f"{name}: largest ({x:.1f}, {y:.1f}, {z:.1f}) {shown} at {1e3 * most['time [s]']:.0f} ms, in the end {scale * size(rows[-1]):.1f} {shown}")


for column in rows[0]:
    if column.endswith(" force x [N]"):
        for axis in "xyz":
            settle(column.replace(" x [N]", f" {axis} [N]"))
        tell(column[:-6], "N", "N", 1)
    elif column.endswith(" x [m]"):
        tell(column[:-6], "m", "mm", 1e3)

#!/usr/bin/env python3
"""measure.py TORN.csv: when the first and the last cells break, and what they took, from the books of a run."""

import csv
import sys

with open(sys.argv[1], encoding="utf-8") as file:
    rows = [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]
TAKEN = "fracture dissipated [J]"
first = next(row for row in rows if row[TAKEN] > 0)
last = next(row for row in rows if row[TAKEN] == rows[-1][TAKEN])
print(f"first cells break at {1e3 * first['time [s]']:.1f} ms, under {2 * first['time [s]'] / 50e-3:.2f} N; the last at {1e3 * last['time [s]']:.1f} ms")
print(f"breaking took {1e3 * rows[-1][TAKEN]:.2f} mJ")

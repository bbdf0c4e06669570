#!/usr/bin/env python3
"""measure.py SWING.csv: how far the head was drawn, how long a swing takes, and how fast they die away, from the books of a run."""

import csv
import math
import sys

LET_GO = 0.251  # s, as in swing.toml

with open(sys.argv[1], encoding="utf-8") as file:
    rows = list(csv.DictReader(file))
time = [float(row["time [s]"]) for row in rows]
head = [float(row["head z [m]"]) for row in rows]

# turning points after the release: the parabola through a sample and its neighbours
turns = []
for i in range(1, len(time) - 1):
    if time[i] > LET_GO + 0.004 and (head[i] - head[i - 1]) * (head[i + 1] - head[i]) < 0:
        bend = head[i + 1] - 2 * head[i] + head[i - 1]
        offset = (head[i - 1] - head[i + 1]) / (2 * bend)
        turns.append((time[i] + offset * (time[i + 1] - time[i]), head[i] - bend * offset**2 / 2))
drawn = min(head)
swings = (len(turns) - 2) // 2
period = (turns[2 * swings][0] - turns[0][0]) / swings
first, last = (abs(turns[i][1] - turns[i + 1][1]) for i in (0, 2 * swings))
decrement = math.log(first / last) / swings
print(f"drawn down by {-1e3 * drawn:.2f} mm; {swings} swings of {1e3 * period:.1f} ms, each {100 * math.exp(-decrement):.1f} % of the one"
      f" before: damping ratio {decrement / math.hypot(decrement, 2 * math.pi):.4f}")

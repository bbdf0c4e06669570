#!/usr/bin/env python3
"""Prints a rubber ring that stands between two jaws as ASCII STL, in mm, a solid each."""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from solids import block, ring  # noqa: E402

RADIUS, WALL, GAP = 24, 8, 0.5
ring("ring", (0, RADIUS), RADIUS, RADIUS - WALL, (0, 16))
block("left", (-RADIUS - GAP - 8, -RADIUS - GAP), (-2, 18), (14, 34))
block("right", (RADIUS + GAP, RADIUS + GAP + 8), (-2, 18), (14, 34))

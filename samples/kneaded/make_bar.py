#!/usr/bin/env python3
"""Prints a bar along x and three round tools across it as ASCII STL, in mm, a solid each."""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from solids import bar, circle, prism  # noqa: E402

bar("bar", (0, 120), (0, 12), (0, 12), 30)
RADIUS, GAP = 8, 0.3
prism("left", circle((25, -RADIUS - GAP), RADIUS, 24), (-2, 14))
prism("right", circle((95, -RADIUS - GAP), RADIUS, 24), (-2, 14))
prism("middle", circle((60, 12 + RADIUS + GAP), RADIUS, 24), (-2, 14))

#!/usr/bin/env python3
"""Prints two supports, a beam that lies on them and a cylinder above it as ASCII STL, in mm, a solid each: prisms along y."""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from solids import circle, prism  # noqa: E402

# against the wall a plate, above it a shelf, between them a gusset
LEFT = [(0, 0), (8, 0), (40, 32), (40, 40), (0, 40)]
prism("left", LEFT, (0, 24))
prism("right", [(200 - x, z) for x, z in reversed(LEFT)], (0, 24))
prism("beam", [(16, 40), (184, 40), (184, 52), (16, 52)], (0, 24))
prism("cylinder", circle((100, 74), 20), (-4, 28))

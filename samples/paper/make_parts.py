#!/usr/bin/env python3
"""make_parts.py NAME: a part of docs/guide/paper.md as ASCII STL, in mm."""

import pathlib
import sys

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1]))
from solids import block  # noqa: E402

PARTS = {
    "beam": lambda: block("beam", (0, 2000), (0, 700), (0, 500)),
    "bar": lambda: block("bar", (0, 60), (0, 15), (0, 15)),
    "blocks": lambda: (block("left", (0, 20), (0, 20), (0, 20)), block("right", (25, 45), (0, 20), (0, 20))),
    "sledge": lambda: block("sledge", (0, 20), (0, 20), (0, 20)),
    "press": lambda: (block("pad", (0, 30), (0, 30), (0, 15)), block("ram", (5, 25), (5, 25), (16, 26))),
}

PARTS[sys.argv[1]]()

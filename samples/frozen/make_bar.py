#!/usr/bin/env python3
"""Prints a bar of 120 x 12 x 12 along x as OBJ, in mm. Groups: start, end, sides."""

SIZE = (120, 12, 12)
for n in range(8):
    print("v", *(SIZE[axis] * (n >> axis & 1) for axis in range(3)))
for name, faces in {"start": [(1, 5, 7, 3)], "end": [(2, 4, 8, 6)], "sides": [(1, 2, 6, 5), (3, 7, 8, 4), (1, 3, 4, 2), (5, 6, 8, 7)]}.items():
    print(f"g {name}")
    for face in faces:
        print("f", *face)

#!/usr/bin/env python3
"""Prints a plate of 80 x 24 x 4 along x as OBJ, in mm. Groups: start, end, sides."""

SIZE = (80, 24, 4)
for n in range(8):
    print("v", *(SIZE[axis] * (n >> axis & 1) for axis in range(3)))
for name, faces in {"start": [(1, 5, 7, 3)], "end": [(2, 4, 8, 6)], "sides": [(1, 2, 6, 5), (3, 7, 8, 4), (1, 3, 4, 2), (5, 6, 8, 7)]}.items():
    print(f"g {name}")
    for face in faces:
        print("f", *face)

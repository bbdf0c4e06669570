#!/usr/bin/env python3
"""Prints a hammer as OBJ, in mm: a handle of 40 x 12 x 12 along x and a head of 12 x 12 x 28 at its end. Groups: grip (the end of the
handle), head (its far side), sides."""

# the outline in the x-z plane, all around, and the four rectangles that it is cut into (indices into it)
OUTLINE = [(0, 0), (40, 0), (40, -8), (52, -8), (52, 0), (52, 12), (52, 20), (40, 20), (40, 12), (0, 12)]
RECTANGLES = [(0, 1, 8, 9), (2, 3, 4, 1), (1, 4, 5, 8), (8, 5, 6, 7)]
WIDTH, COUNT = 12, len(OUTLINE)

for y in (0, WIDTH):
    for x, z in OUTLINE:
        print(f"v {x} {y} {z}")
groups = {"grip": [], "head": [], "sides": []}
for rectangle in RECTANGLES:
    groups["sides"].append([i + 1 for i in rectangle])
    groups["sides"].append([i + 1 + COUNT for i in reversed(rectangle)])
for i in range(COUNT):
    j = (i + 1) % COUNT
    ends = {OUTLINE[i][0], OUTLINE[j][0]}
    groups["grip" if ends == {0} else "head" if ends == {52} else "sides"].append([j + 1, i + 1, i + 1 + COUNT, j + 1 + COUNT])
for name, faces in groups.items():
    print(f"g {name}")
    for face in faces:
        print("f", *face)

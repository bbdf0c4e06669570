#!/usr/bin/env python3
"""Prints an L-bracket of 40 x 10 x 40, 6 thick, as OBJ, in mm. Groups: wall (the back of the upright), tip (the far end of the arm), sides."""

# the outline in the x-z plane, all around, and the rectangles that it is cut into (indices into it)
OUTLINE = [(0, 0), (6, 0), (40, 0), (40, 6), (6, 6), (6, 40), (0, 40), (0, 6)]
RECTANGLES = [(0, 1, 4, 7), (1, 2, 3, 4), (7, 4, 5, 6)]
WIDTH, COUNT = 10, len(OUTLINE)

for y in (0, WIDTH):
    for x, z in OUTLINE:
        print(f"v {x} {y} {z}")
groups = {"wall": [], "tip": [], "sides": []}
for rectangle in RECTANGLES:
    groups["sides"].append([i + 1 for i in rectangle])
    groups["sides"].append([i + 1 + COUNT for i in reversed(rectangle)])
for i in range(COUNT):
    j = (i + 1) % COUNT
    ends = {OUTLINE[i][0], OUTLINE[j][0]}
    groups["wall" if ends == {0} else "tip" if ends == {40} else "sides"].append([j + 1, i + 1, i + 1 + COUNT, j + 1 + COUNT])
for name, faces in groups.items():
    print(f"g {name}")
    for face in faces:
        print("f", *face)

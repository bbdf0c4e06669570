#!/usr/bin/env python3
"""Prints a calf and two round tools at its flanks as ASCII STL, in mm, a solid each.

The calf is where a sum of soft balls passes 1, as triangles by marching tetrahedra.
"""

import itertools
import math
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from solids import circle, prism, solid  # noqa: E402

STEP = 5.0
# centre, half-axes
BALLS = [((0, 0, 60), (44, 20, 22)), ((-22, 0, 60), (22, 20, 22)), ((52, 0, 78), (14, 9, 18)), ((66, 0, 92), (18, 11, 11)), ((80, 0, 88), (9, 8, 8))]
BALLS += [((x, side * 11, z), (8, 8, 13)) for x in (-32, 30) for side in (-1, 1) for z in (12, 24, 38)]
BALLS += [((60, side * 14, 100), (5, 9, 4)) for side in (-1, 1)]


def field(point):
    total = 0.0
    for centre, axes in BALLS:
        squared = sum(((p - c) / a) ** 2 for p, c, a in zip(point, centre, axes))
        if squared < 6:
            total += math.exp(1.4 * (1 - squared))
    return total - 1


LOW = (-72.3, -32.3, -7.3)
COUNT = (36, 14, 27)


def corner(index):
    return tuple(low + STEP * i for low, i in zip(LOW, index))


VALUES = {index: field(corner(index)) for index in itertools.product(*map(range, COUNT))}


def crossing(a, b):
    """Where the field passes 0 on an edge; the same from both ends."""
    a, b = sorted((a, b))
    share = min(max(VALUES[a] / (VALUES[a] - VALUES[b]), 0.02), 0.98)
    return tuple(p + share * (q - p) for p, q in zip(corner(a), corner(b)))


def outward(triangle, inside, outside):
    (ax, ay, az), (bx, by, bz), (cx, cy, cz) = triangle
    ux, uy, uz, vx, vy, vz = bx - ax, by - ay, bz - az, cx - ax, cy - ay, cz - az
    normal = (uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx)
    way = [o - i for i, o in zip(corner(inside), corner(outside))]
    right = sum(n * w for n, w in zip(normal, way)) > 0
    return triangle if right else (triangle[0], triangle[2], triangle[1])


def surface():
    triangles = []
    for base in itertools.product(*(range(n - 1) for n in COUNT)):
        cube = [tuple(b + d for b, d in zip(base, step)) for step in itertools.product((0, 1), repeat=3)]
        if len({VALUES[c] > 0 for c in cube}) < 2:
            continue
        for order in itertools.permutations((4, 2, 1)):  # six tetrahedra around the diagonal
            tetrahedron = [cube[0], cube[order[0]], cube[order[0] + order[1]], cube[7]]
            inner = [c for c in tetrahedron if VALUES[c] > 0]
            outer = [c for c in tetrahedron if VALUES[c] <= 0]
            if not inner or not outer:
                continue
            if len(inner) == 2:
                a, b, c, d = (crossing(i, o) for i, o in ((inner[0], outer[0]), (inner[0], outer[1]), (inner[1], outer[1]), (inner[1], outer[0])))
                triangles += [outward((a, b, c), inner[0], outer[0]), outward((a, c, d), inner[1], outer[1])]
            else:
                triangles.append(outward(tuple(crossing(i, o) for i in inner for o in outer), inner[0], outer[0]))
    return triangles


calf = surface()
solid("calf", calf)
GAP = 0.5
FLANK = max(y for triangle in calf for x, y, z in triangle if abs(x + 2) < 14 and abs(z - 60) < 14)
prism("left", circle((-2, 60), 14, 32), (-FLANK - GAP - 12, -FLANK - GAP))
prism("right", circle((-2, 60), 14, 32), (FLANK + GAP, FLANK + GAP + 12))

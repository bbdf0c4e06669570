#!/usr/bin/env python3
"""Prints two supports, a beam that lies on them and a cylinder above it as ASCII STL, in mm, a solid each: prisms along y."""

import math


def prism(name, outline, y):
    """A solid: `outline`, convex, in the x-z plane (counter-clockwise seen from -y), between the two `y`."""
    near, far = ([(x, each, z) for x, z in outline] for each in y)
    count = len(outline)
    triangles = []
    for i in range(1, count - 1):
        triangles += [(near[0], near[i], near[i + 1]), (far[0], far[i + 1], far[i])]
    for i in range(count):
        j = (i + 1) % count
        triangles += [(near[j], near[i], far[i]), (near[j], far[i], far[j])]
    print(f"solid {name}")
    for triangle in triangles:
        print(" facet normal 0 0 0\n  outer loop")
        for x, y_, z in triangle:
            print(f"   vertex {x:.9g} {y_:.9g} {z:.9g}")
        print("  endloop\n endfacet")
    print(f"endsolid {name}")


# against the wall a plate, above it a shelf, between them a gusset
LEFT = [(0, 0), (8, 0), (40, 32), (40, 40), (0, 40)]
prism("left", LEFT, (0, 24))
prism("right", [(200 - x, z) for x, z in reversed(LEFT)], (0, 24))
prism("beam", [(16, 40), (184, 40), (184, 52), (16, 52)], (0, 24))
AROUND = 48
prism("cylinder", [(100 + 20 * math.cos(2 * math.pi * i / AROUND), 74 + 20 * math.sin(2 * math.pi * i / AROUND)) for i in range(AROUND)], (-4, 28))

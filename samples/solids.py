"""Solids for the samples, printed as ASCII STL in mm: prisms along y and round bars."""

import math


def solid(name, triangles):
    """Prints `triangles` (outward, three points each) as the solid `name`."""
    print(f"solid {name}")
    for triangle in triangles:
        print(" facet normal 0 0 0\n  outer loop")
        for point in triangle:
            print("   vertex {:.9g} {:.9g} {:.9g}".format(*point))
        print("  endloop\n endfacet")
    print(f"endsolid {name}")


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
    solid(name, triangles)


def block(name, x, y, z):
    """A box between two values of each."""
    prism(name, [(x[0], z[0]), (x[1], z[0]), (x[1], z[1]), (x[0], z[1])], y)


def bar(name, x, y, z, pieces):
    """A box in so many pieces along x, so that its surface can bend."""
    rims = []
    for i in range(pieces + 1):
        at = x[0] + (x[1] - x[0]) * i / pieces
        rims.append([(at, y[0], z[0]), (at, y[1], z[0]), (at, y[1], z[1]), (at, y[0], z[1])])
    triangles = []
    for one, two in zip(rims, rims[1:]):
        for i in range(4):
            j = (i + 1) % 4
            triangles += [(one[i], one[j], two[j]), (one[i], two[j], two[i])]
    first, last = rims[0], rims[-1]
    triangles += [(first[0], first[2], first[1]), (first[0], first[3], first[2]), (last[0], last[1], last[2]), (last[0], last[2], last[3])]
    solid(name, triangles)


def circle(centre, radius, around=48):
    """Points (x, z), counter-clockwise."""
    turns = [2 * math.pi * i / around for i in range(around)]
    return [(centre[0] + radius * math.cos(turn), centre[1] + radius * math.sin(turn)) for turn in turns]


def ring(name, centre, outer, inner, y, around=48):
    """A tube along y around `centre` (x, z)."""
    walls = [[(x, each, z) for x, z in circle(centre, radius, around)] for radius in (outer, inner) for each in y]
    triangles = []
    # from the outer wall over the far end to the inner one and back
    for a, b in ((0, 1), (1, 3), (3, 2), (2, 0)):
        for i in range(around):
            j = (i + 1) % around
            triangles += [(walls[a][j], walls[a][i], walls[b][i]), (walls[a][j], walls[b][i], walls[b][j])]
    solid(name, triangles)

"""Boxes as STL, for tests and benchmarks."""

import struct


def box_triangles(size=(40.0, 10.0, 10.0)):
    """Twelve outward triangles of a box from the origin."""
    x, y, z = size
    corners = [(a, b, c) for c in (0.0, z) for b in (0.0, y) for a in (0.0, x)]
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return [[corners[f[0]], corners[f[i]], corners[f[i + 1]]] for f in faces for i in (1, 2)]


def binary_stl(triangles):
    data = b"test part".ljust(80) + struct.pack("<I", len(triangles))
    for triangle in triangles:
        data += struct.pack("<12fH", 0, 0, 0, *[c for corner in triangle for c in corner], 0)
    return data


def ascii_stl(triangles, name="part"):
    lines = [f"solid {name}"]
    for triangle in triangles:
        lines += ["facet normal 0 0 0", "outer loop", *(f"vertex {x!r} {y!r} {z!r}" for x, y, z in triangle), "endloop", "endfacet"]
    return ("\n".join([*lines, f"endsolid {name}"]) + "\n").encode()

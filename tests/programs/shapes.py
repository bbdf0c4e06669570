"""Boxes as STL and bars as OBJ, for tests and benchmarks."""

import math
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


def turn(degrees, axis=(1, 2, 3)):
    """Rotation matrix (Rodrigues)."""
    length, angle = math.hypot(*axis), math.radians(degrees)
    x, y, z = (each / length for each in axis)
    c, s = math.cos(angle), math.sin(angle)
    return [[c + x * x * (1 - c), x * y * (1 - c) - z * s, x * z * (1 - c) + y * s],
            [y * x * (1 - c) + z * s, c + y * y * (1 - c), y * z * (1 - c) - x * s],
            [z * x * (1 - c) - y * s, z * y * (1 - c) + x * s, c + z * z * (1 - c)]]


def turned(rotation, point):
    return [sum(a * b for a, b in zip(row, point)) for row in rotation]


def obj_bar(sizes, degrees=0, gaps=()):
    """OBJ text of a bar along x, turned, with groups held (x = 0), end and side; and copies of it shifted along z by each of `gaps`; and its
    rotation."""
    rotation, lines, first = turn(degrees), [], 1
    x, y, z = sizes
    for shift in (0, *gaps):
        for c in (0, z):
            for b in (0, y):
                for a in (0, x):
                    lines.append("v {:.15g} {:.15g} {:.15g}".format(*turned(rotation, (a, b, c + shift))))
        quads = {"held": [(0, 4, 6, 2)], "end": [(1, 3, 7, 5)], "side": [(0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)]}
        for group, faces in quads.items():
            lines += [f"g {group}"] + ["f " + " ".join(str(i + first) for i in face) for face in faces]
        first += 8
    return "\n".join(lines) + "\n", rotation

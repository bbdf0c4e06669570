"""Small parts as arrays of triangles (n x 3 x 3, m, outward)."""

import numpy as np


def box(low, high):
    """A box; np.ndarray 12 x 3 x 3."""
    low, high = np.asarray(low, float), np.asarray(high, float)
    corners = np.array([[(low, high)[i & 1][0], (low, high)[i >> 1 & 1][1], (low, high)[i >> 2][2]] for i in range(8)])
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return np.array([[corners[f[0]], corners[f[i]], corners[f[i + 1]]] for f in faces for i in (1, 2)])


def bar(cells, h, at=(0, 0, 0)):
    """A box of whole cells of spacing h with its lowest corner at `at`."""
    at = np.asarray(at, float)
    return box(at, at + h * np.asarray(cells, float))


def grid_box(cells, h, at=(0, 0, 0)):
    """The same with two triangles on the face of every cell, so that its surface can bend."""
    triangles = []
    for axis in range(3):
        b, c = (axis + 1) % 3, (axis + 2) % 3
        for side in (0, 1):
            for i in range(cells[b]):
                for j in range(cells[c]):
                    square = np.zeros((4, 3))
                    square[:, axis] = side * cells[axis]
                    square[:, b] = [i, i + 1, i + 1, i]
                    square[:, c] = [j, j, j + 1, j + 1]
                    if not side:
                        square = square[::-1]
                    triangles += [square[[0, 1, 2]], square[[0, 2, 3]]]
    return np.asarray(at, float) + h * np.array(triangles)


def tube_along(centres, radius, sides=12):
    """A closed tube of circles around a line of centres (n x 3), its ends capped."""
    centres = np.asarray(centres, float)
    tangent = np.gradient(centres, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1)[:, None]
    normal = np.cross(tangent[0], [0.0, 0.0, 1.0] if abs(tangent[0][2]) < 0.9 else [1.0, 0.0, 0.0])
    rings = []
    for centre, t in zip(centres, tangent):
        normal = normal - t * (normal @ t)
        normal /= np.linalg.norm(normal)
        across = np.cross(t, normal)
        angle = 2 * np.pi * np.arange(sides) / sides
        rings.append(centre + radius * (np.cos(angle)[:, None] * normal + np.sin(angle)[:, None] * across))
    triangles = []
    for a, b in zip(rings, rings[1:]):
        for i in range(sides):
            j = (i + 1) % sides
            triangles += [(a[i], a[j], b[j]), (a[i], b[j], b[i])]
    for ring, centre, flip in ((rings[0], centres[0], True), (rings[-1], centres[-1], False)):
        for i in range(sides):
            j = (i + 1) % sides
            triangles.append((centre, ring[j], ring[i]) if flip else (centre, ring[i], ring[j]))
    return np.array(triangles)


def helix(radius, pitch, turns, wire, points=24, sides=12):
    """A coil around z: the middle of the wire runs at `radius`, `pitch` a turn; `wire` is the wire's radius, `sides` the corners of its outline."""
    angle = 2 * np.pi * np.arange(int(turns * points) + 1) / points
    return tube_along(np.stack([radius * np.cos(angle), radius * np.sin(angle), pitch * angle / (2 * np.pi)], axis=1), wire, sides)


def prism(outline, y):
    """A solid between two y: `outline` (n x 2: x, z), star-shaped about its mean, counter-clockwise seen from -y."""
    near, far = ([np.array([x, each, z]) for x, z in outline] for each in y)
    count = len(outline)
    triangles = []
    middle = (np.mean(near, axis=0), np.mean(far, axis=0))
    for i in range(count):
        j = (i + 1) % count
        triangles += [(near[j], near[i], far[i]), (near[j], far[i], far[j]), (middle[0], near[i], near[j]), (middle[1], far[j], far[i])]
    return np.array(triangles)


def strip(top, bottom, y):
    """A solid between two lines of equally many points (x, z), `top` above `bottom`, both with x rising, and two y."""
    top, bottom = np.asarray(top, float), np.asarray(bottom, float)

    def at(line, i, side):
        return np.array([line[i][0], y[side], line[i][1]])

    triangles = []

    def quad(a, b, c, d):
        triangles.extend([(a, b, c), (a, c, d)])

    last = len(top) - 1
    for i in range(last):
        quad(at(top, i, 0), at(top, i + 1, 0), at(top, i + 1, 1), at(top, i, 1))
        quad(at(bottom, i, 0), at(bottom, i, 1), at(bottom, i + 1, 1), at(bottom, i + 1, 0))
        quad(at(bottom, i, 0), at(bottom, i + 1, 0), at(top, i + 1, 0), at(top, i, 0))
        quad(at(bottom, i, 1), at(top, i, 1), at(top, i + 1, 1), at(bottom, i + 1, 1))
    quad(at(bottom, 0, 0), at(top, 0, 0), at(top, 0, 1), at(bottom, 0, 1))
    quad(at(bottom, last, 0), at(bottom, last, 1), at(top, last, 1), at(top, last, 0))
    return np.array(triangles)

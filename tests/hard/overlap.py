"""Whether a closed surface passes through itself, and how near its sheets come, by the winding number (Jacobson, Kavan, Sorkine 2013)."""

import numpy as np


def winding_numbers(points, triangles):
    """How often the surface (n x 3 x 3, outward) winds around each point: 0 outside, 1 inside, 2 where it overlaps itself. Solid angles by Van Oosterom and Strackee (1983)."""
    numbers = np.zeros(len(points))
    for begin in range(0, len(points), 64):
        a, b, c = np.moveaxis(triangles[None] - points[begin:begin + 64, None, None, :], 2, 0)
        la, lb, lc = (np.linalg.norm(each, axis=2) for each in (a, b, c))
        volume = np.einsum("ijk,ijk->ij", a, np.cross(b, c))
        numbers[begin:begin + 64] = np.arctan2(volume, la * lb * lc + (a * b).sum(2) * lc + (b * c).sum(2) * la + (c * a).sum(2) * lb).sum(1) / (2 * np.pi)
    return numbers


def vertices(triangles, size):
    """Places and mean outward normals of the vertices that triangles share (to a millionth of `size`)."""
    keys, number = np.unique(np.round(triangles.reshape(-1, 3) / size, 6), axis=0, return_inverse=True)
    normals = np.zeros((len(keys), 3))
    areas = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    np.add.at(normals, number.reshape(-1), np.repeat(areas, 3, axis=0))
    return keys * size, normals / np.linalg.norm(normals, axis=1)[:, None]


def touching(triangles, size, gap):
    """Places of the vertices that have matter of another sheet within `gap` in front of them."""
    places, normals = vertices(triangles, size)
    return places[winding_numbers(places + gap * normals, triangles) > 0.5]


def deepest(triangles, size):
    """The deepest that a vertex lies inside another sheet, along its own normal, in hundredths of `size`; 0: none overlaps."""
    places, normals = vertices(triangles, size)
    depth = 0
    while len(places):
        inside = winding_numbers(places - (depth + 1) * size / 100 * normals, triangles) > 1.5
        places, normals = places[inside], normals[inside]
        depth += len(places) > 0
    return depth / 100

#!/usr/bin/env python3
"""Prints the paper's beam (Jansson and Vergeest, section 5) as OBJ, in m: 2 x 0.7 x 0.5 along x, squares of at most 50 mm. Groups: start,
end, sides."""

SIZE, SQUARES = (2.0, 0.7, 0.5), (40, 14, 10)

numbers = {}


def vertex(index):
    """The number of the vertex at this place of the grid; it is printed at its first use."""
    if index not in numbers:
        numbers[index] = len(numbers) + 1
        print("v", *(f"{SIZE[axis] * index[axis] / SQUARES[axis]:.6g}" for axis in range(3)))
    return numbers[index]


def side(axis, end):
    """The squares of one side, counter-clockwise from outside."""
    u, v = (axis + 1) % 3, (axis + 2) % 3
    if not end:
        u, v = v, u
    for i in range(SQUARES[u]):
        for j in range(SQUARES[v]):
            corners = []
            for a, b in ((0, 0), (1, 0), (1, 1), (0, 1)):
                index = [0, 0, 0]
                index[axis] = SQUARES[axis] if end else 0
                index[u], index[v] = i + a, j + b
                corners.append(vertex(tuple(index)))
            yield corners


for group, sides in (("start", [(0, False)]), ("end", [(0, True)]), ("sides", [(1, False), (1, True), (2, False), (2, True)])):
    faces = [corners for each in sides for corners in side(*each)]
    print("g", group)
    for corners in faces:
        print("f", *corners)

#!/usr/bin/python3
"""Prints a tuning fork as OBJ, in mm: two prongs of 80 x 5 mm, 10 mm apart, on a handle of 40 x 5 mm, all 5 mm thick."""

XS, YS, HEIGHT = (0, 40, 50, 130), (0, 5, 7.5, 12.5, 15, 20), 5


def filled(i, j):
    return (i == 0 and j == 2) or (i == 1 and 0 <= j < 5) or (i == 2 and j in (0, 4))


def main():
    number, faces = {}, []
    corner = lambda i, j, top: number.setdefault((i, j, top), len(number) + 1)
    for i in range(3):
        for j in range(5):
            if not filled(i, j):
                continue
            a, b, c, d = (i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)
            faces += [[corner(*p, 0) for p in (a, d, c, b)], [corner(*p, 1) for p in (a, b, c, d)]]
            for p, q, beside in ((a, b, (i, j - 1)), (b, c, (i + 1, j)), (c, d, (i, j + 1)), (d, a, (i - 1, j))):
                if not filled(*beside):
                    faces.append([corner(*p, 0), corner(*q, 0), corner(*q, 1), corner(*p, 1)])
    for i, j, top in number:
        print(f"v {XS[i]} {YS[j]} {HEIGHT * top}")
    for face in faces:
        print("f", *face)


main()

"""flexel info --thickness writes the wall thickness at every vertex."""

import pathlib
import struct

from harness import box, box_triangles, binary_stl, expect, expect_error, expect_ok, main, run, write


def test_thickness_of_a_plate():
    write("plate.stl", binary_stl(box_triangles((40.0, 30.0, 2.0))))
    expect_ok(run("flexel", "info", "plate.stl", "--thickness", "plate.ply"))
    data = pathlib.Path("plate.ply").read_bytes()
    expect(b"thickness" in data[:data.index(b"end_header")], "a property thickness wanted")
    body = data[data.index(b"end_header\n") + len(b"end_header\n"):]
    values = [vertex[3] for vertex in struct.iter_unpack("<4d", body[:8 * 32])]  # x, y, z, thickness
    expect(len(values) == 8 and max(abs(value - 2) for value in values) < 1e-5, f"2 mm at 8 corners wanted: {values}")


def test_the_file_must_be_ply():
    box()
    expect_error(run("flexel", "info", "box.stl", "--thickness", "box.stl"), "flexel", "--thickness", ".ply")


if __name__ == "__main__":
    main(globals())

"""Lattices in pieces: flexel-voxelize --pieces, what reads a .pvtu, and flexel-map piece by piece."""

import array
import json
import os
import re
import shutil
import struct

from harness import body, box, bracket, expect, expect_error, expect_ok, expect_only, main, run, write


def pieces(count, part="box.stl", *options, name="body.pvtu"):
    if part == "box.stl":
        box()
    return expect_ok(run("flexel-voxelize", part, "--pieces", str(count), "-o", name, *options))


def place(data, section):
    """Where the numbers of an array of a .vtu begin, and how many bytes they are."""
    offset = int(re.search(rb'Name="%s"[^>]*offset="(\d+)"' % section.encode(), data).group(1))
    at = data.index(b"_", data.index(b"<AppendedData")) + 1 + offset
    return at + 8, struct.unpack_from("<Q", data, at)[0]


def numbers(data, section, kind="d"):
    at, size = place(data, section)
    values = array.array(kind)
    values.frombytes(data[at : at + size])
    return values


def deform(path):
    """Bends the body: the same numbers for the same place, whatever file it is in."""
    data = bytearray(open(path, "rb").read())
    position = numbers(bytes(data), "rest")
    for i in range(0, len(position), 3):
        x, y, z = position[i : i + 3]
        position[i : i + 3] = array.array("d", [x - 2 * y * x, y + 9 * x * x + z * z, z + 3 * x * y])
    at, size = place(bytes(data), "position")
    data[at : at + size] = position.tobytes()
    open(path, "wb").write(data)


def both(part="box.stl", count=3, size="1 mm"):
    """whole.vtu and body.pvtu of a part, bent alike."""
    if part == "box.stl":
        box()
    expect_ok(run("flexel-voxelize", part, "--size", size, "-o", "whole.vtu"))
    pieces(count, part, "--size", size)
    deform("whole.vtu")
    for index in range(count):
        deform(f"body_{index}.vtu")


def same_maps(*options, report=True):
    expect_ok(run("flexel-map", "whole.vtu", "-o", "whole.obj", "--report", "whole.json", *options))
    expect_ok(run("flexel-map", "body.pvtu", "-o", "pieces.obj", "--report", "pieces.json", *options))
    expect(open("whole.obj").read() == open("pieces.obj").read(), f"{options}: the same surface")
    whole, put_together = json.load(open("whole.json")), json.load(open("pieces.json"))
    for key in ("lattice_volume_before", "lattice_volume_after"):
        expect(abs(put_together.pop(key) / whole.pop(key) - 1) < 1e-12, f"{options}: {key}")
    expect(whole == put_together, f"{options}: the same report\n{whole}\n{put_together}")


def test_the_map_of_pieces_is_that_of_the_whole():
    both()
    for options in ([], ["--keep-vertices"], ["--method", "smooth"], ["--method", "affine", "--refine", "3 mm"],
                    ["--method", "gram-schmidt", "--keep-vertices"], ["--check", "voronoi,self-intersection"]):
        same_maps(*options)


def test_the_map_of_pieces_of_a_cad_part_is_that_of_the_whole():
    both(bracket(), 5, "2 mm")
    same_maps("--format", "obj")
    same_maps("--format", "obj", "--method", "smooth", "--keep-vertices")


def test_the_map_does_not_need_cells_far_from_the_surface():
    """40 x 10 x 10 mm in cells of .5 mm: of the cells in the middle none is kept, and what is mapped is the same."""
    both(size="0.5 mm", count=4)
    same_maps("--keep-vertices")


def test_pieces_that_do_not_belong_together_are_told_by_name():
    pieces(3, "box.stl", "--size", "2 mm")
    os.makedirs("other")
    expect_ok(run("flexel-voxelize", "box.stl", "--pieces", "3", "--size", "1 mm", "-o", "other/body.pvtu"))
    os.makedirs("two")
    expect_ok(run("flexel-voxelize", "box.stl", "--pieces", "2", "--size", "2 mm", "-o", "two/body.pvtu"))
    kept = open("body_1.vtu", "rb").read()

    def wrong(data, *words):
        open("body_1.vtu", "wb").write(data) if data is not None else os.remove("body_1.vtu")
        for program in (["flexel-map", "body.pvtu", "-o", "out.stl"], ["flexel", "info", "body.pvtu"]):
            name = program[0]
            expect_error(run(*program), name, "body.pvtu", "body_1.vtu", *words)
        open("body_1.vtu", "wb").write(kept)

    wrong(None, "missing")
    wrong(open("other/body_1.vtu", "rb").read(), "another run")
    wrong(open("two/body_1.vtu", "rb").read(), "one of 2 pieces", "3")
    wrong(open("body_2.vtu", "rb").read(), "piece 2")
    body("whole.vtu")
    wrong(open("whole.vtu", "rb").read(), "no piece")
    os.rename("body_surface.vtu", "away.vtu")
    expect_error(run("flexel-map", "body.pvtu", "-o", "out.stl"), "flexel-map", "body_surface.vtu", "missing")
    shutil.copy("other/body_surface.vtu", "body_surface.vtu")
    expect_ok(run("flexel-map", "body.pvtu", "-o", "out.stl"))  # of the same part: the same surface
    write("body.pvtu", '<VTKFile type="PUnstructuredGrid"><PUnstructuredGrid><Piece Source="a.vtu"/></PUnstructuredGrid></VTKFile>')
    expect_error(run("flexel-map", "body.pvtu", "-o", "out.stl"), "flexel-map", "body.pvtu", "flexel-voxelize --pieces")


def test_pieces_are_told_apart_by_what_they_are_made_from():
    pieces(2, "box.stl", "--size", "2 mm")
    first = open("body.pvtu").read()
    pieces(2, "box.stl", "--size", "2 mm")
    expect(open("body.pvtu").read() == first, "the same command gives the same run")
    pieces(2, "box.stl", "--size", "2 mm", "--material", "steel")
    expect(open("body.pvtu").read() != first, "another material another one")


def test_info_says_what_a_list_holds():
    pieces(3, "box.stl", "--size", "2 mm")
    text = expect_ok(run("flexel", "info", "body.pvtu")).out.decode()
    expect("3 pieces" in text and "500 cells" in text and "body_2.vtu" in text, text)
    found = json.loads(expect_ok(run("flexel", "info", "body.pvtu", "--json")).out)
    expect(sum(each["cells"] for each in found["pieces"]) == 500, found)
    expect(sum(each["points"] for each in found["pieces"]) == 21 * 6 * 6, found)
    expect(found["run"] in open("body.pvtu").read(), found)
    expect_error(run("flexel", "info", "body.pvtu", "--words"), "flexel", "body.pvtu", "--words")


def test_what_does_not_read_a_list_says_what_to_do():
    pieces(2, "box.stl", "--size", "2 mm")
    write("scene.toml", 'material = "steel"\n[[fix]]\nwhere = "xmin"\n')
    for program in (["flexel", "picture", "body.pvtu", "-o", "x.png"], ["flexel", "view", "body.pvtu", "--html", "x.html"],
                    ["flexel-voxelize", "body.pvtu", "-o", "x.vtu"], ["flexel-simulate", "scene.toml", "body.pvtu", "-o", "x.vtu"]):
        expect_error(run(*program), program[0], "body.pvtu", "pieces", ".vtu")
    expect_ok(run("flexel", "picture", "body_1.vtu", "-o", "x.png"))
    expect_ok(run("flexel-map", "body_1.vtu", "-o", "x.stl"))
    expect_error(run("flexel-map", "body_surface.vtu", "-o", "x.stl"), "flexel-map", "body_surface.vtu", ".pvtu")
    for option in (["--onto", "box.stl"], ["--save-binding", "x.bin", "--keep-vertices", "--method", "affine"], ["--crack", "open"]):
        expect_error(run("flexel-map", "body.pvtu", "-o", "x.stl", *option), "flexel-map", option[0], "without --pieces")


def test_pieces_need_a_list_and_a_number():
    box()
    expect_error(run("flexel-voxelize", "box.stl", "--pieces", "2", "-o", "x.vtu"), "flexel-voxelize", "--pieces", ".pvtu")
    expect_error(run("flexel-voxelize", "box.stl", "--pieces", "0", "-o", "x.pvtu"), "flexel-voxelize", "--pieces")
    expect_error(run("flexel-voxelize", "box.stl", "-o", "x.pvtu"), "flexel-voxelize", "--pieces")
    expect_error(run("flexel-voxelize", "box.stl", "--pieces", "2", "--placement", "centre", "-o", "x.pvtu"), "flexel-voxelize",
                 "--pieces", "corner")
    expect_error(run("flexel-voxelize", "box.stl", "--size", "20 mm", "--pieces", "9", "-o", "x.pvtu"), "flexel-voxelize",
                 "2 layers", "--pieces 2")
    expect_only("box.stl")


def test_what_is_mapped_replaces_no_file_of_the_run():
    pieces(2, "box.stl", "--size", "2 mm")
    for name in ("body_1.vtu", "body_surface.vtu"):
        expect_error(run("flexel-map", "body.pvtu", "-o", name), "flexel-map", name, "is an input")
    os.replace("body.pvtu", "list.pvtu")
    expect_error(run("flexel-map", "list.pvtu", "-o", "out.stl", "--report", "body_surface.vtu"), "flexel-map", "body_surface.vtu", "is an input")


if __name__ == "__main__":
    main(globals())

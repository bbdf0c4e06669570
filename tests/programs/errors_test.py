"""Bad input: one line that says what, the design's exit code, and nothing left behind."""

import os
import struct

from harness import (SCENE, ascii_stl, binary_stl, body, box, box_triangles, bracket, expect, expect_error, expect_ok, expect_only, main,
                     run, scene, write)


def voxelize_refuses(part, *fragments):
    before = os.listdir(".")
    result = run("flexel-voxelize", part, "--size", "5 mm", "-o", "out.vtu")
    expect_error(result, "flexel-voxelize", *fragments)
    expect_only(*before)


def test_models():
    text = SCENE + '[parts.box]\nmodel = "{}"\n'
    box()
    expect_ok(run("flexel-voxelize", "box.stl", "--size", "5 mm", "--align", "none", "-o", "cubes.vtu"))
    result = expect_ok(run("flexel-simulate", scene("springs.toml", text.format("springs")), "cubes.vtu", "-o", "bent.vtu"))
    expect("Poisson's ratio 0.25" in result.err, f"no word on Poisson's ratio: {result}")
    expect_error(run("flexel-simulate", scene("paper.toml", text.format("paper")), "cubes.vtu"), "flexel-simulate", "paper.toml",
                 "--placement centre")
    expect_error(run("flexel-simulate", scene("typo.toml", text.format("spings")), "cubes.vtu"), "flexel-simulate",
                 'did you mean "springs"')
    expect_ok(run("flexel-voxelize", "box.stl", "--size", "5 mm", "--placement", "centre", "-o", "centres.vtu"))
    expect_error(run("flexel-simulate", "springs.toml", "centres.vtu"), "flexel-simulate", "--placement corner")


def test_empty_file():
    voxelize_refuses(write("part.stl", b""), "part.stl", "empty")


def test_empty_step_file():
    voxelize_refuses(write("part.step", b""), "part.step", "empty")


def test_directory():
    os.mkdir("part.stl")
    voxelize_refuses("part.stl", "part.stl")


def test_missing_file():
    voxelize_refuses("absent.stl", "absent.stl", "no such file")


def test_a_file_that_cannot_be_read_is_told_of_before_what_the_options_lack():
    write("cut.stl", binary_stl(box_triangles())[:-70])
    box()
    for command in (("deform",), ("deform", "-o", "bent.stl"), ("export", "--calculix", "-o", "deck.inp"), ("study", "-o", "folder"), ("compensate", "-o", "made.stl")):
        expect_error(run("flexel", command[0], "absent.stl", *command[1:]), "flexel", "absent.stl", "no such file")
        if command[0] != "study":
            expect_error(run("flexel", command[0], "box.stl", "absent.stl", *command[1:]), "flexel", "absent.stl", "no such file")
        expect_error(run("flexel", command[0], "cut.stl", *command[1:]), "flexel", "cut.stl", "cut off")
    expect_error(run("flexel", "compare", "box.stl", "cut.stl"), "flexel", "cut.stl", "cut off")
    expect_error(run("flexel", "deform", "box.stl", "-o", "bent.stl"), "flexel", "nothing acts on the part")
    expect_error(run("flexel", "deform", "cut.stl", "-o", "bent.stl", "--push", "xmax: 1 N", "--material", "PLAA"), "flexel", "cut off")


def test_unknown_format():
    voxelize_refuses(write("part.xyz", b"\x00\x01 neither this nor that\n"), "part.xyz")


def test_truncated_binary_stl():
    voxelize_refuses(write("part.stl", binary_stl(box_triangles())[:-70]), "part.stl", "cut off")


def test_truncated_ascii_stl():
    voxelize_refuses(write("part.stl", ascii_stl(box_triangles())[:-180]), "part.stl")


def test_truncated_step():
    with open(bracket("whole.step"), "rb") as file:
        data = file.read()
    voxelize_refuses(write("part.step", data[: len(data) // 2]), "part.step")


def test_nan_in_ascii_stl():
    voxelize_refuses(write("part.stl", ascii_stl(box_triangles()).replace(b"40.0", b"nan", 1)), "part.stl", "finite")


def test_nan_in_binary_stl():
    triangles = box_triangles()
    triangles[3][1] = (float("nan"), 0.0, 0.0)
    voxelize_refuses(write("part.stl", binary_stl(triangles)), "part.stl", "finite")


def test_infinity_in_obj():
    voxelize_refuses(write("part.obj", "v 0 0 0\nv 1e999 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"), "part.obj")


def test_index_out_of_range_in_obj():
    voxelize_refuses(write("part.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n"), "part.obj")


def test_size_without_unit():
    expect_error(run("flexel-voxelize", box(), "--size", "5"), "flexel-voxelize", "unit")


def test_size_larger_than_the_part():
    expect_error(run("flexel-voxelize", box(), "--size", "3 m"), "flexel-voxelize")


def test_size_that_no_memory_holds():
    expect_error(run("flexel-voxelize", box(), "--size", "1 um"), "flexel-voxelize", "memory")


def test_unknown_option():
    expect_error(run("flexel-voxelize", box(), "--siez", "5 mm"), "flexel-voxelize", "--siez", "--size")


def simulate_refuses(text, *fragments):
    scene("bend.toml", text)
    body()
    before = os.listdir(".")
    expect_error(run("flexel-simulate", "bend.toml", "body.vtu", "-o", "out.vtu"), "flexel-simulate", *fragments)
    expect_only(*before)


def test_scene_with_a_wrong_key():
    simulate_refuses(SCENE.replace("force =", "forec ="), "bend.toml:6", "forec", 'did you mean "force"')


def test_scene_with_a_wrong_table():
    simulate_refuses(SCENE.replace("[[load]]", "[[laod]]"), "bend.toml:4", "laod", 'did you mean "load"')


def test_scene_that_is_no_toml():
    simulate_refuses(SCENE.replace("[[load]]", "[[load]"), "bend.toml:4")


def test_scene_without_a_unit():
    simulate_refuses(SCENE.replace('"-100 N"', "-100"), "bend.toml:6", "unit")


def test_scene_with_a_wrong_unit():
    simulate_refuses(SCENE.replace("-100 N", "-100 mm"), "bend.toml:6", "mm")


def test_scene_with_an_unknown_material():
    simulate_refuses(SCENE.replace('"steel"', '"stele"'), "stele", 'did you mean "steel"')


def test_scene_with_an_unknown_face():
    simulate_refuses(SCENE.replace('"xmax"', '"body-box/99"'), "bend.toml:5", "body-box/99")


def test_scene_that_selects_nothing():
    simulate_refuses(SCENE.replace('"xmax"', '{ sphere = { centre = ["9 m", "0 m", "0 m"], radius = "1 mm" } }'), "bend.toml:5",
                     "holds no element")


def test_box_between_the_elements():
    thin = '{ box = { min = ["38.4 mm", "0 mm", "0 mm"], max = ["38.5 mm", "10 mm", "10 mm"] } }'
    simulate_refuses(SCENE.replace('"xmax"', thin), "holds no element", "its shortest side is 100 um", "smaller cells")


def test_scene_that_holds_nothing():
    simulate_refuses(SCENE.replace('[[fix]]\nwhere = "xmin"\n', ""), "body-box", "free")


def test_scene_without_a_material():
    simulate_refuses(SCENE.replace('material = "steel"\n', ""), "material")


def test_empty_scene():
    simulate_refuses("", "bend.toml", "empty")


def test_missing_scene():
    expect_error(run("flexel-simulate", "absent.toml", body()), "flexel-simulate", "absent.toml", "no such file")


def changed_body(old, new):
    body()
    with open("body.vtu", "rb") as file:
        data = file.read()
    assert old in data, f"{old} is not in the body file"
    write("body.vtu", data.replace(old, new, 1))


def both_refuse_body(*fragments):
    scene()
    before = os.listdir(".")
    expect_error(run("flexel-map", "body.vtu", "-o", "out.stl"), "flexel-map", "body.vtu", *fragments)
    expect_error(run("flexel-simulate", "scene.toml", "body.vtu", "-o", "out.vtu"), "flexel-simulate", "body.vtu", *fragments)
    expect_only(*before)


def test_body_with_a_wrong_number_of_points():
    changed_body(b'NumberOfPoints="81"', b'NumberOfPoints="82"')
    both_refuse_body("damaged", '"rest"')


def test_body_with_a_wrong_number_of_cells():
    changed_body(b'NumberOfCells="32"', b'NumberOfCells="31"')
    both_refuse_body("damaged", '"fill"')


def test_body_with_a_wrong_array_size():
    body()
    with open("body.vtu", "rb") as file:
        data = bytearray(file.read())
    start = data.index(b"_", data.index(b"<AppendedData")) + 1
    size = struct.unpack_from("<Q", data, start)[0]
    struct.pack_into("<Q", data, start, size + 8)
    write("body.vtu", bytes(data))
    both_refuse_body("damaged")


def test_body_that_is_truncated():
    body()
    with open("body.vtu", "rb") as file:
        data = file.read()
    write("body.vtu", data[: len(data) * 2 // 3])
    both_refuse_body("truncated")


def test_body_that_is_an_stl():
    box("body.vtu")
    both_refuse_body("not a body")


def test_map_without_a_format():
    expect_error(run("flexel-map", body()), "flexel-map", "--format")


def test_map_with_an_unknown_method():
    expect_error(run("flexel-map", body(), "--method", "afine", "-o", "x.stl"), "flexel-map", "afine", "affine")


def test_info_of_a_missing_file():
    expect_error(run("flexel", "info", "absent.step"), "flexel", "absent.step", "no such file")


def test_deform_with_an_unknown_face():
    expect_error(run("flexel", "deform", box(), "--fix", "box/77", "--push", "xmax:100 N", "--material", "steel", "-o", "out.stl"), "flexel", "box/77")
    expect_only("box.stl")


def test_unknown_command():
    expect_error(run("flexel", "deforn"), "flexel", "deforn", "deform")


if __name__ == "__main__":
    main(globals())

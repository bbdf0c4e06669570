"""What a command writes never replaces what it reads, nor another of its results; all of a run's results appear, or none."""

import os

from harness import BIN, Skip, body, box, expect, expect_error, expect_ok, expect_only, main, run, scene, write


def refused(program, *arguments, what="add --force", code=2):
    """Refused at once, with every file as it was."""
    before = {name: open(name, "rb").read() for name in os.listdir(".") if not os.path.islink(name)}
    expect_error(run(program, *arguments), program.split("/")[-1], what, code=code)
    after = {name: open(name, "rb").read() for name in os.listdir(".") if not os.path.islink(name)}
    expect(before == after, f"{arguments}: files changed: {sorted(set(before) ^ set(after))}")


def test_voxelize_does_not_replace_its_part():
    box()
    os.link("box.stl", "same.stl")
    os.symlink("box.stl", "link.stl")
    for name in ("box.stl", "./box.stl", os.path.abspath("box.stl"), "same.stl", "link.stl"):
        refused("flexel-voxelize", "box.stl", "--size", "5 mm", "-o", name)
    refused("flexel-voxelize", "box.stl", "--size", "5 mm", "-o", "out.vtu", "--summary", "box.stl")
    expect_ok(run("flexel-voxelize", "box.stl", "--size", "5 mm", "-o", "box.stl", "--force", "--quiet"))
    expect_ok(run("flexel-map", "box.stl", "--format", "stl", "-o", "rest.stl", "--quiet"))


def test_simulate_does_not_replace_scene_or_body():
    body()
    scene()
    for option, name in [("-o", "body.vtu"), ("-o", "scene.toml"), ("--summary", "scene.toml"), ("--summary", "body.vtu"),
                         ("--history", "body.vtu"), ("--checkpoint", "body.vtu")]:
        output = [] if option == "-o" else ["-o", "out.vtu"]
        refused("flexel-simulate", "scene.toml", "body.vtu", *output, option, name)
    # where the last good state of a run that fails would go
    os.rename("body.vtu", "out.failed.vtu")
    refused("flexel-simulate", "scene.toml", "out.failed.vtu", "-o", "out.vtu", what="out.failed.vtu: is an input")


def test_map_does_not_replace_what_it_reads():
    body()
    box()
    write("points.csv", "x,y,z\n1,1,1\n")
    refused("flexel-map", "body.vtu", "-o", "body.vtu")
    refused("flexel-map", "body.vtu", "--onto", "box.stl", "-o", "box.stl")
    refused("flexel-map", "body.vtu", "--points", "points.csv", "-o", "points.csv")
    refused("flexel-map", "body.vtu", "-o", "out.stl", "--report", "body.vtu")
    expect_ok(run("flexel-map", "body.vtu", "--onto", "box.stl", "-o", "box.stl", "--force", "--quiet"))


def test_map_does_not_replace_the_part_that_the_body_was_made_of():
    box("own.stl")
    part = open("own.stl", "rb").read()
    expect_ok(run("flexel-voxelize", "own.stl", "--size", "5 mm", "-o", "body.vtu", "--quiet"))
    expect_error(run("flexel-map", "body.vtu", "-o", "own.stl"), "flexel-map", "is the part that the body was made of", "--force")
    expect(open("own.stl", "rb").read() == part, "the part was changed")
    expect_ok(run("flexel-map", "body.vtu", "-o", "copy.stl", "--quiet"))
    expect_ok(run("flexel-map", "body.vtu", "-o", "copy.stl", "--quiet"))
    expect_ok(run("flexel-map", "body.vtu", "-o", "own.stl", "--force", "--quiet"))


def test_frames_of_a_series_are_not_replaced():
    body()
    falls = write("falls.toml", 'material = "steel"\n[gravity]\nacceleration = ["0 m/s2", "0 m/s2", "-9.81 m/s2"]\n'
                                '[run]\ntime = "1 us"\nframes = 1\n')
    expect_ok(run("flexel-simulate", falls, "body.vtu", "-o", "f.pvd", "--quiet"))
    refused("flexel-map", "f.pvd", "-o", "f.vtu", what="f_00000.vtu: is an input")


def test_frames_and_files_of_parts_do_not_replace_what_is_read():
    """A series and "{part}" are names of many files."""
    box()
    body("f_00002.vtu")
    falls = write("falls.toml", 'material = "steel"\n[gravity]\nacceleration = ["0 m/s2", "0 m/s2", "-9.81 m/s2"]\n'
                                '[run]\ntime = "3 us"\nframes = 3\n')
    refused("flexel-simulate", falls, "f_00002.vtu", "-o", "f.pvd", what="f_00002.vtu: is an input of this command and fits")
    os.symlink("f_00002.vtu", "g_00001.vtu")  # which would be written through
    refused("flexel-simulate", falls, "f_00002.vtu", "-o", "g.pvd", what="g_00001.vtu: is an input")
    os.rename("f_00002.vtu", "f_2b.vtu")
    expect_ok(run("flexel-simulate", falls, "f_2b.vtu", "-o", "f.pvd", "--quiet"))
    box("f_00001.stl")
    refused("flexel-map", "f.pvd", "--onto", "f_00001.stl", "-o", "f.stl", what="f_00001.stl: is an input")
    how = ["--material", "steel", "--fix", "xmin", "--push", "xmax: 0 0 -1 N", "--size", "5 mm"]
    refused("flexel", "deform", "box.stl", *how, "-o", "{part}.stl", what="box.stl: is an input")
    expect_ok(run("flexel-voxelize", "box.stl", "--size", "5 mm", "-o", "own.vtu", "--quiet"))
    refused("flexel-map", "own.vtu", "-o", "{part}.stl", what="box.stl: is the part")
    expect_ok(run("flexel", "deform", "box.stl", *how, "-o", "bent_{part}.stl", "--quiet"))
    expect_ok(run("flexel", "deform", "box.stl", *how, "-o", "{part}.stl", "--force", "--quiet"))


def test_deform_export_and_picture_do_not_replace_the_part():
    box()
    how = ["--material", "steel", "--fix", "xmin", "--push", "xmax: 0 0 -1 N"]
    for arguments in (["deform", "box.stl", *how, "-o", "box.stl"], ["deform", "box.stl", *how, "-o", "o.stl", "--summary", "box.stl"],
                      ["export", "box.stl", *how, "--calculix", "-o", "box.stl"]):
        before = open("box.stl", "rb").read()
        expect_error(run("flexel", *arguments), "flexel", "box.stl: is an input of this command", "--force")
        expect(open("box.stl", "rb").read() == before, "the part is gone")
    os.rename("box.stl", "box.png")
    expect_error(run("flexel", "picture", "box.png", "-o", "box.png"), "flexel", "is an input of this command", "--force")
    expect_only("box.png")


def test_results_do_not_replace_each_other():
    body()
    box()
    scene()
    simulate = ["flexel-simulate", "scene.toml", "body.vtu"]
    for command in ([*simulate, "-o", "x", "--summary", "x"], [*simulate, "-o", "x", "--history", "./x"],
                    [*simulate, "-o", "o.vtu", "--history", "x", "--summary", "x"], [*simulate, "-o", "x", "--checkpoint", "x"],
                    ["flexel-voxelize", "box.stl", "-o", "x", "--summary", "x"],
                    ["flexel-map", "body.vtu", "--format", "stl", "-o", "x", "--report", "x"],
                    ["flexel-map", "body.vtu", "--method", "affine", "--format", "stl", "-o", "x", "--save-binding", "x"]):
        refused(command[0], *command[1:], what='two results would go to "')
    for command in ([*simulate, "-o", "-", "--summary", "-"], [*simulate, "-o", "-", "--history", "-"], [*simulate, "--summary", "-"],
                    ["flexel-voxelize", "box.stl", "-o", "-", "--summary", "-"],
                    ["flexel-map", "body.vtu", "--format", "stl", "-o", "-", "--report", "-"]):
        refused(command[0], *command[1:], what="two results would go to stdout: give one of them a file")
    expect_ok(run("flexel-voxelize", "box.stl", "--size", "5 mm", "-o", "/dev/null", "--summary", "/dev/null"))


def test_a_checkpoint_leaves_other_files_alone():
    body()
    write("notes.body", "precious")
    timed = write("timed.toml", 'material = "steel"\n[[fix]]\nwhere = "xmin"\n[run]\ntime = "1 us"\n')
    expect_ok(run("flexel-simulate", timed, "body.vtu", "-o", "o.vtu", "--checkpoint", "notes", "--quiet"))
    expect(open("notes.body", encoding="ascii").read() == "precious", "somebody else's file was replaced")


def test_info_replaces_no_part_with_its_thickness():
    box()
    body("b.vtu")
    expect_ok(run("flexel-map", "b.vtu", "-o", "part.ply", "--quiet"))
    before = open("part.ply", "rb").read()
    os.link("part.ply", "same.ply")
    for name in ("part.ply", "same.ply"):
        expect_error(run("flexel", "info", "part.ply", "--thickness", name), "flexel", "is an input of this command", "--force")
    expect(open("part.ply", "rb").read() == before, "the part was replaced")
    expect_ok(run("flexel", "info", "part.ply", "--thickness", "part.ply", "--force"))


def test_the_same_body_gives_the_same_level_sets():
    box()
    for name in ("a.vdb", "b.vdb"):
        expect_ok(run("flexel-voxelize", "box.stl", "--size", "5 mm", "--vdb", name, "-o", "o.vtu"))
    expect(open("a.vdb", "rb").read() == open("b.vdb", "rb").read(), "two runs give other bytes")


def test_a_name_too_long_is_told_before_the_work():
    box()
    name = "o" * 300 + ".vtu"
    expect_error(run("flexel-voxelize", "box.stl", "--size", "5 mm", "-o", name), "flexel-voxelize", "File name too long")
    expect_only("box.stl")


def test_results_appear_together():
    """The disk has room for the summary, which is written first, not for the body."""
    box()
    write("s.json", "old")
    os.mkdir("small")
    script = "mount -t tmpfs -o size=16k none small || exit 77; $0 box.stl --size 1mm --quiet -o small/o.vtu --summary s.json"
    result = run("unshare", "-m", "bash", "-c", script, str(BIN / "flexel-voxelize"))
    if result.code in (1, 77) and "error: small" not in result.err:
        raise Skip("mounting is not permitted here")
    expect_error(result, "flexel-voxelize", "small/o.vtu", "no space")
    expect(open("s.json", encoding="ascii").read() == "old", "half of the results appeared")


if __name__ == "__main__":
    main(globals())

"""docs/reference/messages.md: each message is brought about, and its advice followed, as a user would."""

import json
import os
import re
import shutil

from harness import (PARTS, Skip, ascii_stl, binary_stl, body, box, box_triangles, expect, expect_error, expect_ok, main, need_step,
                     bracket, run, write)

HELD = 'material = "steel"\n[[fix]]\nwhere = "xmin"\n'
PUSHED = HELD + '[[load]]\nwhere = "{where}"\nforce = ["0 N", "0 N", "{force}"]\n'
ON_BOX = ("--material", "steel", "--fix", "xmin")


def part(name):
    path = PARTS / name
    if not path.exists():
        raise Skip(f"{path} is not there")
    return path


def shifted(triangles, x=0.0, y=0.0, z=0.0):
    return [[(a + x, b + y, c + z) for a, b, c in triangle] for triangle in triangles]


def says(result, *fragments):
    """The run ended well, and warned or told of this."""
    expect_ok(result)
    for fragment in fragments:
        expect(fragment in result.err, f"\"{fragment}\" is missing in: {result.err}")
    return result


def silent(result, *fragments):
    expect_ok(result)
    for fragment in fragments:
        expect(fragment not in result.err, f"\"{fragment}\" is still said: {result.err}")
    return result


def advised(text, pattern):
    """The option that a message names, as words of a command line."""
    found = re.search(pattern, text)
    expect(found, f"{pattern} is not advised in: {text}")
    return [word.strip('"') for word in re.findall(r'"[^"]*"|\S+', found.group(0))]


def voxelize(*words):
    return run("flexel-voxelize", *words, "-o", "out.vtu", "--force")


def simulate(text, *words, bars=("body.vtu",)):
    write("scene.toml", text)
    return run("flexel-simulate", "scene.toml", *bars, "-o", "out.vtu", "--force", *words)


def deform(*words):
    return run("flexel", "deform", *words, "--count", "500", "-o", "out.stl", "--force")


def lattice_volume(summary="s.json"):
    return sum(each["lattice_volume"] for each in json.load(open(summary, encoding="utf-8"))["parts"])


def test_encodings():
    text = "".join(f"v {x} {y} {z}\n" for z in (0, 10) for y in (0, 10) for x in (0, 20))
    text += "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n"
    write("wide.obj", text.encode("utf-16"))
    refused = run("flexel-voxelize", "wide.obj", "--size", "1 mm", "-o", "out.vtu")
    expect_error(refused, "flexel-voxelize", "is text in UTF-16", "iconv -f UTF-16")
    iconv = re.search(r"\((iconv [^)]*)\)", refused.err).group(1).replace("NEW", "narrow.obj")
    expect(os.system(iconv) == 0, f"the advice fails: {iconv}")
    expect_ok(voxelize("narrow.obj", "--size", "1 mm", "--summary", "s.json"))
    expect(abs(lattice_volume() - 2e-6) < 1e-12, "2 cm^3 wanted")
    write("mark.obj", "\ufeff" + text)
    expect_ok(voxelize("mark.obj", "--size", "1 mm", "--summary", "s.json"))
    expect(abs(lattice_volume() - 2e-6) < 1e-12, "a byte order mark changes the part")


def test_parts_among_each_other():
    one = box_triangles((20, 10, 10))
    write("twice.stl", ascii_stl(one, "a") + ascii_stl(one, "b"))
    expect_error(voxelize("twice.stl", "--size", "1 mm"), "flexel-voxelize", "one body twice in one place", "leave one of them out")
    write("once.stl", ascii_stl(one, "a"))
    silent(voxelize("once.stl", "--size", "1 mm"), "twice")
    shutil.copy("once.stl", "again.stl")
    expect_error(voxelize("once.stl", "again.stl", "--size", "1 mm"), "flexel-voxelize", "one body twice in one place")
    write("gap.stl", ascii_stl(one, "left") + ascii_stl(shifted(one, 20.3), "right"))
    gap = says(voxelize("gap.stl", "--size", "1 mm"), '"left" and "right" miss each other by 300 um', "[[bond]] with gap")
    assert "not joined" not in gap.err, gap.err  # a scene may have that bond already
    wide = re.search(r'gap = "([^"]*)"', gap.err).group(1)
    pull = 'material = "steel"\n[[fix]]\nwhere = "left/xmin"\n[[load]]\nwhere = "right/xmax"\nforce = ["10 N", "0 N", "0 N"]\n'
    expect_error(simulate(pull, bars=("out.vtu",)), "flexel-simulate", "right")
    expect_ok(simulate(pull + f'[[bond]]\nparts = ["left", "right"]\ngap = "{wide}"\n', bars=("out.vtu",)))
    write("lap.stl", ascii_stl(one, "left") + ascii_stl(shifted(one, 18), "right"))
    says(voxelize("lap.stl", "--size", "1 mm"), "overlap: 200 mm^3 lies in both", "cut one from the other")
    write("cut.stl", ascii_stl(box_triangles((18, 10, 10)), "left") + ascii_stl(shifted(one, 18), "right"))
    silent(voxelize("cut.stl", "--size", "1 mm"), "overlap", "miss each other")


def test_a_side_that_is_a_point():
    """A needle: nothing faces down at its tip, and "zmin" is no word that is not known."""
    around = [(0, 0, 30), (4, 0, 30), (4, 4, 30), (0, 4, 30)]
    tip, top = (2, 2, 0), [(around[0], around[1], around[2]), (around[0], around[2], around[3])]
    write("needle.stl", binary_stl([(around[(i + 1) % 4], around[i], tip) for i in range(4)] + top))
    pull = 'material = "steel"\n[[fix]]\nwhere = "zmax"\n[[load]]\nwhere = {}\nforce = ["1 N", "0 N", "0 N"]\n'
    write("side.toml", pull.format('"zmin"'))
    refused = run("flexel", "deform", "needle.stl", "--scene", "side.toml", "--size", "1 mm", "-o", "out.stl")
    expect_error(refused, "flexel", '"zmin" holds no face', "a point or an edge", "box = { min = ..., max = ... }")
    expect("did you mean" not in refused.err, refused.err)
    write("box.toml", pull.format('{ box = { min = ["0 mm", "0 mm", "-1 mm"], max = ["4 mm", "4 mm", "6 mm"] } }'))
    expect_ok(run("flexel", "deform", "needle.stl", "--scene", "box.toml", "--size", "1 mm", "-o", "out.stl"))
    write("mistyped.toml", pull.format('"needle/zmni"'))
    expect_error(run("flexel", "deform", "needle.stl", "--scene", "mistyped.toml", "--size", "1 mm", "-o", "out.stl"), "flexel",
                 'did you mean "needle/zmin"?')


def test_open_surfaces():
    cube = [triangle for triangle in box_triangles((40, 40, 40)) if any(corner[2] < 40 for corner in triangle)]
    write("topless.stl", binary_stl(cube))
    refused = voxelize("topless.stl", "--size", "4 mm")
    expect_error(refused, "flexel-voxelize", "inside cannot be told from outside: 4 open edges")
    expect_ok(voxelize("topless.stl", "--size", "4 mm", *advised(refused.err, r'--heal "wrap:[^"]*"')))
    refused = voxelize("topless.stl", "--size", "4 mm", "--heal", "wrap:0.01 mm", "--max-memory", "8GB")
    expect_error(refused, "flexel-voxelize", "is too fine: it needs", "would fit")


def test_real_parts_that_are_refused():
    refused = voxelize(part("nonmanifold_cells_symmetrical.stl"), "--count", "2000")
    expect_error(refused, "flexel-voxelize", "edges where more than two triangles meet")
    expect_ok(voxelize(part("nonmanifold_cells_symmetrical.stl"), "--count", "2000", *advised(refused.err, "--heal wrap")))
    expect_error(voxelize(part("spinal_implant.3mf")), "flexel-voxelize", "is a lattice of 11821 beams", "leave the object out of the build")
    expect_error(voxelize(part("2CylinderEngine.glb"), "--count", "3000"), "flexel-voxelize", "is larger than 22 of 67 parts", '--size "12 m"')
    need_step()
    refused = voxelize(part("as1-oc-214.stp"), "--count", "300")
    expect_error(refused, "flexel-voxelize", "is larger than 8 of 18 parts")
    expect_ok(voxelize(part("as1-oc-214.stp"), *advised(refused.err, r'--size "[^"]*"')))


def test_names_that_mean_two_things():
    group = "".join(f"v {x} {y} {z}\n" for z in (0, 10) for y in (0, 10) for x in (0, 20))
    sides = {"2": "f 1 5 7 3", "1": "f 2 4 8 6", "rest": "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4"}
    write("num.obj", group + "".join(f"g {name}\n{faces}\n" for name, faces in sides.items()))
    expect_ok(run("flexel-voxelize", "num.obj", "--size", "2.5mm", "-o", "body.vtu"))
    text = 'material = "steel"\n[[fix]]\nwhere = "{}"\n[[load]]\nwhere = "zmax"\nforce = ["0 N", "0 N", "-10 N"]\n'
    refused = simulate(text.format("num/1"))
    expect_error(refused, "flexel-simulate", 'means two things: face number 1')
    held = []
    for name in advised(refused.err, r'"num/#1"') + advised(refused.err, r'"num/=1"'):
        expect_ok(simulate(text.format(name), "--summary", "s.json"))
        held.append(json.load(open("s.json", encoding="utf-8"))["largest_displacement_at"][0])
    expect(abs(held[0] - held[1]) > 0.015, f"both hold one end: {held}")
    refused = simulate(text.format("num/"))
    expect_error(refused, "flexel-simulate", "names no face")
    expect_ok(simulate(text.format(advised(refused.err, r'"num/xmin"')[0])))


def test_scenes():
    body()
    pushed = PUSHED.format(where="xmax", force="-10 N")
    expect_error(simulate(pushed + "time = [\"0 s\", \"1 s\"]\nfactor = [0, nan]\n[run]\ntime = \"1 us\"\n"), "flexel-simulate", '"factor" holds nan')
    expect_ok(simulate(pushed + "time = [\"0 s\", \"1 s\"]\nfactor = [0, 1]\n[run]\ntime = \"1 us\"\n"))
    expect_error(simulate(PUSHED.format(where="xmax", force="-1e155 N")), "flexel-simulate", "is too large")
    expect_ok(simulate(pushed))
    refused = simulate(pushed + "time = [\"0 s\", \"1 s\"]\nfactor = [0, 0]\n")
    expect_error(refused, "flexel-simulate", "equilibrium has no time", "leave them out")
    expect_error(simulate(PUSHED.format(where="xmin", force="-10 N")), "flexel-simulate", "does nothing")
    gum = "[materials.gum]\nyoung = \"1 MPa\"\npoisson = 0.4\ndensity = \"1000 kg/m3\"\n"
    says(simulate(pushed + gum), "[materials.gum] is used by no part")
    silent(simulate(pushed.replace('"steel"', '"gum"').replace("-10 N", "-0.01 N") + gum), "is used by no part")
    expect_error(simulate(pushed + gum + gum.replace("gum", "Gum")), "flexel-simulate", "are one name", "rename one")
    expect_ok(simulate(pushed.replace('"steel"', '"Gum2"').replace("-10 N", "-0.01 N") + gum.replace("gum", "gum2")))
    huge = simulate(PUSHED.format(where="xmax", force="-1 GN"))
    expect_error(huge, "flexel-simulate", "times its size", "check the unit of the part", code=3)
    silent(simulate(PUSHED.format(where="xmax", force="-1 GN") + "[run]\nload_steps = 10\n"), "error: the load")


def test_loads_that_do_not_do_what_they_seem_to():
    body()
    slides = 'material = "steel"\n[[fix]]\nwhere = "zmin"\n[[fix]]\nwhere = "zmax"\naxes = "z"\n[[load]]\nwhere = "zmax"\nforce = ["10 N", "0 N", "-10 N"]\n'
    says(simulate(slides), 'of load "zmax" goes straight into a support')
    silent(simulate(slides.replace("-10 N", "0 N")), "straight into a support")
    roll = HELD + '[[load]]\nwhere = "xmax"\ntorque = ["0 N m", "3000 N m", "0 N m"]\n'
    turned = says(simulate(roll.replace('"steel"', '"PLA"').replace("3000", "55"), "--no-estimate"), "its forces keep the direction", "follower = true")
    expect("of its torque is left" in turned.err, turned.err)
    silent(simulate(roll.replace('"steel"', '"PLA"').replace("3000", "55") + "follower = true\n", "--no-estimate"), "of its torque is left")
    write("bar.stl", binary_stl(box_triangles((80, 10, 6))))
    expect_error(run("flexel", "deform", "bar.stl", "--material", "rubber", "--fix", "xmin", "--torque", "xmax: 0 0.05 0 N m", "--size", "2 mm",
                     "-o", "out.stl"), "flexel", "no equilibrium", 'the forces of load "xmax" keep the direction', "follower = true", code=3)


def test_results_do_not_go_to_one_name():
    body()
    text = PUSHED.format(where="xmax", force="-10 N")
    write("scene.toml", text)
    expect_error(run("flexel-simulate", "scene.toml", "body.vtu", "-o", "x", "--summary", "x"), "flexel-simulate", "two results would go to")
    expect_error(run("flexel-simulate", "scene.toml", "body.vtu", "-o", "-", "--summary", "-"), "flexel-simulate", "two results would go to stdout")
    expect_ok(run("flexel-simulate", "scene.toml", "body.vtu", "-o", "x", "--summary", "y"))
    box("own.stl")
    refused = run("flexel-voxelize", "own.stl", "--size", "5 mm", "-o", "own.stl")
    expect_error(refused, "flexel-voxelize", "is an input of this command")
    expect_ok(run("flexel-voxelize", "own.stl", "--size", "5 mm", "-o", "own.stl", *advised(refused.err, "--force")))


def test_units():
    write("car.stl", binary_stl(box_triangles((4.6, 1.8, 1.4))))
    told = says(run("flexel", "info", "car.stl"), "is 4.6 mm long in mm")
    silent(run("flexel", "info", "car.stl", *advised(told.err, "--unit m")), "if the file is in metres")


def test_coarse_triangles():
    write("bar.stl", binary_stl(box_triangles((80, 10, 10))))
    words = ("bar.stl", "--material", "PLA", "--fix", "xmin", "--push", "xmax: 0 0 -60 N")
    told = says(deform(*words, "--keep-vertices"), "cannot be used as it is", "stay flat where the part bends")
    silent(deform(*words, *advised(told.err, r"--refine \S+mm"), "--strict"), "cannot be used")
    silent(deform(*words, "--strict"), "cannot be used")


def test_the_command_line():
    box()
    expect_error(deform("box.stl", *ON_BOX), "flexel", "nothing acts on the part", '--gravity')
    expect_ok(deform("box.stl", *ON_BOX, "--gravity", "1 g"))
    expect_error(deform("box.stl", *ON_BOX, "--push", "xmin: 10 N"), "flexel", "does nothing")
    expect_ok(deform("box.stl", *ON_BOX, "--push", "zmax: 10 N"))
    write("knob.stl", binary_stl(shifted(box_triangles((10, 10, 10)), 40)))
    two = ("box.stl", "knob.stl", "--material", "knob=PLA", "--fix", "box/xmin", "--gravity", "1 g")
    expect_error(deform(*two), "flexel", 'part "box" has no material', '--material "box=NAME"')
    expect_ok(deform(*two, "--material", "box=steel"))
    expect_error(deform("box.stl", *ON_BOX, "--bearing", "xmax: 50 N"), "flexel", "give three components")
    expect_ok(deform("box.stl", *ON_BOX, "--bearing", "zmax: 0 0 -50 N"))
    plastic = ("box.stl", "--material", "PLA", "--fix", "xmin", "--gravity", "1 g", "--infill")
    refused = deform(*plastic, "2%")
    expect_error(refused, "flexel", "needs to lie between 5 % and 100 %")
    expect_ok(deform(*plastic, *advised(refused.err, r'"20 %"')))
    same = expect_ok(run("flexel", "compare", "box.stl", "box.stl", *ON_BOX, "--push", "xmax: 0 0 -100 N", "--count", "1000"))
    expect(b"not sure which" in same.out, same)


def test_files_that_reach_outside():
    os.mkdir("in")
    write("in/a.gltf", json.dumps({"asset": {"version": "2.0"}, "buffers": [{"uri": "../out.bin", "byteLength": 4}],
                                   "bufferViews": [{"buffer": 0, "byteLength": 4}], "accessors": [], "meshes": [], "nodes": [], "scenes": []}))
    write("out.bin", b"1234")
    expect_error(run("flexel", "info", "in/a.gltf"), "flexel", "outside of its folder, from where nothing is read")


def test_damaged_step():
    name = bracket()
    text = open(name, encoding="latin-1").read()
    number = re.search(r"PLANE\('[^']*'", text).group(0)
    write("bad.step", text.replace(number, "PLANE(1.5", 1).encode("latin-1"))
    told = says(run("flexel", "info", "bad.step"), "is damaged: OpenCASCADE says", "its solids are closed and valid all the same")
    expect("compare their volume" in told.err, told.err)


def test_a_crumb_that_hangs_on_nothing():
    """It bears nothing; a face of it is refused, and what the messages say of it helps."""
    def part_with(x, y, z):
        return write("part.stl", binary_stl(box_triangles((80, 20, 10)) + shifted(box_triangles((1.5, 1.5, 1.5)), x, y, z)))
    pushed = ("part.stl", *ON_BOX, "--push")
    part_with(40, 10, 14)
    told = says(deform(*pushed, "xmax: 0 0 -50 N"), "loose crumb(s)", "mm, ", "let them overlap with it in its file, else take them out")
    expect("the largest near (4" in told.err, told.err)  # mm
    expect_error(deform(*pushed, "zmax: 0 0 -50 N"), "flexel", "no matter lies under", "another face")
    part_with(40, 10, 9.5)
    silent(deform(*pushed, "zmax: 0 0 -50 N"), "crumb")
    write("part.stl", binary_stl(box_triangles((80, 20, 10))))
    silent(deform(*pushed, "zmax: 0 0 -50 N"), "crumb")


if __name__ == "__main__":
    main(globals())

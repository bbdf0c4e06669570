"""What a designer types: loads and materials on the command line, infill, pictures, and which of two parts is stiffer."""

import json
import math
import os

from harness import bracket, box, expect, expect_error, expect_ok, main, run, scene, write
from picture_test import colours, read_png
from shapes import binary_stl, box_triangles

QUICK = ["--count", "500", "--no-estimate", "--quiet"]


def summary_of(*options):
    expect_ok(run("flexel", "deform", "box.stl", *QUICK, *options, "--summary", "s.json", "-o", "out.stl"))
    return json.load(open("s.json"))["simulate"]


def same_as_scene(text, *options):
    """The options give the same part, bit for bit, as the scene."""
    box()
    expect_ok(run("flexel", "deform", "box.stl", *QUICK, "--material", "steel", "--fix", "xmin", *options, "-o", "options.stl"))
    scene("scene.toml", 'material = "steel"\n[[fix]]\nwhere = "xmin"\n' + text)
    expect_ok(run("flexel", "deform", "box.stl", *QUICK, "--scene", "scene.toml", "-o", "scene.stl"))
    expect(open("options.stl", "rb").read() == open("scene.stl", "rb").read(), f"{options} is not {text}")


def test_torque_is_a_scenes():
    same_as_scene('[[load]]\nwhere = "xmax"\ntorque = ["5 N m", "0 N m", "0 N m"]\n', "--torque", "xmax: 5 N m")
    same_as_scene('[[load]]\nwhere = "xmax"\ntorque = ["0 N m", "0 N m", "5 N m"]\n', "--torque", "xmax: 0 0 5 N m")


def test_twist_is_a_scenes():
    turn = '[[move]]\nwhere = "xmax"\nrotation = { axis = [1, 0, 0], through = ["40 mm", "5 mm", "5 mm"], angle = "10 deg" }\n'
    box()
    expect_ok(run("flexel", "deform", "box.stl", *QUICK, "--material", "steel", "--fix", "xmin", "--twist", "xmax: 10 deg", "--summary",
                  "a.json", "-o", "a.stl"))
    scene("scene.toml", 'material = "steel"\n[[fix]]\nwhere = "xmin"\n' + turn)
    expect_ok(run("flexel", "deform", "box.stl", *QUICK, "--scene", "scene.toml", "--summary", "b.json", "-o", "b.stl"))
    one, two = (json.load(open(name))["simulate"]["largest_displacement"] for name in ("a.json", "b.json"))
    # a corner, 7.07 mm from the axis: 2 * 7.07 mm * sin(5 deg) = 1.2325 mm
    expect(abs(one / two - 1) < 1e-9 and abs(one / 1.2325e-3 - 1) < 0.02, f"{one} {two}")


def test_gravity_bearing_and_probe_are_a_scenes():
    same_as_scene('[gravity]\nacceleration = ["0 m/s2", "0 m/s2", "-9.80665 m/s2"]\n', "--gravity", "1 g")
    same_as_scene('[[load]]\nwhere = "zmax"\nbearing = ["0 N", "0 N", "-50 N"]\n', "--bearing", "zmax: 0 0 -50 N")
    found = summary_of("--material", "steel", "--fix", "xmin", "--push", "xmax: 0 0 -100 N", "--probe", "tip: 40 5 5 mm", "--probe",
                       "end: xmax")
    expect([p["name"] for p in found["probes"]] == ["tip", "end"], found["probes"])
    expect(all(p["displacement"][2] < -10e-6 for p in found["probes"]), found["probes"])


def test_an_action_that_cannot_be_placed_is_refused_whatever_chooses_the_size():
    box()
    for choice in (["--accuracy", "50%"], ["--within", "5s"], ["--count", "500"], []):
        done = run("flexel", "deform", "box.stl", *choice, "--material", "steel", "--fix", "xmin", "--push", "xmax: 0 0 -50 N", "--push",
                   "nosuch/99: 50 N", "-o", "out.stl")
        expect_error(done, "flexel", "nosuch/99")


def test_the_axis_of_a_side_is_its_own():
    """A rounded end: however fine its facets are, a torque on the side turns about the side's axis."""
    for facets in (15, 45, 90):
        arc = [(40 + 5 * math.sin(math.pi * k / facets), 5 - 5 * math.cos(math.pi * k / facets)) for k in range(facets + 1)]
        outline = [(0, 0), *arc, (0, 10)]
        count = len(outline)
        lines = [f"v {x} {y} {z}" for z in (0, 10) for x, y in outline]
        lines += ["f " + " ".join(str(k + 1) for k in reversed(range(count))), "f " + " ".join(str(count + k + 1) for k in range(count))]
        for k in range(count):
            j = (k + 1) % count
            lines.append(f"f {k + 1} {j + 1} {count + j + 1} {count + k + 1}")
        write("lever.obj", ("\n".join(lines) + "\n").encode())
        expect_ok(run("flexel", "deform", "lever.obj", *QUICK, "--material", "steel", "--fix", "xmin", "--torque", "xmax: 1 N m",
                      "--summary", "s.json", "-o", "out.obj"))
        moment = json.load(open("s.json"))["simulate"]["loads"][0]["moment"]
        expect(abs(moment[0] - 1) < 1e-3 and abs(moment[2]) < 1e-2, f"{facets} facets: {moment}")


def test_infill_is_told_as_an_estimate():
    box()
    for choice in (["--accuracy", "50%"], ["--count", "500"]):
        done = expect_ok(run("flexel", "deform", "box.stl", *choice, "--material", "PLA", "--infill", "20%", "--fix", "xmin", "--push",
                             "xmax: 0 0 -1 N", "-o", "out.stl"))
        expect("estimate" in done.err, done.err)


def test_material_and_infill_by_part():
    write("knob.stl", binary_stl([[(x + 50, y, z) for x, y, z in t] for t in box_triangles()]))
    box()
    hold = ["--fix", "xmin", "--fix", "knob/xmin", "--push", "box/xmax: 0 0 -100 N", "--push", "knob/xmax: 0 0 -1 N", "--probe",
            "box: box/xmax", "--probe", "knob: knob/xmax"]

    def probes(*options):
        expect_ok(run("flexel", "deform", "box.stl", "knob.stl", *QUICK, *hold, *options, "--summary", "s.json", "-o", "out.stl"))
        return [p["displacement"][2] for p in json.load(open("s.json"))["simulate"]["probes"]]

    steel, knob = probes("--material", "steel", "--material", "knob=PLA")
    expect(abs(knob / steel / (210 / 3.25 / 100) - 1) < 0.03, f"{steel} {knob}: PLA is 64.6 times as soft, its load a hundredth")
    same, sparse = probes("--material", "steel", "--material", "knob=PLA", "--infill", "knob=50%")
    expect(abs(same / steel - 1) < 1e-6 and abs(sparse / knob / 4 - 1) < 0.01, f"0.5^2 of the modulus: {same} {sparse}")
    run_ = ("flexel", "deform", "box.stl", "knob.stl", *QUICK, *hold, "-o", "out.stl")
    expect_error(run(*run_, "--material", "steel", "--material", "knbo=PLA"), "flexel", "--material", "did you mean \"knob\"")
    expect_error(run(*run_, "--material", "knob=PLA"), "flexel", "part \"box\" has no material", "--material")
    expect_error(run(*run_, "--material", "knob=PLLA"), "flexel", "did you mean \"PLA\"")
    expect_error(run(*run_, "--material", "box=steel", "--material", "knob=PLA", "--infill", "20%"), "flexel", "no part takes")


def test_infill_in_every_model():
    box()
    expect_ok(run("flexel-voxelize", "box.stl", "--size", "2.5 mm", "-o", "corner.vtu"))
    expect_ok(run("flexel-voxelize", "box.stl", "--size", "2.5 mm", "--placement", "centre", "-o", "centre.vtu"))
    for model, body in (("cells", "corner.vtu"), ("springs", "corner.vtu"), ("paper", "centre.vtu")):
        moved = []
        for infill in ("", 'infill = "20 %"\n'):
            scene("scene.toml", 'material = "PLA"\n' + infill + f'[parts.box]\nmodel = "{model}"\n[[fix]]\nwhere = "xmin"\n'
                  '[[load]]\nwhere = "xmax"\nforce = ["0 N", "0 N", "-0.01 N"]\n')
            result = expect_ok(run("flexel-simulate", "scene.toml", body, "--summary", "s.json", "--no-estimate", "-o", "bent.vtu"))
            found = json.load(open("s.json"))
            moved.append(found["largest_displacement"])
        expect(abs(moved[1] / moved[0] / 25 - 1) < 1e-3, f"{model}: 0.2^2 of the modulus, {moved}")
        expect("20 % infill" in result.err and "an estimate" in result.err, result.err)


def test_infill_in_time():
    box()
    expect_ok(run("flexel-voxelize", "box.stl", "--size", "5 mm", "-o", "body.vtu"))
    scene("scene.toml", 'material = "PLA"\ninfill = 0.2\nshell = "1 mm"\n[run]\ntime = "0.1 ms"\n[gravity]\n'
          'acceleration = ["0 m/s2", "0 m/s2", "-10 m/s2"]\n')
    result = expect_ok(run("flexel-simulate", "scene.toml", "body.vtu", "--summary", "s.json", "-o", "out.vtu"))
    # 4 cm3, 18 cm2: x = 1 mm * 18 cm2 / 4 cm3 = 0.45, walls 0.45 - 0.45^2 / 4 = 0.399; density 0.399 + 0.601 * 0.2 = 0.519
    expect(abs(json.load(open("s.json"))["mass"] / (4e-6 * 1240 * 0.5195) - 1) < 1e-3, json.load(open("s.json"))["mass"])
    expect("40 % of it solid walls" in result.err, result.err)
    for text, words in (("infill = 2\n", "between 5 %"), ('shell = "1 mm"\n', "goes with an infill")):
        scene("bad.toml", 'material = "PLA"\n' + text)
        expect_error(run("flexel-simulate", "bad.toml", "body.vtu", "-o", "out.vtu"), "flexel-simulate", "bad.toml:2", words)


def test_refusals_show_what_to_write():
    box()
    hold = ("flexel", "deform", "box.stl", *QUICK, "--material", "steel", "--fix", "xmin", "-o", "out.stl")
    expect_error(run(*hold), "flexel", "nothing acts", "--torque")
    expect_error(run(*hold, "--torque", "xmax: 5 N"), "flexel", "--torque", "torque")
    expect_error(run(*hold, "--torque", "xmxa: 5 N m"), "flexel", "did you mean \"xmax\"")
    expect_error(run(*hold, "--twist", "xmax: 5 mm"), "flexel", "--twist", "angle")
    expect_error(run(*hold, "--bearing", "xmax: 50 N"), "flexel", "three components", "0 0 -200 N")
    expect_error(run(*hold, "--gravity", "9.81"), "flexel", "--gravity", "unit")
    expect_error(run(*hold, "--gravity", "1 g", "--probe", "tip: 1 2 mm"), "flexel", "three coordinates")
    expect_error(run(*hold, "--gravity", "1 g", "--infill", "300%"), "flexel", "--infill", "5 %")
    expect_error(run(*hold, "--gravity", "1 g", "--shell", "1 mm"), "flexel", "infill")


def test_a_picture_of_the_bent_part():
    box()
    expect_ok(run("flexel", "deform", "box.stl", *QUICK, "--material", "steel", "--fix", "xmin", "--push", "xmax: 0 0 -100 N", "-o",
                  "bent.png", "-o", "bent.stl"))
    width, height, rows = read_png(open("bent.png", "rb").read())
    bright = [c for c in colours(rows) if max(c) - min(c) > 120]
    expect((width, height) == (1600, 1200) and len(bright) > 50, f"{width} x {height}, {len(bright)} bright colours")


def test_numbers_on_faces():
    result = expect_ok(run("flexel", "picture", box(), "--faces", "-o", "faces.png"))
    expect("too small" not in result.err, f"all six faces of a box have room: {result.err}")
    plain = expect_ok(run("flexel", "picture", "box.stl", "-o", "plain.png", "--view", "iso"))
    one = expect_ok(run("flexel", "picture", "box.stl", "--faces", "--view", "iso", "-o", "one.png"))
    expect("3 of 6 faces" in one.err, one.err)
    expect(open("plain.png", "rb").read() != open("one.png", "rb").read(), plain.err)


def test_which_is_stiffer():
    write("a.stl", binary_stl(box_triangles((40, 10, 10))))
    write("b.stl", binary_stl(box_triangles((40, 10, 12))))
    case = ["--material", "steel", "--fix", "xmin", "--push", "xmax: 0 0 -100 N", "--size", "1.25 mm"]
    found = json.loads(expect_ok(run("flexel", "compare", "a.stl", "b.stl", *case, "--json")).out)
    a, b = found["parts"]
    expect(found["stiffest_first"] == ["b.stl", "a.stl"] and found["sure"], found)
    # 1.2^3 of bending, less for shear
    expect(1.6 < b["stiffness"] / a["stiffness"] < 1.728, found)
    expect(abs(a["stiffness"] - 100 / a["largest_displacement"]) < 1 and abs(b["mass"] / a["mass"] - 1.2) < 1e-6, found)
    expect(abs(a["limit"] / 235e6 - 1) < 1e-9 and a["stiffness_bar"][0] < a["stiffness"] < a["stiffness_bar"][1], found)
    text = expect_ok(run("flexel", "compare", "a.stl", "b.stl", *case)).out.decode()
    expect("b.stl is" in text and "times as stiff as a.stl" in text and "safety factor" in text, text)


def test_overlapping_bars_are_not_sure():
    write("a.stl", binary_stl(box_triangles((40, 10, 10))))
    write("b.stl", binary_stl(box_triangles((40, 10, 10.01))))
    case = ["--material", "steel", "--fix", "a/1", "--push", "xmax: 0 0 -100 N", "--size", "2.5 mm"]
    result = expect_ok(run("flexel", "compare", "a.stl", "b.stl", *case))  # a/1: the part of b.stl goes by the name a
    expect("not sure which" in result.out.decode() and "overlap" in result.out.decode(), result.out.decode())
    expect_error(run("flexel", "compare", "a.stl", *case), "flexel", "two parts")
    expect_error(run("flexel", "compare", "a.stl", "absent.stl", *case), "flexel", "absent.stl")


def test_a_couple_gives_no_stiffness():
    write("a.stl", binary_stl(box_triangles((40, 10, 10))))
    write("b.stl", binary_stl(box_triangles((40, 10, 12))))
    text = expect_ok(run("flexel", "compare", "a.stl", "b.stl", "--material", "steel", "--fix", "xmin", "--torque", "xmax: 5 N m", "--count",
                         "500")).out.decode()
    expect("no stiffness to compare" in text and "times as stiff" not in text, text)


def test_study_takes_options():
    """And prints its study.json with --json."""
    box()
    printed = json.loads(expect_ok(run("flexel", "study", "box.stl", "--material", "steel", "--fix", "xmin", "--torque", "xmax: 5 N m", "--probe",
                                       "tip: 40 10 10 mm", "--budget", "8 s", "-o", "study", "--json", timeout=110)).out)
    with open("study/study.json", encoding="utf-8") as file:
        expect(printed == json.load(file) and printed["program"] == "flexel study", "another study.json")
    text = open("study/study-scene.toml").read()
    expect("torque" in text and "tip" in text and 'material = "steel"' in text.replace("'", '"'), text)
    scene("scene.toml")
    expect_error(run("flexel", "study", "box.stl", "--scene", "scene.toml", "--material", "PLA", "-o", "s2"), "flexel", "scene.toml",
                 "leave --material out")
    expect_error(run("flexel", "study", "box.stl", "--fix", "xmin", "--gravity", "1 g", "-o", "s3"), "flexel", "--material")


def test_fillets_are_no_holes():
    found = json.loads(expect_ok(run("flexel", "info", bracket(), "--json")).out)
    for face in found["files"][0]["parts"][0]["faces"]:
        if face["kind"] == "round":
            expect(face["hole"] is False or face["angle"] > 3, face)


def compared(*words):
    result = expect_ok(run("flexel", "compare", "a.stl", "b.stl", "--material", "steel", "--size", "2.5 mm", "--json", *words))
    return json.loads(result.out), result.err


def test_forces_against_each_other_give_no_stiffness():
    """What rounding leaves of two moves that press a part from both ends, or of loads, is no force; nor is heat's displacement one."""
    write("a.stl", binary_stl(box_triangles((40, 10, 10))))
    write("b.stl", binary_stl(box_triangles((40, 10, 12))))
    middle = '{ box = { min = ["15 mm", "2 mm", "2 mm"], max = ["25 mm", "8 mm", "8 mm"] } }'
    for name, text in (("heat", '[thermal]\nchange = "50 K"\n'), ("shrinkage", '[shrinkage]\nlayer = "0.2 mm"\nalong = "-0.3 %"\nacross = "-0.2 %"\n')):
        write(f"{name}.toml", '[[fix]]\nwhere = "xmin"\n[[load]]\nwhere = "xmax"\nforce = ["0 N", "0 N", "-100 N"]\n' + text)
    for words in (["--fix", middle, "--move", "xmin: 0.01 0 0 mm", "--move", "xmax: -0.01 0 0 mm"],
                  ["--fix", middle, "--push", "xmin: 100 N", "--push", "xmax: 101 N"], ["--scene", "heat.toml"], ["--scene", "shrinkage.toml"]):
        found, _ = compared(*words)
        expect(all(each["stiffness"] is None and each["largest_displacement"] > 0 for each in found["parts"]) and not found["sure"], found)
    # what is moved by nothing is held: the load is what acts
    found, _ = compared("--fix", "xmin", "--move", "xmax: 0 0 0 mm", "--push", "zmax: 0 0 -100 N")
    for each in found["parts"]:
        expect(abs(each["force"] - 100) < 1e-6 and abs(each["stiffness"] * each["largest_displacement"] / 100 - 1) < 1e-9, found)


def test_compare_says_of_which_file_it_speaks():
    """Warnings of a part are told, as flexel deform tells them; files of one name keep their folders."""
    write("a.stl", binary_stl(box_triangles((40, 10, 10))))
    write("b.stl", binary_stl([triangle[::-1] for triangle in box_triangles((40, 10, 10))]))
    case = ["--fix", "xmin", "--push", "xmax: 0 0 -100 N"]
    found, err = compared(*case)
    expect(found["parts"][0]["warnings"] == [] and any("inside out" in line for line in found["parts"][1]["warnings"]), found)
    expect("warning: b.stl: " in err and "warning: a.stl: " not in err, err)
    os.mkdir("new")
    write("new/a.stl", binary_stl(box_triangles((40, 10, 12))))
    both = expect_ok(run("flexel", "compare", "a.stl", "new/a.stl", "--material", "steel", "--size", "1.25 mm", *case)).out.decode()
    expect("new/a.stl is" in both and "times as stiff as a.stl" in both, both)


def test_compare_tells_what_layers_bear():
    """As flexel deform does. A couple out of all proportion is refused as what it is, not by what rounding leaves of its forces."""
    write("a.stl", binary_stl(box_triangles((40, 10, 10))))
    case = ["--material", "PLA", "--size", "2.5 mm", "--fix", "xmin"]
    text = expect_ok(run("flexel", "compare", "a.stl", "a.stl", *case, "--push", "xmax: 0 0 -100 N")).out.decode()
    told = expect_ok(run("flexel", "deform", "a.stl", *case, "--push", "xmax: 0 0 -100 N", "-o", "o.stl")).err
    factors = told.split("safety factor ")[1].split(" across printed layers")[0].split(" (")
    expect(f"{factors[0]} against yield, {factors[1]} across layers" in text, text + told)
    expect_error(run("flexel", "deform", "a.stl", *case, "--torque", "xmax: 0 50 0 kN m", "-o", "o.stl", "--force"), "flexel", "the load (50,000 N m in all)", code=3)


if __name__ == "__main__":
    main(globals())

"""The front door: flexel deform, flexel info, and the stage programs through it."""

import json
import os
import re
import struct

from harness import binary_stl, bracket, box, box_triangles, expect, expect_error, expect_ok, expect_only, main, run, scene, write
from shapes import obj_bar

CASE = ["--material", "steel", "--fix", "xmin", "--push", "xmax: 0 0 -100 N", "--count", "4000"]


def vertices_of(stl):
    data = open(stl, "rb").read()
    (count,) = struct.unpack_from("<I", data, 80)
    return [struct.unpack_from("<9f", data, 84 + 50 * t + 12) for t in range(count)]


def test_deform_writes_every_output():
    result = expect_ok(run("flexel", "deform", box(), *CASE, "--keep-vertices", "-o", "bent.stl", "-o", "bent.obj", "-o", "bent.vtu",
                           "--report", "report.json", "--summary", "summary.json"))
    expect_only("box.stl", "bent.stl", "bent.obj", "bent.vtu", "report.json", "summary.json")
    expect(result.out == b"", "everything that is said goes to stderr")
    before, after = vertices_of("box.stl"), vertices_of("bent.stl")
    expect(len(before) == len(after) == 12, "the same triangles")
    lowest = min(triangle[2::3] for triangle in after)
    drop = max(b - a for t, s in zip(before, after) for b, a in zip(t[2::3], s[2::3]))
    # Euler and Bernoulli: F L^3 / (3 E I) = 100 * 0.04^3 / (3 * 210e9 * 0.01^4 / 12) = 12.2 um; shear adds some percent.
    expect(11.5e-3 < drop < 14.5e-3, f"the tip sinks by 12 to 14 um: {drop} mm, {lowest}")
    summary = json.load(open("summary.json"))
    expect(set(summary) == {"voxelize", "simulate", "map", "warnings"}, f"{summary.keys()}")
    expect(summary["map"] == json.load(open("report.json")), "one mapping, one report")


def test_large_flat_triangles_are_told_and_the_advice_mends_them():
    """Twelve triangles around a box that bends: nothing between its ends shows it."""
    box()
    bend = ["--material", "PLA", "--fix", "xmin", "--push", "zmax: 0 0 -20 N", "--count", "4000"]
    kept = [*bend, "--keep-vertices"]
    coarse = expect_ok(run("flexel", "deform", "box.stl", *kept, "-o", "bent.stl", "--report", "report.json"))
    found = json.load(open("report.json"))
    expect(not found["valid"] and found["failures"]["coarse_triangles"] > 3, f"{found}")
    # Under an even load w the middle of a cantilever moves by 17/48 of its end, and the chord is at a half.
    expect(0.10 < found["chord_error"]["share"] < 0.2, f"{found['chord_error']}")
    advice = re.search(r"warning: the mapped surface cannot be used as it is: its triangles, up to 41.2 mm long, .* (--refine) (\S+) splits them",
                       coarse.err)
    expect(advice, coarse.err)
    expect_error(run("flexel", "deform", "box.stl", *kept, "-o", "strict.stl", "--strict"), "flexel", "--refine", code=4)
    expect(not os.path.exists("strict.stl"), "nothing is written")
    for split in (advice.groups(), ("--edge", advice[2])):
        fine = expect_ok(run("flexel", "deform", "box.stl", *bend, *split, "-o", "fine.stl", "--strict", "--report", "report.json"))
        found = json.load(open("report.json"))
        expect(found["valid"] and found["chord_error"]["share"] < 0.02 and "cannot be used" not in fine.err, f"{found} {fine.err}")


def test_edge_splits_meshes_of_every_format():
    box()
    expect_ok(run("flexel-voxelize", "box.stl", "--size", "5 mm", "-o", "rest.vtu", "--quiet"))
    for ending in ("obj", "ply", "off", "glb", "3mf"):
        expect_ok(run("flexel-map", "rest.vtu", "--quiet", "-o", f"box.{ending}"))
    for ending in ("stl", "obj", "ply", "off", "glb", "3mf"):
        read = expect_ok(run("flexel-voxelize", f"box.{ending}", "--edge", "6 mm", "--size", "5 mm", "-o", "split.vtu"))
        expect(("its triangles were split" in read.err) == (ending != "stl"), read.err)
        expect_ok(run("flexel-map", "split.vtu", "--quiet", "-o", f"split.{ending}"))
        found = json.loads(expect_ok(run("flexel", "info", f"split.{ending}", "--json")).out)["files"][0]["parts"][0]
        expect(found["closed"] and abs(found["volume"] / 4e-6 - 1) < 1e-6 and found["triangles"] > 100, f"{ending}: {found}")
        whole = expect_ok(run("flexel-voxelize", f"box.{ending}", "--edge", "60 mm", "--size", "5 mm", "-o", "whole.vtu"))
        expect("were split" not in whole.err, "short enough already")
    expect_error(run("flexel-voxelize", "box.obj", "--edge", "1 um", "-o", "x.vtu"), "flexel-voxelize", "box.obj", "larger --edge")
    expect_error(run("flexel", "deform", "box.obj", *CASE, "--edge", "0 mm", "-o", "x.stl"), "flexel", "--edge")
    below = run("flexel", "deform", "box.obj", "--material", "steel", "--fix", "xmin", "--gravity", "1 g", "--count", "-5", "-o", "x.stl")
    expect_error(below, "flexel", "--count: must be above zero")


def test_deform_equals_the_pipe():
    box()
    expect_ok(run("flexel", "deform", "box.stl", "--scene", scene(), "--count", "2000", "-o", "one.stl"))
    expect_ok(run("flexel", "voxelize", "box.stl", "--count", "2000", "-o", "rest.vtu"))
    expect_ok(run("flexel", "simulate", "scene.toml", "rest.vtu", "-o", "bent.vtu"))
    expect_ok(run("flexel", "map", "bent.vtu", "-o", "two.stl"))
    expect(open("one.stl", "rb").read() == open("two.stl", "rb").read(), "one process or three, the same bits")


def test_deform_to_stdout_and_threads():
    box()
    one = expect_ok(run("flexel", "deform", "box.stl", *CASE, "--threads", "1", "--quiet", "--format", "obj", "-o", "-"))
    two = expect_ok(run("flexel", "deform", "-", *CASE, "--threads", "2", "--quiet", "--format", "obj", "-o", "-",
                        stdin=open("box.stl", "rb")))
    expect([line for line in one.out.splitlines() if line.startswith(b"v ")] ==
           [line for line in two.out.splitlines() if line.startswith(b"v ")], "any number of threads gives the same bits")


def test_push_inwards_is_a_push_down():
    box()
    expect_ok(run("flexel", "deform", "box.stl", *CASE[:4], "--push", "zmax: 100 N", "--count", "2000", "-o", "in.stl"))
    expect_ok(run("flexel", "deform", "box.stl", *CASE[:4], "--push", "zmax: 0 0 -100 N", "--count", "2000", "-o", "down.stl"))
    for a, b in zip(vertices_of("in.stl"), vertices_of("down.stl")):
        expect(all(abs(x - y) < 1e-6 for x, y in zip(a, b)), f"{a} {b}")


def test_move_is_followed():
    box()
    expect_ok(run("flexel", "deform", "box.stl", "--material", "PLA", "--fix", "xmin", "--move", "xmax: 0.5 0 0 mm", "--count",
                  "2000", "-o", "out.stl"))
    longest = max(x for t in vertices_of("out.stl") for x in t[0::3])
    expect(abs(longest - 40.5) < 5e-3, f"the end is at 40.5 mm: {longest}")


def test_deform_refuses_at_once_and_writes_nothing():
    box()
    fix = ["--fix", "xmin"]
    for arguments, words in (
            ([*fix, "--push", "xmax: 0 0 -1 N", "-o", "out.stl"], ["no material", "steel"]),
            (["--material", "stel", *fix, "--push", "xmax: 0 0 -1 N", "-o", "out.stl"], ["stel", "did you mean \"steel\""]),
            (["--material", "steel", *fix, "-o", "out.stl"], ["nothing acts", "--push"]),
            (["--material", "steel", *fix, "--push", "xmax 0 0 -1 N", "-o", "out.stl"], ["--push", "colon"]),
            (["--material", "steel", *fix, "--push", "xmax: 0 0 -1", "-o", "out.stl"], ["--push", "unit"]),
            (["--material", "steel", *fix, "--push", "xmax: 0 0 -1 mm", "-o", "out.stl"], ["--push", "mm"]),
            (["--material", "steel", *fix, "--push", "xmas: 0 0 -1 N", "-o", "out.stl"], ["xmas", "xmax"]),
            (["--material", "steel", *fix, "--push", "xmax: 0 0 -1 N", "-o", "out.step"], ["step"]),
            (["--material", "steel", *fix, "--push", "xmax: 0 0 -1 N", "-o", "-"], ["--format"]),
            (["--material", "steel", *fix, "--push", "xmax: 0 0 -1 N", "-o", "a.stl", "-o", "a.stl"], ["a.stl"]),
            (["--material", "steel", *fix, "--push", "xmax: 0 0 -1 N", "--size", "2", "-o", "out.stl"], ["unit"]),
            (["--material", "steel", "--push", "xmax: 0 0 -1 N", "-o", "out.stl"], ["box"])):
        expect_error(run("flexel", "deform", "box.stl", *arguments), "flexel", *words)
        expect_only("box.stl")


def test_info_says_what_a_scene_can_name():
    result = expect_ok(run("flexel", "info", box()))
    text = result.out.decode()
    for words in ("40 x 10 x 10 mm", "box/6", "flat, normal +x", "closed", "4000 mm^3", "assumed"):
        expect(words in text, f"\"{words}\" is missing in {text}")
    data = json.loads(expect_ok(run("flexel", "info", "box.stl", "--unit", "m", "--json")).out)
    part = data["files"][0]["parts"][0]
    expect(part["volume"] == 4000 and part["closed"] and len(part["faces"]) == 6, f"{part}")
    expect(abs(part["thinnest_wall"]["thickness"] - 10) < 1e-6, f"{part['thinnest_wall']}")


def test_info_of_a_bracket():
    data = json.loads(expect_ok(run("flexel", "info", bracket(), "--json")).out)
    part = data["files"][0]["parts"][0]
    expect(data["files"][0]["unit_given"] and part["closed"], f"{part}")
    holes = [face for face in part["faces"] if face["kind"] == "round" and face["hole"]]
    expect(holes, "the bracket has holes")


def test_info_of_an_open_part():
    data = open(box(), "rb").read()
    write("open.stl", data[:80] + struct.pack("<I", 11) + data[84:84 + 550])
    text = expect_ok(run("flexel", "info", "open.stl")).out.decode()
    expect("NOT closed" in text and "3 open edges" in text and "volume     4000 mm^3" in text and "healed     1 hole filled" in text, text)
    write("torn.stl", data[:80] + struct.pack("<I", 10) + data[84:84 + 500])
    text = expect_ok(run("flexel", "info", "torn.stl")).out.decode()
    expect("NOT closed" in text and "4 open edges" in text and "volume     none" in text, text)


def test_info_is_that_of_the_healed_part():
    triangles = [[a, c, b] if n % 2 else [a, b, c] for n, (a, b, c) in enumerate(box_triangles())]
    for name, mesh in (("mixed.stl", triangles), ("inside_out.stl", [[a, c, b] for a, b, c in box_triangles()])):
        write(name, binary_stl(mesh))
        part = json.loads(expect_ok(run("flexel", "info", name, "--json")).out)["files"][0]["parts"][0]
        expect(abs(part["volume"] / 4e-6 - 1) < 1e-6, f"{name}: volume {part['volume']}")
        middle = [20e-3, 5e-3, 5e-3]
        for face in part["faces"]:
            outward = sum(n * (c - m) for n, c, m in zip(face["normal"], face["centroid"], middle))
            expect(outward > 0, f"{name}: a face looks inward: {face}")


def test_commands():
    expect(expect_ok(run("flexel", "--version")).out.startswith(b"flexel 0."), "a version")
    expect(b"flexel deform" in expect_ok(run("flexel", "help")).out, "help on stdout")
    for command in ("deform", "info", "voxelize", "simulate", "map"):
        expect(b"--" in expect_ok(run("flexel", "help", command)).out, f"help {command}")
    expect_error(run("flexel"), "flexel", "command", "help")
    expect_error(run("flexel", "defrom"), "flexel", "did you mean \"deform\"")
    expect_error(run("flexel", "map", "absent.vtu", "--format", "stl"), "flexel-map", "absent.vtu")
    expect(not os.listdir("."), "nothing written")


def test_options_that_nothing_takes_are_refused():
    """The body that -o x.vtu writes has its true shape, and a file's extension tells its format."""
    box()
    case = ["box.stl", *CASE, "--force"]
    for out in ("x.vtu", "x.png", "x.html"):
        expect_error(run("flexel", "deform", *case, "--scale", "10", "-o", out), "flexel", "--scale is for surfaces", "bent.stl")
    expect_error(run("flexel", "deform", *case, "--format", "obj", "-o", "x.stl"), "flexel", "--format obj", "-o bent.obj")
    expect_ok(run("flexel", "deform", *case, "--scale", "10", "-o", "x.vtu", "-o", "x.stl"))
    expect_ok(run("flexel", "deform", *case, "-o", "bent.obj", "--format", "stl", "-o", "-"))
    write("m.toml", 'model = "cells"\n')
    refused = run("flexel", "study", "box.stl", "--scene", "m.toml", "--model", "springs", "--material", "steel", "--gravity", "1 g", "-o", "st")
    expect_error(refused, "flexel", "m.toml: has model already: leave --model out")


def test_springs_have_cubic_cells():
    """Whatever the size is, along a part that is turned too; and the answer is that of cells, where Poisson's ratio is 1/4."""
    write("gum.toml", 'material = "gum"\n[materials.gum]\nyoung = "1 GPa"\npoisson = 0.25\ndensity = "1000 kg/m3"\n[[fix]]\nwhere = "bar/held"\n'
          '[[load]]\nwhere = "bar/end"\nforce = ["0 N", "0 N", "-10 N"]\n')
    for degrees in (0, 33):
        write("bar.obj", obj_bar((40, 12, 9), degrees)[0])
        found = {}
        for model in ("cells", "springs"):
            expect_ok(run("flexel", "deform", "bar.obj", "--scene", "gum.toml", "--model", model, "--size", "1.7 mm", "--no-estimate", "-o", "o.stl", "--force",
                          "--summary", "s.json"))
            told = json.load(open("s.json", encoding="utf-8"))
            found[model] = told["simulate"]["largest_displacement"]
        sides = told["voxelize"]["parts"][0]["spacing"]
        expect(max(sides) - min(sides) < 1e-9, sides)
        expect(abs(found["springs"] / found["cells"] - 1) < 0.1, found)  # of cut cells


if __name__ == "__main__":
    main(globals())

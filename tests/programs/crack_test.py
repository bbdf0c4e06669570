"""Parts that broke: flexel-map --crack, and flexel deform with it."""

import collections
import json
import os
import re
import shutil
import struct

import numpy as np

from harness import (ascii_stl, body, box, box_triangles, bracket, expect, expect_error, expect_ok, expect_only, main, run, write)
from torn import tear


def stl(path):
    data = open(path, "rb").read()
    (count,) = struct.unpack_from("<I", data, 80)
    expect(len(data) == 84 + 50 * count, f"{path} is no binary STL")
    records = np.frombuffer(data, np.dtype([("normal", "<f4", 3), ("corner", "<f4", (3, 3)), ("rest", "<u2")]), count, 84)
    return records["corner"].astype(float)


def volume(triangles):
    return float(np.einsum("ij,ij->", triangles[:, 0], np.cross(triangles[:, 1], triangles[:, 2]))) / 6


def expect_solid(path):
    """Closed and oriented by our own count of edges, and by admesh where it is installed."""
    triangles = stl(path)
    edges = collections.Counter()
    for triangle in map(lambda t: [tuple(c) for c in t], triangles):
        for k in range(3):
            edges[triangle[k], triangle[(k + 1) % 3]] += 1
    wrong = [edge for edge, count in edges.items() if count != 1 or edges.get((edge[1], edge[0])) != 1]
    expect(not wrong, f"{path}: {len(wrong)} edges are open or have more than two sides: {wrong[:2]}")
    expect(volume(triangles) > 0, f"{path} is inside out")
    if shutil.which("admesh"):
        said = expect_ok(run("admesh", path, timeout=60)).out.decode()
        for key in ("Total disconnected facets", "Degenerate facets", "Edges fixed", "Facets removed", "Facets added",
                    "Facets reversed", "Backwards edges"):
            numbers = re.search(rf"{key}\s*:\s*(\d+)", said)
            expect(numbers and int(numbers.group(1)) == 0, f"{path}: admesh counts {key}: {said}")
    return volume(triangles)


def half(at, wave=0.0):
    """The side beyond x = at (mm) of a wavy cut."""
    return lambda x: 1e3 * x[:, 0] + wave * np.sin(900 * x[:, 1]) + wave * np.cos(700 * x[:, 2]) > at


def away(x):
    return x + np.array([0.02, 0.0, 0.003])


def torn_bar(wave, *options):
    box()
    expect_ok(run("flexel-voxelize", "box.stl", "--size", "2.5 mm", "-o", "rest.vtu", *options))
    tear("rest.vtu", "torn.vtu", half(21, wave), away)


def test_a_series_comes_out_in_pieces():
    torn_bar(0)
    frames = "".join(f'<DataSet timestep="{i}" part="0" file="{name}"/>' for i, name in enumerate(["rest.vtu", "torn.vtu"]))
    write("run.pvd", f'<?xml version="1.0"?><VTKFile type="Collection" version="0.1"><Collection>{frames}</Collection></VTKFile>')
    result = expect_ok(run("flexel-map", "run.pvd", "--crack", "cap", "-o", "frame.obj"))
    expect("pieces" in result.err, f"it should tell of the pieces: {result}")
    expect_ok(run("flexel-map", "torn.vtu", "--crack", "cap", "-o", "alone.obj"))
    expect_ok(run("flexel-map", "rest.vtu", "-o", "rest.obj"))
    for frame, alone in (("frame_00000.obj", "rest.obj"), ("frame_00001.obj", "alone.obj")):
        expect(open(frame, "rb").read() == open(alone, "rb").read(), f"{frame} is what the frame alone gives")
    expect_error(run("flexel-map", "run.pvd", "--crack", "cap", "--pieces", "p", "-o", "x.obj"), "flexel-map", "--pieces")


def test_torn_bar_is_two_solids():
    torn_bar(0.0)
    os.mkdir("out")
    expect_ok(run("flexel-map", "torn.vtu", "--crack", "cap", "--pieces", "out", "--report", "report.json", "-o", "torn.stl"))
    expect(sorted(os.listdir("out")) == ["box-1.stl", "box-2.stl"], f"{os.listdir('out')}")
    found = json.load(open("report.json"))["crack"]
    expect(found["mode"] == "cap" and found["fragments"] == 2 and found["spanning_triangles"] == 0, f"{found}")
    expect(abs(sum(p["volume_before"] for p in found["pieces"]) - 4e-6) < 1e-18, f"{found}")
    for piece in found["pieces"]:
        solid = expect_solid(f"out/{piece['name']}.stl")
        expect(abs(solid * 1e-9 - piece["volume_after"]) < 1e-12, f"{solid} mm^3, reported {piece}")
    expect(len(stl("torn.stl")) == len(stl("out/box-1.stl")) + len(stl("out/box-2.stl")), "one file with all pieces")


def notched_bar():
    """A bar of 40 x 10 x 10 mm whose cells broke half-way through at x = 20 mm, and that is bent there."""
    box()
    expect_ok(run("flexel-voxelize", "box.stl", "--size", "1.25 mm", "-o", "rest.vtu"))
    angle, tip = 0.1, np.array([0.0206, 0.005, 0])
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    tear("rest.vtu", "notched.vtu", half(20.6), lambda x: (x - tip) @ turn.T + tip, lambda x: x[:, 1] < 0.005)


def test_a_notch_opens_up_to_its_tip():
    notched_bar()
    expect_ok(run("flexel-map", "notched.vtu", "--crack", "cap", "--report", "report.json", "-o", "open.stl"))
    found = json.load(open("report.json"))
    expect(found["crack"]["fragments"] == 0 and found["crack"]["cracked_parts"] == 1 and "pieces" not in found["crack"], f"{found}")
    expect(abs(found["volume_before"] - 4e-6) < 1e-18, f"{found['volume_before']}")
    volume_now = expect_solid("open.stl")
    expect(abs(volume_now * 1e-9 - found["volume_after"]) < 1e-12, f"{volume_now} mm^3, {found['volume_after']} m^3")
    said = expect_ok(run("flexel-map", "notched.vtu", "--report", "kept.json", "-o", "kept.stl"))
    expect("--crack open or cap" in said.err and json.load(open("kept.json"))["crack"]["cracked_parts"] == 1, said.err)
    # The mouth: nothing between its sides, which are 5 mm from the tip and 0.1 rad apart.
    x = sorted(corner[0] for triangle in stl("open.stl") for corner in triangle if corner[1] < 0.2 and 20 < corner[0] < 22)
    gap = max(high - low for low, high in zip(x, x[1:]))
    expect(abs(gap / 0.5 - 1) < 0.15, f"the mouth is {gap} mm wide")
    expect_ok(run("flexel-map", "notched.vtu", "--crack", "cap", "--threads", "1", "-o", "one.stl"))
    expect(open("one.stl", "rb").read() == open("open.stl", "rb").read(), "any number of threads")
    expect_ok(run("flexel-map", "notched.vtu", "--crack", "open", "-o", "walls.stl"))
    expect(len(stl("walls.stl")) < len(stl("open.stl")), "no walls")


def test_pieces_in_every_format():
    torn_bar(2.0)
    for name in ("torn.obj", "torn.ply", "torn.off", "torn.glb", "torn.3mf"):
        expect_ok(run("flexel-map", "torn.vtu", "--crack", "cap", "--debris", "drop", "-o", name))
    expect_ok(run("flexel-map", "torn.vtu", "--crack", "cap", "--debris", "drop", "--ascii", "-o", "torn.stl"))
    expect(re.findall(r"(?m)^o (\S+)", open("torn.obj").read()) == ["box-1", "box-2"], "objects of the OBJ")
    expect(re.findall(r"(?m)^solid (\S+)", open("torn.stl").read()) == ["box-1", "box-2"], "solids of the STL")
    expect(b"property" in (ply := open("torn.ply", "rb").read()) and b" part\n" in ply, "the property of the PLY")
    expect_ok(run("flexel-map", "torn.vtu", "--crack", "cap", "--pieces", "one-{piece}.obj", "-o", "all.obj", "--report", "r.json"))
    for piece in json.load(open("r.json"))["crack"]["pieces"]:
        expect(os.path.exists(f"one-{piece['name']}.obj"), f"no file for {piece}")


def test_pieces_alone():
    torn_bar(0.0)
    result = expect_ok(run("flexel-map", "torn.vtu", "--crack", "cap", "--pieces", "{piece}.stl"))
    expect(result.out == b"", "nothing on stdout")
    expect_only("box.stl", "box-1.stl", "box-2.stl", "rest.vtu", "torn.vtu")


def test_debris_is_kept_or_dropped():
    torn_bar(2.0)
    kept = expect_ok(run("flexel-map", "torn.vtu", "--crack", "cap", "--report", "kept.json", "-o", "kept.stl"))
    expect("debris" in kept.err, f"{kept}")
    expect_ok(run("flexel-map", "torn.vtu", "--crack", "cap", "--debris", "drop", "--report", "dropped.json", "-o", "dropped.stl"))
    kept, dropped = (json.load(open(name))["crack"] for name in ("kept.json", "dropped.json"))
    gone = sum(p["volume_before"] for p in dropped["pieces"] if p["dropped"])
    expect(kept["dropped_pieces"] == 0 and dropped["dropped_pieces"] > 0, "debris was there")
    expect(abs(gone - dropped["dropped_volume"]) < 1e-20 and gone > 0, "the volume that was dropped is said")
    left = volume(stl("dropped.stl")) - volume(stl("kept.stl"))
    expect(abs(left * 1e-9 + gone) < 1e-11, f"{left} mm^3 less, {gone} m^3 dropped")


def test_torn_bracket_is_solid_pieces():
    bracket()
    expect_ok(run("flexel-voxelize", "bracket.step", "--size", "3 mm", "-o", "rest.vtu"))
    tear("rest.vtu", "torn.vtu", half(45, 4.0), away)
    os.mkdir("out")
    said = expect_ok(run("flexel-map", "torn.vtu", "--crack", "cap", "--pieces", "out", "--report", "r.json", "-o", "torn.stl"))
    report = json.load(open("r.json"))
    pieces = report["crack"]["pieces"]
    expect(len(os.listdir("out")) == len(pieces) > 1, f"{said}")
    for piece in pieces:
        expect_solid(f"out/{piece['name']}.stl")
    whole = sum(p["volume_before"] for p in pieces)
    expect(abs(whole - report["volume_before"]) < 1e-12 * whole, f"{whole} {report['volume_before']}")


def test_centre_placement():
    torn_bar(2.0, "--placement", "centre")
    expect_ok(run("flexel-map", "torn.vtu", "--crack", "cap", "-o", "whole.stl"))
    expect(abs(volume(stl("whole.stl")) - 4000) < 0.01, "nothing is lost")


def test_deform_tears_and_caps():
    box()
    write("tear.toml", """[materials.jelly]
young = "10 MPa"
poisson = 0.3
density = "1000 kg/m3"
strength = "0.5 MPa"
source = "test"
[[fix]]
where = { box = { min = ["-1 mm", "-1 mm", "-1 mm"], max = ["11 mm", "11 mm", "11 mm"] } }
[[load]]
where = "xmax"
force = ["90 N", "0 N", "0 N"]
time = ["0 s", "3 ms"]
factor = [0, 1]
[fracture]
[run]
time = "3 ms"
""")
    expect_ok(run("flexel", "deform", "box.stl", "--scene", "tear.toml", "--material", "jelly", "--size", "2.5 mm", "--crack", "cap",
                  "--debris", "drop", "--pieces", "{piece}.stl", "--report", "report.json", "-o", "torn.stl", "-o", "torn.vtu"))
    found = json.load(open("report.json"))["crack"]
    large = [piece for piece in found["pieces"] if not piece["dropped"]]
    expect(len(large) > 1, f"it tore: {found}")
    for piece in large:
        expect_solid(f"{piece['name']}.stl")
    expect_ok(run("flexel-map", "torn.vtu", "--crack", "cap", "--debris", "drop", "-o", "again.stl"))
    expect(open("again.stl", "rb").read() == open("torn.stl", "rb").read(), "one process or three, the same bits")


def test_threads_give_the_same_bits():
    torn_bar(2.0)
    for threads in ("1", "3"):
        expect_ok(run("flexel-map", "torn.vtu", "--crack", "cap", "--threads", threads, "-o", f"{threads}.obj"))
    expect(open("1.obj").read() == open("3.obj").read(), "any number of threads")


def test_open_surface_can_be_opened_but_not_capped():
    # A small hole in the far end: healed for the lattice, open as it came.
    triangles = box_triangles()
    outer = triangles.pop()
    middle = [sum(corner[k] for corner in outer) / 3 for k in range(3)]
    inner = [tuple(m + 0.02 * (c - m) for c, m in zip(corner, middle)) for corner in outer]
    for k in range(3):
        a, b, p, q = outer[k], outer[(k + 1) % 3], inner[k], inner[(k + 1) % 3]
        triangles += [[a, b, q], [a, q, p]]
    write("open.stl", ascii_stl(triangles))
    expect_ok(run("flexel-voxelize", "open.stl", "--size", "2.5 mm", "-o", "rest.vtu"))
    tear("rest.vtu", "torn.vtu", half(21), away)
    expect_error(run("flexel-map", "torn.vtu", "--crack", "cap", "-o", "torn.stl"), "flexel-map", "is open", "--crack open")
    expect_ok(run("flexel-map", "torn.vtu", "--crack", "open", "--report", "r.json", "-o", "torn.stl"))
    expect(json.load(open("r.json"))["volume_after"] is None, "what is open has no volume")


def test_whole_body_is_the_same_whatever_is_asked():
    body()
    for how in ("keep", "open", "cap"):
        expect_ok(run("flexel-map", "body.vtu", "--crack", how, "-o", f"{how}.stl"))
    expect(open("keep.stl", "rb").read() == open("open.stl", "rb").read() == open("cap.stl", "rb").read(), "nothing broke")


def test_words_that_do_not_fit():
    body()
    for options, fragment in (
        (("--crack", "opne"), "did you mean \"open\""),
        (("--crack", "cap", "--debris", "dorp"), "did you mean \"drop\""),
        (("--debris", "drop"), "--crack open or cap"),
        (("--pieces", "x-{piece}.stl"), "--crack open or cap"),
        (("--crack", "cap", "--pieces", "nowhere"), "no folder"),
        (("--crack", "cap", "--pieces", "{piece}.xyz"), "xyz"),
    ):
        expect_error(run("flexel-map", "body.vtu", *options, "-o", "x.stl"), "flexel-map", fragment)


DRILL = """material = "steel"
[[fix]]
where = "xmin"
[gravity]
acceleration = [0, 0, "-9.81 m/s2"]
[[event]]
at = "10 us"
do = "carve"
positions = "rest"
where = { box = { min = ["14 mm", "-1 mm", "-1 mm"], max = ["21 mm", "6 mm", "11 mm"] } }
[run]
time = "20 us"
"""


def test_a_carved_part_comes_out_closed():
    box()
    expect_ok(run("flexel-voxelize", "box.stl", "--size", "2.5 mm", "-o", "rest.vtu"))
    expect_ok(run("flexel-simulate", write("drill.toml", DRILL), "rest.vtu", "-o", "drilled.vtu"))
    said = expect_ok(run("flexel-map", "drilled.vtu", "-o", "kept.stl"))
    expect("carved away" in said.err and "--crack cap" in said.err, said.err)
    closed = expect_ok(run("flexel-map", "drilled.vtu", "--crack", "cap", "--report", "report.json", "-o", "closed.stl"))
    expect("carved away" not in closed.err, closed.err)
    taken = volume(stl("box.stl")) - expect_solid("closed.stl")
    # voxels whose middle is in the box: 2 x 2 x 4 of 2.5 mm
    expect(abs(taken / (16 * 2.5 ** 3) - 1) < 0.01, f"{taken} mm^3 went")
    expect(json.load(open("report.json"))["valid"], "the mapping can be used")


def test_a_carved_and_torn_part_is_parted_and_closed():
    box()
    expect_ok(run("flexel-voxelize", "box.stl", "--size", "2.5 mm", "-o", "rest.vtu"))
    expect_ok(run("flexel-simulate", write("drill.toml", DRILL), "rest.vtu", "-o", "drilled.vtu"))
    tear("drilled.vtu", "torn.vtu", half(26), away)
    os.mkdir("out")
    expect_ok(run("flexel-map", "torn.vtu", "--crack", "cap", "--pieces", "out", "--report", "report.json", "-o", "torn.stl"))
    expect(sorted(os.listdir("out")) == ["box-1.stl", "box-2.stl"], f"{os.listdir('out')}")
    for name in os.listdir("out"):
        expect_solid(f"out/{name}")
    left = sum(p["volume_before"] for p in json.load(open("report.json"))["crack"]["pieces"])
    expect(abs((4000 - left * 1e9) / (16 * 2.5 ** 3) - 1) < 0.01, f"{left} m^3 are left")


if __name__ == "__main__":
    main(globals())

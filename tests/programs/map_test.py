"""flexel-map beyond the part's own surface: other meshes, points, series, scales, attributes and checks."""

import json
import os

from harness import body, bracket, expect, expect_error, expect_ok, main, need, run, scene, write

MOVE = """material = "steel"
[[fix]]
where = "xmin"
[[move]]
where = "xmax"
displacement = ["0 mm", "0 mm", "-4 mm"]
"""
SHEAR = """material = "steel"
[[fix]]
where = "zmin"
[[move]]
where = "zmax"
displacement = ["2 mm", "0 mm", "0 mm"]
"""


def bent(text=MOVE):
    body()
    expect_ok(run("flexel-simulate", scene(text=text), "body.vtu", "-o", "bent.vtu"))
    return "bent.vtu"


def strip():
    """A strip of quads along the box, finer than its own twelve triangles."""
    lines = [f"v {x} {y} 10" for x in range(0, 41, 2) for y in (0, 10)]
    lines += [f"f {2 * i + 1} {2 * i + 3} {2 * i + 4} {2 * i + 2}" for i in range(20)]
    return write("strip.obj", "# a strip\n" + "\n".join(lines) + "\n")


def vertices(path):
    return [[float(x) for x in line.split()[1:4]] for line in open(path) if line.startswith("v ")]


def test_another_mesh_follows_the_same_deformation():
    strip()
    expect_ok(run("flexel-map", bent(), "--onto", "strip.obj", "-o", "out.obj"))
    before, after = vertices("strip.obj"), vertices("out.obj")
    expect(len(after) == len(before) and open("out.obj").readline() == "# a strip\n", "the same file, moved")
    expect(abs(after[0][2] - 10) < 0.05, f"the fixed end stays: {after[0]}")
    expect(abs(after[-1][2] - 6) < 0.05, f"the moved end is where it was moved: {after[-1]}")
    own = expect_ok(run("flexel-map", "bent.vtu", "--onto", "strip.obj", "--method", "smooth", "-o", "smooth.obj"))
    expect("can be used" in own.err, own.err)


def test_another_mesh_is_split_too():
    coarse = expect_ok(run("flexel-map", bent(), "--keep-vertices", "-o", "own.obj"))
    expect("stay flat where the part bends" in coarse.err, coarse.err)
    expect_ok(run("flexel-map", "body.vtu", "--quiet", "-o", "box.obj"))
    fine = expect_ok(run("flexel-map", "bent.vtu", "--onto", "box.obj", "--edge", "4 mm", "-o", "fine.obj", "--strict"))
    expect("can be used" in fine.err and "its triangles were split" in fine.err, fine.err)
    expect(len(vertices("fine.obj")) > 100, "and written")
    expect_error(run("flexel-map", "bent.vtu", "--edge", "4 mm", "-o", "x.obj"), "flexel-map", "--onto", "flexel-voxelize")


def test_points_come_out_as_the_table_they_were_in():
    write("p.csv", "# sensors\nname,x,y,z,colour\nroot,0,5,5,red\ntip,40,5,5,blue\n")
    expect_ok(run("flexel-map", bent(), "--points", "p.csv", "-o", "out.csv"))
    lines = open("out.csv").read().splitlines()
    expect(lines[:2] == ["# sensors", "name,x,y,z,colour"] and lines[3].endswith(",blue"), f"{lines}")
    tip = [float(x) for x in lines[3].split(",")[1:4]]
    expect(abs(tip[2] - 1) < 0.05, f"{tip}")
    piped = expect_ok(run("flexel-map", "bent.vtu", "--points", "-", stdin=b"40,5,5\n"))
    expect(piped.out.decode().count(",") == 2, f"{piped.out}")


def test_points_from_a_spreadsheet_begin_with_a_mark():
    write("p.csv", "\ufeffx,y,z\n40,5,5\n")
    expect_ok(run("flexel-map", bent(), "--points", "p.csv", "-o", "out.csv"))


def test_wrong_points_name_their_line():
    bent()
    for text, fragment in [("x,y,z\n1,2\n", "bad.csv:2"), ("1,2,three\n", "bad.csv:1"), ("a,b\n1,2\n", "bad.csv:1"),
                           ("# nothing\n", "no point")]:
        write("bad.csv", text)
        expect_error(run("flexel-map", "bent.vtu", "--points", "bad.csv", "-o", "out.csv"), "flexel-map", fragment)
        expect(not os.path.exists("out.csv"), "nothing is written")


def test_what_is_far_away_is_refused_or_carried():
    write("far.csv", "900,5,5\n")
    expect_error(run("flexel-map", bent(), "--points", "far.csv", "-o", "out.csv"), "flexel-map", "spacings outside",
                 "--far")
    expect_ok(run("flexel-map", "bent.vtu", "--points", "far.csv", "--far", "rigid", "-o", "out.csv"))
    expect_error(run("flexel-map", "bent.vtu", "--far", "ridgid", "-o", "x.stl"), "flexel-map", "rigid")


def test_a_scale_is_said_in_the_file():
    strip()
    expect_ok(run("flexel-map", bent(), "--scale", "50", "-o", "big.stl"))
    expect(b"displacements times 50" in open("big.stl", "rb").read(80), "the header says so")
    expect_ok(run("flexel-map", "bent.vtu", "--onto", "strip.obj", "-o", "one.obj"))
    expect_ok(run("flexel-map", "bent.vtu", "--onto", "strip.obj", "--scale", "3", "-o", "three.obj"))
    expect("displacements times 3" in open("three.obj").readline(), "the first line says so")
    for rest, one, three in zip(vertices("strip.obj"), vertices("one.obj"), vertices("three.obj")):
        for a, b, c in zip(rest, one, three):
            expect(abs((c - a) - 3 * (b - a)) < 1e-9, f"{a} {b} {c}")


def test_a_series_gives_a_file_for_each_frame():
    bent()
    expect_ok(run("flexel-map", "body.vtu", "-o", "rest.stl"))
    whole = "--keep-vertices"
    expect_ok(run("flexel-map", "bent.vtu", whole, "-o", "alone.stl"))
    frames = "".join(f'<DataSet timestep="{i}" part="0" file="{name}"/>' for i, name in enumerate(["body.vtu", "bent.vtu"]))
    write("run.pvd", f'<?xml version="1.0"?><VTKFile type="Collection" version="0.1"><Collection>{frames}</Collection></VTKFile>')
    expect_ok(run("flexel-map", "run.pvd", whole, "-o", "frame.stl"))
    expect_ok(run("flexel-map", "run.pvd", whole, "-o", "n{frame}.stl", "--report", "r.json"))
    for name in ["frame_00001.stl", "n00001.stl"]:
        expect(open(name, "rb").read() == open("alone.stl", "rb").read(), f"{name} is what the frame alone gives")
    expect(open("frame_00000.stl", "rb").read() == open("rest.stl", "rb").read(), "the first frame is at rest")
    expect(json.load(open("r_00001.json"))["failures"]["inverted"] == 0, "a report for each frame")
    expect(json.load(open("r_00000.json"))["valid"], "at rest even twelve triangles show all there is")
    expect_error(run("flexel-map", "run.pvd", "--format", "stl"), "flexel-map", "-o")
    write("empty.pvd", "<VTKFile><Collection/></VTKFile>")
    expect_error(run("flexel-map", "empty.pvd", "-o", "x.stl"), "flexel-map", "empty.pvd", "no frame")


def test_a_saved_binding_gives_the_same_bytes():
    strip()
    bent()
    for extra in [[], ["--onto", "strip.obj"]]:
        for method in ["affine", "gram-schmidt"]:
            plain = ["flexel-map", "bent.vtu", "--keep-vertices", *extra]
            expect_ok(run(*plain, "--method", method, "-o", "plain.obj"))
            expect_ok(run(*plain, "--method", method, "--save-binding", "part.binding", "-o", "saving.obj"))
            expect_ok(run(*plain, "--binding", "part.binding", "--report", "report.json", "-o", "bound.obj"))
            same = open("plain.obj", "rb").read()
            expect(open("saving.obj", "rb").read() == same and open("bound.obj", "rb").read() == same, f"{method}")
            expect(json.load(open("report.json"))["method"] == method, "the report names the binding's method")


def test_a_wrong_binding_is_refused():
    strip()
    bound = ["flexel-map", bent(), "-o", "out.stl"]
    expect_ok(run(*bound, "--method", "affine", "--save-binding", "part.binding"))
    os.remove("out.stl")
    whole = open("part.binding", "rb").read()
    open("short.binding", "wb").write(whole[:-9])
    open("corrupt.binding", "wb").write(whole[:200] + bytes([whole[200] ^ 1]) + whole[201:])
    write("text.binding", "a text that is long enough to be taken for a header, were it not for its first word")
    for arguments, fragment in [(["--binding", "short.binding"], "damaged"), (["--binding", "corrupt.binding"], "damaged"),
                                (["--binding", "text.binding"], "no saved binding"),
                                (["--binding", "missing.binding"], "missing.binding"),
                                (["--binding", "part.binding", "--onto", "strip.obj"], "another surface"),
                                (["--binding", "part.binding", "--method", "gram-schmidt"], "method affine"),
                                (["--binding", "part.binding", "--crack", "cap"], "--crack"),
                                (["--save-binding", "b", "--method", "blended"], "--method affine"),
                                (["--save-binding", "b"], "--method affine")]:
        expect_error(run(*bound, *arguments), "flexel-map", fragment)
        expect(not os.path.exists("out.stl") and not os.path.exists("b"), "nothing is written")
    body("other.vtu", "--placement", "centre")
    expect_error(run("flexel-map", "other.vtu", "-o", "out.stl", "--binding", "part.binding"), "flexel-map", "another lattice")


def test_attributes_checks_and_the_table():
    result = expect_ok(run("flexel-map", bent(MOVE.replace("-4 mm", "-2 mm")), "-o", "a.ply", "--ascii", "--attributes", "--table", "--check",
                           "voronoi,self-intersection", "--report", "r.json"))
    head = open("a.ply").read().split("end_header")[0]
    for name in ["stretch", "frame_kind", "distance_outside", "rest_residual", "voronoi_changed"]:
        expect(f"property double {name}" in head, head)
    report = json.load(open("r.json"))
    expect(report["failures"]["new_self_intersections"] == 0 and report["advisories"]["voronoi_changed"] == 0, f"{report}")  # bent, hardly sheared
    expect(report["smallest_angle_before"] > 10 and report["lattice_volume_before"] > 0, f"{report}")
    for key in ["failures.new_self_intersections", "smallest_angle_after", "largest_stretch"]:
        expect(key in result.err, result.err)
    body()
    expect_ok(run("flexel-simulate", scene(text=SHEAR), "body.vtu", "-o", "sheared.vtu"))
    result = expect_ok(run("flexel-map", "sheared.vtu", "-o", "a.stl", "--check", "voronoi", "--report", "r.json"))
    expect(json.load(open("r.json"))["advisories"]["voronoi_changed"] > 0 and "Voronoi neighbours have changed" in result.err, result.err)
    expect_error(run("flexel-map", "bent.vtu", "-o", "a.stl", "--attributes"), "flexel-map", "PLY")
    expect_error(run("flexel-map", "bent.vtu", "-o", "a.stl", "--check", "voroni"), "flexel-map", "voronoi")


def test_a_vtu_surface_is_read_by_meshio():
    need("python3")
    try:
        import meshio
    except ImportError:
        return
    expect_ok(run("flexel-map", bent(), "--keep-vertices", "-o", "a.vtu"))
    mesh = meshio.read("a.vtu")
    expect(len(mesh.points) == 8 and mesh.point_data["displacement"].shape == (8, 3), f"{mesh}")


def test_a_step_file_can_be_mapped_onto():
    write("a.step", "ISO-10303-21;\nHEADER;\n")
    expect_error(run("flexel-map", bent(), "--onto", "a.step", "-o", "x.stl"), "flexel-map", "a.step")
    bracket()
    expect_ok(run("flexel-voxelize", "bracket.step", "--size", "4mm", "-o", "rest.vtu", "--quiet"))
    expect_ok(run("flexel-map", "rest.vtu", "--onto", "bracket.step", "-o", "x.stl"))


if __name__ == "__main__":
    main(globals())

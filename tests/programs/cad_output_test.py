"""STEP, IGES and BREP out: the part's own faces, deformed, read by other tools; and what is refused."""

import functools
import json
import math
import os
import pathlib
import re
import shutil
import time

from harness import (BIN, PARTS, Skip, body, bracket, expect, expect_error, expect_ok, expect_only, main, need, need_step, run, scene, shell, write)

BEND = """material = "pla"
[[fix]]
where = "bracket/1"
[[load]]
where = "bracket/2"
force = ["0 N", "0 N", "-1000 N"]
"""


def bent(name="bent.vtu", size="3mm", text=BEND, part=None):
    """The bracket, its seat bent by some 30 mm, as a body."""
    part = part or bracket()
    scene(text=text)
    expect_ok(run("flexel-voxelize", part, "--size", size, "-o", "rest.vtu", "--quiet"))
    expect_ok(run("flexel-simulate", "scene.toml", "rest.vtu", "-o", name, "--no-estimate", "--quiet"))
    return name


@functools.cache
def info_of(part, written):
    return expect_ok(run("flexel", "info", part)).out.decode()


def info(part):
    """What `flexel info` shows of the file as it is now."""
    return info_of(part, os.stat(part).st_mtime_ns)


def faces(part):
    """(number, area in mm^2, name) of each face that `flexel info` shows."""
    found = re.findall(r"^  \S+/(\d+) +([\d.]+)  \(.*?\) +(.*)$", info(part), re.M)
    return [(int(number), float(area), (re.search(r'called "(.*)"', what) or [None, ""])[1]) for number, area, what in found]


# What a mesh within a thousandth of the diagonal loses of walls of 6 mm that are bent.
TESSELLATION = 3e-3


def volume(part):
    """mm^3, of the triangles of `flexel info`."""
    return float(re.search(r"volume +([\d,.]+) mm", info(part))[1].replace(",", ""))


def vertices(step):
    """Corners of the solid: the points of its VERTEX_POINTs, mm."""
    text = pathlib.Path(step).read_text().replace("\n", "")
    points = {number: tuple(map(float, at.split(","))) for number, at in re.findall(r"#(\d+) *= *CARTESIAN_POINT\('[^']*', *\(([^()]*)\)\)", text) if at.count(",") == 2}
    return [points[number] for number in re.findall(r"VERTEX_POINT\('[^']*', *#(\d+)\)", text)]


def bent_as(*names):
    """Writes bent.vtu, with two threads, in each format, and report.json; what was said of the last."""
    for name in names:
        said = expect_ok(run("flexel-map", "bent.vtu", "-o", name, "--report", "report.json", "--threads", "2", "--force")).err
    return said


def test_one_bent_part_in_every_format():
    """The same faces come back bent, from one lattice, as STEP, IGES and BREP."""
    bent()
    the_same_faces_come_back(bent_as("bent.step"))
    corners_are_where_points_go()
    said = bent_as("bent.igs", "bent.brep")
    expect("names of bracket.step do not come along: BREP has no room" in said, said)
    iges_and_brep_hold_the_same()
    the_bytes_do_not_depend_on_threads_or_time()
    notes_do_not_come_along()
    if shutil.which("gmsh"):
        size, report = volume_of_tetrahedra("bent.step"), json.loads(pathlib.Path("report.json").read_text())
        expect(abs(1e-9 * size / report["volume_after"] - 1) < 1e-3, f"gmsh meshes it: {size} mm^3, {report}")


def the_same_faces_come_back(said):
    expect(re.search(r"STEP: 1 solid of 11 faces, \d+ as before, the others within .* of the deformation", said), said)
    expect("valid, also when read again" in said and "do not come along" not in said, said)
    before, after = faces("bracket.step"), faces("bent.step")
    expect([each[0::2] for each in before] == [each[0::2] for each in after], f"numbers and names: {before} {after}")
    report = json.loads(pathlib.Path("report.json").read_text())
    changed = volume("bent.step") / volume("bracket.step")
    expect(abs(changed - report["volume_after"] / report["volume_before"]) < TESSELLATION, f"volume: {changed} {report}")
    expect(pathlib.Path("bent.step").read_text().count("AUTOMOTIVE_DESIGN") == pathlib.Path("bracket.step").read_text().count("AUTOMOTIVE_DESIGN"), "schema")


def corners_are_where_points_go():
    """flexel-map --points moves the corners without any CAD library."""
    at_rest, moved = vertices("bracket.step"), vertices("bent.step")
    write("corners.csv", "x,y,z\n" + "".join(f"{x!r},{y!r},{z!r}\n" for x, y, z in at_rest))
    expect_ok(run("flexel-map", "bent.vtu", "--points", "corners.csv", "-o", "moved.csv", "--quiet"))
    lines = pathlib.Path("moved.csv").read_text().splitlines()[1:]
    wanted = [tuple(map(float, line.split(",")[:3])) for line in lines]
    expect(len(wanted) == len(moved) and len(moved) >= 18, f"{len(wanted)} corners and {len(moved)}")
    tolerance = 1e-4 * math.dist((0, 0, 0), (80, 40, 60))
    for corner in wanted:
        expect(min(math.dist(corner, each) for each in moved) < tolerance, f"no corner near {corner}")
    expect(max(math.dist(a, b) for a, b in zip(at_rest, wanted)) > 10, "hardly anything moved")


def iges_and_brep_hold_the_same():
    wanted = volume("bent.step")
    for name in ("bent.igs", "bent.brep"):
        found, there = volume(name), faces(name)
        expect(abs(found / wanted - 1) < 1e-4, f"{name}: {found} {wanted}")
        expect(len(there) == 11, f"{name}: {there}")
    expect([each[2] for each in faces("bent.igs")] == [each[2] for each in faces("bracket.step")], "names of faces in IGES")


def the_bytes_do_not_depend_on_threads_or_time():
    """One thread, a second later; and a name that is not UTF-8 is a name."""
    time.sleep(max(0, os.path.getmtime("bent.brep") + 1.1 - time.time()))
    for kind in ("step", "igs", "brep"):
        again = os.fsdecode(b"again\xff." + kind.encode())
        expect_ok(run("flexel-map", "bent.vtu", "-o", again, "--threads", "1", "--quiet"))
        expect(pathlib.Path(again).read_bytes() == pathlib.Path(f"bent.{kind}").read_bytes(), f"bytes of {kind}")


def notes_do_not_come_along():
    """Of bracket.step with two notes, which becomes the part of another lattice."""
    text = pathlib.Path("bracket.step").read_text()
    last = max(map(int, re.findall(r"#(\d+) *=", text)))
    write("noted.step", text.replace("ENDSEC;\nEND-ISO", f"#{last + 1}=DRAUGHTING_CALLOUT('a =DATUM(',());\n#{last + 2}=DRAUGHTING_CALLOUT('',());\nENDSEC;\nEND-ISO"))
    expect_ok(run("flexel-voxelize", "noted.step", "--size", "8mm", "-o", "noted.vtu", "--quiet"))
    said = expect_ok(run("flexel-map", "noted.vtu", "-o", "again.step")).err
    expect("(PMI: 2 entities as DRAUGHTING_CALLOUT) of noted.step do not come along" in said, said)


def test_iges_and_brep_are_sources():
    bent(size="6mm")
    bent_as("bent.igs", "bent.brep")
    for name in ("bent.igs", "bent.brep"):
        bent(size="6mm", part=name, text='material = "pla"\n[[fix]]\nwhere = "zmax"\n[[move]]\nwhere = "zmin"\ndisplacement = ["3 mm", "0 mm", "0 mm"]\n', name="again.vtu")
        expect_ok(run("flexel-map", "again.vtu", "-o", "again." + name.rsplit(".")[1], "--quiet"))


def test_one_run_tells_the_faces_it_wrote():
    """Of several CAD files of one run, which are one fit."""
    part = bracket()
    words = ("flexel", "deform", part, "--material", "pla", "--fix", "bracket/1", "--push", "bracket/2: 0 0 -200 N", "--size", "5mm", "--no-estimate")
    said = expect_ok(run(*words, "-o", "bent.step", "-o", "bent.brep", "-o", "again.step", "-o", "bent.igs", "--summary", "summary.json")).err
    lines = re.findall(r"faces +(STEP|BREP|IGES): 1 solid of 11 faces, (\d+) as before, the others within (\S+) (\S+) of the deformation \(bracket/(\d+)\); valid, also when read again", said)
    expect([each[0] for each in lines] == ["STEP", "BREP", "STEP", "IGES"], said)
    found = json.loads(pathlib.Path("summary.json").read_text())["cad"]
    for line, file in zip(lines, found, strict=True):
        metres = float(line[2]) * {"nm": 1e-9, "um": 1e-6, "mm": 1e-3}[line[3]]
        expect(abs(file["deviation"] / metres - 1) < 0.01 and file["deviation_face"] == f"bracket/{line[4]}", f"{line} {file}")
        expect(file["faces_kept"] == int(line[1]) and file["deviation"] <= file["tolerance"] and file["valid"] and not file["missed"], f"{file}")
        expect(file["format"] == {".igs": "iges"}.get(suffix := pathlib.Path(file["file"]).suffix, suffix[1:]), f"{file}")
        expect(abs(file["volume_after"] * 1e9 / volume(file["file"]) - 1) < TESSELLATION, f"{file}")
    expect(abs(volume("bent.brep") / volume("bent.step") - 1) < 1e-6, "the same solid")
    read = lambda name: pathlib.Path(name).read_bytes()
    expect(read("bent.step") == read("again.step"), "one format, one file")
    said = expect_ok(run(*words, "--verbose", "-o", "alone.igs")).err
    expect(read("bent.igs") == read("alone.igs"), "what else is written changes nothing")
    expect(said.count("also when read again") == 1, f"said once: {said}")


def test_what_a_writer_refuses_or_warns_of():
    """Tolerances, --strict, a scale, options that are for meshes, and a missing flexel-cad, of one bent part."""
    bent(size="6mm")
    a_tolerance_is_kept_or_told()
    a_folded_part_is_told_and_not_written_with_strict()
    said = expect_ok(run("flexel-map", "bent.vtu", "-o", "bent.step", "--scale", "0.5", "--strict", "--force")).err
    expect("volume of the faces" not in said, f"a scale is no fault: {said}")
    options_that_are_for_meshes_are_refused()
    a_missing_worker_is_one_line()


def a_tolerance_is_kept_or_told():
    size = {}
    for tolerance in ("1e-3", "20um", "1e-5"):
        said = expect_ok(run("flexel-map", "bent.vtu", "-o", "bent.step", "--tolerance", tolerance, "--force")).err
        expect("warning" not in said, said)
        size[tolerance] = os.path.getsize("bent.step")
    expect(size["1e-3"] < size["20um"] < size["1e-5"], f"sizes {size}")
    expect_error(run("flexel-map", "bent.vtu", "-o", "bent.step", "--tolerance", "1e-9", "--force"), "flexel-map", "--tolerance", "diagonal")
    os.remove("bent.step")


def a_folded_part_is_told_and_not_written_with_strict():
    folded = ("flexel-map", "bent.vtu", "--scale", "-60", "--tolerance", "1e-3")
    said = expect_ok(run(*folded, "-o", "folded.step")).err
    expect("turns space inside out at bracket/" in said, said)
    expect_error(run(*folded, "-o", "bent.step", "--strict", "--report", "report.json"), "flexel-map", code=4)
    expect(pathlib.Path("report.json").exists() and not pathlib.Path("bent.step").exists(), "the report, and no part in spite of --strict")


def options_that_are_for_meshes_are_refused():
    map_step = ("flexel-map", "bent.vtu", "-o", "x.step")
    expect_error(run(*map_step, "--crack", "cap"), "flexel-map", "--crack", "write a mesh")
    expect_error(run(*map_step, "--attributes"), "flexel-map", "--attributes")
    expect_error(run(*map_step, "--ascii"), "flexel-map", "--ascii")
    expect_error(run(*map_step, "--unit", "inch"), "flexel-map", "--unit")
    expect_error(run(*map_step, "--method", "gram-schmidt"), "flexel-map", "gram-schmidt", "blended")
    expect_error(run(*map_step, "--onto", "bracket.step"), "flexel-map", "--onto")
    for tolerance in ("0", "-1", "nan", "2", "3 kg", "soon"):
        expect_error(run(*map_step, f"--tolerance={tolerance}"), "flexel-map")
    expect_error(run("flexel-map", "bent.vtu", "-o", "x.stl", "--tolerance", "1e-4"), "flexel-map", "--tolerance")
    expect(not list(pathlib.Path().glob("x.*")), "something was written")


def a_missing_worker_is_one_line():
    """flexel-cad is the one program that loads OpenCASCADE."""
    os.mkdir("bin")
    shutil.copy(BIN / "flexel-map", "bin/flexel-map")
    shutil.copy(BIN / "flexel-voxelize", "bin/flexel-voxelize")
    expect_error(run("./bin/flexel-map", "bent.vtu", "-o", "x.step"), "flexel-map", "flexel-cad", "install")
    expect_error(run("./bin/flexel-voxelize", "bracket.step", "--size", "3mm", "-o", "x.vtu"), "flexel-voxelize", "flexel-cad")
    expect_ok(run("./bin/flexel-map", "bent.vtu", "-o", "x.stl", "--quiet"))
    os.mkdir("libexec"), os.mkdir("libexec/flexel")
    os.symlink(BIN / "flexel-cad", "libexec/flexel/flexel-cad")
    expect_ok(run("./bin/flexel-map", "bent.vtu", "-o", "x.step", "--quiet"))
    os.remove("libexec/flexel/flexel-cad")
    write("libexec/flexel/flexel-cad", "#!/bin/sh\nexit 127\n")
    os.chmod("libexec/flexel/flexel-cad", 0o755)
    expect_error(run("./bin/flexel-voxelize", "bracket.step", "--size", "3mm", "-o", "x.vtu"), "flexel-voxelize", "does not start", "install")
    alone = run("flexel-cad", stdin=b"no job")
    expect(alone.code == 127 and "run by the other programs" in alone.err, str(alone))


def test_of_a_brep_file_in_inches_each_format_has_its_own_unit():
    need("gmsh")
    expect_ok(run("gmsh", "-v", "1", "-0", write("inches.geo", 'SetFactory("OpenCASCADE"); Box(1) = {0, 0, 0, 4, 1, 1}; Save "inches.brep";\n')))
    expect_ok(run("flexel", "deform", "inches.brep", "--unit", "in", "--material", "pla", "--fix", "xmin", "--push", "xmax: 0 0 -50 N", "--size", "5mm", "--no-estimate", "--quiet",
                  "-o", "bent.step", "-o", "bent.brep"))
    metric, inches = volume("bent.step"), volume("bent.brep")
    expect(abs(metric / inches / 25.4**3 - 1) < 1e-4, f"{metric} mm^3, {inches} in^3")


def test_colours_and_levels_of_iges_come_out_again():
    part = PARTS / "red_cube_blue_cylinder.step"
    if not part.exists():
        raise Skip("no real parts here")
    bend = ("--material", "pla", "--fix", "zmin", "--push", "zmax: 30 0 0 N", "--count", "1500", "--no-estimate", "--quiet")
    expect_ok(run("flexel", "deform", part, *bend, "-o", "first.igs"))
    text = pathlib.Path("first.igs").read_text().splitlines()
    entries = [i for i, line in enumerate(text) if line[72:73] == "D"]
    for first in entries[::2]:  # the level is the fifth number of the first line
        if text[first][:8].strip() == "144" or text[first][:8].strip() == "510":
            text[first] = text[first][:32] + "7".rjust(8) + text[first][40:]
    write("levels.igs", "\n".join(text) + "\n")
    expect_ok(run("flexel", "deform", "levels.igs", *bend, "-o", "second.igs", "-o", "second.step", "-o", "second.ply"))
    first, second = [sorted(re.findall(r"^314,([\d.]+)", pathlib.Path(name).read_text(), re.M)) for name in ("first.igs", "second.igs")]
    expect(len(set(first)) >= 2 and set(second) == set(first), f"colours: {first} {second}")
    step = pathlib.Path("second.step").read_text().replace("\n", "")
    expect(len(re.findall(r"COLOUR_RGB\('[^']*',([^)]*)\)", step)) >= 2, "colours in STEP")
    expect(re.findall(r"PRESENTATION_LAYER_ASSIGNMENT\('([^']*)'", step) == ["7"], "the level is a layer")
    expect("property uchar red" in pathlib.Path("second.ply").read_text(errors="replace"), "colours of a mesh")


def volume_of_tetrahedra(step):
    """mm^3, of gmsh's tetrahedra; whatever the unit of the file."""
    import meshio
    import numpy
    write("mesh.geo", f'SetFactory("OpenCASCADE"); Merge "{step}"; Mesh.MeshSizeMax = 4; Mesh.MeshSizeFromCurvature = 30;\n')
    expect_ok(run("gmsh", "-3", "mesh.geo", "-o", "mesh.msh", "-format", "msh2", "-v", "1"))
    read = meshio.read("mesh.msh")
    p = read.points[numpy.concatenate([block.data for block in read.cells if block.type == "tetra"])]
    return abs(numpy.einsum("ij,ij->i", numpy.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), p[:, 3] - p[:, 0])).sum() / 6


# Run in FreeCAD's own interpreter: valid, solids, volume, and the names that its importer shows.
FREECAD = """import sys, FreeCAD, Part, Import
FreeCAD.ParamGet("User parameter:BaseApp/Preferences/Mod/Import").SetBool("UseLinkGroup", False)
for name in {files}:
    shape = Part.read(name)
    FreeCAD.newDocument("read")
    if name.endswith("step"):
        Import.insert(name, "read")
    labels = sorted(each.Label for each in FreeCAD.getDocument("read").Objects if each.isDerivedFrom("Part::Feature"))
    print("\\nREAD", repr((name, shape.isValid(), len(shape.Solids), all(each.isClosed() for each in shape.Solids), shape.Volume, labels)))
    FreeCAD.closeDocument("read")
"""


def freecad(*files):
    """{file: (valid, solids, closed, volume in mm^3, labels of the imported objects)}"""
    need("freecadcmd")
    write("read.py", FREECAD.format(files=list(files)))
    said = run("freecadcmd", "read.py").out.decode()
    found = {each[0]: each[1:] for each in map(eval, re.findall(r"READ (.*)", said))}
    expect(list(found) == list(files), f"FreeCAD reads {files}: {said}")
    return found


def test_freecad_reads_it():
    need("freecadcmd")
    bent()
    for name in ("bent.step", "bent.igs", "bent.brep"):
        expect_ok(run("flexel-map", "bent.vtu", "-o", name, "--report", "report.json", "--force", "--quiet"))
    found = freecad("bracket.step", "bent.step", "bent.igs", "bent.brep")
    report = json.loads(pathlib.Path("report.json").read_text())
    wanted = found["bracket.step"][3] * report["volume_after"] / report["volume_before"]
    for name in ("bent.step", "bent.igs", "bent.brep"):
        valid, solids, closed, size, labels = found[name]
        expect(valid and solids == 1 and closed, f"{name}: {found[name]}")
        expect(abs(size / wanted - 1) < 1e-3, f"{name}: {size} mm^3, {wanted} by the triangles")
    expect(found["bent.step"][4] == found["bracket.step"][4] == ["bracket"], f"names: {found}")


def test_surfaces_of_one_closed_curve_keep_their_size():
    """A face bounded by one closed B-spline: its volume in CAD programs was a fifth too small in the STEP file."""
    need("freecadcmd")
    write("make.py", """import math, FreeCAD, Part
curve = Part.BSplineCurve()
at = [2 * math.pi * i / 12 for i in range(12)]
curve.interpolate([FreeCAD.Vector(20 * math.cos(a) * (1 + .3 * math.cos(3 * a)), 20 * math.sin(a) * (1 + .3 * math.cos(3 * a)), 0) for a in at], PeriodicFlag=True)
Part.Face(Part.Wire(curve.toShape())).extrude(FreeCAD.Vector(5, 0, 60)).exportStep("clover.step")
""")
    run("freecadcmd", "make.py")
    bent(part="clover.step", text='material = "pla"\n[[fix]]\nwhere = "zmin"\n[[move]]\nwhere = "zmax"\ndisplacement = ["8 mm", "0 mm", "0 mm"]\n')
    said = expect_ok(run("flexel-map", "bent.vtu", "-o", "bent.step", "--report", "report.json", "--strict")).err
    expect("valid, also when read again" in said, said)
    report = json.loads(pathlib.Path("report.json").read_text())
    size = freecad("bent.step")["bent.step"][3]
    expect(abs(size / 1e9 / report["volume_after"] - 1) < 3e-3, f"{size} mm^3, {1e9 * report['volume_after']} in triangles")


def test_a_pipe_carries_the_file():
    bracket()
    scene(text=BEND)
    expect_ok(shell("flexel-voxelize bracket.step --size 4mm --quiet | flexel-simulate scene.toml --no-estimate --quiet | flexel-map --format step --quiet > bent.step"))
    expect(len(faces("bent.step")) == 11, "faces")
    expect_ok(shell("flexel deform bracket.step --fix bracket/1 --push 'bracket/2: 0 0 -1000 N' --material pla --size 4mm -o one.step -o one.stl --quiet"))
    expect(len(faces("one.step")) == 11, "faces")


def test_what_moves_as_one_stays_a_plane():
    turned = 'material = "pla"\n[[move]]\nwhere = { box = { min = ["-1 m", "-1 m", "-1 m"], max = ["1 m", "1 m", "1 m"] } }\nrotation = { axis = [1, 2, 3], through = ["0 mm", "0 mm", "0 mm"], angle = "70 deg" }\n'
    bent(text=turned)
    said = expect_ok(run("flexel-map", "bent.vtu", "-o", "bent.step")).err
    expect("11 faces, all as before, moved; valid" in said, said)
    text = pathlib.Path("bent.step").read_text()
    expect(text.count("CYLINDRICAL_SURFACE") == 3 and text.count(" PLANE") >= 8 and "B_SPLINE_SURFACE" not in text, "surfaces")


def test_a_dent_smaller_than_the_face_is_in_the_file():
    """A spot of two cells on the seat, 66 cells long: it is no plane any more."""
    bracket("plain.step")
    scene(text="""material = "rubber"
[[fix]]
where = "bracket/7"
[[move]]
where = { box = { min = ["46 mm", "19 mm", "5.5 mm"], max = ["48 mm", "21 mm", "6.5 mm"] } }
displacement = ["0 mm", "0 mm", "-0.4 mm"]
""")
    expect_ok(run("flexel-voxelize", "plain.step", "--size", "1mm", "-o", "rest.vtu", "--quiet"))
    expect_ok(run("flexel-simulate", "scene.toml", "rest.vtu", "-o", "dent.vtu", "--no-estimate", "--quiet"))
    said = expect_ok(run("flexel-map", "dent.vtu", "-o", "dent.step", "--strict")).err
    kept = int(re.search(r"of 11 faces, (\d+) as before", said)[1])
    expect(kept < 10, said)
    expect_ok(run("flexel-voxelize", "dent.step", "--size", "3mm", "--deflection", "0.01mm", "-o", "again.vtu", "--quiet"))
    import meshio
    at = meshio.read("again.vtu").field_data["surface_vertices"].reshape(-1, 3)
    near = at[(abs(at[:, 0] - .047) < .004) & (abs(at[:, 1] - .02) < .004) & (at[:, 2] > .004)]
    expect(near[:, 2].min() < .006 - .0003, f"the dent is {1e3 * (.006 - near[:, 2].min())} mm deep")


def test_brep_in_other_units():
    bent(size="6mm")
    expect_ok(run("flexel-map", "bent.vtu", "-o", "bent.brep", "--quiet"))
    moved = 'material = "pla"\n[[fix]]\nwhere = "zmax"\n[[move]]\nwhere = "zmin"\ndisplacement = ["3 cm", "0 mm", "0 mm"]\n'
    scene(text=moved)
    expect_ok(run("flexel-voxelize", "bent.brep", "--unit", "cm", "--count", "1000", "-o", "rest.vtu", "--quiet"))
    expect_ok(run("flexel-simulate", "scene.toml", "rest.vtu", "-o", "big.vtu", "--no-estimate", "--quiet"))
    before = volume("bent.brep")
    for name in ("big.step", "big.iges"):
        expect_ok(run("flexel-map", "big.vtu", "-o", name, "--quiet"))
        found = volume(name)
        expect(abs(found / before / 1000 - 1) < 5e-3, f"{name}: {found}")
    expect_ok(run("flexel-map", "big.vtu", "-o", "big.brep", "--quiet"))
    expect(abs(volume("big.brep") / before - 1) < 5e-3, "BREP keeps its numbers")
    expect_error(run("flexel-map", "big.vtu", "-o", "x.brep", "--unit", "inch"), "flexel-map", "--unit")


def test_the_field_of_quadratic_cells():
    bracket()
    scene(text=BEND.replace('material', 'model = "quadratic"\nmaterial', 1).replace("-1000", "-100"))
    expect_ok(run("flexel-voxelize", "bracket.step", "--size", "6mm", "--moments", "-o", "rest.vtu", "--quiet"))
    expect_ok(run("flexel-simulate", "scene.toml", "rest.vtu", "-o", "bent.vtu", "--no-estimate", "--quiet"))
    said = expect_ok(run("flexel-map", "bent.vtu", "-o", "bent.step")).err
    expect("valid, also when read again" in said and "warning" not in said, said)
    expect([each[2] for each in faces("bent.step")] == [each[2] for each in faces("bracket.step")], "names")


def test_assemblies_keep_their_parts_and_colours():
    need_step()
    part = PARTS / "as1-oc-214.stp"
    if not part.exists():
        raise Skip("no real parts here")
    text = 'material = "steel"\n[[fix]]\nwhere = "plate/zmin"\n[[move]]\nwhere = "rod/xmax"\ndisplacement = ["0 mm", "8 mm", "0 mm"]\n'
    scene(text=text)
    expect_ok(run("flexel-voxelize", part, "--count", "1500", "-o", "rest.vtu", "--quiet"))
    expect_ok(run("flexel-simulate", "scene.toml", "rest.vtu", "-o", "bent.vtu", "--no-estimate", "--quiet"))
    said = expect_ok(run("flexel-map", "bent.vtu", "-o", "bent.step", "--tolerance", "1e-3")).err
    expect("18 solids of 160 faces" in said and "valid, also" in said, said)
    told = [info(step) for step in (part, "bent.step")]
    at_rest, names = (re.findall(r'^part "(.*)"', text, re.M) for text in told)
    expect(names == at_rest and len(at_rest) == 18, f"parts: {names}")
    tree_at_rest, tree = (text.split("parts in their assemblies\n")[1].split("\npart ")[0] for text in told)
    expect("  as1/\n    rod-assembly/\n      nut\n      nut-2\n      rod\n    l-bracket-assembly/\n      nut-bolt-assembly/" in tree_at_rest, tree_at_rest)
    expect(tree == tree_at_rest, f"the tree: {tree}")
    before, after = part.read_text(errors="replace"), pathlib.Path("bent.step").read_text(errors="replace")
    colours = lambda step: {tuple(round(float(each), 4) for each in rgb) for rgb in re.findall(r"COLOUR_RGB\('[^']*', *([\d.E+-]+), *([\d.E+-]+), *([\d.E+-]+)\)", step.replace("\n", ""))}
    expect(colours(before) <= colours(after), f"colours {colours(before)} {colours(after)}")
    for product in ("rod-assembly", "l-bracket-assembly", "nut-bolt-assembly"):
        expect(f"'{product}'" in after, f"the assembly {product} is lost")


def test_a_part_without_cad_faces_is_refused():
    body()
    for name in ("box.step", "box.igs", "box.brep"):
        expect_error(run("flexel-map", "body.vtu", "-o", name), "flexel-map", "has no CAD faces", "write a mesh")
    expect_only("body.vtu")


if __name__ == "__main__":
    main(globals())

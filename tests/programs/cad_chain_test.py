"""Assemblies in inches, metres and millimetres, of AP203, AP214 and AP242, with names, colours and layers (made by tests/programs/make_assembly.cpp, which has
nothing of ours): bent and written as STEP again, and read by gmsh, and by FreeCAD where it is installed."""

import json
import math
import pathlib
import re

from cad_output_test import freecad, volume_of_tetrahedra
from harness import expect, expect_ok, main, need, need_step, run, scene, write

SCHEMAS = {"AP203": "CONFIG_CONTROL_DESIGN", "AP214IS": "AUTOMOTIVE_DESIGN", "AP242DIS": "AP242_MANAGED_MODEL_BASED_3D_ENGINEERING"}
UNITS = {"INCH": "CONVERSION_BASED_UNIT('INCH'", "MM": "SI_UNIT(.MILLI.,.METRE.)", "M": "SI_UNIT($,.METRE.)"}  # an inch is defined by millimetres
BEND = """material = "rubber"
[[fix]]
where = "plate/xmin"
[[move]]
where = "plate/xmax"
displacement = ["0 mm", "0 mm", "9 mm"]
"""


def told_by_gmsh(step):
    """(paths of the solids by their names, numbers of uses left out; colours) as gmsh's importer tells them, sorted."""
    write("read.geo", f'SetFactory("OpenCASCADE"); Merge "{step}";\n')
    said = expect_ok(run("gmsh", "-", "read.geo", "-v", "6")).out.decode()
    paths = [re.sub(r"/\d+/", "/", path) for path in re.findall(r"Label 'Shapes/([^']*)' \(3D\)", said)]
    colours = set(re.findall(r"Color \((.*?)\) \((.*?)\)", said))
    return sorted(path for path in paths if path.startswith("clamp/")), sorted(colours)


def said_in(step):
    """What a STEP file says by itself: schema, unit, and how many faces are on each layer and have each name."""
    text = pathlib.Path(step).read_text().replace("\n", "")
    schema = re.search(r"FILE_SCHEMA\(\( *'(\w+)", text)[1]
    unit = next(name for name, word in UNITS.items() if word in text.replace(" ", ""))
    return schema, unit, set(re.findall(r"PRESENTATION_LAYER_ASSIGNMENT\('([^']*)'", text)), len(re.findall(r"ADVANCED_FACE\('seat'", text))


def chain(unit, schema):
    need_step()
    need("gmsh")
    expect_ok(run("make_assembly", "clamp.step", unit, schema))
    scene(text=BEND)
    expect_ok(run("flexel-voxelize", "clamp.step", "--size", "4 mm", "-o", "rest.vtu", "--quiet"))
    expect_ok(run("flexel-simulate", "scene.toml", "rest.vtu", "-o", "bent.vtu", "--no-estimate", "--quiet"))
    said = expect_ok(run("flexel-map", "bent.vtu", "-o", "bent.step", "--report", "report.json")).err
    expect("6 solids of" in said and "valid, also when read again" in said and "do not come along" not in said, said)
    before, after = said_in("clamp.step"), said_in("bent.step")
    expect(before[0].startswith(SCHEMAS[schema]) and before[1] == unit and before[2] == {"structure", "fasteners"} and before[3] == 1, f"{before}")
    expect(after == before, f"schema, unit, layers, faces called seat: {before} {after}")
    at_rest, tree = (expect_ok(run("flexel", "info", step)).out.decode().split("parts in their assemblies\n")[1].split("\npart ")[0]
                     for step in ("clamp.step", "bent.step"))
    expect(tree == at_rest and at_rest.count("bolt group") == 2, tree)
    before, after = told_by_gmsh("clamp.step"), told_by_gmsh("bent.step")
    expect(len(before[0]) == 6 and len(before[1]) >= 3, f"gmsh: {before}")
    expect(after == before, f"paths and colours in gmsh: {before} {after}")
    bent, report = volume_of_tetrahedra("bent.step"), json.loads(pathlib.Path("report.json").read_text())
    exact = 80 * 40 * 8 + 4 / 3 * math.pi * 1000 / 8 + 2 * math.pi * (16 * 20 + 49 * 2)
    expect(abs(1e9 * report["volume_before"] / exact - 1) < 5e-3, f"mm^3 at rest: {report} {exact}")
    expect(abs(1e-9 * bent / report["volume_after"] - 1) < 1e-3, f"volumes: {bent} {report}")


def test_inches_of_ap203():
    chain("INCH", "AP203")


def test_metres_of_ap214():
    chain("M", "AP214IS")


def test_millimetres_of_ap242():
    chain("MM", "AP242DIS")


def test_inches_of_ap242():
    """Read by FreeCAD too, where it is installed; without, it would be one unit and one schema of the others."""
    need("freecadcmd")
    chain("INCH", "AP242DIS")
    found = freecad("clamp.step", "bent.step")
    for valid, solids, closed, _, labels in found.values():
        expect(valid and solids == 6 and closed, f"{found}")
    expect(found["bent.step"][4] == found["clamp.step"][4], f"names: {found}")


if __name__ == "__main__":
    main(globals())

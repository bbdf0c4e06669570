"""samples/plugins in the tools that they are for, without a screen: Blender, FreeCAD, ParaView, meshio, PyVista."""

import os
import pathlib
import re
import sys

from harness import BIN, SOURCE, Skip, body, box, expect, expect_ok, main, need, need_step, run, write
from screen import screen

PLUGINS = SOURCE / "samples/plugins"
PATIENCE = 140  # s: other tests run beside these
# F l^3 / (3 E I) of a bar of 80 x 10 x 10 mm of the library's PLA (3.25 GPa) under 5 N [m]
SAG = 5 * 0.08**3 / (3 * 3.25e9 * 0.01**4 / 12)


def on_path(**more):
    return {**os.environ, "PATH": f"{BIN}:{os.environ['PATH']}", **more}


def expect_sag(found, where):
    expect(abs(found / SAG - 1) < 0.1, f"{where}: {found} m, a beam sags {SAG} m")


BLENDER = """
import os, sys
import bpy, bmesh
sys.path.insert(0, {plugins!r})
import blender_flexel
def bar_in(scene):
    mesh = bpy.data.meshes.new("bar")
    bar = bpy.data.objects.new("bar", mesh)
    scene.collection.objects.link(bar)
    cells = bmesh.new()
    bmesh.ops.create_cube(cells, size=1)
    bmesh.ops.subdivide_edges(cells, edges=cells.edges[:], cuts=8, use_grid_fill=True)
    cells.to_mesh(mesh)
    bar.scale = (0.08, 0.01, 0.01)
    for name, x in (("root", -0.5), ("tip", 0.5)):
        bar.vertex_groups.new(name=name).add([v.index for v in mesh.vertices if abs(v.co.x - x) < 1e-6], 1, "ADD")
    settings = scene.flexel
    settings.held, settings.pushed, settings.force, settings.size = "root", "tip", (0, 0, -5), "2.5 mm"
    return mesh, bar, settings
"""
BLENDER_BATCH = BLENDER + """
bpy.ops.wm.read_factory_settings(use_empty=True)
blender_flexel.register()
scene = bpy.context.scene
mesh, bar, settings = bar_in(scene)
bpy.context.view_layer.objects.active = bar
# Metres; millimetres, turned; mirrored.
for unit, scale, turn in ((1, (0.08, 0.01, 0.01), 0), (0.001, (80, 10, 10), 0.7), (1, (0.08, -0.01, 0.01), 0)):
    scene.unit_settings.scale_length, bar.scale, bar.rotation_euler.z = unit, scale, turn
    bpy.context.view_layer.update()
    assert bpy.ops.object.flexel_deform() == {{"FINISHED"}}
    key, rest = mesh.shape_keys.key_blocks["Flexel"], mesh.shape_keys.reference_key
    moved = [(bar.matrix_world @ p.co - bar.matrix_world @ v.co).z * unit for p, v in zip(key.data, rest.data)]
    held = [moved[v.index] for v in mesh.vertices if v.co.x < -0.49]
    print("FOUND", -min(moved), max(map(abs, held)), len(mesh.shape_keys.key_blocks))
for name in ("nothing", "root"):
    settings.pushed = name
    try:
        bpy.ops.object.flexel_deform()
    except RuntimeError as error:
        print("REFUSED", str(error).strip())
settings.pushed, settings.material = "tip", "cheese"
try:
    bpy.ops.object.flexel_deform()
except RuntimeError as error:
    print("REFUSED", str(error).strip())
settings.material = "PLA"
take_result = blender_flexel.take_result
def take_edited(*given):
    mesh.shape_keys.reference_key.data[0].co.x += 0.1
    return take_result(*given)
blender_flexel.take_result = take_edited
try:
    bpy.ops.object.flexel_deform()
except RuntimeError as error:
    print("REFUSED", str(error).strip())
"""


# The panel's button: the run goes on beside Blender until it is done, and the object is moved meanwhile.
BLENDER_WINDOW = BLENDER + """
blender_flexel.register()
def begin():
    window = bpy.context.window_manager.windows[0]
    area = next(each for each in window.screen.areas if each.type == "VIEW_3D")
    mesh, bar, settings = bar_in(window.scene)
    with bpy.context.temp_override(window=window, area=area, object=bar, active_object=bar):
        print("BEGUN", bpy.ops.object.flexel_deform("INVOKE_DEFAULT"), flush=True)
    bar.location, bar.rotation_euler.x, bar.scale.z = (0, 0, 1), 0.5, 0.02
    window.view_layer.update()
    print("MOVED", bar.matrix_world.translation.z, flush=True)
    def end():
        if mesh.shape_keys is None:
            return 0.2
        moved = [p.co.z * 0.01 - v.co.z * 0.01 for p, v in zip(mesh.shape_keys.key_blocks["Flexel"].data, mesh.vertices)]
        print("FOUND", -min(moved), flush=True)
        os._exit(0)
    bpy.app.timers.register(end)
bpy.app.timers.register(begin, first_interval=0.5)
"""


def test_blender_window():
    need("blender")
    write("drive.py", BLENDER_WINDOW.format(plugins=str(PLUGINS)))
    with screen() as shown:
        said = run("blender", "--factory-startup", "--python", os.path.abspath("drive.py"), timeout=PATIENCE,
                   env=on_path(HOME=os.getcwd(), **shown))
    text = said.out.decode()
    expect("BEGUN {'RUNNING_MODAL'}" in text and "MOVED 1.0" in text and "FOUND" in text, f"{said}\n{text}")
    expect_sag(float(re.search(r"FOUND (\S+)", text)[1]), "Blender")


def test_blender():
    need("blender")
    write("drive.py", BLENDER_BATCH.format(plugins=str(PLUGINS)))
    said = run("blender", "-b", "--factory-startup", "--python-exit-code", "3", "--python", os.path.abspath("drive.py"), timeout=PATIENCE, env=on_path())
    text = said.out.decode()
    expect(said.code == 0, f"{said}\n{text}")
    found = [tuple(map(float, line.split()[1:])) for line in text.splitlines() if line.startswith("FOUND")]
    expect(len(found) == 3, text)
    for sag, held, keys in found:
        expect_sag(sag, "Blender")
        expect(held < 0.01 * SAG and keys == 2, f"the held end moves {held} m; {keys} shape keys")
    refused = [line for line in text.splitlines() if line.startswith("REFUSED")]
    expect(len(refused) == 4 and 'no vertex group "nothing"' in refused[0] and "all of its faces are held" in refused[1]
           and "cheese" in refused[2] and "the mesh has changed meanwhile" in refused[3], text)


FREECAD = """
import importlib.machinery, importlib.util, os, traceback
import FreeCAD, Part
loader = importlib.machinery.SourceFileLoader("flexel_macro", {macro!r})
macro = importlib.util.module_from_spec(importlib.util.spec_from_loader("flexel_macro", loader))
loader.exec_module(macro)
document = FreeCAD.newDocument("bars")
bar = document.addObject("Part::Box", "bar")
bar.Length, bar.Width, bar.Height = 80, 10, 10
bar.Placement = FreeCAD.Placement(FreeCAD.Vector(5, 6, 7), FreeCAD.Rotation(FreeCAD.Vector(0, 0, 1), 90))
hole = document.addObject("Part::Cylinder", "hole")
hole.Radius, hole.Height, hole.Placement.Base = 1, 10, FreeCAD.Vector(0, 45, 7)
cut = document.addObject("Part::Cut", "cut")
cut.Base, cut.Tool = bar, hole
document.recompute()
def faces_at(y):
    return ["Face" + str(n + 1) for n, face in enumerate(cut.Shape.Faces) if abs(face.CenterOfMass.y - y) < 1e-6 and face.Area > 90 and face.Area < 110]
try:
{rest}
except BaseException:
    traceback.print_exc()
    print("FAILED", flush=True)
"""
FREECAD_BEND = """
    bent = macro.bend(cut, faces_at(6), faces_at(86), "0 0 -5 N", "PLA", "2.5 mm")
    print("FOUND", bent.Shape.isValid(), len(cut.Shape.Faces), len(bent.Shape.Faces), len(bent.Shape.Solids),
          (cut.Shape.BoundBox.ZMin - bent.Shape.BoundBox.ZMin) / 1000, abs(bent.Shape.BoundBox.YMin - 6) / 1000)
    for given in ((["Face1"], []), (["Face1"], ["Face99"]), (["Face1"], ["Face2"], "12"), (["Face1"], ["Face2"], "0 0 -1 N", "cheese")):
        try:
            macro.bend(cut, *given)
        except macro.FlexelError as error:
            print("REFUSED", error)
    print("END", flush=True)
"""
FREECAD_SELECT = """
    import FreeCADGui
    from PySide2 import QtWidgets
    for name in faces_at(6) + faces_at(86):
        FreeCADGui.Selection.addSelection(cut, name)
    QtWidgets.QInputDialog.getText = staticmethod(lambda *given, **more: ("0 0 -5 N; PLA; 2.5 mm", True))
    QtWidgets.QMessageBox.warning = staticmethod(lambda *given: print("WARNED", given[2]))
    macro.ask()
    print("FOUND", FreeCADGui.Selection.getSelection()[0].Label, (cut.Shape.BoundBox.ZMin - document.Objects[-1].Shape.BoundBox.ZMin) / 1000)
    FreeCADGui.Selection.clearSelection()
    macro.ask()
    print("END", flush=True)
    os._exit(0)
"""


def freecad(program, rest, **shown):
    write("drive.py", FREECAD.format(macro=str(PLUGINS / "flexel.FCMacro"), rest=rest))
    done = run(program, "drive.py", timeout=PATIENCE, env=on_path(QTWEBENGINE_DISABLE_SANDBOX="1", HOME=os.getcwd(), **shown))
    text = done.out.decode(errors="replace")
    expect("FAILED" not in text and "END" in text, f"{done}\n{text}")
    return text


def test_freecad():
    need_step()
    need("freecadcmd")
    text = freecad("freecadcmd", FREECAD_BEND)
    valid, before, after, solids, sag, held = re.search(r"FOUND (\w+) (\d+) (\d+) (\d) (\S+) (\S+)", text).groups()
    expect((valid, before, after, solids) == ("True", "7", "7", "1"), text)
    expect_sag(float(sag), "FreeCAD")
    expect(float(held) < 0.01 * SAG, text)
    refused = re.findall("REFUSED (.*)", text)
    expect(len(refused) == 4 and "select the face" in refused[0] and "Face99" in refused[1] and "no force" in refused[2]
           and "cheese" in refused[3], text)


def test_freecad_selection():
    """The macro as its user has it, on a screen that nobody sees."""
    need_step()
    need("freecad")
    with screen() as shown:
        text = freecad("freecad", FREECAD_SELECT, **shown)
    label, sag = re.search(r"FOUND (.*) (\S+)", text).groups()
    expect(label == "cut, bent", text)
    expect_sag(float(sag), "FreeCAD")
    expect("WARNED select faces of one solid" in text, text)


def test_paraview():
    need("pvpython")
    body()
    write("scene.toml", 'material = "steel"\n[[fix]]\nwhere = "xmin"\n[[load]]\nwhere = "xmax"\nforce = ["100 N", "0 N", "0 N"]\n')
    expect_ok(run("flexel-simulate", "scene.toml", "body.vtu", "-o", "bent.vtu"))
    show = ["pvpython", PLUGINS / "paraview_show.py", "bent.vtu"]
    with screen() as shown:
        text = expect_ok(run(*show, "von_mises", "bent.png", timeout=PATIENCE, env=on_path(**shown))).out.decode()
        failed = run(*show, "taste", "bent.png", timeout=PATIENCE, env=on_path(**shown))
    low, high = map(float, re.search(r"von_mises: (\S+) to (\S+)", text).groups())
    expect(0 < low < 1e6 < high, f"100 N on 100 mm2 are 1 MPa: {text}")
    expect(pathlib.Path("bent.png").read_bytes()[:4] == b"\x89PNG", "no picture")
    expect(failed.code == 1 and "von_mises" in failed.err, f"{failed}")


NOT_IN_DEBIAN = {"pyvista": ": Debian 12 has no package of it (pip install pyvista)"}


def python_module(*names):
    if os.environ.get("FLEXEL_HAS_PYTHON") != "ON":
        raise Skip("built without the Python module")
    for name in names:
        try:
            __import__(name)
        except ImportError:
            raise Skip(f"{name} is not installed{NOT_IN_DEBIAN.get(name, '')}") from None


def test_python_of_the_page():
    """The page's blocks, in order."""
    python_module("meshio", "numpy")
    page = (SOURCE / "docs/guide/other-tools.md").read_text(encoding="utf-8")
    found = re.findall(r"^```python\n(.*?)^```$", page, re.M | re.S)
    expect(found, "the page has no python block")
    text = expect_ok(run(sys.executable, "-c", "\n".join(found))).out.decode()
    expect(float(text) > 1e5, text)
    import meshio

    expect("triangle" in meshio.read("bent.stl").cells_dict and pathlib.Path("lattice.inp").stat().st_size > 0, "no mesh")


def test_pyvista():
    python_module("numpy", "meshio", "pyvista")
    box()
    with screen() as shown:
        text = expect_ok(run(sys.executable, PLUGINS / "pyvista_show.py", "box.stl", "bent.png", timeout=PATIENCE, env=on_path(**shown))).out.decode()
    expect(re.search(r"\d+ vertices, \d+ cells, [0-9.]+ mm", text), text)
    expect(pathlib.Path("bent.png").read_bytes()[:4] == b"\x89PNG", "no picture")


def test_pyvista_of_the_page():
    """The page's lines, each into a picture."""
    python_module("numpy", "meshio", "pyvista")
    page = (SOURCE / "docs/guide/other-tools.md").read_text(encoding="utf-8")
    lines = re.search(r"^## PyVista$.*?^```text\n(.*?)^```$", page, re.M | re.S)[1].splitlines()
    expect(lines and all(line.count(".plot(") == 1 for line in lines), lines)
    box()
    code = ["import flexel, pyvista", "pyvista.OFF_SCREEN = True",
            'result = flexel.deform("box.stl", fix="xmin", push={"xmax": (0, 0, -100)}, material="PLA", size="2.5 mm", output="body.vtu")']
    code += [line.replace(".plot(", f".plot(screenshot='{number}.png', ") for number, line in enumerate(lines)]
    with screen() as shown:
        expect_ok(run(sys.executable, "-c", "\n".join(code), timeout=PATIENCE, env=on_path(**shown)))
    for number, line in enumerate(lines):
        expect(pathlib.Path(f"{number}.png").read_bytes()[:4] == b"\x89PNG", line)


if __name__ == "__main__":
    main(globals())

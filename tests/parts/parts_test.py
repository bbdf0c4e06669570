"""Every closed real part through the whole chain at an affordable size: it is held at one end and loaded at the other. The mesh
that comes out has the same vertices and faces in the same order, all finite; without a load it is the one that went in.

The parts are those of ../shared/parts; without them the tests are skipped.
"""

import json
import os
import sys

import numpy as np
from harness import PARTS, SOURCE, Skip, expect, expect_ok, main, need_step, run, scene

sys.path.insert(0, str(SOURCE / "tests/interop"))
from files import any_stl_triangles, obj_parts  # noqa: E402

# Held at the lowest tenth of its longest axis and drawn sideways at the highest tenth: half-spaces, so that it works for any shape.
HOLD_AND_DRAW = """material = "PLA"
[[fix]]
where = {{ half_space = {{ point = [{low}], normal = [{down}] }} }}
[[load]]
where = {{ half_space = {{ point = [{high}], normal = [{up}] }} }}
force = [{force}]
"""

PRESSURE = 1e3  # Pa over the square of the longest side: a thin plate of PLA folds up under it, and still has an equilibrium


def bounding_box(name, unit):
    """Corners in metres of the part that `flexel-map` writes for the lattice at rest."""
    points = any_stl_triangles(name).reshape(-1, 3) if name.endswith(".stl") else obj_parts(name)[0]
    return points.min(axis=0) * unit, points.max(axis=0) * unit


def vector(values, unit=""):
    return ", ".join(f'"{value:.9g} {unit}"' if unit else f"{value:.9g}" for value in values)


def hold_and_draw(low, high, parts):
    """A scene for the part between `low` and `high`; where it has several solids, one for each by its first two faces."""
    if parts:
        sides = "[[fix]]\nwhere = \"{0}/1\"\n[[load]]\nwhere = \"{0}/2\"\nforce = [\"0 N\", \"0 N\", \"-1 N\"]\n"
        return scene("draw.toml", 'material = "PLA"\n' + "".join(sides.format(part) for part in parts))
    along = int(np.argmax(high - low))
    axis = np.eye(3)[along]
    side = np.eye(3)[(along + 1) % 3]
    size = float((high - low)[along])
    text = HOLD_AND_DRAW.format(low=vector(low + 0.1 * size * axis, "m"), down=vector(-axis), high=vector(low + 0.9 * size * axis, "m"),
                                up=vector(axis), force=vector(PRESSURE * size**2 * side, "N"))
    return scene("draw.toml", text)


def through_the_chain(file, count, unit="mm", metres=1e-3, parts=()):
    part = PARTS / file
    if not part.exists():
        raise Skip(f"{part} is not here")
    mesh = "obj" if file.lower().endswith(".obj") else "stl"
    step = file.lower().endswith((".step", ".stp"))
    if step:
        need_step()
    options = [] if step else ["--unit", unit]
    expect_ok(run("flexel-voxelize", part, "--count", count, *options, "-o", "rest.vtu", "--quiet"))
    expect_ok(run("flexel-map", "rest.vtu", "-o", f"rest.{mesh}", "--quiet"))
    low, high = bounding_box(f"rest.{mesh}", metres)
    expect_ok(run("flexel-simulate", hold_and_draw(low, high, parts), "rest.vtu", "-o", "bent.vtu", "--summary", "summary.json", timeout=280))
    expect_ok(run("flexel-map", "bent.vtu", "--keep-vertices", "-o", f"bent.{mesh}", "--report", "report.json"))
    diagonal = float(np.linalg.norm(high - low)) / metres
    same_mesh(part, mesh, step, diagonal)
    with open("report.json", encoding="utf-8") as text:
        report = json.load(text)
    print(f"{file}: {os.path.getsize(f'bent.{mesh}')} bytes, report {report}")


TURNED = {"multibody.stl"}  # inside out: comes out facing outward


def same_mesh(part, mesh, step, diagonal):
    """The input (where it is a mesh), the round trip without a load, and the bent part have the same vertices in the same order."""
    if mesh == "obj":
        before, faces = obj_parts(part)
        rest, rest_faces = obj_parts("rest.obj")
        bent, bent_faces = obj_parts("bent.obj")
        expect(faces == rest_faces == bent_faces, "faces were changed or reordered")
        tolerance = 1e-9 * diagonal
    else:
        rest, bent = any_stl_triangles("rest.stl"), any_stl_triangles("bent.stl")
        before = rest if step else any_stl_triangles(part)
        if os.path.basename(part) in TURNED and before.shape == rest.shape:  # a turned triangle keeps its first corner
            turned = np.abs(rest - before).max(axis=(1, 2)) > np.abs(rest - before[:, [0, 2, 1]]).max(axis=(1, 2))
            expect(turned.any(), "no triangle was turned")
            before = np.where(turned[:, None, None], before[:, [0, 2, 1]], before)
        # An STL holds single precision, and so does what comes out: the nearest such number is the best there is.
        tolerance = 1e-9 * diagonal + 0.5 * np.spacing(np.abs(rest).astype(np.float32)).max()
    expect(before.shape == rest.shape == bent.shape, f"{before.shape} became {rest.shape} at rest and {bent.shape} bent")
    expect(np.isfinite(bent).all(), "not finite")
    expect(np.abs(rest - before).max() <= tolerance, f"at rest vertices moved by {np.abs(rest - before).max()} of {diagonal}")
    moved = np.abs(bent - rest).max()
    expect(1e-7 * diagonal < moved, f"the load moved no vertex: {moved} of {diagonal}")


def test_4040_base_mount_step():
    through_the_chain("4040_base_mount.step", 8000)


def test_base_interface_step():
    through_the_chain("base_interface_AP203.STEP", 3000)


def test_featuretype_step():
    through_the_chain("featuretype.STEP", 8000)


def test_moving_jaw_step():
    through_the_chain("Moving_Jaw_SO101.step", 8000)


def test_red_cube_blue_cylinder_step():
    through_the_chain("red_cube_blue_cylinder.step", 5000, parts=["red_cube", "blue_cylinder"])


def test_lower_leg_structure_fork_step():
    through_the_chain("lower_leg_structure_fork.STEP", 8000)


def test_lower_leg_structure_fork_stl():
    through_the_chain("lower_leg_structure_fork.STL", 8000)


def test_lower_leg_structure_200mm_stl():
    through_the_chain("lower_leg_structure_200mm.STL", 8000)


def test_conrod_stl():
    through_the_chain("conrod.stl", 8000, "inch", 0.0254)


def test_transmission_pulley_stl():
    through_the_chain("transmission_pulley_at3_t30_output.STL", 8000)


def test_hip_cover_stl():
    through_the_chain("hip_aa_module_shell_cover.STL", 8000)


def test_springy_trigger_stl():
    through_the_chain("Springy_Trigger.STL", 8000)


def test_hook_stl():
    through_the_chain("hook.stl", 8000)


def test_inertial_sensor_stl():
    through_the_chain("ADIS16480.STL", 8000, "m", 1.0)


def test_multibody_stl():
    through_the_chain("multibody.stl", 5000, "inch", 0.0254, ["bodyA", "bodyB"])


def test_yarn_guide_stl():
    through_the_chain("yarn_guide.stl", 5000)


def test_spot_triangles_obj():
    through_the_chain("spot_triangulated.obj", 5000, "m", 1.0)


def test_spot_quads_obj():
    through_the_chain("spot_quadrangulated.obj", 5000, "m", 1.0)


def test_quadknot_obj():
    through_the_chain("quadknot.obj", 8000)


def test_rabbit_obj():
    through_the_chain("rabbit.obj", 5000, "cm", 0.01)


if __name__ == "__main__":
    main(globals())

#!/usr/bin/python3
"""Flexel beside CalculiX on the same parts: error, error bar, seconds, memory.

    PATH=build/release/bin:$PATH bench/accuracy/calculix.py [--quick] [--parts DIR] [--list] [CASE...]

Each part is made by gmsh (OpenCASCADE) or is a STEP file of ../shared/parts (left out, and said so, where that folder is not there; it is held
and drawn by 10 N along (1, 1, 1) at the flat faces at the two ends of its longest side). CalculiX gets its mesh of quadratic
tetrahedra (C3D10) at three sizes, of a STEP file with curved edges but where those fold an element; Flexel the STEP file at two spacings, in model quadratic at
four times and twice the coarser of them, both
one thread and the same faces, material and load. What is compared is the mean displacement of a face, or that of a point. The
reference is Lame's solution for the tube, reference.py's for the L-bracket and the STEP files, otherwise CalculiX's three values extrapolated (Aitken),
or the finest where they do not approach a limit. Seconds are the processor's, which other jobs change little, and hold everything from the file with the part or mesh
to the result; those of gmsh's meshing stand beside CalculiX's. --quick leaves out the finest mesh and spacing. Needs ccx and gmsh (tools/setup --tests).
"""

import json
import math
import os
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

from end_faces import end_faces
from gmsh_mesh import Mesh, cad_face, cylinder, measured, plane


def turned(angles):
    """Rotation about x, then about z [deg]."""
    x, z = np.radians(angles)
    about_x = np.array([[1, 0, 0], [0, math.cos(x), -math.sin(x)], [0, math.sin(x), math.cos(x)]])
    about_z = np.array([[math.cos(z), -math.sin(z), 0], [math.sin(z), math.cos(z), 0], [0, 0, 1]])
    return about_z @ about_x


class Case:
    """Lengths in mm before `turn`. faces: name -> (triangles of it, its middle). fix: [(face, axes)]. load: (face, kind, value), N, N m or
    MPa. asked: a face, or a point. align: Flexel's lattice to the part or not. step: the part's file, where it has one; `geometry` then
    merges it."""

    def __init__(self, geometry, faces, fix, load, asked, sizes, spacings, poisson=0.3, turn=None, reference=None, align="snap", step=None):
        self.geometry, self.faces, self.fix, self.load, self.asked = geometry, faces, fix, load, asked
        self.sizes, self.spacings, self.poisson, self.reference = sizes, spacings, poisson, reference
        self.angles, self.align, self.step = turn, align, step
        self.turn = turned(turn) if turn else np.eye(3)


YOUNG = 210e3  # MPa


def beam(poisson, turn=None, align="snap"):
    faces = {"held": (plane(0, 0), (0, 12.5, 12.5)), "end": (plane(0, 100), (100, 12.5, 12.5))}
    return Case("Box(1) = {0, 0, 0, 100, 25, 25};", faces, [("held", "xyz")], ("end", "force", (0, 0, -1000)), "end",
                (12.5, 8, 5), (25 / 4, 25 / 8), poisson, turn, align=align)


BRACKET, FORK, FEATURETYPE = 15.97e-3, 6.56e-3, 0.3324e-3  # mm, limits that reference.py prints


def bracket():
    geometry = """Box(1) = {0, 0, 0, 8, 40, 60}; Box(2) = {0, 0, 0, 60, 40, 8}; Cylinder(3) = {-1, 20, 40, 20, 0, 0, 6};
BooleanUnion(4) = { Volume{1}; Delete; }{ Volume{2}; Delete; };
BooleanDifference(5) = { Volume{4}; Delete; }{ Volume{3}; Delete; };"""
    faces = {"held": (plane(0, 0), (0, 20, 30)), "end": (plane(0, 60), (60, 20, 4))}
    return Case(geometry, faces, [("held", "xyz")], ("end", "force", (0, 0, -100)), "end", (5, 3.5, 2.5), (2, 1),
                reference=BRACKET)


def plate():
    geometry = """Box(1) = {0, 0, 0, 100, 50, 5}; Cylinder(2) = {50, 25, -1, 0, 0, 7, 10};
BooleanDifference(3) = { Volume{1}; Delete; }{ Volume{2}; Delete; };"""
    faces = {"held": (plane(0, 0), (0, 25, 2.5)), "end": (plane(0, 100), (100, 25, 2.5))}
    return Case(geometry, faces, [("held", "xyz")], ("end", "force", (5000, 0, 0)), "end", (6, 4, 2.5), (2.5, 1.25))


def torsion():
    faces = {"held": (plane(0, 0), (0, 10, 10)), "end": (plane(0, 100), (100, 10, 10))}
    return Case("Box(1) = {0, 0, 0, 100, 20, 20};", faces, [("held", "xyz")], ("end", "torque", (50, 0, 0)), (100, 20, 20),
                (10, 6, 4), (5, 2.5))


def clamped_plate():
    """Square, held on its four sides and pressed on its face: two cells thick at the coarser spacing."""
    sides = {"west": (plane(0, 0), (0, 50, 2.5)), "east": (plane(0, 100), (100, 50, 2.5)), "south": (plane(1, 0), (50, 0, 2.5)), "north": (plane(1, 100), (50, 100, 2.5))}
    faces = {**sides, "above": (plane(2, 5), (50, 50, 5))}
    return Case("Box(1) = {0, 0, 0, 100, 100, 5};", faces, [(side, "xyz") for side in sides], ("above", "force", (0, 0, -1000)), "above", (8, 5, 3.5), (2.5, 1.25))


def channel(load):
    """Walls of 2 mm, two cells at the coarser spacing; `load` at its end."""
    geometry = """Box(1) = {0, 0, 0, 100, 20, 20}; Box(2) = {-1, 2, 2, 102, 16, 19};
BooleanDifference(3) = { Volume{1}; Delete; }{ Volume{2}; Delete; };"""
    middle = (40 * 1 + 72 * 11) / 112  # of the section, above its web
    faces = {"held": (plane(0, 0), (0, 10, middle)), "end": (plane(0, 100), (100, 10, middle))}
    return Case(geometry, faces, [("held", "xyz")], load, "end" if load[1] == "force" else (100, 20, 20), (4, 2.8, 2), (1, 0.5))


def tube():
    geometry = """Cylinder(1) = {0, 0, 0, 0, 0, 4, 40, Pi/2}; Cylinder(2) = {0, 0, 0, 0, 0, 4, 20, Pi/2};
BooleanDifference(3) = { Volume{1}; Delete; }{ Volume{2}; Delete; };"""
    middle = 2 / math.pi * 20
    faces = {"inner": (cylinder(20), (middle, middle, 2)), "along": (plane(1, 0), (30, 0, 2)), "across": (plane(0, 0), (0, 30, 2)),
             "low": (plane(2, 0), (19.8, 19.8, 0)), "high": (plane(2, 4), (19.8, 19.8, 4))}
    nu, a, b, p = 0.3, 20, 40, 10
    radial = (1 + nu) * p * a * a / (YOUNG * (b * b - a * a)) * ((1 - 2 * nu) * a + b * b / a)
    return Case(geometry, faces, [("along", "y"), ("across", "x"), ("low", "z"), ("high", "z")], ("inner", "pressure", p), "inner",
                (6, 4, 2.5), (2, 1), nu, reference=radial * 2 * math.sqrt(2) / math.pi)


PARTS = pathlib.Path(__file__).resolve().parents[2] / "../shared/parts"


def real_part(name, sizes, spacings, reference):
    """A STEP part, held and drawn at its ends."""
    step = PARTS / name
    if not step.exists():
        return None
    solid = solid_of(step)
    faces = {each: (cad_face(face), 1e3 * np.array(face["centroid"])) for each, face in zip(("held", "end"), end_faces(solid))}
    force = (10 / math.sqrt(3),) * 3
    return Case(f'Merge "{step.resolve()}";', faces, [("held", "xyz")], ("end", "force", force), "end", sizes, spacings, reference=reference,
                step=step)


CASES = {
    "beam": lambda: beam(0.3),
    "beam, nu 0": lambda: beam(0.0),
    "beam, nu 0.25": lambda: beam(0.25),
    "beam, nu 0.45": lambda: beam(0.45),
    "beam, nu 0.49": lambda: beam(0.49),
    "beam turned": lambda: beam(0.3, (30, 30)),
    "beam turned, lattice not": lambda: beam(0.3, (30, 30), "none"),
    "L-bracket with a hole": bracket,
    "plate with a hole": plate,
    "bar twisted": torsion,
    "plate clamped": clamped_plate,
    "channel bent": lambda: channel(("end", "force", (0, 0, -10))),
    "channel twisted": lambda: channel(("end", "torque", (0.2, 0, 0))),
    "thick tube": tube,
    "fork (STEP)": lambda: real_part("lower_leg_structure_fork.STEP", (2, 1.4, 1), (0.5, 0.25), FORK),
    "featuretype (STEP)": lambda: real_part("featuretype.STEP", (8, 5.5, 4), (2, 1.4), FEATURETYPE),
}


# CalculiX


def nodal_loads(case, mesh):
    face, kind, value = case.load
    triangles = mesh.triangles_on(case.faces[face][0])
    weights = mesh.weights(triangles)
    if kind == "force":
        return weights[:, None] / weights.sum() * np.array(value, float)
    if kind == "torque":
        middle = (weights[:, None] * mesh.rest).sum(axis=0) / weights.sum()
        arm = mesh.rest - middle
        inertia = sum(w * (r @ r * np.eye(3) - np.outer(r, r)) for w, r in zip(weights, arm) if w > 0)
        return weights[:, None] * np.cross(np.linalg.solve(inertia, 1000 * np.array(value, float)), arm)
    area = mesh.areas(triangles)
    centre = mesh.rest[triangles[:, :3]].mean(axis=1)
    inward = np.einsum("ij,ij->i", area[:, :2], centre[:, :2]) < 0  # the tube's outward normal there looks to its axis
    area[~inward] *= -1
    forces = np.zeros_like(mesh.points)
    for i in range(3, 6):
        np.add.at(forces, triangles[:, i], -value * area / 3)
    return forces


def calculix(case, folder, size):
    mesh = Mesh(case, folder, size)
    forces = nodal_loads(case, mesh) @ case.turn.T
    with open(folder / "job.inp", "w", encoding="utf-8") as out:
        out.write("*NODE, NSET=ALL\n")
        for i, point in enumerate(mesh.points):
            out.write(f"{i + 1},{point[0]:.12g},{point[1]:.12g},{point[2]:.12g}\n")
        out.write("*ELEMENT, TYPE=C3D10, ELSET=E\n")
        for i, solid in enumerate(mesh.solids):
            out.write(f"{i + 1}," + ",".join(str(mesh.place[node] + 1) for node in solid) + "\n")
        out.write(f"*MATERIAL,NAME=M\n*ELASTIC\n{YOUNG},{case.poisson}\n*SOLID SECTION,ELSET=E,MATERIAL=M\n*BOUNDARY\n")
        for face, axes in case.fix:
            for i in np.unique(mesh.triangles_on(case.faces[face][0])):
                for axis in axes:
                    out.write(f"{i + 1},{'xyz'.index(axis) + 1},{'xyz'.index(axis) + 1}\n")
        out.write("*STEP\n*STATIC\n*CLOAD\n")
        for i, axis in zip(*np.nonzero(forces)):
            out.write(f"{i + 1},{axis + 1},{forces[i, axis]:.12g}\n")
        out.write("*NODE PRINT, NSET=ALL\nU\n*END STEP\n")
    seconds, memory = measured(["ccx", folder / "job"], cwd=folder, env={**os.environ, "OMP_NUM_THREADS": "1"})
    moved = np.zeros_like(mesh.points)
    for line in (folder / "job.dat").read_text().splitlines():
        row = line.split()
        if len(row) == 4 and row[0].isdigit():
            moved[int(row[0]) - 1] = [float(value) for value in row[1:]]
    if isinstance(case.asked, str):
        weights = mesh.weights(mesh.triangles_on(case.faces[case.asked][0]))
        mean = (weights[:, None] * moved).sum(axis=0) / weights.sum()
    else:
        mean = moved[np.argmin(np.linalg.norm(mesh.rest - np.array(case.asked, float), axis=1))]
    held = sum(len(np.unique(mesh.triangles_on(case.faces[face][0]))) * len(axes) for face, axes in case.fix)
    return np.linalg.norm(mean), seconds, memory, len(mesh.solids), mesh.seconds, 3 * len(mesh.points) - held


# Flexel


def solid_of(step):
    """The only part of a STEP file, as `flexel info` has it."""
    info = json.loads(subprocess.run(["flexel", "info", step, "--json"], check=True, capture_output=True, text=True).stdout)
    (solid,) = info["files"][0]["parts"]
    return solid


def face_names(case, step):
    """The faces of the part as Flexel numbers them, by their middles."""
    faces = solid_of(step)["faces"]
    return {name: min(faces, key=lambda face, at=case.turn @ np.array(middle, float): np.linalg.norm(1e3 * np.array(face["centroid"]) - at))["selection"]
            for name, (_, middle) in case.faces.items()}


def quantities(vector, unit):
    return "[" + ", ".join(f'"{value:.15g} {unit}"' for value in vector) + "]"


def flexel(case, folder, spacing, model="cells"):
    step = case.step or folder / "part.step"
    if not step.exists():
        geo = (folder / "part.geo").read_text() + 'Save "part.step";\n'
        (folder / "export.geo").write_text(geo)
        subprocess.run(["gmsh", "export.geo", "-0", "-v", "1"], check=True, cwd=folder, stdout=subprocess.DEVNULL)
    names = face_names(case, step)
    face, kind, value = case.load
    vector = None if kind == "pressure" else case.turn @ np.array(value, float)
    load = {"force": lambda: f"force = {quantities(vector, 'N')}", "torque": lambda: f"torque = {quantities(vector, 'N m')}",
            "pressure": lambda: f'pressure = "{value} MPa"'}[kind]()
    asked = f'where = "{names[case.asked]}"' if isinstance(case.asked, str) else f"at = {quantities(case.turn @ case.asked, 'mm')}"
    scene = folder / "scene.toml"
    scene.write_text(f"""material = "it"
model = "{model}"
[materials.it]
young = "{YOUNG} MPa"
poisson = {case.poisson}
density = "7850 kg/m3"
""" + "".join(f'[[fix]]\nwhere = "{names[each]}"\naxes = "{axes}"\n' for each, axes in case.fix) + f"""[[load]]
where = "{names[face]}"
{load}
[[probe]]
name = "asked"
{asked}
""")
    body = folder / "body.vtu"
    first, memory = measured(["flexel-voxelize", step, "--size", f"{spacing} mm", "--align", case.align, "-o", body,
                              "--threads", "1", *(["--moments"] if model == "quadratic" else [])])
    second, more = measured(["flexel-simulate", scene, body, "-o", folder / "bent.vtu", "--threads", "1", "--summary", folder / "s.json"])
    found = json.loads((folder / "s.json").read_text())
    bars = found.get("error_bars", {}).get("bars", [])
    bar = next((each["bar"] for each in bars if each["of"] == "probe asked"), float("nan"))
    iterations = f"{found['unknowns']:,}; {found['newton_iterations']}, {found['cg_iterations']}"
    return np.linalg.norm(found["probes"][0]["displacement"]) * 1e3, bar * 1e3, first + second, max(memory, more), found["cells"], iterations


def limit(values):
    """Aitken's extrapolation, or the last."""
    if len(values) < 3:
        return values[-1]
    first, second = values[-2] - values[-3], values[-1] - values[-2]
    return values[-1] if not 0 < second / first < 0.9 else values[-1] + second * second / (first - second)


def run(name, quick):
    case = CASES[name]()
    if not case:
        print(f"| {name} | left out: no ../shared/parts |", flush=True)
        return
    with tempfile.TemporaryDirectory() as place:
        folder = pathlib.Path(place)
        rows = [calculix(case, folder, size) for size in case.sizes[: 2 if quick else 3]]
        ours = [("", spacing, flexel(case, folder, spacing)) for spacing in case.spacings[: 1 if quick else 2]]
        ours += [(" of model quadratic", times * case.spacings[0], flexel(case, folder, times * case.spacings[0], "quadratic"))
                 for times in ((4,) if quick else (4, 2))]
    reference = case.reference or limit([row[0] for row in rows])
    for size, (value, seconds, memory, count, meshing, unknowns) in zip(case.sizes, rows):
        print(f"| {name} | CalculiX, C3D10 of {size:g} mm | {count:,} | {100 * (value / reference - 1):+.2f} | | {meshing:.2f} | {seconds:.2f} |"
              f" {memory:.0f} | {unknowns:,} |")
    for model, spacing, (value, bar, seconds, memory, cells, iterations) in ours:
        print(f"| {name} | Flexel, cells{model} of {spacing:g} mm | {cells:,} | {100 * (value / reference - 1):+.2f} | {'none' if math.isnan(bar) else f'{100 * bar / reference:.2f}'} |"
              f" | {seconds:.2f} | {memory:.0f} | {iterations} |", flush=True)


def main():
    global PARTS
    given = sys.argv[1:]
    if "--list" in given:
        print("\n".join(CASES))
        return
    if "--parts" in given[:-1]:
        at = given.index("--parts")
        PARTS = pathlib.Path(given[at + 1])
        del given[at:at + 2]
    wanted = [argument for argument in given if not argument.startswith("-")] or list(CASES)
    unknown = [name for name in wanted if name not in CASES]
    if unknown or "--help" in sys.argv:
        print(__doc__ + "\nCases: " + ", ".join(CASES), file=sys.stderr)
        sys.exit(0 if "--help" in sys.argv else 2)
    print("| part | by | elements, cells | error % | bar % | mesh s | s | MB | unknowns; Newton, CG |\n|---|---|---|---|---|---|---|---|---|")
    for name in wanted:
        run(name, "--quick" in sys.argv)


if __name__ == "__main__":
    main()

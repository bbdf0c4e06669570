"""CalculiX runs what `flexel export --calculix` writes: loads and reactions balance, and the answers agree with beam theory and with
our own."""

import json
import math
import os
import re

import numpy as np

from harness import BIN, Skip, binary_stl, box_triangles, bracket, expect, expect_error, expect_ok, main, need, run, scene, write

YOUNG, POISSON = 210e9, 0.3
LENGTH, WIDTH = 0.1, 0.01
FORCE = 100.0
# Timoshenko's cantilever under an end force: bending and shear
TIP = FORCE * LENGTH**3 / (3 * YOUNG * WIDTH**4 / 12) + FORCE * LENGTH / (5 / 6 * YOUNG / 2 / (1 + POISSON) * WIDTH**2)

BEAM = """material = "it"
[materials.it]
young = "210 GPa"
poisson = 0.3
density = "7850 kg/m3"
[[fix]]
where = "xmin"
[[load]]
name = "end"
where = "xmax"
force = ["0 N", "0 N", "-100 N"]
[[probe]]
name = "tip"
where = "xmax"
"""


def beam():
    return write("beam.stl", binary_stl(box_triangles((100, 10, 10))))


def export(*arguments, name="job.inp"):
    expect_ok(run("flexel", "export", *arguments, "--calculix", "--summary", "export.json", "-o", name, "--quiet", timeout=110))
    with open("export.json", encoding="utf-8") as file:
        return json.load(file)


def deform(*arguments):
    expect_ok(run("flexel", "deform", *arguments, "--no-estimate", "--summary", "deform.json", "-o", "out.stl", "--quiet", timeout=110))
    with open("deform.json", encoding="utf-8") as file:
        return json.load(file)["simulate"]


def ccx(name="job"):
    """Displacement [m] of each set that is printed (of probes their weighted mean, else that of its nodes), and the total forces [N] of
    each support."""
    result = expect_ok(run("ccx", name, timeout=110, env={**os.environ, "OMP_NUM_THREADS": "1"}))
    text = result.out.decode(errors="replace")
    expect("*ERROR" not in text, text[-2000:])
    moved, forces, into = {}, {}, None
    with open(name + ".dat", encoding="utf-8") as file:
        for line in file:
            title = re.match(r"\s*(displacements|total force).* for set (\S+)", line)
            if title:
                into = (title[1], title[2])
            row = line.split()
            if into and into[0] == "displacements" and len(row) == 4 and row[0].isdigit():
                moved.setdefault(into[1], {})[int(row[0])] = 1e-3 * np.array(row[1:], float)
            if into and into[0] == "total force" and len(row) == 3 and not title:
                forces[into[1]] = np.array([float(value) for value in row])
    means = {name: np.mean(list(rows.values()), axis=0) for name, rows in moved.items()}
    with open("export.json", encoding="utf-8") as file:
        for probe in json.load(file)["probes"]:
            means[probe["set"]] = sum(w * moved[probe["set"]][n] for n, w in zip(probe["nodes"], probe["weights"]))
    return means, forces


def keyword(name, text):
    """The data lines of every card of that name."""
    return [block.split("\n")[1:] for block in re.findall(rf"(?m)^\*{name}\b[^\n]*(?:\n(?!\*)[^\n]*)*", text)]


def concentrated(path="job.inp"):
    """Sum of all *CLOAD [N]."""
    total = np.zeros(3)
    with open(path, encoding="utf-8") as file:
        for block in keyword("CLOAD", file.read()):
            for line in block:
                _, axis, value = line.split(",")
                total[int(axis) - 1] += float(value)
    return total


def close(found, wanted, share, what):
    found, wanted = np.asarray(found, float), np.asarray(wanted, float)
    expect(np.linalg.norm(found - wanted) <= share * np.linalg.norm(wanted), f"{what}: {found}, wanted {wanted} within {100 * share} %")


def test_beam_hexahedra():
    need("ccx")
    beam(), scene("scene.toml", BEAM)
    told = export("beam.stl", "--scene", "scene.toml", "--size", "2.5 mm", "--nlgeom", "off")
    expect(told["elements"] == 640 and told["element"] == "C3D8I" and not told["nlgeom"], told)
    close(told["mass"], 7850 * LENGTH * WIDTH**2, 1e-9, "mass")
    close(concentrated(), [0, 0, -FORCE], 1e-6, "load")
    moved, forces = ccx()
    tip = moved["N_PROBE_TIP"]
    close(tip[2], -TIP, 0.02, "tip by beam theory")
    close(np.sum(list(forces.values()), axis=0), [0, 0, FORCE], 1e-5, "reaction")
    ours = deform("beam.stl", "--scene", "scene.toml", "--size", "2.5 mm")
    close(tip, ours["probes"][0]["displacement"], 0.02, "tip beside ours")


def test_beam_tetrahedra():
    need("ccx", "gmsh")
    beam(), scene("scene.toml", BEAM)
    told = export("beam.stl", "--scene", "scene.toml", "--mesh", "tet", "--size", "4 mm", "--nlgeom", "off")
    expect(told["element"] == "C3D10" and told["elements"] > 200, told)
    close(told["mass"], 7850 * LENGTH * WIDTH**2, 1e-6, "mass")
    for face in told["faces"]:
        close(face["area"], 1e-4 if face["area"] < 5e-4 else 1e-3, 1e-6, face["selection"])
    close(concentrated(), [0, 0, -FORCE], 1e-6, "load")
    moved, forces = ccx()
    close(moved["N_PROBE_TIP"][2], -TIP, 0.02, "tip by beam theory")
    close(np.sum(list(forces.values()), axis=0), [0, 0, FORCE], 1e-5, "reaction")


def test_bracket():
    """The sample from its STEP file, both meshes: faces as `flexel info` names them, and our own answer."""
    need("ccx", "gmsh")
    bracket()
    options = ["bracket.step", "--material", "steel", "--fix", "bracket/1", "--push", "bracket/2: 0 0 -100 N"]
    listed = json.loads(expect_ok(run("flexel", "info", "--json", "bracket.step")).out)["files"][0]["parts"][0]["faces"]
    ours = deform(*options, "--size", "1.5 mm")["largest_displacement"]
    for mesh, size in (("hex", "2 mm"), ("tet", "5 mm")):
        told = export(*options, "--mesh", mesh, "--size", size, "--nlgeom", "off")
        expect([face["selection"] for face in told["faces"]] == [face["selection"] for face in listed], told["faces"])
        if mesh == "tet":
            for face, info in zip(told["faces"], listed):
                close(face["area"], info["area"], 0.02, face["selection"])
        close(concentrated(), [0, 0, -100], 1e-6, f"load, {mesh}")
        with open("job.inp", encoding="utf-8") as file:
            text = file.read()
        write("job.inp", text.replace("*END STEP", "*NODE PRINT, NSET=N_BRACKET_2\nU\n*END STEP"))
        moved, forces = ccx()
        close(np.sum(list(forces.values()), axis=0), [0, 0, 100], 1e-4, f"reaction, {mesh}")
        close(np.linalg.norm(moved["N_BRACKET_2"]), ours, 0.03, f"tip, {mesh}")


def cylinder(radius, height, sides=48):
    """An upright cylinder with its middle at the origin of its foot."""
    ring = [(radius * math.cos(2 * math.pi * i / sides), radius * math.sin(2 * math.pi * i / sides)) for i in range(sides)]
    triangles = []
    for (x0, y0), (x1, y1) in zip(ring, ring[1:] + ring[:1]):
        triangles += [((0, 0, 0), (x1, y1, 0), (x0, y0, 0)), ((0, 0, height), (x0, y0, height), (x1, y1, height)),
                      ((x0, y0, 0), (x1, y1, 0), (x1, y1, height)), ((x0, y0, 0), (x1, y1, height), (x0, y0, height))]
    return triangles


def test_partial_cells():
    """A round bar drawn along its axis: its skin cuts through the cells."""
    need("ccx")
    write("bar.stl", binary_stl(cylinder(5, 40)))
    told = export("bar.stl", "--material", "steel", "--fix", "zmin", "--push", "zmax: 0 0 1000 N", "--size", "1.25 mm", "--nlgeom", "off")
    area = 24 * math.sin(2 * math.pi / 48) * 5e-3**2
    expect(len(told["sections"]) > 3 and any("partly filled" in note for note in told["notes"]), told)
    close(sum(section["volume"] for section in told["sections"]), 0.04 * area, 0.002, "volume")
    close(concentrated(), [0, 0, 1000], 1e-6, "load")
    with open("job.inp", encoding="utf-8") as file:
        text = file.read()
    end = next(face for face in told["faces"] if face["selection"].endswith("/2"))
    write("job.inp", text.replace("*END STEP", f"*NODE PRINT, NSET={end['nodes']}\nU\n*END STEP"))
    moved, forces = ccx()
    ours = deform("bar.stl", "--material", "steel", "--fix", "zmin", "--push", "zmax: 0 0 1000 N", "--size", "1.25 mm")
    close(np.sum(list(forces.values()), axis=0), [0, 0, -1000], 1e-4, "reaction")
    expect(max(abs(moved[end["nodes"]][2]), 0) > 0, moved)
    close(ours["largest_displacement"], moved[end["nodes"]][2], 0.05, "ours")


def test_holes_held():
    """The bracket held in its bolt holes, which cut through cells: equations. Beside our own answer."""
    need("ccx")
    bracket()
    found = json.loads(expect_ok(run("flexel", "info", "--json", "bracket.step")).out)["files"][0]["parts"][0]["faces"]
    holes = [face["selection"] for face in found if face["kind"] == "round" and face["hole"] and face["radius"] < 5e-3]
    expect(len(holes) == 2, found)
    options = ["bracket.step", "--material", "steel", "--push", "bracket/2: 0 0 -100 N", "--size", "2 mm"]
    options += [word for hole in holes for word in ("--fix", hole)]
    told = export(*options, "--nlgeom", "off")
    expect(all(support["equations"] > 50 for support in told["supports"]), told["supports"])
    with open("job.inp", encoding="utf-8") as file:
        text = file.read()
    write("job.inp", text.replace("*END STEP", "*NODE PRINT, NSET=N_BRACKET_2\nU\n*END STEP"))
    moved, _ = ccx()
    close(np.linalg.norm(moved["N_BRACKET_2"]), deform(*options)["largest_displacement"], 0.06, "tip beside ours")


def test_pressure_gravity_and_torque():
    need("ccx")
    beam()
    scene("scene.toml", BEAM.replace('force = ["0 N", "0 N", "-100 N"]', 'pressure = "2 MPa"') + """[gravity]
acceleration = [0, 0, "-9.81 m/s2"]
[[load]]
name = "twist"
where = "xmax"
torque = ["1 N m", 0, 0]
[[load]]
name = "hung"
where = "xmax"
force = [0, 0, "-50 N"]
at = ["150 mm", "5 mm", "5 mm"]
""")
    weight = 9.81 * 7850 * LENGTH * WIDTH**2
    for mesh in (["--size", "2.5 mm"], ["--mesh", "tet", "--size", "5 mm"]):
        if mesh[0] == "--mesh":
            need("gmsh")
        told = export("beam.stl", "--scene", "scene.toml", *mesh, "--nlgeom", "off")
        expect([load["kind"] for load in told["loads"]] == ["pressure", "torque", "remote force"], told["loads"])
        close(told["loads"][0]["force"], [-2e6 * WIDTH**2, 0, 0], 1e-6, "pressure")
        expect(np.linalg.norm(told["loads"][1]["force"]) < 1e-9, told["loads"][1])
        _, forces = ccx()
        close(np.sum(list(forces.values()), axis=0), [200, 0, 50 + weight], 1e-4, "reaction")
        ours = deform("beam.stl", "--scene", "scene.toml", "--size", "2.5 mm")
        moved, _ = ccx()
        close(moved["N_PROBE_TIP"], ours["probes"][0]["displacement"], 0.02, "tip")


def test_large_deflection():
    """A strip bent far: told from a coarse run, and the same end as ours."""
    need("ccx")
    write("strip.stl", binary_stl(box_triangles((60, 4, 4))))
    scene("scene.toml", BEAM.replace('"210 GPa"', '"1 GPa"').replace("-100 N", "-6 N"))
    told = export("strip.stl", "--scene", "scene.toml", "--size", "1 mm")
    expect(told["nlgeom"] and "large rotations change" in told["why_nlgeom"], told)
    moved, _ = ccx()
    ours = deform("strip.stl", "--scene", "scene.toml", "--size", "1 mm")
    expect(np.linalg.norm(ours["probes"][0]["displacement"]) > 0.01, "the strip should bend far")
    close(moved["N_PROBE_TIP"], ours["probes"][0]["displacement"], 0.02, "tip")
    scene("small.toml", BEAM)
    expect(not export("strip.stl", "--scene", "small.toml", "--push", "xmax: 0 0 99.999 N", "--size", "1 mm")["nlgeom"], "0.001 N is small")


def test_moves():
    """An end that is led: shifted and turned."""
    need("ccx")
    beam()
    scene("scene.toml", """material = "steel"
[[fix]]
where = "xmin"
[[move]]
where = "xmax"
displacement = ["0 mm", "0 mm", "-0.2 mm"]
rotation = { axis = [1, 0, 0], through = ["0 mm", "5 mm", "5 mm"], angle = "1 deg" }
""")
    told = export("beam.stl", "--scene", "scene.toml", "--size", "2.5 mm")
    expect(told["nlgeom"] and "turned" in told["why_nlgeom"], told)
    ours = deform("beam.stl", "--scene", "scene.toml", "--size", "2.5 mm")
    _, forces = ccx()
    fixed = next(value for name, value in forces.items() if "FIX" in name)
    close(fixed, ours["reactions"][0]["force"], 0.03, "reaction")


def test_touching_parts():
    """Two boxes end to end, bonded: as one beam."""
    need("ccx", "gmsh")
    left, right = box_triangles((50, 10, 10)), [tuple((x + 50, y, z) for x, y, z in t) for t in box_triangles((50, 10, 10))]
    write("left.stl", binary_stl(left)), write("right.stl", binary_stl(right)), scene("scene.toml", BEAM)
    for mesh in (["--size", "2.5 mm"], ["--mesh", "tet", "--size", "4 mm"]):
        told = export("left.stl", "right.stl", "--scene", "scene.toml", *mesh, "--nlgeom", "off")
        expect(told["ties"] == [["left", "right"]], told["ties"])
        moved, forces = ccx()
        close(moved["N_PROBE_TIP"][2], -TIP, 0.03, "tip of two parts")
        close(np.sum(list(forces.values()), axis=0), [0, 0, FORCE], 1e-4, "reaction")


def test_refusals():
    beam()
    timed = scene("timed.toml", BEAM + '[run]\ntime = "1 s"\n')
    out = ["--calculix", "-o", "job.inp"]
    expect_error(run("flexel", "export", "beam.stl", "--scene", timed, *out), "flexel", "timed.toml", "timed run")
    dragged = scene("drag.toml", BEAM + '[drag]\ndensity = "1.2 kg/m3"\n')
    expect_error(run("flexel", "export", "beam.stl", "--scene", dragged, *out), "flexel", "drag")
    expect_error(run("flexel", "export", "beam.stl", "--material", "steel", "--fix", "xmin", "--push", "xmax: 1 0 0 N", *out, "--mesh",
                     "hexes"), "flexel", "--mesh", "hex")
    expect_error(run("flexel", "export", "beam.stl", "--material", "steel", "--fix", "xmin", "--push", "beam/9: 1 0 0 N", *out), "flexel",
                 "no face", "beam/9")
    expect_error(run("flexel", "export", "beam.stl", "--material", "steel", "--fix", "xmin", "--push", "xmax: 1 0 0 N", *out, "--mesh",
                     "tet", env={"PATH": "/nowhere"}), "flexel", "gmsh", "not installed")
    expect(not os.path.exists("job.inp"), "nothing is written")
    if not (BIN / "flexel").exists():
        raise Skip("flexel is not built")


if __name__ == "__main__":
    main(globals())

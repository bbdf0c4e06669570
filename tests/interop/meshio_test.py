"""meshio reads our body files, raw and compressed, and carries them to other formats; it reads the meshes that we write."""

import meshio
import numpy as np
from files import obj_parts, stl_triangles, vtu_arrays

from harness import body, box, expect, expect_ok, main, run, scene, write


def deformed(*options):
    scene()
    body("rest.vtu", *options)
    expect_ok(run("flexel-simulate", "scene.toml", "rest.vtu", "-o", "body.vtu", *options))
    return "body.vtu"


def same_as_ours(path):
    mesh = meshio.read(path)
    ours = vtu_arrays(path)
    expect([block.type for block in mesh.cells] == ["hexahedron"], f"one block of hexahedra wanted: {mesh}")
    expect(len(mesh.cells[0].data) == 32, f"32 cells wanted: {mesh}")
    compared = 0
    for kind, data in (("point", mesh.point_data), ("cell", mesh.cell_data), ("field", mesh.field_data)):
        for name, value in data.items():
            value = value[0] if kind == "cell" else value
            expect(np.array_equal(np.ravel(value), np.ravel(ours[f"{kind}/{name}"])), f"{kind} data \"{name}\" differs")
            compared += 1
    expect(compared >= 6, f"only {compared} arrays were there to compare: {mesh}")
    expect(np.array_equal(mesh.points, ours["points/position"]), "points differ")
    return mesh


def test_raw_body():
    mesh = same_as_ours(deformed())
    expect(len(mesh.points) == 81, "81 elements wanted")
    lengths = mesh.points.max(axis=0) - mesh.points.min(axis=0)
    expect(0.03 < lengths[0] < 0.05, f"a body is in metres: {lengths}")


def test_compressed_body():
    same_as_ours(deformed("--compress"))


def test_compressed_equals_raw():
    body("raw.vtu")
    body("small.vtu", "--compress")
    raw, small = vtu_arrays("raw.vtu"), vtu_arrays("small.vtu")
    expect(raw.keys() == small.keys(), "different arrays")
    for name, array in raw.items():
        expect(np.array_equal(array, small[name]), f"\"{name}\" differs")


def test_pieces():
    """Each piece by itself; their own cells are all cells, and a number of a point is one place."""
    expect_ok(run("flexel-voxelize", box(), "--size", "5 mm", "--pieces", "3", "-o", "body.pvtu"))
    own, places = 0, {}
    for index in range(3):
        mesh = meshio.read(f"body_{index}.vtu")
        own += int(np.sum(mesh.cell_data["vtkGhostType"][0] == 0))
        for number, place in zip(mesh.point_data["GlobalPointIds"], mesh.points):
            expect(places.setdefault(int(number), tuple(place)) == tuple(place), f"point {number} is in two places")
        head = open(f"body_{index}.vtu", "rb").read(4096)
        expect(b'GlobalIds="GlobalPointIds"' in head, f"VTK's global ids wanted: {head}")
    expect(own == 32 and sorted(places) == list(range(81)), f"{own} own cells, {len(places)} points")


def test_hexahedra_are_right_handed():
    mesh = meshio.read(body())
    corners = mesh.points[mesh.cells[0].data]
    edges = [corners[:, i] - corners[:, 0] for i in (1, 3, 4)]
    volumes = np.einsum("ij,ij->i", np.cross(edges[0], edges[1]), edges[2])
    expect(np.allclose(volumes, 0.005**3, rtol=1e-9), f"VTK's order of corners gives every cell its volume: {volumes.min()}")


def test_abaqus():
    path = deformed()
    mesh = meshio.read(path)
    meshio.write_points_cells("body.inp", mesh.points, [("hexahedron", mesh.cells[0].data)])
    again = meshio.read("body.inp")
    expect(np.allclose(again.points, mesh.points, rtol=1e-12, atol=1e-15), "points differ after .inp")
    expect(np.array_equal(again.cells_dict["hexahedron"], mesh.cells[0].data), "cells differ after .inp")


def test_stl_is_read_with_its_triangles_in_order():
    box()
    path = deformed()
    expect_ok(run("flexel-map", path, "--keep-vertices", "-o", "bent.stl"))
    ours = stl_triangles("bent.stl")
    mesh = meshio.read("bent.stl")
    expect(len(ours) == 12 and np.array_equal(mesh.points[mesh.cells_dict["triangle"]], ours.astype(np.float32)), "triangles differ")
    expect(np.abs(ours - stl_triangles("box.stl")).max() > 0, "the load left no trace in the STL")


QUADS = """# a box, as quads
v 0 0 0
v 40 0 0
v 40 10 0
v 0 10 0
v 0 0 10
v 40 0 10
v 40 10 10
v 0 10 10
g box
f 4 3 2 1
f 5 6 7 8
f 1 2 6 5
f 2 3 7 6
f 3 4 8 7
f 4 1 5 8
"""


def test_obj_is_read_with_its_vertices_in_order():
    write("part.obj", QUADS)
    scene()
    expect_ok(run("flexel-voxelize", "part.obj", "--size", "5 mm", "-o", "rest.vtu"))
    expect_ok(run("flexel-simulate", "scene.toml", "rest.vtu", "-o", "body.vtu"))
    expect_ok(run("flexel-map", "body.vtu", "--keep-vertices", "-o", "bent.obj"))
    before, faces = obj_parts("part.obj")
    vertices, new_faces = obj_parts("bent.obj")
    expect(faces == new_faces and len(before) == len(vertices), "faces or vertices were added, lost or reordered")
    expect(np.abs(vertices - before)[:, 2].max() > 0, "the load left no trace in the OBJ")
    mesh = meshio.read("bent.obj")
    expect(np.allclose(mesh.points, vertices, rtol=1e-6), "meshio reads other points")


def test_split_surfaces_are_read():
    write("part.obj", QUADS)
    scene()
    expect_ok(run("flexel-voxelize", "part.obj", "--size", "5 mm", "-o", "rest.vtu"))
    for ending in ("obj", "ply", "off", "stl"):
        expect_ok(run("flexel-map", "rest.vtu", "-o", f"whole.{ending}"))
        expect_ok(run("flexel-voxelize", f"whole.{ending}", "--size", "5 mm", "-o", "own.vtu"))
        expect_ok(run("flexel-map", "own.vtu", "--refine", "3 mm", "-o", f"split.{ending}"))
        mesh = meshio.read(f"split.{ending}")
        at = mesh.points[mesh.cells_dict["triangle"]].astype(float)
        volume = np.einsum("ti,ti->t", at[:, 0], np.cross(at[:, 1], at[:, 2])).sum() / 6
        expect(len(at) > 500 and abs(volume / 4000 - 1) < 1e-5, f"{ending}: {len(at)} triangles, {volume} mm^3")


def test_new_ply_and_off_are_read():
    expect_ok(run("flexel-voxelize", box(), "--size", "5 mm", "-o", "rest.vtu"))
    for name in ["part.ply", "part.off"]:
        expect_ok(run("flexel-map", "rest.vtu", "-o", name))
        mesh = meshio.read(name)
        expect(len(mesh.points) == 8 and len(mesh.cells_dict["triangle"]) == 12, f"meshio reads {mesh} from {name}")


if __name__ == "__main__":
    main(globals())

"""Other people's programs read what we write: admesh, gmsh and, where it is installed, ParaView."""

import re
import shutil
import subprocess
import sys

from files import stl_triangles

from harness import Skip, body, box, bracket, expect, expect_ok, main, need, run, scene


def bent_bracket(name):
    """The bracket, bent, under the given name."""
    bracket()
    scene("bend.toml", 'material = "PLA"\n[[fix]]\nwhere = "bracket/1"\n[[load]]\nwhere = "bracket/2"\nforce = ["0 N", "0 N", "-50 N"]\n')
    expect_ok(run("flexel-voxelize", "bracket.step", "--size", "3 mm", "-o", "rest.vtu"))
    expect_ok(run("flexel-simulate", "bend.toml", "rest.vtu", "-o", "body.vtu"))
    expect_ok(run("flexel-map", "body.vtu", "-o", name))
    expect_ok(run("flexel-map", "rest.vtu", "-o", "rest.stl"))
    return name


def admesh(path):
    """What admesh counts as wrong in a mesh, by its own words."""
    out = expect_ok(run("admesh", path, timeout=60)).out.decode()
    found = {key: int(value) for key, value in re.findall(r"(?m)^\s*(Edges fixed|Facets removed|Facets added|Facets reversed|Backwards "
                                                          r"edges|Normals fixed|Degenerate facets|Number of parts)\s*:\s*(\d+)", out)}
    found["facets"] = int(re.search(r"Number of facets\s*:\s*(\d+)", out).group(1))
    expect(len(found) >= 8, f"admesh says something new: {out}")
    return found


def test_admesh():
    need("admesh")
    bent_bracket("bent.stl")
    before, after = admesh("rest.stl"), admesh("bent.stl")
    expect(after["facets"] == len(stl_triangles("bent.stl")), f"admesh sees other facets: {after}")
    for key in ("Edges fixed", "Facets removed", "Facets added", "Facets reversed", "Backwards edges"):
        expect(after[key] == before[key] == 0, f"{key}: {before[key]} at rest, {after[key]} bent")


def test_admesh_reads_ascii():
    need("admesh")
    bent_bracket("bent.stl")
    expect_ok(run("flexel-map", "body.vtu", "--ascii", "-o", "text.stl"))
    expect(admesh("text.stl") == admesh("bent.stl"), "the ASCII STL is another mesh")


def gmsh(*arguments):
    result = expect_ok(run("gmsh", *arguments, "-v", "4", timeout=100))
    text = result.out.decode() + result.err
    expect("Error" not in text, text)
    return text


def test_gmsh_reads_stl():
    need("gmsh")
    bent_bracket("bent.stl")
    text = gmsh("bent.stl", "-save", "-format", "msh2", "-o", "bent.msh")
    with open("bent.msh", encoding="latin-1") as file:
        lines = file.read().splitlines()
    count = int(lines[lines.index("$Elements") + 1])
    expect(count >= len(stl_triangles("bent.stl")), f"{count} elements: {text}")


def test_gmsh_reads_the_lattice():
    need("gmsh")
    import meshio
    mesh = meshio.read(body())
    meshio.write_points_cells("body.msh", mesh.points, [("hexahedron", mesh.cells[0].data)], file_format="gmsh22", binary=False)
    text = gmsh("body.msh", "-check")
    expect("81 nodes" in text and "32 elements" in text, text)


PARAVIEW = """
from paraview.simple import XMLUnstructuredGridReader
from paraview import servermanager
reader = XMLUnstructuredGridReader(FileName=["{path}"])
reader.UpdatePipeline()
grid = servermanager.Fetch(reader)
assert grid.GetNumberOfPoints() == 81 and grid.GetNumberOfCells() == 32, grid
assert grid.GetPointData().GetNumberOfArrays() > 0 and grid.GetCellData().GetArray("fill") is not None, grid
"""


PARAVIEW_PIECES = """
from paraview.simple import XMLPartitionedUnstructuredGridReader
from paraview import servermanager
reader = XMLPartitionedUnstructuredGridReader(FileName=["{path}"])
reader.UpdatePipeline()
grid = servermanager.Fetch(reader)
ghosts = grid.GetCellData().GetArray("vtkGhostType")
own = [c for c in range(grid.GetNumberOfCells()) if ghosts is None or ghosts.GetValue(c) == 0]
assert len(own) == 32, (len(own), grid)
assert grid.GetPointData().GetGlobalIds() is not None and grid.GetCellData().GetArray("fill") is not None, grid
"""


def need_paraview():
    pvpython = shutil.which("pvpython")
    if pvpython is None and subprocess.run(["/usr/bin/python3", "-c", "import paraview"], stderr=subprocess.DEVNULL,
                                           check=False).returncode != 0:
        raise Skip("ParaView is not installed")
    return pvpython or sys.executable


def test_paraview():
    pvpython = need_paraview()
    for options in ([], ["--compress"]):
        path = body("body.vtu", *options)
        expect_ok(run(pvpython, "-c", PARAVIEW.format(path=path), timeout=100))


def test_paraview_reads_pieces():
    pvpython = need_paraview()
    expect_ok(run("flexel-voxelize", box(), "--size", "5 mm", "--pieces", "3", "-o", "body.pvtu"))
    expect_ok(run(pvpython, "-c", PARAVIEW_PIECES.format(path="body.pvtu"), timeout=100))


if __name__ == "__main__":
    main(globals())

"""The scripts of samples/pipelines work, and their results are what the text says."""

import os
import re
import sys

from harness import BIN, SOURCE, Skip, binary_stl, box_triangles, expect, expect_ok, main, need, need_step, run, write

sys.path.insert(0, str(SOURCE / "tests/interop"))
PIPELINES = SOURCE / "samples/pipelines"


def pipeline(name, *arguments):
    environment = dict(os.environ, PATH=f"{BIN}:{os.environ['PATH']}")
    result = run("bash", PIPELINES / name, *arguments, timeout=170, env=environment)
    return expect_ok(result).out.decode()


def bent(before, after):
    """No triangle less (they are split where the part bends); the held end stays, the other goes down."""
    import numpy as np
    from files import any_stl_triangles
    old, new = any_stl_triangles(before).reshape(-1, 3), any_stl_triangles(after).reshape(-1, 3)
    expect(len(new) >= len(old) and np.isfinite(new).all(), f"{len(old)} corners became {len(new)}")
    ends = old[:, 0].min(), old[:, 0].max()
    lowest = lambda points, end: points[abs(points[:, 0] - end) < 0.005 * (ends[1] - ends[0]), 2].min()
    held, loaded = (lowest(new, end) - lowest(old, end) for end in ends)
    expect(abs(held) < 0.02 * abs(loaded), f"the held end moved by {held} mm")
    expect(loaded < -0.01, f"the loaded end moved by {loaded} mm")


def test_openscad():
    need("openscad", "admesh")
    text = pipeline("openscad.sh", "out")
    bent("out/clip.stl", "out/pressed.stl")
    for key in ("Edges fixed", "Facets removed", "Facets added", "Facets reversed", "Backwards edges"):
        expect(re.search(rf"{key}\s*:\s*0\b", text), f"admesh reports {key}: {text}")


def test_gmsh():
    need("gmsh")
    text = pipeline("gmsh.sh", "out")
    expect("Error" not in text, text)
    bent("out/plate.stl", "out/bent.stl")
    import meshio
    tetrahedra = meshio.read("out/bent.msh").cells_dict.get("tetra", [])
    expect(len(tetrahedra) > 100, f"gmsh filled the bent plate with {len(tetrahedra)} tetrahedra")


def test_step():
    need("gmsh")
    need_step()
    pipeline("step.sh", "out")
    import meshio
    import numpy as np

    def volume(name):
        mesh = meshio.read(name)
        at = mesh.points[mesh.cells_dict["tetra"]]
        return np.abs(np.linalg.det(at[:, 1:] - at[:, :1])).sum() / 6
    before, after = volume("out/bracket.msh"), volume("out/bent.msh")
    expect(abs(after / before - 1) < 0.03, f"gmsh's tetrahedra of the bracket hold {before} mm^3, of the bent one {after}")
    faces = lambda name: len(re.findall("ADVANCED_FACE", open(name, encoding="utf-8").read()))
    expect(faces("out/bracket.step") == faces("out/bent.step") == 11, "the bent part has the bracket's 11 faces")


def test_meshio():
    import meshio
    import numpy as np
    triangles = np.array(box_triangles())
    points, index = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    meshio.write_points_cells("part.ply", points, [("triangle", index.reshape(-1, 3))])
    pipeline("meshio.sh", "part.ply", "out")
    bent("out/part.stl", "out/bent.stl")
    expect(len(meshio.read("out/bent.ply").cells_dict["triangle"]) >= len(triangles), "triangles were lost on the way")
    hexahedra = meshio.read("out/body.inp").cells_dict["hexahedron"]
    expect(1000 < len(hexahedra) < 4000, f"{len(hexahedra)} hexahedra in the .inp")


def test_lammps():
    need("lmp", "mpirun")
    os.environ.update(OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1", OMPI_MCA_mpi_yield_when_idle="1", OMP_NUM_THREADS="1")
    write("bar.stl", binary_stl(box_triangles((40.0, 8.0, 6.0))))
    pipeline("lammps.sh", "bar.stl", "out", "2")
    import numpy as np
    from files import any_stl_triangles
    old, new = (any_stl_triangles(name).reshape(-1, 3) for name in ("bar.stl", "out/bent.stl"))
    held, swung = (abs(new[abs(new[:, 0] - end) < 0.5][:, 2].min() - old[:, 2].min()) for end in (old[:, 0].min(), new[:, 0].max()))
    expect(held < 1e-3 and 0.1 < swung < 10, f"the held end moved by {held} mm, the free one by {swung} mm")
    expect(os.path.exists("out/swing_00010.vtu") and not os.path.exists("out/swing_00011.vtu"), "eleven frames are wanted")


def test_mpi():
    if not (BIN / "flexel-simulate-mpi").exists():
        raise Skip("built without PETSc and MPI (tools/setup --mpi)")
    need("mpirun")
    os.environ.update(OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1", OMPI_MCA_mpi_yield_when_idle="1")
    write("bar.stl", binary_stl(box_triangles((40.0, 8.0, 6.0))))
    pipeline("mpi.sh", "bar.stl", "out", "2")
    bent("bar.stl", "out/bent.stl")


def test_failure_stops_the_pipeline():
    result = run("bash", PIPELINES / "meshio.sh", "absent.ply", "out", env=dict(os.environ, PATH=f"{BIN}:{os.environ['PATH']}"))
    expect(result.code != 0 and not os.path.exists("out/bent.stl"), f"a missing part should stop the script: {result}")


if __name__ == "__main__":
    main(globals())

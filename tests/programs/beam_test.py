"""The paper's beam (2 x 0.7 x 0.5 m, E = 12.1e5 Pa, one end fixed, a transverse force over the other) turned by 30 degrees twice
against its lattice, four cells over the short side: the end follows the reference within 11 %."""

import json

import numpy as np
from harness import binary_stl, box_triangles, expect, expect_ok, main, run, scene, write

SIZE = (2.0, 0.7, 0.5)  # m
FORCE = 1e-3  # N: the linear regime
# Mean displacement of the end along the load, m/N: CalculiX 2.20, C3D20R, extrapolated (tests/simulate/reference/beam_ccx.py), by
# Poisson's ratio and by the axis of the load.
REFERENCE = {(0.25, 1): 1.66322e-4, (0.25, 2): 3.11722e-4, (0.3, 1): 1.65964e-4, (0.3, 2): 3.10193e-4}


def turn():
    """30 degrees about z, then 30 degrees about y."""
    c, s = np.cos(np.pi / 6), 0.5
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]) @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def face_at(point, faces):
    return min(faces, key=lambda face: np.linalg.norm(np.array(face["centroid"]) - point))["selection"]


def tip_errors(poisson):
    """Relative errors of the end's displacement for the loads along the beam's y and z."""
    rotation = turn()
    write("beam.stl", binary_stl([[tuple(rotation @ corner) for corner in triangle] for triangle in box_triangles(SIZE)]))
    expect_ok(run("flexel-voxelize", "beam.stl", "--unit", "m", "--size", "125 mm", "--align", "none", "-o", "beam.vtu"))
    info = json.loads(expect_ok(run("flexel", "info", "beam.stl", "--unit", "m", "--json")).out)
    faces = info["files"][0]["parts"][0]["faces"]
    middle = np.array([0, SIZE[1] / 2, SIZE[2] / 2])
    start = face_at(rotation @ middle, faces)
    end = face_at(rotation @ (middle + np.array([SIZE[0], 0, 0])), faces)
    errors = []
    for axis in (1, 2):
        direction = rotation[:, axis]
        force = ", ".join(f'"{FORCE * component:.12g} N"' for component in direction)
        scene("bend.toml", f"""material = "gum"
[materials.gum]
young = "1.21 MPa"
poisson = {poisson}
density = "580 kg/m3"
[[fix]]
where = "{start}"
[[load]]
where = "{end}"
force = [{force}]
[[probe]]
where = "{end}"
""")
        expect_ok(run("flexel-simulate", "bend.toml", "beam.vtu", "-o", "bent.vtu", "--summary", "summary.json"))
        with open("summary.json", encoding="utf-8") as text:
            moved = direction @ json.load(text)["probes"][0]["displacement"]
        errors.append(moved / FORCE / REFERENCE[poisson, axis] - 1)
    print(f"nu {poisson}: {[f'{100 * error:+.1f} %' for error in errors]}")
    return errors


def test_turned_beam():
    for poisson in (0.25, 0.3):
        for error in tip_errors(poisson):
            expect(abs(error) < 0.11, f"nu {poisson}: {error}")


if __name__ == "__main__":
    main(globals())

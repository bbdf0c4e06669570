"""Real parts, torn in two along a wavy cut and capped: every piece is closed, volumes add up; what cannot be capped is refused in one
line and can be opened."""

import json
import re
import shutil

import numpy as np
from harness import PARTS, Skip, expect, expect_error, expect_ok, main, run
from torn import tear


def wavy(points):
    """The far side of a cut across the middle of the longest axis."""
    low = points.min(axis=0)
    size = points.max(axis=0) - low
    a = int(np.argmax(size))
    b, c = (k for k in range(3) if k != a)
    along, p, q = ((points[:, k] - low[k]) / size[a] for k in (a, b, c))
    return along > 0.45 + 0.03 * np.sin(30 * p) + 0.03 * np.cos(25 * q)


def torn(name):
    if not (PARTS / name).is_file():
        raise Skip(f"{PARTS / name} is not there")
    expect_ok(run("flexel-voxelize", PARTS / name, "--count", "8000", "-o", "rest.vtu"))
    tear("rest.vtu", "torn.vtu", wavy, lambda x: x + np.array([0.05, 0.02, 0.0]))


def expect_capped(name):
    torn(name)
    expect_ok(run("flexel-map", "torn.vtu", "--crack", "cap", "--debris", "drop", "--report", "report.json", "-o", "torn.stl"))
    report = json.load(open("report.json"))
    crack = report["crack"]
    expect(sum(not piece["debris"] for piece in crack["pieces"]) > 1, f"{name} is not in two: {crack}")
    whole = report["volume_before"] + crack["dropped_volume"]
    expect(abs(sum(piece["volume_before"] for piece in crack["pieces"]) - whole) < 1e-12 * whole, f"{name}: volumes do not add up")
    if shutil.which("admesh"):
        said = expect_ok(run("admesh", "torn.stl", timeout=60)).out.decode()
        for key in ("Total disconnected facets", "Degenerate facets", "Edges fixed", "Facets reversed"):
            expect(int(re.search(rf"{key}\s*:\s*(\d+)", said).group(1)) == 0, f"{name}: {key}: {said}")


def test_step():
    expect_capped("4040_base_mount.step")


def test_stl():
    expect_capped("hook.stl")


def test_quads():
    expect_capped("spot_quadrangulated.obj")


def test_many_solids():
    expect_capped("pins.glb")


def test_edge_with_four_sides():
    expect_capped("yarn_guide.stl")


def test_overlapping_shells_are_refused_and_opened():
    torn("conrod.stl")
    expect_error(run("flexel-map", "torn.vtu", "--crack", "cap", "-o", "torn.stl"), "flexel-map", "shells that overlap", "--crack open")
    expect_ok(run("flexel-map", "torn.vtu", "--crack", "open", "-o", "torn.stl"))


if __name__ == "__main__":
    main(globals())

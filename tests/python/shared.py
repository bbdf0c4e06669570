"""What the tests of the Python package share: the package, and small parts. ctest runs them one by one, as those of tests/programs."""

import os
import unittest

from harness import Skip, bracket, expect_error, expect_ok, main, need_step, run  # noqa: F401: for the tests, too

check = unittest.TestCase()
check.maxDiff = None


def module():
    """The package; skips the test where it was not built."""
    if os.environ.get("FLEXEL_HAS_PYTHON") != "ON":
        raise Skip("built without the Python module (pybind11 or Python's headers are missing)")
    try:
        import numpy  # noqa: F401
    except ImportError:
        raise Skip("numpy is not installed") from None
    import flexel

    return flexel


def box(lengths=(0.04, 0.01, 0.01)):
    """(vertices, quads) of a box, outward [m]."""
    import numpy as np

    corners = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], float) * lengths
    quads = np.array([[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]])
    return corners, quads


def box_body(flexel, size=0.0025):
    return flexel.voxelize(flexel.Part.from_mesh(*box()), size=size)


PULL = {"fix": "xmin", "push": {"xmax": (0, 0, -100)}, "material": "steel"}
SWING = """material = "steel"
[[fix]]
where = "xmin"
[gravity]
acceleration = ["0 m/s^2", "0 m/s^2", "-9.81 m/s^2"]
[run]
time = "TIME"
frames = 4
"""

#!/usr/bin/python3
"""Chooses the thickness of a clip so that bending its hook out of the way takes 20 N.

    snap_force.py [NEWTONS]

The clip is a cantilever of 20 mm with a hook of 1 mm at its end; it snaps in when the hook is pushed aside by that 1 mm.
The force is that across the clip; what friction and the hook's slope make of it is not in it.
"""

import sys
import time

import flexel
import numpy as np
from scipy import optimize

LENGTH, WIDTH, HOOK = 0.020, 0.006, 0.001  # m


def clip(thickness):
    """The clip as (vertices, quads): slices along x, the hook at the end on top."""
    stations = np.array([0, 0.004, 0.008, 0.012, 0.016, 0.0175, LENGTH])
    top = thickness + np.array([0, 0, 0, 0, 0, HOOK, 0])
    ring = np.array([[[x, -WIDTH / 2, 0], [x, WIDTH / 2, 0], [x, WIDTH / 2, z], [x, -WIDTH / 2, z]]
                     for x, z in zip(stations, top)]).reshape(-1, 3)
    quads = [[0, 3, 2, 1], [len(ring) - 4, len(ring) - 3, len(ring) - 2, len(ring) - 1]]
    for s in range(len(stations) - 1):
        for side in range(4):
            a, b = 4 * s + side, 4 * s + (side + 1) % 4
            quads.append([a, b, b + 4, a + 4])
    return ring, np.array(quads)


def deflection(thickness, force):
    """[m] by which `force` [N] across the end of the clip pushes it aside; the end may turn."""
    part = flexel.Part.from_mesh(*clip(thickness), name="clip")
    result = flexel.deform(part, fix="xmin", push={"xmax": (0, 0, -force)}, probe="end: xmax", material="PLA",
                           model="quadratic", size="1 mm", no_estimate=True)
    return -result.probes["end"][2]


def choose(force):
    """The thickness [m] at which `force` [N] pushes the end aside by its hook, and each (thickness, deflection) tried."""
    tried = []

    def miss(thickness):
        tried.append((thickness, deflection(thickness, force)))
        return tried[-1][1] / HOOK - 1

    thickness = optimize.brentq(miss, 0.0015, 0.006, xtol=1e-7, rtol=1e-5)
    return thickness, tried


def main():
    force = float(sys.argv[1]) if len(sys.argv) > 1 else 20.0
    began = time.monotonic()
    thickness, tried = choose(force)
    print("thickness [mm]  deflection [mm]")
    for each, moved in tried:
        print(f"{1000 * each:14.4f}  {1000 * moved:15.4f}")
    print(f"{1000 * thickness:.3f} mm for {force:g} N, after {len(tried)} runs in {time.monotonic() - began:.0f} s")


if __name__ == "__main__":
    main()

#!/usr/bin/python3
"""Finds Young's modulus from a curve of force against displacement.

The curve is made here, by Flexel itself with 2.35 GPa and noise of 1 % from a seed, so that the answer is known; a measured one
goes in its place. The bar is bent so far that the curve is no line.
"""

import flexel
import numpy as np
from scipy import optimize

TRUE, NOISE = 2.35e9, 0.01  # Pa; share of each force
DISPLACEMENTS = np.array([0.002, 0.004, 0.006, 0.008])  # m


def bar():
    """A strip of 60 x 10 x 3 mm as (vertices, quads)."""
    size = np.array([0.06, 0.01, 0.003])
    corners = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], float) * size
    return corners, np.array([[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]])


def forces(body, young):
    """[N] at each displacement of the end."""
    found = []
    for distance in DISPLACEMENTS:
        scene = (f'material = "strip"\n[materials.strip]\nyoung = "{young:.17g} Pa"\npoisson = 0.35\ndensity = "1200 kg/m3"\n'
                 f'[[fix]]\nwhere = "xmin"\n[[move]]\nwhere = "xmax"\ndisplacement = ["0 m", "0 m", "-{distance:.17g} m"]\n')
        found.append(-flexel.simulate(body, scene, estimate=False, stress=False).reactions["xmax"][2])
    return np.array(found)


def fit(body, measured):
    """(Young's modulus, its standard error) [Pa] by least squares, from a start that is far off."""
    scale = 1e9
    values, covariance = optimize.curve_fit(lambda _, young: forces(body, young * scale), DISPLACEMENTS, measured, p0=[1.0],
                                            sigma=NOISE * measured)
    return values[0] * scale, float(np.sqrt(covariance[0, 0])) * scale


def main():
    body = flexel.voxelize(flexel.Part.from_mesh(*bar(), name="strip"), size="1.5 mm")
    measured = forces(body, TRUE) * (1 + NOISE * np.random.default_rng(1).standard_normal(len(DISPLACEMENTS)))
    print("displacement [mm]  force [N], made by this script")
    for distance, force in zip(DISPLACEMENTS, measured):
        print(f"{1000 * distance:17.1f}  {force:9.4f}")
    young, error = fit(body, measured)
    print(f"Young's modulus {young / 1e9:.3f} +- {error / 1e9:.3f} GPa; the curve was made with {TRUE / 1e9:.3f}")


if __name__ == "__main__":
    main()

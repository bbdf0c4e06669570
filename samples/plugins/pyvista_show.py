"""Bends a part and shows it by PyVista, which is not in Debian 12: pip install pyvista (Debian 13: python3-pyvista).

    python3 pyvista_show.py PART PICTURE.png      held at xmin, pushed down by 100 N at xmax
"""

import sys

import flexel
import numpy as np
import pyvista


def main():
    part, picture = sys.argv[1:]
    result = flexel.deform(part, fix="xmin", push={"xmax": (0, 0, -100)}, material="PLA")
    surface = pyvista.PolyData.from_regular_faces(result.part.vertices, result.part.triangles)
    surface["displacement [mm]"] = 1e3 * np.linalg.norm(result.part.displacement, axis=1)
    surface.plot(scalars="displacement [mm]", off_screen=True, screenshot=picture)
    cells = pyvista.from_meshio(result.body.to_meshio())  # the lattice, with stresses; pyvista.read("body.vtu") gives the same
    print(f"{surface.n_points} vertices, {cells.n_cells} cells, {surface['displacement [mm]'].max():.4g} mm")


main()

#!/usr/bin/python3
"""References of calculix.py: meshes that are ever finer, and finer still where the stress has no bound.

    PATH=build/release/bin:$PATH bench/accuracy/reference.py [--parts DIR] [--sizes MM[,MM...]] [CASE...]

CalculiX's quadratic tetrahedra (C3D10, gmsh) of SIZE in the open, of a sixteenth of it along the edges of the held face, of an eighth (L-bracket: a
sixteenth) along re-entrant edges; in between the size grows with the distance. Circles have 12 elements on the coarsest mesh, and more as
the size falls. Such meshes converge evenly, which even ones do not: at a right angle theirs is the order 1.09 of its
singularity. Prints the mean displacement of the loaded face by size and the limit that Aitken's extrapolation gives the last three. Needs ccx and
gmsh; the finest of the default sizes take minutes and some GB.
"""

import argparse
import itertools
import math
import pathlib
import re
import tempfile

import numpy as np

import calculix
from gmsh_mesh import Mesh

HELD = 1 / 16  # of the size, along the edges of the held face
SLOPE = 0.4  # of the distance to edges
ROUND = 12  # elements around a circle, on the coarsest mesh

GRADING = """
Mesh.CharacteristicLengthExtendFromBoundary = 0; Mesh.CharacteristicLengthFromPoints = 0; Mesh.CharacteristicLengthFromCurvature = {round};
held() = Abs(Boundary{{ Surface{{{held}}}; }});
Field[1] = Distance;
Field[1].CurvesList = {{held()}};
Field[1].NumPointsPerCurve = 400;
Field[2] = Distance;
Field[2].CurvesList = {{{re_entrant}}};
Field[2].NumPointsPerCurve = 400;
Field[3] = MathEval;
Field[3].F = "Min({at_held} + {slope} * F1, {at_re_entrant} + {slope} * F2)";
Background Field = 3;
"""

# Sizes in mm; of the size, along re-entrant edges.
CASES = {
    "L-bracket with a hole": ((5.6, 4, 2.8), 1 / 16),
    "fork (STEP)": ((2.8, 2, 1.4), 1 / 8),
    "featuretype (STEP)": ((16, 11, 8), 1 / 8),
}
SHARP = math.sin(math.radians(30))


def re_entrant_curves(mesh, file):
    """Numbers of gmsh's curves along which the matter fills more than half of the space around, by 30 degrees."""
    solid_at = {}
    for solid in mesh.solids:
        for corners in itertools.combinations([mesh.place[node] for node in solid[:4]], 3):
            solid_at[frozenset(corners)] = solid
    around = {}
    for triangle in mesh.triangles[:, :3]:
        for pair in itertools.combinations(triangle, 2):
            around.setdefault(frozenset(pair), []).append(triangle)

    def middle(nodes):
        return mesh.points[nodes].mean(axis=0)

    def folds_in(pair):
        (one, other), (a, *_) = around[pair], pair
        normal = np.cross(mesh.points[one[1]] - mesh.points[one[0]], mesh.points[one[2]] - mesh.points[one[0]])
        within = middle([mesh.place[node] for node in solid_at[frozenset(one)][:4]]) - middle(one)
        normal *= -np.sign(normal @ within) / np.linalg.norm(normal)
        (across,) = set(other) - pair
        along = mesh.points[list(pair)[1]] - mesh.points[a]
        way = mesh.points[across] - mesh.points[a]
        way -= way @ along / (along @ along) * along
        return normal @ way > SHARP * np.linalg.norm(way)

    found, curve = set(), None
    for line in file.read_text().splitlines():
        if line.startswith("*"):
            name = re.search(r"T3D3, ELSET=LINE(\d+)", line.upper())
            curve = int(name[1]) if name else None
        elif curve:
            _, first, _, last = (int(value) for value in line.replace(",", " ").split())
            pair = frozenset((mesh.place[first], mesh.place[last]))
            if len(around[pair]) == 2 and folds_in(pair):
                found.add(curve)
    return sorted(found)


def singular(case, size):
    """The part's surface that is held, and its re-entrant curves, as gmsh numbers them."""
    with tempfile.TemporaryDirectory() as place:
        mesh = Mesh(case, pathlib.Path(place), size)
        return mesh.surface[case.faces["held"][0](mesh)][0], re_entrant_curves(mesh, pathlib.Path(place) / "mesh.inp")


def values_of(name, sizes):
    ours, along_edges = CASES[name]
    sizes = sizes or ours
    case = calculix.CASES[name]()
    if not case:
        print(f"| {name} | left out: no ../shared/parts |", flush=True)
        return []
    plain = case.geometry
    case.geometry += f"Mesh.CharacteristicLengthFromCurvature = {ROUND};"
    held, re_entrant = singular(case, sizes[0])
    values = []
    for size in sizes:
        case.geometry = plain + GRADING.format(held=held, re_entrant=", ".join(map(str, re_entrant)), at_held=HELD * size, slope=SLOPE,
                                               at_re_entrant=along_edges * size, round=round(ROUND * sizes[0] / size))
        with tempfile.TemporaryDirectory() as place:
            value, seconds, memory, count, _, _ = calculix.calculix(case, pathlib.Path(place), size)
        values.append(value)
        print(f"| {name} | {size:g} | {count:,} | {1e3 * value:.4f} | {seconds:.1f} | {memory:.0f} |", flush=True)
    return values


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--parts", default=calculix.PARTS, type=pathlib.Path)
    arguments.add_argument("--sizes", type=lambda text: [float(each) for each in text.split(",")], metavar="MM[,MM...]")
    arguments.add_argument("names", nargs="*", metavar="CASE", help=", ".join(CASES))
    options = arguments.parse_args()
    if unknown := [name for name in options.names if name not in CASES]:
        arguments.error(f"there is no case \"{unknown[0]}\"; there are {', '.join(CASES)}")
    calculix.PARTS = options.parts
    print("| part | size mm | elements | mean displacement um | s | MB |\n|---|---|---|---|---|---|")
    limits = []
    for name in options.names or CASES:
        values = values_of(name, options.sizes)
        if len(values) > 2:
            limits.append(f"{name}: limit {1e3 * calculix.limit(values):.4g} um")
    print("\n" + "\n".join(limits))


if __name__ == "__main__":
    main()

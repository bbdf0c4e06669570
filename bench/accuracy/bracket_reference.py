#!/usr/bin/python3
"""The reference of the L-bracket in calculix.py: meshes that are ever finer, and finer still where the stress has no bound.

    bench/accuracy/bracket_reference.py [--sizes MM[,MM...]]

CalculiX's quadratic tetrahedra (C3D10, gmsh) of SIZE away from, and an eighth of it along, the bracket's re-entrant edge and the edges of its held
face; in between the size grows with the distance. Such meshes converge evenly, which even ones do not: theirs is the order 1.09 of a right
angle's singularity. Prints the mean displacement of the loaded face by size and the limit that Aitken's extrapolation gives the last
three. Needs ccx and gmsh; the finest of the default sizes takes a minute.
"""

import argparse
import pathlib
import tempfile

import calculix

# Distances to the edge x = z = 8 and to the edges of the held face x = 0, 40 x 60 mm.
GRADING = """
Field[1] = MathEval;
Field[1].F = "{fine} + {slope} * Sqrt((x - 8)^2 + (z - 8)^2)";
Field[2] = MathEval;
Field[2].F = "{fine} + {slope} * Sqrt(x^2 + Min(Min(y, 40 - y), Min(z, 60 - z))^2)";
Field[3] = Min;
Field[3].FieldsList = {{1, 2}};
Background Field = 3;
Mesh.CharacteristicLengthExtendFromBoundary = 0; Mesh.CharacteristicLengthFromPoints = 0; Mesh.CharacteristicLengthFromCurvature = 0;
"""


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--sizes", default="8,5.6,4,2.8")
    sizes = [float(each) for each in arguments.parse_args().sizes.split(",")]
    print("| size mm | elements | mean displacement um | s | MB |\n|---|---|---|---|---|")
    values = []
    for size in sizes:
        case = calculix.bracket()
        case.geometry += GRADING.format(fine=size / 8, slope=0.25)
        with tempfile.TemporaryDirectory() as place:
            value, seconds, memory, count, _ = calculix.calculix(case, pathlib.Path(place), size)
        values.append(value)
        print(f"| {size:g} | {count:,} | {1e3 * value:.4f} | {seconds:.1f} | {memory:.0f} |", flush=True)
    if len(values) > 2:
        print(f"\nlimit {1e3 * calculix.limit(values):.4f} um")


if __name__ == "__main__":
    main()

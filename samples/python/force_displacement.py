#!/usr/bin/python3
"""Bends a STEP part step by step: force against displacement.

    force_displacement.py [PART.step] [OUT.png]

The part is held at its face 1 and moved at its face 2. A curve that is no line shows the large deflection.
"""

import sys

import flexel


def curve(path, displacements, size="4 mm", material="PLA"):
    """[N] that each displacement [m] of face 2 along -z takes."""
    body = flexel.voxelize(path, size=size)
    name = body.parts[0]["name"]
    forces = []
    for distance in displacements:
        result = flexel.simulate(body, fix=f"{name}/1", move={f"{name}/2": (0, 0, -distance)}, material=material, estimate=False)
        forces.append(-result.reactions[f"{name}/2"][2])
    return forces


def main():
    path = sys.argv[1] if len(sys.argv) > 1 else "bracket.step"
    displacements = [0.001 * n for n in range(1, 6)]
    forces = curve(path, displacements)
    print("displacement [mm]  force [N]")
    for distance, force in zip(displacements, forces):
        print(f"{1000 * distance:17.1f}  {force:9.2f}")
    if len(sys.argv) < 3:
        return
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(6, 4))
    axes.plot([1000 * each for each in displacements], forces, marker="o")
    axes.set(xlabel="displacement [mm]", ylabel="force [N]", title=path, xlim=(0, None), ylim=(0, None))
    figure.savefig(sys.argv[2], dpi=150)


if __name__ == "__main__":
    main()

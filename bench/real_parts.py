#!/usr/bin/env python3
"""Every closed real part through the whole chain at the size that gives three cells in its thinnest wall, and again at half the
spacing: cells, seconds, displacement of the loaded end, and how far the two answers are apart.

    PATH=build/release/bin:$PATH bench/real_parts.py [--parts DIR] [--max-cells N] [NAME...]

--max-cells bounds the finer of the two runs (default 400,000 cells, about 1.8 GB); a part that needs more runs coarser, and its
row says how many cells three in the thinnest wall would take. Each part is held at the lowest tenth of its longest axis and drawn
sideways at the highest tenth; a part of several solids is held and drawn solid by solid. Exit code 1 when a part fails or its two
answers are more than 15 % apart.
"""

import argparse
import json
import pathlib
import subprocess
import sys
import tempfile
import time

UNITS = {"ADIS16480.STL": "m", "conrod.stl": "in", "spot_triangulated.obj": "m", "spot_quadrangulated.obj": "m"}
PARTS = ["4040_base_mount.step", "Moving_Jaw_SO101.step", "base_interface_AP203.STEP", "featuretype.STEP",
         "lower_leg_structure_fork.STEP", "red_cube_blue_cylinder.step", "ADIS16480.STL", "Springy_Trigger.STL", "conrod.stl",
         "hip_aa_module_shell_cover.STL", "hook.stl", "lower_leg_structure_200mm.STL", "lower_leg_structure_fork.STL",
         "transmission_pulley_at3_t30_output.STL", "quadknot.obj", "spot_quadrangulated.obj", "spot_triangulated.obj"]


def texts(values, unit=""):
    return "[" + ", ".join(f'"{value:.9g} {unit}"' if unit else f"{value:.9g}" for value in values) + "]"


def draw(solid):
    """The tables that hold and draw one solid: 10 kPa over the square of its shortest side."""
    low, high = solid["min"], solid["max"]
    sizes = [b - a for a, b in zip(low, high)]
    along = sizes.index(max(sizes))
    side = (along + 1) % 3
    axis = [1.0 if k == along else 0.0 for k in range(3)]
    point = lambda share: texts([a + share * sizes[along] if k == along else a for k, a in enumerate(low)], "m")
    within = lambda p, n: f'{{ half_space = {{ point = {p}, normal = {n} }} }}'
    held = within(point(0.1), texts([-x for x in axis]))
    drawn = within(point(0.9), texts(axis))
    force = texts([1e4 * min(sizes) ** 2 if k == side else 0.0 for k in range(3)], "N")
    return f'[[fix]]\nwhere = {held}\n[[load]]\nwhere = {drawn}\nforce = {force}\n[[probe]]\nname = "end"\nwhere = {drawn}\n'


def tables(info):
    solids = [solid for file in info["files"] for solid in file["parts"]]
    if len(solids) == 1:
        return draw(solids[0])
    blocks = []
    for solid in solids:  # several solids share the half-spaces of their own boxes only when they are far apart: use faces
        name = solid["name"]
        blocks.append(f'[[fix]]\nwhere = "{name}/1"\n[[load]]\nwhere = "{name}/2"\nforce = ["0 N", "0 N", "-1 N"]\n'
                      f'[[probe]]\nname = "{name}"\nwhere = "{name}/2"\n')
    return "".join(blocks)


def chain(part, unit, size, scene, folder):
    """Runs the pipe; gives the summary and the wall seconds."""
    summary, mapped = folder / "summary.json", folder / "out.stl"
    began = time.monotonic()
    command = (f'set -o pipefail; flexel-voxelize "{part}" {unit} --size "{size:.9g} m" --edge "{4 * size:.9g} m" --quiet | '
               f'flexel-simulate "{scene}" --summary "{summary}" --quiet | flexel-map --format stl --quiet --strict > "{mapped}"')
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, timeout=1500)
    if done.returncode:
        raise RuntimeError((done.stderr.strip().splitlines() or ["no message"])[-1])
    return json.loads(summary.read_text()), time.monotonic() - began


def displacement(summary):
    return [sum(x * x for x in probe["displacement"]) ** 0.5 for probe in summary["probes"]]


def row(part, max_cells, folder):
    unit = f'--unit {UNITS[part.name]}' if part.name in UNITS else ""
    info = json.loads(subprocess.run(["bash", "-c", f'flexel info "{part}" --json {unit}'], capture_output=True, check=True).stdout)
    solids = [solid for file in info["files"] for solid in file["parts"]]
    wall = min(solid["thinnest_wall"]["thickness"] for solid in solids if solid["thinnest_wall"])
    volume = sum(abs(solid["volume"]) for solid in solids)
    size, coarser = wall / 3, ""
    if 8 * volume / size**3 > max_cells:
        coarser = f"  (three cells in {wall * 1e3:.3g} mm would take {volume / size**3:.3g} cells, eight times that at half)"
        size = (8 * volume / max_cells) ** (1 / 3)
    scene = folder / "draw.toml"
    scene.write_text('material = "PLA"\n' + tables(info))
    coarse, t1 = chain(part, unit, size, scene, folder)
    fine, t2 = chain(part, unit, size / 2, scene, folder)
    apart = max(abs(a / b - 1) for a, b in zip(displacement(coarse), displacement(fine)))
    print(f'{part.name:40} {size * 1e3:8.3g} {coarse["cells"]:9,} {t1:7.1f} {fine["cells"]:10,} {t2:7.1f} '
          f'{max(displacement(fine)) * 1e6:11.4g} {apart * 100:7.1f}{coarser}', flush=True)
    return apart <= 0.15


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--parts", default=pathlib.Path(__file__).resolve().parent.parent / "../shared/parts", type=pathlib.Path)
    arguments.add_argument("--max-cells", default=400000, type=int)
    arguments.add_argument("names", nargs="*")
    options = arguments.parse_args()
    print(f'{"part":40} {"h mm":>8} {"cells":>9} {"s":>7} {"cells h/2":>10} {"s":>7} {"end um h/2":>11} {"apart %":>7}')
    good = True
    for name in options.names or PARTS:
        with tempfile.TemporaryDirectory() as folder:
            try:
                good &= row(options.parts / name, options.max_cells, pathlib.Path(folder))
            except (RuntimeError, subprocess.SubprocessError) as error:
                good = False
                print(f"{name:40} failed: {error}", flush=True)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())

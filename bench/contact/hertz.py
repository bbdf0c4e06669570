"""Force against indentation of an elastic ball, as Hertz has it: prints the table of docs/theory/contact-mechanics.md.

    python3 bench/contact/hertz.py build/release/bin [cells of the radius [radius of the contact, in cells]]

A quarter of the lower half of a ball of 10 mm, held on its planes of symmetry, that a flat rigid tool presses from
below: half of a ball between two plates. The force is compared at one indentation d with Hertz (1882),
F = 4/3 E' sqrt(R d^3), E' = E / (1 - nu^2), and with what Tatara (1991) adds for the ball's far half,
d = 3 (1 - nu^2) F / (4 E a) - f F / (pi E), f = 2 (1 + nu) R^2 / (a^2 + 4 R^2)^(3/2) + (1 - nu^2) / (a^2 + 4 R^2)^(1/2),
a^3 = 3 (1 - nu^2) F R / (4 E).
"""

import json
import math
import os
import struct
import subprocess
import sys
import tempfile

RADIUS, YOUNG, POISSON, DENSITY = 10e-3, 1e6, 0.3, 1000.0


def quarter_ball(rings):
    """Triangles [mm] of the part of a ball with x, y > 0 and z < 0."""

    def at(i, j):
        polar, around = math.pi / 2 * i / rings, math.pi / 2 * j / rings
        x = 0.0 if j == rings else math.sin(polar) * math.cos(around)
        return tuple(1e3 * RADIUS * c for c in (x, math.sin(polar) * math.sin(around), 0.0 if i == rings else -math.cos(polar)))

    triangles = []
    for i in range(rings):
        for j in range(rings):
            triangles.append((at(i, j), at(i + 1, j + 1), at(i + 1, j)))
            if i > 0:
                triangles.append((at(i, j), at(i, j + 1), at(i + 1, j + 1)))
        triangles.append(((0, 0, 0), at(i, 0), at(i + 1, 0)))
        triangles.append(((0, 0, 0), at(i + 1, rings), at(i, rings)))
    triangles += [((0, 0, 0), at(rings, j), at(rings, j + 1)) for j in range(rings)]
    return triangles


def box(low, high):
    corners = [(x, y, z) for z in (low[2], high[2]) for y in (low[1], high[1]) for x in (low[0], high[0])]
    quads = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))
    return [(corners[a], corners[b], corners[c]) for q in quads for a, b, c in (q[:3], (q[0], q[2], q[3]))]


def write_stl(path, triangles):
    with open(path, "wb") as file:
        file.write(bytes(80) + struct.pack("<I", len(triangles)))
        for triangle in triangles:
            file.write(struct.pack("<12fH", 0, 0, 0, *[c for corner in triangle for c in corner], 0))


def scene(indentation, slowness):
    """`slowness`: of the pressing, in times that sound takes through the radius."""
    unit = RADIUS / math.sqrt(YOUNG / DENSITY)
    return f"""material = "gum"
[materials.gum]
young = "{YOUNG} Pa"
poisson = {POISSON}
density = "{DENSITY} kg/m3"
[contact]
self = false
[damping]
time = "{0.5 * unit:.6g} s"
[[fix]]
where = "ball/xmin"
axes = "x"
[[fix]]
where = "ball/ymin"
axes = "y"
[[fix]]
where = "ball/zmax"
axes = "z"
[[manipulator]]
part = "plate"
time = ["0 s", "{slowness * unit:.6g} s"]
displacement = [["0 mm", "0 mm", "0 mm"], ["0 mm", "0 mm", "{1e3 * indentation} mm"]]
[run]
time = "{1.5 * slowness * unit:.6g} s"
"""


def measured(programs, cells, contact_cells, slowness=30):
    """Indentation [m] and force [N] of the whole ball; works in the present folder."""
    spacing = RADIUS / cells
    indentation = (contact_cells * spacing) ** 2 / RADIUS
    write_stl("ball.stl", quarter_ball(min(4 * cells, 120)))
    wide, low = 1e3 * (2.2 * contact_cells + 2) * spacing, -1e3 * RADIUS
    write_stl("plate.stl", box((-2e3 * spacing, -2e3 * spacing, low - 2e3 * spacing), (wide, wide, low)))
    with open("hertz.toml", "w", encoding="utf-8") as file:
        file.write(scene(indentation, slowness))
    tool = lambda name: os.path.join(programs, name)
    subprocess.run([tool("flexel-voxelize"), "ball.stl", "plate.stl", "--size", f"{1e3 * spacing} mm", "-o", "ball.vtu", "--quiet"], check=True)
    subprocess.run([tool("flexel-simulate"), "hertz.toml", "ball.vtu", "-o", "pressed.vtu", "--summary", "summary.json", "--quiet"], check=True)
    with open("summary.json", encoding="utf-8") as file:
        reactions = json.load(file)["reactions"]
    return indentation, 4 * next(abs(each["force"][2]) for each in reactions if each["name"] == "plate")


def hertz(indentation):
    return 4 / 3 * YOUNG / (1 - POISSON**2) * math.sqrt(RADIUS * indentation**3)


def tatara(indentation):
    def depth(force):
        a = (3 * (1 - POISSON**2) * force * RADIUS / (4 * YOUNG)) ** (1 / 3)
        far = a * a + 4 * RADIUS**2
        f = 2 * (1 + POISSON) * RADIUS**2 / far**1.5 + (1 - POISSON**2) / far**0.5
        return 3 * (1 - POISSON**2) * force / (4 * YOUNG * a) - f * force / (math.pi * YOUNG)

    low, high = 0.0, 10 * hertz(indentation)
    for _ in range(80):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if depth(middle) < indentation else (low, middle)
    return low


def main():
    programs = os.path.abspath(sys.argv[1])
    cases = [(20, 4), (32, 4), (32, 6)]
    if len(sys.argv) > 2:
        cases = [(int(sys.argv[2]), float(sys.argv[3]) if len(sys.argv) > 3 else 4)]
    print("| R/h | a/h | F/Hertz | F/Tatara |\n|---|---|---|---|")
    for cells, contact in cases:
        with tempfile.TemporaryDirectory() as folder:
            os.chdir(folder)
            indentation, force = measured(programs, cells, contact)
            print(f"| {cells} | {contact} | {force / hertz(indentation):.3f} | {force / tatara(indentation):.3f} |", flush=True)
            os.chdir("/")


if __name__ == "__main__":
    main()

"""Stresses of model `quadratic` at the part's own surface: known answers, bars, and one figure in summary, body and mapped file."""

import json
import math
import pathlib

from harness import SCENE, Skip, ascii_stl, box_triangles, expect, expect_error, expect_ok, main, run, write

MATERIAL = """material = "m"
model = "quadratic"
[materials.m]
young = "210 GPa"
poisson = 0.3
density = "7800 kg/m3"
yield = "100 MPa"
"""
QUARTER = """[[fix]]
where = "start"
axes = "y"
[[fix]]
where = "end"
axes = "x"
"""
PLANE = """[[fix]]
where = "bottom"
axes = "z"
[[fix]]
where = "top"
axes = "z"
"""
INSIDE = """[[load]]
where = "inner"
pressure = "10 MPa"
"""


def arc(a, b):
    """A quarter of an ellipse from (a, 0) to (0, b)."""
    return lambda s: (a * math.cos(s * math.pi / 2), b * math.sin(s * math.pi / 2))


def square(side):
    def point(s):
        angle = s * math.pi / 2
        scale = side / max(math.cos(angle), math.sin(angle))
        return (scale * math.cos(angle), scale * math.sin(angle))
    return point


def quarter(name, inner, outer, height, steps=32):
    """OBJ of the matter between two curves, with groups inner, outer, start (y = 0), end (x = 0), bottom and top."""
    lines = ["v {:.12g} {:.12g} {:.12g}".format(*curve(s / steps), z) for s in range(steps + 1) for curve in (inner, outer) for z in (0, height)]
    at = lambda s, outside, above: 4 * s + 2 * outside + above + 1
    quads = {"inner": [(at(s, 0, 0), at(s, 0, 1), at(s + 1, 0, 1), at(s + 1, 0, 0)) for s in range(steps)],
             "outer": [(at(s, 1, 0), at(s + 1, 1, 0), at(s + 1, 1, 1), at(s, 1, 1)) for s in range(steps)],
             "bottom": [(at(s, 0, 0), at(s + 1, 0, 0), at(s + 1, 1, 0), at(s, 1, 0)) for s in range(steps)],
             "top": [(at(s, 0, 1), at(s, 1, 1), at(s + 1, 1, 1), at(s + 1, 0, 1)) for s in range(steps)],
             "start": [(at(0, 0, 0), at(0, 1, 0), at(0, 1, 1), at(0, 0, 1))],
             "end": [(at(steps, 0, 0), at(steps, 0, 1), at(steps, 1, 1), at(steps, 1, 0))]}
    for group, faces in quads.items():
        lines += [f"g {group}"] + ["f " + " ".join(map(str, face)) for face in faces]
    return write(name, "\n".join(lines) + "\n")


def solve(part, size, scene, *options):
    write("scene.toml", scene)
    expect_ok(run("flexel-voxelize", part, "--size", size, "--align", "none", "--moments", "-o", "body.vtu"))
    done = expect_ok(run("flexel-simulate", "scene.toml", "body.vtu", "-o", "bent.vtu", "--summary", "s.json", *options))
    return json.loads(pathlib.Path("s.json").read_text()), done


def mapped(meshio):
    expect_ok(run("flexel-map", "bent.vtu", "--attributes", "-o", "mapped.vtu"))
    return meshio.read("mapped.vtu")


def has_meshio():
    try:
        import meshio
    except ImportError as error:
        raise Skip("meshio is not installed") from error
    return meshio


def test_tube_under_pressure():
    """Radii 20 and 40, plane strain, some six cells through the wall that do not follow it: Lame's largest von Mises stress."""
    part = quarter("tube.obj", arc(20, 20), arc(40, 40), 10)
    hoop, radial = 10 * 2000 / 1200, -10
    axial = 0.3 * (hoop + radial)
    true = 1e6 * math.sqrt(0.5 * ((hoop - radial)**2 + (radial - axial)**2 + (axial - hoop)**2))
    summary, _ = solve(part, "3.4 mm", MATERIAL + QUARTER + PLANE + INSIDE)
    found, bar = summary["largest_von_mises"], summary["error_bars"]["largest_von_mises"]["bar"]
    expect(abs(found / true - 1) < 0.01, f"{found} against {true}")
    expect(bar is not None and abs(found - true) < bar < 0.1 * true, f"{found} +- {bar} against {true}")


def test_stress_along_the_whole_inner_face_of_a_tube():
    """Principal stresses at every vertex of the inner face: the pressure, but for facets of 2.8 degrees, and the hoop stress within 2 %."""
    meshio = has_meshio()
    part = quarter("tube.obj", arc(20, 20), arc(40, 40), 10)
    solve(part, "3.4 mm", MATERIAL + QUARTER + PLANE + INSIDE, "--no-estimate")
    mesh = mapped(meshio)
    inner = [k for k, (x, y, z) in enumerate(mesh.points - 1e3 * mesh.point_data["displacement"]) if abs(math.hypot(x, y) - 20) < 1e-6]
    expect(len(inner) == 66, len(inner))
    for k in inner:
        first, _, last = mesh.point_data["principal_stress"][k]
        expect(abs(first / 1e6 - 50 / 3) < 0.02 * 50 / 3 and abs(last + 10e6) < 1e5, f"{mesh.points[k]}: {first}, {last}")


def test_plate_with_a_hole():
    """A plate of 100 x 100 with a hole of radius 5, three cells a radius, drawn in plane strain: 27.43 MPa (CalculiX's CPE8, bench/accuracy/stresses.py)."""
    part = quarter("hole.obj", arc(5, 5), square(50), 5)
    summary, _ = solve(part, "1.7 mm", MATERIAL + QUARTER + PLANE + '[[load]]\nwhere = "xmax"\npressure = "-10 MPa"\n', "--no-estimate")
    expect(abs(summary["largest_von_mises"] / 27.43e6 - 1) < 0.03, summary["largest_von_mises"])
    x, y, _ = summary["largest_von_mises_at"]
    expect(abs(math.hypot(x, y) - 5e-3) < 2e-5 and x < 1e-3, (x, y))


def look_closer(part, size, scene, *options):
    write("scene.toml", scene)
    done = expect_ok(run("flexel", "deform", part, "--scene", "scene.toml", "--size", size, "--refine-stress", "--summary", "s.json", "-o", "bent.vtu", "--verbose", *options))
    return json.loads(pathlib.Path("s.json").read_text())["simulate"], done


def test_a_closer_look_at_a_hole():
    """The same plate with one cell a radius: within 3 %, with a narrow bar, and one figure in summary, body and mapped file."""
    meshio = has_meshio()
    part = quarter("hole.obj", arc(5, 5), square(50), 5)
    summary, done = look_closer(part, "5 mm", MATERIAL + QUARTER + PLANE + '[[load]]\nwhere = "xmax"\npressure = "-10 MPa"\n')
    found, bar = summary["largest_von_mises"], summary["error_bars"]["largest_von_mises"]["bar"]
    expect(abs(found / 27.43e6 - 1) < 0.03, found)
    expect(bar is not None and abs(found - 27.43e6) < bar < 0.05 * found, f"{found} +- {bar}")
    expect(abs(summary["largest_von_mises_yield_share_bar"] / (bar / 100e6) - 1) < 1e-12, summary["largest_von_mises_yield_share_bar"])
    local = summary["largest_von_mises_local"]
    expect(local["values"][0] == found and local["values"][-1] < 0.9 * found, local)
    expect("looked at closer" in done.out.decode() + done.err, done)
    expect(abs(max(meshio.read("bent.vtu").point_data["von_mises"]) / found - 1) < 1e-9, "the body's largest")
    expect(abs(max(mapped(meshio).point_data["von_mises"]) / found - 1) < 1e-9, "the mapped surface's largest")


def channel(name, width, floor, top, length, radii, middle):
    """Walls of 6 along z, with fillets of these radii at their feet, each of its own facets; groups: held, left (its top), middle (of the right top)."""
    left, right = radii
    corner = lambda radius, centre, k, steps: (centre - radius * math.sin(0.5 * math.pi * k / steps), floor + radius - radius * math.cos(0.5 * math.pi * k / steps))
    mine = [corner(left, 6 + left, k, 24) for k in range(25)]  # from the floor up
    other = [(width - x, y) for x, y in (corner(right, 6 + right, k, 8) for k in range(9))]
    outline = [(0, 0), (width, 0), (width, floor), (width, floor + right), (width, top), (width - 6, top), *other[::-1], *mine, (6, top), (0, top), (0, floor + left), (0, floor)]
    n = len(outline)
    first_other, first_mine = 6, 6 + len(other)
    end = first_mine + len(mine)  # of the fillets: (6, top)
    caps = [[0, 1, 2, first_mine - 1, first_mine, n - 1], [3, 4, 5, first_other], [n - 2, end - 1, end, end + 1], [2, 3, first_other], [n - 1, end - 1, n - 2]]
    caps += [[2, k, k + 1] for k in range(first_other, first_mine - 1)] + [[n - 1, k, k + 1] for k in range(first_mine, end - 1)]
    vertices = [(x, y, z) for z in (0, length) for x, y in outline] + [(x, top, z) for z in middle for x in (width, width - 6)]
    a, b, c, d = range(2 * n, 2 * n + 4)
    sides = {k: [k, (k + 1) % n, (k + 1) % n + n, k + n] for k in range(n)}
    groups = {"held": [sides.pop(0)], "left": [sides.pop(end)], "middle": [[a, b, d, c]]}
    del sides[4]
    sides[3] = [3, 4, a, c, 4 + n, 3 + n]
    sides[5] = [6, 6 + n, 5 + n, d, b, 5]
    groups["body"] = [*sides.values(), [4, 5, b, a], [c, d, 5 + n, 4 + n], *(face[::-1] for face in caps), *([k + n for k in face] for face in caps)]
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in vertices]
    for group, faces in groups.items():
        lines += [f"g {group}"] + ["f " + " ".join(str(k + 1) for k in face) for face in faces]
    return write(name, "\n".join(lines) + "\n")


def test_a_closer_look_at_a_fillet_whose_vertices_are_at_its_ends():
    """The small fillet has its peak in the middle of edges that run from end to end; what the run finds largest is at the wide one, and less than that."""
    part = channel("channel.obj", 36, 12, 32, 72, (9, 0.8), (28, 44))
    scene = MATERIAL + '[[fix]]\nwhere = "held"\n[[load]]\nwhere = "left"\nforce = ["-1000 N", 0, 0]\n[[load]]\nwhere = "middle"\nforce = ["250 N", 0, 0]\n'
    summary, _ = look_closer(part, "4 mm", scene, "--no-estimate")
    x, _, z = summary["largest_von_mises_at"]
    expect(x > 0.029 and abs(z - 0.036) < 0.004, (x, z))
    expect(summary["largest_von_mises_local"]["values"][-1] < 0.5 * summary["largest_von_mises"], summary)


def test_a_closer_look_beside_a_clamp_finds_no_limit():
    part = write("bar.stl", ascii_stl(box_triangles((60, 10, 10))))
    summary, done = look_closer(part, "4 mm", MATERIAL + '[[fix]]\nwhere = "xmin"\n[[load]]\nwhere = "xmax"\nforce = [0, 0, "-10 N"]\n')
    expect(summary["largest_von_mises_beside"] == "a support", summary)
    expect(summary["error_bars"]["largest_von_mises"]["bar"] is None, summary["error_bars"])
    expect(summary["largest_von_mises_local_none"] == "it lies beside a support, and farther away none comes to a limit", summary)
    expect("not looked at closer: it lies beside a support" in done.out.decode() + done.err, done)


def test_a_closer_look_at_the_edge_of_a_punch_finds_no_limit():
    """A block pressed down on a half of its upper side, which cannot rise: at the end of that half the pressure has no limit."""
    part = quarter("block.obj", lambda s: (40 - 40 * s, 0), lambda s: (40 - 40 * s, 20), 20, 8)
    lines = pathlib.Path(part).read_text().splitlines()
    after = lines.index("g outer") + 4
    pathlib.Path(part).write_text("\n".join(lines[:after + 1] + ["g free"] + lines[after + 1:]) + "\n")
    scene = MATERIAL + PLANE + '[[fix]]\nwhere = "start"\naxes = "x"\n[[fix]]\nwhere = "outer"\naxes = "y"\n[[load]]\nwhere = "inner"\npressure = "10 MPa"\n'
    summary, done = look_closer(part, "5.3 mm", scene)
    expect("largest_von_mises_local" in summary, summary)
    expect(summary["error_bars"]["largest_von_mises"]["bar"] is None, summary)
    expect("does not converge" in done.out.decode() + done.err, done)


def test_a_closer_look_is_refused_by_name():
    part = write("bar.stl", ascii_stl(box_triangles((60, 10, 10))))
    common = ("flexel", "deform", part, "--fix", "xmin", "--material", "steel", "--size", "4 mm", "--refine-stress", "-o", "bent.stl")
    expect_error(run(*common, "--push", "xmax: 0 0 -10 N", "--model", "cells"), "flexel", '--refine-stress is for model "quadratic": add --model quadratic')
    expect_error(run(*common[:7], *common[9:], "--push", "xmax: 0 0 -10 N", "--model", "quadratic", "--within", "9s"), "flexel",
                 "--refine-stress takes time of its own: leave --within out")
    linked = MATERIAL + '[[fix]]\nwhere = "xmin"\n[[load]]\nwhere = "xmax"\nforce = [0, 0, "-10 N"]\nlink = "rigid"\n'
    write("linked.toml", linked)
    expect_error(run("flexel", "deform", part, "--scene", "linked.toml", "--size", "4 mm", "--refine-stress", "-o", "bent.stl"), "flexel",
                 "the closer look at the largest stress does not take rigid links and rigid parts")
    # before the search for a size, which would be stopped
    expect_error(run("flexel", "deform", part, "--scene", "linked.toml", "--accuracy", "0.001%", "--timeout", "30s", "--refine-stress", "-o", "bent.stl"), "flexel",
                 "the closer look at the largest stress does not take rigid links and rigid parts")


def test_nafems_le1():
    """sigma_yy at D of the elliptic membrane: 92.7 MPa."""
    meshio = has_meshio()
    part = quarter("le1.obj", arc(2000, 1000), arc(3250, 2750), 100, 48)
    solve(part, "100 mm", MATERIAL + QUARTER + '[[fix]]\nwhere = "bottom"\naxes = "z"\n[[load]]\nwhere = "outer"\npressure = "-10 MPa"\n', "--no-estimate")
    mesh = mapped(meshio)
    rest = mesh.points - 1e3 * mesh.point_data["displacement"]
    point = min(range(len(rest)), key=lambda k: math.dist(rest[k], (2000, 0, 0)))
    expect(abs(mesh.point_data["principal_stress"][point][0] / 92.7e6 - 1) < 0.02, mesh.point_data["principal_stress"][point])


def test_one_figure_everywhere():
    """The largest of the body's column and of the mapped vertices are the summary's; without --attributes the file is as it was."""
    meshio = has_meshio()
    part = quarter("tube.obj", arc(20, 20), arc(40, 40), 10)
    summary, _ = solve(part, "7 mm", MATERIAL + QUARTER + PLANE + INSIDE, "--no-estimate")
    largest = summary["largest_von_mises"]
    body = meshio.read("bent.vtu")
    expect(max(body.point_data["von_mises"]) == largest, (max(body.point_data["von_mises"]), largest))
    mesh = mapped(meshio)
    expect(max(mesh.point_data["von_mises"]) == largest, (max(mesh.point_data["von_mises"]), largest))
    shares = mesh.point_data["yield_share"]
    expect(abs(max(shares) / summary["largest_von_mises_yield_share"] - 1) < 1e-12, max(shares))
    expect_ok(run("flexel-map", "bent.vtu", "-o", "plain.ply"))
    expect(b"von_mises" not in pathlib.Path("plain.ply").read_bytes(), "a column that nobody asked for")


def test_stresses_of_an_earlier_run_go():
    part = quarter("tube.obj", arc(20, 20), arc(40, 40), 10, 8)
    solve(part, "7 mm", MATERIAL + QUARTER + PLANE + INSIDE, "--no-estimate")
    expect_ok(run("flexel-simulate", "scene.toml", "bent.vtu", "--no-stress", "--no-estimate", "-o", "again.vtu"))
    expect(b"von_mises" not in pathlib.Path("again.vtu").read_bytes(), "stresses of the run before")


def test_supports_of_elements_press_as_those_of_faces():
    """A cube held across five faces, pressed on the sixth: s_xx = s_yy = nu / (1 - nu) p, whether sides or boxes select what is held."""
    part = write("cube.stl", ascii_stl(box_triangles((10, 10, 10))).decode())
    material = """model = "quadratic"
material = "m"
[materials.m]
young = "1 GPa"
poisson = 0.45
density = "1000 kg/m3"
[[load]]
where = "zmax"
pressure = "1 MPa"
"""
    for how in ("side", "box"):
        scene = material
        for axis, side, low, high in (("x", "xmin", (-1, -1, -1), (.1, 11, 11)), ("x", "xmax", (9.9, -1, -1), (11, 11, 11)),
                                      ("y", "ymin", (-1, -1, -1), (11, .1, 11)), ("y", "ymax", (-1, 9.9, -1), (11, 11, 11)),
                                      ("z", "zmin", (-1, -1, -1), (11, 11, .1))):
            corner = lambda at: "[" + ", ".join(f'"{value} mm"' for value in at) + "]"
            where = f'"{side}"' if how == "side" else f"{{ box = {{ min = {corner(low)}, max = {corner(high)} }} }}"
            scene += f'[[fix]]\nwhere = {where}\naxes = "{axis}"\n'
        summary, _ = solve(part, "2.5 mm", scene, "--no-estimate")
        true = 1e6 * (1 - .45 / .55)
        expect(abs(summary["largest_von_mises"] / true - 1) < 1e-4, (how, summary["largest_von_mises"], true))


def test_a_column_of_the_part_is_not_replaced_in_silence():
    corners = [(x, y, z) for z in (0, 10) for y in (0, 10) for x in (0, 40)]
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    head = ["ply", "format ascii 1.0", "element vertex 8"] + [f"property double {name}" for name in ("x", "y", "z", "von_mises")]
    head += ["element face 6", "property list uchar int vertex_indices", "end_header"]
    lines = head + [f"{x} {y} {z} 7" for x, y, z in corners] + ["4 " + " ".join(map(str, quad)) for quad in quads]
    part = write("own.ply", "\n".join(lines) + "\n")
    _, done = solve(part, "5 mm", 'model = "quadratic"\n' + SCENE, "--no-estimate")
    expect('column "von_mises" is replaced' in done.err, done)
    again = expect_ok(run("flexel-simulate", "scene.toml", "bent.vtu", "--no-estimate", "-o", "again.vtu"))
    expect("is replaced" not in again.err, again)


if __name__ == "__main__":
    main(globals())

"""Elements at the centres of voxels, through the whole pipe: voxelize --placement centre, simulate with model paper, map."""

import json
import struct

import meshio

from harness import ascii_stl, binary_stl, box, body, box_triangles, expect, expect_error, expect_ok, main, run, scene, write
from shapes import turn, turned

SCENE = """[parts.box]
material = "PLA"
{}
[[fix]]
where = "xmin"
[[load]]
where = "xmax"
force = ["0 N", "0 N", "-100 N"]
[[probe]]
name = "tip"
at = ["40 mm", "10 mm", "10 mm"]
"""


def centres(name="centres.vtu", size="1.25 mm"):
    expect_ok(run("flexel-voxelize", box(), "--size", size, "--placement", "centre", "-o", name))
    return name


def vertices_of(stl):
    data = open(stl, "rb").read()
    (count,) = struct.unpack_from("<I", data, 80)
    return [struct.unpack_from("<3f", data, 84 + 50 * t + 12 + 12 * v) for t in range(count) for v in range(3)]


def simulate(text, *options):
    expect_ok(run("flexel-simulate", scene("bend.toml", text), "centres.vtu", "-o", "bent.vtu", "--summary", "summary.json", *options))
    return json.load(open("summary.json"))


def wedge(name, mirrored):
    """40 x 20 x 40 mm with a face at 45 degrees, which passes through the centres of voxels of 5 mm."""
    outline = [(0, 0), (40, 0), (0, 40)]
    if mirrored:
        outline = [(40 - x, z) for x, z in reversed(outline)]
    near, far = ([(x, y, z) for x, z in outline] for y in (0, 20))
    triangles = [near, far[::-1]]
    for i in range(3):
        j = (i + 1) % 3
        triangles += [(near[j], near[i], far[i]), (near[j], far[i], far[j])]
    write(f"{name}.stl", binary_stl(triangles))
    expect_ok(run("flexel-voxelize", f"{name}.stl", "--size", "5 mm", "--placement", "centre", "-o", f"{name}.vtu"))
    return {tuple(round(1e4 * x) for x in point) for point in meshio.read(f"{name}.vtu").points}


def test_where_a_part_lies_decides_nothing():
    """Points of a loaded face lie half-way between elements here: they go with both, whatever rounding says."""
    found = []
    still = turn(0, (0, 0, 1))
    for rotation, shift in ((still, (0, 0, 0)), (still, (1, 2, 3)), (still, (.3, -.7, .1)), (turn(90, (0, 0, 1)), (0, 0, 0)),
                            (turn(120, (1, 1, 1)), (.1, .2, .3)), (turn(180, (1, 0, 0)), (0, 0, 0))):
        moved = [[tuple(a + b for a, b in zip(turned(rotation, corner), shift)) for corner in triangle] for triangle in box_triangles((60.0, 20.0, 10.0))]
        write("bar.stl", ascii_stl(moved))
        expect_ok(run("flexel-voxelize", "bar.stl", "--size", "5 mm", "--placement", "centre", "-o", "centres.vtu"))
        along = max(range(3), key=lambda i: abs(rotation[i][0]))
        low, high = ("min", "max") if rotation[along][0] > 0 else ("max", "min")
        force = [f"{round(100 * row[0])} N" for row in rotation]
        text = f'material = "steel"\n[[fix]]\nwhere = "{"xyz"[along]}{low}"\n[[load]]\nwhere = "{"xyz"[along]}{high}"\nforce = {force}\n'
        found.append([simulate(text, "--no-estimate")[key] for key in ("largest_displacement", "elastic_energy")])
    for other in found[1:]:
        expect(all(abs(b / a - 1) < 1e-6 for a, b in zip(found[0], other)), f"a pulled bar, shifted and turned: {found}")


def test_mirrored_parts_have_mirrored_elements():
    one, other = wedge("one", False), wedge("other", True)
    expect(len(one) == len(other) == 4 * 36, f"{len(one)} and {len(other)} elements")
    expect({(400 - x, y, z) for x, y, z in one} == other, "elements at mirrored places")


def test_every_voxel_of_an_aligned_box_has_an_element():
    for size, count in (("5 mm", 32), ("2.5 mm", 256), ("1.25 mm", 2048)):
        result = expect_ok(run("flexel-voxelize", box(), "--size", size, "--placement", "centre", "-o", "body.vtu"))
        expect(f"{count:,} elements" in result.err, f"{count} elements at {size}: {result}")


def test_bends_and_maps():
    centres()
    summary = simulate(SCENE.format(""))
    expect(summary["elements"] == 2048 and summary["cells"] == 0, f"elements: {summary['elements']}")
    expect(abs(summary["mass"] - 1240 * 4e-6) < 1e-12, f"mass: {summary['mass']}")
    expect("smallest_corner_jacobian" not in summary and 0.9 < summary["smallest_jacobian"] < 1, "J around the elements")
    tip = summary["probes"][0]["displacement"]
    expect(max(map(abs, summary["imbalance"])) < 1e-5, f"imbalance: {summary['imbalance']}")
    result = expect_ok(run("flexel-map", "bent.vtu", "--keep-vertices", "-o", "bent.stl", "--report", "report.json"))
    failures = json.load(open("report.json"))["failures"]
    expect(failures["inverted"] == failures["degenerate"] == failures["not_finite"] == 0, f"invalid mapping: {result}")
    # The vertices lie half a voxel outside the elements. The one at the probe goes where the probe goes, to a percent.
    moved = [[b - a for a, b in zip(rest, now)] for rest, now in zip(vertices_of("box.stl"), vertices_of("bent.stl"))
             if rest == (40.0, 10.0, 10.0)]
    expect(moved, "no vertex at the probe")
    for way in moved:
        expect(all(abs(x - 1e3 * u) < 0.01 * 1e3 * abs(tip[2]) for x, u in zip(way, tip)), f"vertex {way} mm, probe {tip} m")
    # The held end stays, but for what half a voxel beyond the held elements turns.
    for rest, now in zip(vertices_of("box.stl"), vertices_of("bent.stl")):
        if rest[0] == 0:
            expect(all(abs(b - a) < 0.1 * 1e3 * abs(tip[2]) for a, b in zip(rest, now)), f"{rest} went to {now}")


def test_pipe():
    centres()
    scene("bend.toml", SCENE.format(""))
    simulated = expect_ok(run("flexel-simulate", "bend.toml", "--quiet", stdin=open("centres.vtu", "rb")))
    mapped = expect_ok(run("flexel-map", "--format", "stl", "--keep-vertices", stdin=simulated.out))
    expect(len(mapped.out) == 84 + 50 * 12, f"12 triangles: {len(mapped.out)} bytes")


def test_deform_in_one_process():
    centres()
    scene("bend.toml", SCENE.format(""))
    expect_ok(run("flexel-simulate", "bend.toml", "centres.vtu", "-o", "bent.vtu"))
    expect_ok(run("flexel-map", "bent.vtu", "-o", "stages.stl"))
    deform = ["flexel", "deform", "box.stl", "--scene", "bend.toml", "--size", "1.25 mm", "-o", "one.stl", "--placement"]
    expect_ok(run(*deform, "centre"))
    expect(open("stages.stl", "rb").read() == open("one.stl", "rb").read(), "one process or three, the same bits")
    expect_error(run(*deform, "center"), "flexel", "--placement", 'did you mean "centre"')


def test_hooke_constants_and_threads():
    centres()
    paper = simulate(SCENE.format('model = "paper"'))["probes"][0]["displacement"][2]
    same = simulate(SCENE.format('hooke = "paper"'), "--threads", "1")["probes"][0]["displacement"][2]
    soft = simulate(SCENE.format('model = "paper"\nhooke = "ganovelli"'))["probes"][0]["displacement"][2]
    expect(paper == same, "the default, with any number of threads")
    # E l is about 2.4 times as stiff at eight elements (docs/measurements/accuracy.md: -64.5 against -15.6 percent).
    expect(2.0 < soft / paper < 2.8, f"ganovelli {soft}, paper {paper}")


def test_models_that_do_not_fit():
    centres()
    body("corners.vtu", "--align", "none")
    for model in ("cells", "springs"):
        expect_error(run("flexel-simulate", scene("a.toml", SCENE.format(f'model = "{model}"')), "centres.vtu"), "flexel-simulate",
                     "a.toml:1", "--placement corner")
    text = SCENE.format('model = "paper"').replace("parts.box", "parts.body-box")
    expect_error(run("flexel-simulate", scene("b.toml", text), "corners.vtu"), "flexel-simulate", "b.toml:1", "--placement centre")
    text = SCENE.format('hooke = "ganovelli"').replace("parts.box", "parts.body-box")
    expect_error(run("flexel-simulate", scene("c.toml", text), "corners.vtu"), "flexel-simulate", 'model "paper"')
    expect_error(run("flexel-simulate", scene("d.toml", SCENE.format('hooke = "paperr"')), "centres.vtu"), "flexel-simulate",
                 'did you mean "paper"')


def test_stresses_and_error_bars_are_refused_by_name():
    centres(size="5 mm")
    done = expect_ok(run("flexel-simulate", scene("bend.toml", SCENE.format("")), "centres.vtu", "-o", "bent.vtu", "--json"))
    expect("strength   not known: model \"paper\" has no stresses" in done.err, done.err)
    told = json.loads(done.out)
    expect(told["error_bars"]["bars"] == [] and "voxels' centres" in told["error_bars"]["note"], told["error_bars"])
    expect("stress" not in told and "strength" not in told, told)
    for shown in (("picture", "-o", "x.png"), ("view", "--html", "x.html")):
        expect_error(run("flexel", shown[0], "bent.vtu", "--color", "von_mises", *shown[1:]), "flexel", "von_mises", 'model "paper" has no stresses')
    expect_error(run("flexel", "deform", "box.stl", "--fix", "xmin", "--push", "xmax: 1 N", "--material", "PLA", "--placement", "centre", "--accuracy", "5%",
                     "-o", "x.stl"), "flexel", "--accuracy", "--placement centre")


def test_a_wall_of_one_element_is_refused():
    box()
    expect_ok(run("flexel-voxelize", "box.stl", "--size", "8 mm", "--align", "none", "--placement", "centre", "-o", "thin.vtu"))
    result = run("flexel-simulate", scene("thin.toml", SCENE.format("")), "thin.vtu")
    expect_error(result, "flexel-simulate", "in one plane", "smaller spacing", "--placement corner")


def test_a_run_without_equilibrium_leaves_the_last_one():
    centres("centres.vtu", "2.5 mm")
    write("crush.toml", SCENE.format("").replace("-100 N", "-100 MN") + "[run]\nnewton_iterations = 20\n")
    result = run("flexel-simulate", "crush.toml", "centres.vtu", "-o", "crushed.vtu")
    expect_error(result, "flexel-simulate", "no equilibrium", "most compressed is element", "crushed.failed.vtu", code=3)
    expect_ok(run("flexel-map", "crushed.failed.vtu", "-o", "crushed.stl"))


if __name__ == "__main__":
    main(globals())

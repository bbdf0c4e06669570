"""What the package gives is what the programs give, byte for byte."""

import json
import pathlib

from shared import PULL, SWING, bracket, box, box_body, check, expect_ok, main, module, need_step, run

SCENE = 'material = "steel"\n[[fix]]\nwhere = "xmin"\n[[load]]\nwhere = "xmax"\nforce = ["0 N", "0 N", "-100 N"]\n'


def same(a, b):
    left, right = pathlib.Path(a).read_bytes(), pathlib.Path(b).read_bytes()
    check.assertGreater(len(left), 100)
    check.assertTrue(left == right, f"{a} and {b} differ: {len(left)} and {len(right)} bytes")


def test_bodies_and_maps():
    flexel = module()
    flexel.Part.from_mesh(*box(), unit="m").write("box.ply")
    part = flexel.read("box.ply", unit="m")
    body = flexel.voxelize(part, size="2 mm")
    body.write("python.vtu")
    expect_ok(run("flexel-voxelize", "box.ply", "--unit", "m", "--size", "2 mm", "-o", "program.vtu"))
    same("python.vtu", "program.vtu")
    pathlib.Path("scene.toml").write_text(SCENE)
    result = flexel.simulate(body, "scene.toml")
    result.body.write("python-bent.vtu")
    expect_ok(run("flexel-simulate", "scene.toml", "program.vtu", "-o", "program-bent.vtu", "--summary", "summary.json"))
    same("python-bent.vtu", "program-bent.vtu")
    text = flexel.simulate(body, SCENE)
    text.body.write("python-text.vtu")
    same("python-text.vtu", "program-bent.vtu")
    program = json.loads(pathlib.Path("summary.json").read_text())
    check.assertEqual(result.summary["probes"], program["probes"])
    check.assertEqual(result.largest_displacement, program["largest_displacement"])
    for name in ("bent.stl", "bent.ply", "bent.obj"):
        flexel.map(result.body, output="python-" + name)
        expect_ok(run("flexel-map", "program-bent.vtu", "-o", "program-" + name))
        same("python-" + name, "program-" + name)
    result.part.write("python-smooth.ply", method="smooth", refine="off")
    expect_ok(run("flexel-map", "program-bent.vtu", "-o", "program-smooth.ply", "--method", "smooth", "--refine", "off"))
    same("python-smooth.ply", "program-smooth.ply")


def test_deform():
    flexel = module()
    need_step()
    bracket()
    options = dict(fix="bracket/1", push={"bracket/2": (0, 0, -100)}, material="PLA", size=0.004)
    result = flexel.deform("bracket.step", output=["python.stl", "python.vtu"], **options)
    expect_ok(run("flexel", "deform", "bracket.step", "--fix", "bracket/1", "--push", "bracket/2: 0 0 -100 N", "--material", "PLA",
                  "--size", "4 mm", "-o", "program.stl", "-o", "program.vtu", "--summary", "summary.json"))
    same("python.stl", "program.stl")
    same("python.vtu", "program.vtu")
    program = json.loads(pathlib.Path("summary.json").read_text())
    check.assertEqual(result.found["largest_displacement"], program["simulate"]["largest_displacement"])
    check.assertTrue(any(line.startswith("how far") for line in result.answer), result.answer)


def test_deform_of_a_part_in_memory():
    flexel = module()
    part = flexel.Part.from_mesh(*box())
    part.write("box.ply")
    result = flexel.deform(part, size="2.5 mm", **PULL)
    again = flexel.deform("box.ply", unit="m", size="2.5 mm", **PULL)
    check.assertEqual(result.largest_displacement, again.largest_displacement)
    check.assertTrue((result.part.displacement == again.part.displacement).all())


def test_frames_of_a_timed_run():
    flexel = module()
    body = box_body(flexel)
    body.write("box.vtu")
    scene = SWING.replace("TIME", "0.2 ms")
    pathlib.Path("swing.toml").write_text(scene)
    kept = []
    result = flexel.simulate(body, scene, on_frame=lambda frame: kept.append((frame.time, frame.body())))
    check.assertEqual(len(kept), 5)
    times = [time for time, _ in kept]
    check.assertEqual(times, sorted(times))
    expect_ok(run("flexel-simulate", "swing.toml", "box.vtu", "-o", "swing.pvd"))
    expect_ok(run("flexel-simulate", "swing.toml", "box.vtu", "-o", "end.vtu"))
    for n, (_, frame) in enumerate(kept):
        program = flexel.read_body(f"swing_{n:05d}.vtu")
        check.assertTrue((frame.position == program.position).all(), f"frame {n}")
    check.assertTrue((kept[-1][1].displacement != 0).any())
    result.body.write("python.vtu")
    same("python.vtu", "end.vtu")


def test_picture_and_page():
    flexel = module()
    result = flexel.simulate(box_body(flexel), **PULL)
    result.body.write("bent.vtu")
    png = flexel.picture(flexel.read_body("bent.vtu"), "python.png", color="von_mises", size="320x240")
    check.assertEqual(png[:8], b"\x89PNG\r\n\x1a\n")
    expect_ok(run("flexel", "picture", "bent.vtu", "-o", "program.png", "--color", "von_mises", "--size", "320x240"))
    same("python.png", "program.png")
    page = flexel.read_body("bent.vtu").page()
    expect_ok(run("flexel", "view", "bent.vtu", "--html", "program.html"))
    check.assertEqual(page, pathlib.Path("program.html").read_text(encoding="utf-8"))
    for shown in (result, result.body, result.body.surface):
        check.assertIn("<iframe srcdoc=", shown._repr_html_())


def test_study():
    flexel = module()
    part = flexel.Part.from_mesh(*box())
    part.write("box.ply")
    found = flexel.study("box.ply", output="study", unit="m", budget="8 s", **PULL)
    check.assertTrue(found["runs"] if "runs" in found else found)
    check.assertEqual(found, json.loads(pathlib.Path("study/study.json").read_text()))


if __name__ == "__main__":
    main(globals())

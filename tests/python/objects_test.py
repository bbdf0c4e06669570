"""Views keep what they are of alive and cannot change it; meshes in and out; units; what is wrong is said as the programs say it."""

import ast
import gc
import os
import pathlib
import re
import resource
import time
import warnings
from unittest import mock

from shared import PULL, SWING, box, box_body, check, expect_error, main, module, run


def test_views_outlive_their_owners():
    flexel = module()
    import numpy as np

    result = flexel.simulate(box_body(flexel), estimate=False, **PULL)
    body = result.body
    views = [body.rest, body.position, body.displacement, body["von_mises"], body.cell_elements, body.fill, result.part.rest,
             result.part.displacement, result.part.triangles, flexel.Part.from_mesh(*box()).vertices]
    copies = [np.array(view) for view in views]
    check.assertFalse(any(view.flags.owndata for view in views), "a view is a copy")
    del result, body
    gc.collect()
    waste = [np.full(len(view) * 8 + 64, 7.5) for view in views for _ in range(50)]
    for view, copy in zip(views, copies):
        check.assertTrue((view == copy).all())
    del waste


def test_the_same_memory_each_time():
    flexel = module()
    body = box_body(flexel)
    check.assertEqual(body.position.ctypes.data, body.position.ctypes.data)
    check.assertEqual(body.position.dtype.name, "float64")
    check.assertEqual(body.position.shape, (17 * 5 * 5, 3))
    check.assertEqual(body.cell_elements.shape, (16 * 4 * 4, 8))
    check.assertTrue((body.displacement == 0).all())


def test_views_cannot_be_written():
    flexel = module()
    body = box_body(flexel)
    for view in (body.position, body.displacement, body.fill, body.cell_elements):
        with check.assertRaises(ValueError):
            view[0] = 0
        with check.assertRaises(ValueError):
            view.flags.writeable = True


def test_a_run_leaves_its_body_alone():
    flexel = module()
    body = box_body(flexel)
    before = body.position.copy()
    first = flexel.simulate(body, estimate=False, **PULL)
    second = flexel.simulate(body, estimate=False, **PULL)
    check.assertTrue((body.position == before).all())
    check.assertTrue((first.body.position == second.body.position).all())
    check.assertGreater(abs(first.body.displacement).max(), 0)


def test_units():
    flexel = module()
    part = flexel.Part.from_mesh(*box())
    bodies = [flexel.voxelize(part, size=size) for size in ("2.5 mm", 0.0025, "0.25 cm")]
    check.assertEqual(len({body.position.tobytes() for body in bodies}), 1)
    pushes = [{"xmax": (0, 0, -100)}, "xmax: 0 0 -100 N", {"xmax": "0 0 -0.1 kN"}, ["xmax: 0 0 -100 N"]]
    found = {flexel.simulate(bodies[0], estimate=False, fix="xmin", push=push, material="steel").largest_displacement
             for push in pushes}
    check.assertEqual(len(found), 1, found)
    scaled = flexel.Part.from_mesh(box()[0] * 1000, box()[1], unit="mm")
    check.assertTrue(abs(scaled.vertices - part.vertices).max() < 1e-15)
    with check.assertRaises(flexel.InputError):
        flexel.voxelize(part, size="2 N")


def test_errors_are_the_programs():
    flexel = module()
    pathlib.Path("none.toml").write_text("material = 'steel'\nwhatever = 1\n")
    body = box_body(flexel)
    body.write("box.vtu")
    cases = [(lambda: flexel.read("missing.stl"), ("flexel-voxelize", "missing.stl", "--size", "1 mm")),
             (lambda: flexel.simulate(body, "none.toml"), ("flexel-simulate", "none.toml", "box.vtu")),
             (lambda: flexel.read_body("none.toml"), ("flexel-map", "none.toml", "-o", "x.stl"))]
    for call, command in cases:
        with check.assertRaises(flexel.InputError) as caught:
            call()
        done = run(*command)
        expect_error(done, command[0])
        check.assertEqual(f"{command[0]}: error: {caught.exception}", done.err.splitlines()[-1])
        check.assertEqual(caught.exception.exit_code, 2)
    check.assertTrue(issubclass(flexel.InputError, flexel.FlexelError) and issubclass(flexel.InputError, ValueError))
    check.assertEqual((flexel.DivergedError.exit_code, flexel.InvalidMappingError.exit_code, flexel.StoppedByTimeout.exit_code),
                      (3, 4, 5))


def test_what_cannot_be_a_mesh():
    flexel = module()
    import numpy as np

    points, quads = box()
    for vertices, faces in ((points[:, :2], quads), (points, quads * 1.0), (points, quads + 100), (points, quads[:0]),
                            (points * float("nan"), quads), (points + 1j, quads), (np.ma.masked_less(points, 0.001), quads),
                            (points, np.ma.masked_greater(quads, 5)), (points, quads > 3), (points, quads.astype(np.uint64) + 2**40)):
        with check.assertRaises(flexel.InputError):
            flexel.Part.from_mesh(vertices, faces)


def test_a_mesh_of_any_layout_is_the_same():
    flexel = module()
    import numpy as np

    points, quads = box()
    wanted = flexel.Part.from_mesh(points, quads)
    doubled = np.repeat(points, 2, axis=0)
    for vertices, faces in ((points.tolist(), quads.tolist()), (np.asfortranarray(points), np.asfortranarray(quads)),
                            (points.astype(">f8"), quads.astype(">i8")), (doubled[::2], quads.astype(np.uint8)),
                            (points[::-1], 7 - quads), (points.astype(object), quads)):
        part = flexel.Part.from_mesh(vertices, faces)
        check.assertTrue((part.vertices[part.triangles] == wanted.vertices[wanted.triangles]).all())


def test_divergence():
    flexel = module()
    body = box_body(flexel)
    scene = """material = "rubber"
[[fix]]
where = "xmin"
[[load]]
where = "xmax"
force = ["0 N", "0 N", "-5 MN"]
"""
    with check.assertRaises(flexel.FlexelError) as caught:
        flexel.simulate(body, scene.replace('"rubber"', '"TPU"'), estimate=False)
    check.assertIn(caught.exception.exit_code, (2, 3))
    check.assertGreater(len(str(caught.exception)), 20)


def test_a_time_limit():
    flexel = module()
    part = flexel.Part.from_mesh(*box())
    with check.assertRaises(flexel.StoppedByTimeout) as caught:
        flexel.deform(part, size="0.25 mm", timeout="0.2 s", **PULL)
    check.assertIsInstance(caught.exception, TimeoutError)
    check.assertGreater(flexel.deform(part, size="5 mm", **PULL).largest_displacement, 0)


def test_warnings():
    flexel = module()
    points, quads = box()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        part = flexel.Part.from_mesh(points * 1e6, quads)
    check.assertTrue(part.warnings, "a part of 40 km is nothing to warn of?")
    check.assertEqual([str(each.message) for each in caught], part.warnings)
    check.assertEqual({each.filename for each in caught}, {__file__})
    check.assertTrue(all(each.category is flexel.FlexelWarning for each in caught))


def test_the_source_is_not_overwritten():
    flexel = module()
    os.mkdir("parts")
    flexel.Part.from_mesh(*box()).write("parts/box.ply")
    before = pathlib.Path("parts/box.ply").read_bytes()
    part = flexel.read("parts/box.ply", unit="m")
    unrelated = pathlib.Path("box.ply")
    unrelated.write_bytes(b"of another part")
    os.chdir("parts")
    for source in (part, "box.ply"):
        with check.assertRaises(flexel.InputError) as caught:
            flexel.deform(source, output="box.ply", size="5 mm", **PULL)
        check.assertIn("is an input", str(caught.exception))
    check.assertEqual(pathlib.Path("box.ply").read_bytes(), before)
    os.chdir("..")
    result = flexel.deform(part, output="box.ply", size="5 mm", **PULL)
    check.assertEqual(result.label, "box.ply, deformed")
    check.assertGreater(len(unrelated.read_bytes()), 100)
    made = flexel.Part.from_mesh(*box(), name="box.ply")
    flexel.deform(made, output=["box.ply", "box.html"], size="5 mm", **PULL)
    check.assertIn("box.ply, deformed", pathlib.Path("box.html").read_text(encoding="utf-8"))


def test_results_do_not_replace_what_was_read():
    flexel = module()
    flexel.Part.from_mesh(*box()).write("own.ply")
    part = flexel.read("own.ply", unit="m")
    body = flexel.voxelize(part, size="5 mm")
    body.write("body.vtu")
    read = flexel.read_body("body.vtu")
    scene = 'material = "steel"\n[[fix]]\nwhere = "xmin"\n[[load]]\nwhere = "xmax"\nforce = ["0 N", "0 N", "-1 N"]\n'
    pathlib.Path("scene.toml").write_text(scene)
    result = flexel.simulate(read, "scene.toml", estimate=False)
    bent = flexel.simulate(body, "scene.toml", estimate=False)
    deformed = flexel.deform(part, size="5 mm", **PULL)
    staged = flexel.deform("own.ply", scene="scene.toml", unit="m", size="5 mm", no_estimate=True)
    pathlib.Path("swing.toml").write_text(SWING.replace("TIME", "0.1 ms"))
    frames = []
    flexel.simulate(read, pathlib.Path("swing.toml"), on_frame=lambda frame: frames.append(frame.body()))
    os.symlink("own.ply", "link.ply")
    pathlib.Path("aside").mkdir()
    pathlib.Path("aside/own.ply").write_bytes(pathlib.Path("own.ply").read_bytes())
    for name, attempt in (("own.ply", lambda path, **more: part.write(path, **more)),
                          ("own.ply", lambda path, **more: body.surface.write(path, **more)),
                          ("own.ply", lambda path, **more: flexel.map(bent.body, output=path, **more)),
                          ("own.ply", lambda path, **more: flexel.map(result.body, output=path, **more)),
                          ("aside/own.ply", lambda path, **more: flexel.map(result.body, output=path, **more)),
                          ("own.ply", lambda path, **more: flexel.map(bent.body, report=path, **more)),
                          ("own.ply", lambda path, **more: bent.part.write(path, **more)),
                          ("own.ply", lambda path, **more: deformed.part.write(path, **more)),
                          ("link.ply", lambda path, **more: part.write(path, **more)),
                          ("own.ply", lambda path, **more: flexel.picture(part, path, **more)),
                          ("own.ply", lambda path, **more: flexel.picture([bent, deformed], path, **more)),
                          ("own.ply", lambda path, **more: part.write_page(path, **more)),
                          ("own.ply", lambda path, **more: bent.write_page(path, **more)),
                          ("body.vtu", lambda path, **more: read.write(path, **more)),
                          ("body.vtu", lambda path, **more: result.write_page(path, **more)),
                          ("body.vtu", lambda path, **more: flexel.simulate(read, scene, history=path, **more)),
                          ("scene.toml", lambda path, **more: flexel.simulate(body, "scene.toml", history=path, **more)),
                          ("scene.toml", lambda path, **more: result.write_page(path, **more)),
                          ("scene.toml", lambda path, **more: result.body.write(path, **more)),
                          ("scene.toml", lambda path, **more: result.body.write_page(path, **more)),
                          ("scene.toml", lambda path, **more: result.part.write(path, format="stl", **more)),
                          ("scene.toml", lambda path, **more: flexel.picture(result, path, **more)),
                          ("scene.toml", lambda path, **more: staged.write_page(path, **more)),
                          ("scene.toml", lambda path, **more: staged.body.write(path, **more)),
                          ("own.ply", lambda path, **more: staged.write_page(path, **more)),
                          ("body.vtu", lambda path, **more: frames[0].write(path, **more)),
                          ("swing.toml", lambda path, **more: frames[-1].write_page(path, **more)),
                          ("swing.toml", lambda path, **more: flexel.picture(frames[0], path, **more))):
        before = pathlib.Path(name).read_bytes()
        with check.assertRaises(flexel.InputError) as caught:
            attempt(name)
        check.assertRegex(str(caught.exception), "is an input|is the part that")
        check.assertEqual(pathlib.Path(name).read_bytes(), before, name)
    flexel.map(bent.body, output="own.ply", force=True)
    check.assertNotEqual(pathlib.Path("own.ply").read_bytes(), pathlib.Path("aside/own.ply").read_bytes())
    for name, attempt in (("own.ply", part.write), ("body.vtu", read.write), ("own.ply", result.part.write)):
        attempt(name, force=True)
        attempt("new-" + name)
    flexel.picture(part, "own.ply", force=True)
    check.assertEqual(pathlib.Path("own.ply").read_bytes()[:4], b"\x89PNG")


def test_pages_of_all_that_is_shown():
    flexel = module()
    part = flexel.Part.from_mesh(*box(), name="bar")
    result = flexel.deform(part, size="5 mm", **PULL)
    for shown in (part, result.body, result.part, result):
        shown.write_page("page.html")
        page = pathlib.Path("page.html").read_text(encoding="utf-8")
        check.assertIn("<html", page)
        check.assertIn("bar", page)
        check.assertRegex(shown._repr_html_(), "^<iframe srcdoc=")
        check.assertEqual(flexel.picture(shown, size="100x100")[:4], b"\x89PNG")


def test_a_page_that_fails_leaves_the_old_one():
    flexel = module()
    part = flexel.Part.from_mesh(*box())
    part.write_page("page.html")
    os.chmod("page.html", 0o640)
    os.symlink("page.html", "link.html")
    before = pathlib.Path("page.html").read_bytes()

    def fails():
        raise KeyboardInterrupt

    def unwritable():
        return "\ud800"

    for page, error in ((fails, KeyboardInterrupt), (unwritable, UnicodeEncodeError)):
        part.page = page
        with check.assertRaises(error):
            part.write_page("page.html")
        check.assertEqual(pathlib.Path("page.html").read_bytes(), before)
    part.page = lambda: "é"
    with mock.patch("os.replace", side_effect=OSError):
        with check.assertRaises(OSError):
            part.write_page("page.html")
    check.assertEqual(pathlib.Path("page.html").read_bytes(), before)
    part.write_page("link.html")
    check.assertEqual(pathlib.Path("page.html").read_text(encoding="utf-8"), "é")
    check.assertEqual(os.stat("page.html").st_mode & 0o777, 0o640)
    check.assertTrue(os.path.islink("link.html"))
    part.write_page(os.devnull)
    check.assertEqual(sorted(os.listdir(".")), ["link.html", "page.html"])


def test_the_stub_is_of_the_module():
    """_flexel.pyi has the functions, classes and members of the module, with as many arguments."""
    flexel = module()
    core = flexel._flexel
    stub = ast.parse(pathlib.Path(flexel.__file__).with_name("_flexel.pyi").read_text())

    def members(thing):
        return {name for name in vars(thing) if not name.startswith("_")}

    def check_arguments(node, function):
        signature = re.match(r"\w+\((.*)\) -> ", function.__doc__.splitlines()[0]).group(1)
        check.assertEqual(len(re.findall(r"\b(?:arg\d+|self): ", signature)), len(node.args.args), node.name)

    functions = {node.name: node for node in stub.body if isinstance(node, ast.FunctionDef)}
    classes = {node.name: node for node in stub.body if isinstance(node, ast.ClassDef)}
    values = {node.target.id for node in stub.body if isinstance(node, ast.AnnAssign)}
    check.assertEqual(set(functions) | set(classes) | values, members(core))
    for name, node in functions.items():
        check_arguments(node, getattr(core, name))
    for name, node in classes.items():
        methods = {each.name: each for each in node.body if isinstance(each, ast.FunctionDef)}
        fields = {each.target.id for each in node.body if isinstance(each, ast.AnnAssign)}
        check.assertEqual(set(methods) | fields, members(getattr(core, name)), name)
        for method, each in methods.items():
            check_arguments(each, getattr(getattr(core, name), method))


def test_limits_of_simulate():
    flexel = module()
    body = flexel.voxelize(flexel.Part.from_mesh(*box()), size="1 mm")
    began = time.monotonic()
    with check.assertRaises(flexel.StoppedByTimeout):
        flexel.simulate(body, SWING.replace("TIME", "100 s"), timeout="0.5 s")
    check.assertLess(time.monotonic() - began, 30)
    check.assertGreater(flexel.simulate(body, estimate=False, **PULL).largest_displacement, 0)


def test_limits_end_with_their_call():
    flexel = module()
    part = flexel.Part.from_mesh(*box())
    limit = resource.getrlimit(resource.RLIMIT_DATA)
    with check.assertRaises(flexel.InputError) as caught:
        flexel.deform(part, size="2.5 mm", max_elements=10, **PULL)
    check.assertIn("--max-elements", str(caught.exception))
    body = flexel.voxelize(part, size="2.5 mm")
    check.assertEqual(len(body.rest), 17 * 5 * 5)
    check.assertGreater(flexel.deform(part, size="5 mm", **PULL).largest_displacement, 0)
    for call in (lambda: flexel.deform(part, max_memory="4GB", **PULL), lambda: flexel.map(body, max_memory="4GB"),
                 lambda: flexel.simulate(body, max_memory="4GB", **PULL), lambda: flexel.picture(body, max_memory="4GB")):
        with check.assertRaises(flexel.InputError) as caught:
            call()
        check.assertIn("max_memory", str(caught.exception))
    check.assertEqual(resource.getrlimit(resource.RLIMIT_DATA), limit)


def test_modes_by_path_and_as_text():
    flexel = module()
    body = box_body(flexel)
    scene = 'material = "steel"\n[[fix]]\nwhere = "xmin"\n[run]\nmodes = 2\n'
    pathlib.Path("modes.toml").write_text(scene)
    by_path, as_text = (flexel.simulate(body, given).summary["shapes"] for given in ("modes.toml", scene))
    check.assertEqual(by_path, as_text)
    check.assertEqual(len(by_path["modes"]), 2)
    for given in ("modes.toml", scene):
        with check.assertRaises(flexel.InputError) as caught:
            flexel.simulate(body, given, on_frame=print)
        check.assertRegex(str(caught.exception), "^[^\n]*frames are of timed runs[^\n]*$")


def test_scenes_with_odd_names():
    flexel = module()
    body = box_body(flexel)
    scene = SWING.replace("TIME", "0.1 ms")
    for name in ("load=5 N.toml", "load=6 N"):
        pathlib.Path(name).write_text(scene)
        check.assertTrue(flexel.simulate(body, name).summary)
    with check.assertRaises(flexel.InputError) as caught:
        flexel.simulate(body, "none=1.toml")
    check.assertIn("none=1.toml", str(caught.exception))


def test_values_of_the_wrong_type():
    flexel = module()
    part = flexel.Part.from_mesh(*box())
    part.write("box.ply")
    for error, name, call in (
            (flexel.InputError, "count", lambda: flexel.voxelize(part, count=-5)),
            (TypeError, "count", lambda: flexel.voxelize(part, count=2.5)),
            (TypeError, "count", lambda: flexel.voxelize(part, count=10**30)),
            (TypeError, "align", lambda: flexel.voxelize(part, size="5 mm", align=None)),
            (TypeError, "threads", lambda: flexel.voxelize(part, size="5 mm", threads=None)),
            (flexel.InputError, "threads", lambda: flexel.voxelize(part, size="5 mm", threads=-1)),
            (TypeError, "unit", lambda: flexel.Part.from_mesh(*box(), unit=None)),
            (TypeError, "unit", lambda: flexel.read("box.ply", unit=5)),
            (TypeError, "isa", lambda: flexel.simulate(box_body(flexel), isa=None, **PULL))):
        with check.assertRaises(error) as caught:
            call()
        check.assertRegex(str(caught.exception), f"^{name}: [^\n]+$")


def test_what_is_no_number_is_refused():
    """float() makes something of each."""
    flexel = module()
    import numpy as np

    part, body = flexel.Part.from_mesh(*box()), box_body(flexel)

    def push(amount):
        return lambda: flexel.simulate(body, estimate=False, **{**PULL, "push": {"xmax": amount}})

    for call in (push((0, 0, "-100")), push((0, 0, -100 + 1j)), push((True, 0, 0)), push({0: 1}), push({1.0, 2.0, 3.0}), push(b"5 N"),
                 push(np.array([0, 0, -100 + 1j])), lambda: flexel.voxelize(part, size=True), lambda: flexel.voxelize(part, size=b"2 mm"),
                 lambda: flexel.Part.from_mesh(*box(), edge=True), lambda: flexel.simulate(body, **{**PULL, "fix": b"xmin"}),
                 lambda: flexel.simulate(body, **{**PULL, "fix": True}), lambda: flexel.simulate(body, **{**PULL, "fix": {"xmin": 1}})):
        with check.assertRaises(TypeError) as caught:
            call()
        check.assertNotIn("\n", str(caught.exception))
    wanted = flexel.simulate(body, estimate=False, **PULL).largest_displacement
    for amount in (np.array([0, 0, -100], np.int8), [0, 0, np.float32(-100)], (each for each in (0, 0, -100))):
        check.assertEqual(push(amount)().largest_displacement, wanted)


def test_what_is_of_another_class_is_named():
    flexel = module()
    part, body = flexel.Part.from_mesh(*box()), box_body(flexel)
    result = flexel.simulate(body, estimate=False, **PULL)
    for call, said in ((lambda: flexel.simulate(part, **PULL), "not a Part"), (lambda: flexel.simulate(None, **PULL), "not a NoneType"),
                       (lambda: flexel.map(result), "give its .body"), (lambda: flexel.picture(None), "None cannot be shown"),
                       (lambda: flexel.picture([part, "box.ply"]), "'box.ply' cannot be shown"),
                       (lambda: flexel.voxelize(body, size=0.005), "not Body"), (lambda: flexel.voxelize(part, progress=5), "progress: 5"),
                       (lambda: flexel.Part.from_mesh(*box(), name=5), "name: 5")):
        with check.assertRaises(TypeError) as caught:
            call()
        check.assertIn(said, str(caught.exception))
        check.assertNotIn("\n", str(caught.exception))
    with check.assertRaises(flexel.InputError):
        flexel.picture([])
    import numpy as np

    check.assertEqual(len(flexel.voxelize(part, size=0.0025, progress=np.bool_(False)).rest), len(body.rest))


def test_a_path_is_read_to_its_end():
    flexel = module()
    part = flexel.Part.from_mesh(*box())
    part.write("box.ply")
    for call in (flexel.read, flexel.read_body, part.write, lambda path: flexel.picture(part, path)):
        with check.assertRaises(ValueError) as caught:
            call("box.ply\0.stl")
        check.assertIn("null character", str(caught.exception))
        with check.assertRaises(ValueError) as caught:
            call(b"box\xff.ply")
        check.assertRegex(str(caught.exception), "^[^\n]+ is not UTF-8: [^\n]+$")
    check.assertTrue((flexel.read(b"box.ply", unit="m").vertices == part.vertices).all())


def test_a_body_under_the_name_of_a_part_is_told():
    flexel = module()
    body = box_body(flexel)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        body.write("bent.stl")
        body.write("bent.vtu")
    check.assertEqual([str(each.message) for each in caught],
                      ["bent.stl gets a body (VTK, .vtu), whatever its name says: flexel-map makes the deformed part of one"])
    check.assertEqual(pathlib.Path("bent.stl").read_bytes(), pathlib.Path("bent.vtu").read_bytes())
    flexel.Part.from_mesh(*box()).write("box.ply")
    done = run("flexel-voxelize", "box.ply", "--unit", "m", "--size", "2.5 mm", "-o", "bent.stl")
    check.assertEqual(done.code, 0)
    check.assertIn("flexel-voxelize: warning: bent.stl gets a body", done.err)


def test_what_timed_runs_alone_have_is_refused_elsewhere():
    flexel = module()
    for options in ({"isa": "portable"}, {"isa": "none such"}, {"history": "h.csv"}):
        with check.assertRaises(flexel.InputError) as caught:
            flexel.simulate(box_body(flexel), **options, **PULL)
        check.assertIn("timed runs", str(caught.exception))


def test_reactions_of_one_name_are_added():
    flexel = module()
    scene = 'material = "steel"\n[[fix]]\nwhere = "part/xmin"\nname = "wall"\n[[fix]]\nwhere = "part/xmax"\nname = "wall"\n[[load]]\n' \
            'where = "zmax"\nforce = ["0 N", "0 N", "-100 N"]\n'
    result = flexel.simulate(box_body(flexel), scene, estimate=False)
    check.assertEqual([each["name"] for each in result.found["reactions"]], ["wall", "wall"])
    check.assertAlmostEqual(result.reactions["wall"][2], 100, 6)


def test_one_material_for_all():
    flexel = module()
    for options in ({"material": ["steel", "PLA"]}, {"material": ["part=steel", "part=PLA"]}, {"material": "PLA", "infill": ["20%", "40%"]}):
        with check.assertRaises(flexel.InputError) as caught:
            flexel.simulate(box_body(flexel), **{**PULL, **options})
        check.assertIn("is given twice", str(caught.exception))
    both = flexel.simulate(box_body(flexel), **{**PULL, "material": ["steel", "part=PLA"]}, estimate=False)
    alone = flexel.simulate(box_body(flexel), **{**PULL, "material": "PLA"}, estimate=False)
    check.assertEqual(both.largest_displacement, alone.largest_displacement)


def test_meshio_meshes_are_taken_whole():
    """Triangles beside quads, in the order of the mesh; nothing is left out without a word."""
    flexel = module()
    try:
        import meshio
    except ImportError:
        from harness import Skip

        raise Skip("meshio is not installed") from None
    points, quads = box()
    halves = [[corners[0], *corners[n : n + 2]] for corners in quads[2:4] for n in (1, 2)]
    cells = [("quad", quads[:2]), ("vertex", [[0]]), ("triangle", halves), ("quad", quads[4:])]
    part = flexel.Part.from_meshio(meshio.Mesh(points, cells))
    whole = flexel.Part.from_mesh(points, quads)
    check.assertTrue((part.triangles == whole.triangles).all())
    check.assertEqual([len(each) for each in (part.polygons[0], part.faces)], [9, 6])
    curved = meshio.Mesh(points, [("triangle", halves), ("triangle6", [[0, 1, 2, 3, 4, 5]])])
    for mesh, said in ((curved, "triangle6"), (meshio.Mesh(points, [("tetra", [[0, 1, 2, 4]])]), "extract its surface")):
        with check.assertRaises(flexel.InputError) as caught:
            flexel.Part.from_meshio(mesh)
        check.assertIn(said, str(caught.exception))


def test_meshio_round_trip():
    flexel = module()
    try:
        import meshio
    except ImportError:
        from harness import Skip

        raise Skip("meshio is not installed") from None
    points, quads = box()
    part = flexel.Part.from_meshio(meshio.Mesh(points, [("quad", quads)]))
    check.assertTrue((part.vertices == points).all())
    check.assertEqual(len(part.faces), 6)
    again = flexel.Part.from_meshio(part.to_meshio())
    check.assertTrue((again.vertices == part.vertices).all() and (again.triangles == part.triangles).all())
    body = flexel.simulate(flexel.voxelize(part, size=0.0025), estimate=False, **PULL).body
    body.to_meshio().write("hex.vtu")
    body.write("own.vtu")
    ours, theirs = meshio.read("hex.vtu"), meshio.read("own.vtu")
    check.assertEqual(ours.cells[0].type, "hexahedron")
    check.assertTrue((ours.cells[0].data == theirs.cells_dict["hexahedron"]).all())
    check.assertTrue((ours.points == body.position).all())
    check.assertTrue((ours.point_data["von_mises"] == body["von_mises"]).all())


if __name__ == "__main__":
    main(globals())

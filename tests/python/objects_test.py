"""Views keep what they are of alive and cannot change it; meshes in and out; units; what is wrong is said as the programs say it."""

import gc
import pathlib
import warnings

from shared import PULL, box, box_body, check, expect_error, main, module, run


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
    points, quads = box()
    for vertices, faces in ((points[:, :2], quads), (points, quads * 1.0), (points, quads + 100), (points, quads[:0]),
                            (points * float("nan"), quads)):
        with check.assertRaises(flexel.InputError):
            flexel.Part.from_mesh(vertices, faces)


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
    check.assertTrue(all(each.category is flexel.FlexelWarning for each in caught))


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

"""flexel-simulate-mpi: on 1, 2 and 4 ranks the answer of flexel-simulate; what it refuses; errors and killed ranks end all."""

import json
import math
import os
import pathlib
import signal
import subprocess
import time

from harness import BIN, Skip, binary_stl, box_triangles, expect, expect_error, expect_ok, expect_only, body, box, main, need, run, scene, write

PROGRAM = "flexel-simulate-mpi"
ENVIRONMENT = dict(os.environ, OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1", OMPI_MCA_rmaps_base_oversubscribe="1",
                   OMPI_MCA_hwloc_base_binding_policy="none",
                   OMPI_MCA_mpi_yield_when_idle="1")
MPIRUN = ("mpirun", "--quiet", "-n")

SMALL = """material = "steel"
[gravity]
acceleration = ["0 m/s2", "3 m/s2", "-9.81 m/s2"]
[[fix]]
where = "xmin"
[[load]]
name = "push"
where = "xmax"
force = ["10 N", "0 N", "-100 N"]
[[load]]
name = "press"
where = "zmax"
pressure = "20 kPa"
[[probe]]
name = "tip"
at = ["40 mm", "5 mm", "5 mm"]
[run]
tolerance = 1e-11
"""
# Far past its thickness; one end is held by elements, the other led and turned.
LARGE = """material = "rubber"
[[fix]]
where = { box = { min = ["-1 mm", "-1 mm", "-1 mm"], max = ["1 mm", "11 mm", "11 mm"] } }
[[move]]
name = "led"
where = { box = { min = ["39 mm", "-1 mm", "-1 mm"], max = ["41 mm", "11 mm", "11 mm"] } }
displacement = ["free", "free", "8 mm"]
[[load]]
name = "aside"
where = "zmax"
force = ["0 N", "0.5 N", "0 N"]
[[probe]]
name = "middle"
at = ["20 mm", "5 mm", "5 mm"]
[run]
tolerance = 1e-11
"""


def need_mpi():
    if not (BIN / PROGRAM).exists():
        raise Skip("built without PETSc and MPI (tools/setup --mpi)")
    need("mpirun")


def mpi(ranks, *arguments, timeout=300, **options):
    """Ranks wait for each other: on a crowded machine they take many times as long as alone."""
    return run(*MPIRUN, ranks, BIN / PROGRAM, *arguments, env=ENVIRONMENT, timeout=timeout, **options)


def points(path):
    """Positions of the elements and the columns of a body that is not compressed, as meshio reads them."""
    try:
        import meshio
    except ImportError:
        raise Skip("python3-meshio is not installed") from None
    return meshio.read(path)


def close(one, other, share, what):
    """Numbers, or nested lists of them, that differ by at most `share` of the largest."""
    import numpy
    one, other = numpy.asarray(one, float), numpy.asarray(other, float)
    expect(one.shape == other.shape, f"{what}: {one.shape} and {other.shape}")
    scale = numpy.abs(other).max()
    expect(scale > 0, f"{what}: nothing but zeros")
    expect(numpy.abs(one - other).max() <= share * scale, f"{what}: off by {numpy.abs(one - other).max() / scale:.1e}, allowed {share:.0e}")


def same_answer(ranks, text, *options, petsc=""):
    need_mpi()
    scene(text=text)
    body()
    expect_ok(run("flexel-simulate", "scene.toml", "body.vtu", "-o", "one.vtu", "--summary", "one.json", "--threads", "1", *options))
    expect_ok(mpi(ranks, "scene.toml", "body.vtu", "-o", "all.vtu", "--summary", "all.json", *options, *(("--petsc", petsc) if petsc else ())))
    one, every = points("one.vtu"), points("all.vtu")
    close(every.point_data["displacement"], one.point_data["displacement"], 1e-8, "displacements")
    for column in ("von_mises", "principal_stresses"):
        if column in one.point_data:
            close(every.point_data[column], one.point_data[column], 1e-7, column)
    a, b = json.loads(pathlib.Path("all.json").read_text()), json.loads(pathlib.Path("one.json").read_text())
    expect(a.keys() == b.keys(), f"the summary has {set(a) ^ set(b)}")
    close([p["displacement"] for p in a["probes"]], [p["displacement"] for p in b["probes"]], 1e-8, "probes")
    close([r["force"] for r in a["reactions"]], [r["force"] for r in b["reactions"]], 1e-8, "reactions")
    close([r["moment"] for r in a["reactions"]], [r["moment"] for r in b["reactions"]], 1e-8, "moments of reactions")
    close([load["force"] for load in a["loads"]], [load["force"] for load in b["loads"]], 1e-12, "loads")
    for key in ("elastic_energy", "largest_displacement", "mass", "largest_von_mises", "smallest_jacobian"):
        close([a[key]], [b[key]], 1e-7, key)
    if "error_bars" in b:
        close([bar["value"] for bar in a["error_bars"]["bars"]], [bar["value"] for bar in b["error_bars"]["bars"]], 1e-7, "values of bars")
        close([bar["bar"] for bar in a["error_bars"]["bars"]], [bar["bar"] for bar in b["error_bars"]["bars"]], 1e-6, "error bars")
    expect(a["relative_residual"] <= 1e-11 or a["newton_iterations"] > 1, "the tolerance holds on all ranks")
    return a, b


def test_one_rank():
    same_answer(1, SMALL)


def test_two_ranks():
    same_answer(2, SMALL)


def test_four_ranks():
    same_answer(4, SMALL)


def test_two_ranks_large_deflections():
    every, one = same_answer(2, LARGE, "--no-estimate")
    expect(one["newton_iterations"] > 2, f"the case should not be linear: {one['newton_iterations']} iterations")
    expect(every["largest_displacement"] > 0.008, "it should go near the thickness of the bar")


def test_pieces_in_and_out():
    """A list of pieces is the body that it was cut from, and its result in pieces that of the whole; as many pieces as there were, on any ranks."""
    need_mpi()
    scene(text=SMALL)
    box("bar.stl")
    expect_ok(run("flexel-voxelize", "bar.stl", "--size", "5 mm", "-o", "whole.vtu"))
    expect_ok(run("flexel-voxelize", "bar.stl", "--size", "5 mm", "--pieces", "3", "-o", "parts.pvtu"))
    expect_ok(mpi(2, "scene.toml", "whole.vtu", "-o", "bent.vtu", "--no-estimate"))
    expect_ok(mpi(2, "scene.toml", "parts.pvtu", "-o", "bent.pvtu", "--no-estimate"))
    whole, found = points("bent.vtu"), {}
    for p in range(3):
        piece = points(f"bent_{p}.vtu")
        for at, moved, stress in zip(piece.point_data["rest"], piece.point_data["displacement"], piece.point_data["von_mises"]):
            found.setdefault(tuple(round(1e6 * x) for x in at), []).append((moved, stress))
    expect(len(found) == len(whole.points), f"{len(found)} places in pieces, {len(whole.points)} in the whole")
    for at, moved, stress in zip(whole.point_data["rest"], whole.point_data["displacement"], whole.point_data["von_mises"]):
        for piece_moved, piece_stress in found[tuple(round(1e6 * x) for x in at)]:
            expect((piece_moved == moved).all() and piece_stress == stress, f"at {at}: {piece_moved} and {moved}")
    expect_ok(run("flexel-map", "bent.pvtu", "-o", "pieces.stl"))
    expect_ok(run("flexel-map", "bent.vtu", "-o", "whole.stl"))
    expect(pathlib.Path("pieces.stl").read_bytes() == pathlib.Path("whole.stl").read_bytes(), "mapped from pieces and from the whole")
    expect_error(mpi(2, "scene.toml", "parts.pvtu", "-o", "bent.vtu"), PROGRAM, "come out as pieces")
    expect(b"1 of 3" in pathlib.Path("bent_1.vtu").read_bytes(), "the note which piece it is")
    os.replace("parts.pvtu", "list.pvtu")
    expect_error(mpi(2, "scene.toml", "list.pvtu", "-o", "parts.pvtu"), PROGRAM, "parts_", "is an input")
    os.replace("list.pvtu", "parts.pvtu")
    os.replace("bent_1.vtu", "parts_1.vtu")
    expect_error(mpi(2, "scene.toml", "parts.pvtu", "-o", "again.pvtu"), PROGRAM, "piece 1", "another run")


# Regions inside and across slabs, and all kinds of loads.
REGIONS = """material = "steel"
[gravity]
acceleration = ["0 m/s2", "3 m/s2", "-9.81 m/s2"]
[[fix]]
name = "end"
where = { box = { min = ["-1 mm", "-1 mm", "-1 mm"], max = ["2 mm", "11 mm", "11 mm"] } }
[[fix]]
name = "rail"
where = "ymin"
axes = "y"
[[move]]
name = "led"
where = { sphere = { centre = ["40 mm", "5 mm", "5 mm"], radius = "4 mm" } }
displacement = ["free", "free", "0.1 mm"]
[[load]]
name = "couple"
where = "zmax"
torque = ["0 N m", "0.3 N m", "0.1 N m"]
[[load]]
name = "beside"
where = "ymax"
force = ["0 N", "20 N", "0 N"]
at = ["30 mm", "10 mm", "5 mm"]
[[load]]
name = "volume"
where = { box = { min = ["12 mm", "-1 mm", "-1 mm"], max = ["28 mm", "11 mm", "11 mm"] } }
force = ["7 N", "0 N", "-30 N"]
[[probe]]
name = "at a cut"
at = ["20 mm", "5 mm", "10 mm"]
[[probe]]
name = "inside"
at = ["26.3 mm", "4.1 mm", "7.7 mm"]
[[probe]]
name = "side"
where = "zmax"
[[probe]]
name = "all but the end"
where = { not = { box = { min = ["-1 mm", "-1 mm", "-1 mm"], max = ["2 mm", "11 mm", "11 mm"] } } }
[run]
tolerance = 1e-11
"""


def pieces_of(list_name, count):
    """{element: [(displacement, von Mises stress), of it and of its ghosts]} of a result in pieces."""
    found = {}
    for p in range(count):
        piece = points(list_name.replace(".pvtu", f"_{p}.vtu"))
        stress = piece.point_data.get("von_mises", [0] * len(piece.points))
        for element, moved, von_mises in zip(elements(piece), piece.point_data["displacement"], stress):
            found.setdefault(element, []).append((moved, von_mises))
    return found


def elements(body_read):
    """Where in the lattice each point is, and which of those there."""
    return [(*map(int, at), int(piece)) for at, piece in zip(body_read.point_data["lattice_index"], body_read.point_data["piece"])]


def same_bars(a, b):
    """Error bars of two summaries. The coarser runs have a tolerance of 1e-6."""
    expect(a["cells"] == b["cells"] and a["note"] == b["note"], f"lattices {a['cells']} and {b['cells']}, {a['note']!r} and {b['note']!r}")
    expect([each["of"] for each in a["bars"]] == [each["of"] for each in b["bars"]] != [], f"bars of {a['bars']} and {b['bars']}")
    for x, y in zip(a["bars"], b["bars"]):
        for key in ("value", "bar", "extrapolated"):
            expect(abs(x[key] - y[key]) <= 1e-4 * abs(y["bar"]) + 1e-5 * abs(y["value"]), f"{key} of {x['of']}: {x[key]} and {y[key]}")
    x, y = a.get("largest_von_mises"), b.get("largest_von_mises")
    expect((x is None) == (y is None), f"bars of the stress: {x} and {y}")
    if y:
        close(x["values"], y["values"], 1e-5, "the largest stress of each lattice")


def same_on_pieces(ranks, pieces, text, part="bar.stl", size="2.5 mm", shared=True, stress=True, bars=False, moments=False):
    """A body in pieces of which no rank has the whole: the answer of flexel-simulate, in each piece, ghosts too."""
    import numpy
    need_mpi()
    scene(text=text)
    options = (*(() if bars else ("--no-estimate",)), *(() if stress else ("--no-stress",)))
    lattice = ("--size", size, *(("--moments",) if moments else ()))
    expect_ok(run("flexel-voxelize", part, *lattice, "-o", "whole.vtu"))
    expect_ok(run("flexel-voxelize", part, *lattice, "--pieces", pieces, "-o", "parts.pvtu"))
    expect_ok(run("flexel-simulate", "scene.toml", "whole.vtu", "-o", "one.vtu", "--summary", "one.json", "--threads", "1", *options))
    told = expect_ok(mpi(ranks, "scene.toml", "parts.pvtu", "-o", "all.pvtu", "--summary", "all.json", "--explain", "--force", *options))
    expect(("puts the body together" not in told.err) == shared, f"shared: {shared}: {told.err}")
    one, every = points("one.vtu"), pieces_of("all.pvtu", pieces)
    scale, most = numpy.abs(one.point_data["displacement"]).max(), 0
    expect(len(every) == len(one.points), f"{len(every)} elements in pieces, {len(one.points)} in the whole")
    loudest = one.point_data["von_mises"].max() if stress else 1
    for n, at in enumerate(elements(one)):
        for moved, von_mises in every[at]:
            most = max(most, numpy.abs(moved - one.point_data["displacement"][n]).max() / scale)
            if stress:
                expect(abs(von_mises - one.point_data["von_mises"][n]) <= 1e-7 * loudest, f"stress at {at}: {von_mises} and {one.point_data['von_mises'][n]}")
    expect(most <= 1e-8, f"displacements differ by {most:.1e}")
    a, b = json.loads(pathlib.Path("all.json").read_text()), json.loads(pathlib.Path("one.json").read_text())
    expect(a.keys() == b.keys(), f"the summary has {set(a) ^ set(b)}")
    for key in ("elements", "cells", "unknowns", "parts"):
        expect(a[key] == b[key], f"{key}: {a[key]} and {b[key]}")
    for kind, values in (("probes", ("displacement", "at")), ("reactions", ("force", "moment", "middle")), ("loads", ("force", "moment"))):
        expect([each["name"] for each in a[kind]] == [each["name"] for each in b[kind]], f"names of {kind}")
        for value in values if b[kind] else ():
            close([each[value] for each in a[kind]], [each[value] for each in b[kind]], 1e-8, f"{value} of {kind}")
    for x, y in zip(a["loads"], b["loads"]):
        expect(("rotation" in x) == ("rotation" in y), "turns of couples")
        if "rotation" in y:
            close(x["rotation"], y["rotation"], 1e-6, "turn of a couple")
    for key in ("elastic_energy", "largest_displacement", "mass", "smallest_jacobian", "smallest_corner_jacobian", *(("largest_von_mises",) if stress else ())):
        close([a[key]], [b[key]], 1e-7, key)
    if stress:
        expect(abs(a.get("largest_von_mises_thin_walls", 0) - b.get("largest_von_mises_thin_walls", 0)) < 1e-9, "share of thin walls")
        expect(a["strength"].keys() == b["strength"].keys(), f"strength: {a['strength']} and {b['strength']}")
        expect(a.get("largest_von_mises_beside") == b.get("largest_von_mises_beside"), "what the largest stress lies beside")
    if bars:
        same_bars(a["error_bars"], b["error_bars"])
    return a, b


def test_no_rank_has_the_whole_on_two_ranks():
    box("bar.stl")
    same_on_pieces(2, 2, SMALL, bars=True)
    same_on_pieces(2, 4, REGIONS, size="1.25 mm", bars=True)


def test_no_rank_has_the_whole_on_four_ranks():
    box("bar.stl")
    same_on_pieces(4, 4, REGIONS, bars=True)


def test_pieces_without_error_bars_say_why():
    """A plate one cell thick: as flexel-simulate says it, with the size that shows how sure it is."""
    need_mpi()
    write("plate.stl", binary_stl(box_triangles((40.0, 10.0, 2.5))))
    scene(text='material = "steel"\n[[fix]]\nwhere = "xmin"\n[[load]]\nwhere = "xmax"\nforce = ["0 N", "0 N", "-1 N"]\n')
    for pieces in ((), ("--pieces", "2")):
        expect_ok(run("flexel-voxelize", "plate.stl", "--size", "2.5 mm", "-o", "parts.pvtu" if pieces else "whole.vtu", *pieces))
    one = expect_ok(run("flexel-simulate", "scene.toml", "whole.vtu", "-o", "one.vtu")).err
    told = expect_ok(mpi(2, "scene.toml", "parts.pvtu", "-o", "all.pvtu")).err
    for row in ("how sure", "next"):
        said = [[line.partition(row)[2] for line in text.splitlines() if f": {row} " in line] for text in (one, told)]
        expect(said[0] == said[1] and len(said[0]) == 1, f"{row}: {said}")
    expect("one cell thick" in one and "--size 1.25mm shows how sure" in one, one)


def test_no_rank_has_the_whole_with_large_deflections():
    box("bar.stl")
    a, b = same_on_pieces(2, 2, LARGE, size="5 mm")
    expect(a["newton_iterations"] > 2, f"the case should not be linear: {a}")


def arch(name="arch.stl"):
    """Two legs along z, the longest axis, that a half ring joins: low slabs have two pieces of matter each. The ring cuts cells at every angle."""
    leg, steps, width = 28.0, 12, 6.0

    def line(radius):
        turn = [(radius * math.cos(math.pi * (1 - i / steps)), leg + radius * math.sin(math.pi * (1 - i / steps))) for i in range(steps + 1)]
        return [(-radius, 0.0), *turn, (radius, 0.0)]

    inner, outer = line(7.3), line(12.1)
    at = lambda point, y: (point[0], y, point[1])  # noqa: E731
    quads = [[at(inner[0], 0), at(outer[0], 0), at(outer[0], width), at(inner[0], width)], [at(outer[-1], 0), at(inner[-1], 0), at(inner[-1], width), at(outer[-1], width)]]
    for i in range(len(inner) - 1):
        a, b, c, d = inner[i], inner[i + 1], outer[i + 1], outer[i]
        quads += [[at(a, 0), at(b, 0), at(c, 0), at(d, 0)], [at(d, width), at(c, width), at(b, width), at(a, width)], [at(d, 0), at(c, 0), at(c, width), at(d, width)],
                  [at(b, 0), at(a, 0), at(a, width), at(b, width)]]
    return write(name, binary_stl([[q[0], q[2], q[1]] for q in quads] + [[q[0], q[3], q[2]] for q in quads]))


ARCH = """material = "PLA"
[gravity]
acceleration = ["0 m/s2", "3 m/s2", "-9.81 m/s2"]
[[fix]]
where = "zmin"
[[load]]
name = "pressed"
where = "zmax"
pressure = "50 kPa"
[[load]]
name = "pushed"
where = "xmax"
force = ["-2 N", "1 N", "0 N"]
[[probe]]
name = "crown"
at = ["0 mm", "3 mm", "40 mm"]
[[probe]]
name = "off the surface"
at = ["12.3 mm", "3 mm", "14 mm"]
[run]
tolerance = 1e-11
"""


def test_no_rank_has_the_whole_of_a_curved_part():
    same_on_pieces(2, 2, ARCH, part=arch(), size="1.7 mm", bars=True)
    same_on_pieces(3, 3, ARCH, part=arch(), size="1.1 mm", bars=True)
    same_on_pieces(2, 2, 'model = "cells"\n' + ARCH, part=arch(), size="1.3 mm", bars=True, moments=True)


def test_one_rank_puts_together_what_takes_the_whole():
    """Two blocks apart: each piece has matter of both, and only the whole says that they are two."""
    need_mpi()
    box("bar.stl")
    far = [[(x, y + 30, z) for x, y, z in triangle] for triangle in box_triangles((40.0, 10.0, 10.0))]
    write("two.stl", binary_stl(box_triangles((40.0, 10.0, 10.0)) + far))
    a, _ = same_on_pieces(2, 2, SMALL, part="two.stl", size="5 mm", shared=False)
    expect(a["largest_displacement"] > 0, "it moves")
    told = expect_ok(mpi(2, "scene.toml", "parts.pvtu", "-o", "all.pvtu", "--no-estimate", "--force", "--verbose"))
    expect("several pieces" in told.err, f"why is said: {told.err}")


def test_errors_on_pieces_are_told_once_and_end_all_ranks():
    need_mpi()
    box("bar.stl")
    expect_ok(run("flexel-voxelize", "bar.stl", "--size", "5 mm", "--pieces", "2", "-o", "parts.pvtu"))
    expect_ok(run("flexel-voxelize", "bar.stl", "--size", "4 mm", "--pieces", "2", "-o", "other.pvtu"))
    files = {"scene.toml", "bar.stl", *(f"{name}{end}" for name in ("parts", "other") for end in (".pvtu", "_0.vtu", "_1.vtu", "_surface.vtu"))}
    command = ("scene.toml", "parts.pvtu", "-o", "bent.pvtu", "--no-estimate")
    load = '[[load]]\nwhere = "xmax"\nforce = ["0 N", "0 N", "-1 N"]\n'
    nowhere = '{ box = { min = ["90 mm", "0 mm", "0 mm"], max = ["91 mm", "1 mm", "1 mm"] } }'
    for text, words in (('material = "steel"\n' + load, ["nothing holds part"]), (SMALL + "[[fix]]\nwhere = " + nowhere + "\n", ["holds no element", "40 mm"]),
                        (SMALL + '[[probe]]\nname = "off"\nat = ["60 mm", "0 mm", "0 mm"]\n', ["off", "20 mm outside"]),
                        ('material = "steel"\n[[fix]]\nwhere = "xmin"\naxes = "x"\n' + load, ["is free to translate along y"])):
        scene(text=text)
        expect_error(mpi(2, *command), PROGRAM, *words)
        expect_only(*files)
    scene(text=SMALL)
    os.replace("parts_1.vtu", "kept")
    expect_error(mpi(2, *command), PROGRAM, "piece 1 of 2", "parts_1.vtu", "is missing")
    os.replace("other_1.vtu", "parts_1.vtu")
    expect_error(mpi(2, *command), PROGRAM, "piece 1", "another run")
    os.replace("kept", "parts_1.vtu")
    os.mkdir("bent_1.vtu")
    expect_error(mpi(2, *command), PROGRAM, "bent_1.vtu")
    os.rmdir("bent_1.vtu")
    expect_only(*(files - {"other_1.vtu"}))


def test_the_last_equilibrium_of_pieces_is_kept_in_pieces():
    need_mpi()
    box("bar.stl")
    scene(text='material = "rubber"\n[[fix]]\nwhere = "xmin"\n[[load]]\nwhere = "xmax"\nforce = ["0 N", "0 N", "-60 N"]\n[run]\nload_steps = 4\nnewton_iterations = 6\n')
    expect_ok(run("flexel-voxelize", "bar.stl", "--size", "5 mm", "--pieces", "2", "-o", "parts.pvtu"))
    expect_error(mpi(2, "scene.toml", "parts.pvtu", "-o", "bent.pvtu", "--no-estimate"), PROGRAM, "bent.failed.pvtu", code=3)
    expect(not pathlib.Path("bent.pvtu").exists(), "no result")
    expect_ok(run("flexel-map", "bent.failed.pvtu", "-o", "failed.stl"))


def test_a_time_limit_ends_all_ranks_of_pieces():
    """A rod that is pushed together to a fortieth of its length takes far longer; rank 0 alone has the limit, and all write what was reached."""
    need_mpi()
    box("bar.stl")
    scene(text='material = "rubber"\n[[fix]]\nwhere = "xmin"\n[[move]]\nwhere = "xmax"\ndisplacement = ["-39 mm", "0 mm", "5 mm"]\n')
    expect_ok(run("flexel-voxelize", "bar.stl", "--size", "2.5 mm", "--pieces", "2", "-o", "parts.pvtu"))
    told = mpi(2, "scene.toml", "parts.pvtu", "-o", "bent.pvtu", "--no-estimate", "--timeout", "3 s")
    expect_error(told, PROGRAM, "stopped by --timeout", "bent.failed.pvtu", code=5)
    expect_ok(run("flexel-map", "bent.failed.pvtu", "-o", "reached.stl"))


def test_options_of_petsc():
    need_mpi()
    scene(text=SMALL)
    body("body.vtu")
    result = expect_ok(mpi(2, "scene.toml", "body.vtu", "-o", "out.vtu", "--no-estimate", "--petsc", "-ksp_view -pc_type jacobi -no_such 3"))
    expect("type: jacobi" in result.out.decode() and "type: cg" in result.out.decode(), f"-ksp_view should show the solver: {result}")
    expect("nothing asked for -no_such" in result.err and "-ksp_view" not in result.err.split("nothing asked for")[1],
           f"unused options should be named: {result}")


def test_no_option_of_petsc_ends_newtons_method_early():
    same_answer(2, LARGE, "--no-estimate", petsc="-snes_type ksponly -snes_linesearch_type basic -snes_convergence_test skip")


def test_what_ranks_do_not_do_is_refused():
    need_mpi()
    body("body.vtu")
    fix = 'material = "steel"\n[[fix]]\nwhere = "xmin"\n'
    load = '[[load]]\nwhere = "xmax"\nforce = ["0 N", "0 N", "-1 N"]\n'
    cases = {
        "timed runs": fix + load + '[run]\ntime = "1 ms"\n',
        "vibrations": fix + "[run]\nmodes = 2\n",
        "buckling": fix + load + "[run]\nbuckling = 1\n",
        "contact": fix + load + '[[plane]]\npoint = ["0 mm", "0 mm", "-1 mm"]\nnormal = [0, 0, 1]\n',
        'model "springs"': 'model = "springs"\n' + fix + load,
        'model "quadratic"': 'model = "quadratic"\n' + fix + load,
        "rigid links": fix + load + 'link = "rigid"\n',
        "loads that turn": fix + load + "follower = true\n",
        "heat and shrinkage": fix + '[thermal]\nchange = "10 K"\n',
        "renormalise": fix + load + "[run]\nrenormalise = true\n",
        "indenters": fix + '[[indenter]]\nball = { centre = ["20 mm", "5 mm", "20 mm"], radius = "8 mm" }\ndisplacement = ["0 mm", "0 mm", "-3 mm"]\n',
    }
    for what, text in cases.items():
        scene(text=text)
        expect_error(run(PROGRAM, "scene.toml", "body.vtu", "-o", "out.vtu", env=ENVIRONMENT), PROGRAM, what)
    expect_only("body.vtu", "scene.toml")


def test_an_error_is_told_once_and_ends_all_ranks():
    need_mpi()
    body("body.vtu")
    scene(text='material = "steel"\n[[load]]\nwhere = "xmax"\nforce = ["0 N", "0 N", "-1 N"]\n')
    expect_error(mpi(2, "scene.toml", "body.vtu", "-o", "out.vtu"), PROGRAM, "add a [[fix]]")
    scene(text=SMALL)
    expect_error(mpi(2, "scene.toml", "body.vtu", "-o", "out.vtu", "--petsc", "-pc_type nonsense"), PROGRAM, "nonsense")
    expect_error(mpi(2, "scene.toml", "body.vtu"), PROGRAM, "-o")
    expect_error(mpi(2, "scene.toml", "none.vtu", "-o", "out.vtu"), PROGRAM, "none.vtu")
    expect_only("body.vtu", "scene.toml")


def test_what_is_free_is_told_as_by_flexel_simulate():
    """Rigid motions, asked on the ranks: the same line for each way to hold too little."""
    need_mpi()
    body("body.vtu")
    load = '[[load]]\nwhere = "xmax"\nforce = ["0 N", "0 N", "-1 N"]\n'
    line = '{ box = { min = ["-1 mm", "-1 mm", "-1 mm"], max = ["1 mm", "11 mm", "1 mm"] } }'
    for hold in ('where = "xmin"\naxes = "x"', 'where = "xmin"\naxes = "yz"', f"where = {line}"):
        scene(text=f'material = "steel"\n[[fix]]\n{hold}\n{load}')
        one, all_ranks = run("flexel-simulate", "scene.toml", "body.vtu", "-o", "out.vtu"), mpi(2, "scene.toml", "body.vtu", "-o", "out.vtu")
        expect_error(one, "flexel-simulate", "is free to")
        expect_error(all_ranks, PROGRAM, "is free to")
        expect(one.err.splitlines()[-1].replace("flexel-simulate:", PROGRAM + ":") == all_ranks.err.splitlines()[-1], f"{hold}: {one.err} and {all_ranks.err}")


def test_an_equilibrium_that_is_not_stable_is_told():
    """A straight column below and beyond its buckling load, which no load step need meet: where none does, all ranks ask together."""
    need_mpi()
    body("body.vtu")
    for newtons, stable in ((1, True), (2, False)):
        scene(text=f'material = "rubber"\n[[fix]]\nwhere = "xmin"\n[[load]]\nwhere = "xmax"\nforce = ["-{newtons} N", "0 N", "0 N"]\n')
        for ranks in (1, 2):
            told = expect_ok(mpi(ranks, "scene.toml", "body.vtu", "-o", "out.vtu", "--force", "--no-estimate", "--no-stress"))
            warned = "this equilibrium is not stable" in told.err or "the part buckles at" in told.err
            expect(warned != stable, f"{newtons} N, {ranks} ranks: {told.err}")


def test_more_ranks_than_cells():
    """One cell, which rank 0 solves alone."""
    need_mpi()
    scene(text=SMALL)
    box("bar.stl")
    expect_ok(run("flexel-voxelize", "bar.stl", "--size", "40 mm", "-o", "body.vtu"))
    expect_ok(run("flexel-simulate", "scene.toml", "body.vtu", "-o", "one.vtu", "--no-estimate"))
    expect_ok(mpi(2, "scene.toml", "body.vtu", "-o", "all.vtu", "--no-estimate"))
    expect(pathlib.Path("one.vtu").read_bytes() == pathlib.Path("all.vtu").read_bytes(), "the same solver, the same bytes")


def ranks_of(process):
    """The processes that mpirun started, by their parent."""
    children = pathlib.Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
    return [int(child) for child in children]


def test_a_killed_rank_loses_one_load_step_at_most():
    need_mpi()
    scene(text=LARGE + "load_steps = 8\n")
    body("body.vtu")
    command = ("scene.toml", "body.vtu", "-o", "out.vtu", "--no-estimate")
    expect_ok(run("flexel-simulate", *command[:2], "-o", "whole.vtu", "--no-estimate", "--summary", "whole.json"))
    with open("told", "wb") as told:
        process = subprocess.Popen([*MPIRUN, "2", BIN / PROGRAM, *command, "--checkpoint", "steps"], stdout=told, stderr=told, env=ENVIRONMENT)
        ends = time.monotonic() + 60
        while not pathlib.Path("steps").exists() and process.poll() is None and time.monotonic() < ends:
            time.sleep(0.002)
        expect(process.poll() is None, f"it ended before it was killed: {pathlib.Path('told').read_text()}")
        os.kill(ranks_of(process)[-1], signal.SIGKILL)
        expect(process.wait(60) != 0, "mpirun should tell that a rank was killed")
    expect(not pathlib.Path("out.vtu").exists(), "a job that was killed leaves no result")
    expect_ok(mpi(2, *command, "--resume", "steps", "--summary", "resumed.json"))
    whole, resumed = json.loads(pathlib.Path("whole.json").read_text()), json.loads(pathlib.Path("resumed.json").read_text())
    expect(resumed["load_steps"] < whole["load_steps"], f"{resumed['load_steps']} load steps after {whole['load_steps']}: nothing was kept")
    close(points("out.vtu").point_data["displacement"], points("whole.vtu").point_data["displacement"], 1e-8, "displacements")
    expect_ok(mpi(2, *command, "--resume", "steps", "--summary", "ended.json"))
    ended = json.loads(pathlib.Path("ended.json").read_text())
    expect(ended["load_steps"] == 0 and ended["relative_residual"] == resumed["relative_residual"] > 0, f"nothing was left to do: {ended}")
    scene(text=LARGE + "load_steps = 41\n")
    expect_error(mpi(2, *command, "--resume", "steps"), PROGRAM, "another scene")
    data = pathlib.Path("steps").read_bytes()
    pathlib.Path("steps").write_bytes(data[:-8])
    expect_error(mpi(2, *command, "--resume", "steps"), PROGRAM, "truncated or damaged")


if __name__ == "__main__":
    main(globals())

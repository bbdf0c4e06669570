"""Calls of the C library that fail, one after another (tests/faults/fail_call.cpp): a command ends with success and its whole
result, or with one line, and then what was there before is there still."""

import json
import os
import pathlib
import shutil
import sys

from harness import BIN, SCENE, SOURCE, Skip, body, box, bracket, expect, expect_ok, main, need_step, run, scene, write

# FLEXEL_FAULTS_MOST: how many of each kind of call fail, evenly between the first and the last (FLEXEL_FAULTS_ALLOCATIONS: of
# allocations); FLEXEL_FAULTS_RESULTS: a file to
# which a line of JSON with the counts is added (tools/reliability).
KINDS = ("write", "fsync", "rename", "open", "close", "malloc")
MOST = int(os.environ.get("FLEXEL_FAULTS_MOST", "12"))
OLD = b"what was there before\n"


def library():
    path = BIN / "libfail_call.so"
    if not path.exists():
        raise Skip("fail_call.cpp was not built")
    return str(path)


def counted(command, **options):
    """How often each kind of call is made by any one process of the command."""
    environment = dict(os.environ, LD_PRELOAD=library(), FLEXEL_FAULT_COUNTS="counts.txt")
    expect_ok(run(*command, env=environment, **options))
    most = {kind: 0 for kind in KINDS}
    for line in pathlib.Path("counts.txt").read_text().splitlines():
        kind, count = line.split()
        if kind in KINDS:
            most[kind] = max(most[kind], int(count))
    os.remove("counts.txt")
    return most


def whole(name, data, reference):
    if name.endswith(".json"):  # holds times
        try:
            return isinstance(json.loads(data), (dict, list))
        except ValueError:
            return False
    return data == reference


def sweep(command, outputs, least=1):
    """Each fault alone, over old results."""
    program = command[0]
    inputs = {path.name: path.read_bytes() for path in pathlib.Path(".").iterdir()}
    for name in outputs:
        write(name, OLD)
    counts = counted(command)
    reference = {name: pathlib.Path(name).read_bytes() for name in outputs}
    expect(counts["fsync"] >= len(outputs) and counts["rename"] >= len(outputs), f"results are replaced without fsync and rename: {counts}")
    said = expect_ok(run(*command)).out
    tried = failed = 0
    for kind in KINDS:
        count = counts[kind]
        most = int(os.environ.get("FLEXEL_FAULTS_ALLOCATIONS", MOST)) if kind == "malloc" else MOST
        numbers = range(1, count + 1) if count <= most else sorted({1 + round(i * (count - 1) / (most - 1)) for i in range(most)})
        for number in numbers:
            shutil.rmtree("again", ignore_errors=True)
            os.mkdir("again")
            for name, data in inputs.items():
                pathlib.Path("again", name).write_bytes(data)
            for name in outputs:
                pathlib.Path("again", name).write_bytes(OLD)
            environment = dict(os.environ, LD_PRELOAD=library(), FLEXEL_FAULT=f"{kind}:{number}")
            done = run(*command, env=environment, cwd="again")
            what = f"{' '.join(map(str, command))} with {kind} {number} of {count} failing: {done}"
            found = {path.name: path.read_bytes() for path in pathlib.Path("again").iterdir()}
            expect(set(found) == set(inputs) | set(outputs), f"files {sorted(found)}; {what}")
            tried += 1
            if done.code == 0:
                expect(all(whole(name, found[name], reference[name]) for name in outputs), f"success, but not its result; {what}")
                expect(outputs or done.out == said, f"success, but not all was said; {what}")
                continue
            failed += 1
            errors = [line for line in done.err.splitlines() if f"{program}: error: " in line]
            expect(0 < done.code < 6 and len(errors) == 1, f"one line and an exit code wanted; {what}")
            expect("internal error" not in done.err, what)
            old, new = ([name for name in outputs if good(name)] for good in
                        (lambda name: found[name] == OLD, lambda name: found[name] != OLD and whole(name, found[name], reference[name])))
            expect(sorted(old + new) == sorted(outputs), f"old: {old}, new: {new}, and others neither; {what}")
            expect(not old or not new, f"some are old ({old}), some new ({new}); {what}")
    shutil.rmtree("again", ignore_errors=True)
    expect(failed >= least and tried > failed, f"{failed} of {tried} faults were noticed")
    if results := os.environ.get("FLEXEL_FAULTS_RESULTS"):
        with open(results, "a", encoding="utf-8") as file:
            file.write(json.dumps({"name": sys.argv[1].removeprefix("test_").replace("_", " "), "calls": sum(counts.values()),
                                   "failed": tried, "noticed": failed}) + "\n")


def test_voxelize():
    box()
    sweep(("flexel-voxelize", "box.stl", "--size", "5 mm", "--moments", "-o", "body.vtu", "--summary", "s.json"), ("body.vtu", "s.json"))


def test_voxelize_step_in_a_child():
    need_step()
    bracket()
    sweep(("flexel-voxelize", "bracket.step", "--size", "5 mm", "-o", "body.vtu"), ("body.vtu",))


def test_simulate():
    body()
    scene()
    sweep(("flexel-simulate", "scene.toml", "body.vtu", "-o", "bent.vtu", "--summary", "s.json"), ("bent.vtu", "s.json"))


def test_simulate_quadratic():
    body("body.vtu", "--moments")
    scene("scene.toml", 'model = "quadratic"\n' + SCENE)
    sweep(("flexel-simulate", "scene.toml", "body.vtu", "-o", "bent.vtu"), ("bent.vtu",))


def test_simulate_in_time():
    body()
    scene("scene.toml", SCENE + '[run]\ntime = "20 us"\n')
    sweep(("flexel-simulate", "scene.toml", "body.vtu", "-o", "bent.vtu", "--history", "h.csv"), ("bent.vtu", "h.csv"))


def bent():
    body()
    scene()
    expect_ok(run("flexel-simulate", "scene.toml", "body.vtu", "-o", "bent.vtu", "--no-estimate"))


def test_map():
    bent()
    sweep(("flexel-map", "bent.vtu", "-o", "bent.stl", "--report", "r.json"), ("bent.stl", "r.json"))


def test_map_to_a_body_of_polygons():
    bent()
    sweep(("flexel-map", "bent.vtu", "-o", "bent.glb"), ("bent.glb",))


def test_map_to_an_archive():
    bent()
    sweep(("flexel-map", "bent.vtu", "-o", "bent.3mf"), ("bent.3mf",))


def test_deform():
    box()
    scene()
    sweep(("flexel", "deform", "box.stl", "--scene", "scene.toml", "--size", "5 mm", "-o", "out.stl", "--summary", "s.json"), ("out.stl", "s.json"))


def test_picture():
    bent()
    sweep(("flexel", "picture", "bent.vtu", "--size", "400x300", "-o", "p.png"), ("p.png",))


def test_no_thread_can_be_started():
    """With --threads 1 nothing changes; without, the result is the same or a line names that option."""
    box()
    bent()
    none = dict(os.environ, LD_PRELOAD=library(), FLEXEL_FAULT="thread:1:1000000")
    for command, output in ((("flexel-voxelize", "box.stl", "--size", "5 mm"), "b.vtu"), (("flexel-simulate", "scene.toml", "body.vtu"), "s.vtu"),
                            (("flexel-map", "bent.vtu"), "m.stl"), (("flexel", "picture", "bent.vtu", "--size", "200x150"), "p.png"),
                            (("flexel", "deform", "box.stl", "--scene", "scene.toml", "--size", "5 mm"), "d.stl")):
        command = (*command, "--force", "-o", output)
        expect_ok(run(*command, "--threads", "1"))
        reference = pathlib.Path(output).read_bytes()
        expect_ok(run(*command, "--threads", "1", env=none))
        expect(pathlib.Path(output).read_bytes() == reference, f"{command}: another result")
        done = run(*command, env=none)
        expect(pathlib.Path(output).read_bytes() == reference, f"{command}: another result: {done}")
        expect(done.code == 0 or done.code == 2 and "give --threads 1" in done.err, done)


def test_export():
    box()
    scene()
    sweep(("flexel", "export", "box.stl", "--scene", "scene.toml", "--size", "5 mm", "--calculix", "-o", "out.inp"), ("out.inp",))


SWING = 'model = "springs"\n' + SCENE.replace("-100 N", "-1 N") + '[run]\ntime = "20 us"\nstep = "0.2 us"\n'


def test_export_to_lammps():
    box()
    scene("scene.toml", SWING)
    sweep(("flexel", "export", "box.stl", "--scene", "scene.toml", "--size", "5 mm", "--lammps", "-o", "out.in"), ("out.in", "out.data", "out.vtu"))


def test_import_lammps():
    body()
    sys.path.insert(0, str(SOURCE / "tests/interop"))
    from files import vtu_arrays
    positions = vtu_arrays("body.vtu")["points/position"].tolist()
    frame = f"ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n{len(positions)}\nITEM: BOX BOUNDS ss ss ss\n0 1\n0 1\n0 1\nITEM: ATOMS id x y z\n"
    write("run.dump", frame + "".join(f"{n} {x!r} {y!r} {z!r}\n" for n, (x, y, z) in enumerate(positions, 1)))
    sweep(("flexel", "import-lammps", "run.dump", "body.vtu", "-o", "out.vtu"), ("out.vtu",))


def test_info_on_stdout():
    box()
    sweep(("flexel", "info", "box.stl", "--json"), ())


if __name__ == "__main__":
    main(globals())

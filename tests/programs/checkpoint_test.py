"""Timed runs that are stopped and go on: the same bytes as a run that was not, whatever the scene calls for; and refusals."""

import os
import pathlib
import shutil
import signal
import subprocess
import time

from harness import BIN, body, expect, expect_error, expect_ok, expect_only, run, scene, main

SWING = """material = "MATERIAL"
MORE
[[fix]]
where = "xmin"
[[load]]
where = "xmax"
force = ["0 N", "0 N", "FORCE"]
time = ["0 s", "TIME"]
factor = [0, 1]
[[probe]]
name = "tip"
where = "xmax"
[run]
time = "TIME"
frames = 40
"""


def text(material, force, duration, more="", run_keys=""):
    return SWING.replace("MATERIAL", material).replace("FORCE", force).replace("TIME", duration).replace("MORE", more) + run_keys


RUBBER = ("rubber", "-0.01 N")
MODELS = {
    "cells": text(*RUBBER, "0.3 s", '[gravity]\nacceleration = ["0 m/s2", "0 m/s2", "-1 m/s2"]\n[drag]\ndensity = "1 kg/m3"'),
    "damped": text(*RUBBER, "0.3 s", '[damping]\ntime = "2 us"'),
    "long_damping": text(*RUBBER, "20 ms", '[damping]\ntime = "20 ms"'),
    "springs": text("rubber", "-1 N", "0.2 s", '[parts.body-box]\nmodel = "springs"\n[fracture]\nelongation = 0.05'),
    "broken": text("soft", "6 N", "0.1 s", '[materials.soft]\nyoung = "10 MPa"\npoisson = 0.3\ndensity = "1000 kg/m3"\nsource = "test"\n'
                   '[plasticity]\nyield = "20 kPa"\nhardening = "1 MPa"\n[fracture]\nelongation = 0.02').replace(
                       '["0 N", "0 N", "6 N"]', '["6 N", "0 N", "0 N"]'),
    "events": text(*RUBBER, "0.3 s", '[damping]\ntime = "2 us"\n[[event]]\nat = "0.05 s"\ndo = "renormalise"\n[[event]]\nat = "0.1 s"\ndo = "edit"\n'
                   'stiffness = 0.5\nwhere = { box = { min = ["10 mm", "-1 mm", "-1 mm"], max = ["20 mm", "11 mm", "11 mm"] } }\n'
                   '[[event]]\nat = "0.2 s"\ndo = "carve"\nwhere = { box = { min = ["14 mm", "4 mm", "4 mm"], max = ["26 mm", "11 mm", "11 mm"] } }\n'),
    # it falls on one end, bounces, tips over and slides
    "contact": 'material = "rubber"\n[contact]\nfriction = 0.3\ndamping = "20 us"\n[damping]\ntime = "20 us"\n[[plane]]\npoint = ["0 mm", "0 mm", "-1 mm"]\n'
               'normal = [0.1, 0, 1]\n[gravity]\nacceleration = [0, 0, "-9.81 m/s2"]\n[[velocity]]\nwhere = "body-box"\nvelocity = [0, 0, "-1 m/s"]\n'
               '[[probe]]\nname = "tip"\nwhere = "xmax"\n[run]\ntime = "60 ms"\nframes = 40\n',
    "implicit": text("steel", "-100 N", "0.01 s", '[damping]\ntime = "20 us"', 'method = "implicit"\nstep = "5 us"\n'),
}


def whole(name, *options):
    """The run that nothing stops, in a folder of its own: its files' bytes."""
    os.mkdir("whole")
    for file in ("scene.toml", "body.vtu"):
        shutil.copy(file, "whole")
    expect_ok(run("flexel-simulate", "scene.toml", "body.vtu", "-o", name, "--history", "h.csv", *options, cwd="whole"))
    return {path.name: path.read_bytes() for path in pathlib.Path("whole").iterdir()}


def interrupt(arguments, ready, by=signal.SIGINT, **options):
    """Starts a run and interrupts it once `ready` is there. False: it ended before."""
    process = subprocess.Popen([BIN / "flexel-simulate", *arguments], stderr=subprocess.PIPE, **options)
    while not os.path.exists(ready) and process.poll() is None:
        time.sleep(0.002)
    process.send_signal(by)
    error = process.communicate(timeout=60)[1].decode()
    if process.returncode == 0:
        return False
    expect(process.returncode == 128 + by and "--resume run.checkpoint" in error, f"exit {process.returncode}: {error}")
    return True


def expect_same(wanted):
    for name, data in wanted.items():
        expect(pathlib.Path(name).read_bytes() == data, f"{name} should have the same bytes as that of the whole run")


def stop_and_go(model, *placement):
    scene(text=MODELS[model])
    body("body.vtu", *placement)
    wanted = whole("swing.pvd")
    stops = 0
    stops += interrupt(["scene.toml", "body.vtu", "-o", "swing.pvd", "--history", "h.csv", "--checkpoint", "run.checkpoint"], "swing_00007.vtu")
    for frame, by in ((19, signal.SIGTERM), (31, signal.SIGHUP)):
        if stops:
            stops += interrupt(["--resume", "run.checkpoint", "--threads", "1"], f"swing_{frame:05}.vtu", by)
    expect(stops > 0, "the run was too short to be stopped")
    expect_ok(run("flexel-simulate", "--resume", "run.checkpoint"))
    expect_same(wanted)


def test_cells():
    stop_and_go("cells")


def test_damped_cells():
    stop_and_go("damped")


def test_long_damping():
    stop_and_go("long_damping")


def test_contact():
    stop_and_go("contact")


def test_springs_that_break():
    stop_and_go("springs")


def test_cells_that_flow_and_break():
    stop_and_go("broken")


def test_paper():
    MODELS["paper"] = MODELS["damped"]
    stop_and_go("paper", "--placement", "centre")


def test_events():
    stop_and_go("events")


def test_implicit_steps():
    stop_and_go("implicit")


def test_implicit_contact():
    MODELS["implicit_contact"] = MODELS["contact"] + 'method = "implicit"\nstep = "2 ms"\n'
    stop_and_go("implicit_contact")


def start_one():
    body()
    scene(text=MODELS["cells"])
    for seconds in (0.05, 0.1, 0.2, 0.4):  # on a busy machine the first may pass before the run has begun
        result = run("flexel-simulate", "scene.toml", "body.vtu", "-o", "out.vtu", "--checkpoint", "run.checkpoint", "--timeout", f"{seconds} s")
        if "--resume" in result.err:
            break
    expect_error(result, "flexel-simulate", "stopped by --timeout", "--resume run.checkpoint", code=5)


def test_timeout_leaves_a_checkpoint():
    start_one()
    expect_only("body.vtu", "scene.toml", "out.failed.vtu", "run.checkpoint")
    wanted = whole("out.vtu")
    expect_ok(run("flexel-simulate", "scene.toml", "body.vtu", "-o", "out.vtu", "--resume", "run.checkpoint"))
    expect(pathlib.Path("out.vtu").read_bytes() == wanted["out.vtu"], "the result should have the same bytes")


def test_written_now_and_then():
    body()
    scene(text=MODELS["cells"])
    expect_ok(run("flexel-simulate", "scene.toml", "body.vtu", "-o", "out.vtu", "--checkpoint", "run.checkpoint", "--checkpoint-every", "10 ms"))
    whole_run = pathlib.Path("out.vtu").read_bytes()
    os.remove("out.vtu")
    expect_ok(run("flexel-simulate", "--resume", "run.checkpoint"))
    expect(pathlib.Path("out.vtu").read_bytes() == whole_run, "the result should have the same bytes")


def test_another_scene_or_body_is_refused():
    start_one()
    resume = ["--resume", "run.checkpoint", "-o", "on.vtu"]
    scene("other.toml", MODELS["cells"] + "# changed\n")
    expect_error(run("flexel-simulate", "other.toml", *resume), "flexel-simulate", "run.checkpoint", "another scene")
    body("other.vtu", "--placement", "centre")
    expect_error(run("flexel-simulate", "scene.toml", "other.vtu", *resume), "flexel-simulate", "run.checkpoint", "another body")
    expect_error(run("flexel-simulate", "--resume", "run.checkpoint", "-o", "on.pvd"), "flexel-simulate", "out.vtu")
    expect_error(run("flexel-simulate", *resume, "--history", "h.csv"), "flexel-simulate", "--history")


def test_damage_is_refused():
    start_one()
    data = pathlib.Path("run.checkpoint").read_bytes()
    for name, bad, fragment in (("short", data[:5], "not a checkpoint"), ("head", data[:20], "truncated"), ("cut", data[:-100], "truncated"),
                                ("half", data[:len(data) // 2], "truncated"), ("flipped", data[:300] + bytes([data[300] ^ 4]) + data[301:], "damaged"),
                                ("late", data[:-9] + bytes([data[-9] ^ 1]) + data[-8:], "damaged"), ("longer", data + b"0", "truncated"),
                                ("version", data[:8] + b"\x63" + data[9:], "version 99"), ("scene.toml", pathlib.Path("scene.toml").read_bytes(), "not a checkpoint")):
        if name != "scene.toml":
            pathlib.Path(name).write_bytes(bad)
        expect_error(run("flexel-simulate", "--resume", name, "-o", "on.vtu"), "flexel-simulate", name, fragment)
    expect_error(run("flexel-simulate", "--resume", "absent", "-o", "on.vtu"), "flexel-simulate", "absent")


def test_checkpoints_are_for_timed_runs():
    body()
    scene()
    expect_error(run("flexel-simulate", "scene.toml", "body.vtu", "-o", "out.vtu", "--checkpoint", "c"), "flexel-simulate", "--checkpoint", "time")
    expect_error(run("flexel-simulate", "scene.toml", "body.vtu", "-o", "out.vtu", "--checkpoint-every", "1 s"), "flexel-simulate", "--checkpoint FILE")
    expect_error(run("flexel-simulate"), "flexel-simulate", "scene")
    scene(text=MODELS["cells"])
    expect_error(run("flexel-simulate", "scene.toml", "body.vtu", "-o", "out.vtu", "--checkpoint", "no/such/folder/c"), "flexel-simulate", "no/such/folder")


if __name__ == "__main__":
    main(globals())

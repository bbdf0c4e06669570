"""Every command that prints a result prints it as JSON with --json, and nothing else on stdout."""

import json
import pathlib
import shutil

from harness import BIN, body, box, expect, expect_error, expect_ok, main, run, scene

PULL = ["--fix", "xmin", "--push", "xmax: 0 0 -100 N", "--material", "steel", "--size", "5 mm"]


def parsed(*command):
    return json.loads(expect_ok(run("flexel", *command)).out)


def test_deform_prints_its_summary():
    box()
    printed = parsed("deform", "box.stl", *PULL, "--json")
    expect_ok(run("flexel", "deform", "box.stl", *PULL, "-o", "bent.stl", "--summary", "summary.json"))
    written = json.loads(pathlib.Path("summary.json").read_text())
    expect(list(printed) == ["voxelize", "simulate", "map", "warnings"], f"{list(printed)}")
    for key in ("largest_displacement", "mass", "reactions"):
        expect(printed["simulate"][key] == written["simulate"][key], f"{key}: {printed['simulate'][key]}")
    expect(printed["simulate"]["largest_displacement"] > 0, "nothing moved")


def test_json_and_a_part_on_stdout():
    box()
    expect_error(run("flexel", "deform", "box.stl", *PULL, "--json", "-o", "-", "--format", "stl"), "flexel", "--json", "-o")


def test_json_and_another_result_on_stdout():
    box()
    for option in ("--summary", "--report", "--body"):
        expect_error(run("flexel", "deform", "box.stl", *PULL, "--json", "-o", "bent.stl", option, "-"), "flexel", "stdout")
        expect(not pathlib.Path("bent.stl").exists(), f"{option}: a part was written")


def test_other_commands():
    box()
    expect(parsed("info", "box.stl", "--json")["files"][0]["parts"][0]["triangles"] == 12, "a box has 12 triangles")
    expect(parsed("materials", "--json"), "no material")
    expect(parsed("measure", "--model", "cells", "--size", "1 mm", "--json"), "nothing measured")


def test_the_stages():
    """What --json prints is what --summary and --report write; the result itself needs a file then."""
    box()
    scene()
    for name, option, command in (("flexel-voxelize", "--summary", ["box.stl", "--size", "5 mm", "-o", "body.vtu"]),
                                  ("flexel-simulate", "--summary", ["scene.toml", "body.vtu", "-o", "bent.vtu"]),
                                  ("flexel-map", "--report", ["bent.vtu", "-o", "bent.stl"])):
        printed = json.loads(expect_ok(run(name, *command, "--json", option, "found.json")).out)
        written = json.loads(pathlib.Path("found.json").read_text())
        expect(printed == written and len(printed) > 2, f"{name}: {printed}")
        expect(pathlib.Path(command[-1]).stat().st_size > 100, f"{name}: no result")
        piped = ["--format", "stl"] if name == "flexel-map" else []
        expect_error(run(name, *command[:-2], *piped, "--json"), name, "two results would go to stdout")


def test_no_json_of_a_series():
    scene("scene.toml", 'material = "steel"\n[[fix]]\nwhere = "xmin"\n[gravity]\nacceleration = [0, 0, "-9.81 m/s^2"]\n[run]\ntime = "0.1 ms"\nframes = 2\n')
    expect_ok(run("flexel-simulate", "scene.toml", body(), "-o", "swing.pvd"))
    expect_error(run("flexel-map", "swing.pvd", "-o", "bent.stl", "--json"), "flexel-map", "--json", "one state")


def test_compensate_and_export():
    box()
    for command in (["compensate", "box.stl", *PULL, "-o", "made.stl"], ["export", "box.stl", *PULL, "--calculix", "-o", "box.inp"]):
        printed = json.loads(expect_ok(run("flexel", *command, "--json", "--summary", "found.json", "--force")).out)
        expect(printed == json.loads(pathlib.Path("found.json").read_text()) and len(printed) > 4, f"{command[0]}: {printed}")
    expect_error(run("flexel", "export", "box.stl", *PULL, "--calculix", "-o", "-", "--json"), "flexel", "stdout")


def test_scene_keys():
    groups = parsed("scene-keys", "--json")["groups"]
    keys = {(key["table"], key["key"]) for group in groups for key in group["keys"]}
    expect(("[[fix]]", "where") in keys and ("[run]", "time") in keys, f"{sorted(keys)[:20]}")
    words = expect_ok(run("flexel", "scene-keys", "--words")).out.decode().split()
    expect({key for _, key in keys} <= set(words), "--words lacks keys")
    expect_error(run("flexel", "scene-keys", "--json", "--words"), "flexel", "excludes")


# What draws, serves, only lists where to click, or makes a body of a body has nothing to print as JSON.
WITHOUT = {"picture", "view", "clay", "coarsen", "import-lammps"}


def test_every_command_has_it_or_prints_nothing():
    listed = expect_ok(run("flexel", "--describe-arguments")).out.decode().splitlines()
    for name in (line.split("\t")[1] for line in listed):
        has = "--json" in expect_ok(run("flexel", name, "--help")).out.decode()
        expect(has == (name not in WITHOUT), f"flexel {name}: --json {has}")


def test_every_command_prints_json_alone():
    """A new command belongs into this table, or among those that have a test of their own above or below."""
    box()
    body("body.vtu")
    elsewhere = {"study", "measure", "doctor"}
    out = ["-o", "out.stl", "--force"]
    commands = {"deform": ["box.stl", *PULL, *out], "flex": ["box.stl", "--bend", "10 deg", "--material", "steel", "--size", "5 mm", *out],
                "compare": ["box.stl", "box.stl", *PULL], "compensate": ["box.stl", *PULL, *out],
                "export": ["box.stl", *PULL, "--calculix", "-o", "out.inp"], "info": ["box.stl"], "materials": [], "scene-keys": [],
                "voxelize": ["box.stl", "--size", "5 mm", "-o", "out.vtu"], "simulate": [scene(), "body.vtu", "-o", "out.vtu", "--force"],
                "map": ["body.vtu", *out]}
    listed = {line.split("\t")[1] for line in expect_ok(run("flexel", "--describe-arguments")).out.decode().splitlines()}
    expect(listed - WITHOUT - elsewhere == set(commands), f"not in the table: {listed - WITHOUT - elsewhere ^ set(commands)}")
    for name, arguments in commands.items():
        expect(parsed(name, *arguments, "--json"), f"flexel {name}: nothing was found")


def test_doctor():
    found = parsed("doctor", "--json")
    test = found["self_test"]
    expect(test["passed"] and abs(test["found"] / test["known"] - 1) < 1e-5, f"{test}")
    expect(found["isa"] in ("portable", "avx2", "avx512"), f"{found['isa']}")
    own = {tool["name"]: tool["found"] for tool in found["tools"] if tool["own"]}
    for name, there in own.items():
        expect(there == (BIN / name).exists(), f"{name}: {there}")
    said = expect_ok(run("flexel", "doctor")).out.decode()
    expect("self-test   passed" in said, said)


def test_doctor_where_programs_are_missing():
    pathlib.Path("bin").mkdir()
    shutil.copy(BIN / "flexel", "bin/flexel")
    own = ["flexel-voxelize", "flexel-simulate", "flexel-map", "flexel-meshes", "flexel-distances.so", "flexel-serve.so"]
    for name in own:
        pathlib.Path("bin", name).symlink_to(BIN / name)
    reads_cad = (BIN / "flexel-cad").exists()
    done = run("bin/flexel", "doctor")
    if reads_cad:
        expect(done.code == 2 and "MISSING     flexel-cad" in done.out.decode() and "error: flexel-cad is missing" in done.err, done)
    else:
        said = expect_ok(done).out.decode()
        expect("left out    flexel-cad" in said and "MISSING" not in said, said)
    pathlib.Path("bin", own[0]).unlink()
    done = run("bin/flexel", "doctor")
    wanted = "flexel-voxelize, flexel-cad are missing" if reads_cad else "flexel-voxelize is missing"
    expect(done.code == 2 and f"MISSING     {own[0]}" in done.out.decode() and f"error: {wanted}" in done.err, done)


if __name__ == "__main__":
    main(globals())

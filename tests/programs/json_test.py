"""Every command that prints a result prints it as JSON with --json, and nothing else on stdout."""

import json
import pathlib
import shutil

from harness import BIN, box, expect, expect_error, expect_ok, main, run

PULL = ["--fix", "xmin", "--push", "xmax: 0 0 -100 N", "--material", "steel", "--size", "5 mm"]


def parsed(*command):
    return json.loads(expect_ok(run("flexel", *command)).out)


def test_deform_prints_its_summary():
    box()
    printed = parsed("deform", "box.stl", *PULL, "--json")
    expect_ok(run("flexel", "deform", "box.stl", *PULL, "-o", "bent.stl", "--summary", "summary.json"))
    written = json.loads(pathlib.Path("summary.json").read_text())
    expect(list(printed) == ["voxelize", "simulate", "map"], f"{list(printed)}")
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
    said = expect_ok(run("bin/flexel", "doctor")).out.decode()  # a build may leave flexel-cad out
    expect("missing     flexel-cad" in said and "MISSING" not in said, said)
    pathlib.Path("bin", own[0]).unlink()
    done = run("bin/flexel", "doctor")
    expect(done.code == 2 and f"MISSING     {own[0]}" in done.out.decode() and f"error: {own[0]} is missing" in done.err, done)


if __name__ == "__main__":
    main(globals())

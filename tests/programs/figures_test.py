"""One word, one value: what a run prints, what its summary holds and what the mapped part shows."""

import json
import math
import pathlib
import re

from harness import binary_stl, box_triangles, expect, expect_ok, main, run, write

PREFIX = {"km": 1e3, "m": 1, "mm": 1e-3, "um": 1e-6, "nm": 1e-9, "GPa": 1e9, "MPa": 1e6, "kPa": 1e3, "Pa": 1}


def askew(name="box.stl"):
    """The box turned about z and y, so that its surface cuts cells everywhere."""
    a, b = 0.4, 0.3

    def turn(p):
        x, y, z = p
        x, z = math.cos(b) * x + math.sin(b) * z, -math.sin(b) * x + math.cos(b) * z
        return math.cos(a) * x - math.sin(a) * y, math.sin(a) * x + math.cos(a) * y, z

    return write(name, binary_stl([tuple(map(turn, triangle)) for triangle in box_triangles()]))


def said(result, what):
    found = re.search(what + r" ([0-9.e+-]+) (\w+)", result.err)
    expect(found, f"\"{what}\" is not said: {result}")
    return float(found[1]) * PREFIX[found[2]]


def near(one, other, within, what):
    expect(abs(one - other) <= within * abs(other), f"{what}: {one} and {other}")


def faces(name):
    parts = json.loads(expect_ok(run("flexel", "info", name, "--json")).out)["files"][0]["parts"]
    ends = sorted(parts[0]["faces"], key=lambda face: face["centroid"][0])
    return ends[0]["selection"], ends[-1]["selection"]


def run_model(model, *options):
    held, pushed = faces(askew())
    write("scene.toml", f'material = "steel"\n[parts.box]\nmodel = "{model}"\n[[fix]]\nwhere = "{held}"\n'
                        f'[[load]]\nwhere = "{pushed}"\nforce = [0, 0, "-10 N"]\n')
    expect_ok(run("flexel-voxelize", "box.stl", "--size", "2.3 mm", "-o", "box.vtu", *options))
    result = expect_ok(run("flexel-simulate", "scene.toml", "box.vtu", "-o", "bent.vtu", "--summary", "s.json", "--no-estimate", "--verbose"))
    summary = json.loads(pathlib.Path("s.json").read_text(encoding="utf-8"))
    near(said(result, "largest displacement"), summary["largest_displacement"], 6e-3, "printed and in the summary")
    mapped = expect_ok(run("flexel-map", "bent.vtu", "-o", "bent.ply", "--attributes", "--report", "map.json"))
    report = json.loads(pathlib.Path("map.json").read_text(encoding="utf-8"))
    near(report["largest_vertex_displacement"], summary["largest_displacement"], 5e-3 if model != "paper" else 0.15, "of the vertices")
    near(said(mapped, "vertices move by up to"), report["largest_vertex_displacement"], 6e-3, "printed and in the report")
    if model == "paper":
        expect("largest_von_mises" not in summary, "model paper has no stress")
    else:
        near(said(result, "largest von Mises stress"), summary["largest_von_mises"], 6e-3, "printed and in the summary")
    printed = [line.split(": warning: ", 1)[1] for line in result.err.splitlines() if ": warning: " in line]
    expect(summary["warnings"] == printed, f"{summary['warnings']}, and printed {printed}")
    expect(bool(printed) == (model != "cells"), f"what a model leaves out is a warning: {printed}")


def test_cells():
    run_model("cells")


def test_springs():
    run_model("springs", "--align", "none")


def test_paper():
    run_model("paper", "--placement", "centre")


def test_a_warning_before_a_run_is_in_its_summary():
    held, pushed = faces(askew())
    write("scene.toml", f'material = "steel"\n[[fix]]\nwhere = "{held}"\n[[load]]\nwhere = "{pushed}"\nforce = [0, 0, "-10 N"]\n')
    expect_ok(run("flexel-voxelize", "box.stl", "--size", "4 mm", "-o", "box.vtu"))
    told = expect_ok(run("flexel-simulate", "scene.toml", "box.vtu", "-o", "bent.ply", "--summary", "s.json", "--no-estimate", "--quiet")).err
    warnings = json.loads(pathlib.Path("s.json").read_text(encoding="utf-8"))["warnings"]
    expect("bent.ply gets a body" in told and told == "".join(f"flexel-simulate: warning: {line}\n" for line in warnings), f"{warnings}, and {told}")


if __name__ == "__main__":
    main(globals())

#!/usr/bin/env python3
"""Whether `flexel deform --accuracy 2%` reaches what it claims.

    PATH=build/release/bin:$PATH bench/accuracy/accuracy_option.py [--accuracy SHARE] [--within TIME] [--cells N] [--parts DIR] [--work DIR] [CASE...]

Each part and scene is run with the option, and once at half the spacing that was chosen, or with about --cells cells where that would be
more: the reference. References are kept in the folder --work, so that a bench that was stopped goes on where it was. The true error is the largest relative difference of a probe, or of the elastic energy where
moves drive the part; "reference" says how much finer the reference's spacing is than the chosen one's, and its own error bar. Parts that
are not there are skipped, and said so. So is a case whose reference is less than 1.4 times as fine. Ends with 1 where fewer than nine of
ten are truly within the accuracy asked for, or where a run claims it whose true error is over 2.5 times as large.
"""

import argparse
import hashlib
import json
import math
import pathlib
import shutil
import struct
import subprocess
import sys
import tempfile

from end_faces import end_faces


LEAST_FINER = 1.4  # a reference that is not is none


def box(x, y, z):
    corners = [(a, b, c) for c in (0, z) for b in (0, y) for a in (0, x)]
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return [[corners[f[0]], corners[f[i]], corners[f[i + 1]]] for f in faces for i in (1, 2)]


def tube(inner, outer, height, sides=96):
    at = lambda r, i, z: (r * math.cos(2 * math.pi * i / sides), r * math.sin(2 * math.pi * i / sides), z)
    triangles = []
    for i in range(sides):
        quads = [[at(outer, i, 0), at(outer, i + 1, 0), at(outer, i + 1, height), at(outer, i, height)],
                 [at(inner, i + 1, 0), at(inner, i, 0), at(inner, i, height), at(inner, i + 1, height)],
                 [at(inner, i, 0), at(inner, i + 1, 0), at(outer, i + 1, 0), at(outer, i, 0)],
                 [at(outer, i, height), at(outer, i + 1, height), at(inner, i + 1, height), at(inner, i, height)]]
        for a, b, c, d in quads:
            triangles += [[a, b, c], [a, c, d]]
    return triangles


def write_stl(path, triangles):
    data = b"part".ljust(80) + struct.pack("<I", len(triangles))
    for triangle in triangles:
        data += struct.pack("<12fH", 0, 0, 0, *[c for corner in triangle for c in corner], 0)
    path.write_bytes(data)


def scene(fix, act, probe, material="steel"):
    """`probe` is a selection or, as "at = ...", a point."""
    asked = probe if probe.startswith("at = ") else f"where = {probe}"
    return f'material = "{material}"\n[[fix]]\nwhere = {fix}\n{act}[[probe]]\nname = "asked"\n{asked}\n'


def load(where, *force):
    return f"[[load]]\nwhere = {where}\nforce = [" + ", ".join(f'"{each} N"' for each in force) + "]\n"


def ends(axis, *force):
    """Held at one end of the part, loaded at the other."""
    return scene(f'"{axis}min"', load(f'"{axis}max"', *force), f'"{axis}max"')


def at_end_faces(part):
    """Held and drawn at the flat faces at the two ends. The sides of a rounded part are edges, and a load on an edge has no limit that
    finer lattices could approach."""
    info = json.loads(subprocess.run(["flexel", "info", part, "--json"], check=True, capture_output=True, text=True).stdout)
    held, drawn = (face["selection"] for face in end_faces(info["files"][0]["parts"][0]))
    return scene(f'"{held}"', load(f'"{drawn}"', 5, 5, 5), f'"{drawn}"')


# name -> (part: a file among the real parts, or a function that writes it; scene, or a function that writes it)
CASES = {
    "beam": (lambda folder: write_stl(folder / "beam.stl", box(100, 20, 20)), ends("x", 0, 0, -1000)),
    "slender strip": (lambda folder: write_stl(folder / "strip.stl", box(120, 20, 4)), ends("x", 0, 0, -20)),
    "bar twisted": (lambda folder: write_stl(folder / "bar.stl", box(100, 20, 20)),
                    scene('"xmin"', '[[load]]\nwhere = "xmax"\ntorque = ["50 N m", 0, 0]\n', 'at = ["100 mm", "20 mm", "20 mm"]')),
    "tube bent": (lambda folder: write_stl(folder / "tube.stl", tube(12, 20, 120)), ends("z", 1000, 0, 0)),
    "block squeezed": (lambda folder: write_stl(folder / "block.stl", box(40, 30, 20)),
                       scene('"zmin"', '[[move]]\nwhere = "zmax"\ndisplacement = [0, 0, "-0.1 mm"]\n', '"xmax"')),
    "bracket sample": ("make_bracket", pathlib.Path("samples/bracket/bend.toml")),
    "bracket, PLA, twisted": ("make_bracket", scene('"bracket/1"', '[[load]]\nwhere = "bracket/2"\ntorque = ["0.5 N m", 0, 0]\n', '"bracket/2"',
                                                    "PLA")),
    "4040_base_mount": ("4040_base_mount.step", ends("x", 0, 0, -100)),
    "Moving_Jaw_SO101": ("Moving_Jaw_SO101.step", at_end_faces),
    "base_interface": ("base_interface_AP203.STEP", ends("z", 50, 0, 0)),
    "featuretype": ("featuretype.STEP", ends("x", 0, 0, -100)),
    "lower_leg_structure_fork": ("lower_leg_structure_fork.STEP", at_end_faces),
}


def flexel(part, scene_file, *options):
    """The summary, or a line of error."""
    with tempfile.TemporaryDirectory() as place:
        out = pathlib.Path(place)
        done = subprocess.run(["flexel", "deform", part, "--scene", scene_file, "-o", out / "out.stl", "--summary", out / "s.json",
                               "--quiet", *options], capture_output=True, text=True, check=False)
        if done.returncode != 0:
            return None, done.stderr.strip().splitlines()[-1]
        return json.loads((out / "s.json").read_text()), ""


def asked_of(summary, driven):
    found = summary["simulate"]
    values = [math.hypot(*probe["displacement"]) for probe in found["probes"]]
    return values + ([found["elastic_energy"]] if driven else [])


def make_part(source, folder, arguments):
    """The part's file, or why there is none."""
    if callable(source):
        source(folder)
        return next(folder.glob("*.stl")), ""
    if source == "make_bracket":
        if shutil.which("make_bracket") is None:
            return None, "make_bracket is not built (OpenCASCADE)"
        subprocess.run(["make_bracket", folder / "bracket.step"], check=True)
        return folder / "bracket.step", ""
    part = arguments.parts / source
    return (part, "") if part.exists() else (None, f"{part} is not there")


def reference_cells(cells, most):
    """Of a reference for a run of so many cells: half the spacing, or as near to that as `most` allows. In steps of two, so that kept ones
    serve when the chosen size changes a little."""
    return min(most, max(125_000, 125_000 * 2 ** math.ceil(math.log2(8 * cells / 125_000))))


def reference(part, scene_file, driven, cells, arguments):
    """What about so many cells give: {"values", "bar" (share), "cells"}; or a line of error."""
    content = part.read_bytes().rpartition(b"DATA;")[2]  # the head of a STEP file has its date
    key = hashlib.sha256(content + scene_file.read_bytes() + str(cells).encode()).hexdigest()[:16]
    kept = arguments.work / f"{part.stem}-{key}.json"
    if not kept.exists():
        summary, error = flexel(part, scene_file, "--count", str(cells))
        if summary is None:
            return None, error
        wanted = {"probe asked"} | ({"elastic_energy"} if driven else set())
        bars = [each["bar"] / abs(each["value"]) for each in summary["simulate"]["error_bars"]["bars"] if each["of"] in wanted and each["value"]]
        found = {"values": asked_of(summary, driven), "bar": max(bars, default=None), "cells": summary["simulate"]["cells"]}
        arguments.work.mkdir(parents=True, exist_ok=True)
        new = kept.with_suffix(".new")
        new.write_text(json.dumps(found))
        new.rename(kept)
    return json.loads(kept.read_text()), ""


def run(name, arguments):
    """A row of the table and whether (truly reached, claimed falsely); nothing where it is skipped."""
    source, text = CASES[name]
    with tempfile.TemporaryDirectory() as place:
        folder = pathlib.Path(place)
        part, missing = make_part(source, folder, arguments)
        if part is None:
            print(f"| {name} | skipped: {missing} | | | | | | |", flush=True)
            return None
        if isinstance(text, pathlib.Path):
            text = (pathlib.Path(__file__).parents[2] / text).read_text()
        if callable(text):
            text = text(part)
        scene_file = folder / "scene.toml"
        scene_file.write_text(text)
        driven = "[[move]]" in text
        options = ["--accuracy", arguments.accuracy] + (["--within", arguments.within] if arguments.within else [])
        summary, error = flexel(part, scene_file, *options)
        if summary is None:
            print(f"| {name} | {error} | | | | | | |", flush=True)
            return False, False
        told = summary["accuracy"]
        cells = told["runs"][-1]["cells"]
        fine, error = reference(part, scene_file, driven, reference_cells(cells, arguments.cells), arguments)
        if fine is None:
            print(f"| {name} | the reference: {error} | | | | | | |", flush=True)
            return None
    finer = (fine["cells"] / cells) ** (1 / 3)
    true = max(abs(a / b - 1) for a, b in zip(asked_of(summary, driven), fine["values"]) if b)
    wanted = told["asked"]
    claims = told["reached"] is not None and told["reached"] <= wanted
    reached = "?" if told["reached"] is None else f"{100 * told['reached']:.2g}"
    bar = "no bar" if fine["bar"] is None else f"{100 * fine['bar']:.2g} %"
    judged = finer >= LEAST_FINER
    print(f"| {name} | {1e3 * told['size']:.4g} | {cells:,} | {reached} | {'yes' if claims else 'no'} | "
          f"{f'{100 * true:.2f}' if judged else 'not judged'} | x {finer:.1f}, {bar} | {told['seconds']:.1f} |", flush=True)
    return (true <= wanted, claims and true > 2.5 * wanted) if judged else None


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--accuracy", default="2%")
    parser.add_argument("--within", default="")
    parser.add_argument("--cells", type=int, default=1_000_000, help="of a reference, at most")
    parser.add_argument("--parts", type=pathlib.Path, default=pathlib.Path(__file__).resolve().parents[2].parent / "shared/parts")
    parser.add_argument("--work", type=pathlib.Path, default=pathlib.Path("out/accuracy-option"))
    parser.add_argument("cases", nargs="*", metavar="CASE")
    arguments = parser.parse_args()
    unknown = [name for name in arguments.cases if name not in CASES]
    if unknown:
        parser.error(f"no case {', '.join(unknown)}; there are {', '.join(CASES)}")
    print(f"| part and scene | size mm | cells | error told % | claims {arguments.accuracy} | true error % | reference | s |\n|---|---|---|---|---|---|---|---|")
    found = [run(name, arguments) for name in arguments.cases or CASES]
    judged = [each for each in found if each is not None]
    within = sum(each[0] for each in judged)
    false = sum(each[1] for each in judged)
    print(f"\n{within} of {len(judged)} truly within {arguments.accuracy}; {false} claim it with a true error over 2.5 times that.")
    sys.exit(0 if judged and within >= 0.9 * len(judged) and false == 0 else 1)


if __name__ == "__main__":
    main()

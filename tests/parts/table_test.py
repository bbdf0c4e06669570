"""The command that writes docs/measurements/parts.md: every real part ends in a lattice or is refused with one line."""

import pathlib
import sys

from harness import BIN, PARTS, SOURCE, Skip, expect, expect_ok, main, run


def test_every_part_ends_in_a_lattice_or_in_one_line():
    if not PARTS.is_dir():
        raise Skip(f"{PARTS} is not there")
    expect_ok(run(sys.executable, SOURCE / "tools/parts-table", "--bin", BIN, "--parts", PARTS, "--count", "2000", "-o", "parts.md", timeout=280))
    rows = [line.split(" | ") for line in pathlib.Path("parts.md").read_text().splitlines() if line.startswith("| ")][1:]
    said = {row[0].removeprefix("| "): row[1] + ": " + row[2] for row in rows}
    expected = {
        "foot_structure.STL": "140 open edges closed by welding",
        "angle_block.STL": "166 open edges closed by welding",
        "multibody.stl": "inside out and turned",
        "planar-geom-03.stl": "refused (exit 2)",
        "conrod.stl": "shells interpenetrate",
        "openscad-nonmanifold-crash.obj": "cells",
        "yarn_guide.stl": "cells",
    }
    for file, words in expected.items():
        expect(words in said[file], f"{file}: \"{words}\" wanted: {said[file]}")


def test_the_first_answer_is_right_or_refused():
    if not PARTS.is_dir():
        raise Skip(f"{PARTS} is not there")
    done = expect_ok(run(sys.executable, SOURCE / "tools/first-answers", "--bin", BIN, "--parts", PARTS, "-o", "answers.md", "angle_block.STL",
                         "box_UTF16BE.obj", "planar-geom-03.stl", timeout=280))
    said = done.out.decode()
    expect("3 parts: 1 right, 2 refused, 0 wrong" in said, said)
    expect(pathlib.Path("answers.md").read_text().count("**") == 6, said)


if __name__ == "__main__":
    main(globals())

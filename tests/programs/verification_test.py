"""The quick part of bench/accuracy/verification.py, which writes docs/measurements/verification.md."""

import os
import re

from harness import BIN, SOURCE, expect, main, run


def test_the_quick_part_holds():
    found = run(SOURCE / "bench/accuracy/verification.py", "--quick", "-o", "verification.md", env={**os.environ, "PATH": f"{BIN}:{os.environ['PATH']}"})
    expect(found.code == 0, found)
    with open("verification.md", encoding="utf-8") as file:
        page = file.read()
    for section in ("The lattice as a material", "The paper's cantilever", "A thick tube under pressure"):
        expect(f"## {section}" in page, f"no section {section!r}")
    rows = re.findall(r"^\| \d+ \| [\d,]+ \| ([+-][\d.]+) \| ([\d.]+|none) \| (yes|no) \|$", page, re.M)
    expect(len(rows) == 6, page)
    for figure in re.findall(r"!\[[^]]*\]\(([^)]*)\)", page):
        expect(os.path.exists(figure), f"no figure {figure}")


def test_a_missing_program_is_one_line():
    found = run(SOURCE / "bench/accuracy/verification.py", "--quick", "-o", "verification.md", env={**os.environ, "PATH": "/usr/bin:/bin"})
    expect(found.code != 0 and not os.path.exists("verification.md"), found)


if __name__ == "__main__":
    main(globals())

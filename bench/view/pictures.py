#!/usr/bin/env python3
"""The pictures of docs/guide/view.md: the real page in Chromium, of the bracket of samples/bracket.

    PATH=build/release/bin:$PATH bench/view/pictures.py docs/pictures
"""

import os
import pathlib
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
os.environ.setdefault("FLEXEL_BIN", str(ROOT / "build/release/bin"))
os.environ.setdefault("FLEXEL_SOURCE", str(ROOT))
os.environ.setdefault("FLEXEL_PARTS", str(ROOT / "../shared/parts"))
sys.path.insert(0, str(ROOT / "tests/programs"))
from browser import chromium  # noqa: E402
from harness import expect_ok, run, write  # noqa: E402
from view_test import served  # noqa: E402

SWING = """material = "PLA"
[run]
time = "40 ms"
frames = 40
[[fix]]
where = "bracket/1"
[[load]]
where = "bracket/2"
force = ["0 N", "0 N", "-100 N"]
"""


def push(thickness, output, *arguments):
    expect_ok(run("flexel", "deform", "bracket.step", "--fix", "bracket/1", "--push", "bracket/2: 0 0 -100 N", "--material", thickness, "--size", "2 mm",
                  "-o", output, "--quiet", *arguments))


def shoot(name, files, act, size=(1100, 760)):
    with chromium(size) as browser, served(*files) as (url, _):
        browser.open(url.geturl())
        act(browser)
        browser.run("return new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
        browser.screenshot(name)


def stress(browser):
    browser.choose("colour", "von_mises")
    browser.run("document.getElementById('shape').open = false")
    browser.click(600, 400)


def section(browser):
    for control, value in (("dark", True), ("colour", "strain"), ("scaling", "log"), ("low", "0.001"), ("before", "ghost"), ("scale-number", "2"),
                           ("cut-axis", "y"), ("cut", True)):
        browser.choose(control, value)
    browser.run("document.getElementById('cut').closest('details').open = true; flexelView.picture.fit()")


def beside(browser):
    browser.choose("colour", "displacement")


def swing(browser):
    browser.choose("frame", "14")
    browser.choose("before", "wipe")
    browser.choose("wipe", "0.62")


def main():
    folder = pathlib.Path(sys.argv[1]).resolve()
    with tempfile.TemporaryDirectory() as work:
        os.chdir(work)
        expect_ok(run("make_bracket", "bracket.step"))
        push("PLA", "pla.vtu", "--summary", "summary.json")
        push("ABS", "abs.vtu")
        write("swing.toml", SWING)
        expect_ok(run("flexel-voxelize", "bracket.step", "--size", "3mm", "-o", "rest.vtu"))
        expect_ok(run("flexel-simulate", "swing.toml", "rest.vtu", "-o", "swing.pvd"))
        shoot(folder / "view-stress.png", ["pla.vtu", "--summary", "summary.json"], stress)
        shoot(folder / "view-section.png", ["pla.vtu"], section)
        shoot(folder / "view-beside.png", ["pla.vtu", "abs.vtu"], beside)
        shoot(folder / "view-series.png", ["swing.pvd"], swing)


if __name__ == "__main__":
    main()

"""The page that goes through the paper, and the pages of the samples: every command works, and prints and draws what the page says and shows."""

import os
import pathlib
import re
import sys

from harness import BIN, SOURCE, expect, main
from pictures import read_png, write_png

sys.path.append(str(SOURCE / "bench/paper"))
from page import SAMPLES, blocks, pictures, run_blocks  # noqa: E402

NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")


def same(said, printed):
    """Words as they are, numbers within a hundredth: the page rounds them; what is zero is zero to rounding."""
    if NUMBER.sub("#", said) != NUMBER.sub("#", printed):
        return False
    pairs = zip(map(float, NUMBER.findall(said)), map(float, NUMBER.findall(printed)))
    return all(abs(a - b) <= 0.01 * max(abs(a), abs(b)) or max(abs(a), abs(b)) < 1e-12 for a, b in pairs)


def unlike(one, other):
    """What tells two pictures apart, or None: sizes; more than one value of a hundred off by more than a quarter of the range. Lines that are drawn
    a hundredth of a pixel elsewhere are the same."""
    if one == other:
        return None
    (width, height, rows), (other_width, other_height, other_rows) = read_png(one), read_png(other)
    if (width, height) != (other_width, other_height):
        return f"{width} x {height} against {other_width} x {other_height}"
    off = sum(abs(a - b) > 64 for row, other_row in zip(rows, other_rows) if row != other_row for a, b in zip(row, other_row))
    return f"{off} of {3 * width * height} values differ" if off > 0.01 * 3 * width * height else None


def compare(page, least=1):
    text = page.read_text(encoding="utf-8")
    found = blocks(text)
    expect(len(found) >= least, f"{len(found)} blocks")
    os.environ["PATH"] = f"{BIN}:{os.environ['PATH']}"
    printed = run_blocks([each for each, _ in found], pathlib.Path.cwd())
    for number, ((commands, said), each) in enumerate(zip(found, printed)):
        expect(same(said, each), f"block {number}:\n{commands}\nprints\n{each}\nand the page says\n{said}")
    expect(any(said for _, said in found), "no figures")
    for name in pictures(text):
        difference = unlike((SOURCE / "docs/pictures" / name).read_bytes(), pathlib.Path(name).read_bytes())
        expect(not difference, f"the page's {name} is not what its commands draw: {difference}")


def compare_sample(name):
    compare(SOURCE / f"samples/{name}/README.md")


def test_every_command_of_the_page_prints_what_it_says():
    page = SOURCE / "docs/guide/paper.md"
    expect(all(said for _, said in blocks(page.read_text(encoding="utf-8"))), "a block without figures")
    compare(page, 10)


def test_the_figures():
    compare(SOURCE / "docs/guide/paper-figures.md", 6)


def test_bracket():
    compare_sample("bracket")


def test_cantilever():
    compare_sample("cantilever")


def test_carved():
    compare_sample("carved")


def test_dented():
    compare_sample("dented")


def test_fork():
    compare_sample("fork")


def test_frozen():
    compare_sample("frozen")


def test_gripped():
    compare_sample("gripped")


def test_kneaded():
    compare_sample("kneaded")


def test_squeezed():
    compare_sample("squeezed")


def test_supports():
    compare_sample("supports")


def test_swing():
    compare_sample("swing")


def test_torn():
    compare_sample("torn")


def test_every_sample_with_a_scene_is_compared():
    folders = {page.parent.name for page in (SOURCE / "samples").glob("*/README.md") if list(page.parent.glob("*.toml"))}
    expect(folders == set(SAMPLES), f"{folders ^ set(SAMPLES)}")
    expect(all(f"test_{name}" in globals() for name in SAMPLES), "a sample without a test")


def test_the_comparison_can_fail():
    expect(same("end x: 1.004 mm\n", "end x: 1.001 mm\n") and not same("end x: 1.1 mm\n", "end x: 1 mm\n"), "numbers")
    expect(not same("end x: 1 mm\n", "end y: 1 mm\n"), "words")
    white, spotted, black = (write_png(40, 30, [bytes(v for x in range(40) for v in pixel(x, y)) for y in range(30)])
                             for pixel in (lambda x, y: (255, 255, 255), lambda x, y: (0, 0, 0) if x == y == 5 else (255, 255, 255),
                                           lambda x, y: (0, 0, 0) if x < 5 else (255, 255, 255)))
    expect(unlike(white, white) is None and unlike(white, spotted) is None and "values" in unlike(white, black), "pictures")
    expect("against" in unlike(white, write_png(20, 30, [bytes(60)] * 30)), "sizes")


if __name__ == "__main__":
    main(globals())

"""Pages with figures: every command works, and prints what the page says that it prints."""

import os
import pathlib
import re
import sys

from harness import BIN, SOURCE, expect, main

sys.path.append(str(SOURCE / "bench/paper"))
from page import blocks, run_blocks  # noqa: E402

NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")


def same(said, printed):
    """Words as they are, numbers within a hundredth: the page rounds them; what is zero is zero to rounding."""
    if NUMBER.sub("#", said) != NUMBER.sub("#", printed):
        return False
    pairs = zip(map(float, NUMBER.findall(said)), map(float, NUMBER.findall(printed)))
    return all(abs(a - b) <= 0.01 * max(abs(a), abs(b)) or max(abs(a), abs(b)) < 1e-12 for a, b in pairs)


def compare(page, least):
    found = blocks(page.read_text(encoding="utf-8"))
    expect(len(found) >= least, f"{len(found)} blocks")
    os.environ["PATH"] = f"{BIN}:{os.environ['PATH']}"
    for number, ((commands, said), printed) in enumerate(zip(found, run_blocks([each for each, _ in found], pathlib.Path.cwd()))):
        expect(said, f"block {number} has no figures:\n{commands}")
        expect(same(said, printed), f"block {number}:\n{commands}\nprints\n{printed}\nand the page says\n{said}")


def test_every_command_of_the_page_prints_what_it_says():
    compare(SOURCE / "docs/guide/paper.md", 10)


def test_the_kneaded_bar_is_what_its_page_says():
    compare(SOURCE / "samples/kneaded/README.md", 1)


def test_the_comparison_can_fail():
    expect(same("end x: 1.004 mm\n", "end x: 1.001 mm\n") and not same("end x: 1.1 mm\n", "end x: 1 mm\n"), "numbers")
    expect(not same("end x: 1 mm\n", "end y: 1 mm\n"), "words")


if __name__ == "__main__":
    main(globals())

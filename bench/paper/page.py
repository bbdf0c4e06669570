#!/usr/bin/python3
"""Runs the commands of a page, block by block in one folder, and writes what each prints into the ```text block that follows it.

    PATH=build/release/bin:$PATH bench/paper/page.py [PAGE.md ...]      (docs/guide/paper.md, samples/kneaded/README.md)
"""

import pathlib
import re
import subprocess
import sys
import tempfile

SOURCE = pathlib.Path(__file__).resolve().parents[2]
PAGES = [SOURCE / "docs/guide/paper.md", SOURCE / "samples/kneaded/README.md"]
BLOCK = re.compile(r"^```sh\n(.*?)^```\n(?:\n```text\n(.*?)^```\n)?", re.M | re.S)


def blocks(text):
    """(commands, what the page says that they print) of each block."""
    return [(match[1], match[2] or "") for match in BLOCK.finditer(text)]


def run_blocks(commands, folder):
    """What each prints; it ends at the first that fails."""
    printed = []
    (folder / "samples").symlink_to(SOURCE / "samples")
    for each in commands:
        done = subprocess.run(["bash", "-eu", "-o", "pipefail", "-c", each], cwd=folder, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, timeout=300, check=False)
        if done.returncode != 0:
            raise RuntimeError(f"{each}\nends with {done.returncode}:\n{done.stderr.decode()}")
        printed.append(done.stdout.decode())
    return printed


def write(page):
    text = page.read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory(prefix="flexel-") as folder:
        try:
            printed = iter(run_blocks([commands for commands, _ in blocks(text)], pathlib.Path(folder)))
        except RuntimeError as error:
            sys.exit(f"page.py: {page}: {error}")

    def written(match):
        said = next(printed)
        return f"```sh\n{match[1]}```\n" + (f"\n```text\n{said}```\n" if said else "")

    page.write_text(BLOCK.sub(written, text), encoding="utf-8")


if __name__ == "__main__":
    for each in sys.argv[1:] or PAGES:
        write(pathlib.Path(each).resolve())

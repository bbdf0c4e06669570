#!/usr/bin/python3
"""Runs the commands of a page, block by block in one folder; writes what each prints into the ```text block that follows it, and the pictures
that the page shows of what they draw.

    PATH=build/release/bin:$PATH bench/paper/page.py [PAGE.md ...]      (docs/guide/paper.md, paper-figures.md and the pages of the samples)
"""

import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

SOURCE = pathlib.Path(__file__).resolve().parents[2]
SAMPLES = ["bracket", "cantilever", "carved", "dented", "fork", "frozen", "gripped", "kneaded", "squeezed", "supports", "swing", "torn"]
PAGES = [SOURCE / "docs/guide/paper.md", SOURCE / "docs/guide/paper-figures.md"] + [SOURCE / f"samples/{name}/README.md" for name in SAMPLES]
PICTURE = re.compile(r"!\[[^]]*\]\((?:[^)]*/)?([^/)]+\.png)\)")
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


def pictures(text):
    """Names of those that the page shows."""
    return PICTURE.findall(text)


def write(page):
    text = page.read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory(prefix="flexel-") as folder:
        try:
            printed = iter(run_blocks([commands for commands, _ in blocks(text)], pathlib.Path(folder)))
        except RuntimeError as error:
            sys.exit(f"page.py: {page}: {error}")
        for name in pictures(text):
            shutil.copyfile(pathlib.Path(folder) / name, SOURCE / "docs/pictures" / name)

    def written(match):
        said = next(printed)
        return f"```sh\n{match[1]}```\n" + (f"\n```text\n{said}```\n" if said else "")

    page.write_text(BLOCK.sub(written, text), encoding="utf-8")


if __name__ == "__main__":
    for each in sys.argv[1:] or PAGES:
        write(pathlib.Path(each).resolve())

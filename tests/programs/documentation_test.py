"""Every command in a ```sh block of README.md and docs/ works as it stands; paper_test.py has docs/guide/paper.md and the pages of the
samples, tests/pipelines the scripts of samples/README.md.

The blocks of a page run one after another in one shell (`bash -eu -o pipefail`), in a folder that looks like the repository after
tools/demo: build/release/bin, samples and out/bracket.step are there. A block that is not to be run is fenced ```text.
"""

import pathlib
import re

from harness import BIN, SOURCE, bracket, expect, main, shell, write


def blocks(page):
    return re.findall(r"^```sh\n(.*?)^```$", page.read_text(encoding="utf-8"), re.M | re.S)


def furnish():
    pathlib.Path("build/release").mkdir(parents=True)
    pathlib.Path("build/release/bin").symlink_to(BIN)
    pathlib.Path("samples").symlink_to(SOURCE / "samples")
    pathlib.Path("out").mkdir()
    bracket("out/bracket.step")


def run_page(name):
    found = blocks(SOURCE / name)
    expect(found, f"{name} has no ```sh block")
    furnish()
    result = shell("set -eu -o pipefail\n" + "\n".join(found), timeout=170)
    expect(result.code == 0, f"the commands of {name} as they stand: {result}\n{result.out.decode(errors='replace')}")


def test_readme():
    run_page("README.md")


def test_samples():
    """tests/pipelines runs each script; the page has them all, with no argument more."""
    folder = SOURCE / "samples/pipelines"
    commands = re.findall(r"^samples/pipelines/(\w+)\.sh(.*)$", "\n".join(blocks(SOURCE / "samples/README.md")), re.M)
    on_page = {name: len(arguments.split()) for name, arguments in commands}
    calls = re.findall(r'\bpipeline\("(\w+)\.sh", (.*?)\)', (SOURCE / "tests/pipelines/pipelines_test.py").read_text(encoding="utf-8"))
    tested = {name: arguments.count(",") + 1 for name, arguments in calls}
    expect(set(on_page) == set(tested) == {script.stem for script in folder.glob("*.sh")}, f"{on_page} on the page, tested {tested}")
    expect(all(0 < number <= tested[name] for name, number in on_page.items()), f"{on_page} on the page, tested {tested}")


def test_docs():
    pages = [page for page in sorted((SOURCE / "docs").rglob("*.md")) if blocks(page) and page.name not in ("paper.md", "paper-figures.md")]
    expect(pages, "no page of docs/ has a command that can be run")
    furnish()
    for page in pages:
        write("page.sh", "set -eu -o pipefail\n" + "\n".join(blocks(page)))
        result = shell("bash page.sh", timeout=100)
        expect(result.code == 0, f"the commands of {page.relative_to(SOURCE)} as they stand: {result}")


def test_the_index_has_every_page():
    docs = SOURCE / "docs"
    index = (docs / "README.md").read_text(encoding="utf-8")
    missing = [name for page in sorted(docs.rglob("*.md")) if f"({(name := str(page.relative_to(docs)))})" not in index and name != "README.md"]
    expect(not missing, f"docs/README.md has no link to {missing}")


if __name__ == "__main__":
    main(globals())

"""What an installation holds: a tree that can be moved, and the licences of all that is compiled into it."""

import os
import pathlib
import re
import shutil
import sys

from harness import BIN, SOURCE, Skip, box, expect, expect_ok, main, need, run, shell

# Linked as shared libraries with interfaces of C, or tools: their packages carry their own licences.
NOT_COMPILED_IN = {"build-essential", "cmake", "ninja-build", "zlib1g-dev", "libpng-dev", "libfreetype-dev", "libfontconfig-dev", "libmicrohttpd-dev", "gnuplot-nox",
                   "python3-dev", "python3-numpy", "file", "python3"}


def test_licences_of_all_that_is_compiled_in():
    setup = (SOURCE / "tools/setup").read_text()
    packages = set(re.search(r"build_packages=\((.*?)\)", setup, re.S)[1].split())
    text = (SOURCE / "tools/cmake/debian_copyright.txt").read_text()
    named = set(re.findall(r"[a-z0-9.+-]+", text))
    expect(NOT_COMPILED_IN <= packages, f"not in tools/setup: {NOT_COMPILED_IN - packages}")
    missing = packages - NOT_COMPILED_IN - named
    expect(not missing, f"debian_copyright.txt does not name {sorted(missing)}")
    used = set(re.findall(r"(?<=\n\n)Files: .*?\nLicense: (.*?)\n", text, re.S))
    given = set(re.findall(r"\n\nLicense: (.*)\n ", text))
    expect(used == given, f"licences without text, or without use: {used ^ given}")


def git(*arguments):
    return expect_ok(run("git", "-c", "user.name=a", "-c", "user.email=a@b.invalid", *arguments))


def test_a_release_is_of_what_is_committed():
    """tools/release begins with a clean clone: what is not committed, or lies in the folder, is refused before anything is built."""
    need("git")
    pathlib.Path("tree/tools").mkdir(parents=True)
    shutil.copy(SOURCE / "tools/release", "tree/tools/release")
    for name in ("CMakeLists.txt", "CHANGELOG.md"):
        shutil.copy(SOURCE / name, f"tree/{name}")
    pathlib.Path("tree/tools/check").write_text("#!/bin/sh\necho checked in $PWD $*; exit 7\n")
    os.chmod("tree/tools/check", 0o755)
    git("init", "-q", "tree")
    git("-C", "tree", "add", "-A")
    git("-C", "tree", "commit", "-qm", "all of it")

    def refused(*arguments):
        done = run("tree/tools/release", *arguments)
        expect(done.code == 2 and done.err.startswith("tools/release: error: ") and len(done.err.splitlines()) == 1, f"{done}")
        return done.err

    out = pathlib.Path("out").absolute()
    expect("unknown option" in refused(out, "--fast"), "an unknown option")
    out.mkdir(exist_ok=True)
    (out / "old").touch()
    expect("is not empty" in refused(out), "a folder with files")
    (out / "old").unlink()
    done = run("tree/tools/release", out)
    expect(done.code == 7 and b"checked in /" in done.out and str(pathlib.Path("tree").absolute()).encode() not in done.out.split(b"checked in")[1],
           f"{done}\n{done.out.decode()}")
    expect(not os.listdir(out), "a release of what failed its tests")
    shutil.rmtree(out)
    expect("the folder is missing" in refused(), "no folder")
    # Where tests and packages succeed: stand-ins, for both take minutes. The folder is the caller's, not the tree's.
    pathlib.Path("tree/tools/check").write_text("#!/bin/sh\n")
    pathlib.Path("tree/tools/package").write_text("#!/bin/sh\nmkdir -p build/package; echo packed >build/package/flexel.deb\n")
    os.chmod("tree/tools/package", 0o755)
    pathlib.Path("tree/.gitignore").write_text("build/\n")
    git("-C", "tree", "add", "-A")
    git("-C", "tree", "commit", "-qm", "stand-ins")
    expect_ok(run("tree/tools/release", "out"))
    made = sorted(os.listdir(out))
    expect(made[0] == "SHA256SUMS" and re.fullmatch(r"flexel-[0-9.]+\.tar\.gz", made[1]) and made[2:] == ["flexel.deb"], made)
    expect_ok(shell("cd out && sha256sum --check --quiet --strict SHA256SUMS && tar xzf flexel-*.tar.gz"))
    expect(len(list(out.glob("flexel-*/tools/release"))) == 1, "the source is not in its archive")
    shutil.rmtree(out)
    pathlib.Path("tree/new").touch()
    expect("has changes" in refused(out), "a file that is not committed")
    git("-C", "tree", "add", "-A")
    git("-C", "tree", "commit", "-qm", "more")
    version = re.search(r"project\(flexel VERSION ([0-9.]+)", pathlib.Path("tree/CMakeLists.txt").read_text())[1]
    git("-C", "tree", "tag", f"v{version}", "HEAD~1")
    expect("raise the version" in refused(out), "a version that another commit has")


def test_a_tree_that_was_moved():
    """cmake --install, then mv: programs, man pages, completions and the Python package still find each other."""
    if not (BIN.parent / "cmake_install.cmake").exists():
        raise Skip("the programs are in no build folder")
    expect_ok(run("cmake", "--install", BIN.parent, "--prefix", pathlib.Path("first").absolute()))
    shutil.move("first", "second")
    tree = pathlib.Path("second").absolute()
    for name in ("share/man/man1/flexel-deform.1.gz", "share/bash-completion/completions/flexel", "share/zsh/vendor-completions/_flexel",
                 "share/fish/vendor_completions.d/flexel.fish", "share/doc/flexel/copyright", "share/doc/flexel/samples/plugins/blender_flexel.py",
                 "share/doc/flexel/docs/guide/python.md"):
        expect((tree / name).exists(), f"{name} is missing")
    clean = {name: value for name, value in os.environ.items() if name not in ("FLEXEL_BIN", "PYTHONPATH")}
    clean["PATH"] = f"{tree / 'bin'}:/usr/bin:/bin"
    expect_ok(run(str(tree / "bin/flexel"), "doctor", env=clean))
    box()
    sample = tree / "share/doc/flexel/samples/bracket/bracket.step"
    expect(sample.exists() == (BIN / "flexel-cad").exists(), "the sample's part is not installed")
    part, place = (sample, ("bracket/1", "bracket/2")) if sample.exists() else ("box.stl", ("xmin", "xmax"))
    pull = ["--fix", place[0], "--push", f"{place[1]}: 0 0 -10 N", "--material", "PLA", "--size", "3 mm", "--quiet"]
    expect_ok(run(str(tree / "bin/flexel"), "deform", part, *pull, "-o", "bent.stl", env=clean))
    expect_ok(run(str(tree / "bin/flexel-voxelize"), part, "--size", "3 mm", "--heal", "wrap", "-o", "body.vtu", env=clean))
    if os.environ.get("FLEXEL_HAS_PYTHON") == "ON":
        clean["PYTHONPATH"] = str(tree / "lib/python3/dist-packages")
        code = "import flexel, sys; print(flexel.__file__); print(flexel.read(sys.argv[1]))"
        said = expect_ok(run(sys.executable, "-c", code, part, env=clean)).out.decode()
        expect(str(tree) in said and "<flexel.Part" in said, said)


if __name__ == "__main__":
    main(globals())

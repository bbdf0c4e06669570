"""What the tests of whole programs share: running them, judging how they end, and small parts to feed them.

A test file holds functions test_*(); ctest runs each by itself as `python3 file.py test_name` in an empty folder. FLEXEL_BIN is
the folder of the programs, FLEXEL_SOURCE the repository, FLEXEL_PARTS the folder of real parts (it may be absent).
"""

import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import traceback

from shapes import ascii_stl, binary_stl, box_triangles  # noqa: F401: for the tests, too

BIN = pathlib.Path(os.environ["FLEXEL_BIN"])
SOURCE = pathlib.Path(os.environ["FLEXEL_SOURCE"])
PARTS = pathlib.Path(os.environ["FLEXEL_PARTS"])
SKIPPED = 77  # ctest's SKIP_RETURN_CODE

SCENE = """material = "steel"
[[fix]]
where = "xmin"
[[load]]
where = "xmax"
force = ["0 N", "0 N", "-100 N"]
[[probe]]
name = "tip"
at = ["40 mm", "5 mm", "5 mm"]
"""


class Skip(Exception):
    """The machine lacks what the test needs."""


class Result:
    def __init__(self, code, out, err):
        self.code, self.out, self.err = code, out, err

    def __str__(self):
        return f"exit {self.code}, {len(self.out)} bytes on stdout, stderr:\n{self.err}"


def run(*arguments, stdin=b"", timeout=120, **options):
    """Runs a program of ours (or any other by its path); stdin is bytes or a file."""
    command = [str(BIN / arguments[0]) if (BIN / arguments[0]).exists() else arguments[0], *map(str, arguments[1:])]
    if isinstance(stdin, bytes):
        options["input"] = stdin
    else:
        options["stdin"] = stdin
    options.setdefault("stdout", subprocess.PIPE)
    done = subprocess.run(command, stderr=subprocess.PIPE, timeout=timeout, check=False, **options)
    return Result(done.returncode, done.stdout or b"", done.stderr.decode(errors="replace"))


def shell(script, timeout=120, **options):
    """Runs a bash script with our programs on its PATH."""
    environment = dict(os.environ, PATH=f"{BIN}:{os.environ['PATH']}")
    done = subprocess.run(["bash", "-c", script], input=b"", stdout=subprocess.PIPE, stderr=subprocess.PIPE, timeout=timeout,
                          env=environment, check=False, **options)
    return Result(done.returncode, done.stdout, done.stderr.decode(errors="replace"))


def expect(condition, message):
    if not condition:
        raise AssertionError(message)


def expect_ok(result):
    expect(result.code == 0, f"should have worked: {result}")
    return result


def expect_error(result, program, *fragments, code=2):
    """Exit code, and a single line of error that names the program and holds every fragment; nothing on stdout."""
    lines = [line for line in result.err.splitlines() if ": error: " in line]
    expect(result.code == code, f"exit code {code} wanted: {result}")
    expect(len(lines) == 1 and result.err.splitlines()[-1] == lines[0], f"one line of error at the end wanted: {result}")
    expect(lines[0].startswith(f"{program}: error: "), f"the line should begin with the program: {result}")
    for fragment in fragments:
        expect(fragment.lower() in lines[0].lower(), f"\"{fragment}\" is missing in: {lines[0]}")
    expect(result.out == b"", f"nothing belongs on stdout: {result}")


def expect_only(*names, folder="."):
    """The folder holds these files and no others: nothing half-written, no temporary left."""
    found = sorted(os.listdir(folder))
    expect(found == sorted(names), f"files {sorted(names)} wanted, found {found}")


def write(name, data):
    pathlib.Path(name).write_bytes(data.encode() if isinstance(data, str) else data)
    return name


def box(name="box.stl"):
    return write(name, binary_stl(box_triangles()))


def body(name="body.vtu", *options):
    """A box of 8 x 2 x 2 cells as a body file."""
    box("body-box.stl")
    expect_ok(run("flexel-voxelize", "body-box.stl", "--size", "5 mm", "-o", name, *options))
    os.remove("body-box.stl")
    return name


def scene(name="scene.toml", text=SCENE):
    return write(name, text)


def need_step():
    """Skips the test where the programs read no STEP files."""
    if not (BIN / "make_bracket").exists():
        raise Skip("built without OpenCASCADE")


def bracket(name="bracket.step"):
    need_step()
    expect_ok(run("make_bracket", name))
    return name


def need(*programs):
    """Skips the test where another tool is not installed."""
    for program in programs:
        if shutil.which(program) is None:
            raise Skip(f"{program} is not installed")


def main(tests):
    """Runs the test named on the command line in an empty folder of its own."""
    name = sys.argv[1]
    with tempfile.TemporaryDirectory(prefix="flexel-") as folder:
        os.chdir(folder)
        try:
            tests[name]()
        except Skip as reason:
            print(f"SKIPPED: {reason}")
            sys.exit(SKIPPED)
        except Exception:
            traceback.print_exc()
            sys.exit(1)
        finally:
            os.chdir("/")

"""tools/torture sees what is wrong with a program, and says what is right of a sound one."""

import os
import pathlib
import sys

from harness import BIN, SOURCE, box, expect, main

sys.path.insert(0, str(SOURCE / "tests/torture"))
import mutate  # noqa: E402
from smaller import smaller  # noqa: E402
from trial import Trial, run, wrong  # noqa: E402


def judged(script, trial=None):
    """What is said of a program that is this shell script."""
    programs = pathlib.Path("programs").resolve()
    programs.mkdir(exist_ok=True)
    path = programs / "liar"
    path.write_text(f"#!/bin/sh\n{script}\n")
    path.chmod(0o755)
    trial = trial or Trial("arguments", ["liar", "-o", "out.json"], {"in.txt": b"sound"}, ["out.json"])
    return wrong(trial, run(trial, programs, os.path.abspath("work")))[0]


ERROR = "echo 'liar: error: no' >&2; exit 2"


def test_faults_of_programs_are_seen():
    for script, what in (("kill -SEGV $$", "exit -11"), ("exit 1", "exit 1"), ("exit 2", "exit 2 with 0 lines of error"), (f"echo 'liar: error: a' >&2; {ERROR}", "exit 2 with 2 lines of error"),
                         ("printf 'liar: error: \\033[31m\\n' >&2; exit 2", "control characters"), ("exit 0", "success without its result"), ("echo '{\"a\": NaN}' > out.json", "not finite"),
                         (f"echo x > out.json; {ERROR}", "a failed run replaced a result"), (f"touch left.tmp; {ERROR}", "leftovers"), (f"touch $TMPDIR/left; {ERROR}", "leftovers in the temporary folder"),
                         (f"echo x > in.txt; {ERROR}", "an input changed"), (f"sleep 60 > /dev/null 2>&1 & {ERROR}", "a child lives on"),
                         ("echo 'liar: error: internal error' >&2; exit 2", "internal error"), ("echo '{}' > out.json", ""), (ERROR, "")):
        expect(judged(script) == what, f"{script}: {judged(script)!r}, not {what!r}")


def test_a_sound_program_is_sound():
    data = pathlib.Path(box()).read_bytes()
    trial = Trial("mutation", ["flexel-voxelize", "box.stl", "--size", "5 mm", "-o", "out.vtu"], {"box.stl": data}, ["out.vtu"])
    expect(wrong(trial, run(trial, BIN, os.path.abspath("work")))[0] == "", "a sound command")
    trial.inputs["box.stl"] = data[:100]
    expect(wrong(trial, run(trial, BIN, os.path.abspath("work")))[0] == "", "a refusal")


def test_findings_become_smaller():
    """Of four changes that one stays which brings the fault about, and of the file no more than it needs."""
    sound = bytes(range(97, 123)) * 20
    changes = [(3, 4, b"!"), (200, 201, b"#"), (300, 310, b""), (400, 400, b"more")]
    trial = Trial("mutation", ["liar", "in.txt", "--quiet", "--size", "5"], {"in.txt": mutate.apply(sound, changes)}, [], changed="in.txt", sound=sound, changes=changes)
    script = "grep -q '#' in.txt && exit 1; exit 0"
    expect(judged(script, trial=trial) == "exit 1", "the fault is there")
    least = smaller(trial, "exit 1", pathlib.Path("programs").resolve(), os.path.abspath("work"))
    expect(least.command == ["liar", "in.txt"] and len(least.changes) == 1, f"{least.command}, {least.changes}")
    expect(b"#" in least.inputs["in.txt"] and len(least.inputs["in.txt"]) < 16, f"{least.inputs}")


if __name__ == "__main__":
    main(globals())

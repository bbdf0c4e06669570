"""Every stop is heard: Ctrl-C within half a second, time limits within one; and a failed stage's exit code reaches the end of a pipe."""

import os
import signal
import subprocess
import time

from harness import BIN, SCENE, box, body, expect, expect_error, expect_ok, expect_only, main, run, scene, shell, write

FINE = ["--size", "0.3 mm"]
HEARD = 3.0  # s: half a second, on a machine that does much else


def interrupted(*command, once):
    """Stopped soon after the stage `once` has ended: exit code 130, one line, at once, and no file more than before."""
    before = sorted(os.listdir("."))
    with subprocess.Popen([str(BIN / command[0]), *command[1:]], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                          stderr=subprocess.PIPE) as process:
        said = []
        while not said or f": {once}: " not in said[-1]:
            said.append(process.stderr.readline().decode())
            expect(said[-1] != "", f"{command} ended before it was stopped: {said}")
        time.sleep(0.3)
        process.send_signal(signal.SIGINT)
        began = time.monotonic()
        process.wait(timeout=60)
        took = time.monotonic() - began
        said += process.stderr.read().decode().splitlines()
    expect(process.returncode == 130, f"{command}: exit code 130 wanted, not {process.returncode}: {said}")
    expect(took < HEARD, f"{command}: it took {took:.1f} s to stop")
    expect(said[-1].endswith(": interrupted"), f"{command}: {said}")
    expect_only(*before)


def test_interrupt_while_voxelizing():
    box()
    interrupted("flexel-voxelize", "box.stl", "--size", "0.1 mm", "--max-memory", "1TB", "-o", "out.vtu", once="import")


def test_interrupt_while_wrapping():
    box()
    interrupted("flexel-voxelize", "box.stl", "--size", "5 mm", "--heal", "wrap:0.02mm", "-o", "out.vtu", once="import")


def test_interrupt_while_mapping():
    box()
    expect_ok(run("flexel-voxelize", "box.stl", *FINE, "--quiet", "-o", "body.vtu"))
    interrupted("flexel-map", "body.vtu", "--check", "voronoi", "-o", "out.stl", once="read")


def test_interrupt_of_flexel():
    box()
    interrupted("flexel", "deform", "box.stl", "--material", "steel", "--fix", "xmin", "--push", "xmax: 0 0 -1 N", *FINE, "-o", "out.stl",
                "--verbose", once="import")


def test_timeout_is_heard_within_a_step():
    """Damping that every step solves for: a hundred of them take much longer than the limit."""
    box()
    expect_ok(run("flexel-voxelize", "box.stl", "--size", "0.4 mm", "--quiet", "-o", "body.vtu"))
    timed = write("timed.toml", 'material = "steel"\n[[fix]]\nwhere = "xmin"\n[gravity]\nacceleration = ["0 m/s2", "0 m/s2", "-9.81 m/s2"]\n'
                                '[damping]\ntime = "1 ms"\n[run]\ntime = "1 s"\n')
    began = time.monotonic()
    result = run("flexel-simulate", timed, "body.vtu", "-o", "out.vtu", "--timeout", "2 s", "--quiet")
    expect_error(result, "flexel-simulate", "stopped by --timeout after", code=5)
    expect(time.monotonic() - began < 2 + 3 * HEARD, f"{time.monotonic() - began:.1f} s for a limit of 2 s")


def test_timeout_of_deform_holds_in_every_stage():
    box()
    began = time.monotonic()
    result = run("flexel", "deform", "box.stl", "--material", "steel", "--fix", "xmin", "--push", "xmax: 0 0 -1 N", "--size", "0.2 mm",
                 "--timeout", "0.3 s", "--quiet", "-o", "out.stl")
    expect_error(result, "flexel", "stopped by --timeout", code=5)
    expect(time.monotonic() - began < 0.3 + HEARD, f"{time.monotonic() - began:.1f} s for a limit of 0.3 s")


def test_a_rate_that_is_no_number_is_refused():
    body()
    scene()
    result = run("flexel-simulate", "scene.toml", "body.vtu", "-o", "out.vtu", "--live", "tcp:0", "--live-rate", "nan", timeout=20)
    expect_error(result, "flexel-simulate", "--live-rate", "nan")
    expect_error(run("flexel-map", "body.vtu", "-o", "out.stl", "--far-distance", "nan"), "flexel-map", "--far-distance", "nan")


def test_the_exit_code_of_a_stage_reaches_the_end_of_the_pipe():
    body()
    scene(text=SCENE.replace("-100 N", "-1000 GN"))
    result = shell("flexel-simulate scene.toml body.vtu --quiet | flexel-map -o out.stl --quiet")
    expect(result.code == 3, f"exit code 3 wanted: {result}")
    expect(len(result.err.splitlines()) == 1, f"the line of the stage that failed, and no other: {result}")
    result = shell("flexel-voxelize none.stl | flexel-simulate scene.toml | flexel-map -o out.stl")
    expect(result.code == 2 and result.err.count("error:") == 1, f"one error, exit code 2 wanted: {result}")
    expect(shell("flexel-simulate scene.toml body.vtu --quiet | wc -c").out.strip() == b"0", "nothing belongs into the pipe")
    result = shell("true | flexel-map -o out.stl")
    expect_error(result, "flexel-map", "stdin is empty")


# The load would move the part by far more than its size: a wrong unit.
def test_a_load_out_of_proportion_is_told_at_once():
    body()
    scene(text=SCENE.replace("-100 N", "-1 GN"))
    result = run("flexel-simulate", "scene.toml", "body.vtu", "-o", "out.vtu", "--quiet")
    expect_error(result, "flexel-simulate", "the load (1000 MN in all)", "2,954 times its size", "--unit", "steel", "load_steps", code=3)


if __name__ == "__main__":
    main(globals())

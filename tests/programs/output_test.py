"""Where results go: pipes, full disks, terminals, folders that are not there, and what stays when a run is stopped."""

import os
import pty
import signal
import subprocess
import time

from harness import (BIN, SCENE, Skip, bracket, body, box, expect, expect_error, expect_ok, expect_only, main, run, scene, shell, write)

# Big enough to overflow any pipe's buffer.
FINE = ["--size", "0.4 mm"]


def test_reader_that_closes_the_pipe():
    box()
    result = shell('flexel-voxelize --quiet box.stl --size 0.4mm | head -c 10 >/dev/null; echo "${PIPESTATUS[0]}"')
    expect(result.out == b"141\n", f"exit code 141 wanted: {result.out} {result}")
    expect(result.err == "", f"silence wanted: {result}")


def test_full_disk_as_stdout():
    box()
    with open("/dev/full", "wb") as full:
        expect_error(run("flexel-voxelize", "box.stl", *FINE, stdout=full), "flexel-voxelize", "no space")
        body()
        expect_error(run("flexel-map", "body.vtu", "--format", "stl", stdout=full), "flexel-map", "no space")


def with_disk(size, command):
    """Runs a program of ours while the folder "disk" is a disk of `size`, and what is on it then."""
    os.mkdir("disk")
    result = run("unshare", "-m", "bash", "-c",
                 f"mount -t tmpfs -o size={size} none disk || exit 99; {BIN}/{command}; code=$?; ls -A disk >left; exit $code")
    if result.code in (1, 99) and "error: disk" not in result.err:
        raise Skip("mounting is not permitted here")
    return result, open("left", encoding="utf-8").read().split()


def test_full_disk():
    box()
    result, left = with_disk("64k", "flexel-voxelize box.stl --size 0.4mm -o disk/out.vtu")
    expect_error(result, "flexel-voxelize", "disk/out.vtu", "no space")
    expect(not left, f"nothing may stay: {left}")


def test_a_disk_that_fills_up_takes_frames_only():
    body()
    falls = write("falls.toml", 'material = "steel"\n[gravity]\nacceleration = ["0 m/s2", "0 m/s2", "-9.81 m/s2"]\n'
                                '[run]\ntime = "1 ms"\nframes = 500\n')
    out = "-o disk/f.pvd --history h.csv --checkpoint on.checkpoint --quiet"
    result, left = with_disk("300k", f"flexel-simulate {falls} body.vtu {out}")
    expect_error(result, "flexel-simulate", "disk/f_", "no space", "--resume on.checkpoint")
    expect(left == ["f.pvd", *(f"f_{i:05}.vtu" for i in range(len(left) - 1))] and len(left) > 5, f"whole frames wanted: {left}")
    rows = open("h.csv", encoding="utf-8").read().splitlines()
    expect(len(rows) > 10, f"the history up to there wanted: {rows}")
    expect_ok(run("flexel-simulate", "--resume", "on.checkpoint", "--quiet"))
    expect(len(open("h.csv", encoding="utf-8").read().splitlines()) > len(rows), "more rows wanted")


def test_terminal_as_stdout():
    try:
        master, slave = pty.openpty()
    except OSError as error:
        raise Skip(f"no terminal to be had: {error}") from error
    try:
        expect_error(run("flexel-voxelize", box(), stdout=slave), "flexel-voxelize", "terminal", "-o")
        expect_error(run("flexel-map", body(), "--format", "stl", stdout=slave), "flexel-map", "terminal")
        expect_ok(run("flexel-map", "body.vtu", "--format", "stl", "--ascii", "--quiet", stdout=slave))
        expect(os.read(master, 5) == b"solid", "an ASCII STL may go to a terminal")
    finally:
        os.close(master)
        os.close(slave)


def test_info_shows_a_bar_on_a_terminal_alone():
    """On stderr, where the reading of a large part takes seconds; a log and completion (--words) have none."""
    try:
        master, slave = pty.openpty()
    except OSError as error:
        raise Skip(f"no terminal to be had: {error}") from error
    try:
        part, terminal = box(), dict(os.environ, TERM="xterm")
        expect_ok(run("flexel", "info", "--words", part))
        subprocess.run([BIN / "flexel", "info", "--words", part], stdout=subprocess.DEVNULL, stderr=slave, env=terminal, check=True)
        subprocess.run([BIN / "flexel", "info", part], stdout=subprocess.DEVNULL, stderr=slave, env=terminal, check=True)
        said = os.read(master, 4096)
        expect(said.startswith(b"\rflexel: import [") and said.endswith(b"\r\x1b[K"), f"{said}")
        expect(said.count(b"import [........................]   0 %") == 1, f"--words too: {said}")
        expect(not expect_ok(run("flexel", "info", part)).err, "a log has lines")
    finally:
        os.close(master)
        os.close(slave)


def test_missing_folder():
    expect_error(run("flexel-voxelize", box(), "-o", "absent/out.vtu"), "flexel-voxelize", "absent/out.vtu", "no such file")


def test_missing_folder_is_told_before_the_work():
    simulate = ["flexel-simulate", scene(), body()]
    deform = ["flexel", "deform", box(), "--fix", "xmin", "--push", "xmax: 0 0 -1 N"]
    for command, option, path in ((["flexel-voxelize", "box.stl"], "-o", "absent/out.vtu"), (["flexel-voxelize", "box.stl"], "--summary", "absent/s.json"),
                                  (simulate, "-o", "absent/out.vtu"), (simulate, "--summary", "absent/s.json"), (deform, "-o", "absent/out.stl")):
        given = ["-o", "out.vtu"] if option != "-o" else []
        result = run(*command, option, path, *given)
        expect_error(result, command[0], path, "no such file")
        expect(result.err.count("\n") == 1, f"one line and no work wanted: {result}")
        expect_only("body.vtu", "box.stl", "scene.toml")


def test_fifo_as_output_is_opened_once():
    os.mkfifo("out.vtu")
    with subprocess.Popen(["cat", "out.vtu"], stdout=subprocess.PIPE) as reader:
        expect_ok(run("flexel-simulate", scene(), body(), "-o", "out.vtu", "--quiet"))
        read = reader.stdout.read()
    expect_ok(run("flexel-simulate", "scene.toml", "body.vtu", "-o", "file.vtu", "--quiet"))
    expect(read == open("file.vtu", "rb").read(), f"the whole body wanted, not {len(read)} bytes")


def test_folder_as_output():
    os.mkdir("out.vtu")
    expect_error(run("flexel-voxelize", box(), "-o", "out.vtu"), "flexel-voxelize", "out.vtu", "folder")


def test_folder_without_permission():
    os.mkdir("locked")
    os.chmod("locked", 0o555)
    folder = "locked" if os.geteuid() != 0 else "/sys/kernel"  # root may write anywhere but there
    result = run("flexel-voxelize", box(), "-o", f"{folder}/out.vtu")
    expect_error(result, "flexel-voxelize", f"{folder}/out.vtu")
    expect(not os.path.exists(f"{folder}/out.vtu"), "nothing should have been written")


def test_failure_keeps_the_old_output():
    box()
    with open("out.vtu", "w", encoding="ascii") as file:
        file.write("precious")
    expect_error(run("flexel-voxelize", "absent.stl", "-o", "out.vtu"), "flexel-voxelize")
    with open("out.vtu", encoding="ascii") as file:
        expect(file.read() == "precious", "a failed run replaced the file")


def stage_before(producer, consumer, program):
    scene()
    body()
    before = os.listdir(".")
    result = shell(f"{producer} | {consumer}")
    expect_error(result, program, "program before")
    expect_only(*before)


def test_voxelize_after_a_program_that_failed():
    stage_before("false", "flexel-voxelize --size 5mm -o out.vtu", "flexel-voxelize")


def test_simulate_after_a_program_that_failed():
    stage_before("false", "flexel-simulate scene.toml -o out.vtu", "flexel-simulate")


def test_map_after_a_program_that_failed():
    stage_before("false", "flexel-map -o out.stl", "flexel-map")


def test_simulate_after_a_program_that_died():
    stage_before("head -c 3000 body.vtu", "flexel-simulate scene.toml -o out.vtu", "flexel-simulate")


def test_map_after_a_program_that_died():
    stage_before("head -c 3000 body.vtu", "flexel-map -o out.stl", "flexel-map")


def stop(command, seconds, stdin=subprocess.DEVNULL):
    with subprocess.Popen([str(BIN / command[0]), *command[1:]], stdin=stdin, stdout=subprocess.DEVNULL,
                          stderr=subprocess.PIPE) as process:
        time.sleep(seconds)
        if process.poll() is not None:
            raise AssertionError(f"{command[0]} ended before it was stopped: {process.stderr.read().decode()}")
        process.send_signal(signal.SIGINT)
        began = time.monotonic()
        process.wait(timeout=30)
        expect(time.monotonic() - began < 10, "it took too long to stop")
        return process.returncode


def test_interrupt_while_waiting_for_input():
    before = [scene()]
    read, keep_open = os.pipe()
    code = stop(["flexel-simulate", "scene.toml", "-o", "out.vtu"], 0.7, stdin=read)
    os.close(keep_open)
    expect(code == 130, f"exit code 130 wanted, not {code}")
    expect_only(*before)


def test_interrupt_while_simulating():
    scene(text=SCENE + "[run]\nload_steps = 100\n")
    box()
    expect_ok(run("flexel-voxelize", "box.stl", *FINE, "-o", "body.vtu"))
    before = os.listdir(".")
    code = stop(["flexel-simulate", "scene.toml", "body.vtu", "-o", "out.vtu"], 2.0)
    expect(code == 130, f"exit code 130 wanted, not {code}")
    expect_only(*before)


# The cell between the two selections is led to its mirror image: no equilibrium.
MIRROR = """material = "steel"
[[fix]]
where = { half_space = { point = ["11 mm", 0, 0], normal = [-1, 0, 0] } }
[[move]]
where = { half_space = { point = ["19 mm", 0, 0], normal = [1, 0, 0] } }
displacement = ["-25 mm", "0 mm", "0 mm"]
"""


def expect_failed_state(name, *others):
    """Besides the inputs only the last good state is there, and it is a body that flexel-map takes."""
    expect_only(name, *others)
    expect_ok(run("flexel-map", name, "-o", "last.stl", "--quiet"))


def test_divergence_leaves_the_last_good_state():
    box()
    expect_ok(run("flexel-voxelize", "box.stl", "--size", "10 mm", "-o", "body.vtu"))
    inputs = ["box.stl", "body.vtu", scene(text=MIRROR)]
    expect_error(run("flexel-simulate", "scene.toml", "body.vtu"), "flexel-simulate", "no equilibrium beyond", "% of the load", code=3)
    expect_only(*inputs)
    result = run("flexel-simulate", "scene.toml", "body.vtu", "-o", "out.vtu", "--summary", "summary.json")
    expect_error(result, "flexel-simulate", "no equilibrium beyond", "out.failed.vtu", code=3)
    expect_failed_state("out.failed.vtu", *inputs)


def test_deform_leaves_the_last_good_state():
    inputs = [box(), scene(text=MIRROR)]
    result = run("flexel", "deform", "box.stl", "--size", "10 mm", "--scene", "scene.toml", "-o", "out.stl")
    expect_error(result, "flexel", "no equilibrium beyond", "out.failed.vtu", code=3)
    expect_failed_state("out.failed.vtu", *inputs)


def test_newton_iterations_are_bounded():
    box()
    expect_ok(run("flexel-voxelize", "box.stl", "--size", "2.5 mm", "-o", "body.vtu"))
    text = SCENE.replace("-100 N", "-1000 MN") + "[run]\nnewton_iterations = 3\n"
    inputs = ["box.stl", "body.vtu", scene(text=text)]
    result = run("flexel-simulate", "scene.toml", "body.vtu", "-o", "out.vtu", timeout=60)
    expect_error(result, "flexel-simulate", "% of the load within 3 Newton iterations", "times its size", "check the unit", code=3)
    expect_failed_state("out.failed.vtu", *inputs)


def test_timeout():
    box()
    expect_ok(run("flexel-voxelize", "box.stl", "--size", "1 mm", "-o", "body.vtu"))
    inputs = ["box.stl", "body.vtu", scene(text=SCENE + "[run]\nload_steps = 10000\n")]
    began = time.monotonic()
    result = run("flexel-simulate", "scene.toml", "body.vtu", "-o", "out.vtu", "--timeout", "4 s")
    expect(time.monotonic() - began < 40, "it took too long to stop")
    expect_error(result, "flexel-simulate", "stopped by --timeout", "% of the load", "out.failed.vtu", code=5)
    expect_failed_state("out.failed.vtu", *inputs)


def test_timeout_of_deform():
    inputs = [box(), scene(text=SCENE + "[run]\nload_steps = 10000\n")]
    result = run("flexel", "deform", "box.stl", "--size", "1 mm", "--scene", "scene.toml", "--timeout", "4s", "-o", "out.stl")
    expect_error(result, "flexel", "stopped by --timeout", "out.failed.vtu", code=5)
    expect_failed_state("out.failed.vtu", *inputs)


def test_timeout_that_is_no_time():
    scene()
    for text in ("5", "5 mm", "0 s", "-1 s"):
        expect_error(run("flexel-simulate", "scene.toml", "body.vtu", "--timeout=" + text), "flexel-simulate", "time")


PROGRAMS = ["flexel", "flexel-voxelize", "flexel-simulate", "flexel-map"]


def test_version():
    for program in PROGRAMS:
        result = expect_ok(run(program, "--version"))
        expect(b"0.1.0" in result.out and result.err == "", f"{program}: {result.out}")


def test_help():
    for program in PROGRAMS:
        result = expect_ok(run(program, "--help"))
        expect(b"--help" in result.out and b"--version" in result.out and result.err == "", f"{program}: {result.out}")


def test_whole_chain_in_one_pipe():
    bracket()
    scene()
    result = shell("set -o pipefail; flexel-voxelize bracket.step --size 3mm | "
                   f"flexel-simulate {scene('bend.toml', SCENE.replace('40 mm', '80 mm').replace('5 mm', '3 mm'))} | "
                   "flexel-map --format stl > bent.stl")
    expect(result.code == 0, str(result))
    expect(os.path.getsize("bent.stl") > 84, "the deformed bracket is empty")


def test_flexel_runs_the_stages():
    box()
    scene()
    expect_ok(run("flexel", "voxelize", "box.stl", "--size", "5mm", "-o", "one.vtu"))
    expect_ok(run("flexel-voxelize", "box.stl", "--size", "5mm", "-o", "two.vtu"))
    with open("one.vtu", "rb") as one, open("two.vtu", "rb") as two:
        expect(one.read() == two.read(), "flexel voxelize and flexel-voxelize differ")


def test_same_bits_for_any_thread_count():
    box()
    scene()
    for threads in ("1", "2", "3"):
        expect_ok(run("flexel-voxelize", "box.stl", "--size", "2 mm", "--threads", threads, "-o", f"body{threads}.vtu"))
        expect_ok(run("flexel-simulate", "scene.toml", f"body{threads}.vtu", "--threads", threads, "-o", f"bent{threads}.vtu"))
    with open("bent1.vtu", "rb") as first:
        reference = first.read()
    for threads in ("2", "3"):
        with open(f"bent{threads}.vtu", "rb") as other:
            expect(other.read() == reference, f"{threads} threads give other bits than one")


if __name__ == "__main__":
    main(globals())

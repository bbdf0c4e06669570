"""Runs that a hand leads and a viewer watches: poses from stdin, frames in real time, whoever leaves when (docs/guide/live.md)."""

import json
import os
import signal
import stat
import subprocess
import sys
import time

from harness import BIN, SOURCE, ascii_stl, box_triangles, expect, expect_error, expect_ok, expect_only, main, run, scene, write

sys.path.insert(0, str(SOURCE / "bench/live"))
from client import Run  # noqa: E402

# a plate pats a block of rubber on a floor
PAT = """material = "rubber"
[[manipulator]]
part = "plate"
path = "stdin"
[contact]
friction = 0.5  # without it the block slides out from under the plate
[[plane]]
point = ["0 mm", "0 mm", "0 mm"]
normal = [0, 0, 1]
[damping]
time = "20 us"
[run]
time = "TIME"
"""
KEYED = 'time = ["0 s", "20 ms", "40 ms"]\ndisplacement = [[0, 0, 0], [0, 0, "-2 mm"], [0, 0, "-1 mm"]]'
LINES = b"# a comment\n0 0 0 0\n\n0.02, 0, 0, -0.002\n0.04 0 0 -1e-3 1 0 0 0\n"


def part():
    """Two solids: a block of 4 x 2 x 2 cells and a plate 0.2 mm above it."""
    raised = [[(x, y, z + 20.2) for x, y, z in corners] for corners in box_triangles((40.0, 20.0, 10.0))]
    write("part.stl", ascii_stl(box_triangles((40.0, 20.0, 20.0)), "block") + ascii_stl(raised, "plate"))
    expect_ok(run("flexel-voxelize", "part.stl", "--size", "10 mm", "-o", "body.vtu"))
    os.remove("part.stl")


def prepare(text=PAT, duration="50 ms"):
    part()
    scene(text=text.replace("TIME", duration))


def start(*options, to=(), **more):
    return Run(BIN / "flexel-simulate", "scene.toml", "body.vtu", "-o", "out.vtu", "--verbose", "--live", *to, "--threads", "1", *options, **more)


def first_frame(live):
    frames = []
    while not frames:
        frames = live.take(60)
        expect(frames is not None, f"the stream ended before the first frame: {live.finish() if frames is None else ''}")
    return frames


def test_poses_lead_as_a_path_does():
    poses_lead_as_a_path_does("")


def test_poses_lead_as_a_path_does_in_implicit_steps():
    poses_lead_as_a_path_does('method = "implicit"\nstep = "2 ms"\n')


def poses_lead_as_a_path_does(method):
    prepare(PAT + method)
    done = expect_ok(run("flexel-simulate", "scene.toml", "body.vtu", "-o", "poses.vtu", "--history", "poses.csv", "--verbose", stdin=LINES))
    expect("live: 3 pose(s)" in done.err, f"the summary should count the poses: {done.err}")
    scene("keys.toml", (PAT + method).replace('path = "stdin"', KEYED).replace("TIME", "50 ms"))
    expect_ok(run("flexel-simulate", "keys.toml", "body.vtu", "-o", "keys.vtu", "--history", "keys.csv"))
    for kind in ("vtu", "csv"):
        expect(open(f"poses.{kind}", "rb").read() == open(f"keys.{kind}", "rb").read(), f"the same path should give the same .{kind}")
    expect("plate force z [N]" in open("poses.csv").readline(), "the books should have the force on the plate")


def test_a_run_without_real_time_waits_for_its_poses():
    prepare()
    process = subprocess.Popen([BIN / "flexel-simulate", "scene.toml", "body.vtu", "-o", "out.vtu", "--verbose"], stdin=subprocess.PIPE, stderr=subprocess.PIPE)
    process.stdin.write(b"0 0 0 0\n0.02 0 0 -0.002\n")
    process.stdin.flush()
    time.sleep(1)
    expect(process.poll() is None, "it should wait for the pose after 20 ms")
    said = process.communicate(b"end\n", timeout=60)[1].decode()
    expect(process.returncode == 0 and "to 0.0" in said and "to 0.05 s" not in said, f"\"end\" should end it there: {said}")


def test_wrong_lines():
    prepare()
    for lines, *fragments in ((b"0 0 0 0\n0.01 0 0\n", "stdin:2", "TIME X Y Z"), (b"0 0 0 zero\n", "stdin:1", "\"zero\"", "no number"),
                              (b"0 0 0 0\n0.01 0 0 0 0 0 0 0\n", "stdin:2", "quaternion"), (b"0 0 0 0\n0 0 0 0\n", "stdin:2", "ascend"),
                              (b"hammer 0 0 0 0\n", "stdin:1", "hammer", "plate"), (b"0 0 0 nan\n", "stdin:1", "nan"),
                              (b"1" * 9000, "stdin:1", "too long"), (b"", "stdin is empty")):
        result = run("flexel-simulate", "scene.toml", "body.vtu", "-o", "out.vtu", stdin=lines)
        expect_error(result, "flexel-simulate", *fragments)
    expect_only("scene.toml", "body.vtu", *(["out.failed.vtu"] if os.path.exists("out.failed.vtu") else []))


def test_refusals():
    prepare()
    simulate = ("flexel-simulate", "scene.toml", "body.vtu")
    expect_error(run(*simulate[:2], stdin=b"x"), "flexel-simulate", "scene.toml:2", "body", "stdin")
    expect_error(run(*simulate, "--live"), "flexel-simulate", "-o")
    for where, fragment in (("udp:5", "tcp:PORT"), ("tcp:0.0.0.0:80", "only this machine"), ("tcp:70000", "65535"), ("unix:", "characters"),
                            ("unix:missing/there", "No such file")):
        expect_error(run(*simulate, "-o", "out.vtu", "--live", where, stdin=b"0 0 0 0\n"), "flexel-simulate", fragment)
    expect_error(run(*simulate, "-o", "out.vtu", "--checkpoint", "c", stdin=b"0 0 0 0\n"), "flexel-simulate", "--checkpoint")
    scene(text=PAT.replace('[run]\ntime = "TIME"\n', ""))
    expect_error(run(*simulate, "-o", "out.vtu", stdin=b"0 0 0 0\n"), "flexel-simulate", "timed runs")
    scene(text='material = "rubber"\n[[fix]]\nwhere = "block"\n')
    expect_error(run(*simulate, "-o", "out.vtu", "--live", "tcp:0"), "flexel-simulate", "timed runs")


def test_frames_on_stdout():
    prepare(duration="100 s")
    live = start("--live-rate", "200", "--live-state", "2", "--summary", "s.json")
    frames, began, last = first_frame(live), time.monotonic(), 0
    while time.monotonic() - began < 1.5:
        depth = min(time.monotonic() - began, 1) * 3e-3
        live.pose(f"0 0 0 {-depth:.6f}")  # its time has passed: now
        last += 1
        found = live.take(0.005)
        expect(found is not None, "the stream should go on")
        frames += found
    until = time.monotonic() + 30
    while frames[-1]["line"] < last and time.monotonic() < until:
        frames += live.take(1)
    live.pose("end")
    code, said = live.finish()
    expect(code == 0, f"exit {code}: {said}")
    header = live.frames.header
    expect(header["rate"] == 200 and header["tools"] == ["plate"] and header["elements"] == 45 + 30, f"header {header}")
    expect([part["name"] for part in header["parts"]] == ["block", "plate"], f"header {header}")
    numbers = [frame["frame"] for frame in frames]
    expect(numbers == sorted(set(numbers)) and numbers[0] == 0, f"frames should be counted up: {numbers}")
    times = [frame["time"] for frame in frames]
    expect(times == sorted(times), "time should go on from frame to frame")
    # generous: in real time, or behind where the machine is busy
    expect(0 < times[-1] < time.monotonic() - began + 1, f"{times[-1]} s of the run in {time.monotonic() - began} s")
    for frame in frames:
        expect(("positions" in frame) == (frame["frame"] % 2 == 0), "every second frame should have positions")
    pressed = frames[-1]
    expect(pressed["line"] == last, f"the last frame should know of line {last}: {pressed['line']}")
    expect(min(frame["place"][0][2] for frame in frames) < -2e-3, "the plate should be where it was led")
    expect(max(frame["felt"][0][2] for frame in frames) > 1, "the plate should feel the block push it up, with newtons")
    whole = [frame for frame in frames if "positions" in frame]
    expect(all(len(frame["positions"]) == 3 * 75 for frame in whole), "three numbers an element")
    # the block's top (40 x 20 x 20 mm) goes down with the plate
    top = max(whole[0]["positions"][2::3][:45])
    expect(abs(top - 0.02) < 1e-6 and max(whole[-1]["positions"][2::3][:45]) < top - 5e-4, "the block should be pressed")
    summary = json.load(open("s.json"))["timed"]["live"]
    expect(summary["poses"] == last and summary["frames"] >= len(frames) and summary["late"] <= summary["frames"], f"summary {summary}")
    expect(f"{summary['late']} late" in said.replace(",", ""), f"late frames should be told: {said}")
    expect_only("scene.toml", "body.vtu", "out.vtu", "s.json")
    expect_ok(run("flexel-map", "out.vtu", "-o", "out.stl", "--quiet"))


def port_of(live):
    """The port that it says it listens at."""
    said = b""
    while b"frames at tcp:" not in said or not said.endswith(b"\n"):
        piece = live.process.stderr.read(1)
        expect(piece, f"it ended: {said}")
        said += piece
    return int(said.split(b"frames at tcp:")[1].split()[0])


def test_readers_of_a_socket_come_and_go():
    prepare(duration="1000 s")
    live = start(to=["tcp:0"])
    port = port_of(live)
    address = ("127.0.0.1", port)
    seen = []
    for _ in range(2):  # the first one vanishes, and the second finds a run that goes on
        live.attach(address)
        live.frames.header, live.frames.buffer = None, b""
        frames = first_frame(live)
        expect(live.frames.header["tools"] == ["plate"] and len(frames[0]["positions"]) == 225, "each reader should get a header first")
        seen.append(frames[0]["frame"])
        live.source.close()
    expect(seen[0] < seen[1], f"the run should go on: {seen}")
    listening = [line.split()[1] for line in open("/proc/net/tcp").read().splitlines()[1:] if line.split()[3] == "0A"]
    expect(f"0100007F:{port:04X}" in listening and f"00000000:{port:04X}" not in listening, "only the loopback should be listened to")
    time.sleep(0.3)
    live.pose("end")
    live.source = live.process.stdout
    code, said = live.finish()
    expect(code == 0 and "2 reader(s)" in said, f"exit {code}: {said}")


def test_a_reader_that_sleeps_does_not_hold_the_run_up():
    prepare(duration="2 s")
    live = start("--live-rate", "2000", "--summary", "s.json")  # 1.8 MB a second into a pipe that nobody empties
    live.process.stdin.close()
    until = time.monotonic() + 60
    while not os.path.exists("out.vtu") and time.monotonic() < until:
        time.sleep(0.1)
    code, said = live.finish()
    summary = json.load(open("s.json"))["timed"]["live"]
    expect(code == 0 and summary["dropped"] > 0 and summary["poses_ended"], f"exit {code}: {said}")


def test_unix_socket():
    prepare(duration="1000 s")
    live = start(to=["unix:live.sock"])
    live.attach("live.sock")
    expect(stat.S_IMODE(os.stat("live.sock").st_mode) & 0o077 == 0, "the socket should be its owner's alone")
    first_frame(live)
    again = run("flexel-simulate", "scene.toml", "body.vtu", "-o", "two.vtu", "--live", "unix:live.sock", stdin=b"0 0 0 0\n")
    expect_error(again, "flexel-simulate", "live.sock", "in use")
    live.process.send_signal(signal.SIGKILL)
    live.process.wait()
    live.source.close()
    live = start(to=["unix:live.sock"])  # what a killed run left is no obstacle
    live.attach("live.sock")
    first_frame(live)
    live.pose("end")
    live.source = live.process.stdout
    code, said = live.finish()
    expect(code == 0 and not os.path.exists("live.sock"), f"the socket should go with the run: exit {code}: {said}")


def test_a_reader_that_leaves_stdout():
    prepare(duration="1000 s")
    live = start()
    first_frame(live)
    live.process.stdout.close()
    code = live.process.wait(60)
    said = live.process.stderr.read().decode()
    expect(code == 141 and "error" not in said, f"exit {code}: {said}")
    expect_only("scene.toml", "body.vtu")


def test_interrupt():
    prepare(duration="1000 s")
    for to in ([], ["tcp:0"]):
        live = start(to=to)
        if not to:
            first_frame(live)
        else:
            port_of(live)
            time.sleep(0.5)
        live.process.send_signal(signal.SIGINT)
        code, said = live.finish()
        expect(code == 130 and "out.failed.vtu" in said, f"exit {code}: {said}")
    process = subprocess.Popen([BIN / "flexel-simulate", "scene.toml", "body.vtu", "-o", "out.vtu", "--verbose"], stdin=subprocess.PIPE, stderr=subprocess.PIPE)
    time.sleep(1)  # waiting for the first pose
    process.send_signal(signal.SIGINT)
    expect(process.wait(30) == 130, f"exit {process.returncode}")


def test_timeout_while_it_waits():
    prepare()
    process = subprocess.Popen([BIN / "flexel-simulate", "scene.toml", "body.vtu", "-o", "out.vtu", "--timeout", "1 s"], stdin=subprocess.PIPE,
                               stderr=subprocess.PIPE)
    expect(process.wait(60) == 5, f"exit {process.returncode}")


def test_latency_is_measured():
    done = run(sys.executable, SOURCE / "bench/live/latency.py", "--bin", BIN, "--seconds", "1", "--rate", "200", "--size", "20")
    expect_ok(done)
    text = done.out.decode()
    for word in ("from a pose to its first frame: median", "from frame to frame: median", "late ", "force on the plate: 0 to "):
        expect(word in text, f"\"{word}\" is missing in: {text}")
    trip = float(text.split("first frame: median ")[1].split()[0])
    expect(0 < trip < 2000, f"a pose should be known within seconds: {trip} ms")  # generous: machines are busy


if __name__ == "__main__":
    main(globals())

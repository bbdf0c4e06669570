"""Threads, Ctrl-C, progress and callbacks: what a run does to the process that it is in."""

import os
import signal
import subprocess
import sys
import threading
import time

from shared import PULL, SWING, box, box_body, bracket, check, main, module, need_step

# A run that takes minutes; the child says when it begins.
LONG = """
import sys, flexel
sys.path.insert(0, {tests!r})
from shared import SWING, box_body
body = box_body(flexel, 0.0005)
def begins(frame):
    print("begun", flush=True)
try:
    flexel.simulate(body, SWING.replace("TIME", "100 s"), on_frame=begins)
except KeyboardInterrupt:
    small = flexel.simulate(box_body(flexel), estimate=False, fix="xmin", push={{"xmax": (0, 0, -1)}}, material="steel")
    print("interrupted, and goes on" if small.largest_displacement > 0 else "", flush=True)
"""


def interrupted(code):
    """Exit code, output and error output of a child that gets SIGINT once it has begun."""
    default = lambda: signal.signal(signal.SIGINT, signal.SIG_DFL)  # a job in the background ignores it
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, preexec_fn=default) as child:
        try:
            check.assertEqual(child.stdout.readline(), b"begun\n")
            child.send_signal(signal.SIGINT)
            out, err = child.communicate(timeout=60)
        finally:
            child.kill()
    return child.returncode, out, err


def test_ctrl_c():
    module()
    code, out, err = interrupted(LONG.format(tests=os.path.dirname(os.path.abspath(__file__))))
    check.assertEqual((code, out), (0, b"interrupted, and goes on\n"), err.decode())


def test_ctrl_c_ends_a_script():
    module()
    code = LONG.format(tests=os.path.dirname(os.path.abspath(__file__))).replace("except KeyboardInterrupt", "except ZeroDivisionError")
    code, _, err = interrupted(code)
    check.assertEqual(code, -signal.SIGINT, err.decode())
    check.assertIn("KeyboardInterrupt", err.decode())


def test_a_handler_of_ones_own():
    """A Python handler that SIGINT has already is called, and what it raises comes out."""
    flexel = module()

    class Mine(Exception):
        pass

    def handler(number, frame):
        raise Mine

    before = signal.signal(signal.SIGINT, handler)
    try:
        with check.assertRaises(Mine):
            flexel.simulate(box_body(flexel, 0.001), SWING.replace("TIME", "100 s"),
                            on_frame=lambda frame: os.kill(os.getpid(), signal.SIGINT))
        check.assertIs(signal.getsignal(signal.SIGINT), handler)
    finally:
        signal.signal(signal.SIGINT, before)


def test_callbacks_that_raise():
    flexel = module()
    body = box_body(flexel)
    with check.assertRaises(ZeroDivisionError):
        flexel.simulate(body, SWING.replace("TIME", "1 ms"), on_frame=lambda frame: 1 / 0)
    check.assertGreater(flexel.simulate(body, estimate=False, **PULL).largest_displacement, 0)


def test_frames_are_over_after_the_callback():
    flexel = module()
    frames = []
    flexel.simulate(box_body(flexel), SWING.replace("TIME", "0.1 ms"), on_frame=frames.append)
    with check.assertRaises(flexel.InputError):
        frames[0].body()


def test_a_run_within_a_callback():
    flexel = module()
    body, found = box_body(flexel), []
    flexel.simulate(body, SWING.replace("TIME", "0.1 ms"),
                    on_frame=lambda frame: found.append(flexel.simulate(body, estimate=False, **PULL).largest_displacement))
    check.assertEqual(len(found), 5)
    check.assertEqual(len(set(found)), 1)


def test_an_error_of_a_run_within_a_run():
    """Caught, it leaves the outer run alone."""
    flexel = module()
    body, caught = box_body(flexel), []

    def inner(frame):
        try:
            flexel.simulate(body, SWING.replace("TIME", "0.1 ms"), on_frame=lambda frame: 1 / 0)
        except ZeroDivisionError as error:
            caught.append(error)

    flexel.simulate(body, SWING.replace("TIME", "0.2 ms"), on_frame=inner)
    check.assertEqual(len(caught), 5)


def test_limits_of_an_outer_run_are_its_own():
    flexel = module()
    body, found = box_body(flexel), []
    larger = flexel.Part.from_mesh(*box())

    def inner(frame):
        found.append(len(flexel.voxelize(larger, size=0.001).rest))
        with check.assertRaises(flexel.InputError):
            flexel.deform(larger, size=0.001, max_elements=100, **PULL)

    flexel.simulate(body, SWING.replace("TIME", "0.1 ms"), max_elements=1000, on_frame=inner)
    check.assertEqual(found, [41 * 11 * 11] * 5)


def test_progress_of_a_run_to_equilibrium():
    """By the residual: it grows, and so tells the time left."""
    flexel = module()
    shares = []

    def progress(stage, share, note, left):
        if stage == "simulate":
            shares.append(share)

    flexel.simulate(box_body(flexel, 0.0004), estimate=False, progress=progress, **PULL)
    check.assertGreater(len(shares), 1)
    check.assertEqual(shares, sorted(shares))
    check.assertTrue(any(0.05 < share < 1 for share in shares), f"{shares}")


def test_progress_runs_nothing():
    """It may be told on any thread of the run, which holds the lock: refused, not a wait for ever."""
    flexel = module()
    body, part, refused = box_body(flexel, 0.001), flexel.Part.from_mesh(*box()), []

    def progress(stage, share, note, left):
        try:
            flexel.voxelize(part, size=0.005)
        except flexel.InputError as error:
            refused.append(str(error))

    flexel.simulate(body, SWING.replace("TIME", "0.1 ms"), progress=progress)
    check.assertTrue(refused)
    check.assertIn("progress cannot run anything", refused[0])
    check.assertEqual(len(flexel.voxelize(part, size=0.005).rest), 9 * 3 * 3)


def test_ctrl_c_ends_a_wait():
    """For the run of another thread, which goes on."""
    flexel = module()
    body, begun, enough = box_body(flexel), threading.Event(), threading.Event()

    def occupy(frame):
        begun.set()
        enough.wait(60)

    other = threading.Thread(target=lambda: flexel.simulate(body, SWING.replace("TIME", "0.1 ms"), on_frame=occupy))
    other.start()
    begun.wait(60)
    timer = threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT))
    timer.start()
    began = time.monotonic()
    try:
        with check.assertRaises(KeyboardInterrupt):
            flexel.simulate(body, estimate=False, **PULL)
        check.assertLess(time.monotonic() - began, 20)
    finally:
        enough.set()
        other.join()
    check.assertGreater(flexel.simulate(body, estimate=False, **PULL).largest_displacement, 0)


def test_frames_are_of_timed_runs():
    flexel = module()
    with check.assertRaises(flexel.InputError):
        flexel.simulate(box_body(flexel), on_frame=print, **PULL)


def test_threads_give_the_same():
    """Runs of several threads: the same bits, and Python goes on meanwhile."""
    flexel = module()
    bodies = [box_body(flexel, 0.002 / (n + 1)) for n in range(3)]
    alone = [flexel.simulate(body, estimate=False, **PULL).body.position.copy() for body in bodies]
    found = [None] * 3

    def work(n):
        found[n] = flexel.simulate(bodies[n], estimate=False, **PULL).body.position

    threads = [threading.Thread(target=work, args=(n,)) for n in range(3)]
    for thread in threads:
        thread.start()
    ticks = 0
    while any(thread.is_alive() for thread in threads):
        ticks += 1
        time.sleep(0.001)
    check.assertGreater(ticks, 3, "Python stood still")
    for one, other in zip(alone, found):
        check.assertTrue((one == other).all())


def test_progress():
    flexel = module()
    seen = []
    flexel.simulate(box_body(flexel, 0.001), SWING.replace("TIME", "2 ms"), progress=lambda *each: seen.append(each))
    check.assertTrue(seen)
    for stage, share, note, left in seen:
        check.assertIsInstance(stage, str)
        check.assertTrue(0 <= share <= 1)
        check.assertTrue(left is None or left >= 0)

    def refuse(*each):
        raise LookupError("enough")

    with check.assertRaises(LookupError):
        flexel.simulate(box_body(flexel, 0.001), SWING.replace("TIME", "100 s"), progress=refuse)


def test_progress_of_cad_files():
    """flexel-cad tells how many faces it has done, and so the time left can be told."""
    flexel = module()
    need_step()
    bracket()
    seen = []
    flexel.deform("bracket.step", output="bent.step", size="4 mm", fix="bracket/1", push={"bracket/2": (0, 0, -100)}, material="PLA",
                  progress=lambda *each: seen.append(each))
    shares = [share for stage, share, note, _ in seen if stage == "write" and note == "CAD faces"]
    check.assertTrue(any(0 < share < 1 for share in shares), f"{shares}")
    check.assertEqual(shares, sorted(shares))


def test_progress_of_each_stage():
    """Deep within a stage it is told how far it is: of a wrap, of a lattice, of a map and its checks, of a picture, of a CAD file's triangles."""
    flexel = module()
    need_step()
    bracket()
    part = flexel.Part.from_mesh(*box(), edge=0.0003)
    seen = {}

    def hear(name):
        return lambda stage, share, note, left: seen.setdefault((name, stage), []).append(share)

    flexel.read("bracket.step", deflection="1 um", edge="1 m", progress=hear("cad"))
    flexel.voxelize(flexel.Part.from_mesh(*box()), size=0.001, heal="wrap:0.6 mm", progress=hear("wrap"))
    flexel.voxelize(part, size=0.0005, progress=hear("lattice"))
    bent = flexel.simulate(flexel.voxelize(part, size=0.0025), estimate=False, **PULL).body
    flexel.map(bent, check="self-intersection", progress=hear("map"))
    flexel.picture(bent, progress=hear("picture"))
    for key in (("cad", "import"), ("wrap", "heal"), ("lattice", "voxelize"), ("map", "map"), ("picture", "picture")):
        check.assertTrue(any(0 < share < 1 for share in seen[key]), f"{key}: {seen[key]}")
        check.assertEqual(seen[key], sorted(seen[key]), f"{key}")


def told_by_a_fork(work):
    """What `work` returns in a child of this process."""
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        signal.alarm(30)  # a child that waits for ever says nothing
        os.write(writer, str(work()).encode())
        os._exit(0)
    os.close(writer)
    with open(reader, "rb") as said:
        text = said.read().decode()
    os.waitpid(child, 0)
    return text


def test_a_fork_between_runs_runs():
    flexel = module()
    body = box_body(flexel)
    found = flexel.simulate(body, estimate=False, **PULL).largest_displacement
    check.assertEqual(told_by_a_fork(lambda: flexel.simulate(body, estimate=False, **PULL).largest_displacement), str(found))


def test_a_fork_within_a_run_is_refused():
    """Whatever the run held then is held for ever in the child."""
    flexel = module()
    body, part, said = box_body(flexel), flexel.Part.from_mesh(*box()), []

    def refused():
        try:
            return flexel.voxelize(part, size=0.005)
        except flexel.InputError as error:
            return error

    flexel.simulate(body, SWING.replace("TIME", "0.1 ms"), on_frame=lambda frame: said or said.append(told_by_a_fork(refused)))
    check.assertIn("forked while a run went on", said[0])
    check.assertEqual(len(refused().rest), 9 * 3 * 3)


def test_a_fork_while_a_run_ends_does_not_hang():
    """A run that is over keeps what it held until it has the GIL: a fork then is refused. One that comes a moment later is not."""
    flexel = module()
    body, part, last_frame = box_body(flexel), flexel.Part.from_mesh(*box()), threading.Event()

    def refused():
        try:
            return flexel.voxelize(part, size=0.005)
        except flexel.InputError as error:
            return error

    def hear(frame):
        if frame.time > 0.9e-4:
            last_frame.set()

    before = sys.getswitchinterval()
    sys.setswitchinterval(60)  # nobody takes the GIL from this thread
    try:
        run = threading.Thread(target=lambda: flexel.simulate(body, SWING.replace("TIME", "0.1 ms"), on_frame=hear))
        run.start()
        check.assertTrue(last_frame.wait(60))
        until = time.monotonic() + 1
        while time.monotonic() < until:  # the run ends meanwhile
            pass
        said = told_by_a_fork(refused)
    finally:
        sys.setswitchinterval(before)
    run.join()
    check.assertRegex(said, "forked while a run went on|Body 'part': 81 elements")
    check.assertEqual(len(refused().rest), 9 * 3 * 3)


def test_nothing_on_stderr_without_a_terminal():
    module()
    code = ("import sys\nsys.path.insert(0, %r)\nimport flexel, shared\n"
            "flexel.simulate(shared.box_body(flexel), estimate=False, **shared.PULL)" % os.path.dirname(os.path.abspath(__file__)))
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, timeout=60, check=True)
    check.assertEqual((done.stdout, done.stderr), (b"", b""))


if __name__ == "__main__":
    main(globals())

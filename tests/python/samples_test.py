"""The scripts of samples/python run, and find what is known."""

import pathlib
import re
import sys

from harness import SOURCE, Skip
from shared import bracket, check, expect_ok, main, module, need_step, run


def script(name, *arguments):
    return expect_ok(run(sys.executable, "-B", SOURCE / "samples/python" / name, *arguments, timeout=115)).out.decode()


def need_module(name):
    try:
        __import__(name)
    except ImportError:
        raise Skip(f"{name} is not installed") from None


def rows(text):
    return [tuple(map(float, line.split())) for line in text.splitlines() if re.fullmatch(r"[\s0-9.e+-]+", line)]


def test_force_against_displacement():
    module()
    need_step()
    bracket()
    found = rows(script("force_displacement.py", "bracket.step"))
    check.assertEqual(len(found), 5)
    stiffness = [force / distance for distance, force in found]
    check.assertGreater(min(stiffness), 0)
    check.assertGreater(max(stiffness) / min(stiffness), 1.0001, "large deflection leaves no trace")
    check.assertLess(max(stiffness) / min(stiffness), 2)


def test_the_page():
    """The blocks of docs/guide/python.md, in order."""
    module()
    need_step()
    bracket()
    blocks = re.findall(r"^```python\n(.*?)^```$", (SOURCE / "docs/guide/python.md").read_text(encoding="utf-8"), re.M | re.S)
    text = expect_ok(run(sys.executable, "-c", "\n".join(blocks), timeout=115)).out.decode()
    check.assertIn("how far", text)
    frames = rows(text)
    check.assertEqual(len(frames), 6)
    check.assertGreater(frames[-1][1], frames[1][1])
    check.assertTrue(all(pathlib.Path(name).stat().st_size for name in ("bent.stl", "bent.step")))


def test_force_plot():
    module()
    need_step()
    need_module("matplotlib")
    bracket()
    script("force_displacement.py", "bracket.step", "force.png")
    check.assertEqual(pathlib.Path("force.png").read_bytes()[:4], b"\x89PNG")


def test_snap_force():
    module()
    need_module("scipy")
    text = script("snap_force.py", "20")
    check.assertLess(abs(rows(text)[-1][1] - 1), 0.001, text)
    thickness = float(re.search(r"([0-9.]+) mm for 20 N", text).group(1))
    # A cantilever's 3 E I d / l^3 with the library's 3.25 GPa, which shear and the clamped end change by some percent.
    beam = (20 * 4 * 0.020**3 / (3.25e9 * 0.006 * 0.001)) ** (1 / 3) * 1000
    check.assertLess(abs(thickness / beam - 1), 0.15, f"{thickness} mm, a beam {beam} mm")


def test_fit_of_the_modulus():
    module()
    need_module("scipy")
    text = script("fit_modulus.py")
    young, error = map(float, re.search(r"modulus ([0-9.]+) \+- ([0-9.]+) GPa", text).groups())
    check.assertLess(abs(young - 2.35), 0.05, text)
    check.assertLess(error, 0.05, text)


if __name__ == "__main__":
    main(globals())

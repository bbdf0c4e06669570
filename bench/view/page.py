#!/usr/bin/env python3
"""What a page of flexel view weighs, how long it loads, and how many frames a second a million triangles get, in Chromium without a
graphics card (SwiftShader). Prints the table of docs/guide/view.md.

    PATH=build/release/bin:$PATH bench/view/page.py
"""

import contextlib
import math
import os
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
os.environ.setdefault("FLEXEL_BIN", str(ROOT / "build/release/bin"))
os.environ.setdefault("FLEXEL_SOURCE", str(ROOT))
os.environ.setdefault("FLEXEL_PARTS", str(ROOT / "../shared/parts"))
sys.path.insert(0, str(ROOT / "tests/programs"))
from browser import chromium  # noqa: E402
from view_test import served  # noqa: E402


def knot(name, along, around):
    """A tube along a trefoil knot, 2 x along x around triangles, as OFF."""
    centre = lambda t: (math.sin(t) + 2 * math.sin(2 * t), math.cos(t) - 2 * math.cos(2 * t), -math.sin(3 * t))
    with open(name, "w", encoding="ascii") as out:
        out.write(f"OFF\n{along * around} {2 * along * around} 0\n")
        for i in range(along):
            t = 2 * math.pi * i / along
            here, next_one = centre(t), centre(t + 1e-4)
            way = [b - a for a, b in zip(here, next_one)]
            length = math.hypot(*way)
            w = [x / length for x in way]
            u = [w[1], -w[0], 0]
            length = math.hypot(*u)
            u = [x / length for x in u]
            v = [w[1] * u[2] - w[2] * u[1], w[2] * u[0] - w[0] * u[2], w[0] * u[1] - w[1] * u[0]]
            for j in range(around):
                a = 2 * math.pi * j / around
                c, s = 6 * math.cos(a), 6 * math.sin(a)
                out.write(" ".join(f"{10 * x + c * p + s * q:.4f}" for x, p, q in zip(here, u, v)) + "\n")
        for i in range(along):
            for j in range(around):
                a, b = i * around + j, i * around + (j + 1) % around
                c, d = ((i + 1) % along) * around + j, ((i + 1) % along) * around + (j + 1) % around
                out.write(f"3 {a} {c} {b}\n3 {b} {c} {d}\n")


# As a hand does it: a turn at each frame that the browser shows, for some seconds once it is warm.
TURN = """
const {picture} = flexelView, seconds = arguments[0], start = performance.now();
let from, drawn;
for (;;) {
  await new Promise(done => requestAnimationFrame(done));
  const now = performance.now();
  if (from === undefined && now > start + 3000) [from, drawn] = [now, picture.drawn];
  if (now > start + 1000 * (seconds + 3) && picture.drawn > drawn + 1) return 1000 * (picture.drawn - drawn) / (now - from);
  picture.view.turn(3, 0);
}"""
# The whole part, each frame waited for.
STILL = """
const {picture} = flexelView, gl = picture.renderer.getContext(), pixel = new Uint8Array(4), frames = arguments[0];
const frame = () => { picture.coarse = false; picture.draw(); gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel); };
frame();
const start = performance.now();
for (let k = 0; k < frames; ++k) frame();
return (performance.now() - start) / frames;"""
LOAD = "return [performance.getEntriesByName('ready')[0].startTime, flexelView.picture.panels[0].shape.triangles.length / 3]"


def processor_seconds(profile):
    """Of all processes of the browser with this profile."""
    total = 0
    for process in pathlib.Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            command = (process / "cmdline").read_bytes().decode(errors="replace")
            if profile in command or "swiftshader" in command.replace("\0", " "):
                fields = (process / "stat").read_text().rsplit(")", 1)[1].split()
                total += (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    return total


def turned(browser, seconds):
    """Frames a second, and processor seconds a frame, while it turns."""
    browser.run(TURN, 1)
    before, drawn = processor_seconds(browser.folder), browser.run("return flexelView.picture.drawn")
    speed = browser.run(TURN, seconds)
    frames = browser.run("return flexelView.picture.drawn") - drawn
    return speed, (processor_seconds(browser.folder) - before) / frames


def row(title, path):
    with chromium((1280, 800)) as browser, served(path) as (url, _):
        browser.open(url.geturl())
        load, triangles = browser.run(LOAD)
        data = browser.run("return flexelView.picture.page.files[0].bytes")
        before = processor_seconds(browser.folder)
        whole = browser.run(STILL, 4)
        still = (processor_seconds(browser.folder) - before) / 5
        speed, processor = turned(browser, 6)
        print(f"| {title} | {triangles:,.0f} | {data / 1e6:.2f} MB | {load / 1000:.2f} s | {whole:.0f} ms | {1000 * still:.0f} ms | {speed:.1f} | "
              f"{1000 * processor:.0f} ms |", flush=True)


def main():
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        subprocess.run([os.environ["FLEXEL_BIN"] + "/make_bracket", "bracket.step"], check=True)
        knot("knot.off", 5000, 100)
        subprocess.run([os.environ["FLEXEL_BIN"] + "/flexel", "view", "bracket.step", "--html", "page.html", "--quiet"], check=True)
        print(f"The page without data: {(os.path.getsize('page.html')) / 1e6:.2f} MB (bracket.step included)\n")
        print("| part | triangles | data | loaded and drawn after | a frame at rest | processor | frames a second while it turns | processor a frame |\n"
              "|---|---|---|---|---|---|---|---|")
        row("bracket.step", "bracket.step")
        row("a knot", "knot.off")
        print(f"\n{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f} at the end; window 1280 x 800")


if __name__ == "__main__":
    main()

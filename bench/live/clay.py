#!/usr/bin/env python3
"""How a part follows a hand in flexel clay, by number of cells: processor time of each stage a frame, frames a second and milliseconds from
the hand to the drawn picture, in Chromium without a graphics card (SwiftShader), and to the frame alone. The hand goes on by a
thirtieth of a second with each frame, however long that took, so that a busy machine is given the same work. The page's
weight and load time. Prints the tables of docs/guide/clay.md; --tools prints the one of tools alone, without a browser; --pictures FOLDER makes its
pictures.

    PATH=build/release/bin:$PATH bench/live/clay.py [--frames N] [--tools] [--pictures FOLDER]
"""

import argparse
import contextlib
import json
import math
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
os.environ.setdefault("FLEXEL_BIN", str(ROOT / "build/release/bin"))
os.environ.setdefault("FLEXEL_SOURCE", str(ROOT))
os.environ.setdefault("FLEXEL_PARTS", str(ROOT / "../shared/parts"))
sys.path.insert(0, str(ROOT / "tests/programs"))
from browser import chromium  # noqa: E402
from clay_browser_test import bent_by_hand, settle  # noqa: E402
from clay_test import Hand, ask, clay  # noqa: E402

# The tip goes 2 mm up and down, once in two seconds; the next pose is said when the one before has been drawn, to its last pixel.
HZ = 30
DRAG = """
const {clay, picture} = flexelView, [poses] = arguments, gl = picture.renderer.getContext(), pixel = new Uint8Array(4), latencies = [];
const began = performance.now(), drawn = picture.drawn, frame = clay.frame.frame, stages = {};
const timed = (object, name) => { const own = object[name]; stages[name] = 0;
  object[name] = function (...given) { const at = performance.now(); try { return own.apply(this, given); } finally { stages[name] += performance.now() - at; } }; };
timed(clay, "bend");
timed(picture, "draw");
for (let k = 0; k < poses; ++k) {
  const said = performance.now(), before = picture.drawn;
  clay.post(`0 0 0 ${2e-3 * Math.sin(Math.PI * k / 30)}`);
  while (clay.busy || clay.waiting.length > 0 || clay.sent.some(each => each.line > clay.frame.line) || picture.drawn === before) {
    await new Promise(done => requestAnimationFrame(done));
    if (performance.now() > said + 5000) break;
  }
  gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
  latencies.push(performance.now() - said);
}
return {seconds: (performance.now() - began) / 1000, drawn: picture.drawn - drawn, frames: clay.frame.frame - frame, latencies, bend: stages.bend};
"""


def spent(number):
    """s of processor time, of all threads so far."""
    fields = pathlib.Path(f"/proc/{number}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def browser_processes(folder):
    """{number: kind} of the browser with this profile: "page" runs scripts, "drawing" draws, "rest" is what else it has."""
    parent, command = {}, {}
    for entry in pathlib.Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError, IndexError):
            parent[int(entry.name)] = int((entry / "stat").read_text().rsplit(")", 1)[1].split()[1])
            command[int(entry.name)] = (entry / "cmdline").read_bytes().decode(errors="replace")
    found = {number for number, text in command.items() if f"--user-data-dir={folder}" in text}
    while more := {number for number, above in parent.items() if above in found} - found:
        found |= more
    kinds = {"--type=renderer": "page", "--type=gpu-process": "drawing"}
    return {number: next((kind for text, kind in kinds.items() if text in command[number]), "rest") for number in found}


def stages_of(process, folder):
    """s of processor time so far, by stage."""
    total = {"run": spent(process.pid), "page": 0, "drawing": 0, "rest": 0}
    for number, kind in browser_processes(folder).items():
        with contextlib.suppress(OSError):
            total[kind] += spent(number)
    return total


def by_program(url, process, frames, take="grab face bracket/2", pose=lambda k: f"0 0 0 {2e-3 * math.sin(math.pi * k / HZ)}"):
    """Frames a second, processor time a pose [s] and latencies [s] of a client that poses as soon as it knows of the pose before."""
    hand = Hand(url, 16 * "b")
    hand.act("take", take)
    latencies, used, began = [], spent(process.pid), time.monotonic()
    for k in range(frames):
        now = time.monotonic()
        status, text = hand.post(pose(k))
        line = json.loads(text)["line"]
        while hand.last["line"] < line and time.monotonic() < now + 10:
            time.sleep(0.0005)
        latencies.append(time.monotonic() - now)
    rate, work = frames / (time.monotonic() - began), (spent(process.pid) - used) / frames
    hand.act("stay")
    hand.leave()
    return rate, work, latencies


# By name: what takes hold, and where it is led, k thirtieths of a second on.
TOOLS = {
    "a face": ("grab face bracket/2", lambda k: f"0 0 0 {2e-3 * math.sin(math.pi * k / HZ)}"),
    "a ball of the part": ("grab at 0.0796 0.02 0.003 0.004", lambda k: f"0 0 0 {2e-3 * math.sin(math.pi * k / HZ)}"),
    "pushing with a ball": ("push ball 0.07 0.02 0.006 0 0 1 0.006", lambda k: f"0 0 0 {-1e-3 * (1 - math.cos(math.pi * k / HZ))}"),
    "pushing with a plate": ("push plate 0.06 0.02 0.006 0 0 1 0.008", lambda k: f"0 0 0 {-1e-3 * (1 - math.cos(math.pi * k / HZ))}"),
    "carving along": ("grab face bracket/2", lambda k: f"carve {'to' if k else 'from'} {0.02 + 5e-4 * k} 0.02 0.006{'' if k else ' 0.004'}"),
}


def measure_tools(count, frames):
    with clay("bracket.step", "--count", str(count)) as (url, process):
        setup = Hand(url, 16 * "c")
        elements = sum(1 for _ in setup.settled()["positions"]) // 3
        setup.act("hold bracket/1")
        setup.leave()
        for name, (take, pose) in TOOLS.items():
            rate, work, latencies = by_program(url, process, frames, take, pose)
            print(f"| {elements:,} | {name} | {1e3 * work:.0f} | {rate:.1f} | {1e3 * statistics.median(latencies):.0f} |", flush=True)
            after = Hand(url, 16 * "d")
            after.act("take", "undo", "undo")
            after.leave()


def page_weight():
    """MB, of the page and what it fetches before it has drawn."""
    with clay("bracket.step") as (url, _):
        return sum(len(ask(url, url.path + path)[2]) for path in ("", "data/0", "save/rest.f32")) / 1e6


def percentile(values, share):
    return sorted(values)[min(len(values) - 1, int(share * len(values)))]


def measure(count, frames):
    with clay("bracket.step", "--count", str(count)) as (url, process):
        setup = Hand(url, 16 * "c")
        elements = sum(1 for _ in setup.settled()["positions"]) // 3
        setup.act("hold bracket/1", "grab face bracket/2")
        setup.leave()
        rate, work, latencies = by_program(url, process, frames)
        with chromium() as browser:
            browser.open(url.geturl())
            loaded = browser.run("return performance.getEntriesByName('ready')[0].startTime")
            browser.run("flexelView.clay.post('take')")
            browser.wait("flexelView.clay.mine && flexelView.clay.frame.tools.length === 1 && flexelView.clay.frame.settled")
            before = stages_of(process, browser.folder)
            browser.run(f"window.dragged = undefined; (async function () {{{DRAG}}})(arguments[0]).then(found => {{ window.dragged = found; }});", frames)
            browser.wait("window.dragged", 300)
            drawn = browser.run("return window.dragged")
            after = stages_of(process, browser.folder)
    shown = max(1, drawn["drawn"])
    stages = {name: 1e3 * (after[name] - before[name]) / shown for name in after}
    print(f"| {count:,} | {elements:,} | {1e3 * work:.0f} | {rate:.1f} | {1e3 * statistics.median(latencies):.0f} | {stages['run']:.0f} | {stages['page']:.0f}, "
          f"{drawn['bend'] / shown:.1f} | {stages['drawing']:.0f} | {stages['rest']:.0f} | {2e3 / sum(stages.values()):.1f} | {shown / drawn['seconds']:.1f} | "
          f"{statistics.median(drawn['latencies']):.0f} | {percentile(drawn['latencies'], 0.95):.0f} | {loaded / 1e3:.2f} s |", flush=True)


def pictures(folder):
    with clay("bracket.step", "--material", "PLA") as (url, _), chromium((1280, 900)) as browser:
        x, y = bent_by_hand(browser, url, "z")
        browser.choose("colour", "displacement")
        settle(browser)
        time.sleep(1)
        browser.screenshot(folder / "clay-pull.png")
        browser.mouse(("move", x, y), ("up",))
        settle(browser)
        for place in ("0.035 0.012 0.006 0.007", "0.05 0.028 0.006 0.007", "0.065 0.012 0.006 0.007"):
            browser.run("flexelView.clay.post(arguments[0])", f"carve at {place}")
            time.sleep(1)
            settle(browser)
        browser.run("document.querySelector('input[name=hand][value=carve]').click()")
        browser.wait("!flexelView.clay.renewing && flexelView.clay.surface === flexelView.clay.frame.surface && !flexelView.clay.asked")
        time.sleep(1)
        browser.screenshot(folder / "clay-carve.png")
    with clay("bracket.step", "--material", "rubber") as (url, _), chromium((1280, 900)) as browser:
        browser.open(url.geturl())
        for line in ("hold bracket/1", "grab face bracket/2", "0 0 0 0 0.9 0 0"):
            browser.run("flexelView.clay.post(arguments[0])", line)
            time.sleep(1)
            settle(browser)
        browser.run("document.querySelector('input[name=hand][value=twist]').click(); flexelView.picture.fit()")
        time.sleep(1)
        browser.screenshot(folder / "clay-twist.png")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--frames", type=int, default=90)
    parser.add_argument("--pictures")
    parser.add_argument("--tools", action="store_true")
    parser.add_argument("--counts", default="1000,5000,20000")
    options = parser.parse_args()
    folder = pathlib.Path(options.pictures).resolve() if options.pictures else None
    with tempfile.TemporaryDirectory() as work, contextlib.chdir(work) if hasattr(contextlib, "chdir") else contextlib.nullcontext():
        os.chdir(work)
        subprocess.run([pathlib.Path(os.environ["FLEXEL_BIN"]) / "make_bracket", "bracket.step"], check=True)
        if folder:
            return pictures(folder)
        if options.tools:
            print(f"Load of the machine before: {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores\n")
            print("| elements | tool | processor ms a pose | poses a second | ms, median |\n|---|---|---|---|---|", flush=True)
            for count in options.counts.split(","):
                measure_tools(int(count), options.frames)
            return os.chdir("/")
        print(f"The page without data: {page_weight():.2f} MB (bracket.step included); load of the machine before: {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores\n")
        print("| cells asked for | elements | processor ms a pose, program | poses a second | ms, median | run | page, its map | drawing | rest | two cores would show | drawn a second | ms to the picture, median | 95 % | loaded after |")
        print("|---|---|---|---|---|---|---|---|---|---|---|---|---|---|", flush=True)
        for count in options.counts.split(","):
            measure(int(count), options.frames)
        os.chdir("/")


if __name__ == "__main__":
    main()

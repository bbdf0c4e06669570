#!/usr/bin/env python3
"""How a part follows a hand in flexel clay, by number of cells: frames a second and milliseconds from the hand to the moved picture, in
Chromium without a graphics card (SwiftShader), and to the frame alone. The page's weight and load time. Prints the tables of
docs/guide/clay.md; --pictures FOLDER makes its pictures.

    PATH=build/release/bin:$PATH bench/live/clay.py [--seconds S] [--pictures FOLDER]
"""

import argparse
import contextlib
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

# The tip goes 2 mm up and down, once in two seconds; a pose at every picture.
DRAG = """
const {clay} = flexelView, seconds = arguments[0], start = performance.now();
clay.latencies = [];
let shown;
for (;;) {
  await new Promise(done => requestAnimationFrame(done));
  const now = performance.now();
  if (shown === undefined && now > start + 1000) { shown = clay.shown; clay.latencies = []; }
  if (now > start + 1000 * (seconds + 1)) return {rate: (clay.shown - shown) / seconds, latencies: clay.latencies};
  clay.post(`0 0 0 ${2e-3 * Math.sin(Math.PI * (now - start) / 1000)}`);
}
"""


def processor(process):
    """s, of all of its threads so far."""
    fields = pathlib.Path(f"/proc/{process.pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def by_program(url, process, seconds):
    """Frames a second, processor time a frame [s] and latencies [s] of a client that poses as soon as it knows of the pose before."""
    hand = Hand(url, 16 * "b")
    hand.act("take", "grab face bracket/2")
    latencies, first, used, began = [], hand.seen, processor(process), time.monotonic()
    while (now := time.monotonic()) < began + seconds:
        status, text = hand.post(f"0 0 0 {2e-3 * math.sin(math.pi * (now - began))}")
        line = int(text.split(":")[1].strip(" }\n"))
        while hand.last["line"] < line:
            time.sleep(0.0005)
        latencies.append(time.monotonic() - now)
    frames = max(1, hand.seen - first)
    rate, work = frames / (time.monotonic() - began), (processor(process) - used) / frames
    hand.leave()
    return rate, work, latencies


def page_weight():
    """MB, of the page and what it fetches before it has drawn."""
    with clay("bracket.step") as (url, _):
        return sum(len(ask(url, url.path + path)[2]) for path in ("", "data/0", "save/rest.f32")) / 1e6


def percentile(values, share):
    return sorted(values)[min(len(values) - 1, int(share * len(values)))]


def measure(count, seconds):
    with clay("bracket.step", "--count", str(count)) as (url, process):
        setup = Hand(url, 16 * "c")
        cells = sum(1 for _ in setup.settled()["positions"]) // 3
        setup.act("hold bracket/1", "grab face bracket/2")
        setup.leave()
        rate, work, latencies = by_program(url, process, seconds)
        with chromium() as browser:
            browser.open(url.geturl())
            loaded = browser.run("return performance.getEntriesByName('ready')[0].startTime")
            browser.run("flexelView.clay.post('take')")
            browser.wait("flexelView.clay.mine && flexelView.clay.frame.tools.length === 1")
            drawn = browser.run(DRAG, seconds)
    ms = drawn["latencies"] or [math.nan]
    print(f"| {count:,} | {cells:,} | {1e3 * work:.0f} | {rate:.1f} | {1e3 * statistics.median(latencies):.0f} | {1e3 * percentile(latencies, 0.95):.0f} | "
          f"{drawn['rate']:.1f} | {statistics.median(ms):.0f} | {percentile(ms, 0.95):.0f} | {loaded / 1e3:.2f} s |", flush=True)


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
    parser.add_argument("--seconds", type=float, default=5)
    parser.add_argument("--pictures")
    parser.add_argument("--counts", default="1000,5000,20000")
    options = parser.parse_args()
    folder = pathlib.Path(options.pictures).resolve() if options.pictures else None
    with tempfile.TemporaryDirectory() as work, contextlib.chdir(work) if hasattr(contextlib, "chdir") else contextlib.nullcontext():
        os.chdir(work)
        subprocess.run([pathlib.Path(os.environ["FLEXEL_BIN"]) / "make_bracket", "bracket.step"], check=True)
        if folder:
            return pictures(folder)
        print(f"The page without data: {page_weight():.2f} MB (bracket.step included); load of the machine before: {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores\n")
        print("| cells asked for | elements | processor ms a frame | frames a second | ms, median | 95 % | drawn a second | ms to the picture, median | 95 % | loaded after |")
        print("|---|---|---|---|---|---|---|---|---|---|", flush=True)
        for count in options.counts.split(","):
            measure(int(count), options.seconds)
        os.chdir("/")


if __name__ == "__main__":
    main()

#!/usr/bin/python3
"""Measures contact in every model that has it: rest, bounces, friction, points of contact, and what contact and damping cost.
Prints the tables and writes docs/measurements/contact.md. Costs are processor time of one thread, medians of three.

    PATH=build/release/bin:$PATH bench/contact/measure.py [rest bounces friction pressed costs damping kneaded]

With names of sections it makes these anew and leaves the others.
"""

import csv
import json
import math
import os
import pathlib
import platform
import re
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile

SOURCE = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(SOURCE / "tests" / "programs"), str(SOURCE / "bench" / "contact")]
import hertz  # noqa: E402
from shapes import binary_stl, box_triangles  # noqa: E402

MODELS = ("cells", "springs", "paper")
H = 10.0  # mm


def gum(model, young="1 MPa"):
    return f'model = "{model}"\nmaterial = "gum"\n[materials.gum]\nyoung = "{young}"\npoisson = 0.25\ndensity = "1000 kg/m3"\n'


def turned(axis, angle):
    x, y, z = (c / math.sqrt(sum(v * v for v in axis)) for c in axis)
    s, c = math.sin(angle), math.cos(angle)
    return ((c + x * x * (1 - c), x * y * (1 - c) - z * s, x * z * (1 - c) + y * s), (y * x * (1 - c) + z * s, c + y * y * (1 - c), y * z * (1 - c) - x * s),
            (z * x * (1 - c) - y * s, z * y * (1 - c) + x * s, c + z * z * (1 - c)))


def block(name, cells, at=(0, 0, 0), h=H, turn=None):
    """A box of so many cells, its lowest corner there [mm], turned about its middle."""
    size = [n * h for n in cells]
    middle = [s / 2 for s in size]

    def place(p):
        d = [p[i] - middle[i] for i in range(3)]
        if turn:
            d = [sum(row[i] * d[i] for i in range(3)) for row in turn]
        return tuple(at[i] + middle[i] + d[i] for i in range(3))
    pathlib.Path(f"{name}.stl").write_bytes(binary_stl([[place(p) for p in t] for t in box_triangles(tuple(map(float, size)))]))
    return f"{name}.stl"


def body(parts, model="cells", h=H):
    placement = ("--placement", "centre") if model == "paper" else ()
    subprocess.run(["flexel-voxelize", *parts, "--size", f"{h} mm", "--align", "none", *placement, "-o", "body.vtu", "--quiet"], check=True, stderr=subprocess.DEVNULL)


def simulate(scene, history=False, threads=1, explain=False):
    """Summary, columns of the history, processor seconds, what --explain said."""
    pathlib.Path("scene.toml").write_text(scene, encoding="utf-8")
    command = ["flexel-simulate", "scene.toml", "body.vtu", "-o", "out.vtu", "--summary", "summary.json", "--threads", str(threads)]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(command + ["--history", "history.csv"] * history + (["--explain"] if explain else ["--quiet"]), check=False, stderr=subprocess.PIPE)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    said = done.stderr.decode()
    if done.returncode != 0:
        sys.exit(f"measure.py: {said}\n{scene}")
    columns = {}
    if history:
        with open("history.csv", newline="", encoding="utf-8") as file:
            rows = list(csv.reader(file))
        columns = {re.sub(r" \[.*", "", name): [float(row[i]) for row in rows[1:]] for i, name in enumerate(rows[0])}
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return json.loads(pathlib.Path("summary.json").read_text(encoding="utf-8")), columns, seconds, said


def steps_of(summary):
    return summary["timed"]["steps"]


def of_a_step(scene, seconds, repeats=3):
    """us of a step: a long run less a short one; `scene(time)` with the run's time [s]."""
    taken = []
    for _ in range(repeats):
        short, long = (simulate(scene(t)) for t in (0.2 * seconds, seconds))
        taken.append((long[2] - short[2]) / (steps_of(long[0]) - steps_of(short[0])) * 1e6)
    return statistics.median(taken)


def rest():
    yield "## Rest"
    yield ""
    yield "Blocks exactly in touch with each other and with a plane, nothing acts, 50 ms; a cube of 2 cells a side under its weight with contact damping of .2 ms, the way of its middle in the second half of 2 s."
    yield ""
    yield "| model | in touch, moved by | resting, moved by |"
    yield "|---|---|---|"
    plane = "[[plane]]\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\n"
    for model in MODELS:
        body([block("a", (3, 3, 2)), block("b", (2, 2, 2), (5, 5, 20)), block("c", (2, 3, 2), (30, 0, 0))], model)
        moved = simulate(gum(model) + "[contact]\nfriction = 0.3\n" + plane + '[run]\ntime = "50 ms"\n')[0]["largest_displacement"]
        body([block("a", (2, 2, 2))], model)
        resting = simulate(gum(model) + '[contact]\nfriction = 0.3\ndamping = "0.2 ms"\n' + plane + '[gravity]\nacceleration = [0, 0, "-9.81 m/s2"]\n'
                           '[[probe]]\nname = "middle"\nat = ["10 mm", "10 mm", "10 mm"]\n[run]\ntime = "2 s"\nhistory_every = "10 ms"\n', True)[1]
        half = len(resting["time"]) // 2
        way = max(max(resting[f"middle {axis}"][half:]) - min(resting[f"middle {axis}"][half:]) for axis in "xyz")
        yield f"| {model} | {moved / H * 1e3:.1e} h | {way / H * 1e3:.1e} h |"
    yield ""


def bounces():
    yield "## Bounces"
    yield ""
    yield "A cube of 3 cells a side thrown at a plane, without damping: e, the square root of the energy of motion and deformation after it over that before. At the step that the run chooses, a third and a tenth of it."
    yield ""
    yield "| model | E | m/s | own step | 1/3 | 1/10 |"
    yield "|---|---|---|---|---|---|"
    cases = [(model, rigid, young, speed) for model in MODELS for rigid in (False, True) if not (rigid and model == "springs") for young, speed in (("20 kPa", 0.1), ("1 MPa", 0.9), ("1 GPa", 3))]
    for model, rigid, young, speed in cases:
        body([block("a", (3, 3, 3), (0, 0, 0.3 * H))], model)
        sound = math.sqrt({"20 kPa": 2e4, "1 MPa": 1e6, "1 GPa": 1e9}[young] / 1000)
        scene = gum(model, young) + ("[parts.a]\nrigid = true\n" if rigid else "") + '[[plane]]\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\n'
        scene += f'[[velocity]]\nwhere = "a"\nvelocity = ["0 m/s", "0 m/s", "{-speed} m/s"]\n[run]\ntime = "{0.3e-2 / speed + 0.4 / sound} s"\n'
        found, own = [], None
        for finer in (1, 3, 10):
            summary, columns, _, _ = simulate(scene + (f'step = "{own / finer} s"\n' if own else ""), True)
            own = own or min(summary["timed"]["step"], summary["timed"]["time"] / steps_of(summary))
            energy = [columns["kinetic"][row] + columns["elastic"][row] for row in (0, -1)]
            if columns["contact stored"][-1] != 0:
                sys.exit("measure.py: it touches still")
            found.append(math.sqrt(energy[1] / energy[0]))
        yield f"| {model}{', rigid' * rigid} | {young} | {speed} | " + " | ".join(f"{e:.4f}" for e in found) + " |"
    yield ""


def friction():
    yield "## Friction"
    yield ""
    yield "A block of 4 x 4 x 2 cells slides on a plane from 1 m/s under its weight, mu = .3, contact damping .1 ms: by v^2 / 2 mu g = 169.9 mm."
    yield ""
    yield "| model | slides by |"
    yield "|---|---|"
    for model in MODELS:
        for rigid in (False, True):
            if rigid and model == "springs":
                continue
            body([block("a", (4, 4, 2))], model)
            scene = gum(model) + ("[parts.a]\nrigid = true\n" if rigid else "") + '[contact]\nfriction = 0.3\ndamping = "0.1 ms"\n'
            scene += '[damping]\ntime = "0.2 ms"\n' if not rigid else ""
            scene += '[[plane]]\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\n[gravity]\nacceleration = [0, 0, "-9.81 m/s2"]\n[[velocity]]\nwhere = "a"\nvelocity = ["1 m/s", "0 m/s", "0 m/s"]\n'
            scene += '[[probe]]\nname = "middle"\nat = ["20 mm", "20 mm", "10 mm"]\n[run]\ntime = "0.5 s"\n'
            yield f"| {model}{', rigid' * rigid} | {1e3 * simulate(scene, True)[1]['middle x'][-1]:.1f} mm |"
    yield ""


def pressed():
    yield "## A ball pressed on a plate"
    yield ""
    yield "`bench/contact/hertz.py`: the force over that of Hertz, and over that of Tatara (1991), which has the compliance of the ball's far side."
    yield ""
    yield "| R/h | a/h | F/Hertz | F/Tatara |"
    yield "|---|---|---|---|"
    for cells, contact in ((20, 3), (20, 4)):
        indentation, force = hertz.measured(os.path.dirname(shutil.which("flexel-simulate")), cells, contact, slowness=8)
        yield f"| {cells} | {contact} | {force / hertz.hertz(indentation):.3f} | {force / hertz.tatara(indentation):.3f} |"
    yield ""


def run_of(time):
    return f'[run]\ntime = "{time} s"\n'


def costs():
    yield "## What contact costs"
    yield ""
    yield "us of a step, one thread, E = 1 MPa, cells of 10 mm. Points: of contact."
    yield ""
    yield "| what | elements | points | without contact | with | ratio |"
    yield "|---|---|---|---|---|---|"

    def row(name, scene, contact, seconds):
        summary, _, _, said = simulate(scene + contact + run_of(0.02 * seconds), explain=True)
        points = re.search(r"\[contact\], (\d+) points", said)[1]
        bare = of_a_step(lambda t: scene + run_of(t), seconds)
        taken = of_a_step(lambda t: scene + contact + run_of(t), seconds)
        return f"| {name} | {summary['elements']} | {points} | {bare:.1f} | {taken:.1f} | {taken / bare:.2f} |"
    for cells, seconds in ((10, 0.3), (22, 0.04), (46, 0.008)):
        body([block("a", (cells,) * 3)])
        free = gum("cells") + '[[velocity]]\nwhere = "a"\nvelocity = ["1 m/s", "0 m/s", "0 m/s"]\n'
        yield row(f"one block of {cells} x {cells} x {cells}, in flight", free, "[contact]\nself = true\n", seconds)
    for count, across in ((5, 6), (5, 16)):
        body([block(f"p{n}", (across, across, 2), (0, 0, 2 * H * n)) for n in range(count)])
        scene = "bond = false\n" + gum("cells") + '[gravity]\nacceleration = [0, 0, "-9.81 m/s2"]\n'
        yield row(f"{count} plates of {across} x {across} x 2 at rest on one another", scene, "[contact]\nfriction = 0.3\n[[plane]]\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\n",
                  0.1 if across < 10 else 0.02)
    cubes = [block(f"c{n}", (2, 2, 2), tuple(3.6 * H * (n // 3**axis % 3) for axis in range(3)), turn=turned((1, 2, n % 5), 0.7 * n)) for n in range(27)]
    body(cubes)
    scene = "bond = false\n" + gum("cells") + '[gravity]\nacceleration = [0, 0, "-9.81 m/s2"]\n'
    contact = '[contact]\nfriction = 0.3\ndamping = "50 us"\n' + "".join(
        f'[[plane]]\npoint = [{p}]\nnormal = [{n}]\n' for p, n in (('0, 0, "-10 mm"', "0, 0, 1"), ('"-10 mm", 0, 0', "1, 0, 0"), ('"102 mm", 0, 0', "-1, 0, 0"),
                                                             ('0, "-10 mm", 0', "0, 1, 0"), ('0, "102 mm", 0', "0, -1, 0")))
    yield row("27 cubes of 8 cells fall into a box", scene, contact, 0.15)
    yield ""


def damping():
    yield "## What damping costs"
    yield ""
    yield "A block of 20 x 20 x 20 cells of 4 mm that swings freely, one thread, ns of a cell for as much time as the longest undamped step takes; zeta: the damping ratio of the stiffest cell."
    yield ""
    yield "| model | E | tau | zeta | without | with | ratio |"
    yield "|---|---|---|---|---|---|---|"
    cells, h = 20, 4.0
    body([block("a", (cells,) * 3, h=h)], h=h)
    for model, young in (("cells", "20 kPa"), ("cells", "1 MPa"), ("springs", "20 kPa")):
        scene = gum(model, young) + '[[velocity]]\nwhere = { sphere = { centre = ["0 mm", "0 mm", "0 mm"], radius = "50 mm" } }\nvelocity = ["10 mm/s", "0 m/s", "0 m/s"]\n'
        longest = simulate(scene + run_of(0.01))[0]["timed"]["step"] / 0.9
        bare = None
        for tau in (0, 0.2e-3, 0.5e-3, 2e-3):
            damped = scene + (f'[damping]\ntime = "{tau} s"\n' if tau else "")
            seconds = 60 * longest
            taken = []
            for _ in range(3):
                short, long = (simulate(damped + run_of(t)) for t in (0.25 * seconds, seconds))
                taken.append((long[2] - short[2]) / (0.75 * seconds))
            rate = statistics.median(taken)  # processor seconds a second
            if not tau:
                bare = rate
                continue
            scale = longest / cells**3 * 1e9
            yield f"| {model} | {young} | {1e3 * tau:g} ms | {tau / longest:.1f} | {bare * scale:.1f} | {rate * scale:.1f} | {rate / bare:.1f} |"
    yield ""


def kneaded():
    yield "## Figure 8"
    yield ""
    yield "`samples/kneaded`, one thread: processor seconds for 112 ms of motion."
    yield ""
    yield "| model | steps | seconds | slower than real time |"
    yield "|---|---|---|---|"
    stl = subprocess.run([SOURCE / "samples/kneaded/make_bar.py"], check=True, stdout=subprocess.PIPE).stdout
    pathlib.Path("kneaded.stl").write_bytes(stl)
    text = (SOURCE / "samples/kneaded/kneaded.toml").read_text(encoding="utf-8").replace("frames = 22\n", "")
    for model in ("cells", "paper"):
        placement = ("--placement", "centre") if model == "paper" else ()
        subprocess.run(["flexel-voxelize", "kneaded.stl", "--size", "6mm", *placement, "-o", "body.vtu", "--quiet"], check=True, stderr=subprocess.DEVNULL)
        summary, _, seconds, _ = simulate(text)
        yield f"| {model} | {steps_of(summary)} | {seconds:.2f} | {seconds / 0.112:.1f} |"
    yield ""


SECTIONS = (rest, bounces, friction, pressed, costs, damping, kneaded)


def main():
    if not shutil.which("flexel-simulate"):
        sys.exit("measure.py: needs flexel-simulate on the PATH")
    chosen = [s for s in SECTIONS if not sys.argv[1:] or s.__name__ in sys.argv[1:]]
    lines = []
    for section in chosen:
        with tempfile.TemporaryDirectory(prefix="flexel-") as folder:
            os.chdir(folder)
            for line in section():
                lines.append(line)
                print(line, flush=True)
            os.chdir("/")
    page = SOURCE / "docs/measurements/contact.md"
    if len(chosen) == len(SECTIONS):
        processor = re.search(r"model name\s*: (.*)", pathlib.Path("/proc/cpuinfo").read_text(encoding="utf-8")) if platform.system() == "Linux" else None
        head = f"# Contact\n\n`bench/contact/measure.py` writes this page{f' (here on {processor[1]})' if processor else ''}. What it measures: [contact-mechanics.md](../theory/contact-mechanics.md).\n\n"
        page.write_text(head + "\n".join(lines).rstrip() + "\n", encoding="utf-8")
        return
    parts = re.split(r"(?m)^(?=## )", page.read_text(encoding="utf-8"))
    for part in re.split(r"(?m)^(?=## )", "\n".join(lines).rstrip() + "\n\n")[1:]:
        title = part.splitlines()[0]
        parts = [part if each.startswith(title + "\n") else each for each in parts]
    page.write_text("".join(parts).rstrip() + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()

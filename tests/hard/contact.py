"""Hard cases of contact: at rest for long, hit, flush, inside each other."""

import json

import numpy as np

import peers
from invariants import books, ends_well, integrators, refused, require, same_bits, same_view, sound_state, worked
from solids import grid_box, helix
from suite import case
from world import OTHER_UNITS, PLAIN, Setup, call, significant


def gum(view, poisson=0.3, density=1000, young=1e6):
    return 'material = "gum"\n' + view.material("gum", young, poisson, density)


@case("a coil on itself", quick=False, known={"damped": "the damping's system is not solved in 5000 iterations where elements are moved"},
      holds="a coil of three turns pressed until its turns lie on one another: no triangle passes through another, books within 1 %, the same mirrored",
      breaks="contact of a part with itself that takes its neighbours in the wire for touching; turns that slip through")
def coil(trial):
    radius, pitch, wire = 8e-3, 6e-3, 2e-3
    h = 1e-3

    def world(view, damping=""):
        scene = gum(view, 0.3, 1000, 5e6) + '[contact]\nfriction = 0.2\ndamping = "5 us"\n' + damping
        top = 3 * pitch
        scene += f'[[fix]]\nwhere = {view.box((radius - 2 * wire, -2 * wire, -2 * wire), (radius + 2 * wire, 0.6e-3, wire))}\n'
        scene += f'[[move]]\nwhere = {view.box((radius - 2 * wire, -0.6e-3, top - wire), (radius + 2 * wire, 2 * wire, top + 2 * wire))}\n'
        scene += f'displacement = {view.vector("length", (0, 0, -0.5 * top))}\ntime = ["0 ms", "60 ms"]\nfactor = [0, 1]\n'
        return Setup({"coil": helix(radius, pitch, 3, wire)}, scene + '[run]\ntime = "80 ms"\n', h)

    with trial.section("pressed"):
        out = worked(same_bits(trial, world, (7,)))
        sound_state(out)
        trial.show(out)
        ratio = books(out, 1e-2)
        report = out.folder / "report.json"
        code, err = call("flexel-map", out.out, "-o", out.folder / "coil.stl", "--check", "self-intersection", "--report", report)
        found = json.loads(report.read_text())["failures"]["new_self_intersections"]
        trial.figure(f"{found} pairs of triangles cross, books {significant(ratio)}")
        require(found == 0, f"{found} pairs of triangles pass through each other: {err.strip()[-200:]}")
        same_view(trial, world, out, OTHER_UNITS, 1e-3)
    with trial.section("damped"):
        damped = worked(trial.go(world(PLAIN, '[damping]\ntime = "0.1 ms"\n')))
        sound_state(damped)
        books(damped, 1e-2)


def told(found, *names_and_unit):
    *names, unit = names_and_unit
    if "failed" in found:
        return f"ends with code {found['failed']}"
    if not all(np.isfinite(found[name]) for name in found):
        return "positions become NaN, without a word"
    return ", ".join(f"{name} {significant(found[name])}{unit}" for name in names)


def stack_of_plates(trial, count, friction, seconds, shift=0.0):
    """Plates of 2 x 2 x 1 cells; every other one is shifted aside by so many cells."""
    h = 2e-2

    def world(view):
        parts = {f"plate{n:02}": grid_box((2, 2, 1), h, (shift * h * (n % 2), shift * h * (n % 2), n * h)) for n in range(count)}
        scene = gum(view, 0.3) + f'[contact]\nfriction = {friction}\ndamping = "50 us"\n[damping]\ntime = "0.2 ms"\n[[plane]]\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\n'
        scene += f'[gravity]\nacceleration = {view.vector("acceleration", (0, 0, -9.81))}\n'
        scene += "".join(f'[[probe]]\nname = "p{n}"\nat = {view.point((h, h, (n + 0.5) * h))}\n' for n in range(count))
        return Setup(parts, scene + f'[run]\ntime = "{seconds} s"\nhistory_every = "5 ms"\n', h)

    out = worked(trial.go(world(PLAIN)))
    trial.show(out)
    sound_state(out)
    ratio = books(out, 1e-2)
    history = out.history
    late = history["time"] >= 1.0
    path = np.array([[history[f"p{n} {axis}"][late] for axis in "xyz"] for n in range(count)])
    drift = np.abs(path[:, :, -1] - path[:, :, 0]).max() / h
    jitter = np.ptp(path, axis=2).max() / h
    trial.figure(f"{'shifted' if shift else 'flush'}, friction {friction}: drift {significant(drift)} h, jitter {significant(jitter)} h, books {significant(ratio)}")
    require(drift < 1e-3 and jitter < 1e-3, f"drift {significant(drift)} h, jitter {significant(jitter)} h")
    # The stack is shorter by its own weight: m g over area and modulus, summed over the plates below; and pressure begins to grow softly where the
    # surfaces meet (docs/contact.md), over a hundredth of a cell at each.
    weight = 1000 * 9.81 * h / 1e6 * h * sum(count - n - 0.5 for n in range(count))
    top = -path[count - 1, 2, -1]
    require(0.5 * weight < top < 3 * weight + 0.01 * h * count, f"the top plate sank by {significant(top)} m; {significant(weight)} m by the plates' compression alone")
    return world


@case("a stack of plates at rest",
      known={"shifted, friction 0.5": "the stack sways on; 1 s does not settle it", "flush, friction 0.5": "jitter of half a hundredth of a cell, no drift",
             "shifted, friction 0": "without friction nothing holds plates that lie askew: they slide off"},
      quick=False, peer="Bullet",
      holds="ten rubber plates (1 MPa) on a floor, 10 s after 1 s of settling: drift and jitter under 1e-3 h, with friction and without, every other one shifted by a quarter of a cell and all flush",
      breaks="contact forces that jump when patches come and go; friction that creeps; energy that trickles in")
def stack(trial):
    for name, friction, shift in (("shifted", 0.5, 0.25), ("shifted", 0, 0.25), ("flush", 0.5, 0.0)):
        with trial.section(f"{name}, friction {friction}"):
            stack_of_plates(trial, 10, friction, 11, shift)
    with trial.peer("Bullet") as on:
        if on:
            for gap in (0, 0.05):
                found = peers.bullet("stack", 10, 11, gap)
                trial.peers.append(f"Bullet, plates that begin {gap} h apart: " + told(found, "drift", "jitter", " h"))


@case("two plates at rest",
      holds="the stack's small sister: two plates for 0.3 s after 1 s", breaks="what breaks the stack")
def stack_quick(trial):
    for name, shift in (("shifted", 0.25), ("flush", 0.0)):
        with trial.section(name):
            stack_of_plates(trial, 2, 0.5, 1.3, shift)


@case("impact at 300 m/s",
      holds="steel on steel at 300 m/s: momentum to 1e-9, books within 2 %, they part; rubber on a floor at 300 m/s (ten times its speed of sound) stops as it should",
      breaks="a patch that passes another within a step; contact energy that is not given back")
def impact(trial):
    h = 5e-3

    def steel(view, run, model="cells"):
        scene = 'material = "hard"\n' + view.material("hard", 210e9, 0.25, 7850) + "".join(f'[parts.{p}]\nmodel = "{model}"\n' for p in ("left", "right"))
        scene += f'[[velocity]]\nwhere = "left"\nvelocity = {view.vector("velocity", (300, 0, 0))}\n'
        scene = 'contact = true\n' + scene
        return Setup({"left": grid_box((4, 3, 3), h), "right": grid_box((4, 3, 3), h, (4.2 * h, 0.3 * h, 0.2 * h))}, scene + run, h)

    def rubber(view, run):
        return Setup({"ball": grid_box((4, 4, 4), h, (0, 0, h / 10))}, gum(view) + f'[[plane]]\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\n[[velocity]]\nwhere = "ball"\n'
                     f'velocity = {view.vector("velocity", (0, 0, -300))}\n' + run, h)

    for model in ("cells", "springs"):
        outcomes = integrators(trial, lambda view, run: steel(view, run, model), "40 us", None, f"steel, {model}, ", energy=2e-2, free=1e-9, units=1e-6, mirror=1e-4)
        if "symplectic" in outcomes:
            with trial.section(f"steel, {model}, they part"):
                out = outcomes["symplectic"]
                arrays = out.arrays()
                velocity, part = arrays["point/velocity"][:, 0], arrays["point/part"]
                left, right = velocity[part == 0].mean(), velocity[part == 1].mean()
                trial.figure(f"{model}: {significant(left)} and {significant(right)} m/s after, books {significant(books(out, 1))}")
                require(right > 200 and left < right, f"{left} and {right} m/s after")
                if model == "cells":
                    trial.show(out)
    for method in ("symplectic",) if trial.quick else ("symplectic", "verlet", "explicit"):
        with trial.section(f"rubber, {method}"):
            out = ends_well(same_bits(trial, lambda view: rubber(view, f'[run]\ntime = "5 ms"\nmethod = "{method}"\n'), (7,)))
            trial.figure(f"rubber, {method}: " + ("stops" if out.code else f"holds, J {significant(out.summary['smallest_jacobian'])}"))


@case("mass ratio 1e6 in contact",
      peer="Bullet",
      holds="a block is hit by one a million times heavier: it leaves at up to twice the speed, momentum to 1e-9, books within 2 %; the heavy one rests on the light one",
      breaks="contact stiffness or steps chosen by the wrong side; impulses that are shared by mass")
def mass_ratio(trial):
    h = 1e-2

    def hit(view, run):
        scene = 'contact = true\nmaterial = "light"\n' + view.material("light", 1e6, 0.3, 1000) + view.material("heavy", 1e6, 0.3, 1e9) + '[parts.big]\nmaterial = "heavy"\n'
        scene += f'[[velocity]]\nwhere = "big"\nvelocity = {view.vector("velocity", (0.5, 0, 0))}\n'
        return Setup({"big": grid_box((3, 3, 3), h), "small": grid_box((3, 3, 3), h, (3.05 * h, 0, 0))}, scene + run, h)

    outcomes = integrators(trial, hit, "40 ms", None, energy=2e-2, free=1e-9, units=1e-6, mirror=1e-4)
    if "symplectic" in outcomes:
        with trial.section("speed after"):
            out = outcomes["symplectic"]
            arrays = out.arrays()
            speed = arrays["point/velocity"][arrays["point/part"] == 1][:, 0].mean()
            trial.figure(f"leaves at {significant(speed / 0.5)} of the speed")
            require(0.9 < speed / 0.5 < 2.05, f"{speed} m/s")
            trial.show(out)
    with trial.section("at rest"):
        # the heavy one's weight is that of 0.2 % strain of the light one
        def lie(view):
            scene = '[contact]\nfriction = 0.3\ndamping = "50 us"\n' + view.material("light", 1e6, 0.3, 1000) + view.material("heavy", 1e6, 0.3, 1e9)
            scene = 'material = "light"\n' + scene + '[parts.big]\nmaterial = "heavy"\n[damping]\ntime = "5 ms"\n'
            scene += f'[[plane]]\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\n[gravity]\nacceleration = {view.vector("acceleration", (0, 0, -1e-4))}\n'
            scene += f'[[probe]]\nname = "big"\nat = {view.point((h, h, 2 * h))}\n'
            return Setup({"small": grid_box((2, 2, 1), h), "big": grid_box((2, 2, 2), h, (0, 0, h))}, scene + '[run]\ntime = "1 s"\nhistory_every = "5 ms"\n', h)
        out = worked(same_bits(trial, lie, (7,)))
        sound_state(out)
        books(out, 2e-2)
    with trial.peer("Bullet") as on:
        if on:
            trial.peers.append("Bullet: it leaves at " + told(peers.bullet("hit", 1e6), "speed", " of the other's").removeprefix("speed "))


@case("exactly in touch at the start",
      holds="two blocks face to face and one exactly on a floor, nothing acts: nothing moves, to 1e-9 h; with friction too",
      breaks="a gap of zero whose sign is rounding's; a force that is not zero where the gap is")
def touching(trial):
    h = 1e-2

    def world(view, run, friction=0.0):
        scene = gum(view) + f"[contact]\nfriction = {friction}\n[[plane]]\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\n"
        return Setup({"low": grid_box((3, 3, 2), h), "high": grid_box((2, 2, 2), h, (0.5 * h, 0.5 * h, 2 * h)), "side": grid_box((2, 3, 2), h, (3 * h, 0, 0))}, scene + run, h)

    for friction in (0.0, 0.5):
        outcomes = integrators(trial, lambda view, run: world(view, run, friction), "20 ms", None, f"friction {friction}, ", energy=None, units=None, mirror=None)
        for method, out in outcomes.items():
            with trial.section(f"friction {friction}, {method}, still"):
                moved = out.summary["largest_displacement"] / h
                trial.figure(f"moved by {significant(moved)} h")
                trial.show(out)
                require(moved < 1e-9, f"moved by {moved} h")


@case("pressed without friction",
      holds="a block between a floor and a plate of its own outline that comes down by a fifth of a cell: whether it stays or slides out, books within 2 %",
      breaks="a side that takes over a contact from the face beside it at once, as deep as it is")
def pressed(trial):
    h = 1e-2
    scene = ("[contact]\n[[plane]]\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\n[[manipulator]]\npart = \"plate\"\n"
             'time = ["0 s", "250 ms"]\ndisplacement = [[0, 0, 0], [0, 0, "-4 mm"]]\n[damping]\ntime = "20 us"\n[run]\ntime = "220 ms"\n')
    with trial.section("books"):
        out = same_bits(trial, lambda view: Setup({"block": grid_box((4, 2, 2), h), "plate": grid_box((4, 2, 1), h, (0, 0, 2.02 * h))}, gum(view) + scene, h), (7,))
        ends_well(out)
        trial.show(out)
        books(out, 2e-2)


@case("overlapping at the start",
      peer="Bullet",
      holds="two blocks that begin 0.1, 0.5 and 1.5 cells inside each other: refused with the depth, or parted with no more speed than a tenth of sound's",
      breaks="a penalty that throws them apart; normals that point the wrong way once a surface is passed")
def overlapping(trial):
    h = 1e-2

    def world(view, depth, run):
        scene = 'contact = true\n' + gum(view)
        return Setup({"low": grid_box((3, 3, 3), h), "high": grid_box((3, 3, 3), h, (0, 0, 3 * h - depth * h))}, scene + run, h)

    for depth in (0.1, 0.5, 1.5):
        with trial.section(f"{depth} cells"):
            out = same_bits(trial, lambda view: world(view, depth, '[run]\ntime = "30 ms"\n'), (7,))
            if out.code == 2:
                refused(out, "overlap")
                trial.figure(f"{depth} cells: refused")
                continue
            ends_well(out)
            require(out.code == 0, f"stopped: {out.error}")
            speed = np.linalg.norm(out.arrays()["point/velocity"], axis=1).max() / np.sqrt(1e6 / 1000)
            trial.figure(f"{depth} cells: {significant(speed)} of the speed of sound")
            if depth == 0.5:
                trial.show(out)
            books(out, 2e-2)
            _, position = out.motion()
            require(np.ptp(position[:, 2]) > 5.9 * h, f"still {significant(6 - np.ptp(position[:, 2]) / h)} cells inside each other")
            require(speed < 0.1, f"thrown apart at {significant(speed)} of the speed of sound")
    with trial.peer("Bullet") as on:
        if on:
            for depth in (0.1, 0.5, 1.5):
                trial.peers.append(f"Bullet, {depth} cells: " + told(peers.bullet("overlap", depth), "gap", " cells after a second"))

"""Hard cases of contact: at rest for long, hit, flush, inside each other."""

import numpy as np

import peers
from files import any_stl_triangles
from invariants import books, ends_well, integrators, momentum, refused, require, same_bits, same_view, sound_state, worked
from overlap import deepest, touching
from solids import grid_box, helix
from suite import case
from world import OTHER_UNITS, PLAIN, Setup, call, placement, significant


def gum(view, poisson=0.3, density=1000, young=1e6):
    return 'material = "gum"\n' + view.material("gum", young, poisson, density)


@case("a coil on itself", quick=False,
      holds="a coil of two turns and a quarter, its first and last quarter led, pressed until its turns lie on one another: they touch over a quarter of the round or more, none is deeper in another than a quarter of a cell, books within 1 %, the same in other units",
      breaks="contact of a part with itself that takes its neighbours in the wire for touching; turns that slip through")
def coil(trial):
    radius, pitch, wire = 8e-3, 6e-3, 2e-3
    h = 2e-3

    def world(view):
        end, top = radius + 2 * wire, 2 * pitch
        scene = gum(view) + '[contact]\nfriction = 0.2\n[damping]\ntime = "0.1 ms"\n'
        scene += f"[[fix]]\nwhere = {view.box((-0.2 * wire, -0.2 * wire, -2 * wire), (end, end, 1.8 * wire))}\n"
        scene += f"[[move]]\nwhere = {view.box((-0.2 * wire, -0.2 * wire, top - 1.1 * wire), (end, end, top + 3 * wire))}\n"
        scene += f'displacement = {view.vector("length", (0, 0, -0.32 * top))}\ntime = ["0 ms", "60 ms"]\nfactor = [0, 1]\n'
        return Setup({"coil": helix(radius, pitch, 2.25, wire, sides=20)}, scene + '[run]\ntime = "80 ms"\n', h)

    with trial.section("pressed"):
        out = worked(same_bits(trial, world, (7,)))
        sound_state(out)
        trial.show(out)
        ratio = books(out, 1e-2)
        code, err = call("flexel-map", out.out, "-o", out.folder / "mapped.stl")
        require(code == 0, f"not mapped: {err.strip()[-200:]}")
        surface = any_stl_triangles(out.folder / "mapped.stl") / 1e3
        depth, near = deepest(surface, h), touching(surface, h, 0.1 * h)
        share = len(np.unique(np.floor(np.arctan2(near[:, 1], near[:, 0]) * (12 / np.pi)))) / 24
        trial.figure(f"touches over {significant(share)} of the round, deepest in itself {significant(depth)} h, smallest J {significant(out.summary['smallest_jacobian'])}, books {significant(ratio)}")
        require(depth < 0.25, f"a turn lies {depth} h deep in another")
        require(share >= 0.25, f"the turns touch over {significant(share)} of the round only")
        same_view(trial, world, out, OTHER_UNITS, 1e-3)


def told(found, *names_and_unit):
    *names, unit = names_and_unit
    if "failed" in found:
        return f"ends with code {found['failed']}"
    if not all(np.isfinite(found[name]) for name in found):
        return "positions become NaN, without a word"
    return ", ".join(f"{name} {significant(found[name])}{unit}" for name in names)


def plates_askew(view, cells, count, friction, shift, probes, seconds):
    """Plates on one another, every other one shifted aside by so many cells. Of rubber whose loss factor is 0.28 at 40 rad/s, where ten wide ones sway."""
    h = 2e-2
    parts = {f"plate{n:02}": grid_box(cells, h, (shift * h * (n % 2), shift * h * (n % 2), n * h)) for n in range(count)}
    scene = gum(view, 0.3) + f'[contact]\nfriction = {friction}\n[damping]\ntime = "7 ms"\n[[plane]]\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\n'
    scene += f'[gravity]\nacceleration = {view.vector("acceleration", (0, 0, -9.81))}\n'
    scene += "".join(f'[[probe]]\nname = "{name}"\nat = {view.point(h * np.asarray(at))}\n' for name, at in probes.items())
    return Setup(parts, scene + f'[run]\ntime = "{seconds} s"\nhistory_every = "5 ms"\n', h)


def plates_at_rest(trial, name, cells, count, seconds, shift=0.0):
    h = 2e-2
    probes = {f"p{n}": (0.5 * cells[0], 0.5 * cells[1], n + 0.5) for n in range(count)}
    out = worked(trial.go(plates_askew(PLAIN, cells, count, 0.5, shift, probes, seconds)))
    trial.show(out)
    sound_state(out)
    ratio = books(out, 1e-2)
    history = out.history
    late = history["time"] >= 1.0
    path = np.array([[history[f"p{n} {axis}"][late] for axis in "xyz"] for n in range(count)])
    drift = np.abs(path[:, :, -1] - path[:, :, 0]).max() / h
    jitter = np.ptp(path, axis=2).max() / h
    trial.figure(f"{name}: drift {significant(drift)} h, jitter {significant(jitter)} h, books {significant(ratio)}")
    require(drift < 1e-3 and jitter < 1e-3, f"drift {significant(drift)} h, jitter {significant(jitter)} h")
    # The stack is shorter by its own weight: m g over area and modulus, summed over the plates below; and pressure begins to grow softly where the
    # surfaces meet (docs/reference/contact.md), over a hundredth of a cell at each.
    weight = 1000 * 9.81 * h / 1e6 * h * sum(count - n - 0.5 for n in range(count))
    top = -path[count - 1, 2, -1]
    require(0.5 * weight < top < 3 * weight + 0.01 * h * count, f"the top plate sank by {significant(top)} m; {significant(weight)} m by the plates' compression alone")


def plates_slide_apart(trial):
    """Plates askew tilt, and where nothing holds them they slide: as fast as gravity makes them on that slope, both ways alike."""
    h, shift, seconds = 2e-2, 0.25, 0.4
    ends = {f"{part}{side}": ((0 if side == "left" else 2) + at, 1 + at, height) for part, at, height in (("low", 0, 0.5), ("high", shift, 1.02))
            for side in ("left", "right")}
    out = worked(trial.go(plates_askew(PLAIN, (2, 2, 1), 2, 0, shift, ends, seconds)))
    sound_state(out)
    books(out, 1e-2)
    history = out.history
    time = history["time"]
    slope = -(history["highright z"] - history["highleft z"]) / (2 * h)
    speed = np.concatenate([[0], np.cumsum(0.5 * 9.81 * (slope[1:] + slope[:-1]) * np.diff(time))])
    due = np.sum(0.5 * (speed[1:] + speed[:-1]) * np.diff(time))
    moved = {part: 0.5 * (history[f"{part}left x"] + history[f"{part}right x"])[-1] for part in ("low", "high")}
    trial.figure(f"without friction: apart by {significant((moved['high'] - moved['low']) / h)} h in {seconds} s, {significant(moved['high'] / due)} of what gravity makes of the tilt")
    require(abs(moved["high"] / due - 1) < 0.1, f"moved by {moved['high']} m, {due} m by the tilt")
    require(abs(moved["low"] + moved["high"]) < 0.02 * moved["high"], f"one moved by {moved['low']} m, the other by {moved['high']} m")


@case("a stack of plates at rest", quick=False, peer="Bullet",
      holds="ten rubber plates (1 MPa) on a floor, 10 s after 1 s of settling: drift and jitter under 1e-3 h, all flush, and every other one shifted aside by a quarter of a cell",
      breaks="contact forces that jump when patches come and go; friction that creeps; energy that trickles in")
def stack(trial):
    with trial.section("flush"):
        plates_at_rest(trial, "flush", (2, 2, 1), 10, 11)
    with trial.section("shifted"):
        plates_at_rest(trial, "shifted", (4, 4, 1), 10, 11, 0.25)
    with trial.peer("Bullet") as on:
        if on:
            for gap in (0, 0.05):
                found = peers.bullet("stack", 10, 11, gap)
                trial.peers.append(f"Bullet, plates that begin {gap} h apart: " + told(found, "drift", "jitter", " h"))


@case("two plates at rest",
      holds="the stack's small sister: two plates for 0.3 s after 1 s; shifted and without friction, where they tilt and so must slide, they do as gravity has it on that slope, within 10 %",
      breaks="what breaks the stack; friction where there is none")
def stack_quick(trial):
    for name, shift in (("shifted", 0.25), ("flush", 0.0)):
        with trial.section(name):
            plates_at_rest(trial, name, (2, 2, 1), 2, 1.3, shift)
    with trial.section("without friction"):
        plates_slide_apart(trial)


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
      holds="two blocks face to face, one beside and one exactly on a floor, nothing acts: nothing moves, to 1e-9 h; with friction too; in all three models",
      breaks="a gap of zero whose sign is rounding's; a force that is not zero where the gap is")
def in_touch(trial):
    h = 1e-2

    def world(view, run, friction, model):
        scene = f'model = "{model}"\n' + gum(view, 0.25) + f"[contact]\nfriction = {friction}\n[[plane]]\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\n"
        return Setup({"low": grid_box((3, 3, 2), h), "high": grid_box((2, 2, 2), h, (0.5 * h, 0.5 * h, 2 * h)), "side": grid_box((2, 3, 2), h, (3 * h, 0, 0))}, scene + run, h, placement(model))

    for model, friction in [(model, friction) for model in ("cells", "springs", "paper") for friction in (0.0, 0.5)]:
        outcomes = integrators(trial, lambda view, run: world(view, run, friction, model), "20 ms", None, f"{model}, friction {friction}, ", energy=None, units=None,
                               mirror=None)
        for method, out in outcomes.items():
            with trial.section(f"{model}, friction {friction}, {method}, still"):
                moved = out.summary["largest_displacement"] / h
                trial.figure(f"{model}: moved by {significant(moved)} h")
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
      holds="two blocks that begin 0.1, 0.5 and 1.5 cells inside each other: refused with the depth; or, as asked, parted in 20 ms with no more speed than a twentieth of sound's, momentum to 1e-9, books within 2 % (deeper than 0.9 cells: refused)",
      breaks="a penalty that throws them apart; normals that point the wrong way once a surface is passed")
def overlapping(trial):
    h = 1e-2

    def world(view, depth, contact):
        scene = contact + gum(view) + '[run]\ntime = "30 ms"\n'
        return Setup({"low": grid_box((3, 3, 3), h), "high": grid_box((3, 3, 3), h, (0, 0, 3 * h - depth * h))}, scene, h)

    for depth in (0.1, 0.5, 1.5):
        with trial.section(f"{depth} cells"):
            refused(same_bits(trial, lambda view: world(view, depth, "contact = true\n"), (7,)), "overlap", f"{10 * depth:.3g} mm")
            trial.figure(f"{depth} cells: refused")
        with trial.section(f"{depth} cells, parted"):
            out = same_bits(trial, lambda view: world(view, depth, f'contact.overlap = "part"\ncontact.overlap_time = {view.time(20e-3)}\n'), (7,))
            if depth > 0.9:
                refused(out, "overlap", f"{10 * depth:.3g} mm")
                trial.figure(f"{depth} cells, parted: refused")
                continue
            sound_state(worked(out))
            history = out.history
            # of the blocks against each other: half the kinetic energy each
            speed = np.sqrt(2 * history["kinetic"].max() / out.summary["mass"]) / np.sqrt(1e6 / 1000)
            trial.figure(f"{depth} cells, parted: {significant(speed)} of the speed of sound at most, books {significant(books(out, 2e-2))}")
            if depth == 0.5:
                trial.show(out)
            momentum(out)
            _, position = out.motion()
            require(np.ptp(position[:, 2]) > 5.99 * h, f"still {significant(6 - np.ptp(position[:, 2]) / h)} cells inside each other")
            require(speed < 0.05, f"thrown apart at {significant(speed)} of the speed of sound")
    with trial.peer("Bullet") as on:
        if on:
            for depth in (0.1, 0.5, 1.5):
                trial.peers.append(f"Bullet, {depth} cells: " + told(peers.bullet("overlap", depth), "gap", " cells after a second"))

"""Hard cases of motion: crushed, thrown, twisted, snapped, buckled."""

import numpy as np

import peers
from invariants import battery, books, ends_well, integrators, momentum, require, same_bits, same_view, sound_state, stops_well, worked
from solids import grid_box, strip
from suite import case
from world import MIRRORED, OTHER_UNITS, PLAIN, Setup, edited, significant


def gum(view, poisson=0.3, density=1000, young=1e6):
    return 'material = "gum"\n' + view.material("gum", young, poisson, density)


def crush(trial, share):
    """A cube of 4^3 cells pressed flat by `share`, its ends held, and let go: how far off its shape it ends, by model and integrator."""
    h, cells = 5e-3, 4

    def pressed(view, model, run):
        return Setup({"cube": grid_box((cells,) * 3, h)}, gum(view, 0.25) + f'[parts.cube]\nmodel = "{model}"\n[[fix]]\nwhere = "zmin"\n[[move]]\nwhere = "zmax"\n'
                     f'displacement = {view.vector("length", (0.02 * cells * h, 0.01 * cells * h, -share * cells * h))}\ntime = ["0 ms", "60 ms"]\nfactor = [0, 1]\n[damping]\ntime = "0.2 ms"\n' + run, h)

    def released(view, model, run, body):
        return Setup({}, gum(view, 0.25) + f'[parts.cube]\nmodel = "{model}"\n[[fix]]\nwhere = "zmin"\n[damping]\ntime = "0.5 ms"\n' + run, h, bodies=(body,))

    # led a little aside, too, so that rounding does not choose the way it folds
    for model in ("cells", "springs"):
        for method in ("symplectic",) if trial.quick else ("symplectic", "verlet", "implicit"):
            with trial.section(f"{model}, {method}"):
                run = f'[run]\ntime = "{{}}"\nmethod = "{method}"\n' + ('step = "2 ms"\n' if method == "implicit" else "")
                flat = same_bits(trial, lambda view: pressed(view, model, run.format("70 ms")), (7,))
                if flat.code == 3:
                    stops_well(flat)
                    trial.figure(f"{model}, {method}: stops")
                    continue
                worked(flat)
                sound_state(flat)
                books(flat, 1e-3)
                same_view(trial, lambda view: pressed(view, model, run.format("70 ms")), flat, OTHER_UNITS, 1e-6)
                if model == "cells" and method == "symplectic":
                    trial.show(flat)
                free = worked(trial.go(released(PLAIN, model, run.format("250 ms"), flat.out)))
                sound_state(free)
                rest, position = free.motion()
                off = np.linalg.norm(position - rest, axis=1).max() / (cells * h)
                trial.figure(f"{model}, {method}: {significant(off)} of its side off")
                require(off < 1e-3, f"it does not come back: {significant(off)} of its side off")
    with trial.peer("LAMMPS") as on:
        if on:
            trial.peers.append(f"pressed at once and let go: {crushed_by_lammps(trial, share)}")


@case("60 % crush and release",
      peer="LAMMPS", holds="pressed to 40 % of its height between held faces and let go, a cube comes back to its shape within 1e-3 of its side, or the run stops as it should",
      breaks="springs, which resist as well inside out and stay so; a step that does not follow the stiffening")
def crush_60(trial):
    crush(trial, 0.6)


def crushed_by_lammps(trial, share):
    """The cube's springs pressed flat at once, and let go."""
    h = 5e-3
    head = gum(PLAIN, 0.25) + '[parts.cube]\nmodel = "springs"\n'
    base = worked(trial.go(Setup({"cube": grid_box((4, 4, 4), h)}, head + '[run]\ntime = "1e-9 ms"\n', h)))

    def press(arrays):
        arrays["position"][:, 2] = arrays["rest"][:, 2] * (1 - share)
    body = edited(base.folder / "body.vtu", trial.folder / "pressed.vtu", press)
    return peers.lammps_free(trial, Setup({}, head + '[run]\ntime = "250 ms"\nmethod = "verlet"\n', h, bodies=(body,)), 1e6, 1000)


@case("90 % crush and release",
      quick=False, holds="the same to a tenth of its height", breaks="the same, and the corners that fold over the held faces")
def crush_90(trial):
    crush(trial, 0.9)


@case("an element thrown through its cell",
      peer="LAMMPS",
      holds="a corner of a cube of 3^3 cells is thrown inwards at 0.05, 0.5, 5 and 50 times the speed of sound: it comes back with the books closed, or the run stops as it should",
      breaks="a fold that happens between two checks; an energy without a barrier; a step that does not follow the speed")
def thrown(trial):
    h = 1e-2

    def world(view, model, speed, run):
        return Setup({"cube": grid_box((3, 3, 3), h)}, gum(view, 0.25) + f'[parts.cube]\nmodel = "{model}"\n[[velocity]]\nwhere = {view.sphere((0, 0, 0), h / 4)}\n'
                     f'velocity = {view.vector("velocity", (speed, speed * 1.01, speed * 0.97))}\n' + run, h)

    sound = np.sqrt(1.2e6 / 1000)
    for model in ("cells", "springs"):
        for times in (0.05, 5) if trial.quick else (0.05, 0.5, 5, 50):
            for method in ("symplectic", "implicit") if trial.quick else ("symplectic", "verlet", "explicit", "implicit"):
                with trial.section(f"{model}, {times} c, {method}"):
                    # at half the speed of sound the cell is as good as flat: the leapfrog's books close with the square of the step
                    step = 'step = "0.05 ms"\n' if method == "implicit" else 'step = "20 us"\n' if times == 0.5 else ""
                    run = f'[run]\ntime = "10 ms"\nmethod = "{method}"\n' + step
                    out = ends_well(same_bits(trial, lambda view: world(view, model, times * sound / np.sqrt(3), run), (7,)))
                    if method in ("symplectic", "implicit"):
                        trial.figure(f"{model} {times} c {method}: " + ("stops" if out.code else "holds"))
                    if out.code == 0 and method != "explicit":
                        books(out, 1e-2)
                        if method != "implicit":
                            momentum(out)
                    if model == "cells" and times == 0.5 and out.code == 0 and method == "symplectic":
                        trial.show(out)
                    require(not (times <= 0.05 and out.code and method != "explicit"), f"stopped at {times} of the speed of sound: {out.error}")
    with trial.peer("LAMMPS") as on:
        if on:
            trial.peers.append(peers.lammps_free(trial, world(PLAIN, "springs", 5 * sound / np.sqrt(3), '[run]\ntime = "10 ms"\nmethod = "verlet"\n'), 1e6, 1000))


@case("twisted by 720 degrees",
      quick=False, peer="CalculiX",
      holds="a bar 3 x 3 x 18 cells, one end turned twice: torque at equilibrium and in time within 5 % of each other, J > 0; let go, it comes back",
      breaks="angles taken modulo a turn; moves whose way is a chord; Newton steps beyond a turn")
def twist(trial):
    h = 5e-3

    def world(view, run, model="cells", more=""):
        middle = (1.5 * h, 1.5 * h, 0)
        return Setup({"bar": grid_box((3, 3, 18), h)}, gum(view, 0.25) + f'[parts.bar]\nmodel = "{model}"\n[[fix]]\nwhere = "zmin"\n[[move]]\nname = "turned"\nwhere = "zmax"\n'
                     f'rotation = {view.rotation((0, 0, 1), middle, 720.0)}\n' + more
                     # it buckles out of its axis on the way: to the side of a little load, not of rounding
                     + f'[[load]]\nwhere = {view.box((-h / 5, -h / 5, 8.5 * h), (3.2 * h, 3.2 * h, 10.5 * h))}\nforce = {view.vector("force", (0.01, 0.003, 0))}\n' + run, h)

    course = 'time = ["0 ms", "200 ms"]\nfactor = [0, 1]\n[damping]\ntime = "0.3 ms"\n'

    def torque(out):
        turned = next(r for r in out.summary["reactions"] if r["name"] == "turned")
        return turned["moment"][2] - 1.5 * h * (turned["force"][1] - turned["force"][0])  # about the bar's axis

    still = None
    for model in ("cells", "springs"):
        with trial.section(f"equilibrium, {model}"):
            out = same_bits(trial, lambda view: world(view, "[run]\nload_steps = 16\n", model), (7,))
            if out.code == 3:
                stops_well(out, timed=False)
                trial.figure(f"{model}, equilibrium: stops")
            else:
                worked(out)
                sound_state(out)
                same_view(trial, lambda view: world(view, "[run]\nload_steps = 16\n", model), out, OTHER_UNITS, 1e-6)
                same_view(trial, lambda view: world(view, "[run]\nload_steps = 16\n", model), out, MIRRORED, 1e-5)
                if model == "cells":
                    still = torque(out)
                    trial.figure(f"torque {significant(still)} N m, smallest J {significant(out.summary['smallest_jacobian'])}")
                    trial.show(out)
        for method in ("symplectic", "implicit"):
            with trial.section(f"{model}, {method}"):
                run = f'[run]\ntime = "300 ms"\nmethod = "{method}"\n' + ('step = "4 ms"\n' if method == "implicit" else "")
                out = ends_well(same_bits(trial, lambda view: world(view, run, model, course), (7,)))
                if out.code == 3:
                    trial.figure(f"{model}, {method}: stops")
                    continue
                books(out, 2e-3)
                if model == "cells" and still:
                    off = torque(out) / still - 1
                    require(abs(off) < 0.05, f"torque {significant(100 * off)} % off that of equilibrium")
                free = worked(trial.go(Setup({}, gum(PLAIN, 0.25) + f'[parts.bar]\nmodel = "{model}"\n[[fix]]\nwhere = "zmin"\n[damping]\ntime = "10 ms"\n'  # a swing aside, 9 a second, dies away in .1 s
                                             + run.replace("300 ms", "600 ms"), h, bodies=(out.out,))))
                rest, position = free.motion()
                off = np.linalg.norm(position - rest, axis=1).max() / (18 * h)
                trial.figure(f"{model}, {method}: {significant(off)} L off after release")
                require(off < 1e-2, f"it does not come back: {significant(off)} of its length off")
    with trial.peer("CalculiX") as on:
        if on:
            trial.peers.append(peers.ccx_twist(trial, (3, 3, 18), h, 1e6, 0.25, 720.0))


@case("snap-through", quick=False, peer="CalculiX",
      holds="a shallow arch under a growing load: past the limit it is found on the other side, at equilibrium and in time; led back and forth it has no more than one path",
      breaks="a Newton's method that cannot pass negative curvature, or that takes the unstable branch for an answer")
def snap(trial):
    h = 2e-3
    span, rise = 40 * h, 8 * h

    def arch(view, load, run, model="cells"):
        x = np.linspace(0, span, 41)
        z = 4 * rise * x * (span - x) / span**2
        part = strip(np.stack([x, z + 2 * h], 1), np.stack([x, z], 1), (0, 2 * h))
        scene = gum(view, 0.25) + f'[parts.arch]\nmodel = "{model}"\n[[fix]]\nwhere = ["{view.side("xmin")}", "{view.side("xmax")}"]\n'
        scene += f'[[load]]\nwhere = {view.box((span / 2 - 2 * h, -h, 0), (span / 2 + 3 * h, 3 * h, 1))}\nforce = {view.vector("force", (0, 0, -load))}\n'
        scene += 'COURSE'
        scene += f'[[probe]]\nname = "crown"\nat = {view.point((span / 2, h, rise + h))}\n' + run
        return Setup({"arch": part}, scene.replace("COURSE", 'time = ["0 ms", "100 ms"]\nfactor = [0, 1]\n[damping]\ntime = "0.3 ms"\n' if "time" in run else ""), h)

    load = 0.5  # a little beside the middle, so that rounding does not choose the way it leans
    still = {}
    for model in ("cells", "springs"):
        with trial.section(f"equilibrium, {model}"):
            out = battery(trial, lambda view: arch(view, load, "", model), units=1e-5, mirror=1e-4)
            still[model] = out.probe("crown")[2]
            require(still[model] < -1.2 * rise, f"it did not snap: {still[model]} m")
            if model == "cells":
                trial.figure(f"crown at {significant(still[model] / rise)} of its rise")
                trial.show(out)
    for model in ("cells", "springs"):
        outcomes = integrators(trial, lambda view, run: arch(view, load, run, model), "300 ms", "1 ms", f"{model}, ", energy=2e-3, units=1e-5, mirror=1e-4, explicit=False)
        for method, out in outcomes.items():
            with trial.section(f"{model}, {method}, the other side"):
                off = out.probe("crown")[2] / still[model] - 1
                require(abs(off) < 1e-2, f"crown {significant(100 * off)} % off that of equilibrium")
    with trial.peer("CalculiX") as on:
        if on:
            def bend(nodes):
                bent = nodes.copy()
                bent[:, 2] += 4 * rise * nodes[:, 0] * (span - nodes[:, 0]) / span**2
                return bent
            said, moved = peers.ccx_loaded(trial, (40, 2, 2), h, 1e6, 0.25, lambda x: (x[:, 0] < 1e-9) | (x[:, 0] > span - 1e-9), [],
                                           [(lambda x: np.abs(x[:, 0] - span / 2 - h / 2) < 2.6 * h, 3, -load)], (span / 2, h, rise + h), bend)
            trial.peers.append(f"CalculiX: {said or 'gets there'}" + ("" if moved is None else f", crown at {significant(moved[2] / rise)} of its rise"))


@case("a thin plate buckles", peer="CalculiX",
      holds="a strip 32 x 4 x 1 cells shortened to eight times its Euler load's shortening: the buckle's height within 5 % of the elastica's, at equilibrium and in time",
      breaks="an equilibrium that is not stable taken for the answer; thin cells that shear in place of bending")
def buckle(trial):
    h, count = 2e-3, 32
    length = count * h
    critical = 4 * np.pi**2 * h**2 / 12 / length
    short = 8 * critical

    def world(view, run, model="cells"):
        scene = gum(view, 0.0 if model == "cells" else 0.25, 1000, 100e6) + f'[parts.strip]\nmodel = "{model}"\n[[fix]]\nwhere = "{view.side("xmin")}"\n'
        scene += f'[[move]]\nwhere = "{view.side("xmax")}"\ndisplacement = {view.vector("length", (-short, 0, 0))}\nCOURSE'
        scene += f'[[load]]\nwhere = {view.box((length / 2 - h, -h, -h), (length / 2 + h, 5 * h, 2 * h))}\nforce = {view.vector("force", (0, 0, 2e-4))}\n'
        scene += ('[damping]\ntime = "0.1 ms"\n' if "time" in run else "") + f'[[probe]]\nname = "middle"\nat = {view.point((length / 2, 2 * h, h / 2))}\n' + run
        return Setup({"strip": grid_box((count, 4, 1), h)}, scene.replace("COURSE", 'time = ["0 ms", "40 ms"]\nfactor = [0, 1]\n' if "time" in run else ""), h)

    # w = a / 2 (1 - cos 2 pi x / L) shortens the middle line by pi^2 a^2 / (4 L) (1 + O(a/L)^2)
    expected = 2 / np.pi * np.sqrt(length * (short - critical))
    still = None
    with trial.section("equilibrium, cells"):
        out = battery(trial, lambda view: world(view, ""), units=1e-5, mirror=1e-4)
        still = out.probe("middle")[2]
        off = still / expected - 1
        trial.figure(f"height {significant(100 * off)} % off")
        require(abs(off) < 0.05, f"height {still} m, {expected} m expected")
        trial.show(out)
    with trial.section("equilibrium, springs"):
        battery(trial, lambda view: world(view, "", "springs"), units=1e-5, mirror=1e-4)
    if trial.quick:
        return
    outcomes = integrators(trial, world, "80 ms", "0.4 ms", energy=2e-3, units=1e-5, mirror=1e-4, explicit=False)
    for method, out in outcomes.items():
        with trial.section(f"{method}, height"):
            off = out.probe("middle")[2] / still - 1
            require(abs(off) < 0.02, f"height {significant(100 * off)} % off that of equilibrium")
    with trial.peer("CalculiX") as on:
        if on:
            said, moved = peers.ccx_loaded(trial, (count, 4, 1), h, 100e6, 0.0, lambda x: x[:, 0] < 1e-9,
                                           [(lambda x: x[:, 0] > length - 1e-9, 1, -short), (lambda x: x[:, 0] > length - 1e-9, 2, 0.0),
                                            (lambda x: x[:, 0] > length - 1e-9, 3, 0.0)],
                                           [(lambda x: np.abs(x[:, 0] - length / 2) < 1.1 * h, 3, 2e-4)], (length / 2, 2 * h, 0))
            trial.peers.append(f"CalculiX: {said or 'gets there'}" + ("" if moved is None else f", height {significant(100 * (moved[2] / expected - 1))} % off"))


def linked(kinds, motor=""):
    """Scene of rigid links along x, the first on the world, of `kinds` of joints; and the links."""
    h, length = 5e-3, 4
    parts = {f"link{n}": grid_box((length, 1, 1), h, ((length + 1) * n * h, 0, 0)) for n in range(len(kinds))}
    text = gum(PLAIN) + "".join(f"[parts.{name}]\nrigid = true\n" for name in parts)
    for n, kind in enumerate(kinds):
        names = f'["link{n}"]' if n == 0 else f'["link{n}", "link{n - 1}"]'
        at = f'["{1e3 * h * ((length + 1) * n - 0.5)} mm", "{1e3 * h / 2} mm", "{1e3 * h / 2} mm"]'
        text += f'[[joint]]\nkind = "{kind}"\nparts = {names}\nat = {at}\n' + ("" if kind == "ball" else "axis = [0, 1, 0]\n")
        text += motor if kind == "motor" else ""
    return parts, text, h


@case("a chain of five rigid links falls and whirls",
      holds="hinges and ball joints hold, the books close within 1e-3, and the bits do not depend on the number of threads",
      breaks="joints that drift apart, or take or give energy, as the last links crack like a whip")
def chain_of_joints(trial):
    parts, text, h = linked(("hinge", "ball", "hinge", "ball", "hinge"))
    run = '[gravity]\nacceleration = [0, 0, "-9.81 m/s2"]\n[run]\ntime = "1 s"\n'
    whirled = worked(same_bits(trial, lambda view: Setup(parts, text + run, h)))
    sound_state(whirled)
    trial.figure(f"books off by {significant(books(whirled))}")


@case("a motor drives a crank against its stop",
      holds="with a couple that does not suffice it stands still with that couple, and the books close",
      breaks="a drive that counts work which it does not do, or forces its way")
def stalled_motor(trial):
    # 0.125 g on an arm of 12.5 mm weighs 12e-6 N m to the side of its hinge; the motor lifts with less
    parts, text, h = linked(("motor",), 'angle_per_second = "-360 deg"\ntorque = "5e-6 N m"\n')
    run = '[gravity]\nacceleration = [0, 0, "-9.81 m/s2"]\n[run]\ntime = "2 s"\n'
    stalled = worked(same_bits(trial, lambda view: Setup(parts, text + run, h)))
    sound_state(stalled)
    trial.figure(f"books off by {significant(books(stalled))}")

"""Hard cases of time and scale: steps at their bound, stiffness that appears, damping, very many steps, very small, very large, very far away."""

import re
import struct

import numpy as np

import peers
from invariants import books, ends_well, integrators, momentum, refused, require, same_bits, sound_state, worked
from solids import bar, grid_box
from suite import case
from world import PLAIN, Setup, call, placement, significant, simulate


def gum(view, poisson=0.25, model="cells", part="bar"):
    return 'material = "gum"\n' + view.material("gum", 1e6, poisson, 1000) + f'[parts.{part}]\nmodel = "{model}"\n'


def struck(view, model, run, speed=0.05, h=1e-2, cells=(6, 3, 3)):
    """A free bar whose right third is given a speed: it stretches, bends and spins a little."""
    scene = gum(view, 0.25, model) + f'[[velocity]]\nwhere = {view.half_space((4.2 * h, 0, 0), (1, 0, 0))}\nvelocity = {view.vector("velocity", (speed, speed / 2, -speed))}\n'
    return Setup({"bar": grid_box(cells, h)}, scene + run, h, placement(model))


def bound(trial, setup):
    """The longest stable step that a refusal tells, in s."""
    out = trial.go(setup)
    message = refused(out, "longest stable")
    return float(re.search(r"is above (\S+) s", message).group(1))


@case("a step at the bound",
      peer="LAMMPS",
      holds="0.99 of the bound that the refusal tells: 20,000 steps (2,000 in the quick half), energy within 2 % and sound; 1.01 of it: refused with the bound; each model and integrator",
      breaks="a bound that is not safe, or that is asked of the shape at rest only; a refusal that rounds the bound up")
def at_the_bound(trial):
    count = 2000 if trial.quick else 20000
    for model in ("cells", "springs", "paper"):
        for method in ("symplectic", "verlet") if not trial.quick else ("symplectic",):
            with trial.section(f"{model}, {method}"):
                longest = bound(trial, struck(PLAIN, model, f'[run]\ntime = "10 s"\nstep = "9 s"\nmethod = "{method}"\n'))
                run = f'[run]\ntime = "{0.99 * longest * count!r} s"\nstep = "{0.99 * longest!r} s"\nmethod = "{method}"\n'
                out = worked(same_bits(trial, lambda view: struck(view, model, run, 0.005), (7,)))
                sound_state(out)
                ratio = books(out, 2e-2)
                momentum(out)
                # a bound that falls a little as the body swings takes the step to 0.9 of it
                require(0.98 * count <= out.steps <= 1.12 * count, f"{out.steps} steps in place of {count}")
                refused(trial.go(struck(PLAIN, model, f'[run]\ntime = "10 s"\nstep = "{1.01 * longest!r} s"\nmethod = "{method}"\n')), "longest stable")
                if method == "symplectic":
                    trial.figure(f"{model}: books {significant(ratio)} after {out.steps} steps")
                    if model == "cells":
                        trial.show(out, "--scale", "auto")
        if not trial.quick:
            with trial.section(f"{model}, explicit"):
                ends_well(trial.go(struck(PLAIN, model, f'[run]\ntime = "{0.99 * longest * 200!r} s"\nstep = "{0.99 * longest!r} s"\nmethod = "explicit"\n', 0.005)))
    with trial.peer("LAMMPS") as on:
        if on:
            longest = bound(trial, struck(PLAIN, "springs", '[run]\ntime = "10 s"\nstep = "9 s"\n'))
            trial.peers.append(peers.lammps_free(trial, struck(PLAIN, "springs", f'[run]\ntime = "{2000 * longest!r} s"\n', 0.005), 1e6, 1000, step=1.5 * longest)
                               + " at 1.5 of our bound")


@case("stiffness that appears mid-run",
      holds="cells made 100 times stiffer at half time, a block that meets a floor at half time, both at once: the step follows, books within 1 % (3 % where a floor is met: docs/reference/contact.md), the same in other units",
      breaks="a step chosen once; a bound that is looked at every hundred steps only")
def appearing(trial):
    h = 1e-2

    def world(view, run, edit=True, floor=False, factor=100.0):
        scene = gum(view) + f'[[velocity]]\nwhere = "bar"\nvelocity = {view.vector("velocity", (0, 0, -1.0))}\n'
        scene += f'[[velocity]]\nwhere = {view.half_space((4.2 * h, 0, 0), (1, 0, 0))}\nvelocity = {view.vector("velocity", (0.3, 0, 0.2))}\n'
        if edit:
            scene += f'[[event]]\nat = "10 ms"\ndo = "edit"\nwhere = {view.half_space((2 * h, 0, 0), (-1, 0, 0))}\nstiffness = {factor!r}\npositions = "rest"\n'
        if floor:
            scene += f'[[plane]]\npoint = {view.point((0, 0, -0.01))}\nnormal = [0, 0, 1]\n'
        return Setup({"bar": grid_box((6, 3, 3), h)}, scene + run, h)

    for name, edit, floor in (("edit", True, False), ("floor", False, True), ("both", True, True)):
        # implicit steps refuse contact (docs/reference/contact.md)
        outcomes = integrators(trial, lambda view, run: world(view, run, edit, floor), "30 ms", None if floor else "0.2 ms", f"{name}, ", energy=3e-2 if floor else 1e-2,
                               units=1e-6, mirror=1e-5, free=None)
        if "symplectic" in outcomes:
            out = outcomes["symplectic"]
            with trial.section(f"{name}, books"):
                trial.figure(f"{name}: books {significant(books(out, 1))}, step {significant(out.summary['timed']['step'] * 1e6)} us")
                trial.show(out)


@case("damping ratios up to 5",
      holds="a bar's slowest swing damped by tau omega / 2 = 0.1, 1 and 5: the decay of the damped oscillator within 5 %; 0.1 to 5 of the stiffest cell: energy only falls; momenta to 1e-9",
      breaks="dashpots taken explicitly beyond their bound; damping that brakes what flies")
def damping(trial):
    h, count = 1e-2, 12
    length = count * h
    # free-free bar, nu = 0: u = cos(pi x / L) e^(..), omega = pi / L sqrt(E / rho), of the lattice: 2 c / h sin(pi h / (2 L))
    omega = 2 * np.sqrt(1e6 / 1000) / h * np.sin(np.pi * h / (2 * length))
    stiffest = 2 * np.sqrt(1e6 / 1000) / h

    def world(view, run, tau):
        scene = 'material = "gum"\n' + view.material("gum", 1e6, 0.0, 1000) + f'[damping]\ntime = "{tau!r} s"\n'
        # the swing is begun by its velocities, slab by slab
        for n in range(count + 1):
            v = 0.02 * np.cos(np.pi * n / count)
            scene += f'[[velocity]]\nwhere = {view.box(((n - 0.5) * h, -h, -h), ((n + 0.5) * h, 3 * h, 3 * h))}\nvelocity = {view.vector("velocity", (v, 0, 0))}\n'
        scene += f'[[probe]]\nname = "end"\nat = {view.point((length, h, h))}\n'
        return Setup({"bar": grid_box((count, 2, 2), h)}, scene + run, h)

    for zeta in (1.0,) if trial.quick else (0.1, 1.0, 5.0):
        tau = 2 * zeta / omega
        span, step = 4 / omega * max(1, zeta), 0.05 / omega / max(1, 2 * zeta)  # the fast root of the overdamped ones wants steps too
        outcomes = integrators(trial, lambda view, run: world(view, run if "step" in run or "explicit" in run else run + f'step = "{step!r} s"\n', tau), f"{span * 1e3!r} ms", f"{step / 2 * 1e3!r} ms", f"zeta {zeta}, ", free=1e-9, units=1e-7)
        for method, out in outcomes.items():
            if out.code or method == "explicit":
                continue
            with trial.section(f"zeta {zeta}, {method}, decay"):
                t, x = out.history["time"], out.history["end x"]
                v0 = -0.02
                if zeta < 1:
                    wd = omega * np.sqrt(1 - zeta**2)
                    exact = v0 / wd * np.exp(-zeta * omega * t) * np.sin(wd * t)
                elif zeta == 1:
                    exact = v0 * t * np.exp(-omega * t)
                else:
                    root = omega * np.sqrt(zeta**2 - 1)
                    exact = v0 / (2 * root) * (np.exp((root - zeta * omega) * t) - np.exp((-root - zeta * omega) * t))
                off = np.abs(x - exact).max() / np.abs(exact).max()
                if method == "symplectic":
                    trial.figure(f"zeta {zeta}: {significant(100 * off)} % off")
                require(off < 0.05, f"{significant(100 * off)} % off the damped oscillator")
                energy = out.history["kinetic"] + out.history["elastic"]
                require(np.diff(energy).max() < 1e-3 * energy[0], "energy rises")
    for zeta in (5.0,) if trial.quick else (0.1, 1.0, 5.0):
        with trial.section(f"{zeta} of the stiffest cell"):
            run = '[run]\ntime = "20 ms"\n'
            out = worked(same_bits(trial, lambda view: world(view, run, 2 * zeta / stiffest), (7,)))
            sound_state(out)
            books(out, 2e-3)
            momentum(out)
            trial.show(out, "--scale", "auto")


@case("ten million steps", quick=False,
      holds="a free spinning, swinging body of two cells, 10 million steps: the energy's mean over the last tenth is that of the first within 1e-4, momenta to 1e-7",
      breaks="an integrator that is not symplectic in its bits; forces that depend on the path; rounding that drifts")
def ten_million(trial):
    long_oscillation(trial, 10_000_000)


@case("a hundred thousand steps", peer="LAMMPS", holds="the same in the quick half", breaks="the same")
def many_steps(trial):
    long_oscillation(trial, 100_000)
    with trial.peer("LAMMPS") as on:
        if on:
            trial.peers.append(peers.lammps_free(trial, oscillation(PLAIN, "springs", "verlet", 1_000_000), 1e6, 1000) + " (a million steps)")


def oscillation(view, model, method, count):
    h = 1e-2
    step = 1e-4
    scene = gum(view, 0.25, model) + f'[[velocity]]\nwhere = {view.half_space((1.5 * h, 0, 0), (1, 0, 0))}\nvelocity = {view.vector("velocity", (0.1, 0.05, -0.1))}\n'
    return Setup({"bar": bar((2, 1, 1), h)}, scene + f'[run]\ntime = "{count * step!r} s"\nstep = "{step!r} s"\nmethod = "{method}"\n', h)


def long_oscillation(trial, count):
    for model in ("cells", "springs"):
        for method in ("symplectic", "verlet"):
            with trial.section(f"{model}, {method}"):
                out = worked(trial.go(oscillation(PLAIN, model, method, count)))
                sound_state(out)
                require(out.steps >= count, f"{out.steps} steps")
                energy = out.history["kinetic"] + out.history["elastic"]
                tenth = len(energy) // 10
                drift = energy[-tenth:].mean() / energy[:tenth].mean() - 1
                kept = momentum(out, 1e-7)
                trial.figure(f"{model}, {method}: energy {significant(drift)}, momenta {significant(kept)}")
                if model == "cells" and method == "symplectic":
                    trial.plot = (out.history["time"], energy / energy[0], "time [s]", "energy / energy at the start")
                require(abs(drift) < 1e-4, f"energy drifts by {significant(drift)}")


@case("nanometres and kilometres",
      holds="one bar of 60 nm, 60 mm and 60 km under the same stress: the same displacement over size to 1e-9, at equilibrium and in time (times over size)",
      breaks="absolute tolerances; lengths printed and read again in mm; a square that underflows", peer="CalculiX")
def sizes(trial):
    def world(size, view, run, model):
        h = 1e-2 * size
        scene = gum(view, 0.25, model) + f'[[fix]]\nwhere = "{view.side("xmin")}"\n[[load]]\nwhere = "{view.side("xmax")}"\n'
        scene += f'force = {view.vector("force", (0.05 * size**2, 0, -0.05 * size**2))}\n[[probe]]\nname = "end"\nwhere = "{view.side("xmax")}"\n'
        return Setup({"bar": grid_box((6, 2, 2), h)}, scene + run, h)

    worst = {}
    for model in ("cells", "springs"):
        runs = [("equilibrium", lambda size: "")]
        for method in ("symplectic", "implicit") if trial.quick else ("symplectic", "verlet", "implicit"):
            step = "step = \"{:.17g} s\"\n" if method == "implicit" else ""
            runs.append((method, lambda size, method=method, step=step: f'[run]\ntime = "{0.02 * size!r} s"\nmethod = "{method}"\n' + step.format(5e-4 * size)))
        for name, run in runs:
            with trial.section(f"{model}, {name}"):
                middle = worked(trial.go(world(1.0, PLAIN, run(1.0), model)))
                rest, position = middle.motion()
                moved = np.abs(position - rest).max()
                for label, size in (("nm", 1e-6), ("km", 1e6)):
                    out = worked(trial.go(world(size, PLAIN, run(size), model)))
                    sound_state(out)
                    there, here = out.motion()
                    off = np.abs((here - there) / size - (position - rest)).max() / moved
                    tolerance = 1e-9 if name in ("symplectic", "verlet") else 1e-7
                    worst[name] = max(worst.get(name, 0.0), off)
                    require(off < tolerance, f"{label}: {significant(off)} of the displacement off")
                if model == "cells" and name == "equilibrium":
                    trial.show(middle)
    for name, off in worst.items():
        trial.figure(f"{name}: {significant(off)} of the displacement apart")
    with trial.peer("CalculiX") as on:
        if on:
            for label, size in (("60 nm", 1e-6), ("60 km", 1e6)):
                length, side = 6e-2 * size, 2e-2 * size
                beam = 0.05 * size**2 * length**3 / (3 * 1e6 * side**4 / 12) + 0.05 * size**2 * length / (5 / 6 * 1e6 / 2.5 * side**2)
                trial.peers.append(f"{label}: " + peers.ccx_cantilever(trial, (6, 2, 2), 1e-2 * size, 1e6, 0.25, 0.05 * size**2, beam))


@case("a million diagonals from the origin",
      holds="a part 1e6 diagonals away in double precision (PLY, OBJ, ASCII STL): moves as the centred one to 1e-6; as a binary STL, whose floats are coarser than h/100: refused",
      breaks="differences of large coordinates; float on the way; lattices laid from the origin")
def far(trial):
    h, cells = 1e-2, (6, 2, 2)
    diagonal = h * np.sqrt(44)
    away = 1e6 * diagonal * np.array([0.6, -0.64, 0.48])

    def scene(at, run):
        view = PLAIN
        text = gum(view) + f'[[fix]]\nwhere = "xmin"\n[[load]]\nwhere = "xmax"\nforce = {view.vector("force", (0.05, 0, -0.05))}\n'
        return text + f'[[probe]]\nname = "end"\nat = {view.point(np.array([6 * h, h, h]) + at)}\n' + run

    def ply(triangles, kind="double"):
        flat = np.asarray(triangles).reshape(-1, 3) * 1e3
        head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(flat)}\nproperty {kind} x\nproperty {kind} y\nproperty {kind} z\n"
        head += f"element face {len(flat) // 3}\nproperty list uchar int vertex_indices\nend_header\n"
        faces = b"".join(struct.pack("<B3i", 3, 3 * n, 3 * n + 1, 3 * n + 2) for n in range(len(flat) // 3))
        return head.encode() + flat.astype("<f8" if kind == "double" else "<f4").tobytes() + faces

    def obj(triangles):
        flat = np.asarray(triangles).reshape(-1, 3) * 1e3
        lines = ["v " + " ".join(map(repr, v)) for v in flat.tolist()]
        lines += [f"f {3 * n + 1} {3 * n + 2} {3 * n + 3}" for n in range(len(flat) // 3)]
        return ("\n".join(lines) + "\n").encode()

    def stl(triangles):
        data = b"far".ljust(80) + struct.pack("<I", len(triangles))
        for triangle in np.asarray(triangles) * 1e3:
            data += struct.pack("<12fH", 0, 0, 0, *triangle.ravel(), 0)
        return data

    triangles = grid_box(cells, h)

    def run(name, data, at, text):
        folder = trial.folder / f"{name.replace('.', '-')}-{len(list(trial.folder.iterdir()))}"
        folder.mkdir()
        (folder / ("bar." + name.rsplit(".")[-1])).write_bytes(data)
        code, err = call("flexel-voxelize", "bar." + name.rsplit(".")[-1], "--size", "10 mm", "--unit", "mm", "--align", "none", "-o", "body.vtu", cwd=folder)
        if code:
            from world import Outcome
            return Outcome(folder, PLAIN, code, err)
        return simulate(Setup({}, scene(at, text), h, bodies=(folder / "body.vtu",)), PLAIN, folder / "run")

    texts = {"equilibrium": "", "symplectic": '[run]\ntime = "20 ms"\n', "implicit": '[run]\ntime = "20 ms"\nstep = "0.5 ms"\nmethod = "implicit"\n'}
    for name, text in texts.items():
        centred = worked(run("near.ply", ply(triangles), np.zeros(3), text))
        for kind, writer in (("ply", ply), ("obj", obj), ("stl", lambda t: PLAIN.stl("bar", t).encode())):
            with trial.section(f"{name}, {kind}"):
                out = worked(run(f"far.{kind}", writer(triangles + away), away, text))
                sound_state(out)
                books(out, 1e-3) if "timed" in out.summary else None
                off = np.abs(out.probe("end") - centred.probe("end")).max() / np.abs(centred.probe("end")).max()
                rest, position = out.motion()
                near_rest, near = centred.motion()
                if kind == "ply":
                    trial.figure(f"{name}: {significant(off)}")
                    if name == "equilibrium":
                        trial.show(out, "--scale", "auto")
                require(off < 1e-6, f"{significant(off)} of the displacement off the centred one")
                code, err = call("flexel-map", out.out, "-o", out.folder / "far.ply", "--strict")
                require(code == 0, f"the mapping is refused: {err.strip()[-200:]}")
    with trial.section("binary STL"):
        out = run("far-float.stl", stl(triangles + away), away, "")
        refused(out, "resolution")
    with trial.section("float PLY"):
        out = run("far-float.ply", ply(triangles + away, "float"), away, "")
        refused(out, "resolution")
    with trial.section("binary STL, near"):
        worked(run("near.stl", stl(triangles), np.zeros(3), ""))


@case("next to no time",
      holds="runs of 1e-30 s, 1e-15 s, half a step and exactly one step: done, the body where its velocity takes it",
      breaks="a number of steps that rounds to none; a step divided by it")
def next_to_no_time(trial):
    h = 1e-2

    def world(view, run, model="cells"):
        return Setup({"bar": grid_box((2, 2, 2), h)}, gum(view, 0.25, model) + f'[[velocity]]\nwhere = "bar"\nvelocity = {view.vector("velocity", (1, 0, 0))}\n' + run, h,
                     placement(model))

    for model in ("cells", "springs", "paper"):
        longest = bound(trial, world(PLAIN, '[run]\ntime = "10 s"\nstep = "9 s"\n', model))
        for name, time in (("1e-30 s", 1e-30), ("1e-15 s", 1e-15), ("half a step", longest / 2), ("a step", 0.9 * longest)):
            for method in ("symplectic",) if trial.quick else ("symplectic", "verlet", "explicit", "implicit"):
                if method == "implicit" and model == "paper":
                    continue
                with trial.section(f"{model}, {name}, {method}"):
                    out = worked(trial.go(world(PLAIN, f'[run]\ntime = "{time!r} s"\nmethod = "{method}"\n', model)))
                    sound_state(out)
                    moved = out.summary["largest_displacement"]
                    # a body thrown evenly: v t, to the rounding of its coordinates
                    require(abs(moved - time) <= 1e-6 * time + 1e-17, f"moved by {moved} m in {time} s at 1 m/s")
    trial.figure("runs of 1e-30 s to one step")

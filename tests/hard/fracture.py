"""Hard cases of matter that goes: broken all at once, to dust, inside out, carved away."""

import json

import numpy as np

from invariants import battery, books, ends_well, momentum, refused, require, same_bits, sound_state, worked
from solids import grid_box
from suite import case
from world import PLAIN, Setup, call, edited, significant

H = 1e-2


def glass(view, model, strength, part="bar", **more):
    return ('material = "glass"\n' + view.material("glass", 1e6, 0.25, 1000, strength=strength, **more) + f'[parts.{part}]\nmodel = "{model}"\n')


def stretched(trial, model, share, cells=(8, 3, 3)):
    """A body file of a bar stretched evenly by `share`."""
    scene = 'material = "glass"\n' + PLAIN.material("glass", 1e6, 0.25, 1000) + f'[parts.bar]\nmodel = "{model}"\n[run]\ntime = "1e-6 ms"\n'
    base = worked(trial.go(Setup({"bar": grid_box(cells, H)}, scene, H)))

    def stretch(arrays):
        arrays["position"][:, 0] = arrays["rest"][:, 0] * (1 + share)
    return edited(base.folder / "body.vtu", trial.folder / f"stretched-{model}-{share}.vtu", stretch)


def broken_share(out):
    arrays = out.arrays()
    return arrays["cell/broken"].mean()


@case("all of its energy at once",
      holds="a bar stretched evenly past its strength breaks everywhere in one step: its energy is booked as the fracture's within 0.1 %, debris flies on, momenta to 1e-9",
      breaks="energy looked up after the crack; a step bound without a single whole cell")
def at_once(trial):
    for model in ("cells", "springs"):
        # by half, springs of every direction but across are past their length
        body = stretched(trial, model, 0.2 if model == "cells" else 0.5)
        for method in ("symplectic",) if trial.quick else ("symplectic", "verlet", "explicit"):
            with trial.section(f"{model}, {method}"):
                scene = glass(PLAIN, model, 0.1e6) + f'[fracture]\n[run]\ntime = "20 ms"\nmethod = "{method}"\n'
                out = same_bits(trial, lambda view: Setup({}, scene, H, bodies=(body,)))
                if method == "explicit":
                    ends_well(out)
                    continue
                worked(out)
                sound_state(out)
                ratio = books(out)
                kept = momentum(out)
                share = broken_share(out)
                trial.figure(f"{model}: {significant(100 * share)} % of the cells broke, books {significant(ratio)}, momenta {significant(kept)}")
                require(share == 1, f"{significant(100 * share)} % of the cells broke")
                if model == "cells":
                    trial.show(out, "--elements")
    with trial.section("implicit"):
        refused(trial.go(Setup({}, glass(PLAIN, "cells", 0.1e6) + '[fracture]\n[run]\ntime = "20 ms"\nmethod = "implicit"\n', H, bodies=(body,))), "implicit")


@case("a part that turns to dust",
      holds="a brittle block thrown at a floor at its speed of sound: every cell may break, books within 1 %, the debris is mapped as it is, opened and capped, or dropped with a word",
      breaks="pieces of one element; a mapping without a single frame; a surface that is nothing but cracks")
def dust(trial):
    def world(view, run, model):
        scene = glass(view, model, 2e3) + f'[fracture]\n[[plane]]\npoint = {view.point((0, 0, -1e-3))}\nnormal = [0, 0, 1]\n[[velocity]]\nwhere = "bar"\n'
        return Setup({"bar": grid_box((3, 2, 3), H)}, scene + f'velocity = {view.vector("velocity", (0.5, 0.3, -20))}\n' + run, H)

    for model in ("cells", "springs"):
        with trial.section(f"{model}, thrown"):
            run = '[run]\ntime = "10 ms"\n'
            out = ends_well(same_bits(trial, lambda view: world(view, run, model), (7,)))
            trial.figure(f"{model}, thrown: " + ("stops" if out.code else f"{significant(100 * broken_share(out))} % broken, books {significant(books(out, 1))}"))
            if out.code == 0:
                books(out, 2e-2)
    for model in ("cells", "springs"):
        body = stretched(trial, model, 0.2 if model == "cells" else 0.5, (3, 3, 3))
        scene = glass(PLAIN, model, 0.1e6) + '[fracture]\n[[velocity]]\nwhere = "bar"\n' + f'spin = {PLAIN.spin((1, 2, 3), (0.015, 0.015, 0.015), 3600.0)}\n'
        with trial.section(f"{model}, dust"):
            out = worked(same_bits(trial, lambda view: Setup({}, scene + '[run]\ntime = "20 ms"\n', H, bodies=(body,))))
            require(broken_share(out) == 1, "not all of it broke")
            books(out)
            momentum(out)
            trial.show(out, "--elements")
            for crack in ("keep", "open", "cap"):
                report = out.folder / f"{crack}.json"
                code, err = call("flexel-map", out.out, "--crack", crack, "-o", out.folder / f"{crack}.ply", "--report", report, "--quiet")
                require(code == 0, f"--crack {crack}: exit {code}: {err.strip()[-200:]}")
                if crack == "cap":
                    pieces = json.loads(report.read_text())["crack"]["pieces"]
                    volume = sum(p["volume_before"] for p in pieces)
                    trial.figure(f"{len(pieces)} pieces, their volume {significant(volume / 27e-6 - 1)} off")
                    require(len(pieces) == 64 and abs(volume / 27e-6 - 1) < 1e-6, f"{len(pieces)} pieces of {volume} m^3")
            code, err = call("flexel-map", out.out, "--crack", "cap", "--debris", "drop", "-o", out.folder / "dropped.ply")
            require(code == 2 and ": error: " in err, f"nothing but debris dropped: exit {code}: {err.strip()[-200:]}")
        with trial.section(f"{model}, dust goes on"):
            more = worked(trial.go(Setup({}, scene.split("[[velocity]]")[0] + '[run]\ntime = "20 ms"\n', H, bodies=(out.out,))))
            sound_state(more)
        with trial.section(f"{model}, dust at equilibrium"):
            held = 'material = "glass"\n' + PLAIN.material("glass", 1e6, 0.25, 1000) + f'[parts.bar]\nmodel = "{model}"\n[[fix]]\nwhere = {PLAIN.half_space((0, 0, H / 2), (0, 0, -1))}\n'
            held += f'[gravity]\nacceleration = {PLAIN.vector("acceleration", (0, 0, -9.81))}\n'
            refused(trial.go(Setup({}, held, H, bodies=(out.out,))))


@case("renormalising an inverted cell", holds="a body with a cell that is inside out: renormalising it is refused, with the cell's place and the last good state on disk",
      breaks="a rest shape of negative volume")
def renormalise(trial):
    def invert(arrays):
        rest = arrays["rest"]
        corner = np.argmin(np.linalg.norm(rest - rest.min(0), axis=1))
        arrays["position"][corner] = rest[corner] + 2.5 * H

    for model in ("cells", "springs", "paper"):
        options = ("--placement", "centre", "--align", "none") if model == "paper" else ("--align", "none")
        head = 'material = "glass"\n' + PLAIN.material("glass", 1e6, 0.25, 1000) + f'[parts.bar]\nmodel = "{model}"\n'
        base = worked(trial.go(Setup({"bar": grid_box((3, 3, 3), H)}, head + '[run]\ntime = "1e-6 ms"\n', H, options)))
        body = edited(base.folder / "body.vtu", trial.folder / f"inverted-{model}.vtu", invert)
        with trial.section(model):
            out = same_bits(trial, lambda view: Setup({}, head + '[[event]]\nat = "0 ms"\ndo = "renormalise"\n[run]\ntime = "5 ms"\n', H, bodies=(body,)), (7,))
            if model == "cells":
                trial.show(body, "--cells")
            require(out.code == 3, f"exit {out.code}: {out.err.strip()[-300:]}")
            require("inside out" in out.error and "near (" in out.error, f"no word or place: {out.error}")
            require(not out.out.exists(), "a result under the output's name")
            trial.figure(f"{model}: exit 3")


@case("all of a part carved away", holds="everything carved, in one event, in several, of one part of two: ends (exit 2 before the first step, else 3 with the state before it) with the event; all but one cell: goes on",
      breaks="a part without elements; a step bound over nothing")
def carved(trial):
    def world(view, events, two=False):
        parts = {"bar": grid_box((4, 2, 2), H)}
        if two:
            parts["other"] = grid_box((2, 2, 2), H, (0, 0, 5 * H))
        return Setup(parts, 'material = "glass"\n' + view.material("glass", 1e6, 0.25, 1000) + events + '[run]\ntime = "10 ms"\n', H)

    def event(view, where, at="1 ms"):
        return f'[[event]]\nat = "{at}"\ndo = "carve"\nwhere = {where}\n'

    for model in ("cells", "springs"):
        head = f'[parts.bar]\nmodel = "{model}"\n'
        for name, events, two in (
                ("at once", event(PLAIN, '"bar"'), False),
                ("in two", event(PLAIN, PLAIN.half_space((2 * H, 0, 0), (-1, 0, 0))) + event(PLAIN, PLAIN.half_space((1.5 * H, 0, 0), (1, 0, 0)), "2 ms"), False),
                ("at 0", event(PLAIN, '"bar"', "0 ms"), False),
                ("one of two parts", event(PLAIN, '"bar"'), True)):
            with trial.section(f"{model}, {name}"):
                out = trial.go(world(PLAIN, head + events, two))
                if name == "at 0":
                    trial.figure(refused(out, "carve").split("error: ")[-1])
                else:
                    require(out.code == 3 and "carve leaves nothing" in out.error and not out.out.exists(), f"exit {out.code}: {out.err.strip()[-300:]}")
                    sound_state(out, out.failed)
                    trial.figure(out.error[out.error.index("scene.toml"):].split("; the state")[0])
        with trial.section(f"{model}, all but a cell"):
            def leave(view):
                return world(view, head + event(view, view.box((0.5 * H, -H, -H), (5 * H, 3 * H, 3 * H))) + event(view, view.box((-H, 0.5 * H, -H), (5 * H, 3 * H, 3 * H)))
                             + event(view, view.half_space((0, 0, 0.5 * H), (0, 0, 1))))
            out = battery(trial, leave, mirror=None)
            left = len(out.arrays()["cell/broken"])
            require(left == 1, f"{left} cells left")
            trial.show(out, "--cells")

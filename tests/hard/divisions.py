"""Hard cases of division: distances, speeds, masses and determinants of exactly zero."""

import json

import numpy as np

import peers
from invariants import ends_well, integrators, momentum, refused, require, same_bits, sound_state, worked
from solids import bar, grid_box
from suite import case
from world import CENTRE, MIRRORED, PLAIN, Setup, call, edited, placement, significant


def gum(view, poisson=0.25, model="cells", part="bar"):
    return 'material = "gum"\n' + view.material("gum", 1e6, poisson, 1000) + f'[parts.{part}]\nmodel = "{model}"\n'


@case("coincident elements",
      holds="two bars of 3 and 4 cells whose elements coincide to the bit, with mutual gravity and contact: finite, symmetric, momenta kept; or refused with the reason; one bar twice is refused",
      breaks="a direction divided by a distance of zero")
def coincident(trial):
    h = 1e-2

    def world(view, run, model, more):
        scene = 'bond = false\nmaterial = "gum"\n' + more + view.material("gum", 1e6, 0.25, 1000)
        scene += "".join(f'[parts.{p}]\nmodel = "{model}"\n' for p in ("one", "two"))
        return Setup({"one": grid_box((3, 2, 2), h), "two": grid_box((4, 2, 2), h)}, scene + run, h, placement(model))

    draw = '[gravity]\nmutual = true\nconstant = "1e-3 m3/kg/s2"\n'
    for model in ("cells", "springs", "paper"):
        with trial.section(f"gravity, {model}"):
            out = worked(same_bits(trial, lambda view: world(view, '[run]\ntime = "10 ms"\n', model, draw)))
            sound_state(out)
            momentum(out)
            arrays = out.arrays()
            one, two = (arrays["point/rest"][arrays["point/part"] == p] for p in (0, 1))
            shared = sum((two == element).all(axis=1).any() for element in one)
            trial.figure(f"{model}: {shared} elements coincide")
            if model == "cells":
                trial.show(out)
            require(shared == len(one), f"{shared} of {len(one)} elements coincide")
        with trial.section(f"contact, {model}"):
            out = same_bits(trial, lambda view: world(view, '[run]\ntime = "10 ms"\n', model, "[contact]\nfriction = 0.3\n"), (7,))
            if out.code == 2:
                trial.figure(f"{model}, contact: refused")
                refused(out, "overlap")
            else:
                ends_well(out)
                trial.figure(f"{model}, contact: " + ("stops" if out.code else "holds"))
    with trial.section("one bar twice"):
        twice = world(PLAIN, '[run]\ntime = "10 ms"\n', "cells", draw)
        twice.parts["two"] = twice.parts["one"]
        refused(trial.go(twice), "one body twice")
    with trial.section("bonded, equilibrium"):
        def bonded(view):
            scene = 'material = "gum"\n' + view.material("gum", 1e6, 0.25, 1000) + f'[[fix]]\nwhere = "{view.side("one/xmin")}"\n[[fix]]\nwhere = "{view.side("two/xmin")}"\n'
            scene += f'[[load]]\nwhere = "{view.side("one/xmax")}"\nforce = {view.vector("force", (0.01, 0, 0))}\n'
            return Setup({"one": grid_box((3, 2, 2), h), "two": grid_box((4, 2, 2), h)}, scene, h)
        sound_state(worked(same_bits(trial, bonded)))


@case("zero relative velocity",
      holds="friction between blocks that do not move against each other, drag on a body at rest, damping of a rigid motion: no force, to 1e-12 of what a slip would bring; starting from exactly 0",
      breaks="v / |v|")
def zero_velocity(trial):
    h = 1e-2

    def together(view, run):
        scene = gum(view, part="low") + '[contact]\nfriction = 0.5\n[damping]\ntime = "0.1 ms"\n'
        for part in ("low", "high"):
            scene += f'[[velocity]]\nwhere = "{part}"\nvelocity = {view.vector("velocity", (0.3, 0.2, 0.1))}\n'
        return Setup({"low": grid_box((3, 3, 2), h), "high": grid_box((2, 2, 2), h, (0.5 * h, 0.5 * h, 2 * h))}, scene + run, h)

    def still(view, run, model):
        return Setup({"bar": grid_box((3, 2, 2), h)}, gum(view, model=model) + '[drag]\ndensity = "1.2 kg/m3"\n[damping]\ntime = "0.1 ms"\n' + run, h, placement(model))

    # no mirrored view: what differs is rounding's alone
    outcomes = integrators(trial, together, "20 ms", None, "friction, ", energy=None, free=1e-12, units=None, mirror=None)
    for method, out in outcomes.items():
        with trial.section(f"friction, {method}, no slip"):
            spread = np.ptp(out.arrays()["point/velocity"], axis=0).max()
            trial.show(out)
            trial.figure(f"friction: speeds spread by {significant(spread)} m/s")
            require(spread < 1e-9, f"speeds spread by {spread} m/s")
    for model in ("cells", "springs", "paper"):
        outcomes = integrators(trial, lambda view, run: still(view, run, model), "20 ms", "1 ms" if model != "paper" else None, f"drag, {model}, ", energy=None, units=None, mirror=None)
        for method, out in outcomes.items():
            with trial.section(f"drag, {model}, {method}, still"):
                require(out.summary["largest_displacement"] == 0, f"moved by {out.summary['largest_displacement']} m")


@case("zero mass", holds="a density of 0, an edit to a density of 0, a fill of 0 in the body file: refused, with the key",
      breaks="a force divided by a mass of zero")
def zero_mass(trial):
    h = 1e-2

    def world(density=1000.0, more=""):
        return Setup({"bar": bar((3, 2, 2), h)}, 'material = "gum"\n' + PLAIN.material("gum", 1e6, 0.25, density) + more + '[run]\ntime = "5 ms"\n', h)

    with trial.section("density 0"):
        trial.figure(refused(trial.go(world(0.0)), "density").split(": error: ")[-1])
    for name, key in (("edit to 0", "density = 0"), ("edit to less", "density = -1")):
        with trial.section(name):
            refused(trial.go(world(more=f'[[event]]\nat = "1 ms"\ndo = "edit"\n{key}\n')), "density")
    with trial.section("fill 0"):
        sound = worked(trial.go(world()))
        path = edited(sound.folder / "body.vtu", trial.folder / "empty.vtu", lambda a: a["fill"].__setitem__(slice(0, 4), 0.0))
        refused(trial.go(Setup({}, world().scene.replace("bar", "bar"), h, bodies=(path,))), "fill")


@case("connections of zero length",
      peer="LAMMPS",
      holds="two neighbours of a lattice of springs begin at one place, and all of a body does: finite, momenta kept, or the run stops as it should (cells: at once)",
      breaks="(d - l) d / |d| at |d| = 0")
def zero_length(trial):
    h = 1e-2

    def pinch(arrays):
        rest = arrays["rest"]
        one = np.argmin(np.linalg.norm(rest - rest.min(0), axis=1))
        gap = np.linalg.norm(rest - rest[one], axis=1)
        gap[one] = np.inf
        arrays["position"][one] = arrays["position"][np.argmin(gap)]

    def collapse(arrays):
        arrays["position"][:] = arrays["position"].mean(axis=0)

    for model in ("springs", "paper", "cells"):
        base = worked(trial.go(Setup({"bar": grid_box((3, 3, 3), h)}, gum(PLAIN, model=model) + '[run]\ntime = "1e-6 ms"\n', h, placement(model))))
        for name, change in (("two at one place", pinch), ("all at one place", collapse)):
            path = edited(base.folder / "body.vtu", trial.folder / f"{model}-{name.split()[0]}.vtu", change)
            integrations = ("symplectic", "implicit") if model != "paper" else ("symplectic",)
            for method in integrations + (() if trial.quick else ("verlet", "explicit")):
                with trial.section(f"{name}, {model}, {method}"):
                    run = f'[run]\ntime = "20 ms"\nmethod = "{method}"\n' + ('step = "0.2 ms"\n' if method == "implicit" else "")
                    out = same_bits(trial, lambda view: Setup({}, gum(PLAIN, model=model) + run, h, bodies=(path,)), (7,))
                    if out.code == 2:
                        trial.figure(f"{model}, {name}, {method}: refused")
                        require("inside out" in out.error or "flat" in out.error or "volume" in out.error, f"refused with: {out.error}")
                        continue
                    if out.code == 3 and not out.failed.exists():
                        trial.figure(f"{model}, {name}, {method}: stops at the start")
                        require("start" in out.error or "step 0" in out.error or "begin" in out.error, f"no word on the start: {out.error}")
                        continue
                    ends_well(out)
                    if name.startswith("two") and model == "cells":
                        trial.show(path, "--cells")
                    trial.figure(f"{model}, {name}, {method}: " + ("stops" if out.code else "holds"))
                    if out.code == 0 and method in ("symplectic", "verlet"):
                        momentum(out)
            with trial.section(f"{name}, {model}, equilibrium"):
                scene = gum(PLAIN, model=model) + f'[[fix]]\nwhere = {PLAIN.half_space((h, 0, 0), (-1, 0, 0))}\n[[load]]\nwhere = {PLAIN.half_space((2.4 * h, 0, 0), (1, 0, 0))}\n'
                scene += f'force = {PLAIN.vector("force", (0.001, 0, 0))}\n'
                out = trial.go(Setup({}, scene, h, bodies=(path,)))
                ends_well(out, timed=False) if out.code != 2 else None
    with trial.peer("LAMMPS") as on:
        if on:
            path = trial.folder / "springs-all.vtu"
            trial.peers.append("all at one place: " + peers.lammps_free(trial, Setup({}, gum(PLAIN, model="springs") + '[run]\ntime = "20 ms"\nmethod = "verlet"\n', h, bodies=(path,)),
                                                                        1e6, 1000))


def mapped(trial, body, *options):
    """flexel-map's exit code, its report and the vertices of the OBJ that comes out."""
    count = len(list(trial.folder.glob("map-*")))
    folder = trial.folder / f"map-{count}"
    folder.mkdir()
    code, err = call("flexel-map", body, "-o", folder / "out.obj", "--report", folder / "report.json", "--quiet", *options)
    report = json.loads((folder / "report.json").read_text()) if (folder / "report.json").exists() else {}
    vertices = np.array([[float(w) for w in line.split()[1:4]] for line in (folder / "out.obj").read_text().splitlines() if line.startswith("v ")]) if code == 0 else None
    return code, err, report, vertices


@case("collinear and coplanar frames",
      holds="a row, a sheet and a single element (centre placement), and corners pressed onto a plane, a line, a point: every vertex finite; plane, line, rigid frames or degenerate ones counted",
      breaks="a base divided by its determinant; a third axis of length zero")
def flat_frames(trial):
    h = 1e-2
    for name, cells in (("row", (5, 1, 1)), ("sheet", (5, 4, 1)), ("single", (1, 1, 1))):
        with trial.section(f"centre, {name}"):
            folder = trial.folder / name
            folder.mkdir()
            (folder / "bar.stl").write_text(PLAIN.stl("bar", grid_box(cells, h)))
            code, err = call("flexel-voxelize", "bar.stl", "--size", "10 mm", "--unit", "mm", *CENTRE, "-o", "body.vtu", "--quiet", cwd=folder)
            require(code == 0, err)

            def shift(arrays):
                arrays["position"][:] = arrays["rest"] * 1.1 + [0.01, 0.02, 0.03]
            path = edited(folder / "body.vtu", folder / "moved.vtu", shift)
            for method in ("blended", "smooth", "affine", "gram-schmidt"):
                code, err, report, vertices = mapped(trial, path, "--method", method)
                require(code == 0, f"{method}: exit {code}: {err.strip()[-200:]}")
                require(np.isfinite(vertices).all(), f"{method}: vertices that are no numbers")
                kinds = {k: v for k, v in report["frames"].items() if k in ("plane", "line", "rigid") and v}
            trial.figure(f"{name}: {', '.join(f'{v} {k}' for k, v in kinds.items())}")
            require(kinds and "full" not in kinds, f"frames {report['frames']}")
    folder = trial.folder / "corner"
    folder.mkdir()
    (folder / "bar.stl").write_text(PLAIN.stl("bar", grid_box((3, 3, 3), h)))
    code, err = call("flexel-voxelize", "bar.stl", "--size", "10 mm", "--unit", "mm", "--align", "none", "-o", "body.vtu", "--quiet", cwd=folder)
    for name, scale in (("plane", (1, 1, 0)), ("line", (1, 0, 0)), ("point", (0, 0, 0))):
        for method in ("blended", "smooth", "affine", "gram-schmidt"):
            with trial.section(f"pressed onto a {name}, {method}"):
                path = edited(folder / "body.vtu", folder / f"{name}.vtu", lambda a, scale=scale: a["position"].__setitem__(slice(None), a["rest"] * np.array(scale)))
                code, err, report, vertices = mapped(trial, path, "--method", method)
                require(code in (0, 4), f"exit {code}: {err.strip()[-200:]}")
                if code == 0:
                    require(np.isfinite(vertices).all(), "vertices that are no numbers")
                if name == "plane":
                    trial.show(path)
                require(report["failures"]["degenerate"] == report["vertices"], f"{report['failures']} of {report['vertices']} vertices")
                code, *_ = mapped(trial, path, "--method", method, "--strict")
                require(code == 4, f"--strict lets it through with exit {code}")


@case("a vertex on a Voronoi boundary",
      holds="vertices exactly half way between two, four and eight elements: the same choice and bits at 1, 2 and 7 threads, for any order of the vertices, and the mirrored part mapped to the mirror image",
      breaks="ties that rounding or the order of a list decides")
def voronoi(trial):
    h = 1e-2

    def world(view, order=1):
        triangles = grid_box((4, 4, 4), h / 2)[::order]  # vertices at corners, middles of edges and of faces of 2^3 cells
        scene = gum(view) + f'[[fix]]\nwhere = "zmin"\n[[load]]\nwhere = "zmax"\nforce = {view.vector("force", (0.5, 0.2, 0.1))}\n'
        return Setup({"bar": triangles}, scene, h)

    with trial.section("threads"):
        out = worked(same_bits(trial, world))
        sound_state(out)
        trial.show(out)
        for method in ("blended", "smooth", "affine", "gram-schmidt"):
            found = []
            for threads in (1, 2, 7):
                code, err, report, vertices = mapped(trial, out.out, "--method", method, "--threads", threads)
                require(code == 0, f"{method}: {err.strip()[-200:]}")
                found.append(vertices)
            require(all((v == found[0]).all() for v in found), f"{method}: other bits with other threads")

    def by_rest(view, order, method):
        """Vertices of the mapped surface, unmirrored, in the order of where they rest."""
        out = worked(trial.go(world(view, order), view))
        _, _, _, rest = mapped(trial, out.folder / "body.vtu", "--method", method)
        _, _, _, there = mapped(trial, out.out, "--method", method)
        sign = [-1, 1, 1] if view.mirror else [1, 1, 1]
        rest, there = rest * sign, there * sign
        return there[np.lexsort(np.round(rest, 6).T)]

    for method in ("blended", "smooth", "affine", "gram-schmidt"):
        straight = by_rest(PLAIN, 1, method)
        with trial.section(f"order of vertices, {method}"):
            off = np.abs(straight - by_rest(PLAIN, -1, method)).max() / np.ptp(straight)
            require(off < 1e-12, f"{off} of the size apart")
        with trial.section(f"mirrored, {method}"):
            off = np.abs(straight - by_rest(MIRRORED, 1, method)).max() / np.ptp(straight)
            trial.figure(f"{method}: mirrored {significant(off)} of the size apart")
            # on the part's own plane of symmetry the first axis of gram-schmidt points to one side of it
            require(off < (1e-3 if method == "gram-schmidt" else 1e-6), f"{off} of the size apart")

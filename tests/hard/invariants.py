"""What must hold whatever the case is: each function takes what a run left and raises Broken where it does not hold."""

import re

import numpy as np

from world import MIRRORED, OTHER_UNITS, PLAIN, call, significant

# What a way out is worded with, in the messages of runs that stop.
SUGGESTION = re.compile(r"\b(load it|damp it|use a|shorter|smaller|finer|fewer|hold it|add a|give |set |raise|lower|reduce|try|soften|longer|more slowly|check)\b")


class Broken(AssertionError):
    """Something that must hold does not."""


def require(condition, message):
    if not condition:
        raise Broken(message)


def worked(outcome):
    require(outcome.code == 0, f"exit {outcome.code}: {outcome.err.strip()[-400:]}")
    return outcome


def sound_state(outcome, path=None):
    """Every number of the body finite; no element left its part's neighbourhood for infinity; J > 0 where the run says it."""
    for name, array in outcome.arrays(path).items():
        if array.dtype.kind == "f":
            require(np.isfinite(array).all(), f"{name} has numbers that are none")
    least = outcome.summary.get("smallest_jacobian")
    require(least is None or least > 0, f"smallest J {least}")


def books(outcome, tolerance=1e-3):
    """Kinetic + elastic + potential + dissipated - work stays what it was, against the largest of these terms, and contact gives back what it took.
    Gives the worst ratio."""
    kept = outcome.summary["timed"]["books"]
    ratio = max(kept["worst_residual"], kept["worst_contact_error"]) / kept["largest_term"] if kept["largest_term"] else 0.0
    require(ratio <= tolerance, f"books off by {significant(ratio)} of their largest term, {tolerance:g} allowed")
    return ratio


def momentum(outcome, tolerance=1e-9):
    """Linear and angular momentum of a free body, against what its energy could carry. Gives the worst ratio."""
    history, mass = outcome.history, outcome.summary["mass"]
    energy = max(np.abs(history["kinetic"]).max(), np.abs(history["elastic"]).max())
    scale = np.sqrt(2 * mass * energy)
    arrays = outcome.arrays()
    reach = np.abs(np.concatenate([arrays["point/rest"], arrays["points/position"]])).max()
    worst = 0.0
    for kind, size in (("momentum", scale), ("angular momentum", scale * reach)):
        for axis in "xyz":
            column = history[f"{kind} {axis}"]
            drift = np.abs(column - column[0]).max() / size if size else 0.0
            require(drift <= tolerance, f"{kind} {axis} drifts by {significant(drift)} of the scale, {tolerance:g} allowed")
            worst = max(worst, drift)
    return worst


def same_bits(trial, world, threads=(1, 7)):
    """The bytes of the body do not depend on the number of threads (2 and 7 only in the quick half)."""
    threads = threads[-1:] if trial.quick else threads
    first = trial.go(world(PLAIN), PLAIN, threads=2)
    for count in threads:
        other = trial.go(world(PLAIN), PLAIN, threads=count)
        require(other.code == first.code, f"exit {first.code} with 2 threads, {other.code} with {count}")
        for a, b in ((first.out, other.out), (first.failed, other.failed)):
            require(a.exists() == b.exists(), f"{a.name} only with some numbers of threads")
            require(not a.exists() or a.read_bytes() == b.read_bytes(), f"other bits with {count} threads than with 2")
    return first


def _apart(first, other):
    """Largest distance of an element between two runs, against the largest displacement or a thousandth of the size."""
    rest, here = first.motion()
    rest_there, there = other.motion()
    require(rest.shape == rest_there.shape, f"{len(rest)} elements in one view, {len(rest_there)} in the other")
    size = np.ptp(rest, axis=0).max()
    # matter that rests at one place (two bodies that touch) is matched by where it is now, too
    moved = max(np.linalg.norm(here - rest, axis=1).max(), 1e-3 * size)
    require(np.abs(rest - rest_there).max() <= 1e-9 * max(size, np.abs(rest).max()), "the lattice lies elsewhere")
    return np.linalg.norm(here - there, axis=1).max() / moved


def same_view(trial, world, first, view, tolerance):
    other = trial.go(world(view), view)
    what = "mirrored" if view.mirror else "in other units"
    require(other.code == first.code, f"{what}: exit {other.code} in place of {first.code}: {other.err.strip()[-300:]}")
    if first.code != 0:
        return 0.0
    apart = _apart(first, other)
    require(apart <= tolerance, f"{what}: {significant(apart)} of the displacement apart, {tolerance:g} allowed")
    return apart


def battery(trial, world, energy=1e-3, free=None, units=1e-9, mirror=1e-6):
    """All of them for one world. energy, units, mirror: tolerances, None leaves it out; free: tolerance of the momenta of a free body."""
    first = worked(same_bits(trial, world))
    sound_state(first)
    if "timed" in first.summary:
        if energy is not None:
            books(first, energy)
        if free is not None:
            momentum(first, free)
    for view, tolerance in ((OTHER_UNITS, units), (MIRRORED, mirror)):
        if tolerance is not None:
            same_view(trial, world, first, view, tolerance)
    return first


def stops_well(outcome, timed=True):
    """Exit 3; one line with the step, the time, the place and a way out; nothing under the output's name; the last good state on disk, finite,
    not turned inside out, and mapped by flexel-map."""
    require(outcome.code == 3, f"exit {outcome.code} where 3 was due: {outcome.err.strip()[-300:]}")
    message = outcome.error
    require(message, f"no line of error: {outcome.err.strip()[-300:]}")
    if timed:
        require(re.search(r"\bstep \d+", message), f"no step in: {message}")
        require(re.search(r"\d(\.\d+)?(e-?\d+)? [numk]?s\b", message), f"no time in: {message}")
    require("near (" in message or re.search(r"\belement \d+|\bcell \d+", message), f"no place in: {message}")
    require(SUGGESTION.search(message), f"no suggestion in: {message}")
    require(not outcome.out.exists(), "a result under the output's name")
    require(outcome.failed.exists(), "no last good state on disk")
    sound_state(outcome, outcome.failed)
    code, err = call("flexel-map", outcome.failed, "--format", "stl", "-o", outcome.folder / "failed.stl", "--strict", "--report", outcome.folder / "failed.json")
    require(code in (0, 4), f"the last good state is not mapped: {err.strip()[-300:]}")
    return message


def refused(outcome, *words):
    """Exit 2 with one line that holds the words."""
    require(outcome.code == 2, f"exit {outcome.code} where 2 was due: {outcome.err.strip()[-300:]}")
    for word in words:
        require(word.lower() in outcome.error.lower(), f'"{word}" is missing in: {outcome.error}')
    require(not outcome.out.exists(), "a result under the output's name")
    return outcome.error


def ends_well(outcome, timed=True):
    """Done and sound, or stopped as it should be."""
    if outcome.code == 0:
        sound_state(outcome)
    else:
        stops_well(outcome, timed)
    return outcome


def integrators(trial, world, time, step, label="", energy=1e-3, free=None, units=1e-8, mirror=1e-6, explicit=True):
    """world(view, run): the setup with the text of [run]. Every integrator: symplectic, verlet and implicit must get through with all that
    battery asks for; explicit Euler, which gains energy by itself (docs/reference/motion.md), must get through or stop as it should. The quick half
    has the first and the last of them. step: of the implicit one. Gives the outcomes by method."""
    outcomes = {}
    for method in ("symplectic", "implicit") if trial.quick else ("symplectic", "verlet", "explicit", "implicit"):
        if method == "explicit" and not explicit or method == "implicit" and step is None:
            continue
        with trial.section(f"{label}{method}"):
            run = f'[run]\ntime = "{time}"\nmethod = "{method}"\n' + (f'step = "{step}"\n' if method == "implicit" else "")
            if method == "explicit":
                outcomes[method] = ends_well(same_bits(trial, lambda view: world(view, run), (7,)))
            elif method == "verlet":  # the symplectic kernel with half a kick before it: in one view
                outcomes[method] = worked(same_bits(trial, lambda view: world(view, run), (7,)))
                sound_state(outcomes[method])
                if energy is not None:
                    books(outcomes[method], energy)
                if free is not None:
                    momentum(outcomes[method], free)
            else:
                # implicit Euler takes angular momentum from what turns, at the rate omega dt (docs/reference/motion.md)
                outcomes[method] = battery(trial, lambda view: world(view, run), energy=energy, free=None if method == "implicit" else free,
                                           units=units if units is None or method != "implicit" else max(units, 1e-6), mirror=mirror)
    return outcomes

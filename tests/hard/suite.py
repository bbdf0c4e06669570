"""Cases, and how one is run: its sections, its figure, its picture, its verdict.

A case is a function of a Trial with what people should know about it:

    @case("steel beside foam", holds="...", breaks="...")
    def steel_beside_foam(trial): ...

A case has sections (one a model or an integrator, mostly): `with trial.section("springs"):`. What is raised inside is that section's and the
others go on. `known` names sections that do not hold yet, with what is wrong: they are told of in every run, and the case fails when one of
them begins to hold.
"""

import contextlib
import dataclasses
import pathlib
import re
import shutil
import time

import world as world_module
from invariants import Broken

CASES = []


@dataclasses.dataclass
class Case:
    family: str
    name: str
    run: object
    holds: str
    breaks: str
    quick: bool
    known: dict
    peer: str

    @property
    def key(self):
        return re.sub("[^a-z0-9]+", "-", self.name.lower()).strip("-")


def case(name, holds, breaks, quick=True, known=None, peer=""):
    """Registers a case. quick: part of plain ctest too; peer: of another program that runs the same, in the whole suite only."""
    def register(function):
        CASES.append(Case(function.__module__, name, function, holds, breaks, quick, known or {}, peer))
        return function
    return register


def all_of(what, *sections):
    """`known` of sections that all suffer from the same."""
    return dict.fromkeys(sections, what)


class NotHere(Exception):
    """The machine lacks what a peer's run needs."""


class Trial:
    """One run of a case in a folder of its own. quick: the quick half only."""

    def __init__(self, case_, folder, quick):
        self.case, self.folder, self.quick = case_, pathlib.Path(folder), quick
        self.figures, self.peers, self.broken, self.known, self.holding, self.notes = [], [], [], [], [], []
        self.picture = None
        self.plot = None
        self._count = 0
        self._seen = {}

    def go(self, setup, view=world_module.PLAIN, threads=2, options=()):
        """Runs a setup; the same one asked for twice is run once."""
        key = (repr(sorted((name, world_module.np.asarray(t).tobytes()) for name, t in setup.parts.items())), setup.scene, setup.size,
               setup.options, tuple(map(str, setup.bodies)), view, threads, tuple(options))
        if key not in self._seen:
            self._count += 1
            self._seen[key] = world_module.simulate(setup, view, self.folder / f"run{self._count:03}", threads, options)
        return self._seen[key]

    @contextlib.contextmanager
    def section(self, name):
        try:
            yield
        except NotHere as reason:
            self.notes.append(f"{name}: skipped, {reason}")
        except Exception as error:  # a case that stumbles over what a run left has found something too
            text = f"{name}: {error}" if isinstance(error, Broken) else f"{name}: {type(error).__name__}: {error}"
            (self.known if name in self.case.known else self.broken).append(text.replace("\n", " "))
        else:
            self.holding.append(name)
            if name in self.case.known:
                self.broken.append(f"{name}: holds now; take it out of `known` ({self.case.known[name]})")

    @contextlib.contextmanager
    def peer(self, name):
        """A run of another program: in the whole suite only; what it does is told, not judged."""
        if self.quick:
            yield False
            return
        try:
            yield True
        except NotHere as reason:
            self.peers.append(f"{name}: skipped ({reason})")
        except Exception as error:
            self.peers.append(f"{name}: our script failed: {type(error).__name__}: {error}")
            self.broken.append(f"peer {name}: {type(error).__name__}: {error}")

    def figure(self, text):
        if text not in self.figures:
            self.figures.append(text)

    def show(self, outcome_or_path, *options):
        """What the picture of this case shows: a body file, and options of `flexel picture`."""
        self.picture = (getattr(outcome_or_path, "out", outcome_or_path), options)


@dataclasses.dataclass
class Verdict:
    case: Case
    word: str
    figures: list
    broken: list
    known: list
    notes: list
    peers: list
    seconds: float
    picture: object
    plot: object

    @property
    def line(self):
        text = f"{self.word:<6} {self.case.family + '.' + self.case.key:<58} {'; '.join(self.figures)}"
        return text + (f"  [{self.seconds:.0f} s]" if self.seconds >= 1 else "")


def run_case(case_, folder, quick=False):
    folder = pathlib.Path(folder) / case_.key
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    trial = Trial(case_, folder, quick)
    begin = time.monotonic()
    with trial.section("case"):
        case_.run(trial)
    if not trial.holding and not trial.broken and not trial.known:
        trial.broken.append("nothing was looked at")
    word = "FAILS" if trial.broken else "KNOWN" if trial.known else "ok"
    return Verdict(case_, word, trial.figures, trial.broken, trial.known, trial.notes, trial.peers, time.monotonic() - begin, trial.picture, trial.plot)

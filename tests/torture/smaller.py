"""A finding with what it does not need left out: changes of the file, pieces of the file, words of the command."""

import copy
import time

import mutate
from trial import run, wrong

SECONDS = 120


def smaller(trial, what, programs, folder):
    """The least trial found that ends in the same way."""
    until = time.monotonic() + SECONDS

    def holds(candidate):
        return time.monotonic() < until and wrong(candidate, run(candidate, programs, folder))[0] == what

    trial = fewer_changes(trial, holds)
    trial = fewer_words(trial, holds)
    return shorter_input(trial, holds) if trial.changed else trial


def with_input(trial, data):
    other = copy.copy(trial)
    other.inputs = dict(trial.inputs, **{trial.changed: data})
    return other


def fewer_changes(trial, holds):
    for change in list(trial.changes):
        left = [each for each in trial.changes if each is not change]
        other = with_input(trial, mutate.apply(trial.sound, left))
        if left and holds(other):
            other.changes = left
            trial = other
    return trial


def fewer_words(trial, holds):
    """Options with their values; the first words and results stay."""
    at = 2
    while at < len(trial.command):
        if str(trial.command[at]).startswith("--"):
            alone = at + 1 == len(trial.command) or str(trial.command[at + 1]).startswith("-")
            for width in (1,) if alone else (2, 1):
                other = copy.copy(trial)
                other.command = trial.command[:at] + trial.command[at + width:]
                other.outputs = [name for name in trial.outputs if name in other.command]
                if holds(other):
                    trial = other
                    break
            else:
                at += 1
        else:
            at += 1
    return trial


def shorter_input(trial, holds):
    """Zeller's delta debugging, without the halves alone."""
    data = trial.inputs[trial.changed]
    pieces = 2
    while len(data) > 1 and pieces <= len(data):
        size = (len(data) + pieces - 1) // pieces
        for begin in range(0, len(data), size):
            other = with_input(trial, data[:begin] + data[begin + size:])
            if holds(other):
                trial, data = other, other.inputs[trial.changed]
                pieces = max(2, pieces - 1)
                break
        else:
            if pieces == len(data):
                break
            pieces = min(len(data), 2 * pieces)
            if size <= 4:
                break
    return trial

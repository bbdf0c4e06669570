"""What a run says while it works: progress on stderr, and warnings."""

from __future__ import annotations

import os
import sys
import time
import warnings as python_warnings
from typing import Callable, Optional, Union

import numpy as np

from .errors import FlexelWarning

ProgressFunction = Callable[[str, float, str, Optional[float]], None]
Progress = Union[bool, None, ProgressFunction]


def _time(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 99.5 else f"{seconds / 60:.0f} min"


class Bar:
    """A line that is rewritten in place, in terminals and notebooks; runs under a second leave no trace."""

    def __init__(self) -> None:
        self.began = time.monotonic()
        self.width = 0

    def __call__(self, stage: str, share: float, note: str, left: Optional[float]) -> None:
        if time.monotonic() - self.began < 1:
            return
        filled = round(24 * share)
        line = f"flexel: {stage} [{'#' * filled}{'.' * (24 - filled)}] {int(100 * share):3d} %"
        if left is not None:
            line += f"  {_time(left)} left"
        if note:
            line += "  " + note
        line = line[:100]
        sys.stderr.write("\r" + line.ljust(self.width))
        sys.stderr.flush()
        self.width = len(line)

    def clear(self) -> None:
        if self.width:
            sys.stderr.write("\r" + " " * self.width + "\r")
            sys.stderr.flush()


def _in_notebook() -> bool:
    return "ipykernel" in sys.modules


def listener(progress: Progress):
    """What the module is given for `progress`: None, or a function."""
    if callable(progress):
        return progress
    if isinstance(progress, np.bool_):
        progress = bool(progress)
    if progress is False:
        return None
    if progress is not True and progress is not None:
        raise TypeError(f"progress: {progress!r} is neither a function nor True, False or None")
    try:
        shown = sys.stderr.isatty() or _in_notebook()
    except (AttributeError, ValueError):  # no stderr, or a closed one
        shown = False
    return Bar() if progress is True or shown else None


def _warn(line: str) -> None:
    """At the line that called the package."""
    package, frame, level = os.path.dirname(__file__) + os.sep, sys._getframe(), 1
    while frame.f_back is not None and frame.f_code.co_filename.startswith(package):
        frame, level = frame.f_back, level + 1
    python_warnings.warn(line, FlexelWarning, stacklevel=level)


def heard(function, *arguments, progress: Progress = None):
    """Calls `function` of the module; returns what it gives, without what it said, and that."""
    heard_by = listener(progress)
    try:
        given = function(*arguments, heard_by)
    finally:
        if isinstance(heard_by, Bar):
            heard_by.clear()
    *results, said = given if isinstance(given, tuple) else (given,)
    for line in said.warnings:
        _warn(line)
    return (*results, said)

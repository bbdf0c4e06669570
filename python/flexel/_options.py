"""Options of the commands from keywords: units as texts or SI numbers, places as words."""

from __future__ import annotations

import os
from collections.abc import Mapping, Set
from typing import Iterable, List, Optional, Union

import numpy as np

from . import _flexel
from .errors import InputError

_UNITS = {"push": "N", "move": "m", "torque": "N m", "twist": "rad", "bearing": "N", "probe": "m"}
_SCALARS = {"gravity": "m/s^2", "size": "m", "edge": "m", "within": "s", "timeout": "s", "shell": "m", "tolerance": "m",
            "budget": "s"}
_VALUED = {*_UNITS, *_SCALARS, "fix", "material", "infill", "model", "scene", "count"}


def _float(value) -> float:
    """What float() would make a number of all the same: True, a text, a part of a complex number."""
    if isinstance(value, (str, bytes, bool, np.bool_)) or np.iscomplexobj(value):
        raise TypeError(f"{value!r} is not a number")
    return float(value)


def _number(value) -> str:
    return repr(_float(value))


def length(value) -> Optional[float]:
    """Metres of "2 mm" or of a number, which is metres."""
    return _flexel.parse_quantity(value, "length") if isinstance(value, str) else None if value is None else _float(value)


def _amount(value, unit: str) -> str:
    """ "0 0 -50 N" of (0, 0, -50), "5 N" of 5; a text is left as it is."""
    if isinstance(value, str):
        return value
    if isinstance(value, (Mapping, Set, bytes, bytearray)):
        raise TypeError(f"{value!r} is neither a number nor a vector")
    one = not isinstance(value, Iterable) or getattr(value, "ndim", 1) == 0
    numbers = [value] if one else list(value)
    return f"{' '.join(_number(each) for each in numbers)} {unit}"


def _listed(value) -> List:
    if isinstance(value, (bytes, bytearray)):
        raise TypeError(f"{value!r} is bytes: a text is needed")
    return [value] if isinstance(value, (str, os.PathLike)) or not isinstance(value, Iterable) else list(value)


def _actions(name: str, value) -> List[str]:
    if isinstance(value, Mapping):
        return [f"{where}: {_amount(amount, _UNITS[name])}" for where, amount in value.items()]
    return [str(each) for each in _listed(value)]


def _of_parts(value) -> List[str]:
    """ "knob=PLA" of {"knob": "PLA"}."""
    if isinstance(value, Mapping):
        return [f"{part}={each}" for part, each in value.items()]
    return [str(each) for each in _listed(value)]


def refuse_limits(options: Mapping) -> None:
    """A limit of memory would be one of the whole process, and stay."""
    if any(name.replace("-", "_").startswith("max_memory") for name in options):
        raise InputError("max_memory: it would limit all of Python, and stay: run the command, or use max_elements")


def words(options: Mapping) -> List[str]:
    """The command line of keywords: no_estimate=True is --no-estimate, fix=["a", "b"] is --fix a --fix b."""
    refuse_limits(options)
    line: List[str] = []
    for name, value in options.items():
        option = "--" + name.replace("_", "-")
        if value is None or value is False:
            continue
        if value is True and name in _VALUED:
            raise TypeError(f"{name}: True says nothing: give its value")
        if value is True:
            line.append(option)
            continue
        if name in _UNITS:
            values = _actions(name, value)
        elif name in ("material", "infill"):
            values = _of_parts(value)
        elif name in _SCALARS:
            values = [_amount(value, _SCALARS[name])]
        elif name == "accuracy" and not isinstance(value, str):
            values = [_number(value)]
        elif isinstance(value, (int, float)):
            values = [str(value) if isinstance(value, int) else _number(value)]
        elif isinstance(value, Mapping):
            raise TypeError(f"{name}: {value!r} gives values where a name is enough")
        else:
            values = [os.fspath(each) if isinstance(each, os.PathLike) else str(each) for each in _listed(value)]
        line.extend(f"{option}={each}" for each in values)
    return line


def is_scene_text(scene) -> bool:
    """Whether a scene is given as its text: not where it is a file, or named as one."""
    if not isinstance(scene, str) or "\n" in scene:
        return isinstance(scene, str)
    return "=" in scene and not scene.endswith(".toml") and not os.path.exists(scene)


def path(value) -> str:
    """A path as a text. Raises ValueError where what opens it would read a part of it only, or cannot read it."""
    text = os.fsdecode(value)
    if "\0" in text:
        raise ValueError(f"{text!r} is no path: it holds a null character")
    try:
        text.encode()
    except UnicodeEncodeError:
        raise ValueError(f"{text!r} is not UTF-8: rename the file, or run the command") from None
    return text


def paths(value) -> List[str]:
    given = [path(each) for each in ([value] if isinstance(value, bytes) else _listed(value))]
    if not given:
        raise InputError("no file is named")
    return given


Quantity = Union[str, float]

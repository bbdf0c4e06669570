"""Deforms CAD parts: voxelizes them, simulates, and maps the deformation back onto the part.

    import flexel
    result = flexel.deform("bracket.step", fix="bracket/1", push={"bracket/2": (0, 0, -100)}, material="PLA",
                           output="bent.stl")
    print(result)
    result.body["von_mises"].max()

Numbers are SI (metres, newtons, seconds); texts carry their unit ("2 mm"). Arrays are read-only numpy views. Runs let
the GIL go, take every core, and one runs at a time. docs/guide/python.md has more.
"""

from __future__ import annotations

import json
import os
import pathlib
import shutil
from typing import Any, Callable, Dict, List, Optional, Sequence, Union

from . import _flexel
from ._objects import Body, Frame, Mapped, Part, Result, Shown, check_outputs, write_whole
from ._options import Quantity, is_scene_text, length, paths, refuse_limits, words
from ._options import path as path_text
from ._said import Progress, heard
from .errors import (DivergedError, FlexelError, FlexelWarning, InputError, InvalidMappingError, StoppedByTimeout)

__all__ = ["Body", "DivergedError", "FlexelError", "FlexelWarning", "Frame", "InputError", "InvalidMappingError", "Mapped",
           "Part", "Result", "StoppedByTimeout", "deform", "map", "materials", "picture", "read", "read_body", "simulate",
           "study", "voxelize"]
__version__ = _flexel.version
Paths = Union[str, os.PathLike, Sequence[Union[str, os.PathLike]]]


def _find_programs() -> None:
    """CAD files are read by flexel-cad, and a study runs the programs: they are in the same installation or build."""
    package = pathlib.Path(__file__).resolve().parent
    places = [os.environ.get("FLEXEL_BIN", "")] + [str(up / "bin") for up in package.parents[1:4]]
    places.append(os.path.dirname(shutil.which("flexel") or ""))
    for place in places:
        if place and os.access(os.path.join(place, "flexel"), os.X_OK):
            _flexel.set_program_folder(place)
            return


_find_programs()


def read(path: Paths, *, unit: Optional[str] = None, format: Optional[str] = None, edge: Optional[Quantity] = None,
         deflection: Optional[Quantity] = None, progress: Progress = None) -> Part:
    """Reads parts: STEP, IGES, BREP, STL, OBJ, PLY, OFF, glTF, 3MF ...

    unit: a length unit's name, of files that carry none (default mm). edge: the mesh is split to this longest edge [m].
    deflection: of CAD files, the largest distance of the triangles from the surface [m]. Raises InputError.
    """
    options: Dict[str, Any] = {"edge": length(edge), "deflection": length(deflection)}
    if unit is not None:
        options["unit"] = unit
    if format is not None:
        options["format"] = format
    files = paths(path)
    core, said = heard(_flexel.read_part, files, options, progress=progress)
    return Part(core, os.path.basename(files[0]), said.warnings, _absolute(files))


def _absolute(files: Sequence[str]) -> List[str]:
    return [os.path.abspath(each) for each in files if each != "-"]


def _as_part(part, progress: Progress) -> Part:
    return part if isinstance(part, Part) else read(part, progress=progress)


def voxelize(part: Union[Part, Paths], *, size: Optional[Quantity] = None, count: Optional[int] = None,
             placement: str = "corner", align: str = "snap", heal: str = "auto", material: str = "", moments: bool = False,
             threads: int = 0, progress: Progress = None) -> Body:
    """The lattice of a part, as flexel-voxelize makes it.

    size: spacing [m] or "2 mm"; or count: about this many cells (default 20,000). placement: "corner" or "centre". align:
    "snap", "box" or "none". heal: "auto", "wrap", "wrap:5 mm" or "none". moments: for model "quadratic". threads: 0 is every
    core. Raises InputError.
    """
    given = _as_part(part, progress)
    options = {"size": length(size), "count": count, "placement": placement, "align": align, "heal": heal,
               "material": material, "moments": moments, "threads": threads}
    core, summary, said = heard(_flexel.voxelize, given._core, options, progress=progress)
    return Body(core, summary, said.warnings, given.label, given._files)


def read_body(path: Union[str, os.PathLike], *, progress: Progress = None) -> Body:
    """Reads a body file (.vtu). Raises InputError."""
    name = path_text(path)
    core, said = heard(_flexel.read_body, name, progress=progress)
    return Body(core, "", said.warnings, os.path.basename(name), _absolute([name]))


def _core_of(body) -> "_flexel.Body":
    if isinstance(body, Body):
        return body._core
    hint = ": give its .body" if isinstance(body, (Result, Mapped)) else ""
    raise TypeError(f"body: a flexel.Body is needed, not a {type(body).__name__}{hint}")


def simulate(body: Body, scene: Union[str, os.PathLike, None] = None, *, on_frame: Optional[Callable[[Frame], Any]] = None,
             estimate: bool = True, stress: bool = True, threads: int = 0, history: str = "", failed: str = "", isa: str = "",
             force: bool = False, progress: Progress = None, **options) -> Result:
    """Runs a scene on a body, as flexel-simulate does; the body stays as it is.

    scene: the path of a scene (.toml), or the text of one (docs/reference/scene.md; has a line's end, or "=" and names no
    file), or None. options add to it: fix, push,
    move, torque, twist, bearing, gravity, probe, material, model, infill, shell, as of `flexel deform`:
    push={"bracket/2": (0, 0, -100)} [N], "bracket/2: 0 0 -100 N" or a list of such; fix="bracket/1".
    on_frame: of runs in time, called with each Frame ([run] frames of the scene). estimate: error bars. history: a CSV of
    energies. failed: where the last good state goes when the run fails (.vtu). force: they may replace what was read.
    Raises InputError, DivergedError, KeyboardInterrupt.
    """
    core_body, inputs = _core_of(body), list(body._files)
    history, failed = path_text(history or ""), path_text(failed or "")
    callback = None if on_frame is None else lambda core: on_frame(Frame(core, inputs))
    given = {"threads": threads, "estimate": estimate, "stress": stress, "history": history, "failed": failed, "isa": isa,
             "on_frame": callback}
    text, name = "", ""
    line = words(options)
    if is_scene_text(scene):
        text, name = scene, "scene"
    elif scene is not None:
        line.append("--scene=" + path_text(scene))
        inputs += _absolute([path_text(scene)])
    check_outputs([history, failed], inputs, force)
    core, said = heard(_flexel.simulate, core_body, line, text, name, given, progress=progress)
    return Result(core, said, {}, body.label, inputs)


def map(body: Body, *, output: Union[str, os.PathLike, None] = None, progress: Progress = None, **options) -> Mapped:
    """The part's own surface, deformed as the body is; `output`: written too, byte for byte as flexel-map does.

    options are those of flexel-map: method="smooth", check="voronoi", crack="cap", refine="off", strict=True, ...
    A coarse mesh gets more triangles where they are needed to show the bend; refine="off" keeps its vertices.
    Raises InputError, also where `output` is a file that the body came from, unless force=True; InvalidMappingError.
    """
    core_body = _core_of(body)
    core, said = heard(_flexel.map, core_body, words(options), "" if output is None else path_text(output), body._files,
                       progress=progress)
    options.pop("force", None)
    return Mapped(core, body, options, said.warnings)


_OF_MAPPING = ("method", "check", "crack", "debris", "refine", "keep_vertices", "tolerance", "scale", "attributes", "ascii",
               "strict")


def deform(part: Union[Part, Paths], *, output: Union[Paths, None] = None, progress: Progress = None, **options) -> Result:
    """All stages in one run, as `flexel deform`: the size is chosen where none is given.

    options are those of the command: fix, push, move, torque, twist, bearing, gravity, probe, material, scene, size, count,
    accuracy, within, model, no_estimate=True, ... output: files to write (.stl, .step, .vtu, .png, .html).
    Raises InputError, DivergedError, InvalidMappingError, StoppedByTimeout (timeout="90 s"), KeyboardInterrupt.

        flexel.deform("bracket.step", fix="bracket/1", push={"bracket/2": (0, 0, -100)}, material="PLA", size="2 mm")
    """
    line = words(options)
    if output is not None:
        line += ["--output=" + each for each in paths(output)]
    if isinstance(part, Part):
        core_part, names = part._core, part._names()
    else:
        core_part, names = None, paths(part)
    files = list(part._files) if isinstance(part, Part) else _absolute(names)
    if options.get("scene"):
        files += _absolute(paths(options["scene"]))
    core, said = heard(_flexel.deform, line + ["--"] + names, core_part, progress=progress)
    label = part.label if isinstance(part, Part) else ", ".join(os.path.basename(name) for name in names)
    return Result(core, said, {name: options[name] for name in _OF_MAPPING if name in options}, label + ", deformed", files)


def study(part: Paths, *, output: Union[str, os.PathLike], progress: Progress = None, **options) -> Dict[str, Any]:
    """What accuracy costs in time, as `flexel study`: writes study.html, study.csv and study.json to the folder `output`, and
    returns what study.json holds. options: scene, fix, push, material, budget="2 min", reference, against.
    """
    folder = path_text(output)
    code, _ = heard(_flexel.run_command, "study", words(options) + ["--output=" + folder, "--"] + paths(part),
                    progress=progress)
    if code:
        raise KeyboardInterrupt
    with open(os.path.join(folder, "study.json"), encoding="utf-8") as file:
        return json.load(file)


def _subjects(shown) -> List:
    items = shown if isinstance(shown, (list, tuple)) else [shown]
    for each in items:
        if not isinstance(each, Shown):
            raise TypeError(f"{each!r} cannot be shown: parts, bodies and results can")
    if not items:
        raise InputError("nothing is given that could be shown")
    bodies = [each.body if isinstance(each, (Result, Mapped)) else each for each in items]
    return [(each.label, body._core) for each, body in zip(items, bodies)]


def _files_of(shown) -> List[str]:
    return [file for each in (shown if isinstance(shown, (list, tuple)) else [shown]) for file in each._files]


def picture(shown, path: Union[str, os.PathLike, None] = None, *, force: bool = False, progress: Progress = None,
            **options) -> bytes:
    """A PNG of parts, bodies and results (one or a list), as `flexel picture` draws it; written to `path` too.

    options: color="von_mises", scale="auto" or a factor, view="iso" or "30,20", size="1600x1200", cells=True, faces=True,
    range="0:5 mm", up="y". Raises InputError, also where `path` is a file that was read, unless `force`.
    """
    refuse_limits(options)
    subjects = _subjects(shown)
    if path is not None:
        path = path_text(path)
        check_outputs([path], _files_of(shown), force)
    line: List[str] = []
    for name, value in options.items():
        if value is True:
            line.append("--" + name.replace("_", "-"))
        elif value is not None and value is not False:
            line.append(f"--{name.replace('_', '-')}={value}")
    png, _ = heard(_flexel.picture, subjects, line, progress=progress)
    if path is not None:
        write_whole(png, path)
    return png


def materials() -> List[Dict[str, Any]]:
    """The library of materials, SI (docs/reference/materials.md)."""
    found = json.loads(_flexel.materials())
    return found["materials"] if isinstance(found, dict) else found

"""How a case is put to the programs: parts and scenes written in a unit and, if asked for, mirrored; runs; what came out of them.

A case describes its world in SI. A View says in which units it is written and whether x is turned round (the part's mirror image under the
mirrored scene); what comes out is given back in SI and unmirrored, so that two views can be compared number by number.
"""

import csv
import dataclasses
import json
import math
import os
import pathlib
import subprocess

import numpy as np

BIN = pathlib.Path(os.environ["FLEXEL_BIN"])
SECONDS = float(os.environ.get("FLEXEL_HARD_TIMEOUT", "900"))

# unit of each kind, and its size in SI
METRIC = {"length": ("mm", 1e-3), "force": ("N", 1.0), "torque": ("N m", 1.0), "pressure": ("MPa", 1e6), "density": ("kg/m3", 1.0), "time": ("ms", 1e-3),
          "velocity": ("m/s", 1.0), "acceleration": ("m/s2", 1.0), "mass": ("kg", 1.0)}
# exact by definition (the international yard and pound, 1959; standard gravity, 1901)
POUND, INCH = 0.45359237, 0.0254
IMPERIAL = {"length": ("in", INCH), "force": ("lbf", POUND * 9.80665), "torque": ("lbf in", POUND * 9.80665 * INCH),
            "pressure": ("psi", POUND * 9.80665 / INCH**2), "density": ("lb/in^3", POUND / INCH**3), "time": ("min", 60.0),
            "velocity": ("km/h", 1 / 3.6), "acceleration": ("mm/s^2", 1e-3), "mass": ("lb", POUND)}


@dataclasses.dataclass(frozen=True)
class View:
    units: str = "metric"
    mirror: bool = False

    def _number(self, kind, value):
        unit, size = (METRIC if self.units == "metric" else IMPERIAL)[kind]
        return f'"{float(value) / size!r} {unit}"'

    def __getattr__(self, kind):
        """view.length(0.01) is "10.0 mm", view.pressure(1e6) "1.0 MPa" (quotes included)."""
        if kind not in METRIC:
            raise AttributeError(kind)
        return lambda value: self._number(kind, value)

    def vector(self, kind, values, axial=False):
        """A vector of quantities; None is "free". Axial ones (spins, torques) keep their x when mirrored and lose the sign of y and z."""
        signs = ((1, -1, -1) if axial else (-1, 1, 1)) if self.mirror else (1, 1, 1)
        return "[" + ", ".join('"free"' if v is None else self._number(kind, s * v) for s, v in zip(signs, values)) + "]"

    def direction(self, values, axial=False):
        signs = ((1, -1, -1) if axial else (-1, 1, 1)) if self.mirror else (1, 1, 1)
        return "[" + ", ".join(repr(float(s * v)) for s, v in zip(signs, values)) + "]"

    def point(self, values):
        return self.vector("length", values)

    def box(self, low, high):
        if self.mirror:
            low, high = (-high[0], *low[1:]), (-low[0], *high[1:])
        plain = dataclasses.replace(self, mirror=False)
        return f"{{ box = {{ min = {plain.point(low)}, max = {plain.point(high)} }} }}"

    def sphere(self, centre, radius):
        return f"{{ sphere = {{ centre = {self.point(centre)}, radius = {self.length(radius)} }} }}"

    def half_space(self, point, normal):
        return f"{{ half_space = {{ point = {self.point(point)}, normal = {self.direction(normal)} }} }}"

    def side(self, name):
        return name.translate(str.maketrans({})) if not self.mirror else {"xmin": "xmax", "xmax": "xmin"}.get(
            name, name.replace("/xmin", "/XMAX").replace("/xmax", "/xmin").replace("/XMAX", "/xmax"))

    def rotation(self, axis, through, degrees):
        return f'{{ axis = {self.direction(axis, axial=True)}, through = {self.point(through)}, angle = "{degrees!r} deg" }}'

    def spin(self, axis, through, degrees_per_second):
        return f'{{ axis = {self.direction(axis, axial=True)}, through = {self.point(through)}, angle_per_second = "{degrees_per_second!r} deg" }}'

    def material(self, name, young, poisson, density, **more):
        lines = [f'[materials."{name}"]', f"young = {self.pressure(young)}", f"poisson = {poisson!r}", f"density = {self.density(density)}"]
        for key, value in more.items():
            lines.append(f"{key} = {value!r}" if key in ("elongation", "friction") else f"{key} = {self.pressure(value)}")
        return "\n".join(lines) + "\n"

    def stl(self, name, triangles):
        """ASCII STL of (n x 3 x 3) in m, with every digit, in the view's unit of length."""
        triangles = np.array(triangles, dtype=float)
        if self.mirror:
            triangles = triangles[:, ::-1, :] * np.array([-1.0, 1.0, 1.0])
        triangles = triangles / (METRIC if self.units == "metric" else IMPERIAL)["length"][1]
        lines = [f"solid {name}"]
        for triangle in triangles.tolist():
            lines += ["facet normal 0 0 0", "outer loop", *("vertex " + " ".join(map(repr, v)) for v in triangle), "endloop", "endfacet"]
        return "\n".join([*lines, f"endsolid {name}"]) + "\n"

    @property
    def length_unit(self):
        return (METRIC if self.units == "metric" else IMPERIAL)["length"][0]


PLAIN, OTHER_UNITS, MIRRORED = View(), View("imperial"), View(mirror=True)


@dataclasses.dataclass
class Setup:
    """parts: name to triangles (n x 3 x 3, m); scene: TOML; size: spacing (m); options: of flexel-voxelize. bodies: body files in place of parts."""
    parts: dict
    scene: str
    size: float
    options: tuple = ("--align", "none")
    bodies: tuple = ()


def call(program, *arguments, cwd=None, timeout=None):
    """Runs one of our programs; its exit code and what it says on stderr. One that does not end counts as exit code 124."""
    command = [str(BIN / program), *map(str, arguments)]
    try:
        done = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, cwd=cwd,
                              timeout=timeout or SECONDS, check=False)
    except subprocess.TimeoutExpired:
        return 124, f"{program}: did not end within {timeout or SECONDS:g} s"
    return done.returncode, done.stderr.decode(errors="replace")


def read_history(path):
    if not path.exists():
        return {}
    with open(path, encoding="utf-8", newline="") as file:
        rows = list(csv.reader(file))
    names = [name.split(" [")[0] for name in rows[0]]
    values = np.array([[float(x) for x in row] for row in rows[1:]], dtype=float).reshape(-1, len(names))
    return {name: values[:, n] for n, name in enumerate(names)}


class Outcome:
    """How flexel-simulate ended: code, err, summary (dict), history (columns by name, SI), out (the body's path, which may not exist)."""

    def __init__(self, folder, view, code, err):
        self.folder, self.view, self.code, self.err = folder, view, code, err
        self.out = folder / "out.vtu"
        self.failed = folder / "out.failed.vtu"
        summary = folder / "summary.json"
        self.summary = json.loads(summary.read_text(encoding="utf-8")) if summary.exists() else {}
        self._history = None

    @property
    def history(self):
        if self._history is None:
            self._history = read_history(self.folder / "history.csv")
        return self._history

    @property
    def bytes(self):
        return self.out.read_bytes()

    def arrays(self, path=None):
        from files import vtu_arrays
        return vtu_arrays(path or self.out)

    def motion(self, path=None):
        """Rest places and present places of the elements (n x 3, m), unmirrored, in the order of their rest places."""
        arrays = self.arrays(path)
        rest, position = arrays["point/rest"].copy(), arrays["points/position"].copy()
        if self.view.mirror:
            rest[:, 0] *= -1
            position[:, 0] *= -1
        extent = max(np.ptp(rest, axis=0).max(), 1e-300)
        keys = np.round(rest / extent, 6) + 0.0
        order = np.lexsort((position[:, 2], position[:, 1], position[:, 0], arrays["point/part"], keys[:, 0], keys[:, 1], keys[:, 2]))
        return rest[order], position[order]

    def probe(self, name):
        value = next(np.array(p["displacement"]) for p in self.summary["probes"] if p["name"] == name)
        return value * np.array([-1.0, 1, 1]) if self.view.mirror else value

    @property
    def error(self):
        lines = [line for line in self.err.splitlines() if ": error: " in line]
        return lines[-1] if lines else ""

    @property
    def steps(self):
        return self.summary.get("timed", {}).get("steps", 0)


def voxelize(setup, view, folder):
    """The bodies of the setup's parts; a refusal comes back as an Outcome."""
    names = []
    for name, triangles in setup.parts.items():
        path = folder / f"{name}.stl"
        path.write_text(view.stl(name, triangles), encoding="ascii")
        names.append(path.name)
    if not names:
        return list(setup.bodies), None
    size = f"{setup.size / (METRIC if view.units == 'metric' else IMPERIAL)['length'][1]!r} {view.length_unit}"
    code, err = call("flexel-voxelize", *names, "--size", size, "--unit", view.length_unit, *setup.options, "-o", "body.vtu", "--quiet", cwd=folder)
    return ["body.vtu", *setup.bodies], None if code == 0 else Outcome(folder, view, code, err)


def simulate(setup, view, folder, threads=2, options=()):
    """Runs a setup in an empty folder of its own."""
    folder.mkdir(parents=True)
    bodies, refused = voxelize(setup, view, folder)
    if refused:
        return refused
    (folder / "scene.toml").write_text(setup.scene, encoding="utf-8")
    timed = "\ntime = " in setup.scene.partition("[run]")[2]
    arguments = ["scene.toml", *bodies, "-o", "out.vtu", "--summary", "summary.json", "--threads", threads, "--quiet", *options]
    arguments += ["--history", "history.csv"] if timed else ["--no-estimate"]
    code, err = call("flexel-simulate", *arguments, cwd=folder)
    return Outcome(folder, view, code, err)


def edited(source, target, change):
    """Writes `target`: the body file `source` after change(arrays), arrays by name (tests/programs/torn.py)."""
    from torn import arrays_in
    data = bytearray(pathlib.Path(source).read_bytes())
    change(arrays_in(data))
    pathlib.Path(target).write_bytes(data)
    return target


CENTRE = ("--placement", "centre", "--align", "none")


def placement(model):
    return CENTRE if model == "paper" else ("--align", "none")


def significant(x, digits=3):
    """A number for people: 3 digits."""
    return "0" if x == 0 else f"{x:.{digits}g}" if math.isfinite(x) else str(x)

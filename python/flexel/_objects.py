"""Parts, bodies and results. Arrays are read-only views of the libraries' own: nothing is copied, and a view keeps what it
is of alive. Everything is SI and double precision; positions are in the world frame."""

from __future__ import annotations

import json
import os
import secrets
import shutil
from typing import Any, Dict, List, Optional, Sequence, Tuple

import numpy as np

from . import _flexel
from ._options import length, words
from ._options import path as path_text
from ._said import Progress, heard
from .errors import InputError

_VTK_TO_LATTICE = [0, 1, 3, 2, 4, 5, 7, 6]  # corners of a hexahedron as VTK counts them
_LARGEST_INLINE_PAGE = 50_000_000  # bytes


def _need_meshio():
    try:
        import meshio
    except ImportError:
        raise InputError("meshio is not installed: apt-get install python3-meshio") from None
    return meshio


def _inline(page: str, what: str) -> str:
    """An HTML fragment that shows a whole page in a frame of its own."""
    if len(page) > _LARGEST_INLINE_PAGE:
        return f"<p>{what}: too large to be shown here; write it with .write_page(\"FILE.html\").</p>"
    import html

    return (f'<iframe srcdoc="{html.escape(page)}" sandbox="allow-scripts" '
            'style="width:100%;height:520px;border:1px solid #ccc"></iframe>')


def check_outputs(outputs: Sequence, inputs: Sequence[str], force: bool) -> None:
    """Raises InputError where a result would replace what was read, unless `force`."""
    _flexel.check_outputs([path_text(each) for each in outputs if each], list(inputs), force)


def write_whole(data: bytes, path) -> None:
    """Whole or not at all: what is there stays until all is written. Links are followed; devices and FIFOs are written to."""
    target = os.path.realpath(os.fsdecode(path))
    there = os.path.exists(target)
    if there and not os.path.isfile(target):
        with open(target, "wb") as file:
            file.write(data)
        return
    temporary = os.path.join(os.path.dirname(target), ".flexel-" + secrets.token_hex(8))
    try:
        with open(temporary, "xb") as file:
            file.write(data)
        if there:
            shutil.copymode(target, temporary)
        os.replace(temporary, target)
    except BaseException:
        if os.path.exists(temporary):
            os.unlink(temporary)
        raise


def _plain(values, what: str, name: str):
    """Raises InputError where numpy would leave out a part of them: masks, imaginary parts."""
    if np.ma.is_masked(values):
        raise InputError(f"{what} are masked: fill or drop what is", name)
    if np.iscomplexobj(values):
        raise InputError(f"{what} are complex", name)
    return values


def _polygon_table(corners: np.ndarray, points: int, name: str) -> np.ndarray:
    """The rows of a PLY file."""
    if corners.ndim != 2 or not 3 <= corners.shape[1] <= 255 or corners.dtype.kind not in "iu":
        raise InputError(f"faces have the shape {corners.shape} and type {corners.dtype}: (m, 3) indices are needed", name)
    if len(corners) and not (0 <= int(corners.min()) and int(corners.max()) < points):
        raise InputError("a face names a vertex that is not there", name)
    table = np.zeros(len(corners), dtype=[("n", "u1"), ("v", "<i4", (corners.shape[1],))])
    table["n"], table["v"] = corners.shape[1], corners
    return table


class Shown:
    """What has a page in the browser."""

    label: str
    _files: List[str]  # what it was made of, absolute, which results do not replace

    def page(self, *, progress: Progress = None) -> str:
        raise NotImplementedError

    def write_page(self, path, *, force: bool = False) -> None:
        """Writes `page()`. Raises InputError where that is a file that was read, unless `force`."""
        check_outputs([path], self._files, force)
        write_whole(self.page().encode(), path)

    def _repr_html_(self) -> str:
        return _inline(self.page(), self.label)


class Part(Shown):
    """One or more solids as the polygons of their file (`flexel.read`, `Part.from_mesh`)."""

    def __init__(self, core: "_flexel.Part", label: str = "part", warnings: Sequence[str] = (), files: Sequence[str] = ()):
        """files: what it was read from, absolute, which results do not replace."""
        self._core, self.label, self.warnings, self._files = core, label, list(warnings), list(files)

    def _names(self) -> List[str]:
        """What stands for it in a command: its files, or else a name that no file can have."""
        return self._files or [os.path.join(os.devnull, os.path.basename(self.label) or "part")]

    @classmethod
    def from_mesh(cls, vertices, faces, *, unit: str = "m", name: str = "part", edge=None,
                  progress: Progress = None) -> "Part":
        """A part of a (vertices, faces) pair, as trimesh and PyVista have it.

        vertices: (n, 3) in `unit` (a length unit's name; default metres). faces: (m, 3) or (m, 4) indices, outward.
        A mesh without groups is cut into faces at dihedral angles over 30 degrees. Raises InputError.
        """
        options: Dict[str, Any] = {"unit": unit}
        if edge is not None:
            options["edge"] = length(edge)
        return cls._of_polygons(vertices, [faces], options, name, progress)

    @classmethod
    def _of_polygons(cls, vertices, blocks: Sequence, options: Dict[str, Any], name: str, progress: Progress) -> "Part":
        """Of blocks of polygons, which have the same number of corners within a block."""
        if not isinstance(name, str):
            raise TypeError(f"name: {name!r} is of the wrong type")
        points = np.ascontiguousarray(_plain(vertices, "vertices", name), dtype="<f8")
        if points.ndim != 2 or points.shape[1] != 3:
            raise InputError(f"vertices have the shape {points.shape}, not (n, 3)", name)
        tables = [_polygon_table(np.ascontiguousarray(_plain(each, "faces", name)), len(points), name) for each in blocks]
        head = ("ply\nformat binary_little_endian 1.0\n"
                f"element vertex {len(points)}\nproperty double x\nproperty double y\nproperty double z\n"
                f"element face {sum(map(len, tables))}\nproperty list uchar int vertex_indices\nend_header\n")
        file = b"".join([head.encode(), points.tobytes(), *(table.tobytes() for table in tables)])
        core, said = heard(_flexel.part_of_bytes, file, name, options, progress=progress)
        return cls(core, name, said.warnings)

    @classmethod
    def from_meshio(cls, mesh, *, unit: str = "m", name: str = "part") -> "Part":
        """A part of the triangles, quads and polygons of a meshio mesh, in its order, whose points are in `unit`. Raises
        InputError: it has none, or surface cells of another kind, such as "triangle6"."""
        flat = [block for block in mesh.cells if block.dim == 2]
        for block in flat:
            if block.type not in ("triangle", "quad", "polygon"):
                raise InputError(f"the mesh has cells of type {block.type}: make triangles of them", name)
        if not flat:
            raise InputError("the mesh has neither triangles nor quads: extract its surface", name)
        return cls._of_polygons(mesh.points, [block.data for block in flat], {"unit": unit}, name, None)

    @property
    def vertices(self) -> np.ndarray:
        """(n, 3) [m], a view; the file's own order."""
        return self._core.vertices

    @property
    def triangles(self) -> np.ndarray:
        """(m, 3) uint32 indices into `vertices`, of polygons triangulated."""
        return self._core.triangles

    @property
    def polygons(self) -> Tuple[np.ndarray, np.ndarray]:
        """(offsets (p + 1), corners): polygon i has the vertices corners[offsets[i]:offsets[i + 1]]. Views."""
        return self._core.polygon_offsets, self._core.polygon_vertices

    @property
    def polygon_face(self) -> np.ndarray:
        """(p) uint32 index into `faces`, a view."""
        return self._core.polygon_face

    @property
    def faces(self) -> List[Tuple[str, str]]:
        """("part/12", the file's own name for it or "") of each face: what `fix` and `push` can name."""
        return self._core.faces

    @property
    def parts(self) -> List[str]:
        """Names of the solids."""
        return self._core.parts

    @property
    def columns(self) -> Dict[str, np.ndarray]:
        """Attributes of the vertices by name, views."""
        return self._core.vertex_columns

    @property
    def unit(self) -> float:
        """Metres per unit of the file that it came from."""
        return self._core.unit

    def write(self, path, *, force: bool = False, progress: Progress = None) -> None:
        """Writes the mesh, in the unit that it came in; the ending names the format (.stl, .obj, .ply ...). Raises InputError
        where that is a file that it was read from, unless `force`."""
        check_outputs([path], self._files, force)
        heard(_flexel.Part.write, self._core, path_text(path), progress=progress)

    def to_meshio(self):
        """The triangles as a meshio mesh, points in metres."""
        return _need_meshio().Mesh(self.vertices, [("triangle", self.triangles.astype(np.int64))])

    def page(self, *, progress: Progress = None) -> str:
        """The page of `flexel view` (HTML, whole)."""
        page, _ = heard(_flexel.page, [(self.label, self._core)], [], [], "", progress=progress)
        return page

    def __repr__(self) -> str:
        return f"<flexel.Part {self.label!r}: {len(self.vertices)} vertices, {len(self.faces)} faces>"


class Body(Shown):
    """The lattice of a part: elements, cells, and where a run has moved them. It never changes: runs give new ones."""

    def __init__(self, core: "_flexel.Body", summary: str = "", warnings: Sequence[str] = (), label: str = "body",
                 files: Sequence[str] = ()):
        self._core, self._summary, self.warnings, self.label = core, summary, list(warnings), label
        self._files = list(files)

    @property
    def rest(self) -> np.ndarray:
        """(n, 3) [m] where the elements rest, a view."""
        return self._core.rest

    @property
    def position(self) -> np.ndarray:
        """(n, 3) [m] where the elements are, a view."""
        return self._core.position

    @property
    def displacement(self) -> np.ndarray:
        """(n, 3) [m] `position` less `rest`, a view."""
        return self._core.displacement

    @property
    def cell_elements(self) -> np.ndarray:
        """(m, 8) uint32: corner a = i + 2 j + 4 k of each cell; a view. No cells at centre placement."""
        return self._core.cell_elements

    @property
    def fill(self) -> np.ndarray:
        """(m) share of each cell inside the part, in (0, 1]; a view."""
        return self._core.fill

    @property
    def broken(self) -> np.ndarray:
        """(m) uint8, 1: fractured; a view."""
        return self._core.broken

    @property
    def connections(self) -> np.ndarray:
        """(n) uint32, a bit for each half-neighbour (docs/reference/body-file.md); a view."""
        return self._core.connections

    @property
    def lattice_index(self) -> np.ndarray:
        """(n, 3) int32 place in the part's lattice; a view."""
        return self._core.lattice_index

    @property
    def element_columns(self) -> Dict[str, np.ndarray]:
        """Results at the elements by name, such as "von_mises" (n) [Pa] and "principal_stress" (n, 3) [Pa]; views."""
        return self._core.element_columns

    @property
    def cell_columns(self) -> Dict[str, np.ndarray]:
        """Results of the cells by name, such as "cell_von_mises" (m) [Pa]; views."""
        return self._core.cell_columns

    def __getitem__(self, name: str) -> np.ndarray:
        """The column of that name, of the elements or else of the cells."""
        columns = {**self.cell_columns, **self.element_columns}
        if name not in columns:
            raise KeyError(f"no column {name!r}; there are {', '.join(sorted(columns)) or 'none'}")
        return columns[name]

    @property
    def parts(self) -> List[Dict[str, Any]]:
        """name, material, placement, lattice (origin [m], axes, spacing [m]), ranges of elements and cells."""
        return self._core.parts

    @property
    def surface(self) -> Part:
        """The part's own mesh at rest (a copy)."""
        return Part(self._core.surface, self.label, files=self._files)

    @property
    def notes(self) -> Dict[str, str]:
        return self._core.notes

    @property
    def summary(self) -> Dict[str, Any]:
        """What `flexel-voxelize --summary` writes; {} of a body that was read or simulated."""
        return json.loads(self._summary) if self._summary else {}

    def write(self, path, *, compress: bool = False, force: bool = False, progress: Progress = None) -> None:
        """Writes the body (.vtu), byte for byte as the programs do. Raises InputError where that is a file that was read,
        unless `force`."""
        check_outputs([path], self._files, force)
        heard(_flexel.Body.write, self._core, path_text(path), compress, progress=progress)

    def to_meshio(self):
        """The deformed cells as a meshio mesh of hexahedra (points in metres), with `displacement`, `fill` and columns."""
        meshio = _need_meshio()
        cells = self.cell_elements[:, _VTK_TO_LATTICE].astype(np.int64)
        kind = ("hexahedron", cells) if len(cells) else ("vertex", np.arange(len(self.rest))[:, None])
        cell_data = {name: [column] for name, column in self.cell_columns.items()} if len(cells) else {}
        if len(cells):
            cell_data["fill"] = [self.fill]
        return meshio.Mesh(self.position, [kind], point_data={"displacement": self.displacement, **self.element_columns},
                           cell_data=cell_data)

    def page(self, *, progress: Progress = None) -> str:
        """The page of `flexel view` (HTML, whole): the deformed part."""
        page, _ = heard(_flexel.page, [(self.label, self._core)], [], [], "", progress=progress)
        return page

    def __repr__(self) -> str:
        return f"<flexel.Body {self.label!r}: {len(self.rest)} elements, {len(self.cell_elements)} cells>"


class Mapped(Shown):
    """The part's own surface, deformed (`flexel.map`, `Result.part`)."""

    def __init__(self, core: "_flexel.Mapped", body: Body, options: Dict[str, Any], warnings: Sequence[str] = ()):
        self._core, self._body, self._options, self.warnings = core, body, options, list(warnings)
        self.label, self._files = body.label, body._files

    @property
    def body(self) -> Body:
        """The lattice that carries it."""
        return self._body

    @property
    def rest(self) -> np.ndarray:
        """(n, 3) [m] the vertices at rest, a view."""
        return self._core.rest

    @property
    def displacement(self) -> np.ndarray:
        """(n, 3) [m] of the vertices, a view."""
        return self._core.displacement

    @property
    def vertices(self) -> np.ndarray:
        """(n, 3) [m] where the vertices are, a new array."""
        return self.rest + self.displacement

    @property
    def triangles(self) -> np.ndarray:
        """(m, 3) uint32."""
        return self._core.part.triangles

    @property
    def flags(self) -> np.ndarray:
        """(n) uint8: 2, 4 and 8 are failures (docs/reference/mapping.md); a view."""
        return self._core.flags

    @property
    def report(self) -> Dict[str, Any]:
        """What `flexel-map --report` writes; {} of deform, whose summary has it."""
        return json.loads(self._core.report) if self._core.report else {}

    def write(self, path, *, progress: Progress = None, **options) -> None:
        """Maps anew and writes what flexel-map writes to `path`: .stl, .obj, .ply ..., or .step of a CAD part. Raises
        InputError where that is a file that was read, unless force=True."""
        given = words({**self._options, **options})
        heard(_flexel.map, self._body._core, given, path_text(path), self._files, progress=progress)

    def page(self, *, progress: Progress = None) -> str:
        """The page of `flexel view` (HTML, whole)."""
        return self._body.page(progress=progress)

    def to_meshio(self):
        """The deformed triangles as a meshio mesh, points in metres."""
        return _need_meshio().Mesh(self.vertices, [("triangle", self.triangles.astype(np.int64))],
                                   point_data={"displacement": self.displacement})

    def __repr__(self) -> str:
        return f"<flexel.Mapped: {len(self.rest)} vertices>"


class Result(Shown):
    """What a run found (`flexel.simulate`, `flexel.deform`)."""

    def __init__(self, core: "_flexel.Run", said, options: Dict[str, Any], label: str, files: Sequence[str] = ()):
        self._core = core
        self._files = list(files)
        self.body = Body(core.body, label=label, files=files)
        self.warnings: List[str] = list(said.warnings)
        self.lines: List[str] = list(said.lines)
        self._whole = json.loads(core.summary)
        self._map_options = options
        self._part: Optional[Mapped] = None
        self.label = label

    @property
    def summary(self) -> Dict[str, Any]:
        """The summary of the program, SI (docs/reference/json.md): of deform the stages' "voxelize", "simulate", "map"."""
        return self._whole

    @property
    def found(self) -> Dict[str, Any]:
        """What the simulation found (docs/reference/summary.md)."""
        return self._whole.get("simulate", self._whole)

    @property
    def answer(self) -> List[str]:
        """"how far", "how sure", "strength" ... in lines for people."""
        return self._core.answer

    @property
    def probes(self) -> Dict[str, np.ndarray]:
        """(3) [m] displacement by the name of the probe."""
        return {each["name"]: np.array(each["displacement"]) for each in self.found["probes"]}

    @property
    def reactions(self) -> Dict[str, np.ndarray]:
        """(3) [N] by the support on the body, by its name; of supports that share one, their sum."""
        forces: Dict[str, np.ndarray] = {}
        for each in self.found["reactions"]:
            forces[each["name"]] = forces.get(each["name"], np.zeros(3)) + each["force"]
        return forces

    @property
    def largest_displacement(self) -> float:
        """[m]"""
        return self.found["largest_displacement"]

    @property
    def part(self) -> Mapped:
        """The part, deformed."""
        if self._part is None:
            if self._core.mapped is not None:
                self._part = Mapped(self._core.mapped, self.body, self._map_options)
            else:
                core, said = heard(_flexel.map, self.body._core, words(self._map_options), "", [])
                self._part = Mapped(core, self.body, self._map_options, said.warnings)
        return self._part

    def page(self, *, progress: Progress = None) -> str:
        """The page that `flexel deform --html` writes, with what the run said."""
        summary = json.dumps(self._whole) if "simulate" in self._whole else ""
        page, _ = heard(_flexel.page, [(self.label, self.body._core)], self.warnings, self.answer, summary,
                        progress=progress)
        return page

    def __repr__(self) -> str:
        return "<flexel.Result\n  " + "\n  ".join(self.answer) + ">"


class Frame:
    """A state of a run in time, as a callback gets it."""

    def __init__(self, core: "_flexel.Frame", files: Sequence[str] = ()):
        self._core, self._files = core, list(files)

    @property
    def time(self) -> float:
        """[s]"""
        return self._core.time

    def body(self) -> Body:
        """The body as it is now (a copy, to keep). Raises InputError once the callback is over."""
        return Body(self._core.body(), label=f"{self.time:g} s", files=self._files)

# What the module gives to the package around it, which checks and documents (flexel/__init__.py, _objects.py).
from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple, Union

import numpy
from numpy.typing import NDArray

Floats = NDArray[numpy.float64]
Heard = Optional[Callable[[str, float, str, Optional[float]], None]]
version: str

class Said:
    lines: List[str]
    warnings: List[str]

class Part:
    vertices: Floats  # (n, 3) m
    polygon_offsets: NDArray[numpy.uint32]  # (p + 1)
    polygon_vertices: NDArray[numpy.uint32]
    polygon_face: NDArray[numpy.uint32]  # (p)
    vertex_columns: Dict[str, Floats]
    triangles: NDArray[numpy.uint32]  # (m, 3)
    faces: List[Tuple[str, str]]
    parts: List[str]
    unit: float  # m
    def write(self, path: str, heard: Heard) -> Said: ...

class Body:
    rest: Floats  # (n, 3) m
    position: Floats  # (n, 3) m
    displacement: Floats  # (n, 3) m
    lattice_index: NDArray[numpy.int32]  # (n, 3)
    piece: NDArray[numpy.uint16]  # (n)
    connections: NDArray[numpy.uint32]  # (n)
    cell_elements: NDArray[numpy.uint32]  # (m, 8)
    fill: Floats  # (m)
    broken: NDArray[numpy.uint8]  # (m)
    element_columns: Dict[str, Floats]
    cell_columns: Dict[str, Floats]
    notes: Dict[str, str]
    parts: List[Dict[str, Any]]
    surface: Part
    def write(self, path: str, compress: bool, heard: Heard) -> Said: ...

class Frame:
    time: float  # s
    def body(self) -> Body: ...

class Mapped:
    report: str
    part: Part
    rest: Floats  # (n, 3) m
    displacement: Floats  # (n, 3) m
    flags: NDArray[numpy.uint8]  # (n)

class Run:
    body: Body
    mapped: Optional[Mapped]
    summary: str
    answer: List[str]

def set_program_folder(folder: str) -> None: ...
def parse_quantity(text: str, dimension: str) -> float: ...
def read_part(paths: Sequence[str], options: Dict[str, Any], heard: Heard) -> Tuple[Part, Said]: ...
def part_of_bytes(file: bytes, name: str, options: Dict[str, Any], heard: Heard) -> Tuple[Part, Said]: ...
def read_body(path: str, heard: Heard) -> Tuple[Body, Said]: ...
def voxelize(part: Part, options: Dict[str, Any], heard: Heard) -> Tuple[Body, str, Said]: ...
def simulate(body: Body, words: Sequence[str], scene_text: str, scene_name: str, options: Dict[str, Any],
             heard: Heard) -> Tuple[Run, Said]: ...
def map(body: Body, words: Sequence[str], path: str, inputs: Sequence[str], heard: Heard) -> Tuple[Mapped, Said]: ...
def check_outputs(outputs: Sequence[str], inputs: Sequence[str], force: bool) -> None: ...
def deform(words: Sequence[str], part: Optional[Part], heard: Heard) -> Tuple[Run, Said]: ...
def run_command(name: str, words: Sequence[str], heard: Heard) -> Tuple[int, Said]: ...
def picture(shown: Sequence[Tuple[str, Union[Part, Body]]], words: Sequence[str], heard: Heard) -> Tuple[bytes, Said]: ...
def page(shown: Sequence[Tuple[str, Union[Part, Body]]], warnings: Sequence[str], lines: Sequence[str], summary: str,
         heard: Heard) -> Tuple[str, Said]: ...
def materials() -> str: ...

"""Breaks body files by hand: sets `broken` of cells and moves elements, in a plain reading of VTK's file format."""

import re
import struct

import numpy as np

TYPES = {"Float64": "<f8", "Int32": "<i4", "UInt32": "<u4", "Int64": "<i8", "UInt16": "<u2", "UInt8": "u1"}


def arrays_in(data):
    """Views into an appended raw .vtu without compression (a bytearray), by name; writing to them changes it."""
    start = data.index(b"_", data.index(b"<AppendedData")) + 1
    found = {}
    for tag in re.findall(r"<DataArray\b([^>]*)>", bytes(data[:start]).decode("latin-1")):
        attributes = dict(re.findall(r'(\w+)="([^"]*)"', tag))
        at = start + int(attributes["offset"])
        (size,) = struct.unpack_from("<Q", data, at)
        array = np.frombuffer(memoryview(data)[at + 8:at + 8 + size], TYPES[attributes["type"]])
        components = int(attributes.get("NumberOfComponents", 1))
        found.setdefault(attributes["Name"], array.reshape(-1, components) if components > 1 else array)
    return found


STEPS = [(1, 0, 0), (-1, 1, 0), (0, 1, 0), (1, 1, 0), (-1, -1, 1), (0, -1, 1), (1, -1, 1), (-1, 0, 1), (0, 0, 1), (1, 0, 1), (-1, 1, 1),
         (0, 1, 1), (1, 1, 1)]  # of the bits of `connections` (docs/reference/body-file.md)


def tear(rest, torn, side, move, only=None):
    """Writes `torn`: the body `rest`, broken where cells or connections have elements on both sides, and one side moved. `side`: rest
    positions (n x 3, m) to booleans; `move`: the positions of that side to where they go; `only`: middles of cells (n x 3, m) to which of
    them may break: a crack that ends inside."""
    data = bytearray(open(rest, "rb").read())
    arrays = arrays_in(data)
    assert b"vtkZLibDataCompressor" not in data[:2000]
    high = side(arrays["rest"])
    m = int((arrays["types"] == 12).sum())
    cells = arrays["connectivity"][:8 * m].reshape(-1, 8)
    broken = high[cells].any(axis=1) & ~high[cells].all(axis=1)
    arrays["broken"][:m] = broken if only is None else broken & only(arrays["rest"][cells].mean(axis=1))
    if m == 0:
        at = {tuple(index): e for e, index in enumerate(arrays["lattice_index"].tolist())}
        for index, e in at.items():
            for bit, step in enumerate(STEPS):
                other = at.get(tuple(i + s for i, s in zip(index, step)))
                if other is not None and high[e] != high[other]:
                    arrays["connections"][e] &= ~np.uint32(1 << bit)
    arrays["position"][high] = move(arrays["rest"][high])
    open(torn, "wb").write(data)

"""Reads our body files and meshes without any of our code, for comparison with what other tools make of them."""

import re
import struct
import zlib

import numpy as np

TYPES = {"Float64": "<f8", "Float32": "<f4", "Int32": "<i4", "UInt32": "<u4", "Int64": "<i8", "UInt64": "<u8", "UInt16": "<u2",
         "UInt8": "u1", "Int8": "i1", "Int16": "<i2"}


def vtu_arrays(path):
    """Every DataArray of an appended raw .vtu (header_type UInt64), by section and name ("point/rest", "cell/fill", "field/...",
    "points/...", "cells/..."): a plain reading of VTK's file format."""
    data = open(path, "rb").read()
    start = data.index(b"_", data.index(b"<AppendedData")) + 1
    head = data[:start].decode("latin-1")
    compressed = "vtkZLibDataCompressor" in head
    arrays, section = {}, ""
    for element, tag in re.findall(r"<(PointData|CellData|FieldData|Points|Cells|DataArray)\b([^>]*)>", head):
        if element != "DataArray":
            section = element.replace("Data", "").lower()
            continue
        attributes = dict(re.findall(r'(\w+)="([^"]*)"', tag))
        at = start + int(attributes["offset"])
        if compressed:
            blocks, _, _ = struct.unpack_from("<3Q", data, at)
            sizes = struct.unpack_from(f"<{blocks}Q", data, at + 24)
            at += 24 + 8 * blocks
            raw = b""
            for size in sizes:
                raw += zlib.decompress(data[at:at + size])
                at += size
        else:
            size = struct.unpack_from("<Q", data, at)[0]
            raw = data[at + 8:at + 8 + size]
        array = np.frombuffer(raw, TYPES[attributes["type"]])
        components = int(attributes.get("NumberOfComponents", 1))
        arrays[f"{section}/{attributes['Name']}"] = array.reshape(-1, components) if components > 1 else array
    return arrays


def stl_triangles(path):
    """(triangles x 3 x 3) of a binary STL."""
    data = open(path, "rb").read()
    count = struct.unpack_from("<I", data, 80)[0]
    assert len(data) == 84 + 50 * count, f"{path} is {len(data)} bytes for {count} triangles"
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    return np.frombuffer(data, record, count, 84)["corners"].astype(float)


def ascii_stl_triangles(path):
    words = re.findall(r"(?im)^\s*vertex\s+(\S+)\s+(\S+)\s+(\S+)", open(path, encoding="latin-1").read())
    return np.array(words, dtype=float).reshape(-1, 3, 3)


def any_stl_triangles(path):
    data = open(path, "rb").read()
    binary = len(data) >= 84 and len(data) == 84 + 50 * struct.unpack_from("<I", data, 80)[0]
    return stl_triangles(path) if binary else ascii_stl_triangles(path)


def obj_parts(path):
    """Vertices (n x 3) and the corner indices of every face, in order."""
    vertices, faces = [], []
    for line in open(path, encoding="utf-8"):
        words = line.split()
        if words[:1] == ["v"]:
            vertices.append([float(w) for w in words[1:4]])
        elif words[:1] == ["f"]:
            faces.append([int(w.split("/")[0]) for w in words[1:]])
    return np.array(vertices), faces

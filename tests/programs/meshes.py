"""Parts in the formats that carry meshes, made and read without any of our code."""

import io
import json
import struct
import xml.etree.ElementTree as xml
import zipfile

from harness import box_triangles, write


def indexed_box(size=(40.0, 10.0, 10.0)):
    """Vertices and triangles of a box, every corner once."""
    vertices, triangles = [], []
    for triangle in box_triangles(size):
        for corner in triangle:
            if corner not in vertices:
                vertices.append(corner)
        triangles.append([vertices.index(corner) for corner in triangle])
    return vertices, triangles


def ply_box(name="box.ply"):
    """Binary, doubles, with a number of its own at every vertex."""
    vertices, triangles = indexed_box()
    head = ("ply\nformat binary_little_endian 1.0\ncomment by hand\nelement vertex 8\nproperty double x\nproperty double y\n"
            "property double z\nproperty float heat\nelement face 12\nproperty list uchar int vertex_indices\nend_header\n")
    data = head.encode() + b"".join(struct.pack("<3df", *v, n) for n, v in enumerate(vertices))
    return write(name, data + b"".join(struct.pack("<B3i", 3, *t) for t in triangles))


def read_ply(name):
    data = open(name, "rb").read()
    at = data.index(b"end_header\n") + 11
    rows = list(struct.iter_unpack("<3df", data[at:at + 8 * 28]))
    return [row[:3] for row in rows], [row[3] for row in rows], data[:at]


def off_box(name="box.off"):
    vertices, triangles = indexed_box()
    lines = ["OFF", "# by hand", "8 12 0"] + [f"{x} {y} {z}" for x, y, z in vertices] + [f"3 {a} {b} {c}" for a, b, c in triangles]
    return write(name, "\n".join(lines) + "\n")


def read_off(name):
    lines = open(name, encoding="ascii").read().splitlines()
    return [tuple(map(float, line.split())) for line in lines[3:11]], lines


def glb_box(name="box.glb"):
    """In metres, as glTF is."""
    vertices, triangles = indexed_box((0.04, 0.01, 0.01))
    binary = b"".join(struct.pack("<3f", *v) for v in vertices) + b"".join(struct.pack("<3H", *t) for t in triangles)
    document = {"asset": {"version": "2.0", "generator": "hand"}, "scene": 0, "scenes": [{"nodes": [0]}],
                "nodes": [{"mesh": 0, "name": "bar"}],
                "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
                "accessors": [{"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3", "min": [0, 0, 0],
                               "max": [0.04, 0.01, 0.01]}, {"bufferView": 1, "componentType": 5123, "count": 36, "type": "SCALAR"}],
                "bufferViews": [{"buffer": 0, "byteLength": 96}, {"buffer": 0, "byteOffset": 96, "byteLength": 72}],
                "buffers": [{"byteLength": len(binary)}]}
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    return write(name, b"glTF" + struct.pack("<3I", 2, 28 + len(text) + len(binary), len(text)) + b"JSON" + text +
                 struct.pack("<I", len(binary)) + b"BIN\0" + binary)


CONTENT_TYPES = ('<?xml version="1.0"?><Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types"><Default Extension="rels" '
                 'ContentType="application/vnd.openxmlformats-package.relationships+xml"/><Default Extension="model" '
                 'ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/><Default Extension="png" ContentType="image/png"/></Types>')


def threemf_box(name="box.3mf"):
    vertices, triangles = indexed_box()
    model = ('<?xml version="1.0"?><model unit="millimeter" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"><resources>'
             '<object id="1" type="model" name="bar"><mesh><vertices>' + "".join(f'<vertex x="{x}" y="{y}" z="{z}"/>' for x, y, z in vertices) +
             "</vertices><triangles>" + "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in triangles) +
             '</triangles></mesh></object></resources><build><item objectid="1"/></build></model>')
    relation = ('<?xml version="1.0"?><Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships"><Relationship '
                'Target="/3D/3dmodel.model" Id="r" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>')
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("[Content_Types].xml", CONTENT_TYPES)
        archive.writestr("_rels/.rels", relation)
        archive.writestr("3D/3dmodel.model", model)
        archive.writestr("Metadata/thumbnail.png", b"\x89PNG")
    return write(name, file.getvalue())


CORE = "{http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"
PRODUCTION = "{http://schemas.microsoft.com/3dmanufacturing/production/2015/06}"
PACKAGE = "{http://schemas.openxmlformats.org/package/2006/"
MODEL_TYPE = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"
UNITS_OF_3MF = {"micron": 1e-6, "millimeter": 1e-3, "centimeter": 1e-2, "inch": 0.0254, "foot": 0.3048, "meter": 1.0}


def read_3mf(name):
    """(name, vertices in mm in the build's frame, triangles) of every mesh that the build shows, and the root of the model, after checking
    the package and each reference against the specification (core 1.3, production 1.1)."""
    archive = zipfile.ZipFile(name)
    assert archive.testzip() is None and len(set(n.lower() for n in archive.namelist())) == len(archive.namelist()), "a damaged archive"
    types = xml.fromstring(archive.read("[Content_Types].xml"))
    assert {e.get("Extension") for e in types.iter(PACKAGE + "content-types}Default")} >= {"rels", "model"}, "content types"
    relations = [r for r in xml.fromstring(archive.read("_rels/.rels")) if r.get("Type") == MODEL_TYPE]
    assert len(relations) == 1 and relations[0].tag == PACKAGE + "relationships}Relationship", "one model"
    start = relations[0].get("Target").lstrip("/")
    models = {n: xml.fromstring(archive.read(n)) for n in archive.namelist() if n.endswith(".model")}
    objects, uuids = {}, set()
    for file, model in models.items():
        assert model.tag == CORE + "model" and model.get("unit", "millimeter") == models[start].get("unit", "millimeter"), f"{file}: {model.attrib}"
        for node in model.iter():
            uuid = node.get(PRODUCTION + "UUID")
            assert uuid is None or uuid not in uuids, f"{uuid} twice"
            uuids.add(uuid)
        groups = {}
        for resource in model.find(CORE + "resources"):
            number = resource.get("id")
            assert (file, number) not in objects and number not in groups and 0 < int(number) < 2 ** 31, f"id {number}"
            if resource.tag == CORE + "object":
                objects[file, number] = check_object(resource, file, objects, groups)
            else:
                groups[number] = len(resource)
    shown = []
    for item in models[start].find(CORE + "build"):
        unfold_3mf(item, start, [(1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 0, 0)], objects, UNITS_OF_3MF[models[start].get("unit", "millimeter")], shown)
    return shown, models[start]


def check_object(node, file, objects, groups):
    """Corners and properties that are there, and components that come before."""
    pid = node.get("pid")
    assert pid is None or int(node.get("pindex")) < groups[pid], f"{node.attrib}"
    for component in node.iter(CORE + "component"):
        assert (component.get(PRODUCTION + "path", file).lstrip("/"), component.get("objectid")) in objects or component.get(PRODUCTION + "path"), \
            f"{component.attrib} comes later"
    vertices = list(node.iter(CORE + "vertex"))
    for triangle in node.iter(CORE + "triangle"):
        corners = [int(triangle.get(key)) for key in ("v1", "v2", "v3")]
        assert max(corners) < len(vertices) and len(set(corners)) == 3, f"{corners}"
        properties = [triangle.get(key) for key in ("p1", "p2", "p3")]
        assert (properties[1] is None) == (properties[2] is None), f"{properties}"
        for value in filter(None, properties):
            assert int(value) < groups[triangle.get("pid", pid)], f"{triangle.attrib}"
    return node


def unfold_3mf(shown_by, file, outer, objects, unit, shown):
    numbers = [float(x) for x in shown_by.get("transform", "1 0 0 0 1 0 0 0 1 0 0 0").split()]
    rows = [numbers[3 * r:3 * r + 3] for r in range(4)]
    apply = lambda p, m: tuple(sum(p[r] * m[r][c] for r in range(3)) + m[3][c] for c in range(3))
    turn = lambda p, m: tuple(sum(p[r] * m[r][c] for r in range(3)) for c in range(3))
    whole = [turn(row, outer) for row in rows[:3]] + [apply(rows[3], outer)]
    file = shown_by.get(PRODUCTION + "path", file).lstrip("/")
    node = objects[file, shown_by.get("objectid")]
    vertices = [tuple(1000 * unit * x for x in apply([float(v.get(axis)) for axis in "xyz"], whole)) for v in node.iter(CORE + "vertex")]
    if vertices:
        shown.append((node.get("name"), vertices, [[int(t.get(key)) for key in ("v1", "v2", "v3")] for t in node.iter(CORE + "triangle")]))
    for component in node.iter(CORE + "component"):
        unfold_3mf(component, file, whole, objects, unit, shown)


# Sizes by componentType and by type (glTF 2.0, 3.6.2.2), and struct's letters.
COMPONENTS = {5120: "b", 5121: "B", 5122: "h", 5123: "H", 5125: "I", 5126: "f"}
TYPES = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}


def read_glb(name):
    """Positions and triangles of every node with a mesh, after checking the container and every accessor against the specification."""
    data = open(name, "rb").read()
    magic, version, length, size, kind = struct.unpack_from("<4s3I4s", data)
    assert (magic, version, length, kind) == (b"glTF", 2, len(data), b"JSON") and size % 4 == 0, "the GLB's header is wrong"
    document = json.loads(data[20:20 + size])
    binary_size, binary_kind = struct.unpack_from("<I4s", data, 20 + size)
    assert binary_kind == b"BIN\0" and binary_size % 4 == 0 and 28 + size + binary_size == len(data), "the GLB's chunks are wrong"
    binary = data[28 + size:]
    assert document["asset"]["version"] == "2.0" and len(document["buffers"]) == 1
    assert 0 <= binary_size - document["buffers"][0]["byteLength"] < 4, "the buffer is not as long as it says"
    for view in document["bufferViews"]:
        assert view["buffer"] == 0 and view.get("byteOffset", 0) + view["byteLength"] <= document["buffers"][0]["byteLength"], f"{view}"

    def values(number):
        accessor = document["accessors"][number]
        view = document["bufferViews"][accessor["bufferView"]]
        form = "<" + TYPES[accessor["type"]] * COMPONENTS[accessor["componentType"]]
        width = struct.calcsize(form)
        offset, stride = accessor.get("byteOffset", 0), view.get("byteStride", width)
        start = view.get("byteOffset", 0) + offset
        assert start % struct.calcsize(form[-1]) == 0 and (stride % 4 == 0 or "byteStride" not in view), f"misaligned: {accessor} {view}"
        assert offset + stride * (accessor["count"] - 1) + width <= view["byteLength"], f"past its view: {accessor} {view}"
        rows = [struct.unpack_from(form, binary, start + stride * n) for n in range(accessor["count"])]
        for key, least in (("min", min), ("max", max)):
            if key in accessor:
                found = [least(column) for column in zip(*rows)]
                assert all(abs(a - b) <= 1e-6 * max(1e-3, abs(b)) for a, b in zip(accessor[key], found)), f"{key}: {accessor[key]} {found}"
        return rows, accessor

    meshes = []
    for node in document["nodes"]:
        if "mesh" not in node:
            continue
        for primitive in document["meshes"][node["mesh"]]["primitives"]:
            positions, accessor = values(primitive["attributes"]["POSITION"])
            assert accessor["type"] == "VEC3" and accessor["componentType"] == 5126 and "min" in accessor and "max" in accessor
            for attribute in primitive["attributes"].values():
                assert len(values(attribute)[0]) == len(positions), "attributes of different lengths"
            indices = [row[0] for row in values(primitive["indices"])[0]] if "indices" in primitive else list(range(len(positions)))
            assert primitive.get("mode", 4) == 4 and len(indices) % 3 == 0 and max(indices) < len(positions), "indices out of range"
            assert "material" not in primitive or primitive["material"] < len(document["materials"])
            meshes.append((node.get("name", ""), positions, [indices[n:n + 3] for n in range(0, len(indices), 3)]))
    return meshes, document

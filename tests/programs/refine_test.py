"""Triangles too large for the deformation are split (flexel-map --refine), with all that their files hold."""

import json
import math
import os
import re
import struct
import zipfile

from harness import box, box_triangles, expect, expect_error, expect_ok, main, run, write
from meshes import CONTENT_TYPES, CORE, read_3mf
from torn import tear

SIZE = (100.0, 10.0, 6.0)
# Corners of each side, counter-clockwise from outside, and texture coordinates of its own: linear on each side.
CORNERS = [(x, y, z) for z in (0.0, SIZE[2]) for y in (0.0, SIZE[1]) for x in (0.0, SIZE[0])]
SIDES = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
NORMALS = [(0, 0, -1), (0, 0, 1), (0, -1, 0), (0, 1, 0), (-1, 0, 0), (1, 0, 0)]
BEND = ["--material", "PLA", "--fix", "xmin", "--push", "xmax: 0 0 -110 N", "--size", "2 mm", "--no-estimate", "--quiet"]


def uv(side, p):
    """Where a side's picture has this point."""
    return (0.1 * side + 0.003 * p[0] + 0.001 * p[2], 0.02 * p[1] + 0.004 * p[2] - 0.05 * side)


def tint(p):
    return [p[0] / SIZE[0], p[1] / SIZE[1], p[2] / SIZE[2]]


def obj_bar(name="bar.obj", negative=False):
    lines = ["# by hand", "mtllib bar.mtl", "o bar"]
    lines += ["v " + " ".join(f"{c}" for c in (*p, *tint(p))) for p in CORNERS]
    lines += ["vt {} {}".format(*uv(s, CORNERS[c])) for s, side in enumerate(SIDES) for c in side]
    lines += ["vn {} {} {}".format(*n) for n in NORMALS]
    for s, side in enumerate(SIDES):
        lines += [f"g side{s}", f"usemtl paint{s % 2}", "s off"]
        if negative:
            lines.append("f " + " ".join(f"{c - 8}/{4 * s + k - 24}/{s - 6}" for k, c in enumerate(side)))
        else:
            lines.append("f " + " ".join(f"{c + 1}/{4 * s + k + 1}/{s + 1}" for k, c in enumerate(side)))
    return write(name, "\n".join(lines) + "\n")


def glb_bar(name="bar.glb"):
    """Every side with corners of its own, normals, texture coordinates and colours; two materials."""
    floats, indices = [], []
    for s, side in enumerate(SIDES):
        for c in side:
            floats.append((*[x / 1000 for x in CORNERS[c]], *NORMALS[s], *uv(s, CORNERS[c]), *tint(CORNERS[c])))
        indices.append([4 * s + i for i in (0, 1, 2, 0, 2, 3)])
    vertices = b"".join(struct.pack("<11f", *row) for row in floats)
    first, second = sum(indices[:3], []), sum(indices[3:], [])
    listed = struct.pack("<36H", *first, *second)
    accessors = [{"bufferView": 0, "byteOffset": at, "componentType": 5126, "count": 24, "type": kind}
                 for at, kind in ((0, "VEC3"), (12, "VEC3"), (24, "VEC2"), (32, "VEC3"))]
    accessors[0].update(min=[0, 0, 0], max=[x / 1000 for x in SIZE])
    accessors += [{"bufferView": 1, "byteOffset": 36 * n, "componentType": 5123, "count": 18, "type": "SCALAR"} for n in (0, 1)]
    attributes = {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2, "COLOR_0": 3}
    head = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0, "name": "bar"}],
            "meshes": [{"primitives": [{"attributes": attributes, "indices": 4 + n, "material": n} for n in (0, 1)]}],
            "materials": [{"name": "low"}, {"name": "high"}], "accessors": accessors,
            "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": len(vertices), "byteStride": 44},
                            {"buffer": 0, "byteOffset": len(vertices), "byteLength": 72}],
            "buffers": [{"byteLength": len(vertices) + 72}]}
    return write(name, glb(head, vertices + listed))


def glb(head, binary):
    text = json.dumps(head).encode()
    text += b" " * (-len(text) % 4)
    binary += b"\0" * (-len(binary) % 4)
    return (struct.pack("<3I", 0x46546C67, 2, 28 + len(text) + len(binary)) + struct.pack("<2I", len(text), 0x4E4F534A) + text
            + struct.pack("<2I", len(binary), 0x004E4942) + binary)


def read_glb(name):
    data = open(name, "rb").read()
    size = struct.unpack_from("<I", data, 12)[0]
    return json.loads(data[20:20 + size]), data[28 + size:]


def accessor(head, binary, number):
    it = head["accessors"][number]
    view = head["bufferViews"][it["bufferView"]]
    n = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}[it["type"]]
    code = {5126: "f", 5123: "H", 5125: "I"}[it["componentType"]]
    stride = view.get("byteStride", n * struct.calcsize(code))
    at = view.get("byteOffset", 0) + it.get("byteOffset", 0)
    return [struct.unpack_from(f"<{n}{code}", binary, at + i * stride) for i in range(it["count"])]


def ply_bar(name="bar.ply", encoding="ascii", index="int"):
    """Colours at the vertices, texture coordinates of each corner of a face, a number of each face."""
    head = f"ply\nformat {encoding} 1.0\ncomment by hand\nelement vertex 8\n"
    head += "".join(f"property double {c}\n" for c in "xyz") + "".join(f"property uchar {c}\n" for c in ("red", "green", "blue"))
    head += f"element face 6\nproperty list uchar {index} vertex_indices\nproperty list uchar float texcoord\nproperty int side\n"
    head += "element edge 1\nproperty int vertex1\nproperty int vertex2\nend_header\n"
    rows = [(*p, *[round(255 * c) for c in tint(p)]) for p in CORNERS]
    faces = [(side, [x for c in side for x in uv(s, CORNERS[c])], s) for s, side in enumerate(SIDES)]
    if encoding == "ascii":
        lines = [" ".join(map(str, row)) for row in rows]
        lines += [" ".join(map(str, (4, *side, 8, *t, s))) for side, t, s in faces] + ["0 1"]
        return write(name, head + "\n".join(lines) + "\n")
    order = "<" if "little" in encoding else ">"
    data = b"".join(struct.pack(order + "3d3B", *row) for row in rows)
    code = {"int": "i", "uchar": "B"}[index]
    data += b"".join(struct.pack(order + "B4" + code + "B8fi", 4, *side, 8, *t, s) for side, t, s in faces)
    return write(name, head.encode() + data + struct.pack(order + "2i", 0, 1))


def read_ply(name):
    """Vertices with colours; faces with their corners' texture coordinates and the number of their side."""
    data = open(name, "rb").read()
    at = data.index(b"end_header\n") + 11
    head = data[:at].decode().split()
    counts = [int(head[n + 2]) for n, word in enumerate(head) if word == "element"]
    if "ascii" in head:
        words = iter(data[at:].split())
        take = lambda code: [(int if c in "iB" else float)(next(words)) for c in code]
    else:
        order = "<" if "binary_little_endian" in head else ">"

        def take(code):
            nonlocal at
            found = struct.unpack_from(order + code, data, at)
            at += struct.calcsize("=" + code)
            return list(found)
    vertices = [take("dddBBB") for _ in range(counts[0])]
    faces = []
    for _ in range(counts[1]):
        corners = take("i" * take("B")[0])
        faces.append((corners, take("f" * take("B")[0]), take("i")[0]))
    return vertices, faces, [take("ii") for _ in range(counts[2])]


def off_bar(name="bar.off"):
    lines = ["COFF", "# by hand", "8 6 12"]
    lines += [" ".join(f"{c}" for c in p) + " " + " ".join(f"{round(255 * c)}" for c in tint(p)) + " 255" for p in CORNERS]
    lines += ["4 " + " ".join(map(str, side)) + f" {40 * s} 0 0" for s, side in enumerate(SIDES)]
    return write(name, "\n".join(lines) + "\n")


def stl_bar(name="bar.stl"):
    lines = ["solid bar"]
    for triangle in box_triangles(SIZE):
        lines += ["facet normal 0 0 0", "outer loop"] + ["vertex {} {} {}".format(*p) for p in triangle] + ["endloop", "endfacet"]
    return write(name, "\n".join(lines + ["endsolid bar"]) + "\n")


def threemf_bar(name="bar.3mf", extra=""):
    """Every side's texture coordinates, or the colours of its corners; two meshes of one file would share the groups."""
    coords = "".join('<m:tex2coord u="{}" v="{}"/>'.format(*uv(s, CORNERS[c])) for s, side in enumerate(SIDES) for c in side)
    colors = "".join('<m:color color="#' + "".join(f"{round(255 * x):02X}" for x in tint(p)) + '"/>' for p in CORNERS)
    triangles = ""
    for s, side in enumerate(SIDES):
        for corners in ((0, 1, 2), (0, 2, 3)):
            v = [side[i] for i in corners]
            p = v if s % 2 else [4 * s + i for i in corners]
            triangles += '<triangle v1="{}" v2="{}" v3="{}" pid="{}" p1="{}" p2="{}" p3="{}"{}/>\n'.format(*v, 4 if s % 2 else 3, *p, extra)
    model = ('<model unit="millimeter" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02" '
             'xmlns:m="http://schemas.microsoft.com/3dmanufacturing/material/2015/02"><metadata name="Title">by hand</metadata><resources>'
             '<m:texture2d id="2" path="/3D/t.png" contenttype="image/png"/>'
             f'<m:texture2dgroup id="3" texid="2">{coords}</m:texture2dgroup><m:colorgroup id="4">{colors}</m:colorgroup>'
             '<object id="7" name="bar" pid="4" pindex="0"><mesh><vertices>' + "".join('<vertex x="{}" y="{}" z="{}"/>'.format(*p) for p in CORNERS) +
             f'</vertices><triangles>{triangles}</triangles></mesh></object></resources><build>%s</build></model>')
    return lambda items: threemf(name, model % items)


def threemf(name, model):
    with zipfile.ZipFile(name, "w") as archive:
        archive.writestr("[Content_Types].xml", CONTENT_TYPES)
        archive.writestr("_rels/.rels", '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships"><Relationship Id="r" '
                         'Target="/3D/m.model" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>')
        archive.writestr("3D/m.model", model)
        archive.writestr("3D/t.png", b"\x89PNG")
    return name


SERIES = ('<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1"><Collection>\n'
          '<DataSet timestep="0" file="{}"/>\n<DataSet timestep="1" file="{}"/>\n</Collection></VTKFile>\n')
BARS = {"stl": stl_bar, "obj": obj_bar, "ply": ply_bar, "off": off_bar, "glb": glb_bar,
        "3mf": lambda: threemf_bar()('<item objectid="7"/>')}


def near(a, b, tolerance=1e-5):
    return len(a) == len(b) and all(abs(x - y) <= tolerance for x, y in zip(a, b))


def info(name):
    return json.loads(expect_ok(run("flexel", "info", name, "--json")).out)["files"][0]["parts"][0]


def rest(name):
    return expect_ok(run("flexel-voxelize", name, "--size", "2 mm", "--quiet", "-o", "rest.vtu")) and "rest.vtu"


def bent(name, body="bent.vtu"):
    """The bar's end moves by half of its length."""
    expect_ok(run("flexel", "deform", name, *BEND, "-o", body))
    return body


def split(name, out, how="7 mm"):
    """The bar at rest, split: what is linear on its sides must stay so."""
    found = expect_ok(run("flexel-map", rest(name), "--refine", how, "-o", out))
    expect("triangles became" in found.err, found.err)
    part = info(out)
    expect(part["closed"] and abs(part["volume"] / 6e-6 - 1) < 1e-6 and part["triangles"] > 600, f"{part}")


def read_obj(name):
    lines, kinds = open(name).read().splitlines(), {"v": [], "vt": [], "vn": []}
    faces, group, paint = [], None, None
    for words in (line.split() for line in lines if line):
        if words[0] in kinds:
            kinds[words[0]].append([float(x) for x in words[1:]])
        elif words[0] == "g":
            group = words[1]
        elif words[0] == "usemtl":
            paint = words[1]
        elif words[0] == "f":
            faces.append((group, paint, [[int(x) - 1 for x in word.split("/")] for word in words[1:]]))
    return lines, kinds, faces


def test_obj_keeps_texture_coordinates_groups_materials_and_colours():
    for negative in (False, True):
        obj_bar(negative=negative)
        split("bar.obj", "out.obj")
        lines, kinds, faces = read_obj("out.obj")
        expect(lines[:3] == ["# by hand", "mtllib bar.mtl", "o bar"] and lines.count("s off") == 6, f"{lines[:9]}")
        for group, paint, corners in faces:
            side = int(group[4:])
            expect(paint == f"paint{side % 2}" and len(corners) == 3, f"{group} {paint}")
            for v, t, n in corners:
                p = kinds["v"][v]
                expect(near(kinds["vt"][t], uv(side, p)), f"{kinds['vt'][t]} at {p} of side {side}")
                expect(near(kinds["vn"][n], NORMALS[side]), "a flat side at rest")
                expect(near(p[3:], tint(p)), f"{p}")
        expect(len({t for _, _, corners in faces for _, t, _ in corners}) > len(kinds["v"]), "seams have two of them")
        expect([line for line in lines if line.startswith("v ")][:8] ==
               [line for line in open("bar.obj").read().splitlines() if line.startswith("v ")], "the file's own come first")


def test_obj_normals_turn_with_the_bent_side():
    obj_bar()
    expect_ok(run("flexel-map", bent("bar.obj"), "-o", "out.obj", "--strict"))
    _, kinds, faces = read_obj("out.obj")
    top = [(kinds["v"][v], kinds["vn"][n]) for group, _, corners in faces if group == "side1" for v, _, n in corners]
    low, high = min(top), max(top)
    expect(low[1][2] > 0.99 and 0.5 < high[1][0] < 0.85, f"upright where it is held, over 30 degrees at the end: {low} {high}")


def test_glb_keeps_texture_coordinates_normals_colours_and_materials():
    glb_bar()
    split("bar.glb", "out.glb")
    head, binary = read_glb("out.glb")
    expect([m["name"] for m in head["materials"]] == ["low", "high"] and len(head["meshes"]) == 1, f"{head}")
    for primitive in head["meshes"][0]["primitives"]:
        columns = {name: accessor(head, binary, number) for name, number in primitive["attributes"].items()}
        listed = [i for i, in accessor(head, binary, primitive["indices"])]
        expect(len(listed) > 300 and max(listed) < len(columns["POSITION"]), f"{len(listed)}")
        for triangle in zip(listed[::3], listed[1::3], listed[2::3]):
            side = NORMALS.index(tuple(round(x) for x in columns["NORMAL"][triangle[0]]))
            expect((side < 3) == (primitive["material"] == 0), "the material of its side")
            for v in triangle:
                p = [1000 * x for x in columns["POSITION"][v]]
                expect(near(columns["NORMAL"][v], NORMALS[side]), f"{columns['NORMAL'][v]}")
                expect(near(columns["TEXCOORD_0"][v], uv(side, p)), f"{columns['TEXCOORD_0'][v]} at {p} of side {side}")
                expect(near(columns["COLOR_0"][v], tint(p)), f"{columns['COLOR_0'][v]} at {p}")


def test_glb_shown_by_two_nodes_is_split_for_each():
    glb_bar()
    head, binary = read_glb("bar.glb")
    head["nodes"] = [{"mesh": 0, "name": "left"}, {"mesh": 0, "name": "right", "translation": [0, 0.1, 0], "scale": [1, -1, 1]}]
    head["scenes"][0]["nodes"] = [0, 1]
    write("two.glb", glb(head, binary))
    expect_ok(run("flexel-map", rest("two.glb"), "--refine", "7 mm", "-o", "out.glb"))
    parts = json.loads(expect_ok(run("flexel", "info", "out.glb", "--json")).out)["files"][0]["parts"]
    expect([p["name"] for p in parts] == ["left", "right"], f"{parts}")
    expect(all(p["closed"] and abs(p["volume"] / 6e-6 - 1) < 1e-6 and p["triangles"] > 600 for p in parts), f"{parts}")
    expect_ok(run("flexel", "deform", "two.glb", *BEND, "-o", "bent.vtu"))
    bent_parts = expect_ok(run("flexel-map", "bent.vtu", "-o", "out.glb", "--strict")) and \
        json.loads(expect_ok(run("flexel", "info", "out.glb", "--json")).out)["files"][0]["parts"]
    expect(all(p["closed"] and abs(p["volume"] / 6e-6 - 1) < 0.01 for p in bent_parts), f"{bent_parts}")


def test_ply_keeps_colours_lists_and_numbers():
    for encoding in ("ascii", "binary_little_endian", "binary_big_endian"):
        ply_bar(encoding=encoding)
        split("bar.ply", "out.ply")
        vertices, faces, edges = read_ply("out.ply")
        expect(b"comment by hand" in open("out.ply", "rb").read() and edges == [[0, 1]], f"{edges}")
        for v in vertices:
            expect(near(v[3:], [255 * c for c in tint(v)], 3), f"{v}")
        for corners, texture, side in faces:
            for n, v in enumerate(corners):
                expect(near(texture[2 * n:2 * n + 2], uv(side, vertices[v])), f"{texture} {vertices[v]} {side}")
    ply_bar(encoding="binary_little_endian", index="uchar")
    expect_error(run("flexel-map", rest("bar.ply"), "--refine", "3 mm", "-o", "out.ply"), "flexel-map", "bar.ply", "8 bits",
                 "--keep-vertices")


def test_off_keeps_colours():
    off_bar()
    split("bar.off", "out.off")
    words = [line.split() for line in open("out.off").read().splitlines() if not line.startswith("#")]
    expect(words[0] == ["COFF"], f"{words[:2]}")
    vertices = [[float(x) for x in row] for row in words[2:2 + int(words[1][0])]]
    faces = words[2 + int(words[1][0]):]
    expect(len(faces) == int(words[1][1]) and faces, "as many as it says")
    for v in vertices:
        expect(near(v[3:], [255 * c for c in tint(v)] + [255], 3), f"{v}")
    for row in faces:
        side = int(row[4]) // 40
        for v in row[1:4]:
            axis = max(range(3), key=lambda a: abs(NORMALS[side][a]))
            expect(abs(vertices[int(v)][axis] - (SIZE[axis] if sum(NORMALS[side]) > 0 else 0)) < 1e-9, f"{row} lies on side {side}")


def test_3mf_keeps_texture_coordinates_colours_and_uses():
    """Shown as it is, and a mirrored one: each use has triangles and corners of its own, and they share the groups."""
    threemf_bar()('<item objectid="7" partnumber="a"/><item objectid="7" partnumber="b" transform="1 0 0 0 -1 0 0 0 1 0 -20 0"/>')
    expect_ok(run("flexel-map", rest("bar.3mf"), "--refine", "7 mm", "-o", "out.3mf"))
    shown, model = read_3mf("out.3mf")
    expect([n for n, _, _ in shown] == ["bar", "bar"] and all(len(t) > 600 for _, _, t in shown), f"{[len(t) for _, _, t in shown]}")
    parts = json.loads(expect_ok(run("flexel", "info", "out.3mf", "--json")).out)["files"][0]["parts"]
    expect(all(p["closed"] and abs(p["volume"] / 6e-6 - 1) < 1e-6 for p in parts), f"{parts}")
    expect([m.text for m in model.iter(CORE + "metadata")] == ["by hand"], "the file's own metadata")
    groups = {node.get("id"): list(node) for node in model.find(CORE + "resources")}
    colors = [[int(node.get("color")[i:i + 2], 16) for i in (1, 3, 5)] for node in groups["4"]]
    coordinates = [(float(node.get("u")), float(node.get("v"))) for node in groups["3"]]
    seen = set()
    for node in model.iter(CORE + "object"):
        vertices = [tuple(float(v.get(a)) for a in "xyz") for v in node.iter(CORE + "vertex")]
        expect(vertices[:8] == CORNERS, "the file's own come first")
        for t in node.iter(CORE + "triangle"):
            corners = [vertices[int(t.get(key))] for key in ("v1", "v2", "v3")]
            (side,) = [s for s, n in enumerate(NORMALS) if all(abs(sum(a * b for a, b in zip(n, p)) - max(0, sum(a * b for a, b in zip(n, SIZE)))) < 1e-9
                                                               for p in corners)]
            seen.add(side)
            for p, key in zip(corners, ("p1", "p2", "p3")):
                if side % 2:
                    expect(t.get("pid") == "4" and near(colors[int(t.get(key))], [255 * c for c in tint(p)], 1.01), f"{p} {t.attrib}")
                else:
                    expect(t.get("pid") == "3" and near(coordinates[int(t.get(key))], uv(side, p)), f"{p} {t.attrib}")
    expect(seen == set(range(6)), f"{seen}")
    expect_ok(run("flexel", "deform", "bar.3mf", *BEND, "-o", "bent.vtu"))
    expect_ok(run("flexel-map", "bent.vtu", "-o", "bent.3mf", "--strict"))
    parts = json.loads(expect_ok(run("flexel", "info", "bent.3mf", "--json")).out)["files"][0]["parts"]
    expect(all(p["closed"] and abs(p["volume"] / 6e-6 - 1) < 0.01 for p in parts), f"{parts}")


def test_3mf_triangles_with_paint_stay_whole():
    threemf_bar(extra=' paint_color="4"')('<item objectid="7"/>')
    found = expect_ok(run("flexel-map", bent("bar.3mf"), "-o", "out.3mf"))
    expect('were not split: bar.3mf: holds triangles with "paint_color"' in found.err, found.err)
    expect(info("out.3mf")["triangles"] == 12, "as it was")
    expect_error(run("flexel-map", "bent.vtu", "--refine", "7 mm", "-o", "x.3mf"), "flexel-map", "paint_color", "--keep-vertices")


def test_a_bent_bar_keeps_its_volume_in_every_format():
    """52 mm of 100: twelve triangles stay straight and lose a tenth of it."""
    for ending, bar in BARS.items():
        bar()
        body = bent(f"bar.{ending}")
        kept = run("flexel-map", body, "--keep-vertices", "-o", f"kept.{ending}")
        expect("stay flat where the part bends" in kept.err and "--refine" in expect_ok(kept).err, kept.err)
        found = expect_ok(run("flexel-map", body, "-o", f"fine.{ending}", "--strict", "--report", "report.json"))
        expect("12 triangles became" in found.err and "--keep-vertices" in found.err, found.err)
        report = json.load(open("report.json"))
        expect(report["valid"] and report["split_from"] == 12 and report["failures"]["coarse_triangles"] == 0, f"{report}")
        coarse, fine = info(f"kept.{ending}"), info(f"fine.{ending}")
        expect(coarse["volume"] < 5.5e-6 and coarse["triangles"] == 12, f"{coarse}")
        expect(fine["closed"] and abs(fine["volume"] / 6e-6 - 1) < 0.01 and fine["triangles"] > 100, f"{fine}")


def test_an_end_that_moves_without_turning_bends_the_bar():
    """An S, which a straight line misses by 4.9 % of the move only; in the middle by nothing."""
    box()
    for move in ("-0.1", "-8"):
        said = expect_ok(run("flexel", "deform", "box.stl", "--size", "2.5mm", "--material", "PLA", "--fix", "xmin", "--move", f"xmax: 0 0 {move} mm",
                             "--verbose", "-o", "s.stl", "--force")).err
        expect("triangles became" in said, said)


def test_nothing_coarse_changes_nothing():
    for ending, bar in BARS.items():
        bar()
        expect_ok(run("flexel", "deform", f"bar.{ending}", *BEND[:5], "xmax: 500 0 0 N", *BEND[6:], "-o", "body.vtu"))
        expect_ok(run("flexel-map", "body.vtu", "-o", f"auto.{ending}"))
        expect_ok(run("flexel-map", "body.vtu", "--refine", "off", "-o", f"off.{ending}"))
        expect(open(f"auto.{ending}", "rb").read() == open(f"off.{ending}", "rb").read(), ending)
        expect(info(f"auto.{ending}")["triangles"] == 12, ending)


def test_threads_give_the_same_file():
    obj_bar()
    bent("bar.obj")
    for n in (1, 3):
        expect_ok(run("flexel-map", "bent.vtu", "--threads", n, "-o", f"out{n}.obj"))
    expect(open("out1.obj").read() == open("out3.obj").read(), "the same bytes")


def test_what_cannot_be_split_stays_and_is_named():
    glb_bar()
    head, binary = read_glb("bar.glb")
    head["meshes"][0]["primitives"][0]["targets"] = [{"POSITION": 0}]
    write("morph.glb", glb(head, binary))
    body = bent("morph.glb")
    found = expect_ok(run("flexel-map", body, "-o", "out.glb"))
    expect("were not split: morph.glb" in found.err and "morph targets" in found.err and "stay flat" in found.err, found.err)
    expect(info("out.glb")["triangles"] == 12, "as it was")
    expect("--refine" not in found.err, f"what would be refused is not advised: {found.err}")
    expect_error(run("flexel-map", body, "--strict", "-o", "strict.glb"), "flexel-map", "stay flat", code=4)
    expect_error(run("flexel-map", body, "--refine", "auto", "-o", "x.glb"), "flexel-map", "morph.glb", "morph targets", "--edge")
    # Another format does not hold them anyway.
    expect_ok(run("flexel-map", body, "--strict", "-o", "out.stl"))
    expect(not os.path.exists("strict.glb") and not os.path.exists("x.glb"), "nothing is written")


def test_series_have_the_same_triangles_in_every_frame():
    obj_bar()
    rest("bar.obj")
    bent("bar.obj")
    write("run.pvd", SERIES.format("rest.vtu", "bent.vtu"))
    found = expect_ok(run("flexel-map", "run.pvd", "-o", "out.obj", "--report", "report.json", "--strict"))
    expect(found.err.count("triangles became") == 1, found.err)
    faces = [[line for line in open(f"out_0000{n}.obj") if line[0] in "fg"] for n in (0, 1)]
    expect(faces[0] == faces[1] and len(faces[0]) > 100, "the same triangles")
    expect(abs(info("out_00000.obj")["volume"] / 6e-6 - 1) < 1e-6 and abs(info("out_00001.obj")["volume"] / 6e-6 - 1) < 0.01, "of both")
    expect_ok(run("flexel-map", "run.pvd", "-o", "kept.obj", "--keep-vertices"))
    expect(open("kept_00000.obj").read() == open("bar.obj").read(), "the file itself")
    expect_ok(run("flexel-map", "run.pvd", "-o", "even.obj", "--refine", "9 mm"))
    expect(info("even_00000.obj")["triangles"] == info("even_00001.obj")["triangles"] > 300, "to an edge too")


def test_other_meshes_are_split_as_well():
    obj_bar()
    bent("bar.obj")
    found = expect_ok(run("flexel-map", "bent.vtu", "--onto", "bar.obj", "-o", "out.obj", "--strict"))
    expect("triangles became" in found.err, found.err)
    _, kinds, faces = read_obj("out.obj")
    expect(len(kinds["vt"]) > 100 and {paint for _, paint, _ in faces} == {"paint0", "paint1"}, "with what their file holds")
    expect(abs(info("out.obj")["volume"] / 6e-6 - 1) < 0.01, "and its volume")


def longest_hole(name):
    """Of the STL's edges that one triangle has, corners within 0.1 mm being one: the length of the longest."""
    data, count = open(name, "rb").read(), {}
    for n in range(struct.unpack_from("<I", data, 80)[0]):
        at = [tuple(round(c, 1) for c in struct.unpack_from("<3f", data, 96 + 50 * n + 12 * k)) for k in range(3)]
        for k in range(3):
            edge = tuple(sorted((at[k], at[(k + 1) % 3])))
            count[edge] = count.get(edge, 0) + 1
    return max((math.dist(*edge) for edge, users in count.items() if users == 1), default=0)


def noisy_stl():
    """Every second triangle off by what single precision makes of a coordinate."""
    lines = ["solid bar"]
    for n, triangle in enumerate(box_triangles(SIZE)):
        corners = ["vertex {:.7f} {:.7f} {:.7f}".format(*(c + 2e-6 * (n % 2) for c in p)) for p in triangle]
        lines += ["facet normal 0 0 0", "outer loop", *corners, "endloop", "endfacet"]
    return write("noisy.stl", "\n".join(lines + ["endsolid bar"]) + "\n")


def noisy_obj():
    """The upper side has corners of its own, not quite at those of the others."""
    lines = [f"v {x} {y} {z}" for x, y, z in CORNERS] + [f"v {x + 1e-6} {y} {z}" for x, y, z in CORNERS[4:]]
    lines += ["f " + " ".join(str(c + (5 if s == 1 else 1)) for c in side) for s, side in enumerate(SIDES)]
    return write("noisy.obj", "\n".join(lines) + "\n")


def t_junction_obj():
    """A side has a corner more, in the middle of an edge of the upper one."""
    sides = [list(side) for side in SIDES]
    sides[2].insert(3, 8)
    lines = [f"v {x} {y} {z}" for x, y, z in [*CORNERS, (30, 0, 6)]]
    return write("junction.obj", "\n".join(lines + ["f " + " ".join(str(c + 1) for c in side) for side in sides]) + "\n")


def test_seams_that_do_not_fit_exactly_stay_closed():
    for make, longest in ((noisy_stl, 0), (noisy_obj, 0), (t_junction_obj, 20)):
        name = make()
        body = bent(name)
        expect_ok(run("flexel-map", body, "--strict", "-o", "out.stl", "--report", "out.json", "--force"))
        report = json.load(open("out.json"))
        expect(abs(report["volume_after"] / report["volume_before"] - 1) < 0.005, f"{name}: {report['volume_after']}")
        expect(longest_hole("out.stl") <= longest, f"{name}: a hole of {longest_hole('out.stl')} mm")
        expect_ok(run("flexel-voxelize", "out.stl", "--size", "2 mm", "-o", "again.vtu", "--force"))
        # Whole, such a part is no better than one that fits.
        refused = run("flexel-map", body, "--strict", "--keep-vertices", "-o", "x.stl")
        expect_error(refused, "flexel-map", "stay flat", code=4)
        expect(refused.err.count("stay flat") == 1, f"said once: {refused.err}")


def test_ply_with_other_blanks_labels_and_faces_by_number():
    ply_bar()
    text = open("bar.ply").read().replace("element vertex 8", "element  vertex\t8").replace("uchar blue\n", "uchar blue\nproperty int label\n")
    lines = text.split("\n")
    first = lines.index("end_header") + 1
    for v in range(8):
        lines[first + v] += f" {10 * (v % 2)}"
    write("label.ply", "\n".join(lines))
    body = bent("label.ply")
    expect_ok(run("flexel-map", body, "-o", "label_out.ply", "--strict"))
    out = open("label_out.ply").read().split("\n")
    first = out.index("end_header") + 1
    count = int(next(line for line in out if line.startswith("element vertex")).split()[2])
    labels = [line.split()[6] for line in out[first:first + count]]
    expect(count > 50 and set(labels) == {"0", "10"}, f"{set(labels)}")
    reds = {line.split()[3] for line in out[first:first + count]}
    expect(len(reds) > 2, "colours lie between")
    text = open("bar.ply").read().replace("element edge 1\nproperty int vertex1\nproperty int vertex2", "element seam 1\nproperty int face\nproperty int to")
    write("seam.ply", text)
    body = bent("seam.ply", "seam.vtu")
    whole = expect_ok(run("flexel-map", body, "-o", "seam_out.ply"))
    expect("were not split: seam.ply: holds numbers of faces" in whole.err and '"face"' in whole.err, whole.err)
    expect(info("seam_out.ply")["triangles"] == 12, "as it was")
    expect_error(run("flexel-map", body, "-o", "x.ply", "--refine", "5 mm"), "flexel-map", "numbers of faces", "--keep-vertices", "--edge")


def test_glb_labels_stay_labels():
    glb_bar()
    head, binary = read_glb("bar.glb")
    head["bufferViews"].append({"buffer": 0, "byteOffset": len(binary), "byteLength": 48})
    binary += struct.pack("<24H", *[100 * (i // 4) + 3 for i in range(24)])
    head["accessors"].append({"bufferView": 2, "componentType": 5123, "count": 24, "type": "SCALAR"})
    head["buffers"][0]["byteLength"] = len(binary)
    for primitive in head["meshes"][0]["primitives"]:
        primitive["attributes"]["_BATCHID"] = len(head["accessors"]) - 1
    # Within a side, too, there are two of them.
    binary = binary[:-2] + struct.pack("<H", 900)
    write("batch.glb", glb(head, binary))
    expect_ok(run("flexel-map", bent("batch.glb"), "-o", "out.glb", "--strict"))
    head, binary = read_glb("out.glb")
    number = head["meshes"][0]["primitives"][0]["attributes"]["_BATCHID"]
    expect(head["accessors"][number]["componentType"] == 5123 and head["accessors"][number]["count"] > 50, f"{head['accessors'][number]}")
    found = {x for x, in accessor(head, binary, number)}
    expect(found == {3, 103, 203, 303, 403, 503, 900}, f"{found}")


def test_obj_numbers_keep_their_places():
    obj_bar()
    text = open("bar.obj").read()
    tiny = text.replace("v 0.0 0.0 0.0 0.0", "v 0.0 0.0 0.0 1e-400")
    expect(tiny != text, "a colour that no double holds")
    write("tiny.obj", tiny)
    expect_ok(run("flexel-map", bent("tiny.obj"), "-o", "tiny_out.obj", "--strict"))
    new = [line.split() for line in open("tiny_out.obj") if line.startswith("v ")]
    expect(len(new) > 50 and all(len(words) == 7 for words in new), f"{[w for w in new if len(w) != 7][:3]}")
    # A small box besides, of polygons that are not split, with texture coordinates that the file does not have.
    knob = [(50 + x, 4 + y, 5.5 + z) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
    lines = ["o knob"] + ["v {} {} {}".format(*p) for p in knob] + ["f " + " ".join(f"{c + 9}/99" for c in side) for side in SIDES]
    write("knob.obj", text + "\n".join(lines) + "\n")
    expect_ok(run("flexel-voxelize", "knob.obj", "--size", "2 mm", "-o", "knob.vtu"))
    expect_ok(run("flexel-map", "knob.vtu", "--refine", "7 mm", "-o", "knob_out.obj"))
    out = open("knob_out.obj").read()
    expect(out.count("\nvt ") >= 99 and "/99" not in out.split("o knob")[1], "they name nothing new")


def test_pieces_alone_and_cut_surfaces():
    stl_bar()
    body = bent("bar.stl")
    expect_ok(run("flexel-map", body, "--crack", "cap", "--pieces", "even_{piece}.stl", "--refine", "5 mm"))
    expect_ok(run("flexel-map", body, "--crack", "cap", "--pieces", "auto_{piece}.stl"))
    expect(info("even_bar.stl")["triangles"] > 1000, "to an edge")
    expect(info("auto_bar.stl")["triangles"] > 100, "and where it bends")
    # A series that did not break is split, whatever was said of cracks.
    rest("bar.stl")
    write("run.pvd", SERIES.format("rest.vtu", "bent.vtu"))
    found = expect_ok(run("flexel-map", "run.pvd", "-o", "out.stl", "--crack", "cap", "--strict"))
    expect(found.err.count("triangles became") == 1, found.err)
    expect(info("out_00000.stl")["triangles"] == info("out_00001.stl")["triangles"] > 100, "all frames alike")
    obj_bar()
    rest("bar.obj")
    tear("rest.vtu", "torn.vtu", lambda p: p[:, 0] > 0.05, bow)
    for files in (["torn.vtu"], ["torn.vtu", "--pieces", "t_{piece}.obj"]):
        torn = expect_ok(run("flexel-map", *files, "--crack", "cap", "-o", "torn.obj", "--force"))
        expect("was not split" in torn.err and "--refine LENGTH" in torn.err, torn.err)
    write("torn.pvd", SERIES.format("rest.vtu", "torn.vtu"))
    torn = expect_ok(run("flexel-map", "torn.pvd", "--crack", "open", "-o", "t.obj"))
    expect(torn.err.count("--refine LENGTH") == 1 and "became" not in torn.err, torn.err)
    expect_ok(run("flexel-map", "torn.vtu", "--crack", "cap", "--refine", "6 mm", "-o", "fine.obj"))


def bow(p):
    """Bent about the middle, and away from the other half."""
    moved = p.copy()
    moved[:, 2] -= 4 * (p[:, 0] - 0.05) ** 2
    moved[:, 0] += 0.01
    return moved


def test_only_advice_that_works_is_given():
    stl_bar()
    # Nobody gets the triangles of a body, so they do not count.
    found = expect_ok(run("flexel", "deform", "bar.stl", *BEND[:-1], "-o", "body.vtu", "--strict"))
    expect("--refine" not in found.err and "stay flat" not in found.err, found.err)
    whole = ["--method", "affine", "--keep-vertices"]
    saved = expect_ok(run("flexel-map", "body.vtu", *whole, "--save-binding", "p.binding", "-o", "a.stl"))
    expect("--refine" in saved.err and "--save-binding" not in saved.err, saved.err)
    bound = expect_ok(run("flexel-map", "body.vtu", "--binding", "p.binding", "-o", "b.stl"))
    expect("--refine" in bound.err and "--save-binding" in bound.err, bound.err)
    # One format's limit is that of all, and the line says so.
    obj_bar()
    write("lines.obj", open("bar.obj").read() + "l -1 -2\n")
    both = expect_ok(run("flexel", "deform", "lines.obj", *BEND[:-1], "-o", "m.stl", "-o", "m.obj"))
    expect("the other files" in both.err and "--refine" not in both.err, both.err)
    expect(info("m.stl")["triangles"] == info("m.obj")["triangles"] == 12, "the same triangles")


def test_combinations():
    stl_bar()
    body = bent("bar.stl")
    expect_error(run("flexel-map", body, "--refine", "much", "-o", "x.stl"), "flexel-map", "auto, off")
    expect_error(run("flexel-map", body, "--refine", "0 mm", "-o", "x.stl"), "flexel-map", "above zero")
    expect_error(run("flexel-map", body, "--refine", "5", "-o", "x.stl"), "flexel-map", "unit")
    expect_error(run("flexel-map", body, "--refine", "1 um", "-o", "x.stl"), "flexel-map", "--refine", "larger")
    expect_error(run("flexel-map", body, "--refine", "auto", "--keep-vertices", "-o", "x.stl"), "flexel-map", "--keep-vertices")
    expect_error(run("flexel-map", body, "--refine", "auto", "--crack", "cap", "-o", "x.stl"), "flexel-map", "--crack", "length")
    expect_error(run("flexel-map", body, "--refine", "auto", "--method", "affine", "--save-binding", "b", "-o", "x.stl"), "flexel-map",
                 "--save-binding", "length")
    write("p.csv", "x,y,z\n40,5,5\n")
    expect_error(run("flexel-map", body, "--refine", "auto", "--points", "p.csv", "-o", "x.csv"), "flexel-map", "--refine", "--points"[2:])
    expect(not any(name.startswith("x.") for name in os.listdir(".")), "nothing is written")
    # A binding holds for the surface as it was split, and the file's own stays whole without a length.
    bound = ["--method", "affine", "--refine", "6 mm"]
    expect_ok(run("flexel-map", body, *bound, "--save-binding", "part.binding", "-o", "a.stl"))
    expect_ok(run("flexel-map", body, "--refine", "6 mm", "--binding", "part.binding", "-o", "b.stl"))
    expect(open("a.stl", "rb").read() == open("b.stl", "rb").read() and info("a.stl")["triangles"] > 300, "the same")
    whole = expect_ok(run("flexel-map", body, "--method", "affine", "--save-binding", "whole.binding", "-o", "c.stl"))
    expect("stay flat" in whole.err and "became" not in whole.err and info("c.stl")["triangles"] == 12, whole.err)
    # What did not break is whole, whatever was said of cracks.
    capped = expect_ok(run("flexel-map", body, "--crack", "cap", "-o", "d.stl", "--strict"))
    expect("12 triangles became" in capped.err, capped.err)
    expect_ok(run("flexel-map", body, "--attributes", "-o", "e.ply", "--strict"))
    expect_ok(run("flexel-map", body, "--scale", "0.5", "-o", "f.obj", "--strict"))
    expect_ok(run("flexel-map", body, "-o", "g.vtu", "--strict"))
    expect(info("e.ply")["triangles"] == info("f.obj")["triangles"] == info("d.stl")["triangles"], "the same triangles in all")


def test_deform_splits_the_surface_and_keeps_that_of_the_body():
    obj_bar()
    found = expect_ok(run("flexel", "deform", "bar.obj", *BEND[:-1], "-o", "out.obj", "-o", "out.stl", "--body", "body.vtu", "--strict"))
    expect("12 triangles became" in found.err, found.err)
    expect(info("out.obj")["triangles"] == info("out.stl")["triangles"] > 100, "both")
    expect(len(read_obj("out.obj")[1]["vt"]) > 100, "with its texture coordinates")
    expect_ok(run("flexel-map", "body.vtu", "--keep-vertices", "--quiet", "-o", "own.obj"))
    expect(info("own.obj")["triangles"] == 12, "the body has the file's own surface")
    expect_ok(run("flexel", "deform", "bar.obj", *BEND, "--keep-vertices", "-o", "kept.obj"))
    expect(open("kept.obj").read() == open("own.obj").read(), "as flexel-map writes it")
    expect_error(run("flexel", "deform", "bar.obj", *BEND, "--refine", "auto", "-o", "x.vtu"), "flexel", "--refine", "mesh")
    expect_ok(run("flexel", "deform", "bar.obj", *BEND, "--refine", "5 mm", "-o", "even.obj"))
    expect(info("even.obj")["triangles"] > 1000, "to an edge")


def test_what_a_new_3mf_leaves_out_is_told():
    """Textures, and colours that change within a triangle, are in the file as it comes out again and nowhere else."""
    BARS["3mf"]()
    said = expect_ok(run("flexel-voxelize", "bar.3mf", "--count", "500", "-o", "rest.vtu")).err
    expect("textures and colours of corners come out where" in said, said)
    with zipfile.ZipFile("bar.3mf") as archive:
        model = archive.read("3D/m.model").decode()
    model = re.sub(r"<m:texture2dgroup.*?</m:texture2dgroup>", "", re.sub(r' pid="[34]" p1="\d+" p2="\d+" p3="\d+"', "", model))
    said = expect_ok(run("flexel-voxelize", threemf("plain.3mf", model), "--count", "500", "-o", "rest.vtu")).err
    expect("come out where" not in said, said)
    mixed = model.replace("</resources>", '<m:multiproperties id="77" pids="4"><m:multi pindices="0"/></m:multiproperties></resources>')
    said = expect_ok(run("flexel-voxelize", threemf("mixed.3mf", mixed), "--count", "500", "-o", "rest.vtu")).err
    expect("mixed materials come out where" in said, said)


if __name__ == "__main__":
    main(globals())

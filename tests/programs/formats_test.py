"""Every format through the whole chain: the part that comes out is the one that went in, bent, in its own format where that is written,
else as STL."""

import io
import os
import struct
import zipfile

from harness import PARTS, Skip, bracket, box, expect, expect_error, expect_ok, expect_only, main, need, run, scene, write
from meshes import CORE, glb_box, indexed_box, off_box, ply_box, read_3mf, read_glb, read_off, read_ply, threemf_box

BEND = """material = "PLA"
[[fix]]
where = "xmin"
[[load]]
where = "xmax"
force = ["0 N", "0 N", "-50 N"]
"""


def through_the_chain(part, out, *options, size="2.5 mm"):
    scene("bend.toml", BEND)
    expect_ok(run("flexel-voxelize", part, "--size", size, "-o", "rest.vtu"))
    expect_ok(run("flexel-simulate", "bend.toml", "rest.vtu", "-o", "body.vtu"))
    expect_ok(run("flexel-map", "rest.vtu", "-o", "rest." + out.rsplit(".", 1)[1], *options))
    expect_ok(run("flexel-map", "body.vtu", "-o", out, "--keep-vertices", *options))  # refine_test.py has the rest


def expect_bent(before, after, unit=1.0):
    """The held end stays, the loaded end sinks: F L^3 / (3 E I) of 50 N on PLA is 0.4 mm for the box."""
    expect(len(before) == len(after), f"{len(before)} vertices became {len(after)}")
    low, high = min(v[0] for v in before), max(v[0] for v in before)
    for a, b in zip(before, after):
        sunk = (a[2] - b[2]) * unit
        if a[0] == low:
            expect(abs(sunk) < 0.02, f"{a} is held, and moved to {b}")
        if a[0] == high:
            expect(0.2 < sunk < 1.5, f"{a} is pushed down, and moved to {b}")


def test_ply():
    through_the_chain(ply_box(), "bent.ply")
    before, heat, head = read_ply("box.ply")
    after, same_heat, same_head = read_ply("bent.ply")
    expect(open("box.ply", "rb").read() == open("rest.ply", "rb").read(), "a part that did not move is the same file")
    expect((head, heat) == (same_head, same_heat), "a property was lost")
    expect_bent(before, after)


def test_off():
    through_the_chain(off_box(), "bent.off")
    before, lines = read_off("box.off")
    after, new = read_off("bent.off")
    expect(lines[:3] + lines[11:] == new[:3] + new[11:], "only the vertices may change")
    expect(open("box.off", "rb").read() == open("rest.off", "rb").read(), "a part that did not move is the same file")
    expect_bent(before, after)


def test_glb():
    through_the_chain(glb_box(), "bent.glb")
    ((name, before, triangles),), _ = read_glb("box.glb")
    ((same_name, after, same_triangles),), document = read_glb("bent.glb")
    expect((name, triangles) == (same_name, same_triangles) and document["asset"]["generator"] == "hand", "not the same file, moved")
    expect(open("box.glb", "rb").read() == open("rest.glb", "rb").read(), "a part that did not move is the same file")
    expect_bent(before, after, 1000)


def test_a_new_glb():
    """Of another format: what the specification asks of a file, and the box in metres."""
    through_the_chain(threemf_box(), "bent.glb")
    meshes, _ = read_glb("rest.glb")
    expect([name for name, _, _ in meshes] == ["bar"], f"one part, called bar: {meshes}")
    vertices, triangles = indexed_box((0.04, 0.01, 0.01))
    (_, positions, faces), (_, moved, _) = meshes[0], read_glb("bent.glb")[0][0]
    wanted = [[struct.unpack("3f", struct.pack("3f", *vertices[v])) for v in t] for t in triangles]
    expect([[positions[v] for v in face] for face in faces] == wanted, "the box's triangles, in order")
    expect_bent(positions, moved, 1000)


def test_3mf():
    through_the_chain(threemf_box(), "bent.ply")
    data = open("bent.ply", "rb").read()
    at = data.index(b"end_header\n") + 11
    expect_bent(indexed_box()[0], list(struct.iter_unpack("<3d", data[at:at + 8 * 24])))
    through_the_chain("box.3mf", "bent.3mf")
    expect(open("box.3mf", "rb").read() == open("rest.3mf", "rb").read(), "a part that did not move is the same file")
    ((name, before, triangles),), _ = read_3mf("box.3mf")
    ((same_name, after, same_triangles),), _ = read_3mf("bent.3mf")
    expect((name, triangles) == (same_name, same_triangles), "not the same part, moved")
    expect_bent(before, after)
    expect(zipfile.ZipFile("bent.3mf").read("Metadata/thumbnail.png") == b"\x89PNG", "other files of the archive stay")
    expect_ok(run("flexel-map", "body.vtu", "--keep-vertices", "-o", "again.3mf"))
    expect(open("again.3mf", "rb").read() == open("bent.3mf", "rb").read(), "the same bytes")
    expect_error(run("flexel-map", "body.vtu", "-o", "x.3mf", "--unit", "in"), "flexel-map", "3MF has a unit of its own", "--unit")
    expect_error(run("flexel-map", "body.vtu", "--format", "3mf", "--ascii", "-o", "x"), "flexel-map", "3MF is binary")
    expect_only("again.3mf", "bend.toml", "bent.3mf", "bent.ply", "body.vtu", "box.3mf", "rest.3mf", "rest.ply", "rest.vtu")


def test_3mf_through_pipes_and_one_file_a_part():
    vertices, triangles = indexed_box()
    upper = [(x, y, z + 30) for x, y, z in vertices]
    write("other.off", "\n".join(["OFF", "8 12 0"] + ["{} {} {}".format(*v) for v in upper] + ["3 {} {} {}".format(*t) for t in triangles]) + "\n")
    expect_ok(run("flexel-voxelize", threemf_box(), "other.off", "--size", "5 mm", "-o", "two.vtu"))
    piped = expect_ok(run("flexel-map", "two.vtu", "--format", "3mf"))
    write("two.3mf", piped.out)
    shown, _ = read_3mf("two.3mf")
    expect([name for name, _, _ in shown] == ["bar", "other"] and all(len(t) == 12 for _, _, t in shown), f"{shown}")
    expect_ok(run("flexel-map", "two.vtu", "-o", "out_{part}.3mf"))
    for part, corners in (("bar", vertices), ("other", upper)):
        (found,), _ = read_3mf(f"out_{part}.3mf")
        expect(found == (part, corners, triangles), f"{found}")


def test_a_new_3mf():
    """In the unit that the numbers were in; colours as a group."""
    scene("bend.toml", BEND)
    for unit, word, length in (("mm", "millimeter", 40.0), ("in", "inch", 40 * 25.4), ("km", "millimeter", 4e7)):
        expect_ok(run("flexel-voxelize", box(), "--unit", unit, "--count", "500", "-o", "rest.vtu"))
        expect_ok(run("flexel-map", "rest.vtu", "-o", "new.3mf"))
        ((name, vertices, triangles),), model = read_3mf("new.3mf")
        expect((name, model.get("unit"), len(triangles)) == ("box", word, 12), f"{name} {model.attrib}")
        expect(abs(max(v[0] for v in vertices) / length - 1) < 1e-12, f"{vertices}")
        expect(sorted(float(v.get("x")) for v in model.iter(CORE + "vertex"))[0] == 0, "as text")
    lines = open(off_box()).read().splitlines()
    write("red.off", "\n".join(lines[:11] + [line + " 255 0 51" for line in lines[11:]]) + "\n")
    expect_ok(run("flexel", "deform", "red.off", "--material", "PLA", "--fix", "xmin", "--push", "xmax: 0 0 -50 N", "--size", "2.5 mm", "--no-estimate",
                  "--keep-vertices", "-o", "red.3mf", "-o", "same.3mf"))
    ((_, after, _),), model = read_3mf("red.3mf")
    expect_bent(indexed_box()[0], after)
    colors = [node.get("color") for node in model.iter() if node.tag.endswith("}color")]
    expect(colors == ["#FF0033"], f"{colors}")
    expect(open("red.3mf", "rb").read() == open("same.3mf", "rb").read(), "the same bytes")


def test_a_new_3mf_of_a_step_file():
    through_the_chain(bracket(), "bent.3mf", size="3 mm")
    (before,), model = read_3mf("rest.3mf")
    (after,), _ = read_3mf("bent.3mf")
    expect(model.get("unit") == "millimeter" and before[2] == after[2] and len(after[2]) > 100, f"{model.attrib}")
    expect(max(p[2] - q[2] for p, q in zip(before[1], after[1])) > 0.1, "it bends")


def mesh_volume(vertices, triangles):
    return volume([vertices[a] + vertices[b] + vertices[c] for a, b, c in triangles])


def test_openscad_reads_the_3mf_that_we_write():
    need("openscad")
    for part in (threemf_box(), box()):
        through_the_chain(part, "bent.3mf")
        ((_, vertices, triangles),), _ = read_3mf("bent.3mf")
        write("in.scad", 'import("bent.3mf");\n')
        done = run("openscad", "-o", "out.stl", "in.scad", timeout=100, env=dict(os.environ, HOME=os.getcwd()))
        expect(done.code == 0, f"{done}")
        corners = [tuple(map(float, line.split()[1:])) for line in open("out.stl") if line.split()[0] == "vertex"]
        seen = [corners[n] + corners[n + 1] + corners[n + 2] for n in range(0, len(corners), 3)]
        expect(len(seen) == 12 and abs(volume(seen) / mesh_volume(vertices, triangles) - 1) < 1e-4, f"{part}: {volume(seen)} mm^3")


class Pipe(io.RawIOBase):
    """What cannot go back: a ZIP archive then has its sizes after the data."""

    def __init__(self):
        self.data = b""

    def writable(self):
        return True

    def write(self, data):
        self.data += bytes(data)
        return len(data)


def test_3mf_archives_of_other_writers():
    """Streamed, with sizes of 64 bits and a comment; XML in UTF-16."""
    with zipfile.ZipFile(threemf_box()) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    model = files["3D/3dmodel.model"].decode()
    wide = model.replace('<?xml version="1.0"?>', '<?xml version="1.0" encoding="utf-16"?>').replace('"bar"', '"b\u00e4r &amp; &quot;x&quot;"')
    for name, text in (("bar", model.encode()), ("b\u00e4r & \"x\"", wide.replace("><", ">\r\n<").encode("utf-16"))):
        pipe = Pipe()
        with zipfile.ZipFile(pipe, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.comment = b"PK\x05\x06 begins the end"
            for file, data in dict(files, **{"3D/3dmodel.model": text}).items():
                with archive.open(file, "w", force_zip64=True) as out:
                    out.write(data)
        write("streamed.3mf", pipe.data)
        through_the_chain("streamed.3mf", "bent.3mf")
        expect(open("rest.3mf", "rb").read() == pipe.data, "a part that did not move is the same file")
        ((found, after, _),), _ = read_3mf("bent.3mf")
        expect(found == name, found)
        expect_bent(indexed_box()[0], after)


def test_real_3mf_files_keep_all_they_have():
    """One in inches with base materials; an assembly of 17 model files (production extension) with pictures and UUIDs."""
    for file, parts, options in (("featuretype.3MF", 1, ["--count", "2000"]), ("cube_gears_prod_req.3mf", 17, ["--count", "5000"])):
        if not (PARTS / file).exists():
            raise Skip(f"{file} is not there")
        expect_ok(run("flexel-voxelize", PARTS / file, *options, "-o", "rest.vtu"))
        expect_ok(run("flexel-map", "rest.vtu", "-o", "rest.3mf"))
        expect(open("rest.3mf", "rb").read() == (PARTS / file).read_bytes(), f"{file}: a part that did not move is the same file")
        scene("lift.toml", 'material = "PLA"\n[[fix]]\nwhere = "zmin"\n[[load]]\nwhere = "zmax"\nforce = [0, 0, "5 N"]\n')
        expect_ok(run("flexel-simulate", "lift.toml", "rest.vtu", "-o", "bent.vtu", "--no-estimate"))
        expect_ok(run("flexel-map", "bent.vtu", "--keep-vertices", "-o", "bent.3mf"))
        before, old = read_3mf(PARTS / file)
        after, new = read_3mf("bent.3mf")
        expect([(n, len(v), t) for n, v, t in before] == [(n, len(v), t) for n, v, t in after] and len(after) == parts, file)
        expect(old.attrib == new.attrib and [m.text for m in old.iter(CORE + "metadata")] == [m.text for m in new.iter(CORE + "metadata")], file)
        expect([v for _, v, _ in before] != [v for _, v, _ in after], "it moved")
        with zipfile.ZipFile(PARTS / file) as one, zipfile.ZipFile("bent.3mf") as two:
            expect(one.namelist() == two.namelist(), "the same files in the same order")
            for name in one.namelist():
                expect(name.endswith(".model") or one.read(name) == two.read(name), name)


def write_3mf(name, models):
    """An archive of model files: {path: text}; the first is the root."""
    with zipfile.ZipFile(name, "w") as archive:
        archive.writestr("_rels/.rels", '<Relationships><Relationship Target="/{}" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>'.format(next(iter(models))))
        for path, text in models.items():
            archive.writestr(path, text)


CUBE = ("<mesh><vertices>" + "".join(f'<vertex x="{x}" y="{y}" z="{z}"/>' for z in (0, 10) for y in (0, 10) for x in (0, 10)) + "</vertices><triangles>" +
        "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in ((0, 2, 3), (0, 3, 1), (4, 5, 7), (4, 7, 6), (0, 1, 5), (0, 5, 4), (2, 6, 7), (2, 7, 3), (0, 4, 6), (0, 6, 2), (1, 3, 7), (1, 7, 5))) +
        "</triangles></mesh>")
MODEL = '<model unit="{}"><resources>{}</resources><build>{}</build></model>'


def test_3mf_models_of_two_units_are_refused():
    for unit, fine in (("millimeter", True), ("inch", False)):
        write_3mf("units.3mf", {"3D/root.model": MODEL.format("millimeter", "", '<item objectid="1" path="/3D/a.model"/>'),
                                "3D/a.model": MODEL.format(unit, f'<object id="1">{CUBE}</object>', "")})
        if fine:
            expect_ok(run("flexel", "info", "units.3mf"))
        else:
            expect_error(run("flexel", "info", "units.3mf"), "flexel", "3D/a.model", "another unit")


def test_3mf_supports_are_told():
    objects = f'<object id="1" name="part">{CUBE}</object><object id="2" name="tree" type="support">{CUBE}</object>'
    write_3mf("support.3mf", {"3D/m.model": MODEL.format("millimeter", objects, '<item objectid="1"/><item objectid="2" transform="1 0 0 0 1 0 0 0 1 20 0 0"/>')})
    done = expect_ok(run("flexel-voxelize", "support.3mf", "--size", "2 mm", "-o", "s.vtu"))
    expect("\"tree\" is support material" in done.err, done.err)


def bent_bracket(file):
    """Triangles at rest and bent."""
    through_the_chain(bracket(file), "bent.stl", size="3 mm")
    found = []
    for name in ("rest.stl", "bent.stl"):
        data = open(name, "rb").read()
        (count,) = struct.unpack_from("<I", data, 80)
        found.append([struct.unpack_from("<9f", data, 84 + 50 * t + 12) for t in range(count)])
    return found


def volume(triangles):
    return sum(a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g) for a, b, c, d, e, f, g, h, i in triangles) / 6


def test_iges_and_brep_are_the_same_bracket_as_step():
    reference, bent = bent_bracket("bracket.step")
    tip = max(p[2] - q[2] for p, q in zip(reference, bent))
    for file in ("bracket.igs", "bracket.brep"):
        rest, moved = bent_bracket(file)
        expect(abs(volume(rest) / volume(reference) - 1) < 1e-3, f"{file}: {volume(rest)} mm^3, not {volume(reference)}")
        sunk = max(p[2] - q[2] for p, q in zip(rest, moved))
        expect(abs(sunk / tip - 1) < 0.02 and tip > 0.1, f"{file}: the tip sinks by {sunk} mm, not {tip}")


def test_tessellated_solids_beside_exact_ones_are_told():
    bracket()
    text = open("bracket.step", encoding="latin-1").read()
    end = text.rindex("ENDSEC;")
    write("both.step", (text[:end] + "#999999=TESSELLATED_SOLID('more',(),$);\n" + text[end:]).encode("latin-1"))
    said = expect_ok(run("flexel-voxelize", "both.step", "--count", "500", "-o", "body.vtu")).err
    expect("warning: both.step: holds tessellated geometry too (TESSELLATED_SOLID)" in said and "left out" in said, said)


def test_one_file_a_part():
    lower = off_box("lower.off")
    vertices, triangles = indexed_box()
    write("upper.off", "\n".join(["OFF", "8 12 0"] + [f"{x} {y} {z + 30}" for x, y, z in vertices] +
                                 ["3 " + " ".join(map(str, t)) for t in triangles]) + "\n")
    expect_ok(run("flexel-voxelize", lower, "upper.off", "--size", "5 mm", "-o", "rest.vtu"))
    expect_ok(run("flexel-map", "rest.vtu", "-o", "out_{part}.stl"))
    expect_only("lower.off", "upper.off", "rest.vtu", "out_lower.stl", "out_upper.stl")
    for name, bottom in (("out_lower.stl", 0.0), ("out_upper.stl", 30.0)):
        data = open(name, "rb").read()
        (count,) = struct.unpack_from("<I", data, 80)
        lowest = min(min(struct.unpack_from("<9f", data, 96 + 50 * t)[2::3]) for t in range(count))
        expect((count, lowest) == (12, bottom), f"{name}: {count} triangles from {lowest} mm")


def test_size_warning_names_the_likely_unit():
    vertices, triangles = indexed_box((0.04, 0.01, 0.01))
    write("metres.off", "\n".join(["OFF", "8 12 0"] + [f"{x} {y} {z}" for x, y, z in vertices] +
                                  ["3 " + " ".join(map(str, t)) for t in triangles]) + "\n")
    for command in (["flexel-voxelize", "metres.off", "--count", "500", "-o", "rest.vtu"], ["flexel", "info", "metres.off"]):
        result = expect_ok(run(*command))
        expect("warning: metres.off is 40 um across in mm, the unit for files that carry none: likely --unit m" in result.err, f"{result}")
        expect("likely" not in expect_ok(run(*command, "--unit", "m")).err, "in metres it is 40 mm long")
    expect("likely" not in expect_ok(run("flexel-voxelize", box(), "--count", "500", "-o", "rest.vtu")).err, "40 mm is no suspicious size")


def dxf(hidden, help="help", more=""):
    """A box of 4 cm on layer "part", and one a metre long on layer `help`; the entry of "help" in the table of layers ends with `hidden`."""
    text = f"0\nSECTION\n2\nHEADER\n9\n$INSUNITS\n70\n4\n0\nENDSEC\n0\nSECTION\n2\nTABLES\n0\nTABLE\n2\nLAYER\n0\nLAYER\n2\nhelp\n{hidden}0\nENDTAB\n0\nENDSEC\n0\nSECTION\n2\nENTITIES\n"
    for layer, size in (("part", (40.0, 10.0, 10.0)), (help, (1000.0, 10.0, 10.0))):
        vertices, triangles = indexed_box(size)
        for a, b, c in triangles:
            text += f"0\n3DFACE\n8\n{layer}\n"
            for corner, vertex in enumerate((a, b, c, c)):
                text += "".join(f"{10 * (i + 1) + corner}\n{vertices[vertex][i]}\n" for i in range(3))
    return text + more + "0\nENDSEC\n0\nEOF\n"


def test_layers_of_dxf_that_are_off_stay_out():
    seen, off, frozen = "70\n0\n62\n7\n", "70\n0\n62\n-7\n", "70\n1\n62\n7\n"
    corners = "".join(f"0\nVERTEX\n8\nhelp\n10\n{x}\n20\n{y}\n30\n0\n70\n64\n" for x in (0, 1) for y in (0, 1))
    mesh = f"0\nPOLYLINE\n8\nhelp\n66\n1\n70\n16\n71\n2\n72\n2\n{corners}0\nSEQEND\n8\nhelp\n"
    for hidden, help, more, out in ((seen, "help", "", False), (off, "help", "", True), (frozen, "help", "", True),
                                    (seen, "HELP", "", False), (frozen, "HELP", "", True), (frozen, "help", mesh, True)):
        write("drawing.dxf", dxf(hidden, help, more))
        said = run("flexel", "info", "drawing.dxf")
        expect_ok(said)
        expect(("1,000" in said.out.decode() or "1000" in said.out.decode()) != out, f"{hidden!r}: {said.out.decode()}")
        expect(("layer that is off or frozen" in said.err) == out, said.err)
    write("drawing.dxf", dxf(seen, more=mesh))
    expect("polygon meshes" in run("flexel", "info", "drawing.dxf").err, "one that is seen is refused")


if __name__ == "__main__":
    main(globals())

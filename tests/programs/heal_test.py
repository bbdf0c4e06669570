"""Broken surfaces through the programs: what was healed is said and counted, what cannot be told is refused with a reason."""

import json

from harness import PARTS, Skip, ascii_stl, binary_stl, box_triangles, expect, expect_error, expect_ok, expect_only, main, run, write


def grid_box(cells=8, size=40.0):
    """Outward triangles of a cube from the origin, each side `cells` x `cells` squares."""
    def at(side, i, j):
        axis, top = divmod(side, 2)
        point = [0.0, 0.0, 0.0]
        point[axis] = size * top
        point[(axis + 1) % 3] = size * i / cells
        point[(axis + 2) % 3] = size * j / cells
        return tuple(point)

    triangles = []
    for side in range(6):
        for i in range(cells):
            for j in range(cells):
                a, b, c, d = at(side, i, j), at(side, i + 1, j), at(side, i + 1, j + 1), at(side, i, j + 1)
                for t in ([a, b, c], [a, c, d]):
                    triangles.append(t if side % 2 else [t[0], t[2], t[1]])
    return triangles


def healed(triangles, *options):
    """What was said, and the part's entry in the summary."""
    write("part.stl", binary_stl(triangles))
    result = expect_ok(run("flexel-voxelize", "part.stl", "--size", "4 mm", "--summary", "summary.json", "-o", "body.vtu", *options))
    with open("summary.json", encoding="utf-8") as file:
        return result.err, json.load(file)["parts"][0]


def expect_volume(part, size=40e-3, share=1e-9):
    volume = part["lattice_volume"] + part["dropped_volume"]
    expect(abs(volume / size**3 - 1) <= share, f"the lattice holds {volume} m^3, not {size**3}")


def test_a_clean_part_is_not_healed():
    said, part = healed(grid_box())
    expect("healed" not in said, f"nothing was broken: {said}")
    counts = {key: value for key, value in part["healing"].items() if key != "inside_by"}
    expect(not any(counts.values()), f"nothing was broken: {counts}")
    expect_volume(part)


def test_auto_names_what_it_healed():
    triangles = grid_box()
    del triangles[100], triangles[300]  # two holes of one triangle
    triangles[7] = [triangles[7][0], triangles[7][2], triangles[7][1]]
    triangles.append(triangles[50])
    said, part = healed(triangles)
    for words in ("part: healed: 2 holes filled with 2 triangles, the widest 7.07 mm",
                  "part: healed: 1 triangle faced the other way", "part: healed: 1 repeated facet left out"):
        expect(words in said, f"\"{words}\" is missing in {said}")
    found = part["healing"]
    expect((found["holes"], found["hole_triangles"], found["flipped_facets"], found["duplicate_facets"]) == (2, 2, 1, 1), f"{found}")
    expect(found["open_edges"] > 0 and found["left_open"] == 0 and part["closed"], f"{found}")
    expect_volume(part)


def test_a_part_inside_out_is_turned():
    said, part = healed([[a, c, b] for a, b, c in grid_box()])
    expect("1 shell inside out and turned" in said and part["healing"]["inverted_shells"] == 1, f"{said} {part}")
    expect_volume(part)


def pressed(name, triangles):
    """Displacements of a box that is pressed along the inward normal, by force, by pressure and by a move: largest, and its direction."""
    write(name, binary_stl(triangles))
    found = []
    for push in (["--push", "ymax: 10 N"], ["--push", "ymax: 2 MPa"], ["--move", "ymax: 0.1 mm"]):
        expect_ok(run("flexel", "deform", name, "--material", "steel", "--fix", "ymin", *push, "--size", "2.5 mm", "--no-estimate", "--summary",
                      "summary.json", "-o", "out.obj", "--quiet"))
        with open("out.obj", encoding="utf-8") as file:
            found.append([float(line.split()[2]) for line in file if line.startswith("v ")])
    return found


def test_loads_along_the_normal_are_those_of_an_outward_box():
    sound = box_triangles((10.0, 10.0, 10.0))
    expected = pressed("sound.stl", sound)
    for force in expected:
        expect(max(force) < 10, f"a push inward moves the top down: {force}")
    one_a_face = [[a, c, b] if n % 2 else [a, b, c] for n, (a, b, c) in enumerate(sound)]
    one = [[a, c, b] if n == 6 else [a, b, c] for n, (a, b, c) in enumerate(sound)]
    for name, mesh in (("inside_out.stl", [[a, c, b] for a, b, c in sound]), ("one_a_face.stl", one_a_face), ("one.stl", one)):
        got = pressed(name, mesh)
        for mine, theirs in zip(got, expected):
            # STL has no vertex order but that of the corners: compare the sorted heights.
            expect(max(abs(a - b) for a, b in zip(sorted(mine), sorted(theirs))) < 1e-9, f"{name}: {sorted(mine)}, not {sorted(theirs)}")


def test_a_real_part_with_turned_shells_is_pushed_inward():
    """video_part.stl: 358 edges whose triangles face opposite ways; a push on ymax went outward."""
    part = PARTS / "video_part.stl"
    if not part.exists():
        raise Skip("real parts are not there")
    expect_ok(run("flexel", "deform", part, "--material", "steel", "--fix", "ymin", "--move", "ymax: 1 mm", "--count", "2000", "--no-estimate",
                  "-o", "bent.obj", "--quiet"))
    rest = expect_ok(run("flexel", "info", part, "--json"))
    with open("bent.obj", encoding="utf-8") as file:
        top = max(float(line.split()[2]) for line in file if line.startswith("v "))
    before = json.loads(rest.out)["files"][0]["parts"][0]["max"][1] / 1e-3
    expect(abs(before - 1 - top) < 0.2, f"the top went from {before} to {top} mm")


def test_a_sheet_is_refused_with_what_to_do():
    sheet = [t for t in grid_box() if all(corner[2] == 0 for corner in t)]
    write("sheet.stl", ascii_stl(sheet, "plate"))
    for option in ("auto", "wrap", "none"):
        expect_error(run("flexel-voxelize", "sheet.stl", "--size", "4 mm", "--heal", option, "-o", "body.vtu"), "flexel-voxelize", "sheet.stl: part \"plate\"" if option != "wrap" else "plate",
                     *{"auto": ["encloses no volume", "sheet", "open edges", "give it a thickness or close it"],
                       "wrap": ["sheet", "close it", "no wrap closes it"], "none": ["plate"]}[option])
        expect_only("sheet.stl")


def test_an_open_box_is_refused_with_the_hole():
    write("part.stl", binary_stl([t for t in grid_box() if not all(corner[2] == 40 for corner in t)]))
    expect_error(run("flexel-voxelize", "part.stl", "--size", "4 mm", "-o", "body.vtu"), "flexel-voxelize",
                 "inside cannot be told from outside", "32 open edges", "56.6 mm wide", "(20 mm, 20 mm, 40 mm)", "--heal \"wrap:62.2 mm\"")
    expect_only("part.stl")
    said, part = healed([t for t in grid_box() if not all(corner[2] == 40 for corner in t)], "--heal", "wrap:62.2 mm")  # as advised
    expect(part["healing"]["wrapped"], f"{said}")


def test_parts_among_each_other_are_told():
    def block(low, high):
        return [[tuple(c + l for c, l in zip(corner, low)) for corner in t]
                for t in box_triangles(tuple(h - l for l, h in zip(low, high)))]

    left = ascii_stl(block((0, 0, 0), (20, 10, 10)), "left")
    for name, begin, words in (
            ("overlap.stl", 18.0, ["parts \"left\" and \"right\" overlap: 200 mm^3 lies in both"]),
            ("gap.stl", 20.3, ["parts \"left\" and \"right\" miss each other by 300 um", "[[bond]] with gap = \"315 um\""]),
            ("wide.stl", 20.8, ["miss each other by 800 um", "close the gap in CAD"])):
        write(name, left + ascii_stl(block((begin, 0, 0), (40, 10, 10)), "right"))
        result = expect_ok(run("flexel-voxelize", name, "--size", "1 mm", "--summary", "summary.json", "-o", "body.vtu"))
        for word in words:
            expect(word in result.err, f"\"{word}\" is missing in {result.err}")
        with open("summary.json", encoding="utf-8") as file:
            summary = json.load(file)
        found = summary["overlaps"] + summary["gaps"]
        expect(len(found) == 1 and found[0]["parts"] == ["left", "right"], f"{summary['overlaps']} {summary['gaps']}")
    # As advised.
    write("scene.toml", b'''material = "steel"
[[fix]]
where = "xmin"
[[load]]
where = "xmax"
force = ["1 N", "0 N", "0 N"]
[[bond]]
parts = ["left", "right"]
gap = "315 um"
''')
    expect_ok(run("flexel", "deform", "gap.stl", "--scene", "scene.toml", "--size", "1 mm", "--no-estimate", "-o", "bent.stl"))
    write("twice.stl", left + left.replace(b"left", b"again"))
    expect_error(run("flexel-voxelize", "twice.stl", "--size", "1 mm", "-o", "none.vtu"), "flexel-voxelize", "\"left\" and \"again\"",
                 "are one body twice in one place", "leave one of them out")


def test_what_is_said_of_many_parts_is_said_once():
    blocks = [[[tuple(c + s for c, s in zip(corner, (12.0 * n, 0, 0))) for corner in t] for t in box_triangles((10.0, 10.0, 10.0))] for n in range(8)]
    write("many.stl", b"".join(ascii_stl([[a, c, b] for a, b, c in block], f"block{n}") for n, block in enumerate(blocks)))
    said = expect_ok(run("flexel-voxelize", "many.stl", "--size", "2.5 mm", "-o", "body.vtu")).err
    expect("8 parts: 1,000 elements, 512 cells of 2.5 mm" in said, said)
    expect("healed in 8 of 8 parts (\"block0\", \"block1\", \"block2\", ...): 8 shells inside out and turned" in said, said)
    expect(len(said.splitlines()) <= 10, said)


def test_wrap_spans_what_it_is_told_to():
    top = [t for t in grid_box() if not all(corner[2] == 40 for corner in t)]
    said, part = healed(top, "--heal", "wrap:60 mm")
    expect("wrapped: openings up to 60 mm are spanned" in said and part["healing"]["wrapped"], f"{said} {part}")
    # It lies a thirtieth of 60 mm outside, with rounded edges: at most that box, at least the part.
    expect(40.0**3 < 1e9 * part["lattice_volume"] < 44.0**3, f"{part}")


def test_wrap_narrower_than_the_hole_is_refused():
    write("part.stl", binary_stl([t for t in grid_box() if not all(corner[2] == 40 for corner in t)]))
    expect_error(run("flexel-voxelize", "part.stl", "--size", "4 mm", "--heal", "wrap:5 mm", "-o", "body.vtu"), "flexel-voxelize",
                 "opening 56.6 mm wide", "wrap:62.2 mm")
    expect_only("part.stl")


def test_none_takes_it_as_it_is():
    triangles = grid_box()
    del triangles[100]
    said, part = healed(triangles, "--heal", "none")
    expect("healed" not in said and "3 open edges left" in said, said)
    expect(not part["closed"] and part["healing"]["inside_by"] == "vote" and part["healing"]["holes"] == 0, f"{part}")


def test_facets_without_area_are_refused():
    lines = [[(0, 0, 0), (1, 0, 0), (2, 0, 0)], [(0, 0, 0), (2, 0, 0), (3, 0, 0)]]
    write("lines.stl", binary_stl(lines))
    for options in (["--size", "0.2 mm"], ["--size", "0.2 mm", "--heal", "wrap"], ["--count", "100"]):
        found = run("flexel-voxelize", "lines.stl", *options, "-o", "lines.vtu")
        expect(found.code == 2, f"{options}: {found.code} {found.err}")
        expect("flexel-voxelize: error: " in found.err, found.err)


def test_lost_features_are_named():
    for depth, words in ((2.0, "features lost: walls thinner than one cell (33 % of the places measured), the thinnest 2 mm at ("),
                         (4.0, "walls thinner than two cells, the thinnest 4 mm at (")):
        write("plate.stl", binary_stl(box_triangles((40.0, 40.0, depth))))
        result = expect_ok(run("flexel-voxelize", "plate.stl", "--size", "4 mm", "--align", "none", "--summary", "s.json", "-o", "body.vtu"))
        expect(words in result.err and result.err.count("walls thinner") == 1, f"{words}: {result}")
        with open("s.json", encoding="utf-8") as file:
            part = json.load(file)["parts"][0]
        thin = part["wall_samples"] // 3  # of the lines along three axes, those through the plate
        expect((part["thin_walls"], part["lost_walls"]) == (thin, thin if depth < 4 else 0), f"{part}")
        expect(abs(part["thinnest_wall"]["thickness"] - depth * 1e-3) < 1e-9, f"{part}")
    write("cube.stl", binary_stl(box_triangles((40.0, 40.0, 40.0))))
    expect("walls" not in expect_ok(run("flexel-voxelize", "cube.stl", "--size", "4 mm", "-o", "body.vtu")).err, "no thin wall")


def test_a_gap_is_closed_as_the_message_says():
    """Two bars of one solid, a hundredth of a millimetre apart."""
    far = [[(x + 20.01, y, z) for x, y, z in triangle] for triangle in box_triangles((20.0, 10.0, 10.0))]
    write("two.stl", binary_stl(box_triangles((20.0, 10.0, 10.0)) + far))
    write("s.toml", 'material = "PLA"\n[[fix]]\nwhere = "xmin"\n[[load]]\nwhere = "xmax"\nforce = ["0 N", "0 N", "-1 N"]\n')
    for option in ((), ("--heal", "wrap")):
        expect_ok(run("flexel-voxelize", "two.stl", "--size", "2.5 mm", *option, "-o", "b.vtu"))
        done = run("flexel-simulate", "s.toml", "b.vtu", "-o", "o.vtu", "--force")
        if option:
            expect("how far" in expect_ok(done).err, done.err)
        else:
            expect_error(done, "flexel-simulate", "2 pieces that are not connected", "(over a gap: --heal wrap)")


def test_unknown_words():
    write("part.stl", binary_stl(box_triangles()))
    expect_error(run("flexel-voxelize", "part.stl", "--heal", "warp"), "flexel-voxelize", "--heal", 'did you mean "wrap"')
    expect_error(run("flexel-voxelize", "part.stl", "--heal", "wrap:5"), "flexel-voxelize", "unit")
    expect_ok(run("flexel-voxelize", "part.stl", "--size", "4 mm", "--heal", "auto"))


def test_deform_has_the_counts_too():
    triangles = grid_box()
    del triangles[100]
    write("part.stl", binary_stl(triangles))
    result = expect_ok(run("flexel", "deform", "part.stl", "--material", "PLA", "--fix", "xmin", "--push", "xmax: 0 0 -10 N", "--size",
                           "5 mm", "--summary", "summary.json", "-o", "bent.stl"))
    with open("summary.json", encoding="utf-8") as file:
        part = json.load(file)["voxelize"]["parts"][0]
    expect(part["healing"]["holes"] == 1 and "1 hole filled with 1 triangle" in result.err, f"{part} {result}")


if __name__ == "__main__":
    main(globals())

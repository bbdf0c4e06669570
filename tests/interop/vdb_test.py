"""OpenVDB's own vdb_print opens what `flexel-voxelize --vdb` writes."""

import re

from harness import box, expect, expect_error, expect_ok, main, need, run


def test_vdb_print_opens_fill_and_distance():
    need("vdb_print")
    box()
    expect_ok(run("flexel-voxelize", "box.stl", "--size", "1 mm", "--vdb", "box.vdb", "-o", "box.vtu"))
    shown = expect_ok(run("vdb_print", "-l", "box.vdb")).out.decode()
    for name in ("fill_box", "distance_box"):
        expect(name in shown, f"{name} wanted:\n{shown}")
    expect(len(re.findall(r"voxel size: 0\.001\b", shown)) == 2, f"voxels of 1 mm wanted:\n{shown}")
    expect("file_voxel_count: 4000" in shown, f"40 x 10 x 10 full cells wanted:\n{shown}")


def test_level_sets_come_in_as_parts():
    """What is written is read again: the box of 4000 mm^3 with its edges rounded by a voxel, in metres as the file says."""
    box()
    expect_ok(run("flexel-voxelize", "box.stl", "--size", "1 mm", "--vdb", "box.vdb", "-o", "box.vtu"))
    shown = expect_ok(run("flexel", "info", "box.vdb"))
    text = shown.out.decode()
    expect('left out, for they are no level sets: "fill_box"' in shown.err, f"the fill is told: {shown.err}")
    expect("vdb, unit m" in text and 'part "distance_box"' in text and "closed, 1 shell" in text, text)
    volume = float(re.search(r"volume\s+([\d.]+) m\^3", text)[1])
    expect(abs(volume / 4e-6 - 1) < 0.02, f"4e-6 m^3 wanted: {volume}")
    expect_error(run("flexel", "info", "box.vdb", "--unit", "mm"), "flexel", "carries its own unit")
    expect_ok(run("flexel", "deform", "box.vdb", "--size", "2 mm", "--material", "PLA", "--fix", "xmin", "--push", "xmax: 0 0 -5 N", "-o", "bent.stl"))


def test_centre_placement_has_no_cells():
    box()
    expect_error(run("flexel-voxelize", "box.stl", "--size", "1 mm", "--placement", "centre", "--vdb", "box.vdb", "-o", "box.vtu"),
                 "flexel-voxelize", "--vdb", "centre placement")


if __name__ == "__main__":
    main(globals())

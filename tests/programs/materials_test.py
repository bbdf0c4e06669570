"""flexel materials and flexel measure, and the page that holds the table of materials."""

import json

from harness import SOURCE, expect, expect_error, main, run


def test_the_page_holds_the_table():
    found = run("flexel", "materials", "--markdown")
    expect(found.code == 0, found)
    page = (SOURCE / "docs/reference/materials.md").read_text(encoding="utf-8")
    expect(found.out.decode() in page, "docs/reference/materials.md is not what `flexel materials --markdown` prints")


def test_json_and_text_hold_the_same():
    listed = json.loads(run("flexel", "materials", "--json").out)
    text = run("flexel", "materials").out.decode()
    expect(len(listed) >= 30, f"{len(listed)} materials")
    for material in listed:
        expect(material["young"] > 0 and -1 < material["poisson"] < 0.5 and material["density"] > 0, material)
        expect(material["source"], material)
        expect(material["name"] in text, f"{material['name']} is not in the text")
        expect(material.get("yield", 0) <= material.get("strength", 1e300), material)


def test_measure_finds_the_material():
    found = json.loads(run("flexel", "measure", "--model", "cells", "--size", "2 mm", "--material", "steel", "--json").out)
    for each in found["inside"]:
        expect(abs(each["young"] / 210e9 - 1) < 0.01 and abs(each["poisson"] - 0.3) < 0.003, each)
        expect(abs(each["shear"] / (210e9 / 2.6) - 1) < 0.01, each)
    expect([bar["cells"] for bar in found["bars"]] == [2, 4, 8], found)
    for bar in found["bars"]:
        expect(abs(bar["young_drawn"] / 210e9 - 1) < 0.01 and abs(bar["shear_sheared"] / (210e9 / 2.6) - 1) < 0.01, bar)
    limit = found["limit"]
    expect(abs(limit["young_bent"] / 210e9 - 1) < 0.01 and abs(limit["shear_twisted"] / (210e9 / 2.6) - 1) < 0.01, limit)
    expect("G twisted" in run("flexel", "measure", "--model", "paper", "--size", "1 mm").out.decode(), "no table")


def test_measure_refuses():
    expect_error(run("flexel", "measure", "--model", "sprngs", "--size", "1 mm"), "flexel", "springs")
    expect_error(run("flexel", "measure", "--model", "cells", "--size", "1"), "flexel", "unit")
    expect_error(run("flexel", "measure", "--model", "cells", "--size", "1 mm", "--poisson", "0.5"), "flexel", "below 0.5")
    expect_error(run("flexel", "measure", "--model", "cells", "--size", "1 mm", "--material", "stone"), "flexel", "flexel materials")


if __name__ == "__main__":
    main(globals())

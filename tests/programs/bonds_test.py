"""Two files whose solids touch behave as the one solid that they make up."""

import json
import math

from harness import binary_stl, box_triangles, expect, expect_error, expect_ok, main, run, scene, write


def turned(size, begin):
    """A box along x from `begin`, turned by 0.3 rad about z."""
    c, s = math.cos(0.3), math.sin(0.3)
    move = lambda x, y, z: (c * (x + begin) - s * y, s * (x + begin) + c * y, z)
    return binary_stl([[move(*corner) for corner in triangle] for triangle in box_triangles(size)])


def bend(*parts, options=(), extra=""):
    expect_ok(run("flexel-voxelize", *parts, "--size", "2.5 mm", "-o", "body.vtu", *options))
    c, s = math.cos(0.3), math.sin(0.3)
    half = 'half_space = {{ point = ["{:.6f} mm", "{:.6f} mm", 0], normal = [{:.9f}, {:.9f}, 0] }}'
    text = f"""material = "steel"
{extra}
[[fix]]
where = {{ {half.format(c, s, -c, -s)} }}
[[load]]
where = {{ {half.format(79 * c, 79 * s, c, s)} }}
force = [0, 0, "-100 N"]
[[probe]]
where = {{ {half.format(79 * c, 79 * s, c, s)} }}
"""
    return run("flexel-simulate", scene("bend.toml", text), "body.vtu", "-o", "bent.vtu", "--summary", "summary.json", "--verbose")


def summary():
    with open("summary.json", encoding="utf-8") as text:
        return json.load(text)


def test_two_files_that_touch():
    write("whole.stl", turned((80.0, 10.0, 10.0), 0))
    write("a.stl", turned((40.0, 10.0, 10.0), 0))
    write("b.stl", turned((40.0, 10.0, 10.0), 40))
    for options in ([], ["--align", "none"]):
        expect_ok(bend("whole.stl", options=options))
        whole = summary()
        expect(whole["bonds"] == [], "one part has no bond")
        result = expect_ok(bend("a.stl", "b.stl", options=options))
        bonded = summary()
        expect("bonded over 100 mm2" in result.err, f"the bond is not told: {result}")
        expect(abs(bonded["bonds"][0]["area"] - 1e-4) < 1e-9, f"area: {bonded['bonds']}")
        ratio = bonded["probes"][0]["displacement"][2] / whole["probes"][0]["displacement"][2]
        expect(abs(ratio - 1) < 0.03, f"{options}: the bonded bar bends {ratio} times as far as the whole one")
    expect_error(bend("a.stl", "b.stl", extra="bond = false"), "flexel-simulate", 'nothing holds part "b"')


if __name__ == "__main__":
    main(globals())

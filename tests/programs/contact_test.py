"""Contact from the outside: the force that presses an elastic ball, a glued tool, bonds by name."""

import csv
import json
import re
import sys

from harness import BIN, SOURCE, binary_stl, box_triangles, expect, expect_error, expect_ok, main, run, scene, write

sys.path.insert(0, str(SOURCE / "bench" / "contact"))
import hertz  # noqa: E402


def test_an_elastic_ball_presses_as_hertz_has_it():
    indentation, force = hertz.measured(BIN, 20, 4, slowness=8)
    ratio = force / hertz.hertz(indentation)
    expect(0.9 < ratio < 1.1, f"{ratio} times Hertz's force")


def two_blocks():
    write("low.stl", binary_stl(box_triangles((10.0, 10.0, 10.0))))
    write("high.stl", binary_stl([[(x, y, z + 10) for x, y, z in t] for t in box_triangles((10.0, 10.0, 5.0))]))
    expect_ok(run("flexel-voxelize", "low.stl", "high.stl", "--size", "2.5 mm", "-o", "body.vtu"))


LIFT = """material = "rubber"
contact = true
[damping]
time = "50 us"
[[manipulator]]
part = "high"
time = ["0 s", "10 ms"]
displacement = [["0 mm", "0 mm", "0 mm"], ["0 mm", "0 mm", "2 mm"]]
GLUE
[[probe]]
name = "bottom"
at = ["5 mm", "5 mm", "0.1 mm"]
[run]
time = "12 ms"
"""


def lifted(glue):
    scene("lift.toml", LIFT.replace("GLUE", glue))
    expect_ok(run("flexel-simulate", "lift.toml", "body.vtu", "-o", "lifted.vtu", "--history", "h.csv", "--summary", "s.json"))
    with open("h.csv", newline="", encoding="utf-8") as file:
        columns = next(csv.reader(file))
    expect("contact stored [J]" in columns, f"the books lack what contact stores: {columns}")
    with open("s.json", encoding="utf-8") as file:
        return json.load(file)["probes"][0]["displacement"][2]


def test_a_glued_tool_lifts_the_part():
    two_blocks()
    expect(abs(lifted("")) < 1e-5, "without glue the part stays")
    expect(abs(lifted("glue = true") - 2e-3) < 2e-4, "with glue it comes along")


def test_what_a_tool_presses_is_no_part_that_passes_through_itself():
    write("low.stl", binary_stl(box_triangles((10.0, 10.0, 10.0))))
    write("high.stl", binary_stl([[(x + 1, y + 1, z + 10.2) for x, y, z in t] for t in box_triangles((5.0, 5.0, 5.0))]))
    expect_ok(run("flexel-voxelize", "low.stl", "high.stl", "--size", "2.5 mm", "-o", "body.vtu"))
    scene("press.toml", LIFT.replace("GLUE", "").replace('"2 mm"', '"-0.4 mm"').replace("[damping]", "[[plane]]\npoint = [0, 0, 0]\nnormal = [0, 0, 1]\n[damping]"))
    expect_ok(run("flexel-simulate", "press.toml", "body.vtu", "-o", "pressed.vtu"))
    said = expect_ok(run("flexel-map", "pressed.vtu", "-o", "pressed.stl", "--strict", "--check", "self-intersection", "--report", "r.json")).err
    with open("r.json", encoding="utf-8") as file:
        report = json.load(file)
    expect(report["failures"]["new_self_intersections"] == 0 and report["failures"]["parts_through_each_other"] == 0, f"{report['failures']}")
    expect(report["advisories"]["parts_that_meet"] > 0 and 0 < report["deepest_meeting"] < 0.1e-3, f"{report}")
    expect("no part passes through itself" in said and "parts touch" in said, said)


def test_explain_tells_the_whole_time_of_contact():
    two_blocks()
    scene("lift.toml", LIFT.replace("GLUE", "glue = true"))
    lines = expect_ok(run("flexel-simulate", "lift.toml", "body.vtu", "-o", "lifted.vtu", "--explain", "--threads", "1")).err
    shares = {name.strip(): float(share) for name, share in re.findall(r"time: (.+?) +[0-9.]+ s +([0-9.]+) %", lines)}
    expect(abs(sum(shares.values()) - 100) < 1, f"the shares do not add up to the run: {shares}")
    expect(min(shares["contact"], shares["contact friction"]) > 0, f"contact takes no time: {shares}")
    expect(shares["the rest"] < 25, f"time of this run that is nobody's, though contact and damping take nearly all of it: {shares}")


def test_refusals():
    two_blocks()
    scene("lift.toml", LIFT.replace("GLUE", "glue = 3"))
    expect_error(run("flexel-simulate", "lift.toml", "body.vtu", "-o", "o.vtu"), "flexel-simulate", '"glue" needs to be true or false')
    scene("bond.toml", 'material = "rubber"\n[[bond]]\nparts = ["low", "hihg"]\n[run]\ntime = "1 ms"\n')
    expect_error(run("flexel-simulate", "bond.toml", "body.vtu", "-o", "o.vtu"), "flexel-simulate", 'bond.toml:2: the body has no part "hihg"; did you mean "high"')

    scene("short.toml", 'material = "rubber"\n[contact]\noverlap = "part"\noverlap_time = "20 ms"\n[run]\ntime = "1 ms"\n')
    short = run("flexel-simulate", "short.toml", "body.vtu", "-o", "o.vtu")
    expect_ok(short)
    expect('"overlap_time" is 0.02 s, the run 0.001 s' in short.err, f"no word of a run that ends too early: {short.err}")


if __name__ == "__main__":
    main(globals())

"""flexel flex, judged from outside: the angle and the arc are measured on the vertices that it writes."""

import json
import math
import pathlib

from harness import PARTS, ascii_stl, box_triangles, expect, expect_error, expect_ok, main, run

SIZE = (80.0, 12.0, 4.0)
HOW = ["--material", "PLA", "--size", "1mm", "--no-estimate", "--keep-vertices", "--ascii", "--quiet"]


def part():
    pathlib.Path("bar.stl").write_bytes(ascii_stl(box_triangles(SIZE)))


def vertices(path):
    return [tuple(map(float, line.split()[1:])) for line in pathlib.Path(path).read_text().splitlines() if line.strip().startswith("vertex")]


def end_direction(before, after, x=SIZE[0]):
    """Angle in the x-z plane [deg] that the upright edge of the end at x has turned by, and where its middle is."""
    low = [b for a, b in zip(before, after) if a[0] == x and a[2] == 0]
    high = [b for a, b in zip(before, after) if a[0] == x and a[2] == SIZE[2]]
    mean = lambda points: [sum(p[i] for p in points) / len(points) for i in range(3)]
    a, b = mean(sorted(set(low))), mean(sorted(set(high)))
    return math.degrees(math.atan2(a[0] - b[0], b[2] - a[2])), [(p + q) / 2 for p, q in zip(a, b)]


def test_a_bar_is_bent_to_the_arc_that_is_asked_for():
    part()
    for angle in (90, 30):
        expect_ok(run("flexel", "flex", "bar.stl", "--bend", f"{angle} deg", *HOW, "-o", "bent.stl", "--summary", "s.json"))
        turned, middle = end_direction(vertices("bar.stl"), vertices("bent.stl"))
        expect(abs(turned - angle) < 0.1, f"{turned} degrees")
        radius = SIZE[0] / math.radians(angle)
        exact = [radius * math.sin(math.radians(angle)), SIZE[1] / 2, SIZE[2] / 2 + radius * (1 - math.cos(math.radians(angle)))]
        expect(math.dist(middle, exact) < 0.005 * SIZE[0], f"{middle} is not {exact}")
        told = json.loads(pathlib.Path("s.json").read_text())["flex"]
        # what holds the first end yields a little, too
        held, _ = end_direction(vertices("bar.stl"), vertices("bent.stl"), 0)
        expect(abs(held) < 0.1, f"{held} degrees")
        expect(abs(math.degrees(told["angle"]) - (turned - held)) < 0.01, f"{told}, {turned}, {held}")
        expect(abs(told["volume_change"]) < 0.02, told)
    expect_ok(run("flexel", "flex", "bar.stl", "--bend", "30 deg", "--about", "y", *HOW, "-o", "down.stl"))
    turned, middle = end_direction(vertices("bar.stl"), vertices("down.stl"))
    expect(abs(turned + 30) < 0.1 and middle[2] < -10, f"{turned} degrees, {middle}")


def test_a_bar_is_twisted():
    part()
    done = expect_ok(run("flexel", "flex", "bar.stl", "--twist", "45 deg", *[each for each in HOW if each != "--quiet"], "-o", "twisted.stl"))
    expect("twisted by 45.00 deg between its ends" in done.err, done.err)
    before, after = vertices("bar.stl"), vertices("twisted.stl")
    edge = [(a, b) for a, b in zip(before, after) if a[0] == SIZE[0] and a[2] == 0]
    left = next(b for a, b in edge if a[1] == 0)
    right = next(b for a, b in edge if a[1] == SIZE[1])
    turned = math.degrees(math.atan2(right[2] - left[2], right[1] - left[1]))
    expect(abs(turned - 45) < 0.1, f"{turned} degrees")


def test_an_end_that_gives_way_is_told():
    """A ball reaches its ends with little of its surface."""
    done = expect_ok(run("flexel", "flex", PARTS / "ballA.off", "--bend", "20 deg", "--material", "rubber", "--count", "1500", "--no-estimate", "--summary", "s.json", "-o", "bent.stl"))
    told = math.degrees(json.loads(pathlib.Path("s.json").read_text())["flex"]["angle"])
    expect(told < 19, told)
    expect(f"the ends have turned by {told:.2f} deg, not by 20.00 deg" in done.err, done.err)


def test_ends_that_turn_by_less_than_half_are_a_failure():
    """A bar at 45 degrees reaches its ends with edges. What came of it is there all the same."""
    at = lambda x, y, z: ((x - y) * math.sqrt(0.5), (x + y) * math.sqrt(0.5), z)
    triangles = [[at(*corner) for corner in triangle] for triangle in box_triangles((100.0, 10.0, 10.0))]
    pathlib.Path("askew.stl").write_bytes(ascii_stl(triangles))
    done = run("flexel", "flex", "askew.stl", "--twist", "30 deg", "--material", "PLA", "--count", "2000", "--no-estimate", "-o", "twisted.stl")
    expect_error(done, "flexel", "the ends have turned by ", "not by 30.00 deg", code=4)
    expect(len(vertices("askew.stl")) > 0 and pathlib.Path("twisted.stl").stat().st_size > 0, "it is written")


def spindle(tip):
    """STL of a round bar along x, 8 mm thick, whose far end narrows to `tip` mm."""
    round_at = lambda x, r: [(x, r * math.cos(math.pi * i / 6), r * math.sin(math.pi * i / 6)) for i in range(12)]
    rings = [round_at(x, r) for x, r in ((0, 4), (52, 4), (60, tip / 2))]
    near, far = rings[0], rings[-1]
    triangles = [[near[0], near[i + 1], near[i]] for i in range(1, 11)] + [[far[0], far[i], far[i + 1]] for i in range(1, 11)]
    for a, b in zip(rings, rings[1:]):
        for i in range(12):
            j = (i + 1) % 12
            triangles += [[a[i], a[j], b[j]], [a[i], b[j], b[i]]]
    pathlib.Path("spindle.stl").write_bytes(ascii_stl(triangles))


def test_whole_turns_are_measured():
    """A tip gives way and leaves the bar as it was, which a whole turn hides from the ends; a bar that turns has turned."""
    how = ("--along", "x", "--material", "rubber", "--size", "1.5mm", "--no-estimate", "--summary", "s.json", "-o", "twisted.stl", "--force")
    told = lambda: math.degrees(json.loads(pathlib.Path("s.json").read_text())["flex"]["angle"])
    spindle(.2)
    done = run("flexel", "flex", "spindle.stl", "--twist", "360 deg", *how)
    expect_error(done, "flexel", "not by 360.00 deg", code=4)
    expect(abs(told()) < 90, told())
    spindle(8)
    expect_ok(run("flexel", "flex", "spindle.stl", "--twist", "360 deg", *how))
    expect(abs(told() - 360) < 5, told())
    expect_ok(run("flexel", "flex", "spindle.stl", "--bend", "200 deg", *how))
    expect(abs(told() - 200) < 5, told())


def test_the_angle_is_that_of_the_ends():
    """The matter between them only counts whole turns: over two cells across it turns by a fifth less from slice to slice."""
    pathlib.Path("bar.stl").write_bytes(ascii_stl(box_triangles((60.0, 10.0, 10.0))))
    for angle, within in ((440, 10), (-400, 10)):
        expect_ok(run("flexel", "flex", "bar.stl", "--twist", f"{angle} deg", "--along", "x", "--material", "rubber", "--size", "5mm",
                      "--no-estimate", "--summary", "s.json", "-o", "twisted.stl", "--force"))
        found = math.degrees(json.loads(pathlib.Path("s.json").read_text())["flex"]["angle"])
        expect(abs(found - angle) < within, f"{angle} degrees asked for: {found}")


def test_what_cannot_be_is_one_line():
    part()
    flex = lambda *words: run("flexel", "flex", "bar.stl", *words, "--material", "PLA", "--size", "2mm", "-o", "bent.stl")
    expect_error(flex(), "flexel", "give --bend")
    expect_error(flex("--bend", "90 deg", "--twist", "1 deg"), "flexel", "not both")
    expect_error(flex("--bend", "0 deg"), "flexel", '--bend "0 deg" leaves the part as it is')
    expect_error(flex("--bend", "2000 deg"), "flexel", "whole turns")
    expect_error(flex("--bend", "90"), "flexel", '--bend "90": ')
    expect_error(flex("--bend", "90 deg", "--along", "w"), "flexel", "use x, y or z")
    expect_error(flex("--bend", "90 deg", "--along", "x", "--about", "x"), "flexel", "across it")
    expect_error(flex("--bend", "90 deg", "--about", "-w"), "flexel", "use x, y, z, -x, -y or -z")
    expect_error(flex("--twist", "90 deg", "--about", "x"), "flexel", "--about is of --bend")
    expect_error(run("flexel", "flex", "bar.stl", "--bend", "90 deg", "-o", "bent.stl"), "flexel", "no material")
    expect_error(flex("--bend", "90 deg", "--fix", "xmin"), "flexel", "--fix")
    expect(not pathlib.Path("bent.stl").exists(), "something was written")


def test_two_bars_beside_each_other_turn_as_one_does():
    """Bent to one arc they end up through each other, so that where they lie beside each other says nothing of how they turn."""
    upper = [[(x, y, z + 15) for x, y, z in triangle] for triangle in box_triangles((80.0, 20.0, 5.0))]
    pathlib.Path("low.stl").write_bytes(ascii_stl(box_triangles((80.0, 20.0, 5.0)), "low"))
    pathlib.Path("high.stl").write_bytes(ascii_stl(upper, "high"))
    expect_ok(run("flexel", "flex", "low.stl", "high.stl", "--bend", "90 deg", "--material", "PLA", "--size", "2mm", "--no-estimate", "--quiet", "-o", "bent.stl",
                  "--summary", "s.json"))
    told = math.degrees(json.loads(pathlib.Path("s.json").read_text())["flex"]["angle"])
    expect(abs(told - 90) < 1, told)


if __name__ == "__main__":
    main(globals())

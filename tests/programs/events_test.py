"""Events of timed runs from the outside: what a chain of programs gets, and what is refused."""

import json
import os

from harness import body, expect, expect_error, expect_ok, expect_only, main, run, scene, write
from shapes import binary_stl, box_triangles

# A part of 40 x 10 x 10 mm of 5 mm cells, pulled longer by a move and then let be.
PULLED = """material = "rubber"
[[fix]]
where = "xmin"
[[move]]
where = "xmax"
displacement = ["4 mm", "free", "free"]
"""
FREE = """material = "rubber"
[damping]
time = "20 us"
[run]
time = "2 ms"
"""
CARVE = '[[event]]\nat = "1 ms"\ndo = "carve"\nwhere = {{ box = {{ min = ["{}", "-1 mm", "-1 mm"], max = ["41 mm", "11 mm", "11 mm"] }} }}\n'


def summary(*arguments):
    expect_ok(run("flexel-simulate", *arguments, "--summary", "s.json"))
    return json.load(open("s.json"))


def test_a_renormalised_body_keeps_its_shape():
    """Frozen at equilibrium and then let go: not held by anything, it stays as long as it was pulled; without freezing it does not."""
    body()
    scene("pull.toml", PULLED)
    scene("freeze.toml", PULLED + "[run]\nrenormalise = true\n")
    scene("free.toml", FREE)
    expect_ok(run("flexel-simulate", "freeze.toml", "body.vtu", "-o", "frozen.vtu"))
    expect_ok(run("flexel-simulate", "pull.toml", "body.vtu", "-o", "pulled.vtu"))
    frozen = summary("free.toml", "frozen.vtu", "-o", "rest.vtu")
    let_go = summary("free.toml", "pulled.vtu", "-o", "sprung.vtu")
    expect(frozen["elastic_energy"] < 1e-9 * let_go["elastic_energy"], f"{frozen['elastic_energy']} J of {let_go['elastic_energy']} J")
    map_of = {name: expect_ok(run("flexel-map", f"{name}.vtu", "--format", "obj")).out.decode() for name in ("frozen", "rest", "sprung")}

    def longest(text):
        return max(float(line.split()[1]) for line in text.splitlines() if line.startswith("v "))

    expect(abs(longest(map_of["frozen"]) - 44) < 0.1, "the pulled part should be 44 mm long")
    expect(abs(longest(map_of["rest"]) - longest(map_of["frozen"])) < 1e-6, "what was frozen should stay")
    expect(abs(longest(map_of["sprung"]) - longest(map_of["rest"])) > 0.01, "what was not frozen should spring back")


def test_an_event_at_the_very_end_has_forces():
    """As those of a run that goes on for one step, with books and without."""
    body()
    for do in ('do = "edit"\nstiffness = 3.0\n', 'do = "renormalise"\n', CARVE.split("\n", 2)[2].format("19 mm")):
        force = []
        for time, more in (("2 ms", ()), ("2 ms", ("--history", "h.csv")), ("2.002 ms", ())):
            scene(text=FREE.replace('"2 ms"', f'"{time}"\nstep = "2 us"') + '[[fix]]\nwhere = "xmin"\n[gravity]\nacceleration = [0, 0, "-9.81 m/s2"]\n'
                  '[[velocity]]\nwhere = { half_space = { point = ["15 mm", 0, 0], normal = [1, 0, 0] } }\nvelocity = ["1 m/s", 0, 0]\n'
                  f'[[event]]\nat = "2 ms"\n{do}')
            force.append(summary("scene.toml", "body.vtu", "-o", "out.vtu", "--force", *more)["reactions"][0]["force"])
        size = max(map(abs, force[2]))
        expect(size > 0.01, f"{do}: the support bears {force[2]} N")
        for found in force[:2]:
            expect(max(abs(a - b) for a, b in zip(found, force[2])) < 1e-6 * size, f"{do}: {found} N, and {force[2]} N a step later")


def test_carving_half_takes_half_the_mass():
    inputs = [body(), scene(text=FREE + CARVE.format("19 mm"))]
    result = run("flexel-simulate", "scene.toml", "body.vtu", "-o", "out.vtu", "--summary", "s.json", "--history", "h.csv")
    expect_ok(result)
    expect("carve" in result.err, f"a warning should tell of the surface: {result}")
    # the cells right of 20 mm, all eight elements of which are in the region
    expect(abs(json.load(open("s.json"))["mass"] - 930 * 2e-6) < 1e-9, json.load(open("s.json"))["mass"])
    expect_only(*inputs, "out.vtu", "s.json", "h.csv")
    mapped = expect_ok(run("flexel-map", "out.vtu", "--format", "stl"))
    expect("carved away" in mapped.err, f"the mapping should tell, too: {mapped}")


def test_fused_parts_stay_fused_in_later_runs():
    """In time and at equilibrium; without the event the second part has nothing that holds it."""
    write("box.stl", binary_stl(box_triangles()))
    write("twin.stl", binary_stl([[[x + 40.1, y, z] for x, y, z in triangle] for triangle in box_triangles()]))
    for placement, within in (("corner", "0.5 mm"), ("centre", "7.3 mm")):
        for name in ("box", "twin"):
            expect_ok(run("flexel-voxelize", f"{name}.stl", "--size", "5 mm", "--placement", placement, "-o", f"{name}.vtu"))
        scene("fuse.toml", FREE + f'[[event]]\nat = "0 s"\ndo = "fuse"\nwithin = "{within}"\n')
        expect_ok(run("flexel-simulate", "fuse.toml", "box.vtu", "twin.vtu", "-o", "out.vtu"))
        pulled = scene("pull.toml", 'material = "rubber"\n[[fix]]\nwhere = "box/xmin"\n[[load]]\nwhere = "twin/xmax"\nforce = ["1 N", 0, 0]\n'
                                    '[[probe]]\nname = "end"\nwhere = "twin/xmax"\n')
        end = summary(pulled, "out.vtu", "-o", "on.vtu")["probes"][0]["displacement"][0]
        expect(1e-5 < end < 1e-3, f"{placement}: the end is drawn by {end} m")
        expect_ok(run("flexel-simulate", scene("free.toml", FREE), "on.vtu", "-o", "free.vtu"))
        expect_error(run("flexel-simulate", pulled, "box.vtu", "twin.vtu", "-o", "loose.vtu"), "flexel-simulate", "twin")


def test_refusals():
    body()
    for text, fragments in (
        (FREE + '[[event]]\nat = "3 ms"\ndo = "renormalise"\n', ("scene.toml:6", "0.003 s", "0.002 s")),
        (FREE + '[[event]]\nat = "1 ms"\ndo = "explode"\n', ("scene.toml:", "explode", "renormalise")),
        (FREE + '[[event]]\nat = "1 ms"\ndo = "edit"\nstiffness = -2\n', ("scene.toml:", "stiffness")),
        (FREE + '[[event]]\nat = "1 ms"\ndo = "edit"\nstifness = 2\n', ("scene.toml:", "stiffness")),
        (FREE + '[[event]]\nat = "1 ms"\ndo = "add"\nbody = "missing.vtu"\n', ("missing.vtu",)),
        (PULLED + '[[event]]\nat = "1 ms"\ndo = "renormalise"\n', ("event", "time")),
    ):
        scene(text=text)
        expect_error(run("flexel-simulate", "scene.toml", "body.vtu", "-o", "out.vtu"), "flexel-simulate", *fragments)
        expect_only("body.vtu", "scene.toml")


def test_what_an_event_makes_impossible_ends_the_run_with_its_state():
    """Exit code 3, and the state before the event, which is that of a run that ends there; at the start exit code 2, and nothing."""
    body()
    load = FREE + '[[load]]\nwhere = "xmax"\nforce = ["1 N", 0, 0]\n'
    scene("until.toml", load.replace('time = "2 ms"', 'time = "1 ms"'))
    expect_ok(run("flexel-simulate", "until.toml", "body.vtu", "-o", "until.vtu"))
    expect_ok(run("flexel-map", "until.vtu", "-o", "until.obj"))
    for text, fragments in (
        (load + CARVE.format("19 mm"), ("scene.toml:", "xmax")),
        (load + CARVE.format("-1 mm"), ("scene.toml:", "carve", "nothing")),
        (load + '[[event]]\nat = "1 ms"\ndo = "fuse"\nwithin = "1 mm"\n', ("scene.toml:", "fuse", "nothing")),
    ):
        scene(text=text)
        expect_error(run("flexel-simulate", "scene.toml", "body.vtu", "-o", "out.vtu"), "flexel-simulate", "0.001 s", "out.failed.vtu", *fragments, code=3)
        expect_only("body.vtu", "scene.toml", "until.toml", "until.vtu", "until.obj", "out.failed.vtu")
        expect_ok(run("flexel-map", "out.failed.vtu", "-o", "failed.obj"))
        left, right = ([float(x) for line in open(name) if line.startswith("v ") for x in line.split()[1:]] for name in ("failed.obj", "until.obj"))
        expect(len(left) == len(right) and max(abs(a - b) for a, b in zip(left, right)) < 1e-4, f"another state: {left}, {right}")
        expect(max(left) > 40.05, "it has not moved yet")
        os.remove("failed.obj")
        os.remove("out.failed.vtu")
        scene(text=text.replace('at = "1 ms"', 'at = "0 ms"'))
        expect_error(run("flexel-simulate", "scene.toml", "body.vtu", "-o", "out.vtu"), "flexel-simulate", *fragments)
        expect_only("body.vtu", "scene.toml", "until.toml", "until.vtu", "until.obj")


def test_a_rigid_part_of_edited_density_turns_as_a_stiff_one():
    """Heavy on one half and light on the other, its whole mass as before: pushed at the middle it turns about the heavy half."""
    write("bar.stl", binary_stl(box_triangles((60, 10, 10))))
    expect_ok(run("flexel-voxelize", "bar.stl", "--size", "5 mm", "-o", "bar.vtu"))
    edit = ('[[event]]\nat = "0 s"\ndo = "edit"\nwhere = {{ box = {{ min = ["{} mm", "-1 mm", "-1 mm"], max = ["{} mm", "11 mm", "11 mm"] }} }}\n'
            'density = {}\n')
    ends = {}
    for rigid in ("true", "false"):
        write("scene.toml", 'material = "m"\n[materials.m]\nyoung = "1 GPa"\npoisson = 0.3\ndensity = "1000 kg/m3"\n'
              f"[parts.bar]\nrigid = {rigid}\n" + edit.format(29, 61, .1) + edit.format(-1, 31, 1.9) +
              '[[load]]\nwhere = "zmin"\nforce = ["0 N", "0 N", "0.01 N"]\n'
              '[[probe]]\nname = "heavy"\nat = ["0 mm", "5 mm", "5 mm"]\n[[probe]]\nname = "light"\nat = ["60 mm", "5 mm", "5 mm"]\n'
              '[run]\ntime = "20 ms"\n')
        found = summary("scene.toml", "bar.vtu", "-o", "out.vtu", "--no-stress")["probes"]
        ends[rigid] = [probe["displacement"][2] for probe in found]
    heavy, light = ends["true"]
    expect(heavy < 0 < light, ends)
    for stiff, soft in zip(ends["true"], ends["false"]):
        expect(abs(stiff - soft) < 0.2 * abs(soft), ends)


if __name__ == "__main__":
    main(globals())

"""Assemblies of STEP files: parts that touch do what the scene says, and names of assemblies stand for the parts in them."""

import json
import pathlib
import re

from harness import PARTS, Skip, expect, expect_error, expect_ok, main, need, need_step, run, scene, write

# A bolt whose head rests on a plate; its shank has 1 mm of play.
BOLTED = """SetFactory("OpenCASCADE");
Box(1) = {-20, -10, 0, 40, 20, 5};
Cylinder(2) = {0, 0, -1, 0, 0, 7, 4};
BooleanDifference(3) = { Volume{1}; Delete; }{ Volume{2}; Delete; };
Cylinder(4) = {0, 0, -6, 0, 0, 11, 3};
Cylinder(5) = {0, 0, 5, 0, 0, 4, 8};
BooleanUnion(6) = { Volume{4}; Delete; }{ Volume{5}; Delete; };
Save "bolted.step";
"""

PULL = """material = "rubber"
HOLD
[damping]
time = "50 us"
[[fix]]
where = "PLATE/xmin"
[[fix]]
where = "PLATE/xmax"
[[manipulator]]
part = "BOLT"
time = ["0 s", "10 ms"]
displacement = [["0 mm", "0 mm", "0 mm"], ["0 mm", "0 mm", "WAY mm"]]
[[probe]]
name = "under the head"
at = ["0 mm", "6 mm", "4.8 mm"]
[run]
time = "12 ms"
"""


def moved(hold, way, plate, bolt):
    """How far the plate goes along z under the head, mm."""
    scene("pull.toml", PULL.replace("HOLD", hold).replace("WAY", str(way)).replace("PLATE", plate).replace("BOLT", bolt))
    expect_ok(run("flexel-simulate", "pull.toml", "body.vtu", "-o", "pulled.vtu", "--summary", "s.json"))
    return 1e3 * json.loads(pathlib.Path("s.json").read_text())["probes"][0]["displacement"][2]


def test_a_bolt_and_a_plate_are_bonded_or_in_contact_as_the_scene_says():
    need_step()
    need("gmsh")
    write("bolted.geo", BOLTED)
    run("gmsh", "bolted.geo", "-0", "-v", "1")
    expect_ok(run("flexel-voxelize", "bolted.step", "--size", "2 mm", "-o", "body.vtu"))
    plate, bolt = ("bolted", "bolted-2")
    expect(abs(moved("", 1, plate, bolt) - 1) < .2, "bonded, the plate comes along")
    expect(abs(moved("contact = true", 1, plate, bolt)) < .05, "in contact, the bolt lifts off")
    expect(abs(moved("contact = true", -1, plate, bolt) + 1) < .2, "in contact, the head presses the plate down")
    expect(abs(moved("bond = false", -1, plate, bolt)) < .05, "with neither, the bolt goes through")
    bonded = f'contact = true\n[[bond]]\nparts = ["{plate}", "{bolt}"]'
    expect(abs(moved(bonded, 1, plate, bolt) - 1) < .2, "[[bond]] holds them in spite of contact")


FITTED = BOLTED.replace("0, 0, 7, 4", "0, 0, 7, 3").replace("bolted.step", "fitted.step")

PRESSED = """material = "PLA"
contact = true
[[fix]]
where = "PLATE/xmin"
[[fix]]
where = "PLATE/xmax"
[[load]]
where = "BOLT/zmax"
force = ["0 N", "0 N", "-20 N"]
"""


def test_a_bolt_that_fills_its_hole_is_no_press_fit():
    need_step()
    need("gmsh")
    write("fitted.geo", FITTED)
    run("gmsh", "fitted.geo", "-0", "-v", "1")
    expect_ok(run("flexel-voxelize", "fitted.step", "--size", "2 mm", "-o", "body.vtu"))
    scene("press.toml", PRESSED.replace("PLATE", "fitted").replace("BOLT", "fitted-2"))
    expect_ok(run("flexel-simulate", "press.toml", "body.vtu", "-o", "pressed.vtu", "--no-estimate", "--summary", "s.json"))
    found = json.loads(pathlib.Path("s.json").read_text())
    left, right = (each["force"] for each in found["reactions"])
    expect(abs(left[2] + right[2] - 20) < .1, f"the ends bear the load: {left} {right}")
    # of 20 N in the middle between clamped ends; the rims of the hole pressed with over 100 N
    expect(abs(left[0]) < 20 and abs(right[0]) < 20, f"the bolt does not press the ends apart: {left} {right}")


SWOLLEN = """[parts.fitted]
material = "plate"
[parts.fitted-2]
material = "pin"
[[thermal]]
part = "fitted"
change = "0 K"
[[thermal]]
part = "fitted-2"
change = "16.667 K"
[materials.plate]
young = "3.25 GPa"
poisson = 0.36
density = "1240 kg/m3"
expansion = "1e-3 /K"
[materials.pin]
young = "3.25 GPa"
poisson = 0.36
density = "1240 kg/m3"
expansion = "1e-3 /K"
"""

HELD = "".join(f'[[fix]]\nwhere = "fitted/{side}"\n' for side in ("xmin", "xmax"))


def test_a_press_fit_presses_as_a_pin_that_swells():
    need_step()
    need("gmsh")

    def pushes(radius, text):
        """N, along the plate."""
        write("fitted.geo", BOLTED.split("Cylinder(4)")[0].replace("0, 0, 7, 4", "0, 0, 7, 3") + f'Cylinder(4) = {{0, 0, -6, 0, 0, 15, {radius}}};\nSave "fitted.step";\n')
        run("gmsh", "fitted.geo", "-0", "-v", "1")
        expect_ok(run("flexel-voxelize", "fitted.step", "--size", "2 mm", "-o", "body.vtu", "--quiet", "--force"))
        scene("fit.toml", text + HELD)
        expect_ok(run("flexel-simulate", "fit.toml", "body.vtu", "-o", "pressed.vtu", "--no-estimate", "--summary", "s.json", "--quiet", "--force"))
        left, right = (each["force"] for each in json.loads(pathlib.Path("s.json").read_text())["reactions"])
        expect(abs(left[0] + right[0]) < .01 * max(1, abs(left[0])), f"{left} {right}")
        return left[0]

    load = '[[load]]\nwhere = "fitted-2/zmax"\nforce = ["0 N", "0 N", "-100 mN"]\n'
    at_once = 'material = "PLA"\ncontact = true\n' + load
    let_out = 'material = "PLA"\n[contact]\noverlap = "part"\noverlap_time = "20 ms"\n' + load
    swollen = pushes(3, SWOLLEN)
    for text in (at_once, let_out):
        # of 50 um a fifth is the soft part, and of what is left contact's own yielding takes a share
        pressed = pushes(3.05, text)
        expect(.5 < pressed / swollen < .85, f"{pressed} N, swollen {swollen} N: {text}")
    # in contact at once: test_a_bolt_that_fills_its_hole_is_no_press_fit
    expect(abs(pushes(3, let_out)) < .01 * swollen, "a pin that just fits presses nothing")


def test_a_fit_that_facets_hide_is_told():
    need_step()
    need("gmsh")

    def told(offset, radius):
        """Lines about a pin so far off the middle of a hole of 3 mm, mm."""
        write("fitted.geo", BOLTED.split("Cylinder(4)")[0].replace("0, 0, 7, 4", "0, 0, 7, 3") + f'Cylinder(4) = {{{offset}, 0, -6, 0, 0, 15, {radius}}};\nSave "fitted.step";\n')
        run("gmsh", "fitted.geo", "-0", "-v", "1")
        expect_ok(run("flexel-voxelize", "fitted.step", "--size", "2 mm", "-o", "body.vtu", "--quiet", "--force"))
        scene("fit.toml", 'material = "PLA"\n[contact]\noverlap = "part"\noverlap_time = "1 ms"\n[run]\ntime = "1 us"\n' + HELD)
        said = expect_ok(run("flexel-simulate", "fit.toml", "body.vtu", "-o", "pressed.vtu", "--quiet", "--force")).err
        return [line for line in said.splitlines() if "fit each other" in line]

    lines = told(.02, 3)
    expect(len(lines) == 1 and '"fitted" and "fitted-2"' in lines[0] and "not at all" in lines[0], lines)
    for offset, radius in (.1, 3), (0, 3.05), (0, 2.7):
        expect(told(offset, radius) == [], f"{offset} {radius}")


def test_a_fit_that_facets_hide_is_told_once_in_a_run():
    need_step()
    need("gmsh")
    write("fitted.geo", BOLTED.split("Cylinder(4)")[0].replace("0, 0, 7, 4", "0, 0, 7, 3") + 'Cylinder(4) = {.02, 0, -6, 0, 0, 15, 3};\nSave "fitted.step";\n')
    write("far.geo", 'SetFactory("OpenCASCADE");\nBox(1) = {0, 0, 50, 6, 6, 6};\nSave "far.step";\n')
    for name in "fitted", "far":
        run("gmsh", f"{name}.geo", "-0", "-v", "1")
        expect_ok(run("flexel-voxelize", f"{name}.step", "--size", "2 mm", "-o", f"{name}.vtu", "--quiet"))
    scene("fit.toml", 'material = "PLA"\n[contact]\noverlap = "part"\noverlap_time = "1 us"\n[run]\ntime = "2 us"\n[[event]]\nat = "1 us"\ndo = "add"\nbody = "far.vtu"\n' + HELD)
    said = expect_ok(run("flexel-simulate", "fit.toml", "fitted.vtu", "-o", "pressed.vtu", "--quiet")).err
    expect(said.count("fit each other") == 1, f"a part that comes leaves the fit as it was: {said}")
    # In the summary as well, and from a checkpoint again.
    scene("longer.toml", 'material = "PLA"\n[contact]\noverlap = "part"\noverlap_time = "1 us"\n[run]\ntime = "50 us"\n' + HELD)
    first = expect_ok(run("flexel-simulate", "longer.toml", "fitted.vtu", "-o", "one.vtu", "--summary", "first.json", "--checkpoint", "run.checkpoint",
                          "--checkpoint-every", "1 ms")).err
    again = expect_ok(run("flexel-simulate", "--resume", "run.checkpoint", "-o", "again.vtu", "--summary", "again.json")).err
    for name, said in (("first.json", first), ("again.json", again)):
        warnings = json.loads(pathlib.Path(name).read_text())["warnings"]
        told = [line for line in warnings if "fit each other" in line]
        expect(len(told) == 1 and said.count(told[0]) == 1, f"{name}: {warnings}, {said}")


def test_names_of_assemblies_stand_for_their_parts():
    need_step()
    part = PARTS / "as1-oc-214.stp"
    if not part.exists():
        raise Skip("no real parts here")
    text = """[parts.as1]
material = "steel"
[parts.nut-bolt-assembly]
material = "brass"
[parts."l-bracket-assembly/l-bracket"]
material = "PLA"
[[fix]]
where = "plate/zmin"
[[move]]
where = "rod/xmax"
displacement = ["0 mm", "8 mm", "0 mm"]
"""
    scene(text=text)
    expect_ok(run("flexel-voxelize", part, "--count", "1500", "-o", "rest.vtu", "--quiet"))
    expect_ok(run("flexel-simulate", "scene.toml", "rest.vtu", "-o", "bent.vtu", "--no-estimate", "--quiet", "--summary", "s.json"))
    materials = {each["name"]: each["material"] for each in json.loads(pathlib.Path("s.json").read_text())["parts"]}
    expect(len(materials) == 18 and materials["plate"] == "steel" and materials["rod"] == "steel", f"{materials}")
    brass = {name for name, material in materials.items() if material == "brass"}
    expect(brass == {"bolt", "nut-3", "bolt-4", "nut-6"}, f"one pair in either bracket's assembly: {materials}")
    expect(materials["l-bracket"] == "PLA" and materials["l-bracket-2"] == "steel", f"{materials}")
    scene("bond.toml", text + '[[bond]]\nparts = ["nut-bolt-assembly", "plate"]\n')
    expect_error(run("flexel-simulate", "bond.toml", "rest.vtu", "-o", "x.vtu"), "flexel-simulate", '"nut-bolt-assembly" is an assembly of')
    scene("none.toml", text.replace("parts.nut-bolt-assembly", "parts.nut-bolt-assembley"))
    expect_error(run("flexel-simulate", "none.toml", "rest.vtu", "-o", "x.vtu"), "flexel-simulate", 'the body has no part "nut-bolt-assembley"')
    command = ("flexel", "deform", part, "--count", "1500", "--material", "as1=steel", "--material", "nut-bolt-assembly=brass", "--fix", "plate/zmin", "--push", "rod/xmax: 0 10 0 N")
    expect_ok(run(*command, "-o", "bent.stl", "--no-estimate", "--quiet"))
    expect_error(run(*command, "--material", "nuts=brass", "-o", "bent.stl"), "flexel", 'no part "nuts"')


def test_of_a_part_its_own_entry_goes_before_those_of_its_assemblies():
    need_step()
    part = PARTS / "as1-oc-214.stp"
    if not part.exists():
        raise Skip("no real parts here")
    expect_ok(run("flexel-voxelize", part, "--count", "1500", "-o", "rest.vtu", "--quiet"))
    top = 'material = "steel"\nbond = false\n[[fix]]\nwhere = "plate/zmin"\n[run]\ntime = "1 us"\n'

    def rigid(*entries):
        """How many parts are rigid, whichever way round the entries stand."""
        counts = set()
        for order in (entries, entries[::-1]):
            scene(text=top + "".join(f'[parts."{name}"]\nrigid = {flag}\n' for name, flag in order))
            said = expect_ok(run("flexel-simulate", "scene.toml", "rest.vtu", "-o", "moved.vtu", "--explain")).err
            found = re.search(r"(\d+) rigid part\(s\)", said)
            counts.add(int(found[1]) if found else 0)
        expect(len(counts) == 1, f"the order of the entries counts: {entries}, {counts}")
        return counts.pop()

    pair = ("nut-bolt-assembly", "true")
    expect(rigid(pair) == 4, "two bolts and two nuts")
    expect(rigid(pair, ("bolt", "false")) == 3, "the bolt's own entry goes before its assembly's")
    expect(rigid(("nut-bolt-assembly", "false"), ("bolt", "true")) == 1, "and so where it is the one that is rigid")
    expect(rigid(("l-bracket-assembly", "false"), pair) == 4, "the smaller assembly goes before the larger")
    expect(rigid(("l-bracket-assembly", "true"), ("nut-bolt-assembly", "false"), ("bolt", "true"), ("plate", "false")) == 6, "7, less the 2 of the smaller, and the bolt")
    expect(rigid(pair, *((name, "false") for name in ("bolt", "nut-3", "bolt-4", "nut-6"))) == 0, "none is left")


if __name__ == "__main__":
    main(globals())

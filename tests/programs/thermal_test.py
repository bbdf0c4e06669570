"""[thermal], conduction, [shrinkage]: known answers (cases of bench/accuracy/thermal.py), and what is refused."""

import importlib.util
import json
import pathlib
import re

from harness import SOURCE, Skip, ascii_stl, box_triangles, expect, expect_error, expect_ok, main, run

spec = importlib.util.spec_from_file_location("thermal_cases", SOURCE / "bench/accuracy/thermal.py")
CASES = importlib.util.module_from_spec(spec)
HERE = pathlib.Path(".")
HELD = '[[fix]]\nwhere = "xmin"\n'


def cases():
    import os
    from harness import BIN
    os.environ["PATH"] = f"{BIN}:{os.environ['PATH']}"
    spec.loader.exec_module(CASES)
    return CASES


def near(found, exact, share):
    expect(abs(found / exact - 1) < share, f"{found} and not {exact}: {100 * (found / exact - 1):.3f} %")


def test_a_free_body_expands_without_stress():
    try:
        import meshio  # noqa: F401
    except ImportError as error:
        raise Skip("no meshio") from error
    wrong, stress = cases().free_expansion(HERE)
    expect(wrong < 1e-10 and stress < 1e-10, f"displacements off by {wrong:.2e}, stress {stress:.2e} of E alpha dT")


def test_between_walls():
    near(*cases().between_walls(HERE), 1e-6)
    near(*cases().held_all_around(HERE), 1e-6)


def test_bimetal_strip():
    near(*cases().bimetal(HERE, length=18.0, size=1 / 3, far=12.0), 0.02)


def test_tube_under_a_temperature_difference():
    for title, found, exact in cases().tube(HERE):
        expect(abs(found / exact - 1) < 0.02, f"{title}: {found} and not {exact}")


def test_conduction():
    near(*cases().rod(HERE), 2e-4)  # four digits are told
    near(*cases().wall(HERE), 2e-4)
    near(*cases().fin(HERE), 0.02)


def test_a_printed_bar_curls():
    near(*cases().printed_bar(HERE), 0.02)


def refused(thermal, *fragments, material="steel", model="quadratic", extra=""):
    pathlib.Path("part.stl").write_bytes(ascii_stl(box_triangles()))
    expect_ok(run("flexel-voxelize", "part.stl", "--size", "5mm", "--moments", "-o", "rest.vtu", "--force"))
    pathlib.Path("s.toml").write_text(f'material = "{material}"\nmodel = "{model}"\n{thermal}\n{HELD}{extra}')
    expect_error(run("flexel-simulate", "s.toml", "rest.vtu", "-o", "bent.vtu"), "flexel-simulate", *fragments)


def test_wrong_heat_is_one_line():
    refused('[thermal]\nchange = "80 K"', "PLA", "expansion", material="PLA")
    refused('[thermal]\nchange = 80', "unit")
    refused('[thermal]\nchange = "80 mm"', "is a length", "difference of temperatures")
    refused('[thermal]\nchange = "80 Kk"', "unknown unit", "Kk")
    refused('[thermal]\nchange = "nan K"', "not a finite")
    refused('[thermal]\nchange = "80000 K"', "if it were free")
    refused('[thermal]\ncolumn = "heat"\nreference = "20 degC"', "no column", "heat")
    refused('[thermal]\ncolumn = "heat"', "reference")
    refused('[thermal]\nreference = "20 degC"', "reference")
    refused('[thermal]\nchange = "1 K"\npart = "prt"', "no part", "part")
    refused('[thermal]\nchange = "1 K"', "springs", model="springs")
    refused('[thermal]\nchange = "1 K"\n[run]\ntime = "1 s"', "equilibrium", model="cells")
    refused('[[temperature]]\nwhere = "xmin"\nvalue = "-300 degC"', "absolute zero")
    refused('[[temperature]]\nwhere = "xmin"\nvalue = 0', "unit of temperature", "20 degC")
    refused('[[heat]]\nwhere = "xmin"\npower = "1 W"', "temperature")
    refused('[[temperature]]\nwhere = "xmin"\nvalue = "20 degC"', "conductivity", material="PLA")
    refused('[shrinkage]\nlayer = "0 mm"\nalong = "0 %"\nacross = "-1 %"', "above 0")


def between(text="", size="5mm", triangles=None, low=20, high=120, ends=("xmin", "xmax"), model="quadratic"):
    """Conduction between two ends of a part of material m, 50 W/(m K): what ran."""
    pathlib.Path("part.stl").write_bytes(triangles or ascii_stl(box_triangles()))
    expect_ok(run("flexel-voxelize", "part.stl", "--size", size, "--moments", "--align", "none", "-o", "rest.vtu", "--force"))
    material = '[materials.m]\nyoung = "200 GPa"\npoisson = 0.3\ndensity = "7800 kg/m3"\nconductivity = "50 W/(m K)"\n'
    faces = "".join(f'[[temperature]]\nwhere = "{end}"\nvalue = "{value} degC"\n' for end, value in zip(ends, (high, low)))
    pathlib.Path("s.toml").write_text(f'material = "m"\nmodel = "{model}"\n{text}{material}{faces}{HELD}')
    return run("flexel-simulate", "s.toml", "rest.vtu", "-o", "bent.vtu", "--no-estimate", "--force")


def heat_of(done):
    return float(re.search(r'heat through "xmin": (-?[\d.,]+) W', expect_ok(done).err).group(1).replace(",", ""))


def test_bonded_parts_do_not_conduct():
    halves = [[[(x + shift, y, z) for x, y, z in t] for t in box_triangles((20.0, 10.0, 10.0))] for shift in (0.0, 20.0)]
    part = ascii_stl(halves[0], "left") + ascii_stl(halves[1], "right")
    expect_error(between(triangles=part), "flexel-simulate", "left", "right", "bonded", "no heat")
    said = between("bond = false\n", triangles=part).err
    expect(said.count("touch, and parts pass no heat to each other") == 1, said)
    apart = ascii_stl(halves[0], "left") + ascii_stl([[(x + 5, y, z) for x, y, z in t] for t in halves[1]], "right")
    expect("touch" not in between(triangles=apart).err, "parts that are apart do not touch")
    fuse = '[[event]]\ndo = "fuse"\nwithin = "6 mm"\n'
    expect_error(between(fuse, triangles=apart, model="cells"), "flexel-simulate", "fused", "no heat")


def test_an_infill_conducts_less():
    solid = heat_of(between())
    near(solid, 50 * 1e-4 * 100 / 0.04, 1e-3)
    struts = (0.5 + 2 * 0.5**1.5) / 3
    near(heat_of(between('infill = "50 %"\n')), struts * solid, 1e-3)
    share = 1e-3 * 1800e-6 / 4e-6  # shell times area over volume
    walls = share - share * share / 4
    near(heat_of(between('infill = "50 %"\nshell = "1 mm"\n')), (walls + (1 - walls) * struts) * solid, 1e-3)


def test_heat_beside_a_given_temperature_is_not_lost():
    """5 W into both ends, one of which has a temperature: all of it comes in at the other, and a warning says so."""
    text = '[[heat]]\nname = "in"\nwhere = ["xmin", "xmax"]\npower = "5 W"\n'
    done = expect_ok(between(text, ends=("xmin",)))
    expect('"in" acts on 50 % of its area only' in done.err and "go straight out" in done.err, done.err)
    near(heat_of(done), -5, 1e-3)
    high = float(re.search(r"temperature .* to ([\d.]+) degC", done.err).group(1))
    near(high - 120, 5 * .04 / (50 * 1e-4), 1e-3)  # q L / k, above what is given
    near(heat_of(between('[[heat]]\nwhere = "xmax"\npower = "5 W"\n', ends=("xmin",))), -5, 1e-3)


def test_below_absolute_zero():
    refused('[[heat]]\nwhere = "xmin"\npower = "-50 W"\n[[convection]]\nwhere = "xmax"\ncoefficient = "10 W/(m2 K)"\n'
            'ambient = "20 degC"', "below absolute zero", "degC")


def test_the_range_is_of_the_matter():
    said = expect_ok(between(size="7mm")).err  # the lattice stands out of the part
    low, high = (float(each) for each in re.search(r"temperature (-?[\d.]+) to (-?[\d.]+) degC", said).groups())
    expect(abs(low - 20) < 0.1 and abs(high - 120) < 0.1, f"{low} to {high}, not 20 to 120")


def test_buckling_by_heat_is_told():
    """Held at both ends, a bar of 200 x 4 x 4 mm buckles near 110 K (Euler): told beyond it, and not far below."""
    pathlib.Path("thin.stl").write_bytes(ascii_stl(box_triangles((200.0, 4.0, 4.0))))
    expect_ok(run("flexel-voxelize", "thin.stl", "--size", "2 mm", "-o", "thin.vtu"))
    for change, told in (("60 K", False), ("300 K", True)):
        pathlib.Path("thin.toml").write_text(f'material = "steel"\n[thermal]\nchange = "{change}"\n{HELD}[[fix]]\nwhere = "xmax"\n')
        said = expect_ok(run("flexel-simulate", "thin.toml", "thin.vtu", "-o", "out.vtu", "--no-estimate")).err
        expect(("buckles under less heat" in said) == told, f"{change}: {said}")


POINT = '{{ box = {{ min = ["{} mm", "{} mm", "-1 mm"], max = ["{} mm", "{} mm", "0.1 mm"] }} }}'


def at_points(*held):
    """Holds points of the slab's lower side, at x and y in mm, along axes."""
    return "".join(f'[[fix]]\nwhere = {POINT.format(x - 0.1, y - 0.1, x + 0.1, y + 0.1)}\naxes = "{axes}"\n'
                   for x, y, axes in held)


ONE_POINT = at_points((0, 0, "xyz"))
THREE_POINTS = at_points((0, 0, "xyz"), (0, 10, "xz"), (100, 0, "z"))  # and what matter does goes on unhindered
ALLOY = ('material = "alloy"\n[materials.alloy]\nyoung = "100 GPa"\npoisson = 0\ndensity = "1000 kg/m3"\n'
         'expansion = "20e-6 /K"\n')


def slab():
    pathlib.Path("slab.stl").write_bytes(ascii_stl(box_triangles((100.0, 10.0, 10.0))))
    expect_ok(run("flexel-voxelize", "slab.stl", "--size", "2.5 mm", "-o", "slab.vtu"))


def of_the_slab(scene):
    pathlib.Path("scene.toml").write_text(scene)
    return run("flexel-simulate", "scene.toml", "slab.vtu", "-o", "out.vtu", "--summary", "out.json", "--force")


def test_what_holds_a_part_does_not_depend_on_its_heat():
    """Hindered expansion at the start made of a part that three points hold one that is free to turn, and hid of a
    cooled one that it is free."""
    slab()
    for change in (-100, 100, 1000):
        heat = f'[thermal]\nchange = "{change} K"\n'
        expect_ok(of_the_slab(ALLOY + THREE_POINTS + heat))
        far = abs(20e-6 * change) * 0.1 * (1 + 2 * 0.1**2) ** 0.5
        near(json.loads(pathlib.Path("out.json").read_text())["largest_displacement"], far, 1e-3)
        expect_error(of_the_slab(ALLOY + ONE_POINT + heat), "flexel-simulate", "free to rotate about x")


def test_a_curl_is_no_buckling():
    """A print that curls by its layers' shrinkage moves in proportion to it. The first answer, of a part that has not
    moved yet, is stiffened by what the shrinkage pulls."""
    slab()
    done = expect_ok(of_the_slab(
        'material = "PLA"\n' + HELD + '[shrinkage]\nlayer = "0.2 mm"\nalong = "0 %"\nacross = "-0.5 %"\n'
        'height = ["0 mm", "10 mm"]\nfactor = [0, 1]\n'))
    expect("buckle" not in done.err, f"nothing buckles: {done}")
    near(json.loads(pathlib.Path("out.json").read_text())["largest_displacement"], 0.005 / 0.01 * 0.1**2 / 2, 0.05)


def test_bonded_strips_that_keep_their_volume():
    """Of two bonded layers one contracts by 12 %. At Poisson's ratio 0.49 there is no equilibrium near the rest shape with that
    strain whole, so it grows with the load; the curl is that at 0.3, which asks little for the ratio."""
    long, low = 10.0, 0.5
    upper = [[(x, y, z + low) for x, y, z in triangle] for triangle in box_triangles((long, 0.5, 0.25))]
    pathlib.Path("strip.stl").write_bytes(ascii_stl(box_triangles((long, 0.5, low)), "base") + ascii_stl(upper, "active"))
    expect_ok(run("flexel-voxelize", "strip.stl", "--size", "0.25 mm", "--quiet", "-o", "strip.vtu"))
    held = "".join(f'[[fix]]\nwhere = {{ box = {{ min = ["-1 mm", "-1 mm", "{least} mm"], max = ["{x} mm", "{y} mm", "{most} mm"] }} }}\naxes = "{axis}"\n'
                   for axis, x, y, least, most in (("x", 0.01, 9, -1, 9), ("y", 99, 0.01, -1, 9), ("z", 0.01, 0.01, 0.49, 0.51)))
    found = []
    for ratio in (0.3, 0.49):
        matter = "".join(f'[parts.{name}]\nmaterial = "{name}"\n[materials.{name}]\nyoung = "{young} MPa"\npoisson = {ratio}\ndensity = "1000 kg/m3"\n'
                         for name, young in (("base", 2.25), ("active", 0.45)))
        pathlib.Path("strip.toml").write_text(
            matter + '[shrinkage]\npart = "active"\naxis = [1, 0, 0]\nlayer = "1 mm"\nalong = "-12 %"\nacross = "6.6 %"\n' + held +
            f'[[probe]]\nname = "end"\nat = ["{long} mm", 0, "{low} mm"]\n')
        expect_ok(run("flexel-simulate", "strip.toml", "strip.vtu", "-o", "out.vtu", "--summary", "out.json", "--force", "--no-estimate"))
        x, _, z = json.loads(pathlib.Path("out.json").read_text())["probes"][0]["displacement"]
        found.append(2 * z / ((1e-3 * long + x) ** 2 + z**2))  # curvature of the arc
    near(found[1], found[0], 0.01)


def test_a_warm_column_about_to_buckle_is_told():
    """It buckles at about pi^2 E I / (4 L^2) = 20.6 kN (Euler), and its warmth, which nothing hinders, does not hide that."""
    slab()
    for model, force, near_it, how in (("cells", 19000, True, ""), ("cells", 4000, False, ""), ("quadratic", 19000, True, ""),
                                       ("cells", 19000, True, 'link = "rigid"\n'), ("cells", 4000, False, 'link = "rigid"\n')):
        said = expect_ok(of_the_slab(
            f'model = "{model}"\n' + ALLOY + HELD + '[thermal]\nchange = "1 K"\n[[load]]\nwhere = "xmax"\n'
            f'force = ["-{force} N", 0, "20 N"]\n{how}')).err
        expect(("about to buckle: it moves" in said) == near_it, f"{model}, {force} N {how}: {said}")


def test_a_failed_run_leaves_no_free_strain():
    pathlib.Path("bar.stl").write_bytes(ascii_stl(box_triangles()))
    expect_ok(run("flexel-voxelize", "bar.stl", "--size", "2 mm", "-o", "bar.vtu"))
    load = '[[load]]\nwhere = "xmax"\nforce = [0, "{} N", 0]\n'
    plain = 'material = "steel"\n' + HELD
    pathlib.Path("far.toml").write_text(plain + load.format(5e5) + '[thermal]\nchange = "80 K"\n[run]\nnewton_iterations = 2\n')
    expect_error(run("flexel-simulate", "far.toml", "bar.vtu", "-o", "far.vtu"), "flexel-simulate", "far.failed.vtu", code=3)
    expect(b"free_strain" not in pathlib.Path("far.failed.vtu").read_bytes(), "the strain of a heated run stays in its body")


def test_conduction_has_its_models():
    done = between(model="springs")
    expect_error(done, "flexel-simulate", "conduction is for models")
    expect("heat through" not in done.err, f"solved before it was refused: {done}")


def test_bars_and_a_column():
    """The same uniform change as a number and as a column that conduction left: one answer, with bars."""
    pathlib.Path("part.stl").write_bytes(ascii_stl(box_triangles()))
    expect_ok(run("flexel-voxelize", "part.stl", "--size", "2.5mm", "--moments", "-o", "rest.vtu"))
    head = 'material = "steel"\nmodel = "quadratic"\n' + HELD + '[[probe]]\nname = "tip"\nat = ["40 mm", "5 mm", "5 mm"]\n'
    pathlib.Path("a.toml").write_text(head + '[thermal]\nchange = "80 K"\n')
    pathlib.Path("b.toml").write_text(head + '[thermal]\nreference = "20 degC"\n[[temperature]]\nwhere = "xmin"\nvalue = "100 degC"\n')
    found = []
    for name in "ab":
        expect_ok(run("flexel-simulate", f"{name}.toml", "rest.vtu", "-o", f"{name}.vtu", "--summary", f"{name}.json"))
        found.append(json.loads(pathlib.Path(f"{name}.json").read_text()))
    one, other = (each["probes"][0]["displacement"][0] for each in found)
    expect(abs(one / other - 1) < 1e-6, f"{one} and {other}")
    expect(0.95 * 12e-6 * 80 * 0.04 < one < 1.1 * 12e-6 * 80 * 0.04, one)
    for each in found:
        expect(each["error_bars"]["bars"], f"no bars: {each['error_bars']}")


if __name__ == "__main__":
    main(globals())

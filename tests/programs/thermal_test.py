"""[thermal], conduction, [shrinkage]: known answers (cases of bench/accuracy/thermal.py), and what is refused."""

import importlib.util
import json
import pathlib

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
    refused('[thermal]\nchange = "80 mm"', "unknown unit", "mm")
    refused('[thermal]\nchange = "nan K"', "not finite")
    refused('[thermal]\nchange = "80000 K"', "if it were free")
    refused('[thermal]\ncolumn = "heat"\nreference = "20 degC"', "no column", "heat")
    refused('[thermal]\ncolumn = "heat"', "reference")
    refused('[thermal]\nreference = "20 degC"', "reference")
    refused('[thermal]\nchange = "1 K"\npart = "prt"', "no part", "part")
    refused('[thermal]\nchange = "1 K"', "springs", model="springs")
    refused('[thermal]\nchange = "1 K"\n[run]\ntime = "1 s"', "equilibrium", model="cells")
    refused('[[temperature]]\nwhere = "xmin"\nvalue = "-300 degC"', "absolute zero")
    refused('[[heat]]\nwhere = "xmin"\npower = "1 W"', "temperature")
    refused('[[temperature]]\nwhere = "xmin"\nvalue = "20 degC"', "conductivity", material="PLA")
    refused('[shrinkage]\nlayer = "0 mm"\nalong = "0 %"\nacross = "-1 %"', "above 0")


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

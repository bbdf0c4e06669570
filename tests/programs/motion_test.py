"""Timed runs of flexel-simulate from the outside: series, books, refusals, failures, interrupts."""

import csv
import json
import math
import os
import pathlib
import re
import signal
import subprocess
import time
import xml.etree.ElementTree

from harness import BIN, Skip, body, expect, expect_error, expect_ok, expect_only, main, run, scene, write
from shapes import binary_stl, box_triangles

SWING = """material = "rubber"
[[fix]]
where = "xmin"
[[load]]
where = "xmax"
force = ["0 N", "0 N", "-0.01 N"]
[damping]
time = "2 us"
[[probe]]
name = "tip"
where = "xmax"
[run]
time = "5 ms"
"""
# Names no effect; steps for hours.
BARE = """material = "rubber"
[parts.block]
model = "{}"
[run]
time = "1000 s"
"""
LONG = SWING.replace('"5 ms"', '"1000 s"')


def test_series():
    inputs = [body(), scene(text=SWING + "frames = 4\n")]
    expect_ok(run("flexel-simulate", "scene.toml", "body.vtu", "-o", "swing.pvd"))
    frames = [f"swing_{n:05}.vtu" for n in range(5)]
    expect_only(*inputs, "swing.pvd", *frames)
    sets = xml.etree.ElementTree.parse("swing.pvd").getroot().findall("./Collection/DataSet")
    expect([each.get("file") for each in sets] == frames, "the .pvd should name the frames in order")
    times = [float(each.get("timestep")) for each in sets]
    expect(times[0] == 0 and abs(times[-1] - 5e-3) < 1e-12 and times == sorted(times), f"times {times}")
    expect(os.path.getsize(frames[0]) > os.path.getsize(frames[1]), "the first frame alone should hold the surface")


def test_each_frame_of_a_series_is_mapped_by_itself():
    body()
    scene(text=SWING + "frames = 3\n")
    expect_ok(run("flexel-simulate", "scene.toml", "body.vtu", "-o", "swing.pvd"))
    os.remove("body.vtu")
    expect_ok(run("flexel-map", "swing.pvd", "--keep-vertices", "-o", "all.stl"))
    for frame in range(4):
        expect_ok(run("flexel-map", f"swing_{frame:05}.vtu", "--keep-vertices", "-o", "one.stl", "--report", "one.json", "--force"))
        expect(open("one.stl", "rb").read() == open(f"all_{frame:05}.stl", "rb").read(), f"frame {frame}")
        expect(json.load(open("one.json"))["failures"]["inverted"] == 0, "it is checked")
    expect_error(run("flexel-map", "-o", "piped.stl", stdin=open("swing_00002.vtu", "rb").read()), "flexel-map", "frame of a series by its name")
    os.makedirs("elsewhere")
    pathlib.Path("elsewhere/swing_00002.vtu").write_bytes(open("swing_00002.vtu", "rb").read())
    expect_error(run("flexel-map", "elsewhere/swing_00002.vtu", "-o", "x.stl"), "flexel-map", "swing_00000.vtu", "missing")
    expect_ok(run("flexel-voxelize", "one.stl", "--size", "1 mm", "-o", "elsewhere/swing_00000.vtu"))
    expect_error(run("flexel-map", "elsewhere/swing_00002.vtu", "-o", "x.stl"), "flexel-map", "swing_00000.vtu", "same run")


def test_series_is_read_by_meshio():
    try:
        import meshio
    except ImportError as error:
        raise Skip("meshio is not installed") from error
    body()
    scene(text=SWING + "frames = 2\n")
    expect_ok(run("flexel-simulate", "scene.toml", "body.vtu", "-o", "swing.pvd"))
    first, last = (meshio.read(f"swing_{n:05}.vtu") for n in (0, 2))
    expect("velocity" in last.point_data, "the frames should hold velocities")
    expect(abs(first.point_data["displacement"]).max() == 0 < abs(last.point_data["displacement"]).max(), "the beam should move")


def rows(name):
    with open(name, newline="") as file:
        return [{key.split(" [")[0]: float(value) for key, value in row.items()} for row in csv.DictReader(file)]


def test_history_and_summary():
    body()
    scene(text=SWING)
    expect_ok(run("flexel-simulate", "scene.toml", "body.vtu", "-o", "out.vtu", "--history", "h.csv", "--summary", "s.json"))
    found = rows("h.csv")
    expect(found[0]["time"] == 0 and abs(found[-1]["time"] - 5e-3) < 1e-12, "the books should reach from start to end")
    largest = max(abs(row[name]) for row in found for name in ("kinetic", "elastic", "work", "dissipated"))
    expect(0 < max(abs(row["residual"]) for row in found) < 1e-3 * largest, "the books should close")
    summary = json.load(open("s.json"))
    expect(summary["timed"]["steps"] > 0 and summary["timed"]["books"]["worst_residual"] < 1e-3 * largest, "summary")
    probe = summary["probes"][0]["displacement"]
    expect(all(math.isclose(found[-1][f"tip {axis}"], value, rel_tol=1e-9, abs_tol=1e-15) for axis, value in zip("xyz", probe)),
           "the books' last row and the summary should agree")


def test_pipe_carries_the_last_state():
    body()
    scene(text=SWING)
    state = expect_ok(run("flexel-simulate", "scene.toml", "body.vtu")).out
    mapped = expect_ok(run("flexel-map", "--format", "stl", "--keep-vertices", stdin=state)).out
    expect(len(mapped) == 84 + 50 * 12, "the box should come out")


def test_a_run_goes_on_where_another_ended():
    body()
    scene("whole.toml", SWING.replace("[damping]", "[gravity]").replace('time = "2 us"', 'acceleration = ["0 m/s2", "0 m/s2", "-1 m/s2"]'))
    text = open("whole.toml").read()
    scene("half.toml", text.replace('"5 ms"', '"2.5 ms"'))
    expect_ok(run("flexel-simulate", "whole.toml", "body.vtu", "-o", "whole.vtu", "--summary", "whole.json"))
    expect_ok(run("flexel-simulate", "half.toml", "body.vtu", "-o", "half.vtu"))
    expect_ok(run("flexel-simulate", "half.toml", "half.vtu", "-o", "halves.vtu", "--summary", "halves.json"))
    whole, halves = (json.load(open(name))["probes"][0]["displacement"][2] for name in ("whole.json", "halves.json"))
    expect(whole != 0 and abs(halves / whole - 1) < 1e-2, f"two halves should make a whole: {whole}, {halves}")


def test_wrong_keys():
    body()
    for text, fragment in ((SWING + "step = 5\n", "unit"), (SWING + 'method = "verlat"\n', "verlet"),
                           (SWING + 'until = "equilibrium"\n', "both"), (SWING + 'step = "1 s"\n', "longest stable"),
                           (SWING.replace('time = "5 ms"', 'step = "1 us"'), "time"),
                           (SWING.replace('"2 us"', '"-2 us"'), "0 or more"),
                           (SWING.replace("[[probe]]", "[[velocity]]\nwhere = \"xmin\"\nvelocity = [\"1 m/s\", 0, 0]\n[[probe]]"), "part"),
                           (SWING.replace("[damping]", 'time = ["0 s"]\n[damping]'), "factor")):
        expect_error(run("flexel-simulate", scene(text=text), "body.vtu", "-o", "out.vtu"), "flexel-simulate", fragment)


def test_timed_outputs_need_time():
    body()
    still = SWING.replace('time = "5 ms"', "").replace('[damping]\ntime = "2 us"', "")
    expect_error(run("flexel-simulate", scene(text=still), "body.vtu", "-o", "out.pvd"), "flexel-simulate", "time")
    expect_error(run("flexel-simulate", scene(text=still), "body.vtu", "-o", "out.vtu", "--history", "h.csv"), "flexel-simulate", "time")
    damped = SWING.replace('time = "5 ms"', "")
    expect_error(run("flexel-simulate", scene(text=damped), "body.vtu", "-o", "out.vtu"), "flexel-simulate", "damping", "time")


def test_unknown_instruction_set():
    body()
    expect_error(run("flexel-simulate", scene(text=SWING), "body.vtu", "-o", "out.vtu", "--isa", "mmx"), "flexel-simulate", "mmx", "portable")


def test_instruction_sets_agree_to_the_bit():
    body()
    scene(text=SWING)
    expect_ok(run("flexel-simulate", "scene.toml", "body.vtu", "-o", "best.vtu"))
    expect_ok(run("flexel-simulate", "scene.toml", "body.vtu", "-o", "portable.vtu", "--isa", "portable", "--threads", "1"))
    expect(open("best.vtu", "rb").read() == open("portable.vtu", "rb").read(), "the bits should not depend on the machine")


def test_collapse_leaves_the_last_sound_state():
    inputs = [body(), scene(text=SWING.replace("-0.01 N", "-5 kN"))]
    result = run("flexel-simulate", "scene.toml", "body.vtu", "-o", "out.vtu", "--history", "h.csv")
    expect_error(result, "flexel-simulate", "step ", "inside out", "out.failed.vtu", code=3)
    expect_only(*inputs, "out.failed.vtu", "h.csv")
    expect_ok(run("flexel-map", "out.failed.vtu", "-o", "last.stl", "--quiet"))


def test_timeout():
    inputs = [body(), scene(text=LONG)]
    result = run("flexel-simulate", "scene.toml", "body.vtu", "-o", "out.vtu", "--timeout", "1 s")
    expect_error(result, "flexel-simulate", "stopped by --timeout", "out.failed.vtu", code=5)
    expect_only(*inputs, "out.failed.vtu")


def test_interrupt():
    inputs = [body(), scene(text=LONG)]
    for by in (signal.SIGINT, signal.SIGTERM):
        process = subprocess.Popen([BIN / "flexel-simulate", "scene.toml", "body.vtu", "-o", "out.vtu", "--explain"], stderr=subprocess.PIPE)
        text = process.stderr.readline().decode()
        while text and "plan: " not in text.splitlines()[-1]:  # said when it begins to step
            text += process.stderr.readline().decode()
        process.send_signal(by)
        text += process.communicate(timeout=30)[1].decode()
        expect(process.returncode == 128 + by and "out.failed.vtu" in text, f"exit {process.returncode}: {text}")
        expect_only(*inputs, "out.failed.vtu")
        expect_ok(run("flexel-simulate", scene("short.toml", SWING), "out.failed.vtu", "-o", "on.vtu"))
        for name in ("short.toml", "on.vtu", "out.failed.vtu"):
            os.remove(name)


def test_explain():
    body()
    scene(text=SWING)
    lines = expect_ok(run("flexel-simulate", "scene.toml", "body.vtu", "-o", "out.vtu", "--explain")).err
    for word in ("steps of", "kernel", "damping (1 [damping])", "loads (1 [[load]])"):
        expect(word in lines, f"\"{word}\" is missing in: {lines}")
    for word in ("cells", "damping", "loads", "the rest"):
        expect(re.search(rf"time: {word} +[0-9.]+ s +[0-9.]+ %", lines), f"no time of \"{word}\" in: {lines}")
    bare = SWING.replace('[damping]\ntime = "2 us"', "")
    lines = expect_ok(run("flexel-simulate", scene(text=bare), "body.vtu", "-o", "out.vtu", "--explain")).err
    expect("damping" not in lines, f"nothing that the scene does not name belongs in the plan: {lines}")


def resident_bytes(process):
    text = pathlib.Path(f"/proc/{process.pid}/status").read_text(encoding="utf-8")
    return 1024 * int(re.search(r"RssAnon:\s+(\d+) kB", text).group(1))


def processor_seconds(process):
    fields = pathlib.Path(f"/proc/{process.pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def stepping_bytes(cells, model):
    """Of a bare run of a block of cells^3 once it steps."""
    write("block.stl", binary_stl(box_triangles(3 * (float(cells),))))
    expect_ok(run("flexel-voxelize", "block.stl", "--size", "1 mm", "--align", "none", "-o", "block.vtu"))
    scene(text=BARE.format(model))
    command = [BIN / "flexel-simulate", "scene.toml", "block.vtu", "-o", "out.vtu", "--threads", "1", "--explain"]
    with subprocess.Popen(command, stderr=subprocess.PIPE) as process:
        try:
            while b"plan: " not in process.stderr.readline():
                expect(process.poll() is None, "the run ended")
            begun = processor_seconds(process)
            while processor_seconds(process) < begun + 0.5:  # it steps
                time.sleep(0.05)
            return resident_bytes(process)
        finally:
            process.kill()


def test_memory():
    """What a run takes while it steps grows by at most 200 bytes an element, the body and all else included."""
    for model in ("cells", "springs"):
        small, large = (stepping_bytes(n, model) for n in (24, 48))
        each = (large - small) / (49**3 - 25**3)
        print(f"{model}: {each:.0f} bytes an element")
        expect(each <= 200, f"{model}: {each:.0f} bytes an element")


def test_long_damping_is_stable_while_a_part_is_pulled_to_thrice_its_length():
    """The rates of damping grow with the stretch: its stages have to follow between two looks at the step."""
    write("bar.stl", binary_stl(box_triangles((60, 10, 10))))
    expect_ok(run("flexel-voxelize", "bar.stl", "--size", "5 mm", "-o", "bar.vtu"))
    for speed, tau in ((3, "0.1 s"), (1, "0.1 s"), (3, "0.01 s")):
        whole = f"{.12 / speed} s"
        write("scene.toml", f"""material = "m"
[materials.m]
young = "20 kPa"
poisson = 0.3
density = "1000 kg/m3"
[damping]
time = "{tau}"
[[fix]]
where = "xmin"
[[move]]
where = "xmax"
displacement = ["120 mm", "0 mm", "0 mm"]
time = ["0 s", "{whole}"]
factor = [0, 1]
[run]
time = "{whole}"
""")
        expect_ok(run("flexel-simulate", "scene.toml", "bar.vtu", "-o", "out.vtu", "--history", "h.csv"))
        rows = list(csv.DictReader(open("h.csv", encoding="utf-8")))
        column = lambda name: [float(row[next(key for key in row if key.startswith(name))]) for row in rows]
        work, residual = column("work"), column("residual")
        expect(max(map(abs, residual)) < 0.02 * work[-1], (speed, tau, max(map(abs, residual)), work[-1]))


def test_a_spin_beyond_all_steps_is_refused():
    write("bar.stl", binary_stl(box_triangles((60, 10, 10))))
    expect_ok(run("flexel-voxelize", "bar.stl", "--size", "5 mm", "-o", "bar.vtu"))
    write("scene.toml", 'material = "steel"\n[parts.bar]\nrigid = true\n[[velocity]]\nwhere = "bar"\nspin = { axis = [0, 0, 1], through = ["30 mm", "5 mm", "5 mm"], '
          'angle_per_second = "1e14 rad" }\n[run]\ntime = "1 s"\n')
    expect_error(run("flexel-simulate", "scene.toml", "bar.vtu", "-o", "out.vtu", timeout=30), "flexel-simulate", "spins at", code=3)


def test_a_fast_impact_has_a_step_of_its_own():
    """A bar of aluminium flies at a wall at 410 m/s: its foot is squeezed within some steps, and the bound on them follows."""
    pathlib.Path("part.stl").write_bytes(binary_stl(box_triangles((3.0, 3.0, 12.0))))
    expect_ok(run("flexel-voxelize", "part.stl", "--size", "0.75 mm", "--quiet", "-o", "bar.vtu"))
    pathlib.Path("fast.toml").write_text(
        'material = "aluminium 6061"\n[plasticity]\nyield = "385 MPa"\nhardening = "236 MPa"\n'
        '[[fix]]\nwhere = "xmin"\naxes = "x"\n[[fix]]\nwhere = "ymin"\naxes = "y"\n'
        '[[plane]]\npoint = ["0 mm", "0 mm", "0 mm"]\nnormal = [0, 0, 1]\n'
        '[[velocity]]\nwhere = "part"\nvelocity = ["0 m/s", "0 m/s", "-410 m/s"]\n[run]\ntime = "20 us"\n')
    expect_ok(run("flexel-simulate", "fast.toml", "bar.vtu", "-o", "out.vtu", "--no-stress"))


if __name__ == "__main__":
    main(globals())

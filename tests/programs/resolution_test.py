"""A part whose lattice becomes finer and coarser in a timed run, by events or by the run itself: swings, the maps of their frames, checkpoints, refusals."""

import csv
import math
import os
import re

from harness import expect, expect_error, expect_ok, expect_only, main, run, write
from shapes import binary_stl, box_triangles

GUM = 'material = "gum"\n[materials.gum]\nyoung = "5 MPa"\npoisson = 0.3\ndensity = "1000 kg/m3"\n[[fix]]\nwhere = "xmin"\n'
BEND = GUM + '[[load]]\nwhere = "xmax"\nforce = ["0 N", "0 N", "-0.15 N"]\n'
SWING = GUM + """[damping]
period = "14.5 ms"
ratio = 0.02
[[probe]]
name = "tip"
at = ["40 mm", "5 mm", "5 mm"]
[run]
time = "116 ms"
history_every = "0.2 ms"
frames = 10
"""
TIMES = [round(3.1 + 5.37 * n, 2) for n in range(20)]  # ms


def changes(times, first="finer"):
    other = {"finer": "coarser", "coarser": "finer"}
    text = ""
    for at in times:
        text += f'[[event]]\nat = "{at} ms"\ndo = "resolution"\nchange = "{first}"\n'
        first = other[first]
    return text


def bent_bar(size):
    write("bar.stl", binary_stl(box_triangles((40, 10, 10))))
    expect_ok(run("flexel-voxelize", "bar.stl", "--size", size, "-o", "bar.vtu"))
    write("bend.toml", BEND)
    expect_ok(run("flexel-simulate", "bend.toml", "bar.vtu", "-o", "bent.vtu"))


def swing_of(history):
    """Frequency [Hz] by the crossings of 0, and the damping ratio by the mean squares between them."""
    rows = list(csv.reader(open(history)))
    at = rows[0].index("tip z [m]")
    path = [(float(row[0]), float(row[at])) for row in rows[1:]]
    crossings = [t + (u - t) * a / (a - b) for (t, a), (u, b) in zip(path, path[1:]) if a * b < 0]
    frequency = (len(crossings) - 1) / 2 / (crossings[-1] - crossings[0])
    points = []
    for begin, end in zip(crossings, crossings[1:]):
        squares = [z * z for t, z in path if begin <= t < end]
        points.append(((begin + end) / 2, 0.5 * math.log(sum(squares) / len(squares))))
    middle = [sum(point[i] for point in points) / len(points) for i in (0, 1)]
    slope = (sum((t - middle[0]) * (z - middle[1]) for t, z in points) / sum((t - middle[0])**2 for t, _ in points))
    return frequency, -slope / (2 * math.pi * frequency)


def test_a_swing_that_changes_ten_times_is_the_same():
    """Finer and coarser ten times each: frequency and damping within 2 %, the energy within 1 % at every change."""
    bent_bar("2.5 mm")
    write("swing.toml", SWING)
    write("change.toml", SWING + changes(TIMES))
    expect_ok(run("flexel-simulate", "swing.toml", "bent.vtu", "-o", "same.vtu", "--history", "same.csv"))
    told = expect_ok(run("flexel-simulate", "change.toml", "bent.vtu", "-o", "change.pvd", "--history", "change.csv", timeout=600)).err
    shares = [float(share) for share in re.findall(r"J of the body became .* J \(([-+.e\d]+) %\)", told)]
    expect(len(shares) == 20 and all(abs(share) < 1 for share in shares), told)
    expect("warning" not in told, told)
    (frequency, damping), (frequency_of_same, damping_of_same) = swing_of("change.csv"), swing_of("same.csv")
    expect(abs(frequency / frequency_of_same - 1) < 0.02, f"{frequency} Hz, {frequency_of_same} Hz unchanged")
    expect(abs(damping / damping_of_same - 1) < 0.02, f"damping {damping}, {damping_of_same} unchanged")


def test_frames_are_mapped():
    """Each frame has its own lattice and maps onto the part's surface; the last one as that of a run that did not change."""
    bent_bar("5 mm")
    short = SWING.replace("116 ms", "6 ms")
    write("swing.toml", short)
    write("change.toml", short + changes([2, 4]))
    write("adapt.toml", short + ADAPTIVE.replace("0.001", "0.003"))
    expect_ok(run("flexel-simulate", "swing.toml", "bent.vtu", "-o", "same.vtu"))
    expect_ok(run("flexel-simulate", "change.toml", "bent.vtu", "-o", "c.pvd"))
    expect_ok(run("flexel-simulate", "adapt.toml", "bent.vtu", "-o", "a.pvd"))
    cells = [int(re.search(rb'NumberOfCells="(\d+)"', open(f"c_{frame:05}.vtu", "rb").read())[1]) for frame in (0, 5, 10)]
    expect(cells == [32, 256, 32], cells)
    expect_ok(run("flexel-map", "c.pvd", "-o", "m_{frame}.obj"))
    expect_ok(run("flexel-map", "same.vtu", "-o", "same.obj"))

    def corners(file):
        return [[float(x) for x in line.split()[1:]] for line in open(file) if line.startswith("v ")]

    expect_ok(run("flexel-map", "a.pvd", "-o", "a_{frame}.obj"))
    ends = {name: min(z for _, _, z in corners(name)) for name in ("m_00000.obj", "m_00005.obj", "m_00010.obj", "same.obj")}
    expect(abs(ends["m_00010.obj"] - ends["same.obj"]) < 0.2, ends)
    cells = [int(re.search(rb'NumberOfCells="(\d+)"', open(f"a_{frame:05}.vtu", "rb").read())[1]) for frame in range(11)]
    expect(set(cells) == {32, 256}, cells)
    expect(abs(min(z for _, _, z in corners("a_00010.obj")) - ends["same.obj"]) < 0.2, "the frame at the end of a run that adapts")


def test_a_resumed_run_has_the_same_bytes():
    """Stopped by a limit on its time between and after the changes, and resumed."""
    bent_bar("5 mm")
    write("scene.toml", SWING + changes([20, 50, 80]))
    resumed_run_has_the_same_bytes()


def resumed_run_has_the_same_bytes():
    """Stopped by a limit on its time, and resumed; what it told when it was not."""
    told = expect_ok(run("flexel-simulate", "scene.toml", "bent.vtu", "-o", "whole.vtu", "--history", "whole.csv")).err
    arguments = ["scene.toml", "bent.vtu", "-o", "out.vtu", "--history", "out.csv", "--checkpoint", "run.checkpoint"]
    stops, limit = 0, 0.05  # s, longer until it is beyond the start of the program, which on a busy machine takes its time
    for _ in range(40):
        result = run("flexel-simulate", *arguments, "--timeout", f"{limit:.3f} s" if stops < 3 else "300 s", timeout=600)
        if result.code == 0:
            break
        expect(result.code == 5, str(result))
        if "--resume run.checkpoint" in result.err:
            stops += 1
            arguments = ["--resume", "run.checkpoint"]
        else:
            limit *= 1.25
    expect(result.code == 0 and stops > 0, f"{stops} stops: {result}")
    expect(open("out.vtu", "rb").read() == open("whole.vtu", "rb").read(), "another last state")
    expect(open("out.csv", "rb").read() == open("whole.csv", "rb").read(), "another history")
    return told


# Finer where it is bent, and coarser as it passes through its shape at rest.
ADAPTIVE = 'resolution = "adaptive"\n[adaptive]\nstrain_jump = 0.001\ncalm = 0.5\nleast_time = "0.8 ms"\n'


def changes_told(told):
    """Time [s] and whether it became finer; the energy changed within 1 % at each, and no warning told anything else."""
    expect("warning" not in told, told)
    shares = [float(share) for share in re.findall(r"J of the body became .* J \(([-+.e\d]+) %\)", told)]
    found = [(float(at), int(after) > int(before)) for at, before, after in
             re.findall(r"at ([\d.e-]+) s resolution: .*: (\d+) elements became (\d+), for", told)]
    expect(len(found) == len(shares) and all(abs(share) < 1 for share in shares), told)
    return found


def test_a_swing_that_adapts_is_the_same():
    """Frequency within 2 %, damping too, but for changes in step with the swing, within half of it: these pump it, by 5 % at most here."""
    bent_bar("2.5 mm")
    write("swing.toml", SWING)
    expect_ok(run("flexel-simulate", "swing.toml", "bent.vtu", "-o", "same.vtu", "--history", "same.csv"))
    frequency_of_same, damping_of_same = swing_of("same.csv")
    for name, jump, least, most, damping_within in (("seldom", 0.0035, 2, 10, 0.02), ("often", 0.001, 0.8, 40, 0.05)):
        adaptive = ADAPTIVE.replace("0.001", str(jump)).replace("0.8 ms", f"{least} ms")
        write(f"{name}.toml", SWING + adaptive)
        told = expect_ok(run("flexel-simulate", f"{name}.toml", "bent.vtu", "-o", f"{name}.vtu", "--history", f"{name}.csv", timeout=600)).err
        found = changes_told(told)
        expect(most / 2 <= len(found) <= most, told)
        expect(all(finer != later and until - at > least * 0.999e-3 for (at, finer), (until, later) in zip(found, found[1:])), found)
        frequency, damping = swing_of(f"{name}.csv")
        print(f"{name}, {len(found)} changes: frequency {100 * (frequency / frequency_of_same - 1):+.2f} %, damping {100 * (damping / damping_of_same - 1):+.2f} %")
        expect(abs(frequency / frequency_of_same - 1) < 0.02, f"{name}: {frequency} Hz, {frequency_of_same} Hz unchanged")
        expect(abs(damping / damping_of_same - 1) < damping_within, f"{name}: damping {damping}, {damping_of_same} unchanged")


def test_a_resumed_run_adapts_with_the_same_bytes():
    bent_bar("5 mm")
    write("scene.toml", SWING + ADAPTIVE.replace("0.001", "0.003"))
    told = resumed_run_has_the_same_bytes()
    expect(told.count("elements became") >= 4, told)


def test_a_plate_that_is_hardly_pressed_changes():
    """A thousandth of the energy is in its contacts, by velocities of half a step before a little less, by those of the change a little more."""
    write("plate.stl", binary_stl(box_triangles((21, 21, 4.6))))
    expect_ok(run("flexel-voxelize", "plate.stl", "--size", "3 mm", "-o", "plate.vtu"))
    gum = GUM.split("[[fix]]")[0].replace("5 MPa", "1 MPa") + '[[plane]]\npoint = ["0 mm", "0 mm", "-1 mm"]\nnormal = [0, 0, 1]\n'
    speeds = [4.733611102366905 + 0.002 * n for n in range(-5, 6)]
    for speed in speeds:
        write("scene.toml", gum + f'[[velocity]]\nwhere = "plate"\nvelocity = ["0 m/s", "0 m/s", "-{speed} m/s"]\n'
              'spin = { axis = [0, 1, 0], through = ["10 mm", "10 mm", "2 mm"], angle_per_second = "3000 deg" }\n'
              '[run]\ntime = "1 ms"\nresolution = "adaptive"\n[adaptive]\nleast_time = "1 ms"\nstrain_jump = 0.05\ncontact = false\n')
        told = expect_ok(run("flexel-simulate", "scene.toml", "plate.vtu", "-o", "out.vtu", "--force")).err
        expect("192 elements became 1125" in told, told)


def test_a_spin_that_is_another_on_a_coarser_lattice_is_told():
    """A cube of n cells has 1 + 2 / n^2 of its moment of inertia: of four cells 1.125 and of two 1.5."""
    write("cube.stl", binary_stl(box_triangles((20, 20, 20))))
    expect_ok(run("flexel-voxelize", "cube.stl", "--size", "5 mm", "-o", "cube.vtu"))
    spin = (GUM.split("[[fix]]")[0] + '[[velocity]]\nwhere = "cube"\nvelocity = [{}, "0 m/s", "0 m/s"]\n'
            'spin = {{ axis = [0, 0, 1], through = ["10 mm", "10 mm", "10 mm"], angle_per_second = "{} deg" }}\n[run]\ntime = "1 ms"\n'
            '[[event]]\nat = "0.5 ms"\ndo = "resolution"\nchange = "coarser"\n')
    for speed, degrees, warned in (("0 m/s", 3600, True), ("1 m/s", 3600, True), ("1 m/s", 0, False)):
        write("scene.toml", spin.format(f'"{speed}"', degrees))
        told = expect_ok(run("flexel-simulate", "scene.toml", "cube.vtu", "-o", "out.vtu", "--force")).err
        expect(('part "cube" spins 25 % slower' in told) == warned, told)


def test_what_is_bonded_to_a_held_part_does_not_spin():
    """A cube on a plate that is held: it turns a little, and its moment of inertia on another lattice says nothing."""
    plate = [[(x, y, z - 5) for x, y, z in triangle] for triangle in box_triangles((20, 20, 5))]
    write("plate.stl", binary_stl(plate))
    write("cube.stl", binary_stl(box_triangles((20, 20, 20))))
    expect_ok(run("flexel-voxelize", "cube.stl", "plate.stl", "--size", "5 mm", "-o", "both.vtu"))
    turned = ('[[velocity]]\nwhere = "cube"\nspin = { axis = [0, 0, 1], through = ["10 mm", "10 mm", "10 mm"], angle_per_second = "3600 deg" }\n'
              '[run]\ntime = "1 ms"\n[[event]]\nat = "0.5 ms"\ndo = "resolution"\npart = "cube"\nchange = "coarser"\n')
    for apart, warned in (("", False), ("bond = false\n", True)):
        write("scene.toml", apart + GUM.replace("xmin", "plate/zmin") + turned)
        told = expect_ok(run("flexel-simulate", "scene.toml", "both.vtu", "-o", "out.vtu", "--force")).err
        expect(('part "cube" spins' in told) == warned, told)


def test_a_resumed_run_that_meets_a_floor_has_the_same_bytes():
    """It becomes finer before it touches, bounces, and is as it was at the end; explicit steps, and implicit ones."""
    bent_bar("5 mm")
    fall = (GUM.split("[[fix]]")[0] + '[damping]\ntime = "200 us"\n[[plane]]\npoint = ["0 mm", "0 mm", "-6 mm"]\nnormal = [0, 0, 1]\nfriction = 0.3\n'
            '[[velocity]]\nwhere = "bar"\nvelocity = ["0.1 m/s", "0 m/s", "-0.5 m/s"]\n[run]\ntime = "80 ms"\nhistory_every = "1 ms"\n')
    for method in ("", 'method = "implicit"\nstep = "0.2 ms"\n'):
        write("scene.toml", fall + method + 'resolution = "adaptive"\n[adaptive]\nstrain_jump = 0.1\nleast_time = "3 ms"\n')
        told = resumed_run_has_the_same_bytes()
        finer = [int(after) > int(before) for before, after in re.findall(r"(\d+) elements became (\d+), for", told)]
        expect(finer == [True, False], told)
        rows = list(csv.DictReader(open("whole.csv")))
        first = float(re.search(r"at ([\d.e-]+) s resolution", told)[1])
        pressed = [float(row["time [s]"]) for row in rows if float(row["contact stored [J]"]) > 0]
        expect(pressed and first <= pressed[0], f"finer at {first} s, pressed from {pressed[:1]}")
        for name in ("whole.vtu", "whole.csv", "out.vtu", "out.csv", "run.checkpoint"):
            os.remove(name)


def test_refusals():
    write("bar.stl", binary_stl(box_triangles((40, 10, 10))))
    expect_ok(run("flexel-voxelize", "bar.stl", "--size", "5 mm", "-o", "bar.vtu"))
    expect_ok(run("flexel-voxelize", "bar.stl", "--size", "5 mm", "--placement", "centre", "-o", "centre.vtu"))
    finer, coarser = changes([1]), changes([1], "coarser")
    for body, text, fragments in (
        ("bar.vtu", SWING + finer.replace("finer", "larger"), ("scene.toml:", '"larger"', '"finer" or "coarser"')),
        ("bar.vtu", SWING + finer + 'part = "bat"\n', ("scene.toml:", '"bat"', 'did you mean "bar')),
        ("bar.vtu", SWING + finer + 'every = "1 ms"\n', ("scene.toml:", '"every"')),
        ("bar.vtu", SWING + changes([1, 2], "coarser").replace('"finer"', '"coarser"'), ("2 x 2 x 2", "cannot be made coarser")),
        ("bar.vtu", SWING + finer + '[contact]\nstick = "1 kPa"\n', ("resolution", "contact", "stick")),
        ("bar.vtu", SWING + finer + '[contact]\noverlap = "part"\noverlap_time = "1 ms"\n', ("resolution", "contact", "overlap")),
        ("bar.vtu", SWING + finer + '[plasticity]\nyield = "1 MPa"\n', ("resolution", "plasticity")),
        ("bar.vtu", SWING + finer + '[fracture]\nstrength = "1 MPa"\n', ("resolution", "fracture")),
        ("bar.vtu", SWING + finer + '[[event]]\nat = "2 ms"\ndo = "renormalise"\n', ("resolution", "renormalise")),
        ("bar.vtu", 'model = "springs"\n' + SWING + finer, ("resolution", "springs")),
        ("centre.vtu", SWING + coarser, ("resolution", "paper")),
        ("bar.vtu", GUM + '[[event]]\ndo = "resolution"\nchange = "finer"\n', ("resolution", "timed runs")),
    ):
        write("scene.toml", text)
        expect_error(run("flexel-simulate", "scene.toml", body, "-o", "out.vtu"), "flexel-simulate", *fragments)
        expect_only("bar.stl", "bar.vtu", "centre.vtu", "scene.toml")
    write("scene.toml", SWING + "".join(changes([at]) for at in range(1, 6)))
    expect_error(run("flexel-simulate", "scene.toml", "bar.vtu", "-o", "out.vtu", "--max-memory", "50 MB"), "flexel-simulate", "scene.toml:", "elements",
                 "limit")
    for text, fragments in (
        (SWING + 'resolution = "adaptve"\n', ("scene.toml:", '"fixed" or "adaptive"')),
        (SWING + ADAPTIVE + finer, ("scene.toml:", "events", "resolution")),
        (SWING + ADAPTIVE + '[contact]\nstick = "1 kPa"\n', ("scene.toml:", "contact", "stick")),
        (SWING + ADAPTIVE + '[plasticity]\nyield = "1 MPa"\n', ("scene.toml:", "plasticity")),
        (SWING + ADAPTIVE + "coarsest = 3\n", ("scene.toml:", "2 x 2 x 2")),
        ('model = "springs"\n' + SWING + ADAPTIVE, ("scene.toml:", "springs")),
        (SWING + ADAPTIVE.split("\n")[1] + "\n", ("scene.toml:", "[adaptive]", 'resolution = "adaptive"')),
    ):
        write("scene.toml", text)
        expect_error(run("flexel-simulate", "scene.toml", "bar.vtu", "-o", "out.vtu"), "flexel-simulate", *fragments)
        expect_only("bar.stl", "bar.vtu", "centre.vtu", "scene.toml")
    write("scene.toml", SWING + ADAPTIVE)
    expect_error(run("flexel-simulate", "scene.toml", "centre.vtu", "-o", "out.vtu"), "flexel-simulate", "scene.toml:", "paper")
    expect_error(run("flexel-simulate", "scene.toml", "bar.vtu", "-o", "out.vtu", "--max-elements", "100"), "flexel-simulate", "scene.toml:", "--max-elements")
    expect_ok(run("flexel-voxelize", "bar.stl", "--size", "0.5 mm", "-o", "large.vtu"))
    expect_error(run("flexel-simulate", "scene.toml", "large.vtu", "-o", "out.vtu", "--max-memory", "120 MB"), "flexel-simulate", "scene.toml:", "120 MB")
    write("scene.toml", SWING + finer)
    expect_error(run("flexel-simulate", "scene.toml", "bar.vtu", "-o", "out.vtu", "--max-elements", "100"), "flexel-simulate", "scene.toml:", "--max-elements")


if __name__ == "__main__":
    main(globals())

"""--timeout, --max-memory and --max-elements of every program; little address space, few threads, no temporary folder."""

import os
import re
import resource
import subprocess
import zipfile

from harness import BIN, SCENE, SOURCE, binary_stl, body, box, box_triangles, bracket, expect, expect_error, expect_ok, expect_only, main, run, scene, shell, write
from hostile_test import MESH, MODEL, write_3mf

BALL = '[[indenter]]\nball = { centre = ["30 mm", "5 mm", "20 mm"], radius = "9.9 mm" }\ndisplacement = ["0 mm", "0 mm", "-0.2 mm"]\n'
HELD = ["--material", "steel", "--fix", "xmin", "--push", "xmax: 0 0 -1 N"]


def everything():
    """A command of each program, with what it writes."""
    box()
    body()
    scene()
    return [(["flexel-voxelize", "box.stl", "--size", "1 mm", "-o", "o.vtu"], 12000), (["flexel-simulate", "scene.toml", "body.vtu", "-o", "o.vtu"], 81),
            (["flexel-map", "body.vtu", "-o", "o.stl"], 81), (["flexel", "deform", "box.stl", *HELD, "--size", "1 mm", "-o", "o.stl"], 12000),
            (["flexel", "picture", "body.vtu", "-o", "o.png"], 81), (["flexel", "export", "box.stl", "--scene", "scene.toml", "--size", "1 mm", "--calculix", "-o", "o.inp"], 12000),
            (["flexel", "compare", "box.stl", "box.stl", *HELD, "--size", "1 mm"], 12000), (["flexel", "info", "box.stl"], 0),
            (["flexel", "measure", "--model", "cells", "--size", "1 mm"], 0), (["flexel", "study", "box.stl", "--scene", "scene.toml", "-o", "s"], 0),
            (["flexel", "materials"], 0), (["flexel", "scene-keys"], 0)]


def test_every_program_has_all_limits():
    for command, _ in everything():
        words = command[:2] if command[0] == "flexel" else command[:1]
        told = expect_ok(run(*words, "--help")).out.decode()
        for option in ("--timeout", "--max-memory", "--max-elements"):
            expect(option in told, f"{words} has no {option}")
            expect_error(run(*command, option, "-1"), command[0], option)
            expect_error(run(*command, option, "nan"), command[0])
    expect_only("box.stl", "body.vtu", "scene.toml")


def test_elements():
    for command, elements in everything():
        if elements == 0:
            continue
        expect_error(run(*command, "--max-elements", str(elements // 4)), command[0], "elements", "--max-elements")
        expect_only("box.stl", "body.vtu", "scene.toml")
        expect_ok(run(*command, "--max-elements", str(100 * elements)))
        for name in set(os.listdir(".")) - {"box.stl", "body.vtu", "scene.toml"}:
            os.remove(name)


def test_overlapping_shells_are_counted_once():
    """Ten cubes of 20 mm, each .1 mm on: 512 elements of 3 mm."""
    corners = [(x, y, z) for x in (0, 20) for y in (0, 20) for z in (0, 20)]
    quads = [(1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4)]
    lines = [f"v {x + .1 * n} {y + .1 * n} {z + .1 * n}" for n in range(10) for x, y, z in corners]
    write("cubes.obj", "\n".join(lines + ["f " + " ".join(str(c + 8 * n) for c in quad) for n in range(10) for quad in quads]) + "\n")
    made = ["flexel-voxelize", "cubes.obj", "--size", "3 mm", "--force", "-o", "o.vtu", "--max-elements"]
    result = expect_ok(run(*made, "512"))
    expect(re.search(r"\b512 elements", result.err), f"{result}")
    expect_error(run(*made, "511"), "flexel-voxelize", "512 elements", "--max-elements")


def test_one_memory_limit_for_all_programs():
    """What one takes, the other does."""
    box()
    needed = 35e6 + 4500 * 40 * 10 * 10  # a lattice of cells of 1 mm
    for program in (["flexel-voxelize", "box.stl"], ["flexel", "deform", "box.stl", *HELD]):
        command = [*program, "--size", "1 mm", "-o", "o.vtu", "--max-memory"]
        expect_ok(run(*command, str(int(1.4 * needed))))
        os.remove("o.vtu")
        expect_error(run(*command, str(int(.9 * needed))), program[0], "cells need", "--max-memory")


def test_a_size_that_nobody_gave_is_within_the_limits():
    box()
    for limit in (["--max-elements", "10000"], ["--max-elements", "500"], ["--max-memory", "80MB"]):
        result = expect_ok(run("flexel", "deform", "box.stl", *HELD, *limit, "-o", "o.stl"))
        expect("how far" in result.err, f"{limit}: {result}")
        os.remove("o.stl")


def peak(command):
    """Exit code, bytes that the command has had in memory at most, and what it said."""
    process = subprocess.Popen([str(BIN / command[0]), *command[1:]], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    said = process.stderr.read().decode()
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    return process.returncode, 1024 * usage.ru_maxrss, said


def test_what_a_run_takes_is_told_before_it():
    """Of cells that the surface cuts and of whole ones, of small and of large deflections, of a block and of a rod."""
    box()
    write("rod.stl", binary_stl(box_triangles((150, 1, 1))))
    for part, name, size, *options in (("box.stl", "cut", "0.8 mm", "--align", "none", "--moments"), ("box.stl", "whole", "0.8 mm", "--moments"),
                                       ("box.stl", "centre", "0.8 mm", "--placement", "centre"), ("rod.stl", "rod", "0.33 mm", "--placement", "centre"),
                                       ("box.stl", "coarse", "1.25 mm")):
        expect_ok(run("flexel-voxelize", part, "--size", size, *options, "-o", name + ".vtu"))
    held, small = SCENE[:SCENE.index("[[load]]")], SCENE[:SCENE.index("[[probe]]")].replace("-100 N", "-1e-3 N")
    for body_name, name, text in (("cut", "cells", SCENE), ("cut", "springs", 'model = "springs"\n' + SCENE), ("cut", "in time", SCENE + '[run]\ntime = "0.1 us"\n'),
                                  ("cut", "modes", held + "[run]\nmodes = 8\n"), ("cut", "quadratic", 'model = "quadratic"\n' + SCENE),
                                  ("cut", "quadratic, small", 'model = "quadratic"\n' + small), ("whole", "quadratic", 'model = "quadratic"\n' + SCENE),
                                  ("whole", "quadratic, small", 'model = "quadratic"\n' + small), ("centre", "paper", 'model = "paper"\n' + small),
                                  ("rod", "paper", 'model = "paper"\n' + small),
                                  ("coarse", "quadratic, far", 'model = "quadratic"\n' + SCENE.replace("steel", "rubber").replace("-100 N", "-1 N")),
                                  ("cut", "contact", "contact = true\n" + SCENE + '[run]\ntime = "0.1 us"\n'), ("cut", "indenter", small + BALL),
                                  ("coarse", "implicit steps", small + '[run]\ntime = "2 us"\nmethod = "implicit"\nstep = "1 us"\n')):
        write("scene.toml", text)
        command = ["flexel-simulate", "scene.toml", body_name + ".vtu", "-o", "bent.vtu"]
        ended, most, said = peak([*command, "--explain"])
        told = re.search(r"memory: about ([\d.]+) MB(?:, with large deflections up to ([\d.]+) MB)?", said)
        expect(ended == 0 and told, f"{name}: exit {ended}: {said}")
        expect((told[2] is not None) == name.startswith("quadratic"), f"{name}: {told[0]}")
        # A few iterations of a small load turn cells by less than .02 rad, which takes something between.
        turned, far = name.startswith("quadratic") and " 1 Newton" not in said, name == "quadratic, far"
        least, largest = 1e6 * float(told[2 if far else 1]), 1e6 * float(told[2 if turned else 1])
        expect(least < 1.3 * most and largest > most / 1.3, f"{body_name}, {name}: {told[0]}, and it took {most / 1e6:.1f} MB")
        write("old.vtu", "old")
        expect_error(run(*command[:-1], "old.vtu", "--max-memory", f"{float(told[1]) / 1.4:.1f}MB"), "flexel-simulate", "needs about", "raise --max-memory")
        expect(open("old.vtu").read() == "old", "the old result is gone")


def test_memory_is_kept():
    """A limit below what the work takes ends it with a line, and the program has not had more than that and its own code."""
    box()
    code = 120e6  # libraries and what they begin with
    for command in (["flexel-voxelize", "box.stl", "--size", "0.35 mm", "-o", "o.vtu"], ["flexel", "deform", "box.stl", *HELD, "--size", "0.4 mm", "-o", "o.stl"]):
        limit = 30e6
        ended, most, said = peak([*command, "--max-memory", "30MB"])
        expect(ended == 2 and "more than" in said and said.count("error: ") == 1, f"exit {ended}: {said}")
        expect(most < limit + code, f"{most / 1e6:.0f} MB with a limit of {limit / 1e6:.0f} MB")
        expect_only("box.stl")


def test_a_sound_cad_file_is_not_called_damaged():
    bracket()
    result = run("flexel", "info", "bracket.step", "--max-memory", "5MB")
    expect_error(result, "flexel", "bracket.step", "--max-memory 5 MB")
    expect("damaged" not in result.err, f"{result}")


def test_time():
    """A program stops soon: by processor time, for a disk may stall; the clock only catches what hangs."""
    box()
    scene(text=SCENE + "[run]\nload_steps = 10000\n")
    expect_ok(run("flexel-voxelize", "box.stl", "--size", "0.5 mm", "--quiet", "-o", "body.vtu"))
    write_3mf("many.3mf", MODEL.format("", f'<object id="1">{MESH}</object>' + "".join(
        f'<object id="{n + 2}"><components><component objectid="{n + 1}"/><component objectid="{n + 1}"/></components></object>' for n in range(17)), 18))
    before = sorted(os.listdir("."))
    for command in (["flexel-voxelize", "box.stl", "--size", "0.1 mm", "--max-memory", "1TB", "-o", "o.vtu"], ["flexel", "info", "many.3mf"],
                    ["flexel-simulate", "scene.toml", "body.vtu", "-o", "o.vtu"], ["flexel-map", "body.vtu", "--check", "voronoi,self-intersection", "--refine", "0.1 mm", "-o", "o.stl"],
                    ["flexel", "picture", "many.3mf", "-o", "o.png"], ["flexel", "export", "box.stl", "--scene", "scene.toml", "--size", "0.15 mm", "--calculix", "-o", "o.inp"],
                    ["flexel", "study", "box.stl", "--scene", "scene.toml", "--budget", "60 s", "-o", "s"],
                    ["flexel", "measure", "--model", "cells", "--size", "1 mm", "--material", "steel"]):
        before_run = resource.getrusage(resource.RUSAGE_CHILDREN)
        result = run(*command, "--timeout", "0.5 s", timeout=60)
        after_run = resource.getrusage(resource.RUSAGE_CHILDREN)
        took = after_run.ru_utime - before_run.ru_utime + after_run.ru_stime - before_run.ru_stime
        expect(took < 0.5 * (os.cpu_count() or 1) + 3, f"{command}: {took:.1f} s of processor time")
        if result.code == 0 and command[1] == "measure":
            continue  # it may be done before
        expect_error(result, command[0], "stopped by --timeout", code=5)
        for name in set(os.listdir(".")) - set(before):
            expect(name == "o.failed.vtu" or (name == "s" and os.path.isdir("s")), f"{command} leaves {name}")


def test_quarter_of_a_million_parts_in_a_kilobyte():
    """Time grows with the parts, not with their square."""
    write_3mf("many.3mf", MODEL.format("", f'<object id="1">{MESH}</object>' + "".join(
        f'<object id="{n + 2}"><components><component objectid="{n + 1}"/><component objectid="{n + 1}"/></components></object>' for n in range(13)), 14))
    expect(os.path.getsize("many.3mf") < 2000 and zipfile.is_zipfile("many.3mf"), "the file is small")
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    result = expect_ok(run("flexel", "info", "many.3mf"))
    seconds = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
    expect(result.out.count(b"part \"") >= 8192, "parts are missing")
    expect(seconds < 15, f"{seconds:.1f} s of processor time for 8,192 parts")


def test_the_documented_numbers_are_those_of_the_code():
    rows = re.findall(r"^\| [^|]+ \| ([0-9'e.]+) \| `(\w+)` in `([^`]+)` \|$", (SOURCE / "docs/reference/limits.md").read_text(), re.M)
    expect(len(rows) >= 18, f"{len(rows)} rows")
    for number, name, file in rows:
        found = re.search(rf"\b{name} = ([0-9'e.]+)", (SOURCE / file).read_text())
        expect(found and found[1] == number, f"{file}: {name} is {found and found[1]}, not {number}")


def test_a_picture_without_room_for_its_library():
    box()
    for memory in (100000, 150000, 200000, 300000):
        result = shell(f"ulimit -v {memory}; flexel picture box.stl -o p.png")
        expect(result.code in (0, 2, 127) and "internal error" not in result.err, f"{memory} kB: {result}")


if __name__ == "__main__":
    main(globals())

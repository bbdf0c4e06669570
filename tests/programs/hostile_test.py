"""Files made to do harm: every program ends soon, with one line, and touches nothing that it was not told to."""

import json
import os
import re
import signal
import struct
import subprocess
import time
import zipfile

from harness import (BIN, SCENE, body, box, box_triangles, expect, expect_error, expect_ok, expect_only, main, need_step, run, scene, shell,
                     write)

ESCAPE, C1, TURN = "\x1b[31m", "\u009b", "\u202e"


def expect_plain(text):
    """Nothing in it acts on a terminal."""
    wild = [c for c in text if c != "\n" and (ord(c) < 32 or 127 <= ord(c) < 160 or c in "\u202a\u202b\u202c\u202d\u202e\u2028\u2029\ufffd")]
    expect(not wild, f"control characters {wild} in: {text!r}")


def refused(*command, code=2, seconds=20, memory=2_000_000, fragments=()):
    """The program ends within `seconds`, in `memory` kB, with one line of error."""
    begun = time.monotonic()
    line = " ".join(f"'{word}'" for word in command[1:])
    result = shell(f"ulimit -v {memory}; ulimit -c 0; {command[0]} {line} > out", timeout=2 * seconds)
    result.out = open("out", "rb").read()
    os.remove("out")
    expect_error(result, command[0].split("/")[-1], *fragments, code=code)
    expect(time.monotonic() - begun < seconds, f"took {time.monotonic() - begun:.1f} s")
    return result


# --- CAD files


def step(data):
    return ("ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\nFILE_NAME('','',(''),(''),'','','');\n"
            f"FILE_SCHEMA(('AUTOMOTIVE_DESIGN'));\nENDSEC;\nDATA;\n{data}\nENDSEC;\nEND-ISO-10303-21;\n")


def test_a_step_file_that_nests_without_end():
    need_step()
    write("deep.step", step(f"#1=CARTESIAN_POINT('',({'(' * 100000}0.{')' * 100000}));"))
    refused("flexel-voxelize", "deep.step", "-o", "o.vtu", fragments=["deep.step", "is damaged"])
    refused("flexel", "info", "deep.step", fragments=["deep.step", "is damaged"])
    expect_only("deep.step")


def children_of(parent):
    listed = subprocess.run(["ps", "-o", "pid=,stat=", "--ppid", str(parent)], stdout=subprocess.PIPE, check=False).stdout
    return [int(line.split()[0]) for line in listed.decode().splitlines() if "ps" not in line]


def interrupted_while_reading(number, code):
    need_step()
    # So many points take OpenCASCADE some seconds.
    points = "\n".join(f"#{n}=CARTESIAN_POINT('',(0.,0.,{n}.));" for n in range(1, 500000))
    write("long.step", step(points))
    process = subprocess.Popen([BIN / "flexel-voxelize", "long.step", "-o", "o.vtu"], stderr=subprocess.PIPE)
    child = []
    for _ in range(200):
        child = child or children_of(process.pid)
        if child:
            break
        time.sleep(0.01)
    expect(child, "no child reads the file")
    os.kill(process.pid, number)
    _, err = process.communicate(timeout=10)
    expect(process.returncode == code, f"exit {process.returncode}: {err.decode()}")
    for _ in range(100):
        if not os.path.exists(f"/proc/{child[0]}"):
            break
        time.sleep(0.02)
    expect(not os.path.exists(f"/proc/{child[0]}"), "the child lives on")
    expect_only("long.step")


def test_interrupt_while_a_step_file_is_read():
    interrupted_while_reading(signal.SIGINT, 130)


def test_termination_while_a_step_file_is_read():
    interrupted_while_reading(signal.SIGTERM, -signal.SIGTERM)


# --- nesting

TRIANGLE = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)


def gltf(uri, extras="0"):
    accessor = '{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}'
    return (f'{{"asset":{{"version":"2.0"}},"extras":{extras},"buffers":[{{"byteLength":36,"uri":"{uri}"}}],'
            f'"bufferViews":[{{"buffer":0,"byteLength":36}}],"accessors":[{accessor}],'
            '"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"nodes":[{"mesh":0}]}')


def test_json_that_nests_without_end():
    write("b.bin", TRIANGLE)
    for opened, closed in (("[", "]"), ('{"a":', "}")):
        write("deep.gltf", gltf("b.bin", f"{opened * 100000}1{closed * 100000}"))
        refused("flexel-voxelize", "deep.gltf", "-o", "o.vtu", fragments=["nested more than 500 deep"])
        # In a string brackets are letters.
        write("deep.gltf", gltf("b.bin", json.dumps(opened * 100000)))
        result = run("flexel", "info", "deep.gltf")
        expect("nested" not in result.err, str(result))


def test_keys_of_a_scene_with_parts_without_end():
    body("body.vtu")
    for key in (".".join(["a"] * 50000), ".".join(['"a"'] * 50000), f"x = {{ {'.'.join(['a'] * 50000)} = 1 }} #"):
        write("deep.toml", f"material = \"steel\"\n{key} = 1\n")
        refused("flexel-simulate", "deep.toml", "body.vtu", "-o", "o.vtu", fragments=["deep.toml:2", "more than 32 parts"])
    write("deep.toml", f"material = \"steel\"\n[{'.'.join(['a'] * 50000)}]\n")
    refused("flexel-simulate", "deep.toml", "body.vtu", "-o", "o.vtu", fragments=["deep.toml:2", "more than 32 parts"])
    # Dots in strings, numbers and comments are none of a key's.
    scene("dots.toml", SCENE.replace('"tip"', f'"{"." * 100}"') + f"# {'a.' * 100}\n")
    expect_ok(run("flexel-simulate", "dots.toml", "body.vtu", "-o", "o.vtu", "--quiet"))


def test_a_damaged_accessor_that_nothing_shows_costs_no_result():
    data = b"".join(struct.pack("<9f", *(x for corner in triangle for x in corner)) for triangle in box_triangles())
    count = len(data) // 12
    views = [{"buffer": 0, "byteLength": len(data)}]
    accessor = {"bufferView": 0, "componentType": 5126, "count": count, "type": "VEC3"}
    text = json.dumps({"asset": {"version": "2.0"}, "buffers": [{"byteLength": len(data)}], "bufferViews": views,
                       "accessors": [accessor, dict(accessor, count=10 ** 9)],
                       "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}], "extras": {"units": "mm"}}], "nodes": [{"mesh": 0}]}).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(data), 0x004E4942) + data
    write("b.glb", struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks)
    expect_ok(run("flexel", "deform", "b.glb", "--material", "steel", "--fix", "zmin", "--push", "zmax: 0 0 -1 N", "--count", "200", "-o", "o.stl",
                  "-o", "o.glb"))
    expect_only("b.glb", "o.stl", "o.glb")
    expect_ok(run("flexel", "info", "o.glb"))


# --- 3MF

MODEL = '<model unit="millimeter" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"{}><resources>{}</resources><build><item objectid="{}"/></build></model>'
MESH = ('<mesh><vertices>' + "".join(f'<vertex x="{x}" y="{y}" z="{z}"/>' for x, y, z in ((0, 0, 0), (9, 0, 0), (0, 9, 0), (0, 0, 9))) +
        '</vertices><triangles>' + "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2))) +
        '</triangles></mesh>')


def write_3mf(name, model):
    with zipfile.ZipFile(name, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("3D/m.model", model)
    return name


def test_a_3mf_file_whose_sizes_lie():
    write_3mf("m.3mf", MODEL.format("", f'<object id="1">{MESH}</object>', 1))
    expect_ok(run("flexel", "info", "m.3mf"))
    data = bytearray(open("m.3mf", "rb").read())
    directory = data.index(b"PK\x01\x02")
    data[directory + 20:directory + 28] = struct.pack("<II", 0xf0000000, 0xf0000000)
    write("lies.3mf", bytes(data))
    refused("flexel-voxelize", "lies.3mf", "-o", "o.vtu", seconds=3, fragments=["lies.3mf", "is damaged"])


def test_a_3mf_file_that_unpacks_without_end():
    write_3mf("bomb.3mf", " " * 400_000_000)
    refused("flexel-voxelize", "bomb.3mf", "-o", "o.vtu", seconds=3, fragments=["bomb.3mf", "more than 100 times its size"])


def test_components_that_unfold_without_end():
    levels = 17
    mesh = "<mesh>" + MESH[6:].replace("</triangles>", '<triangle v1="0" v2="2" v3="1"/>' * 396 + "</triangles>")
    objects = f'<object id="1">{mesh}</object>' + "".join(
        f'<object id="{n + 2}"><components><component objectid="{n + 1}"/><component objectid="{n + 1}"/></components></object>'
        for n in range(levels))
    write_3mf("unfold.3mf", MODEL.format("", objects, levels + 1))
    refused("flexel-voxelize", "unfold.3mf", "-o", "o.vtu", seconds=5,
            fragments=["unfold.3mf", "52.4 million triangles"])


def test_components_that_contain_one_another():
    objects = "".join(f'<object id="{n}"><components><component objectid="{3 - n}"/><component objectid="{3 - n}"/></components></object>' for n in (1, 2))
    write_3mf("ring.3mf", MODEL.format("", objects, 1))
    refused("flexel-voxelize", "ring.3mf", "-o", "o.vtu", seconds=5, fragments=["ring.3mf", "contain one another"])


def test_elements_of_a_3mf_file_that_nest_without_end():
    deep = "<a>" * 300000 + "</a>" * 300000
    write_3mf("deep.3mf", MODEL.format(' xmlns:x="http://x/3dmanufacturing/x/1" requiredextensions="x"', f'<object id="1">{MESH}{deep}</object>', 1))
    result = run("flexel-voxelize", "deep.3mf", "--count", "100", "-o", "o.vtu")
    expect(result.code in (0, 2), str(result))
    done = run("flexel", "deform", "deep.3mf", "--material", "steel", "--fix", "zmin", "--push", "zmax: 0 0 -1 N", "--count", "200", "-o", "out.3mf")
    expect(done.code in (0, 2), str(done))
    write_3mf("inside.3mf", MODEL.format("", f'<object id="1">{MESH}</object>'.replace('v3="1"/>', f'v3="1">{deep}</triangle>'), 1))
    done = run("flexel", "deform", "inside.3mf", "--material", "steel", "--fix", "zmin", "--push", "zmax: 0 0 -1 N", "--count", "200", "--refine", "1 mm",
               "-o", "out.3mf")
    expect(done.code == 2 and "elements inside triangles" in done.err, str(done))


def test_a_3mf_file_with_more_copies_than_it_seems():
    """A thousand uses of an object become a thousand objects: in time, and none of them twice."""
    uses = "".join(f'<component objectid="1" transform="1 0 0 0 1 0 0 0 1 {20 * n} 0 0"/>' for n in range(1000))
    write_3mf("many.3mf", MODEL.format("", f'<object id="1">{MESH}</object><object id="2"><components>{uses}</components></object>', 2))
    expect_ok(run("flexel", "deform", "many.3mf", "--material", "steel", "--fix", "zmin", "--push", "zmax: 0 0 -1 N", "--count", "3000", "--no-estimate",
                  "--keep-vertices", "-o", "out.3mf"))
    text = zipfile.ZipFile("out.3mf").read("3D/m.model").decode()
    expect(text.count("<mesh>") == 1000 and len(set(re.findall(r'objectid="(\d+)"', text))) == 1001, f"{text.count('<mesh>')} meshes")


# --- options


def test_a_wrap_that_no_memory_holds():
    box("a.stl")
    for length in ("1e-9 mm", "0.0001 mm"):
        refused("flexel-voxelize", "a.stl", "--count", "200", "--heal", f"wrap:{length}", "-o", "o.vtu", seconds=5,
                fragments=["is too fine", "would fit"])
    refused("flexel-voxelize", "a.stl", "--count", "200", "--heal", "wrap:0.05 mm", "--max-memory", "100MB", "-o", "o.vtu", seconds=5,
            fragments=["more than the limit of 100 MB"])
    expect_only("a.stl")


def test_numbers_of_options_that_are_none():
    box("a.stl")
    body("b.vtu")
    scene("s.toml")
    for command in (["flexel-voxelize", "a.stl", "-o", "o.vtu"], ["flexel-simulate", "s.toml", "b.vtu", "-o", "o.vtu"],
                    ["flexel-map", "b.vtu", "-o", "o.stl"]):
        for threads in ("1000000000", "-1", "nan", "1e3"):
            refused(*command, "--threads", threads, fragments=["--threads", "no whole number from 0 to 1024"])
    for option in ("--far-distance", "--scale"):
        for number in ("nan", "inf", "-nan", "1e999"):
            refused("flexel-map", "b.vtu", "-o", "o.stl", f"{option}={number}", fragments=[option])
    for option in ("--size", "--deflection", "--edge", "--count", "--max-memory"):
        for number in ("nan", "inf", "nan mm"):
            refused("flexel-voxelize", "a.stl", "-o", "o.vtu", f"{option}={number}")
    for option in ("--timeout", "--live-rate"):
        for number in ("nan", "inf", "nan s"):
            refused("flexel-simulate", "s.toml", "b.vtu", "-o", "o.vtu", f"{option}={number}")
    for option in ("--poisson", "--size"):
        refused("flexel", "measure", "--model", "cells", "--size", "1 mm", f"{option}=nan")
    expect_only("a.stl", "b.vtu", "s.toml")


def test_an_option_without_its_value():
    box("a.stl")
    for option in ("--unit=", "--count=", "--heal="):
        refused("flexel-voxelize", "a.stl", option, "--quiet", "-o", "o.vtu", fragments=[option[:-1], "its value is empty"])
    body("b.vtu")
    scene("s.toml")
    for command in (["flexel-voxelize", "a.stl"], ["flexel-simulate", "s.toml", "b.vtu"], ["flexel-map", "b.vtu"], ["flexel", "picture", "a.stl"]):
        refused(*command, "-o", "", fragments=["-o: its value is empty"])
    expect_only("a.stl", "b.vtu", "s.toml")


def test_matter_that_no_pressure_compresses():
    body("b.vtu")
    own = '[materials.own]\nyoung = "1 GPa"\npoisson = {}\ndensity = "1000 kg/m3"\n'
    for poisson in ("0.49999999999999", "-0.99999999999", "0.4999999"):
        scene("s.toml", SCENE.replace("steel", "own") + own.format(poisson))
        refused("flexel-simulate", "s.toml", "b.vtu", "-o", "o.vtu", fragments=["s.toml", "poisson", "rounding"])
    scene("s.toml", SCENE.replace("steel", "own") + own.format("0.49999"))
    expect_ok(run("flexel-simulate", "s.toml", "b.vtu", "-o", "o.vtu"))


def test_two_probes_of_one_name():
    body("b.vtu")
    probe = '[[probe]]\nname = "tip"\nwhere = "xmax"\n'
    scene("s.toml", SCENE + probe)
    refused("flexel-simulate", "s.toml", "b.vtu", "-o", "o.vtu", fragments=["s.toml", 'two [[probe]] are called "tip"'])


def test_a_picture_without_room_for_its_parts():
    box("a.stl")
    refused("flexel", "picture", *["a.stl"] * 4, "--size", "64x64", "-o", "p.png", memory=8_000_000, fragments=["--size 64x64", "no room for 4"])
    expect_ok(run("flexel", "picture", *["a.stl"] * 4, "--size", "320x240", "-o", "p.png"))


# --- files that a file names


def test_buffers_of_gltf_come_from_beside_it_alone():
    os.makedirs("in/below")
    for name in ("out.bin", "in/beside.bin", "in/below/under.bin"):
        write(name, TRIANGLE)
    os.symlink("../out.bin", "in/link.bin")
    os.mkfifo("in/fifo.bin")
    os.symlink("/dev/zero", "in/zero.bin")
    here = os.getcwd()
    for uri in ("beside.bin", "below/under.bin", "below/../beside.bin", "%62eside.bin", f"{here}/in/beside.bin"):
        write("in/a.gltf", gltf(uri))
        result = run("flexel", "info", "in/a.gltf")
        expect("has its numbers" not in result.err, f"{uri}: {result}")
    for uri in ("../out.bin", "%2e%2e/out.bin", "below/../../out.bin", f"{here}/out.bin", "link.bin", "/etc/passwd", "/dev/zero", "zero.bin", "../missing.bin"):
        write("in/a.gltf", gltf(uri))
        refused("flexel", "info", "in/a.gltf", seconds=5, fragments=["in/a.gltf", uri, "outside of its folder"])
    write("in/a.gltf", gltf("fifo.bin"))
    refused("flexel", "info", "in/a.gltf", seconds=5, fragments=["in/a.gltf", "fifo.bin", "is no file"])
    for uri in ("missing.bin", "a%00b", "%1b%5b31mred"):
        write("in/a.gltf", gltf(uri))
        expect_plain(refused("flexel", "info", "in/a.gltf", seconds=5, fragments=["in/a.gltf", "has its numbers"]).err)
    # A link to a .gltf whose buffers lie beside the file itself.
    write("in/a.gltf", gltf("beside.bin"))
    os.symlink("in/a.gltf", "far.gltf")
    os.symlink("in/beside.bin", "beside.bin")
    result = run("flexel", "info", "far.gltf")
    expect("has its numbers" not in result.err, str(result))


def test_frames_and_bodies_that_are_devices():
    body("b.vtu")
    os.mkfifo("fifo")
    for name in ("fifo", "/dev/zero"):
        write("run.pvd", f'<?xml version="1.0"?><VTKFile type="Collection"><Collection><DataSet timestep="0" file="{name}"/></Collection></VTKFile>')
        refused("flexel-map", "run.pvd", "-o", "o.stl", seconds=5, fragments=["run.pvd", name, "a device or a pipe"])
        scene("s.toml", SCENE + f'[run]\ntime = "1 ms"\n[[event]]\nat = "0.5 ms"\ndo = "add"\nbody = "{name}"\n')
        refused("flexel-simulate", "s.toml", "b.vtu", "-o", "o.vtu", seconds=5, fragments=["s.toml", name, "a device or a pipe"])


def test_a_checkpoint_touches_no_other_file():
    body("b.vtu")
    write("notes.body", "precious")
    scene("s.toml", 'material = "steel"\n[[fix]]\nwhere = "xmin"\n[run]\ntime = "10 us"\n')
    expect_ok(run("flexel-simulate", "s.toml", "b.vtu", "-o", "o.vtu", "--checkpoint", "notes", "--quiet"))
    expect(open("notes.body").read() == "precious", "notes.body was written to")


# --- what reaches the terminal


def test_control_characters_of_names_are_escaped():
    name = f"a{ESCAPE}{C1}{TURN}b\ninjected"
    body("b.vtu")
    for text in (SCENE.replace('"steel"', json.dumps(name)), SCENE.replace('"xmin"', json.dumps(name)), SCENE.replace('"xmax"', json.dumps(f"{name}/1")),
                 SCENE.replace('"tip"', json.dumps(name)) + '[[probe]]\nname = "x"\nwhere = "nowhere"\n',
                 SCENE.replace("-100 N", f"-100 {json.dumps(name)[1:-1]}"), SCENE + f"{json.dumps(name)} = 1\n",
                 SCENE.replace("force", json.dumps(name))):
        scene("s.toml", text)
        result = refused("flexel-simulate", "s.toml", "b.vtu", "-o", "o.vtu")
        expect_plain(result.err)
    expect_plain(refused("flexel", "info", f"no{ESCAPE}{TURN}thing.stl").err)
    latin = os.fsdecode(b"no\xe9\xff.stl")
    result = run("flexel", "info", latin)
    expect(result.code == 2, str(result))
    expect_plain(result.err)
    expect("\\xe9\\xff" in result.err, result.err)


def test_names_of_a_body_are_escaped_where_they_are_printed_and_in_file_names():
    body("b.vtu", "--quiet")
    data = open("b.vtu", "rb").read()
    old = b"body-box"
    expect(data.count(old) >= 1, "the part's name is not in the body as text")
    name = b"b\xc2\x9b\xe2\x80\xaebx"
    expect(len(name) == len(old), "another length")
    write("evil.vtu", data.replace(old, name))
    scene("s.toml")
    result = run("flexel-simulate", "s.toml", "evil.vtu", "-o", "o.vtu")
    expect_ok(result)
    expect_plain(result.err)
    expect("\\u202e" in result.err or "b" in result.err, result.err)
    expect_ok(run("flexel-map", "o.vtu", "-o", "{part}.stl", "--quiet"))
    for file in os.listdir("."):
        expect_plain(file)


if __name__ == "__main__":
    main(globals())

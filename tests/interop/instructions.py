"""Counts the instructions of a timed run function by function, by valgrind's callgrind: exact, whatever else the machine does."""

import collections
import json
import pathlib
import re
import subprocess

from shapes import ascii_stl, binary_stl, box_triangles

SUMMARY = "summary.json"  # of runs whose joints may ask for steps of their own
MATTER = """material = "gum"
[materials.gum]
young = "1.2 MPa"
poisson = 0.25
density = "930 kg/m3"
[parts.block]
model = "{model}"
[run]
time = "{time} us"
step = "10 us"
"""

# What a scene says to call for an effect, and options that go with it. The block is a cube from the origin.
EFFECTS = {
    "`[gravity]`": '[gravity]\nacceleration = [0, 0, "-9.81 m/s2"]\n',
    "`[[load]]`": '[[load]]\nwhere = "xmax"\nforce = ["0 N", "0 N", "-1 mN"]\n',
    "`[[load]]` with a course": '[[load]]\nwhere = "xmax"\nforce = ["0 N", "0 N", "-1 mN"]\ntime = ["0 s", "1 s"]\nfactor = [0, 1]\n',
    "`[[fix]]` of a side": '[[fix]]\nwhere = "xmin"\n',
    "`[[fix]]` of elements": '[[fix]]\nwhere = { half_space = { point = ["0.5 mm", 0, 0], normal = [-1, 0, 0] } }\n',
    "`[[velocity]]`": '[[velocity]]\nwhere = "block"\nvelocity = ["0 m/s", "0 m/s", "1 m/s"]\n',
    "`[damping]`": '[damping]\ntime = "1 us"\n',
    "`[drag]`": '[drag]\ndensity = "1.2 kg/m3"\n',
    "`[plasticity]`": '[plasticity]\nyield = "1 GPa"\n',
    "`[fracture]`": '[fracture]\nstrength = "1 GPa"\n',
}


def make_block(cells, placement="corner"):
    """block.stl and block.vtu of cells^3 cells of a millimetre; its elements."""
    pathlib.Path("block.stl").write_bytes(binary_stl(box_triangles(3 * (float(cells),))))
    subprocess.run(["flexel-voxelize", "block.stl", "--size", "1 mm", "--align", "none", "--placement", placement, "--quiet", "-o", "block.vtu"],
                   check=True, timeout=120)
    return (cells + (placement == "corner"))**3


PAIR = MATTER.replace("[parts.block]\n", "").replace('material = "gum"\n', 'material = "gum"\nmodel = "{model}"\n').replace('model = "{model}"\n[run]', "[run]").replace("10 us", "5 us")
RIGID = "[parts.upper]\nrigid = true\n"
BOTH_RIGID = RIGID + "[parts.lower]\nrigid = true\n"
HINGE = '[[joint]]\nkind = "hinge"\nparts = ["lower", "upper"]\nat = [0, 0, "16 mm"]\naxis = [1, 0, 0]\n'
# What a scene says where two parts touch, the blocks of make_pair(): at its top, and in tables.
BETWEEN_PARTS = {
    "bonded, as parts that touch are by default": ("", ""),
    "`[contact]`": ("contact = true\n", ""),
    "`[contact]`, one part `rigid`": ("contact = true\n", RIGID),
    "bonded, one part `rigid`": ("", RIGID),
    "both `rigid`": ("bond = false\n", BOTH_RIGID),
    "both `rigid`, a `[[joint]]` between them": ("bond = false\n", BOTH_RIGID + HINGE),
}


def make_pair(cells):
    """block.vtu of two blocks of cells^3 cells of a millimetre, one on the other."""
    lower = box_triangles(3 * (float(cells),))
    upper = [[(x, y, z + cells) for x, y, z in triangle] for triangle in lower]
    pathlib.Path("pair.stl").write_bytes(ascii_stl(lower, "lower") + ascii_stl(upper, "upper"))
    subprocess.run(["flexel-voxelize", "pair.stl", "--size", "1 mm", "--align", "none", "--quiet", "-o", "block.vtu"], check=True,
                   timeout=120)
    return 2 * (cells + 1)**3


def pair_command(steps, row=None, model="cells"):
    """The same for two blocks; without `row` they do not know of each other."""
    top, tables = ("bond = false\n", "") if row is None else BETWEEN_PARTS[row]
    pathlib.Path("scene.toml").write_text(top + PAIR.format(time=5 * steps, model=model) + tables, encoding="utf-8")
    return ["flexel-simulate", "scene.toml", "block.vtu", "-o", "out.vtu", "--threads", "1", "--quiet", "--summary", SUMMARY]


def simulate_command(steps, effect="", model="cells", options=()):
    """Writes scene.toml and gives the command that runs it for so many steps."""
    pathlib.Path("scene.toml").write_text(MATTER.format(time=10 * steps, model=model) + effect, encoding="utf-8")
    return ["flexel-simulate", "scene.toml", "block.vtu", "-o", "out.vtu", "--threads", "1", "--quiet", *options]


def count(command):
    """Instructions by function (demangled) of a run, those of what it calls left out."""
    subprocess.run(["valgrind", "--tool=callgrind", "--callgrind-out-file=callgrind.out", *command], check=True, timeout=300,
                   stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    listed = subprocess.run(["callgrind_annotate", "--threshold=100", "--show-percs=no", "--auto=no", "callgrind.out"], check=True,
                            stdout=subprocess.PIPE, timeout=60).stdout.decode()
    found = collections.Counter()
    for number, function in re.findall(r"(?m)^ *([\d,]+)  [^\n:]*?:(\S[^\n]*?)(?: \[[^\]\n]*\])?$", listed):
        found[function] += int(number.replace(",", ""))
    return found


def counted(command, steps):
    """Instructions by function, and the steps of the run: those asked for, or where it writes a summary those that it took."""
    found = count(command)
    return found, json.loads(pathlib.Path(SUMMARY).read_text(encoding="utf-8"))["timed"]["steps"] if SUMMARY in command else steps


def of_a_step(command_for, steps=200):
    """Instructions of one step by function, from runs of `steps` and twice as many; what is done every hundredth step is in it."""
    # one after the other: both may write the same scene.toml
    (short, fewer), (long, more) = counted(command_for(steps), steps), counted(command_for(2 * steps), 2 * steps)
    return {f: (long[f] - short[f]) / (more - fewer) for f in set(short) | set(long) if long[f] != short[f]}


def kernel_only(functions):
    """Those of the hot loop, simulate/kernels/kernel_table.cpp."""
    return {f: n for f, n in functions.items() if re.match(r"(void |double |flexel::simulate::step::ChunkOutcome )?flexel::simulate::step::", f)}

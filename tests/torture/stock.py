"""What torture begins with: sound parts, bodies and scenes, made once by our own programs."""

import json
import os
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "tests/programs"))
from shapes import ascii_stl, binary_stl, box_triangles  # noqa: E402

MAKERS = {"hammer.obj": "swing/make_hammer.py", "strip.stl": "dented/make_strip.py", "hook.stl": "torn/make_hook.py", "plate.stl": "carved/make_plate.py",
          "ring.stl": "gripped/make_ring.py", "supports.stl": "supports/make_supports.py"}
LARGEST = 600_000  # bytes of a real part that is taken

HELD = 'material = "MATERIAL"\n[[fix]]\nwhere = "xmin"\n'
PULL = '[[load]]\nwhere = "xmax"\nforce = ["FORCE", "0 N", "-FORCE"]\n'
SWAY = PULL + 'time = ["0 s", "TIME"]\nfactor = [0, 1]\n'
TIMED = '[[probe]]\nname = "tip"\nwhere = "xmax"\n[run]\ntime = "TIME"\nframes = 20\n'


def text(what, material="rubber", force="0.01 N", time="20 ms"):
    return what.replace("MATERIAL", material).replace("FORCE", force).replace("TIME", time)


STATIC = {
    "bend.toml": text(HELD + PULL, "steel", "30 N"),
    "quadratic.toml": text('model = "quadratic"\n' + HELD + PULL, "steel", "30 N"),
    "springs.toml": text('model = "springs"\n' + HELD + PULL, "steel", "30 N"),
    "move.toml": text(HELD + '[[move]]\nwhere = "xmax"\ndisplacement = ["1 mm", "free", "-1 mm"]\n[gravity]\n'
                      'acceleration = ["0 m/s2", "0 m/s2", "-9.81 m/s2"]\n', "PLA"),
    "ball.toml": text(HELD + '[[indenter]]\nball = { centre = ["20 mm", "5 mm", "20 mm"], radius = "8 mm" }\ndisplacement = ["0 mm", "0 mm", "-3 mm"]\n', "PLA"),
    "plate.toml": text(HELD + '[[indenter]]\nplate = { centre = ["30 mm", "5 mm", "12 mm"], normal = [0, 0, -1], radius = "8 mm" }\n'
                       'displacement = ["0 mm", "0 mm", "-3 mm"]\n', "PLA"),
}
IN_TIME = {
    "swing.toml": text(HELD + SWAY + '[drag]\ndensity = "1 kg/m3"\n' + TIMED),
    "damped.toml": text(HELD + SWAY + '[damping]\ntime = "2 us"\n' + TIMED),
    "implicit.toml": text(HELD + SWAY + '[damping]\ntime = "20 us"\n' + TIMED + 'method = "implicit"\nstep = "20 us"\n', "steel", "50 N", "4 ms"),
    "torn.toml": text(HELD + SWAY + '[materials.soft]\nyoung = "10 MPa"\npoisson = 0.3\ndensity = "1000 kg/m3"\nsource = "a test"\n[plasticity]\n'
                      'yield = "20 kPa"\nhardening = "1 MPa"\n[fracture]\nelongation = 0.02\n' + TIMED, "soft", "6 N"),
    "events.toml": text(HELD + SWAY + '[damping]\ntime = "2 us"\n[[event]]\nat = "4 ms"\ndo = "renormalise"\n[[event]]\nat = "8 ms"\ndo = "edit"\n'
                        'stiffness = 0.5\nwhere = { box = { min = ["10 mm", "-1 mm", "-1 mm"], max = ["20 mm", "11 mm", "11 mm"] } }\n[[event]]\n'
                        'at = "12 ms"\ndo = "carve"\nwhere = { box = { min = ["14 mm", "4 mm", "4 mm"], max = ["26 mm", "11 mm", "11 mm"] } }\n' + TIMED),
    "finer.toml": text(HELD + SWAY + '[damping]\ntime = "2 us"\n[[event]]\nat = "5 ms"\ndo = "resolution"\nchange = "finer"\n[[event]]\nat = "15 ms"\n'
                       'do = "resolution"\nchange = "coarser"\n' + TIMED),
    "end.toml": text(HELD + SWAY + '[[event]]\nat = "20 ms"\ndo = "edit"\nstiffness = 0.5\n' + TIMED),
    "spring-swing.toml": text('model = "springs"\n' + HELD.replace('where = "xmin"', 'where = { box = { min = ["-1 mm", "-1 mm", "-1 mm"], max = ["4 mm", "11 mm", "11 mm"] } }')
                              + SWAY + TIMED),
}
LAMMPS = ("spring-swing.toml", "box-rest.vtu")
POINTS = "name,x,y,z\na,1,2,3\nb,39,5,5\nc,20,1,9\n"


class Stock:
    """Names and bytes by kind: parts (what programs read first), bodies (rest), bent (deformed), scenes, timed, tables."""

    def __init__(self, programs, parts_folder, folder):
        self.programs, self.folder = programs, folder
        self.parts, self.bodies, self.bent, self.tables = {}, {}, {}, {"points.csv": POINTS.encode()}
        self.scenes = {name: each.encode() for name, each in STATIC.items()}
        self.timed = {name: each.encode() for name, each in IN_TIME.items()}
        for path in sorted((ROOT / "samples").rglob("*.toml")):
            self.scenes[f"{path.parent.name}-{path.name}"] = path.read_bytes()
        self.make_parts(parts_folder)
        self.make_bodies()
        self.exported = {}
        self.make_dump()

    def run(self, *command):
        return subprocess.run([str(self.programs / command[0]), *command[1:]], cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, check=False)

    def keep(self, kind, name):
        path = self.folder / name
        if path.exists():
            kind[name] = path.read_bytes()

    def make_parts(self, parts_folder):
        self.parts["box.stl"] = binary_stl(box_triangles())
        self.parts["ascii.stl"] = ascii_stl(box_triangles())
        for name, maker in MAKERS.items():
            self.parts[name] = subprocess.run([ROOT / "samples" / maker], stdout=subprocess.PIPE, check=True).stdout
        for name, data in self.parts.items():
            (self.folder / name).write_bytes(data)
        if (self.programs / "make_bracket").exists():
            self.run("make_bracket", "bracket.step")
            self.keep(self.parts, "bracket.step")
        # The box in every format that is written.
        self.run("flexel-voxelize", "box.stl", "--size", "5 mm", "--quiet", "-o", "box-rest.vtu")
        for extension in ("obj", "ply", "off", "glb", "3mf"):
            self.run("flexel-map", "box-rest.vtu", "--quiet", "-o", f"box.{extension}")
            self.keep(self.parts, f"box.{extension}")
        if parts_folder.is_dir():
            for path in sorted(parts_folder.iterdir()):
                if path.is_file() and path.suffix not in (".md", ".mtl") and path.stat().st_size <= LARGEST:
                    self.parts[path.name] = path.read_bytes()

    def make_bodies(self):
        kinds = {"box-rest.vtu": ("box.stl", "--size", "5 mm"), "box-fine.vtu": ("box.stl", "--size", "2 mm"),
                 "box-moments.vtu": ("box.stl", "--size", "4.3 mm", "--align", "none", "--moments"),
                 "box-centre.vtu": ("box.stl", "--size", "5 mm", "--placement", "centre"), "box-packed.vtu": ("box.stl", "--size", "5 mm", "--compress"),
                 "obj-rest.vtu": ("box.obj", "--size", "5 mm"), "glb-rest.vtu": ("box.glb", "--size", "5 mm"), "3mf-rest.vtu": ("box.3mf", "--size", "5 mm"),
                 "bracket-rest.vtu": ("bracket.step", "--count", "600")}
        for name, (part, *options) in kinds.items():
            if part in self.parts:
                self.run("flexel-voxelize", part, *options, "--quiet", "-o", name)
                self.keep(self.bodies, name)
        (self.folder / "bend.toml").write_bytes(self.scenes["bend.toml"])
        for name in list(self.bodies):
            if "centre" not in name:
                self.run("flexel-simulate", "bend.toml", name, "--quiet", "--no-estimate", "-o", name.replace("rest", "bent").replace(".vtu", "-bent.vtu"))
                self.keep(self.bent, name.replace("rest", "bent").replace(".vtu", "-bent.vtu"))

    def make_dump(self):
        """A body as it goes to LAMMPS, and a dump of two frames: where it is, and a little further."""
        scene, body = LAMMPS
        (self.folder / scene).write_bytes(self.timed[scene])
        self.run("flexel", "export", body, "--lammps", "--scene", scene, "--quiet", "-o", "swing.in")
        self.keep(self.exported, "swing.vtu")
        if "swing.vtu" not in self.exported:
            return
        atoms = (self.folder / "swing.data").read_text().split("Atoms # bond")[1].split("Velocities")[0].split("\n")
        rows = [row.split() for row in atoms if row]
        frames = []
        for step, way in ((0, 0), (100, 1e-4)):
            frames.append(f"ITEM: TIME\n{step * 1e-6}\nITEM: TIMESTEP\n{step}\nITEM: NUMBER OF ATOMS\n{len(rows)}\nITEM: BOX BOUNDS ss ss ss\n0 1\n0 1\n0 1\n"
                          "ITEM: ATOMS id x y z vx vy vz\n")
            frames += [f"{row[0]} {row[3]} {row[4]} {float(row[5]) + way!r} 0 0 0\n" for row in rows]
        self.exported["swing.dump"] = "".join(frames).encode()

    def counts(self):
        return json.dumps({kind: len(getattr(self, kind)) for kind in ("parts", "bodies", "bent", "scenes", "timed")})


def make(programs, parts_folder, folder):
    os.makedirs(folder, exist_ok=True)
    stock = Stock(programs, parts_folder, pathlib.Path(folder))
    missing = [kind for kind in ("parts", "bodies", "bent") if not getattr(stock, kind)]
    if missing:
        raise SystemExit(f"tools/torture: no {', '.join(missing)} could be made by the programs in {programs}")
    return stock

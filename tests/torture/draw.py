"""Trials drawn by chance: each number always gives the same one."""

import random as generator
import resource
import signal

import mutate
from trial import Trial

LENGTHS = ["1 mm", "5 mm", "0 mm", "-1 mm", "1e-300 mm", "1e300 m", "nan mm", "inf mm", "3", "", "1 N", "0.01 mm", "1e-9 m", "1 km"]
NUMBERS = ["0", "1", "-1", "7", "1e9", "nan", "inf", "1e-320", "99999999999999999999", "x", "1e300"]
FACES = ["xmin", "xmax", "box/1", "box/", "/1", "1", "#1", "=1", "nowhere", "box/999999", "*", "\x1b[31m", "box/xmin", ""]
AMOUNTS = ["0 0 -10 N", "10 N", "1e300 N", "1e34 N", "nan N", "-1 N", "1 Pa", "0 N", "0 0 0 N", "1 2 N", "1e-40 N", "5 mm"]
OPTIONS = {
    "flexel-voxelize": {"--size": LENGTHS, "--count": NUMBERS + ["500", "3000"], "--placement": ["corner", "centre", "x"], "--unit": ["mm", "m", "in", "parsec", "um"],
                        "--align": ["snap", "box", "none"], "--heal": ["auto", "wrap", "none", "wrap:1 mm", "wrap:0.05 mm", "wrap:1e300 m", "wrap:nan mm"],
                        "--max-memory": ["1GB", "50MB", "1kB", "nan", "-1", "1e30"], "--edge": LENGTHS, "--deflection": LENGTHS, "--threads": ["0", "1", "3", "1e9"],
                        "--max-elements": NUMBERS, "--timeout": ["1 s", "0.01 s", "1e300 s", "-1 s", "nan s"], "--moments": None, "--compress": None},
    "flexel-simulate": {"--threads": ["0", "1", "3"], "--timeout": ["1 s", "0.01 s", "1e10 s"], "--no-stress": None, "--no-estimate": None, "--compress": None,
                        "--isa": ["portable", "avx2", "avx1024"], "--explain": None, "--max-memory": ["1GB", "30MB"], "--max-elements": ["10", "100000"]},
    "flexel-map": {"--method": ["blended", "smooth", "affine", "gram-schmidt", "x"], "--scale": NUMBERS, "--far": ["follow", "rigid", "refuse"],
                   "--far-distance": NUMBERS, "--crack": ["keep", "open", "cap"], "--check": ["voronoi", "self-intersection", "x"], "--unit": ["mm", "in", "x"],
                   "--refine": ["auto", "off", "1 mm", "0.01 mm", "nan mm"], "--strict": None, "--keep-vertices": None, "--timeout": ["1 s", "0.01 s"]},
    "flexel deform": {"--push": [f"{f}: {a}" for f in FACES for a in AMOUNTS], "--fix": FACES, "--move": [f"{f}: {a}" for f in FACES for a in ("0 0 -1 mm", "1e300 mm", "nan mm")],
                      "--material": ["steel", "PLA", "unobtainium", "\x1b[0m"], "--gravity": ["1 g", "1e300 g", "nan g"], "--count": NUMBERS, "--size": LENGTHS,
                      "--accuracy": ["5%", "0 %", "nan"], "--within": ["1 s", "0 s"], "--timeout": ["2 s", "0.1 s"], "--torque": ["xmax: 1 N m", "xmax: 1e300 N m"],
                      "--max-elements": ["5000"], "--no-estimate": None},
    "flexel picture": {"--size": ["64x64", "320x240", "1x1", "100000x100000", "0x0", "nanxnan"], "--threads": ["1", "3"], "--timeout": ["0.2 s"]},
    "flexel info": {"--json": None, "--unit": ["mm", "m", "x"], "--edge": LENGTHS, "--timeout": ["0.2 s"], "--threads": ["1", "3"]},
    "flexel export": {"--material": ["steel", "PLA", "unobtainium"], "--fix": FACES, "--push": [f"{f}: {a}" for f in FACES for a in AMOUNTS], "--count": NUMBERS, "--size": LENGTHS,
                      "--element": ["C3D8I", "C3D8", "x"], "--nlgeom": ["auto", "on", "off", "x"], "--mesh": ["hex", "tet", "x"], "--max-elements": ["5000"]},
    "flexel import-lammps": {"--compress": None, "--quiet": None, "--timeout": ["0.01 s", "1 s", "nan s"], "--max-memory": ["1kB", "30MB"], "--threads": ["0", "3"]},
    "flexel measure": {"--model": ["cells", "springs", "paper"], "--size": LENGTHS, "--poisson": NUMBERS + ["0.3", "0.4999999"], "--material": ["steel", "x"]},
}
SURFACES = ["out.stl", "out.obj", "out.ply", "out.off", "out.glb", "out.3mf"]


def options(program, random, most):
    """Some of its options, each at most once."""
    words = []
    for name in random.sample(sorted(OPTIONS[program]), min(most, random.randrange(most + 1), len(OPTIONS[program]))):
        values = OPTIONS[program][name]
        words += [name] if values is None else [f"{name}={random.choice(values)}"] if random.random() < .5 else [name, random.choice(values)]
    return words


def pick(kind, random):
    name = random.choice(sorted(kind))
    return name, kind[name]


class Draw:
    def __init__(self, stock):
        self.stock = stock

    # --- commands over sound inputs: (command, inputs, outputs)

    def voxelize(self, random, most=0):
        name, data = pick(self.stock.parts, random)
        size = [] if most else ["--count", str(random.choice((200, 1500)))]
        return ["flexel-voxelize", name, *size, *options("flexel-voxelize", random, most), "-o", "out.vtu", "--summary", "out.json"], {name: data}, ["out.vtu", "out.json"]

    def simulate(self, random, most=0):
        body, data = pick(self.stock.bodies, random)
        scene, text = pick(random.choice((self.stock.scenes, self.stock.timed)), random)
        inputs = {body: data, scene: text}
        return ["flexel-simulate", scene, body, *options("flexel-simulate", random, most), *([] if most else ["--timeout", "20 s"]), "-o", "out.vtu", "--summary", "out.json"], inputs, ["out.vtu", "out.json"]

    def map(self, random, most=0):
        body, data = pick(self.stock.bent, random)
        out = random.choice(SURFACES)
        if random.random() < .15:
            points, table = pick(self.stock.tables, random)
            return ["flexel-map", body, "--points", points, "-o", "out.csv"], {body: data, points: table}, ["out.csv"]
        return ["flexel-map", body, *options("flexel-map", random, most), "-o", out, "--report", "out.json"], {body: data}, [out, "out.json"]

    def deform(self, random, most=0):
        name, data = pick(self.stock.parts, random)
        out = random.choice(SURFACES)
        words = options("flexel deform", random, most) if most else ["--material", "steel", "--fix", "xmin", "--push", "xmax: 0 0 -10 N", "--count", "400", "--no-estimate"]
        return ["flexel", "deform", name, *words, *([] if "--timeout" in " ".join(words) else ["--timeout", "30 s"]), "-o", out], {name: data}, [out]

    def picture(self, random, most=0):
        name, data = pick(random.choice((self.stock.parts, self.stock.bent)), random)
        return ["flexel", "picture", name, *options("flexel picture", random, most), "-o", "out.png"], {name: data}, ["out.png"]

    def info(self, random, most=0):
        name, data = pick(random.choice((self.stock.parts, self.stock.bent)), random)
        return ["flexel", "info", name, *options("flexel info", random, most)], {name: data}, []

    def measure(self, random, most=0):
        return ["flexel", "measure", *options("flexel measure", random, most)], {}, []

    def export(self, random, most=0):
        if random.random() < .5:
            name, data = pick(self.stock.parts, random)
            held = ["--material", "steel", "--fix", "xmin", "--push", "xmax: 0 0 -10 N", "--count", "400"]
            return ["flexel", "export", name, "--calculix", *(options("flexel export", random, most) if most else held), "--timeout", "30 s", "-o", "out.inp"], {name: data}, ["out.inp"]
        (body, data), (scene, text) = pick(self.stock.bodies, random), pick(self.stock.timed, random)
        return ["flexel", "export", body, "--lammps", "--scene", scene, "--timeout", "20 s", "-o", "out.in"], {body: data, scene: text}, ["out.in", "out.data", "out.vtu"]

    def import_lammps(self, random, most=0):
        words = options("flexel import-lammps", random, most)
        return ["flexel", "import-lammps", "swing.dump", "swing.vtu", *words, "-o", "out.vtu"], dict(self.stock.exported), ["out.vtu"]

    def any(self, random, most=0):
        kinds = [self.voxelize, self.simulate, self.map, self.deform, self.picture, self.info, self.export]
        kinds += ([self.import_lammps] if "swing.dump" in self.stock.exported else []) + ([self.measure] if most else [])
        return random.choice(kinds)(random, most)

    # --- kinds of trials

    def mutation(self, random):
        command, inputs, outputs = self.any(random)
        trial = Trial("mutation", command, dict(inputs), outputs)
        if not inputs:
            return trial
        name = random.choice(sorted(inputs))
        trial.changed, trial.sound, trial.changes = name, inputs[name], mutate.changes(inputs[name], random)
        trial.inputs[name] = mutate.apply(inputs[name], trial.changes)
        return trial

    def arguments(self, random):
        command, inputs, outputs = self.any(random, 4)
        return Trial("arguments", command, inputs, outputs)

    def limit(self, random):
        command, inputs, outputs = self.any(random)
        trial = Trial("limit", command, inputs, outputs)
        kind = random.randrange(5)
        if kind == 0:
            trial.limits = {resource.RLIMIT_AS: random.choice((60, 120, 200, 300, 500, 900)) << 20}
        elif kind == 1:
            trial.limits = {resource.RLIMIT_NPROC: random.choice((1, 2, 4, 8))}
        elif kind == 2:
            trial.small_disk = random.choice((16, 64, 120, 400))
        elif kind == 3:
            trial.environment = {"TMPDIR": "/nowhere/at/all"}
        else:
            trial.command = [*command, "--max-memory", random.choice(("20MB", "60MB", "200MB"))]
        return trial

    def kill(self, random):
        command, inputs, outputs = self.any(random)
        after = 10 ** random.uniform(-2.5, .3)
        return Trial("kill", command, inputs, outputs, signal=random.choice((signal.SIGKILL, signal.SIGKILL, signal.SIGTERM, signal.SIGINT, signal.SIGHUP)), after=after)

    def resume(self, random):
        """A timed run; the driver kills it and goes on (tools/torture)."""
        scene, text = pick(self.stock.timed, random)
        body, data = pick({name: each for name, each in self.stock.bodies.items() if name in ("box-rest.vtu", "obj-rest.vtu", "box-packed.vtu")}, random)
        return Trial("resume", ["flexel-simulate", scene, body, "--quiet", "-o", "run.vtu", "--history", "run.csv"], {scene: text, body: data}, ["run.vtu", "run.csv"])

    def threads(self, random):
        command, inputs, outputs = self.any(random)
        return Trial("threads", command, inputs, [name for name in outputs])

    KINDS = (("mutation", 10), ("arguments", 4), ("limit", 2), ("kill", 4), ("resume", 1), ("threads", 1))

    def number(self, seed, number):
        random = generator.Random(f"{seed}-{number}")
        kind = random.choices([name for name, _ in self.KINDS], [weight for _, weight in self.KINDS])[0]
        return getattr(self, kind)(random)

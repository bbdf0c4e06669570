"""One command in a folder of its own, and what is wrong with how it ended."""

import array
import dataclasses
import json
import os
import pathlib
import re
import resource
import shlex
import signal
import subprocess
import tempfile
import time

ENDS = {0, 2, 3, 4, 5, 130, 141}
OLD = b"what was there before\n"
WALL = 150  # s, on a machine that does much else
BUSY = 10  # times that for one that is ready to work and got less than half of WALL of a processor
MEMORY = 8 << 30
WILD = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\ufffd]")


@dataclasses.dataclass
class Trial:
    kind: str
    command: list
    inputs: dict  # name: bytes
    outputs: list  # names of results; old files lie there before
    threads: str = ""  # of --threads
    limits: dict = dataclasses.field(default_factory=dict)  # resource.RLIMIT_*: value
    environment: dict = dataclasses.field(default_factory=dict)
    stdin: bytes = b""
    signal: int = 0
    after: float = 0  # s
    small_disk: int = 0  # kB of the file system that it works on
    beside: tuple = ()  # files that may appear beside the results
    # Of a mutation: the input that was changed, as it was, and the changes (mutate.py).
    changed: str = ""
    sound: bytes = b""
    changes: list = dataclasses.field(default_factory=list)

    def shell(self, programs="$B"):
        """As a line for a shell whose $B is the folder of the programs; the inputs lie in its folder."""
        names = {resource.RLIMIT_AS: "v", resource.RLIMIT_NPROC: "u", resource.RLIMIT_DATA: "d"}
        limits = "".join(f"ulimit -{names[key]} {value if key == resource.RLIMIT_NPROC else value // 1024}; " for key, value in self.limits.items())
        variables = "".join(f"{key}={shlex.quote(value)} " for key, value in self.environment.items())
        wait = f"timeout -s {self.signal} {self.after:.3f} " if self.signal else ""
        disk = f"mount -t tmpfs -o size={self.small_disk}k tmpfs . && " if self.small_disk else ""
        given = " < stdin" if self.stdin else " < /dev/null"
        return f"({disk}{limits}{variables}{wait}{programs}/{shlex.join(map(str, self.command))}{given})"


@dataclasses.dataclass
class Ended:
    code: int
    out: bytes
    err: str
    files: dict
    seconds: float
    timed_out: bool = False
    survivors: bool = False  # processes that it has started and left
    temporary: tuple = ()  # what is left in the temporary folder


def limits_of(trial):
    def apply():
        resource.setrlimit(resource.RLIMIT_AS, (trial.limits.get(resource.RLIMIT_AS, MEMORY),) * 2)
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        for key, value in trial.limits.items():
            resource.setrlimit(key, (value, value))
        if resource.RLIMIT_NPROC in trial.limits and os.geteuid() == 0:
            os.setgid(65534), os.setuid(65534)  # root has no such limit
    return apply


def run(trial, programs, folder):
    """Runs it in `folder`, which is made anew and left as the command leaves it."""
    subprocess.run(["rm", "-rf", folder], check=True)
    os.makedirs(folder)
    os.chmod(folder, 0o777)
    mounted = trial.small_disk and subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={trial.small_disk}k", "tmpfs", folder], check=False,
                                                  stderr=subprocess.DEVNULL).returncode == 0
    try:
        for name, data in trial.inputs.items():
            try:
                pathlib.Path(folder, name).write_bytes(data)
            except OSError:
                return None  # the disk does not even hold the inputs
        for name in trial.outputs:
            if name not in trial.inputs and not mounted:
                pathlib.Path(folder, name).write_bytes(OLD)
                os.chmod(pathlib.Path(folder, name), 0o666)
        return attempt(trial, programs, folder)
    finally:
        if mounted:
            subprocess.run(["umount", "-l", folder], check=False)


def attempt(trial, programs, folder):
    with tempfile.TemporaryDirectory(prefix="flexel-torture-tmp-") as temporary:
        os.chmod(temporary, 0o777)
        ended = attempt_in(trial, programs, folder, dict(os.environ, LC_ALL="C.UTF-8", TMPDIR=temporary) | trial.environment)
        ended.temporary = tuple(sorted(os.listdir(temporary)))
        return ended


def lives(group):
    try:
        os.killpg(group, 0)
        return True
    except (ProcessLookupError, PermissionError):
        return False


def starved(group):
    """Whether processes of the group are ready to work and got little of a processor; one that waits for nothing is not."""
    used, ready = 0.0, False
    for status in pathlib.Path("/proc").glob("[0-9]*/stat"):
        try:
            words = status.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(words[2]) == group:
            used += (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")
            ready = ready or words[0] in "RD"
    return ready and used < WALL / 2


def ends(process, given):
    """What it wrote, (out, err); TimeoutExpired once it hangs."""
    for _ in range(BUSY):
        try:
            return process.communicate(given, timeout=WALL)
        except subprocess.TimeoutExpired:
            if not starved(process.pid):
                break
    raise subprocess.TimeoutExpired(process.args, WALL)


def attempt_in(trial, programs, folder, environment):
    began = time.monotonic()
    process = subprocess.Popen([str(programs / trial.command[0]), *map(str, trial.command[1:])], cwd=folder, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                               stderr=subprocess.PIPE, env=environment, preexec_fn=limits_of(trial), start_new_session=True)
    timed_out = False
    try:
        if trial.signal:
            try:
                out, err = process.communicate(trial.stdin, timeout=trial.after)
            except subprocess.TimeoutExpired:
                process.send_signal(trial.signal)
                out, err = ends(process, None)
        else:
            out, err = ends(process, trial.stdin)
    except subprocess.TimeoutExpired:
        timed_out = True
        os.killpg(process.pid, signal.SIGKILL)
        out, err = process.communicate()
    for _ in range(100):
        if not lives(process.pid):
            break
        time.sleep(.02)
    survivors = lives(process.pid)
    if survivors:
        os.killpg(process.pid, signal.SIGKILL)
    files = {path.name: path.read_bytes() if path.is_file() else b"" for path in pathlib.Path(folder).iterdir()}
    return Ended(process.returncode, out, err.decode(errors="replace"), files, time.monotonic() - began, timed_out, survivors)


def bad_numbers(name, data):
    """What is not finite in a result."""
    if name.endswith(".json"):
        try:
            json.loads(data, parse_constant=lambda word: (_ for _ in ()).throw(ValueError(word)))
        except ValueError as error:
            return f"{name} is no JSON: {error}"
    if name.endswith(".csv") and re.search(rb"(^|[,;\s])-?(nan|inf)([,;\s]|$)", data):
        return f"{name} holds nan or inf"
    if name.endswith(".stl") and len(data) >= 84 and len(data) == 84 + 50 * int.from_bytes(data[80:84], "little"):
        for at in range(84, len(data), 50):
            if any(x != x or abs(x) == float("inf") for x in array.array("f", data[at:at + 48])):
                return f"{name} holds a number that is not finite"
    if name.endswith((".obj", ".off")) and re.search(rb"^(v )?\s*-?(nan|inf)\b", data, re.M):
        return f"{name} holds nan or inf"
    return ""


def is_leftover(trial, name):
    return name not in (*trial.inputs, *trial.outputs, *trial.beside)


def wrong(trial, ended):
    """(short name of what is wrong, all of it); ("", "") where nothing is."""
    if ended is None:
        return "", ""
    killed = ended.code == -trial.signal or ended.code == 128 + trial.signal
    if ended.timed_out:
        return "hang", f"did not end within {WALL} s"
    if ended.survivors:
        return "a child lives on", ended.err
    if trial.signal == signal.SIGKILL and killed:
        bad = [name for name in trial.outputs if name in ended.files and ended.files[name] != OLD and bad_numbers(name, ended.files[name])]
        return ("half a file", str(bad)) if bad else ("", "")
    if ended.code == 127 and trial.limits and "loading shared libraries" in ended.err:
        return "", ""  # the loader's: the program has not begun
    if ended.code not in ENDS and not (trial.signal and killed):
        return f"exit {ended.code}", ended.err
    lines = [line for line in ended.err.splitlines() if ": error: " in line]
    if "internal error" in ended.err:
        return "internal error", ended.err
    if ended.code in (2, 3, 4, 5) and len(lines) != 1:
        return f"exit {ended.code} with {len(lines)} lines of error", ended.err
    if WILD.search(ended.err.replace("\n", "").replace("\r", "")):
        return "control characters", repr(ended.err)
    if ended.temporary:
        return "leftovers in the temporary folder", f"{ended.temporary}; exit {ended.code}: {ended.err}"
    left = sorted(name for name in ended.files if is_leftover(trial, name))
    if left and not (ended.code in (3, 5, 130, -2, -15, -1, 143, 129) and all(name.endswith(".failed.vtu") for name in left)):
        return "leftovers", f"{left}; exit {ended.code}: {ended.err}"
    for name, data in trial.inputs.items():
        if name not in trial.outputs and ended.files.get(name) != data:
            return "an input changed", name
    if ended.code == 0:
        for name in trial.outputs:
            if ended.files.get(name, OLD) == OLD:
                return "success without its result", f"{name}: {ended.err}"
            if bad := bad_numbers(name, ended.files[name]):
                return "not finite", bad
    elif ended.code != 4 and not trial.small_disk:
        for name in trial.outputs:
            if name.endswith(".csv") and ended.code not in (1, 2):
                continue  # the books so far of a timed run
            if ended.files.get(name) not in (OLD, trial.inputs.get(name)):
                return "a failed run replaced a result", f"{name}; exit {ended.code}: {ended.err}"
    return "", ""


def folder_for(prefix):
    return tempfile.mkdtemp(prefix=f"flexel-{prefix}-")

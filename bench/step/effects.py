#!/usr/bin/python3
"""Prints what each effect adds to a step, an element: instructions (callgrind: exact), nanoseconds (processor time of one thread,
medians of five) and bytes of memory (the process's peak), over a scene that names none; then the hot loop's variants and what they
cost to build. Writes it into docs/measurements/effects.md.

    PATH=build/release/bin:$PATH bench/step/effects.py
"""

import os
import pathlib
import re
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time

SOURCE = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(SOURCE / "tests" / folder) for folder in ("interop", "programs")]
from instructions import BETWEEN_PARTS, EFFECTS, make_block, make_pair, of_a_step, pair_command, simulate_command  # noqa: E402

COUNTED_CELLS, TIMED_CELLS, TIMED_STEPS, REPEATS = 16, 46, 100, 5
ROWS = {"nothing": ("", ()), **{name: (text, ()) for name, text in EFFECTS.items()}, "`--history`, a row in 10 steps":
        ("history_every = \"100 us\"\n", ("--history", "history.csv"))}


def processor_seconds(command):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, check=True, timeout=120)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def nanoseconds(elements, model):
    """Of a step, an element, by row; the rows take turns, so that what else the machine does meets all of them."""
    taken = {row: [] for row in ROWS}
    for _ in range(REPEATS):
        for row, (effect, options) in ROWS.items():
            short = processor_seconds(simulate_command(TIMED_STEPS, effect, model, options))
            long = processor_seconds(simulate_command(2 * TIMED_STEPS, effect, model, options))
            taken[row].append((long - short) / TIMED_STEPS / elements * 1e9)
    return {row: statistics.median(values) for row, values in taken.items()}


def peak_memory(command):
    """Bytes of the process at most, all of it: reading the body, the run, writing."""
    process = subprocess.Popen(command)
    _, status, usage = os.wait4(process.pid, 0)
    if status != 0:
        sys.exit("effects.py: a run failed")
    return 1024 * usage.ru_maxrss


def costs():
    elements = make_block(COUNTED_CELLS)
    instructions = {row: sum(of_a_step(lambda steps, e=effect, o=options: simulate_command(steps, e, "cells", o)).values()) / elements
                    for row, (effect, options) in ROWS.items()}
    elements = make_block(TIMED_CELLS)
    memory = {row: peak_memory(simulate_command(10, scene[0], "cells", scene[1])) / elements for row, scene in ROWS.items()}
    taken = nanoseconds(elements, "cells")
    lines = ["| the scene names | instructions | ns | memory, bytes |", "|---|---|---|---|",
             f"| nothing | {instructions['nothing']:.0f} | {taken['nothing']:.1f} | {memory['nothing']:.0f} |"]
    for row in list(ROWS)[1:]:
        lines.append(f"| {row} | {instructions[row] - instructions['nothing']:+.1f} | {taken[row] - taken['nothing']:+.1f} |"
                     f" {memory[row] - memory['nothing']:+.0f} |")
    return lines


def instructions_of(command_for, elements):
    return sum(of_a_step(command_for).values()) / elements


def models():
    """Instructions of the other models; what a model refuses is left out."""
    lines = ["| the scene names | `cells` | `springs` | `paper` |", "|---|---|---|---|"]
    rows = {}
    for model in ("cells", "springs", "paper"):
        elements = make_block(COUNTED_CELLS, "centre" if model == "paper" else "corner")
        for row, effect in {"nothing": "", **EFFECTS}.items():
            try:
                rows.setdefault(row, []).append(instructions_of(lambda steps, e=effect, m=model: simulate_command(steps, e, m), elements))
            except subprocess.CalledProcessError:
                rows.setdefault(row, []).append(None)
    for row, found in rows.items():
        told = ["refused" if each is None else f"{each:.0f}" if row == "nothing" else f"{each - bare:+.1f}" for each, bare in zip(found, rows["nothing"])]
        lines.append(f"| {row} | {' | '.join(told)} |")
    return lines


def between_parts():
    elements = make_pair(COUNTED_CELLS)
    lines = ["| two blocks, one on the other | instructions | memory, bytes |", "|---|---|---|"]
    bare, room = instructions_of(pair_command, elements), peak_memory(pair_command(10)) / elements
    lines.append(f"| that do not know of each other | {bare:.0f} | {room:.0f} |")
    for row in BETWEEN_PARTS:
        taken = instructions_of(lambda steps, r=row: pair_command(steps, r), elements)
        lines.append(f"| {row} | {taken - bare:+.1f} | {peak_memory(pair_command(10, row)) / elements - room:+.0f} |")
    return lines


def kernels(program):
    """The hot loop for each instruction set: variants a model, size of its code, seconds to compile."""
    build = program.resolve().parent.parent
    lines = ["| hot loop | variants a model | object file | compiled in |", "|---|---|---|---|"]
    for isa in ("portable", "avx2", "avx512"):
        target = f"simulate/CMakeFiles/flexel_kernel_{isa}.dir/kernels/kernel_table.cpp.o"
        if not (build / target).exists():
            continue
        command = subprocess.run(["ninja", "-C", build, "-t", "commands", "-s", target], check=True, stdout=subprocess.PIPE).stdout.decode()
        began = time.monotonic()
        subprocess.run(command.splitlines()[-1].replace(target, os.path.abspath("kernel.o")), shell=True, check=True, cwd=build, timeout=300,
                       env=dict(os.environ, CCACHE_DISABLE="1"))
        seconds = time.monotonic() - began
        listed = subprocess.run(["nm", "-C", "kernel.o"], check=True, stdout=subprocess.PIPE).stdout.decode()
        found = set(re.findall(r" [tT] .*\brun<[^\n]*::(\w+Model), ([^\n]*?)>\(", listed))
        counts = {model: sum(1 for m, _ in found if m == model) for model, _ in found}
        told = ", ".join(f"{model.removesuffix('Model').lower()} {n}" for model, n in sorted(counts.items()))
        lines.append(f"| {isa} | {told} | {os.path.getsize('kernel.o') / 1024:.0f} KiB | {seconds:.0f} s |")
    return [*lines, "", f"`flexel-simulate` is {os.path.getsize(program) / 2**20:.1f} MiB, as built (not stripped)."]


def main():
    program = shutil.which("flexel-simulate")
    if not program or not shutil.which("valgrind"):
        sys.exit("effects.py: needs flexel-simulate on the PATH, and valgrind")
    with tempfile.TemporaryDirectory(prefix="flexel-") as folder:
        os.chdir(folder)
        tables = "\n".join([*costs(), "", *models(), "", *between_parts(), "", *kernels(pathlib.Path(program))])
        os.chdir("/")
    print(tables)
    page = SOURCE / "docs/measurements/effects.md"
    before, _, rest = page.read_text(encoding="utf-8").partition("<!-- effects.py -->\n")
    _, _, after = rest.partition("<!-- end -->\n")
    page.write_text(f"{before}<!-- effects.py -->\n{tables}\n<!-- end -->\n{after}", encoding="utf-8")


if __name__ == "__main__":
    main()

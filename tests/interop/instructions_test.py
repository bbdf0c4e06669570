"""A step does only what the scene calls for: counted instruction by instruction, and seen in the programs' symbols."""

import os
import re
import subprocess

from instructions import EFFECTS, count, kernel_only, make_block, of_a_step, simulate_command

from harness import BIN, SOURCE, Skip, expect, main, need

CELLS = 12
STEPS = 100  # and twice as many: something is done every hundredth step
MOST_VARIANTS = 16  # of the hot loop, a model


def effects():
    """The classes in the list of effects."""
    text = (SOURCE / "simulate/scene/effects.cpp").read_text(encoding="utf-8")
    names = re.findall(r"^ +row<(\w+)>\(", text, re.M)
    expect(len(names) >= 6, f"no list of effects in simulate/scene/effects.cpp: {names}")
    return names


def symbols(program):
    return subprocess.run(["nm", "-C", BIN / program], check=True, stdout=subprocess.PIPE).stdout.decode()


def prepare():
    need("valgrind", "callgrind_annotate")
    os.environ["PATH"] = f"{BIN}:{os.environ['PATH']}"
    make_block(CELLS)


def of_effects(counted):
    """What was counted in effects, in the damped variants of the hot loop, or in what serves effects."""
    names = "|".join([*effects(), "PrescribedMotion", "EnergyHistory"])
    return {f: n for f, n in counted.items() if re.search(rf"flexel::simulate::({names})::|ActiveEffect::|Damping\)[12]|Composition\{{[^}}]", f)}


def test_a_step_runs_what_the_scene_names_and_no_other_effect():
    """A run under valgrind takes some seconds before its first step, so one test counts each once."""
    prepare()
    bare = of_a_step(simulate_command, STEPS)
    expect(sum(kernel_only(bare).values()) > 100 * CELLS**3, f"the hot loop is not where it was: {bare}")
    found = of_effects(bare)
    # what serves effects may be asked once a step whether there is anything, but nothing is done for every element
    expect(sum(found.values()) < 0.05 * CELLS**3, f"instructions a step: {found}")
    damped = count(simulate_command(STEPS, EFFECTS["`[damping]`"]))
    expect(sum(of_effects(damped).values()) > 100 * CELLS**3 * STEPS, "damping leaves no trace: the test sees nothing")
    pushed = of_effects(count(simulate_command(STEPS, EFFECTS["`[[load]]` with a course"])))
    expect(sum(n for f, n in pushed.items() if "flexel::simulate::Loads::add_forces" in f) > CELLS**2 * STEPS, "a load leaves no trace: the test sees nothing")
    without_effects(kernel_only(bare))


def without_effects(with_all):
    """A program without effects steps with the same instructions."""
    if not (BIN / "bare_step").exists():
        raise Skip("built without FLEXEL_BENCH: no bare_step")
    names, bare_step, simulate = effects(), symbols("bare_step"), symbols("flexel-simulate")
    linked = [name for name in names if f"flexel::simulate::{name}::" in bare_step]
    expect(not linked, f"bare_step has effects in it: {linked}")
    missing = [name for name in names if f"flexel::simulate::{name}::" not in simulate]
    expect(not missing, f"flexel-simulate lacks effects: {missing}")
    without = kernel_only(of_a_step(lambda steps: [str(BIN / "bare_step"), "block.vtu", str(steps)], STEPS))
    print({f: round(n / (CELLS + 1)**3, 3) for f, n in without.items()})
    expect(with_all == without, f"instructions of a step, with effects in the program: {with_all}\nwithout: {without}")


def test_the_hot_loop_has_few_variants():
    listed = symbols("flexel-simulate")
    for model in ("CellsModel", "SpringsModel", "ConnectionsModel"):
        found = set(re.findall(rf"run<flexel::simulate::step::\(anonymous namespace\)::{model}, ([^\n]*?)>\(", listed))
        print(model, len(found))
        expect(1 <= len(found) <= MOST_VARIANTS, f"{model} has {len(found)} variants: {found}")


if __name__ == "__main__":
    main(globals())

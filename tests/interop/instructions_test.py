"""A step does only what the scene calls for: counted instruction by instruction, and seen in the programs' symbols."""

import os
import re
import subprocess

from instructions import EFFECTS, kernel_only, make_block, of_a_step, simulate_command

from harness import BIN, SOURCE, Skip, expect, main, need

CELLS = 12
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


def bare():
    counted = of_a_step(simulate_command)
    expect(sum(kernel_only(counted).values()) > 100 * CELLS**3, f"the hot loop is not where it was: {counted}")
    return counted


def of_effects(counted):
    """What was counted in effects, in the damped variants of the hot loop, or in what serves effects."""
    names = "|".join([*effects(), "PrescribedMotion", "EnergyHistory"])
    return {f: n for f, n in counted.items() if re.search(rf"flexel::simulate::({names})::|ActiveEffect::|Damping\)[12]|Composition\{{[^}}]", f)}


def test_a_bare_step_runs_nothing_of_any_effect():
    prepare()
    found = of_effects(bare())
    # what serves effects may be asked once a step whether there is anything, but nothing is done for every element
    expect(sum(found.values()) < 0.05 * CELLS**3, f"instructions a step: {found}")


def test_naming_an_effect_adds_its_own_instructions():
    prepare()
    before = bare()
    damped = of_a_step(lambda steps: simulate_command(steps, EFFECTS["`[damping]`"]))
    expect(sum(of_effects(damped).values()) > 100 * CELLS**3, "damping leaves no trace: the test sees nothing")
    pushed = of_a_step(lambda steps: simulate_command(steps, EFFECTS["`[[load]]` with a course"]))
    expect(any("flexel::simulate::Loads::add_forces" in f for f in of_effects(pushed)), "a load leaves no trace: the test sees nothing")
    expect(sum(pushed.values()) > sum(before.values()), "a load that varies costs nothing")


def test_a_program_without_effects_steps_with_the_same_instructions():
    prepare()
    if not (BIN / "bare_step").exists():
        raise Skip("built without FLEXEL_BENCH: no bare_step")
    linked = [name for name in effects() if f"flexel::simulate::{name}::" in symbols("bare_step")]
    expect(not linked, f"bare_step has effects in it: {linked}")
    missing = [name for name in effects() if f"flexel::simulate::{name}::" not in symbols("flexel-simulate")]
    expect(not missing, f"flexel-simulate lacks effects: {missing}")
    with_all = kernel_only(bare())
    without = kernel_only(of_a_step(lambda steps: [str(BIN / "bare_step"), "block.vtu", str(steps)]))
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

"""`flexel deform --accuracy` and `--within`: what they choose, and what they say of it."""

import json

from harness import binary_stl, box_triangles, expect, expect_error, expect_ok, main, run, scene, write


def beam():
    write("beam.stl", binary_stl(box_triangles((60, 20, 20))))
    return ["beam.stl", "--material", "steel", "--fix", "xmin", "--push", "xmax: 0 0 -100 N"]


def deform(options, name="out.stl"):
    done = expect_ok(run("flexel", "deform", *options, "--summary", "s.json", "-o", name))
    with open("s.json", encoding="utf-8") as file:
        return json.load(file), done.err


def test_accuracy_is_the_run_of_its_size():
    """The result is that of the size that is said, to the last bit; and a finer run agrees."""
    options = beam()
    summary, said = deform([*options, "--accuracy", "10%"])
    told = summary["accuracy"]
    expect(told["met"] and told["reached"] <= 0.1 and told["asked"] == 0.1, told)
    expect(told["sentence"] in said, said)
    words = told["sentence"].split()
    size = words[words.index("--size") + 1]
    method = words[words.index("--method") + 1].rstrip(";")
    again, _ = deform([*options, "--size", size, "--method", method], "again.stl")
    with open("out.stl", "rb") as one, open("again.stl", "rb") as other:
        expect(one.read() == other.read(), "another result than with its --size")
    moved = summary["simulate"]["largest_displacement"]
    expect(moved == again["simulate"]["largest_displacement"], "another displacement")
    fine, _ = deform([*options, "--size", f"{0.75 * told['size']} m", "--no-estimate"], "fine.stl")
    true = abs(moved / fine["simulate"]["largest_displacement"] - 1)
    expect(true < 0.05, f"{true} from a finer run")


def test_within():
    summary, said = deform([*beam(), "--within", "20s"])
    told = summary["accuracy"]
    runs = told["runs"]
    # How long the last run really takes is up to who else is busy here; that it was to end in time is not.
    expect(len(runs) > 1 and sum(run["seconds"] for run in runs[:-1]) + runs[-1]["predicted_seconds"] <= 20, told)
    expect(told["met"] == (told["seconds"] <= 20) and "--within 20s" in said, told)
    expect(runs[-1]["cells"] > 2 * runs[0]["cells"], told)


def test_what_cannot_be_reached_is_not_claimed():
    summary, said = deform([*beam(), "--accuracy", "0.001%", "--within", "0.5s"])
    told = summary["accuracy"]
    expect(not told["met"] and "NOT the 0.001 % asked for" in told["sentence"] and "warning" in said, told)


def test_refusals():
    options = [*beam(), "-o", "out.stl"]
    for extra, fragment in ((["--accuracy", "2%", "--size", "2 mm"], "--size"), (["--accuracy", "0%"], "above 0"),
                            (["--accuracy", "2"], "below 100"), (["--accuracy", "two"], "two"), (["--within", "0 s"], "above zero"),
                            (["--accuracy", "2%", "--no-estimate"], "error bars"),
                            (["--accuracy", "2%", "--placement", "centre"], "centre")):
        expect_error(run("flexel", "deform", *options, *extra), "flexel", fragment)
    timed = scene("timed.toml", 'material = "steel"\n[[fix]]\nwhere = "xmin"\n[run]\ntime = "1 s"\n')
    expect_error(run("flexel", "deform", "beam.stl", "--scene", timed, "--accuracy", "2%", "-o", "out.stl"), "flexel", "timed run")


if __name__ == "__main__":
    main(globals())

"""flexel study from the outside: its files, its page, its budget, and what it says recomputed from study.csv."""

import base64
import csv
import html.parser
import json
import math
import os
import pathlib
import re
import shutil
import signal
import statistics
import subprocess
import time

from browser import chromium
from browser_test import expect_silence
from harness import BIN, SCENE, box, expect, expect_error, expect_ok, expect_only, main, need, run, scene, write

TARGETS = [0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5]


def study_until(enough, *budgets, part="box.stl", scene_file=None):
    """With the first budget that is enough: on a busy machine a run takes many times as long. What it said, and that budget."""
    box()
    scene_file = scene_file or scene()
    for budget in budgets:
        result = expect_ok(run("flexel", "study", part, "--scene", scene_file, "--budget", budget, "-o", "study", timeout=110))
        if enough(rows_of()):
            return result, float(budget.split()[0])
    raise AssertionError(f"not enough runs in {budgets[-1]}: {[r['label'] for r in rows_of()]}")


def sizes(rows):
    return {r["label"] for r in rows if r["sweep"] == "resolution" and r["status"] == "ok"}


def rows_of(folder="study"):
    with open(f"{folder}/study.csv", encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def number(text):
    return float(text) if text else None


def two_digits(share):
    """fmt's {:.2g} of percent."""
    return f"{100 * share:.2g} %" if share < 0.995 else f"{100 * share:.0f} %"


def points(rows):
    """One a label: median time, largest memory, error; as the page has it."""
    result = {}
    for row in rows:
        if row["status"] == "ok":
            result.setdefault(row["label"], []).append(row)
    out = []
    for label, group in result.items():
        error = number(group[0]["error"])
        out.append({"label": label, "sweep": group[0]["sweep"], "size": float(group[0]["size [m]"]),
                    "seconds": statistics.median(float(r["wall [s]"]) for r in group),
                    "memory": max(float(r["memory [B]"]) for r in group), "error": error,
                    "uncertainty": number(group[0]["error uncertainty"])})
    return out


def people_seconds(seconds):
    if seconds < 1:
        return f"{1000 * seconds:.0f} ms"
    return f"{seconds:.1f} s" if seconds < 9.95 else f"{seconds:.0f} s"


def recomputed(rows):
    """The sentences, by their definition in docs/guide/study.md."""
    known = [p for p in points(rows) if p["sweep"] != "effect" and p["error"] is not None]
    bound = lambda p: p["error"] + p["uncertainty"]
    parts = {}
    for target in [0.01] + [t for t in TARGETS if t > 0.01]:
        within = [p for p in known if bound(p) <= target]
        if within:
            parts["target"] = target
            parts["chosen"] = min(within, key=lambda p: p["seconds"])
            break
    ladder = [p for p in known if p["sweep"] == "resolution" and p["error"] > p["uncertainty"]]
    parts["tenfold"] = None
    if len(ladder) > 1 and max(p["error"] for p in ladder) >= 2 * min(p["error"] for p in ladder):
        xs = [-math.log10(p["error"]) for p in ladder]
        ys = [math.log10(p["seconds"]) for p in ladder]
        mx, my = statistics.mean(xs), statistics.mean(ys)
        slope = sum((x - mx) * (y - my) for x, y in zip(xs, ys)) / sum((x - mx) ** 2 for x in xs)
        parts["tenfold"] = 10**slope if slope > 0 else None
    return parts


class Page(html.parser.HTMLParser):
    """Checks that tags nest, and collects what the page would fetch."""

    VOID = {"meta", "link", "img", "br", "hr", "input"}

    def __init__(self):
        super().__init__()
        self.open, self.fetched, self.sentences, self.scripts, self.ids = [], [], [], 0, []
        self.sentence = False

    def handle_starttag(self, tag, attributes):
        if tag not in self.VOID:
            self.open.append(tag)
        self.note(tag, attributes)

    def handle_startendtag(self, tag, attributes):
        self.note(tag, attributes)

    def note(self, tag, attributes):
        self.scripts += tag == "script"
        for name, value in attributes:
            if name in ("src", "href", "xlink:href", "data", "srcset") and not value.startswith(("data:", "#")):
                self.fetched.append(value)
            if name == "id":
                self.ids.append(value)
        if tag == "p":
            self.sentence = ("class", "sentence") in attributes
            if self.sentence:
                self.sentences.append("")

    def handle_endtag(self, tag):
        expect(self.open and self.open[-1] == tag, f"</{tag}> closes <{self.open[-1:]}> in line {self.getpos()}")
        self.open.pop()
        self.sentence = False

    def handle_data(self, data):
        if self.sentence:
            self.sentences[-1] += data


def parsed(folder="study"):
    page = Page()
    page.text = open(f"{folder}/study.html", encoding="utf-8").read()
    page.feed(page.text)
    page.close()
    expect(page.open == [], f"left open: {page.open}")
    return page


def viewer_of(page):
    """The page of the finest run, which is there unless a note says why not."""
    if "The page of the finest run was left out" in page.text:
        return []
    html = pathlib.Path("study/finest.html").read_text(encoding="utf-8")
    expect(html.startswith("<!DOCTYPE html>") and 'id="canvas"' in html, "a page of flexel view")
    return ["finest.html"]


def errors_follow_from_values_and_references():
    references = {r["name"]: r for r in json.load(open("study/study.json"))["references"]}
    expect([n for n, r in references.items() if r["decides"]] == ["tip"], f"the probe counts: {references}")
    tip = references["tip"]
    checked = 0
    for row in rows_of():
        expect(bool(row["error"]) == (row["status"] == "ok" and not tip["doubt"]), f"no error without a reference: {row}")
        if row["error"]:
            error = abs(float(row["tip [m]"]) - tip["value"]) / abs(tip["value"])
            expect(abs(error - float(row["error"])) < 1e-6, f"{error} {row}")
            stages = sum(float(v) for k, v in row.items() if k.endswith(" stage [s]"))
            expect(abs(stages / float(row["wall [s]"]) - 1) < 0.05, f"every second has its stage: {row}")
            checked += 1
    expect(checked >= 3, "rows were compared")
    # Euler and Bernoulli and some shear, as in flexel_test.py: an extrapolation that is near the truth.
    expect(11.5e-6 < tip["value"] < 14.5e-6, f"{tip}")


def test_the_page_says_what_the_table_holds():
    """And is one file that a browser opens, made within its budget; a study that cannot begin leaves it as it is."""
    result, budget = study_until(lambda rows: len(sizes(rows)) >= 3, "12 s", "40 s")
    expect_only("study.csv", "study.html", "study.json", *viewer_of(parsed()), folder="study")
    expect_the_budget_is_kept(budget)
    expect_one_file()
    expect_a_browser_prints_it()
    expect_the_finest_run_is_shown()
    errors_follow_from_values_and_references()
    rows, page, summary = rows_of(), parsed(), json.load(open("study/study.json"))
    expect(page.sentences == summary["sentences"], f"{page.sentences} {summary['sentences']}")
    expect(all(s in result.err for s in page.sentences), result.err)
    again = recomputed(rows)
    said = " ".join(page.sentences)
    if "chosen" in again:
        chosen = again["chosen"]
        found = re.search(r"For (\S+) % use --size ([0-9.]+)(mm|um).*?: (.+?), ([0-9.,]+ [kMG]?B)\.", said)
        expect(found, f"no size is named: {said}")
        expect(f"{found[1]} %" == two_digits(again["target"]), f"{found[0]}, wanted {again['target']}")
        size = float(found[2]) * (1e-3 if found[3] == "mm" else 1e-6)
        expect(abs(size / chosen["size"] - 1) < 0.01, f"{found[0]}, wanted {chosen}")
        expect(found[4] == people_seconds(chosen["seconds"]), f"{found[0]}, wanted {chosen}")
    else:
        expect("No run is known to be within 1 %" in said and "For " not in said, said)
    if again["tenfold"] is None:
        expect("do not tell" in said, said)
    else:
        told = float(re.search(r"accuracy costs (?:over )?([0-9.,]+) times", said)[1].replace(",", ""))
        expect(abs(told / again["tenfold"] - 1) < 0.06 or told == 10000, f"{told} {again['tenfold']}")
    expect_one_that_cannot_begin_leaves_it()


def expect_the_budget_is_kept(seconds):
    took = sum(float(row["wall [s]"]) for row in rows_of())
    expect(took < seconds, f"the runs fit into {seconds} s: {took} s")
    summary = json.load(open("study/study.json"))
    expect(summary["spent"] < seconds + 8, f"the page is within it too, but for what a busy machine takes: {summary['spent']} s")
    expect(summary["left_out"], "what did not fit is named")


def expect_one_file():
    page = parsed()
    expect(page.fetched == viewer_of(page) and page.scripts == 0, f"{page.fetched}")
    expect(len(page.ids) == len(set(page.ids)), "ids are unique")
    for outside in re.findall(r"url\(([^)]*)\)", page.text):
        expect(outside.strip("\"'").startswith(("#", "data:")), outside)
    for address in re.findall(r"https?://[^\"'\s>]*", page.text):
        expect(address.startswith("http://www.w3.org/"), f"only the names of XML namespaces: {address}")
    expect("prefers-color-scheme: dark" in page.text and "@media print" in page.text and "size: A4" in page.text, "styles")
    if shutil.which("gnuplot"):
        expect(page.text.count("<svg") >= 2, "displacement against size, and where the time goes")
    for picture in re.findall(r"data:image/png;base64,([A-Za-z0-9+/=]+)", page.text):
        expect(base64.b64decode(picture, validate=True).startswith(b"\x89PNG\r\n"), "a picture is a PNG")
    expect(len(page.text) < 900_000, f"{len(page.text)} bytes")


def expect_the_finest_run_is_shown():
    if not shutil.which("chromium") or not shutil.which("chromedriver"):
        return
    for name in viewer_of(parsed()):
        with chromium() as viewer:
            viewer.open(pathlib.Path("study", name).resolve().as_uri())
            names = viewer.run("return flexelView.picture.names")
            expect("displacement" in names and "stress" in " ".join(names), f"the finest run with what it has: {names}")
            viewer.choose("colour", "displacement")
            seen = viewer.picture()
            expect(seen["share"] > 0.02 and seen["colours"] > 20, f"it is drawn: {seen}")
            expect_silence(viewer)


def expect_a_browser_prints_it():
    browser = next((shutil.which(name) for name in ("chromium", "chromium-browser", "google-chrome") if shutil.which(name)), None)
    if browser is None:
        return
    done = subprocess.run([browser, "--headless", "--no-sandbox", "--disable-gpu", "--enable-logging=stderr", "--v=0",
                           "--host-resolver-rules=MAP * ~NOTFOUND", "--user-data-dir=profile", "--print-to-pdf=page.pdf",
                           pathlib.Path("study/study.html").resolve().as_uri()], stderr=subprocess.PIPE, timeout=90, check=False)
    said = done.stderr.decode(errors="replace")
    expect(done.returncode == 0 and "CONSOLE" not in said and "ERR_NAME_NOT_RESOLVED" not in said, said)
    pdf = pathlib.Path("page.pdf").read_bytes()
    boxes = {tuple(round(float(v)) for v in m.split()) for m in re.findall(rb"/MediaBox\s*\[([^\]]*)\]", pdf)}
    expect(boxes and all(abs(b[2] - 595) <= 2 and abs(b[3] - 842) <= 2 for b in boxes), f"A4: {boxes}")


def expect_one_that_cannot_begin_leaves_it():
    before = {p.name: p.read_bytes() for p in pathlib.Path("study").iterdir()}
    write("broken.stl", "solid x\nfacet\n")
    expect_error(run("flexel", "study", "broken.stl", "--scene", "scene.toml", "-o", "study"), "flexel", "broken.stl")
    expect_error(run("flexel", "study", "box.stl", "--scene", "scene.toml", "--budget", "10 ms", "-o", "study"), "flexel", "--budget")
    expect(before == {p.name: p.read_bytes() for p in pathlib.Path("study").iterdir()}, "what was there is there")


def test_an_interrupt_keeps_the_rows():
    box()
    process = subprocess.Popen([str(BIN / "flexel"), "study", "box.stl", "--scene", scene(), "--budget", "100 s", "-o", "study"],
                               stderr=subprocess.PIPE)
    table = pathlib.Path("study/study.csv")
    for _ in range(900):
        if table.exists() and len(table.read_text().splitlines()) >= 4:
            break
        time.sleep(0.1)
    before = rows_of()
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=60)
    expect(process.returncode == 130, f"{process.returncode} {err}")
    after = rows_of()
    expect(len(after) >= len(before) >= 3, f"{len(before)} {len(after)}")
    for old, new in zip(before, after):
        expect(old["label"] == new["label"] and old["wall [s]"] == new["wall [s]"], f"{old} {new}")
    expect_only("study.csv", "study.html", "study.json", folder="study")
    expect("interrupted" in parsed().text, "the page says so")
    left = subprocess.run(["pgrep", "-f", os.getcwd()], stdout=subprocess.PIPE, check=False).stdout.decode().split()
    expect([p for p in left if p != str(os.getpid())] == [], f"no program is left running: {left}")


def test_a_study_that_is_stopped_leaves_the_earlier_one():
    box()
    os.mkdir("study")
    earlier = {name: f"earlier {name}\n" for name in ("study.csv", "study.json", "study.html", "study-scene.toml")}
    for name, text in earlier.items():
        pathlib.Path("study", name).write_text(text)
    command = ("flexel", "study", "box.stl", "--material", "steel", "--fix", "xmin", "--push", "xmax: 0 0 -10 N", "--budget", "100 s", "-o",
               "study", "--timeout", "3 s")
    expect_error(run(*command), "flexel", "stopped by --timeout", code=5)
    expect_only(*earlier, folder="study")
    for name, text in earlier.items():
        expect(pathlib.Path("study", name).read_text() == text, f"{name} is not the earlier one")
        os.remove(f"study/{name}")
    expect_error(run(*command), "flexel", "stopped by --timeout", code=5)
    expect_only(folder="study")


def test_timed_runs_have_drift_and_lag():
    write("timed.toml", SCENE + "[run]\ntime = \"5 us\"\n")
    study_until(lambda found: {"integrator", "step"} <= {r["sweep"] for r in found}, "20 s", "50 s", "95 s", scene_file="timed.toml")
    # Without the load nothing moves, and there is no energy to compare with.
    rows = [r for r in rows_of() if r["status"] == "ok" and not r["without"]]
    expect(len(rows) > 3 and all(r["tip peak [m]"] and float(r["energy drift"]) >= 0 for r in rows), "drift and peak in each row")
    expect(any(r["lag [s]"] for r in rows), "the phase")


def test_calculix_stands_beside():
    """Its points are in the table, the plot and on the page, and on a plain box it agrees with Flexel."""
    need("gmsh", "ccx")
    box()
    for budget in ("16 s", "70 s"):  # on a busy machine a run takes many times as long
        result = expect_ok(run("flexel", "study", "box.stl", "--scene", scene(), "--budget", budget, "-o", "study", "--against", "calculix",
                               timeout=110))
        theirs = [r for r in rows_of() if r["sweep"] == "calculix" and r["status"] == "ok"]
        if len({r["label"] for r in theirs}) >= 2:
            break
    expect(len({r["label"] for r in theirs}) >= 2, f"two meshes at least: {theirs} {result.err}")
    for row in theirs:
        expect(float(row["reaction xmin [N]"]) - 100 < 0.01, f"the load is held: {row}")
        expect(abs(float(row["tip [m]"]) / 12.9e-6 - 1) < 0.12, f"Euler and Bernoulli and some shear: {row}")
        expect(float(row["largest displacement [m]"]) >= 0.999 * float(row["tip [m]"]), f"{row}")
        expect(int(row["cells"]) > 10 and int(row["elements"]) > int(row["cells"]), f"nodes of C3D10: {row}")
        stages = sum(float(v) for k, v in row.items() if k.endswith(" stage [s]"))
        expect(abs(stages / float(row["wall [s]"]) - 1) < 0.05 and float(row["solve stage [s]"]) > 0, f"{row}")
        expect(float(row["memory [B]"]) > 1e6 and float(row["predicted wall [s]"]) > 0 and row["error"], f"{row}")
    summary, page = json.load(open("study/study.json")), parsed()
    told = summary["against"]
    expect(told["refused"] == "" and "CalculiX" in told["versions"] and "gmsh" in told["versions"], f"{told}")
    (tip,) = [q for q in told["quantities"] if q["name"] == "tip"]
    (ours,) = [r for r in summary["references"] if r["name"] == "tip"]
    agrees = abs(tip["value"] - ours["value"]) <= tip["uncertainty"] + ours["uncertainty"]
    expect(tip["agrees"] == agrees and tip["decides"], f"{tip} {ours}")
    expect(agrees != any("differ in \"tip\"" in note for note in summary["notes"]), f"{summary['notes']}")
    expect({"reaction xmin", "largest displacement"} <= {q["name"] for q in told["quantities"]}, f"{told}")
    expect("Beside CalculiX" in page.text and any("CalculiX" in s for s in page.sentences), f"{page.sentences}")
    if shutil.which("gnuplot"):
        expect("#8a5cd0" in page.text.lower() or "rgb(138, 92, 208)" in page.text.replace("138,  92", "138, 92"), "its colour is in the plot")
    # It takes no part in what the page says of Flexel.
    expect("CalculiX" not in page.sentences[0], f"{page.sentences}")


def test_what_is_not_installed_is_said():
    """One line, and the study goes on; a reference that is given goes before the extrapolation."""
    box()
    environment = dict(os.environ, PATH="/nowhere")
    result = expect_ok(run("flexel", "study", "box.stl", "--scene", scene(), "--budget", "8 s", "-o", "study", "--against", "calculix",
                           "--reference", "tip=13 um", env=environment, timeout=110))
    expect("CalculiX is left out" in result.err and "ccx is not installed" in result.err, result.err)
    expect("gnuplot is not installed" in result.err and "gnuplot-nox" in result.err, result.err)
    expect("ccx is not installed" in parsed().text and "gnuplot-nox" in parsed().text, "the page says it too")
    expect(not [r for r in rows_of() if r["sweep"] == "calculix"], "no row")
    (tip,) = [r for r in json.load(open("study/study.json"))["references"] if r["name"] == "tip"]
    expect(tip["value"] == 13e-6 and tip["uncertainty"] == 0 and tip["from"] == "given", f"{tip}")


def test_a_scene_that_calculix_cannot_run_is_said():
    need("gmsh", "ccx")
    write("timed.toml", SCENE + "[run]\ntime = \"40 us\"\n")
    result = expect_ok(run("flexel", "study", box(), "--scene", "timed.toml", "--budget", "8 s", "-o", "study", "--against", "calculix",
                           timeout=110))
    expect("CalculiX is left out" in result.err and "time" in result.err, result.err)
    expect(json.load(open("study/study.json"))["against"]["refused"] in parsed().text.replace("&quot;", '"'), "the page says why")


def test_bad_arguments_are_refused_at_once():
    box()
    scene()
    good = ["box.stl", "--scene", "scene.toml", "-o", "study"]
    write("wrong.toml", "material = \"steel\"\n[[fxi]]\n")
    write("not.json", "{}")
    for arguments, words in ((["box.stl", "-o", "study"], ["--scene"]),
                             ([*good[:3]], ["--output"]),
                             (["no.stl", *good[1:]], ["no.stl"]),
                             (["box.stl", "--scene", "wrong.toml", "-o", "study"], ["wrong.toml:2", "fxi"]),
                             ([*good, "--budget", "5"], ["unit", "time"]),
                             ([*good, "--budget", "-5 s"], ["--budget"]),
                             ([*good, "--budget", "0 s"], ["--budget"]),
                             ([*good, "--budget", "nan s"], ["nan"]),
                             ([*good, "--against", "calculx"], ["calculx", "did you mean \"calculix\""]),
                             (["box.stl", "--scene", "no.toml", "-o", "study"], ["no.toml"]),
                             (["box.stl", "--scene", "scene.toml", "-o", "/proc/study"], ["/proc/study"]),
                             (["box.stl", "--scene", "scene.toml", "-o", "/proc"], ["/proc"]),
                             (["box.stl", "--scene", "scene.toml", "-o", "/dev/full"], ["/dev/full", "folder"]),
                             ([*good, "--reference", "tpi=1 mm"], ["tpi", "did you mean \"tip\""]),
                             ([*good, "--reference", "tip=1 N"], ["N"]),
                             ([*good, "--reference", "not.json"], ["not.json", "summary"]),
                             (["box.stl", "--scene", "scene.toml", "-o", "scene.toml"], ["scene.toml", "folder"]),
                             (["-", "--scene", "scene.toml", "-o", "study"], ["stdin"])):
        expect_error(run("flexel", "study", *arguments), "flexel", *words)
    expect(not list(pathlib.Path(".").glob("study/.flexel*")), "nothing is left")


if __name__ == "__main__":
    main(globals())

"""What a run found, kept in a folder, and docs/measurements/hard-cases.md made of it."""

import json
import pathlib
import re
import shutil
import subprocess
import sys

from world import BIN

TITLES = {"stiffness": "Stiffness", "stepping": "Time and scale", "motion": "Motion", "contact": "Contact", "divisions": "Division by zero",
          "fracture": "Matter that goes"}
WORDS = {"ok": "holds", "KNOWN": "**does not hold yet**", "FAILS": "**FAILS**"}
HEAD = """# Hard cases

Cases that break simulations, as a suite of crash tests: `tests/hard`. Each runs with every model and every integrator that claims it, and beside what the
table says these hold in each: every number finite; J > 0; the books of energy closed (to 0.1 % of their largest term where nothing else is said) and the momenta of
free bodies kept to 1e-9; the same bytes at 1, 2 and 7 threads; the same answer where part and scene are written in inches, pounds-force and minutes; the mirrored
scene gives the mirrored answer. Explicit Euler, which gains energy by itself, may stop. Where a case cannot be solved the run stops with exit code 3, one line
with step, time, place and a suggestion, and the last good state on disk, which `flexel-map` reads.

```text
tools/check --hard                 all cases, a line each with its figure; the same cases in CalculiX, LAMMPS and Bullet
tests/hard/run.py motion           one family
tools/check                        has the quick half among its tests (hard.FAMILY.CASE)
tests/hard/run.py --write-docs     this page, from the last whole runs
```

"Off" is relative to the exact answer that the case names. "stops" is a stop as above.
"""


def picture(verdict, path):
    """The case's picture or plot as a PNG; a failure to draw is told and no more."""
    if verdict.plot is not None:
        x, y, label, other = verdict.plot
        data = path.with_suffix(".dat")
        data.write_text("\n".join(f"{a:.9g} {b:.9g}" for a, b in zip(x, y)) + "\n", encoding="ascii")
        script = (f"set terminal pngcairo size 480,360 font 'DejaVu Sans,9'; set output '{path}'; set xlabel '{label}'; set ylabel '{other}'; unset key; "
                  f"plot '{data}' with lines lc rgb '#31688e'")
        done = subprocess.run(["gnuplot", "-e", script], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, check=False)
        data.unlink()
    elif verdict.picture is not None and pathlib.Path(verdict.picture[0]).exists():
        done = subprocess.run([str(BIN / "flexel"), "picture", str(verdict.picture[0]), "-o", str(path), "--size", "480x360", *verdict.picture[1]],
                              stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, check=False)
    else:
        return
    if done.returncode:
        print(f"       note: no picture: {done.stderr.decode(errors='replace').strip()[-200:]}")


def keep_result(verdict, folder):
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{verdict.case.family}-{verdict.case.key}"
    kept = {name: getattr(verdict, name) for name in ("word", "figures", "broken", "known", "notes", "peers", "seconds")}
    path.with_suffix(".json").write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")
    path.with_suffix(".png").unlink(missing_ok=True)
    picture(verdict, path.with_suffix(".png"))


def _cell(lines):
    return "<br>".join(re.sub(r"\s+", " ", line).replace("|", "\\|") for line in lines)


def _plain(text):
    """A message without the folders of this run."""
    return re.sub(r"(/[\w.-]+)+/", "", text)


def _row(case, kept, picture_path):
    verdict = [WORDS[kept["word"]]]
    verdict += [_plain(line)[:240] for line in kept["broken"] + kept["known"]]
    image = f'<img src="{picture_path}" width="240" alt="{case.name}">' if picture_path else ""
    return f"| **{case.name}** {image} | {case.holds} | {_cell(map(_plain, kept['figures']))} | {_cell(verdict)} | {case.breaks} | {_cell(map(_plain, kept['peers']))} |"


def _by_now(case, kept):
    """What a run found, judged by what is known now."""
    known = [line for line in kept["broken"] if line.split(": ")[0] in case.known]
    kept["known"] += known
    kept["broken"] = [line for line in kept["broken"] if line not in known]
    kept["word"] = "FAILS" if kept["broken"] else "KNOWN" if kept["known"] else kept["word"]
    return kept


def write_document(cases, folder, docs):
    pictures = docs / "pictures/hard"
    pictures.mkdir(parents=True, exist_ok=True)
    lines, missing, counts = [HEAD], [], {"ok": 0, "KNOWN": 0, "FAILS": 0}
    family = None
    for case in cases:
        if case.family != family:
            family = case.family
            lines.append(f"## {TITLES[family]}\n\n| case | what must hold | figure | verdict | what would break it | the same in a peer |\n|---|---|---|---|---|---|")
        path = folder / f"{case.family}-{case.key}"
        if not path.with_suffix(".json").exists():
            missing.append(f"{case.family}.{case.key}")
            continue
        kept = _by_now(case, json.loads(path.with_suffix(".json").read_text(encoding="utf-8")))
        counts[kept["word"]] += 1
        shown = None
        if path.with_suffix(".png").exists():
            shutil.copy(path.with_suffix(".png"), pictures / f"{case.key}.png")
            shown = f"../pictures/hard/{case.key}.png"
        lines.append(_row(case, kept, shown))
        if case is [c for c in cases if c.family == family][-1]:
            lines.append("")
    if missing:
        lines[0] += f"\nNot run to the end for this page, and not in the table: {', '.join(missing)}.\n"
    lines[0] += f"\n{counts['ok']} cases hold, {counts['KNOWN'] + counts['FAILS']} do not yet.\n"
    text = "\n".join(lines).rstrip() + "\n\n" + (pathlib.Path(__file__).parent / "defects.md").read_text(encoding="utf-8")
    (docs / "measurements/hard-cases.md").write_text(text, encoding="utf-8")
    if missing:
        print(f"run.py: these have not been run yet and are not in the table: {', '.join(missing)}", file=sys.stderr)
    return 1 if missing else 0

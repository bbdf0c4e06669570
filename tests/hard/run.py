#!/usr/bin/python3 -B
"""The hard cases: `tests/hard/run.py` runs them all and prints a line a case with its figure; exit code 1 where one fails.

    tests/hard/run.py [--quick] [--keep FOLDER] [CASE...]   CASE: a family, or family.case
    tests/hard/run.py --list [--quick]                      their names
    tests/hard/run.py --known                               what is known not to hold yet
    tests/hard/run.py --write-docs                          docs/measurements/hard-cases.md and its pictures, from what the last whole runs left

What a run of a case in full found, and its picture, goes to build/hard.
"""

import argparse
import os
import pathlib
import sys
import tempfile

SOURCE = pathlib.Path(__file__).resolve().parents[2]
os.environ.setdefault("FLEXEL_BIN", str(SOURCE / "build/release/bin"))
sys.path += [str(SOURCE / "tests/hard"), str(SOURCE / "tests/interop"), str(SOURCE / "tests/programs")]
sys.dont_write_bytecode = True

FAMILIES = ("stiffness", "stepping", "motion", "contact", "divisions", "fracture")


def chosen(words, quick):
    from suite import CASES
    for family in FAMILIES:
        __import__(family)
    cases = [case for case in CASES if case.quick or not quick]
    if words:
        wanted = [case for case in cases if case.family in words or case.key in words or f"{case.family}.{case.key}" in words]
        known = {name for case in CASES for name in (case.family, case.key, f"{case.family}.{case.key}")}
        for word in words:
            if word not in known:
                sys.exit(f"run.py: error: no case \"{word}\"; --list has their names")
        return wanted
    return cases


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("case", nargs="*")
    parser.add_argument("--quick", action="store_true", help="the quick half, without peers")
    parser.add_argument("--list", action="store_true")
    parser.add_argument("--known", action="store_true")
    parser.add_argument("--keep", help="leave every run's files in this folder")
    parser.add_argument("--write-docs", action="store_true", help="write docs/measurements/hard-cases.md from the last runs")
    options = parser.parse_args()
    cases = chosen(options.case, options.quick)
    if options.list:
        for case in cases:
            print(f"{case.family}.{case.key}")
        return 0
    if options.known:
        for case in cases:
            for what in dict.fromkeys(case.known.values()):
                sections = [section for section, why in case.known.items() if why == what]
                print(f"known failure: hard.{case.family}.{case.key}: {what} ({'; '.join(sections[:3])}{'; ...' if len(sections) > 3 else ''})")
        return 0
    if not pathlib.Path(os.environ["FLEXEL_BIN"], "flexel-simulate").exists():
        sys.exit(f"run.py: error: no flexel-simulate in {os.environ['FLEXEL_BIN']}; build first, or set FLEXEL_BIN")
    from document import keep_result, write_document
    from suite import run_case
    results = SOURCE / "build/hard"
    if options.write_docs:
        return write_document(cases, results, SOURCE / "docs")
    verdicts = []
    with tempfile.TemporaryDirectory(prefix="flexel-hard-") as temporary:
        folder = pathlib.Path(options.keep or temporary)
        for case in cases:
            verdict = run_case(case, folder, options.quick)
            verdicts.append(verdict)
            if not options.quick:
                keep_result(verdict, results)
            print(verdict.line, flush=True)
            for word, lines in (("fails", verdict.broken), ("known failure", verdict.known), ("note", verdict.notes), ("peer", verdict.peers)):
                for line in lines:
                    print(f"       {word}: {line}", flush=True)
    failed = sum(verdict.word == "FAILS" for verdict in verdicts)
    known = sum(verdict.word == "KNOWN" for verdict in verdicts)
    print(f"{len(verdicts) - failed - known} hold, {known} known failures, {failed} failed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())

"""docs/measurements/reliability.md says what was tried and holds together; SECURITY.md's limits lead somewhere."""

import re

from harness import SOURCE, expect, main

PAGE = SOURCE / "docs/measurements/reliability.md"


def number(text):
    return int(text.replace(",", ""))


def test_every_fuzzer_was_run_with_words_and_is_in_the_page():
    text = PAGE.read_text()
    for source in sorted((SOURCE / "tests/fuzz").glob("fuzz_*.cpp")):
        name = source.stem
        row = re.search(rf"^\| `{name}` \| [^|]+ \| ([\d,]+) \| ([\d,]+) \| [\d,-]+ \| [\d-]+ \| [\d,-]+ \|$", text, re.M)
        expect(row, f"{name} is not in {PAGE.name}: run tools/reliability")
        expect(number(row[1]) >= 20000 and number(row[2]) > 100, f"{name}: {row[0]}")
        binary = name in ("fuzz_answer", "fuzz_binding", "fuzz_checkpoint")
        expect(binary or (SOURCE / f"tests/fuzz/dictionaries/{name}.dict").exists(), f"{name} has no dictionary")


def test_the_sums_are_those_of_the_tables():
    text = PAGE.read_text()
    inputs, kills, calls = map(number, re.search(r"In all ([\d,]+) changed inputs, ([\d,]+) kills and ([\d,]+) failing calls", text).groups())
    rows = re.findall(r"^\| `fuzz_\w+` \| [^|]+ \| ([\d,]+) \| [\d,]+ \| ([\d,-]+) \|", text, re.M)
    fuzzed = sum(number(mutants) + number(led.replace("-", "0")) for mutants, led in rows)
    mutations = number(re.search(r"^\| mutation \| [^|]+ \| ([\d,]+) \|$", text, re.M)[1])
    expect(inputs == fuzzed + mutations, f"{inputs} changed inputs, {fuzzed} + {mutations} in the tables")
    failed = sum(number(n) for n in re.findall(r"^\| [a-z ]+ \| [\d,]+ \| ([\d,]+) \| [\d,]+ \|$", text, re.M))
    expect(calls == failed > 0, f"{calls} failing calls, {failed} in the table")
    expect(kills > 0, "no kills")


def test_every_finding_of_the_corpus_belongs_to_a_fuzzer():
    fuzzers = {source.stem for source in (SOURCE / "tests/fuzz").glob("fuzz_*.cpp")}
    for folder in (SOURCE / "tests/fuzz/corpus").iterdir():
        expect(folder.name in fuzzers, f"{folder.name} is no fuzzer")
        for file in folder.iterdir():
            expect(file.stat().st_size < 20000, f"{file} is large")


if __name__ == "__main__":
    main(globals())

"""docs/reference/messages.md: what each row says a program prints is still in the program's text."""

import re

from harness import SOURCE, expect, main

FOLDERS = ("base", "formats", "voxelize", "simulate", "distributed", "mapping", "cad", "flexel")


def literals():
    """The string literals of all sources, neighbours joined as the compiler joins them."""
    text = "\n".join(path.read_text(encoding="utf-8") for folder in FOLDERS for path in sorted((SOURCE / folder).rglob("*.cpp")))
    return re.sub(r'"\s*\n\s*"', "", text).replace('\\"', '"')


def windows(message):
    """All runs of three words without figures, names or quotes, which are the same in every run."""
    fixed = re.split(r'"[^"]*"|\([^)]*\)|[^\s]*[\d=/#][^\s]*|`', message)
    runs = [piece.strip(" ,;:.").split() for piece in fixed]
    return [" ".join(words[k:k + 3]) for words in runs for k in range(len(words) - 2)]


def test_every_message_of_the_table_is_still_said():
    rows = [line for line in (SOURCE / "docs/reference/messages.md").read_text(encoding="utf-8").splitlines() if line.startswith("| ")][1:]
    expect(len(rows) >= 30, f"{len(rows)} messages, 30 wanted")
    known = literals()
    for row in rows:
        message = re.split(r"(?<!\\)\|", row)[2].replace("\\|", "|")
        wanted = windows(message)
        expect(2 * sum(piece in known for piece in wanted) > len(wanted), f"no source says: {message.strip()}")


if __name__ == "__main__":
    main(globals())

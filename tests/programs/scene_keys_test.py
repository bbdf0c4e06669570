"""flexel scene-keys: the reference of scenes is what the program reads them with."""

from harness import SOURCE, expect, expect_error, main, run


def test_the_page_holds_the_tables():
    found = run("flexel", "scene-keys", "--markdown")
    expect(found.code == 0, found)
    page = (SOURCE / "docs/reference/scene-keys.md").read_text(encoding="utf-8")
    expect(found.out.decode() in page, "docs/reference/scene-keys.md is not what `flexel scene-keys --markdown` prints")


def test_text_and_words_hold_the_same():
    text = run("flexel", "scene-keys").out.decode()
    words = run("flexel", "scene-keys", "--words").out.decode().split("\n")
    expect("[[load]]" in words and "elongation" in words and "glue" in words, words)
    for word in words:
        expect(word in text, f"{word} is not in the text")
    expect_error(run("flexel", "scene-keys", "--words", "--markdown"), "flexel", "excludes")


if __name__ == "__main__":
    main(globals())

"""The page of flexel clay in Chromium, headless: a newcomer's way, a drag that is flexel deform's move, two tabs, a run that ends."""

import json
import os
import pathlib
import tarfile
import time

from browser import chromium
from browser_test import centre_of_face, expect_silence
from clay_test import clay, corners, farthest, saved
from harness import bracket, expect, expect_ok, main, run


def settle(browser):
    """All that was done has been sent, and a frame that has taken it is at rest."""
    browser.wait("""(({busy, waiting, sent, frame}) => !busy && waiting.length === 0 && frame && frame.settled &&
        sent.every(each => each.line <= frame.line))(flexelView.clay)""", 60)


def choose_hand(browser, mode):
    browser.run("document.querySelector(`input[name=hand][value=${arguments[0]}]`).click()", mode)


def download(browser, name):
    path = pathlib.Path(browser.folder) / "downloads" / name
    end = time.monotonic() + 40
    while not path.exists():
        expect(time.monotonic() < end, f"{name} is saved: {os.listdir(path.parent) if path.parent.exists() else 'nothing'} {browser.text('hands-said')}")
        time.sleep(0.1)
    time.sleep(0.2)
    return path.read_bytes()


def pressed(browser, label):
    """By the mouse: a page may save several files only where a hand asks for each."""
    browser.click(*browser.run("""
        const button = document.querySelector(`button[aria-label='${arguments[0]}']`);
        button.scrollIntoView({block: 'center'});
        const {left, top, width, height} = button.getBoundingClientRect();
        return [left + width / 2, top + height / 2];""", label))


def bent_by_hand(browser, url, along="any"):
    """Holds the wall side, drags the tip by 5 mm in the picture; where the mouse is, its button still down."""
    browser.open(url.geturl())
    browser.run("flexelView.picture.view.turn(-180, 0); flexelView.picture.fit()")
    browser.click(*centre_of_face(browser, "bracket/1"))
    browser.wait("flexelView.clay.frame.holds.includes('bracket/1')")
    browser.run("flexelView.controls.look('iso')")
    choose_hand(browser, "pull")
    browser.choose("along", along)
    x, y = centre_of_face(browser, "bracket/2")
    scale = browser.run("const {picture} = flexelView; return picture.pixelsPerMetre(picture.panels[0], picture.layout[0])")
    far = 0.005 * scale
    browser.mouse(("move", x, y), ("down",), ("move", x, y + far / 3), ("move", x, y + 2 * far / 3), ("move", x, y + far))
    settle(browser)
    browser.wait("flexelView.clay.frame.hand !== undefined")
    return x, y + far


def test_a_drag_is_the_move_of_flexel_deform():
    bracket()
    with clay("bracket.step", "--size", "4 mm", "--material", "PLA") as (url, _), chromium() as browser:
        x, y = bent_by_hand(browser, url)
        hand = browser.run("return flexelView.clay.frame.hand")
        expect(abs(sum(v * v for v in hand[:3]) ** 0.5 - 0.005) < 3e-4, f"the hand went 5 mm: {hand}")
        browser.mouse(("move", x, y), ("up",))
        settle(browser)
        frame = browser.run("const {positions, ...frame} = flexelView.clay.frame; return frame")
        feel = browser.text("feel")
        expect("N" in feel and "mm" in feel, f"the force is shown: {feel}")
        stl = saved(url, "part.stl")
        saved(url, "scene.toml")
        pressed(browser, "Save the part as it is now, as STL")
        expect(download(browser, "bracket-bent.stl") == stl, "the button saves the same")
        # The page moves its points where the mapping puts them.
        box = browser.run("""const {shape} = flexelView.picture.panels[0]; let low = 1e9;
            for (let p = 0; p < shape.count; ++p) low = Math.min(low, shape.restOf(p)[2] + shape.displacementOf(p, 0)[2]);
            return low;""")
        expect_silence(browser)
    expect_ok(run("flexel", "deform", "bracket.step", "--scene", "scene.toml", "--size", "4 mm", "-o", "deform.stl", "--summary", "summary.json", "--quiet"))
    data = pathlib.Path("deform.stl").read_bytes()
    apart = farthest(stl, data)
    expect(apart < 1e-3, f"the part is that of flexel deform within a micrometre: {apart}")
    expect(abs(1e3 * box - min(c[2] for c in corners(data))) < 0.03, "what is drawn is that within 0.03 mm")
    force = json.loads(pathlib.Path("summary.json").read_text())["simulate"]["reactions"][-1]["force"]
    expect(max(abs(a + b) for a, b in zip(force, frame["felt"][-1])) < 1e-4 * max(map(abs, force)), f"and so is the force: {force} {frame['felt']}")


def test_a_drag_along_an_axis_goes_nowhere_else():
    bracket()
    with clay("bracket.step", "--size", "5 mm") as (url, _), chromium() as browser:
        x, y = bent_by_hand(browser, url, "z")
        browser.mouse(("move", x, y), ("up",))
        settle(browser)
        place = browser.run("return flexelView.clay.frame.place[0]")
        expect(-0.008 < place[2] < -0.004 and max(map(abs, place[:2])) < 0.1 * abs(place[2]), f"along z: {place}")


def test_the_way_of_someone_new_by_keys():
    """From the STEP part to the bent STL by controls alone, each of which has a name."""
    bracket()
    with clay("bracket.step", "--size", "5 mm") as (url, _), chromium() as browser:
        browser.open(url.geturl())
        settle(browser)
        nameless = browser.run("""return [...document.querySelectorAll('#clay button, #clay input, #clay select')].filter(each =>
            !each.getAttribute('aria-label') && !each.textContent.trim() && !each.labels?.[0]?.textContent.trim()).map(each => each.id || each.outerHTML);""")
        expect(nameless == [], f"controls without a name: {nameless}")
        browser.choose("face", "bracket/1")
        browser.run("document.getElementById('face-hold').click()")
        browser.wait("flexelView.clay.frame.holds.includes('bracket/1')")
        browser.choose("face", "bracket/2")
        browser.run("document.getElementById('face-pull').click()")
        browser.wait("flexelView.clay.frame.tools.length === 1")
        browser.choose("lead-z", "-5")
        browser.run("document.getElementById('lead').click()")
        browser.wait("flexelView.clay.frame.place[0]?.[2] === -0.005 && flexelView.clay.frame.settled")
        first = browser.picture()
        pressed(browser, "Save the part as it is now, as STL")
        expect(len(download(browser, "bracket-bent.stl")) > 1000, "saved")
        browser.run("document.getElementById('undo').click()")
        browser.wait("flexelView.clay.frame.place[0]?.[2] === 0 && flexelView.clay.frame.settled")
        expect(browser.picture() != first, "undone, and seen")
        browser.run("document.getElementById('redo').click()")
        browser.wait("flexelView.clay.frame.place[0]?.[2] === -0.005 && flexelView.clay.frame.settled")
        browser.run("document.getElementById('keep').click()")
        browser.wait("flexelView.clay.frame.kept === 1 && flexelView.clay.frame.tools.length === 0")
        pressed(browser, "Save the scene that does the same without hands")
        pathlib.Path("scene.tar").write_bytes(download(browser, "bracket-scene.tar"))
        with tarfile.open("scene.tar") as files:
            expect(files.getnames() == ["rest.vtu", "scene-1.toml", "scene.toml"], f"{files.getnames()}")
            expect(b"renormalise" in files.extractfile("scene-1.toml").read(), "the scenes are whole")
        expect_silence(browser)


def test_two_tabs_and_the_end():
    bracket()
    with chromium() as browser:
        with clay("bracket.step", "--size", "5 mm") as (url, process):
            browser.open(url.geturl())
            first = browser.ask("GET", "/window")
            settle(browser)
            browser.ask("POST", "/window", {"handle": browser.ask("POST", "/window/new", {"type": "tab"})["handle"]})
            browser.open(url.geturl())
            browser.wait("!document.getElementById('watching').hidden")
            expect(browser.run("return document.getElementById('face-hold').disabled"), "who watches has no hands")
            browser.run("document.getElementById('take').click()")
            browser.wait("flexelView.clay.mine && !document.getElementById('face-hold').disabled")
            browser.choose("face", "bracket/1")
            browser.run("document.getElementById('face-hold').click()")
            browser.wait("flexelView.clay.frame.holds.length === 1")
            browser.ask("POST", "/window", {"handle": first})
            browser.wait("flexelView.clay.frame.holds.length === 1 && !document.getElementById('watching').hidden")
        browser.wait("document.getElementById('hands-said').innerText.includes('does not answer')")


if __name__ == "__main__":
    main(globals())

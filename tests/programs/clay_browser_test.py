"""The page of flexel clay in Chromium, headless: a newcomer's way, a drag that is flexel deform's move, two tabs, a run that ends."""

import json
import math
import os
import pathlib
import tarfile
import time

from browser import chromium
from browser_test import centre_of_face, expect_silence
from clay_test import clay, corners, expect_same_run, farthest, saved
from harness import ascii_stl, box_triangles, bracket, expect, expect_ok, main, run

WINDOW = (800, 560)  # every pixel is drawn by the processor


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
    with clay("bracket.step", "--size", "5 mm", "--material", "PLA") as (url, _), chromium(WINDOW) as browser:
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
    expect_ok(run("flexel", "deform", "bracket.step", "--scene", "scene.toml", "--size", "5 mm", "-o", "deform.stl", "--summary", "summary.json", "--no-estimate", "--quiet"))
    data = pathlib.Path("deform.stl").read_bytes()
    apart = farthest(stl, data)
    expect(apart < 1e-3, f"the part is that of flexel deform within a micrometre: {apart}")
    expect(abs(1e3 * box - min(c[2] for c in corners(data))) < 0.03, "what is drawn is that within 0.03 mm")
    force = json.loads(pathlib.Path("summary.json").read_text())["simulate"]["reactions"][-1]["force"]
    expect(max(abs(a + b) for a, b in zip(force, frame["felt"][-1])) < 1e-4 * max(map(abs, force)), f"and so is the force: {force} {frame['felt']}")


def test_a_drag_along_an_axis_goes_nowhere_else():
    bracket()
    with clay("bracket.step", "--size", "5 mm") as (url, _), chromium(WINDOW) as browser:
        x, y = bent_by_hand(browser, url, "z")
        browser.mouse(("move", x, y), ("up",))
        settle(browser)
        place = browser.run("return flexelView.clay.frame.place[0]")
        expect(-0.008 < place[2] < -0.004 and max(map(abs, place[:2])) < 0.1 * abs(place[2]), f"along z: {place}")


def test_the_way_of_someone_new_by_keys():
    """From the STEP part to the bent STL by controls alone, each of which has a name."""
    bracket()
    with clay("bracket.step", "--size", "5 mm") as (url, _), chromium(WINDOW) as browser:
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


def expect_drawn_as_saved(browser, url):
    """The page's triangles enclose what the saved STL does, now, and have its box; elements that are gone draw nothing."""
    browser.wait("!flexelView.clay.renewing && flexelView.clay.surface === flexelView.clay.frame.surface && !flexelView.clay.asked")
    drawn = browser.run("""
        const {shape} = flexelView.picture.panels[0], at = p => shape.restOf(p).map((x, k) => 1e3 * (x + shape.displacementOf(p, 0)[k]));
        const box = [[1e9, 1e9, 1e9], [-1e9, -1e9, -1e9]];
        let volume = 0, finite = true;
        for (let t = 0; t < shape.triangles.length; t += 3) {
          const [a, b, c] = [0, 1, 2].map(k => at(shape.triangles[t + k]));
          volume += (a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])) / 6;
          for (const corner of [a, b, c]) corner.forEach((x, k) => {
            finite &&= Number.isFinite(x);
            box[0][k] = Math.min(box[0][k], x);
            box[1][k] = Math.max(box[1][k], x);
          });
        }
        return {volume, box, finite, walls: shape.face.filter(face => flexelView.picture.panels[0].faceName(face).odd).length};""")
    places = corners(saved(url, "part.stl"))
    volume = sum(a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])
                 for a, b, c in zip(places[0::3], places[1::3], places[2::3])) / 6
    expect(drawn["finite"] and abs(drawn["volume"] / volume - 1) < 2e-3, f"{drawn} {volume}")
    for k in range(3):
        for end, of in ((0, min), (1, max)):
            expect(abs(drawn["box"][end][k] - of(p[k] for p in places)) < 0.05, f"{drawn['box']}")
    return drawn["volume"], drawn["walls"]


def test_a_ball_is_carved_out_by_a_click():
    """The drawn part, the saved STL and a run of the saved scene are the same; undone, the page has the whole part again."""
    bracket()
    with clay("bracket.step", "--size", "5 mm", "--material", "PLA") as (url, _), chromium(WINDOW) as browser:
        x, y = bent_by_hand(browser, url, "z")
        browser.mouse(("move", x, y), ("up",))
        settle(browser)
        whole, walls = expect_drawn_as_saved(browser, url)
        expect(walls == 0, "nothing is carved")
        bent = browser.run("return flexelView.clay.frame.felt[0][2]")
        browser.choose("ball", "7")
        choose_hand(browser, "carve")
        browser.click(*centre_of_face(browser, "bracket/3"))
        browser.wait("flexelView.clay.frame.surface !== 0", 60)
        settle(browser)
        volume, walls = expect_drawn_as_saved(browser, url)
        expect(volume < whole - 100 and walls > 10, f"a hole of some {whole - volume} mm3")
        expect(0 < browser.run("return flexelView.clay.frame.felt[0][2]") < bent, "and the part is weaker")
        frame = browser.run("const {positions, ...frame} = flexelView.clay.frame; return frame")
        expect_same_run(url, frame, ("--crack", "cap"))
        browser.run("document.getElementById('undo').click()")
        browser.wait("flexelView.clay.frame.surface === 0")
        settle(browser)
        expect(abs(expect_drawn_as_saved(browser, url)[0] / whole - 1) < 1e-6, "the part is whole again")
        expect_silence(browser)


WHOLE = "flexelView.clay.frame.surface === 0 && flexelView.clay.surface === 0 && !flexelView.clay.renewing"  # and drawn so: a hole is no place to click at


def gone_elements(browser):
    return browser.run("const p = flexelView.clay.frame.positions; return [...Array(p.length / 3).keys()].filter(e => Number.isNaN(p[3 * e]));")


def carve_by_hand(browser, *places):
    """A drag through places of the window; what was posted, and the elements that are gone then."""
    browser.run("""const {clay} = flexelView, post = clay.constructor.prototype.post;
        window.posted = [];
        clay.post = function (...lines) { posted.push(...lines); return post.apply(this, lines); };""")
    browser.mouse(("move", *places[0]), ("down",), *(("move", *place) for place in places[1:]), ("up",))
    settle(browser)
    return browser.run("return posted"), gone_elements(browser)


def test_a_drag_carves_without_gaps_however_fast_it_is():
    bracket()
    with clay("bracket.step", "--size", "4 mm", "--material", "PLA") as (url, _), chromium(WINDOW) as browser:
        x, y = bent_by_hand(browser, url, "z")
        browser.mouse(("move", x, y), ("up",))
        settle(browser)
        browser.run("flexelView.controls.look('top')")
        browser.choose("ball", "7")
        choose_hand(browser, "carve")
        at = lambda *place: browser.run("return flexelView.clay.worldPoint(arguments[0]).map(Math.round)", list(place))
        begin, middle, end = at(0.03, 0.012, 0.006), at(0.05, 0.03, 0.006), at(0.07, 0.012, 0.006)
        posted, fast = carve_by_hand(browser, begin, middle, end)
        expect(posted[0].startswith("carve from") and posted[-1] == "stay" and sum(line.startswith("carve from") for line in posted) == 1, f"one way: {posted}")
        places = [[float(number) for number in line.split()[2:5]] for line in posted[:-1]]
        expect(max(math.dist(a, b) for a, b in zip(places, places[1:])) <= 0.0071 and len(fast) > 15, f"without gaps: {len(fast)} {places}")
        frame = browser.run("const {positions, ...frame} = flexelView.clay.frame; return frame")
        expect(not frame["said"] and frame["felt"][0][2] > 0, f"the tool still pulls: {frame['said']} {frame['felt']}")
        expect_drawn_as_saved(browser, url)
        expect_same_run(url, frame, ("--crack", "cap"))
        browser.keys_with_control("z")
        browser.wait(WHOLE)
        expect(gone_elements(browser) == [], "one act")
        settle(browser)
        share = lambda a, b, k: tuple(p + (q - p) * k / 12 for p, q in zip(a, b))
        slow = carve_by_hand(browser, begin, *(share(begin, middle, k) for k in range(1, 13)), *(share(middle, end, k) for k in range(1, 13)))[1]
        odd = set(fast) ^ set(slow)
        expect(len(odd) <= 2, f"a slow hand carves the same: {len(odd)} of {len(fast)}")  # places are whole pixels
        browser.keys_with_control("z")
        browser.wait(WHOLE)
        # beside the part the ball is lifted, and comes down again: still one act
        posted, lifted = carve_by_hand(browser, begin, at(0.03, 0.046, 0.006), at(0.07, 0.046, 0.006), end)
        expect(sum(line.startswith("carve from") for line in posted) == 2 and 0 < len(lifted), f"{posted}")
        browser.keys_with_control("z")
        browser.wait(WHOLE)
        # undone while the button is down, by Ctrl+Z and by Escape: the rest of the drag does nothing
        for undo in (lambda: browser.keys_with_control("z"), lambda: browser.keys("\ue00c")):
            browser.mouse(("move", *begin), ("down",), ("move", *middle))
            browser.wait("flexelView.clay.frame.surface !== 0", 60)
            undo()
            browser.wait(WHOLE + " && !flexelView.clay.drag", 60)
            browser.mouse(("move", *end), ("up",))
            settle(browser)
            expect(gone_elements(browser) == [] and not browser.run("return flexelView.clay.frame.said"), "nothing is carved")
        expect_silence(browser, but="/save/surface-")  # one that another replaced on its way


def test_undo_amid_a_drag_ends_it():
    """The hand does not lead the tool before that was taken up earlier."""
    bracket()
    with clay("bracket.step", "--size", "5 mm", "--material", "PLA") as (url, _), chromium(WINDOW) as browser:
        browser.open(url.geturl())
        settle(browser)
        browser.run("flexelView.clay.post('hold bracket/1', 'grab at 0.04 0.02 0.006 0.005', '0 0 0 -0.0005', 'stay')")
        settle(browser)
        before = browser.run("return flexelView.clay.frame.place")
        choose_hand(browser, "pull")
        browser.run("flexelView.controls.look('iso')")
        for undo in (lambda: (browser.keys_with_control("z"), browser.wait("flexelView.clay.frame.redo"), browser.keys_with_control("z")), lambda: browser.keys("\ue00c")):
            x, y = centre_of_face(browser, "bracket/2")  # what was bent is drawn smaller
            browser.mouse(("move", x, y), ("down",))
            browser.wait("flexelView.clay.drag?.base")
            base = browser.run("return flexelView.clay.drag.base")
            browser.mouse(("move", x, y + 10), ("move", x, y + 20))
            browser.wait("flexelView.clay.frame.hand !== undefined")
            undo()
            browser.wait("flexelView.clay.frame.hand === undefined && !flexelView.clay.drag")
            browser.mouse(("move", x, y + 40), ("move", x, y + 60), ("up",))
            settle(browser)
            place = browser.run("return flexelView.clay.frame.place")
            expect(place[0] == before[0], f"the tool before is where it was: {place} {before}")
            expect(len(place) == 1 or max(abs(a - b) for a, b in zip(place[1], base)) < 1e-9, f"and so is what the drag led: {place}")
        expect_silence(browser)


def test_a_ball_pushes_where_it_is_dragged_and_a_plate_by_keys():
    bracket()
    with clay("bracket.step", "--size", "5 mm", "--material", "PLA") as (url, _), chromium(WINDOW) as browser:
        browser.open(url.geturl())
        settle(browser)
        browser.choose("face", "bracket/1")
        browser.run("document.getElementById('face-hold').click()")
        browser.wait("flexelView.clay.frame.holds.length === 1")
        browser.choose("ball", "6")
        browser.run("flexelView.controls.look('iso')")
        choose_hand(browser, "push-ball")
        expect(browser.run("return document.getElementById('along').value") == "in", "it goes into the face")
        x, y = centre_of_face(browser, "bracket/3")
        scale = browser.run("const {picture} = flexelView; return picture.pixelsPerMetre(picture.panels[0], picture.layout[0])")
        browser.mouse(("move", x, y), ("down",))
        browser.wait("flexelView.clay.drag?.base")
        browser.mouse(("move", x, y + 0.0005 * scale), ("move", x, y + 0.001 * scale), ("move", x, y + 0.0015 * scale), ("up",))
        settle(browser)
        frame = browser.run("const {positions, ...frame} = flexelView.clay.frame; return frame")
        place, felt = frame["place"][0], frame["felt"][0]
        expect(not frame["said"] and -0.003 < place[2] < -0.0005 and max(map(abs, place[:2])) < 0.01 * abs(place[2]) and felt[2] > 1, f"into the face: {frame['said']} {place} {felt}")
        expect_same_run(url, frame)
        expect_drawn_as_saved(browser, url)
        browser.choose("face", "bracket/3")
        browser.run("document.getElementById('undo').click()")
        browser.run("document.getElementById('undo').click()")
        browser.wait("flexelView.clay.frame.tools.length === 0")
        browser.run("document.getElementById('face-push-plate').focus()")
        browser.keys("\ue007")
        browser.wait("flexelView.clay.frame.shapes[0]?.kind === 'plate'")
        browser.choose("lead-z", "-1")
        browser.run("document.getElementById('lead').focus()")
        browser.keys("\ue007")
        browser.wait("flexelView.clay.frame.place[0]?.[2] === -0.001 && flexelView.clay.frame.settled", 60)
        frame = browser.run("const {positions, ...frame} = flexelView.clay.frame; return frame")
        expect(frame["felt"][0][2] > 1, f"it pushes: {frame['felt']}")
        expect_same_run(url, frame)
        expect_silence(browser)


def test_a_ball_is_carved_out_by_keys_and_a_page_that_comes_later_draws_it():
    bracket()
    with clay("bracket.step", "--size", "5 mm", "--material", "PLA") as (url, _), chromium(WINDOW) as browser:
        browser.open(url.geturl())
        settle(browser)
        whole, _ = expect_drawn_as_saved(browser, url)
        browser.choose("ball", "7")
        browser.choose("face", "bracket/2")
        place = browser.run("return ['x', 'y', 'z'].map(axis => Number(document.getElementById('at-' + axis).value))")
        expect(place[0] == 80 and 0 < place[1] < 40 and 0 < place[2] < 6, f"a place on the face: {place}")
        for axis, value in (("x", "40"), ("y", "20"), ("z", "6")):
            browser.choose(f"at-{axis}", value)
        browser.run("document.getElementById('carve').focus()")
        browser.keys("\ue007")
        browser.wait("flexelView.clay.frame.surface !== 0", 60)
        settle(browser)
        expect(expect_drawn_as_saved(browser, url)[0] < whole - 100, "carved by keys")
        expect(b"centre = [\"0.04" in saved(url, "scene.toml"), "where the numbers say")
        drawn = expect_drawn_as_saved(browser, url)
        browser.open(url.geturl())  # a page that comes later
        browser.wait("flexelView.clay.frame?.surface")
        expect(expect_drawn_as_saved(browser, url) == drawn, "a page that comes later draws the same")
        # what was carved has no face to hold; the page before has to have let the tool go
        browser.wait("flexelView.clay.mine", 60)
        choose_hand(browser, "hold")
        browser.run("flexelView.clay.toggleHold('bracket/carved')")
        browser.wait("document.getElementById('hands-said').innerText.includes('bracket/carved')")
        expect_silence(browser)


def test_parts_are_glued_and_painted():
    low = box_triangles((40.0, 10.0, 5.0))
    high = [[(x, y, z + 5.3) for x, y, z in triangle] for triangle in low]
    pathlib.Path("two.stl").write_bytes(ascii_stl(low, "low") + ascii_stl(high, "high"))
    with clay("two.stl", "--size", "2.5 mm") as (url, _), chromium(WINDOW) as browser:
        browser.open(url.geturl())
        settle(browser)
        browser.choose("ball", "100")
        browser.choose("within", "0.5")
        choose_hand(browser, "glue")
        browser.click(*centre_of_face(browser, "high/2"))
        browser.wait("flexelView.clay.frame.undo")
        for face, button in (("low/5", "face-hold"), ("high/6", "face-pull")):
            browser.choose("face", face)
            browser.run("document.getElementById(arguments[0]).click()", button)
        browser.wait("flexelView.clay.frame.tools.length === 1")
        browser.choose("lead-z", "-1")
        browser.run("document.getElementById('lead').click()")
        browser.wait("flexelView.clay.frame.place[0][2] === -0.001 && flexelView.clay.frame.settled")
        frame = browser.run("const {positions, ...frame} = flexelView.clay.frame; return frame")
        expect_same_run(url, frame)
        expect_drawn_as_saved(browser, url)
        browser.choose("paint-with", "spring steel")
        browser.choose("face", "low/2")
        browser.run("document.getElementById('face-paint').click()")
        browser.wait("flexelView.clay.frame.painted.low === 'spring-steel'")
        choose_hand(browser, "paint")
        expect("all of it" in browser.text("hands-said"), "a region is not painted, and the page says so")
        browser.choose("paint-with", "ABS")
        browser.click(*centre_of_face(browser, "high/2"))
        browser.wait("flexelView.clay.frame.painted.high === 'ABS'")
        settle(browser)
        expect(browser.text("painted") == "Painted: high with ABS, low with spring-steel", browser.text("painted"))
        expect_same_run(url, browser.run("const {positions, ...frame} = flexelView.clay.frame; return frame"))
        expect_silence(browser)


def pointer(browser, kind, *actions):
    """Of a "pen" or a "touch" that stays down from one call to the next."""
    browser.ask("POST", "/actions", {"actions": [{"type": "pointer", "id": kind, "parameters": {"pointerType": kind}, "actions": list(actions)}]})


def moved(x, y, pressure):
    return {"type": "pointerMove", "duration": 0, "x": round(x), "y": round(y), "pressure": pressure}


DOWN, UP = {"type": "pointerDown", "button": 0, "pressure": 0.25}, {"type": "pointerUp", "button": 0}


def test_a_pen_pushes_with_its_pressure_and_a_touch_is_felt():
    bracket()
    with clay("bracket.step", "--size", "5 mm") as (url, _), chromium(WINDOW) as browser:
        browser.open(url.geturl())
        settle(browser)
        browser.choose("face", "bracket/1")
        browser.run("document.getElementById('face-hold').click()")
        browser.wait("flexelView.clay.frame.holds.length === 1")
        choose_hand(browser, "pull")
        browser.choose("ball", "8")
        browser.run("""const {clay} = flexelView, post = clay.post.bind(clay);
            window.posted = [];
            clay.post = (...lines) => { posted.push(...lines); post(...lines); };
            flexelView.controls.look('iso');""")
        hand = "[...posted].reverse().find(line => line.startsWith('hand'))?.split(' ').slice(1, 4).map(Number)"
        x, y = centre_of_face(browser, "bracket/3")
        pointer(browser, "pen", moved(x, y, 0), DOWN)
        browser.wait("flexelView.clay.drag?.base")
        for pressure in (0.5, 0.75, 0.25):
            pointer(browser, "pen", moved(x, y, pressure))
            browser.wait(f"Math.abs({hand}?.[2] + {pressure} * 0.008) < 1e-6")
            expect(max(map(abs, browser.run(f"return {hand}")[:2])) < 1e-6, "into the face and nowhere else")
            settle(browser)
        place, felt = browser.run("const {place, felt} = flexelView.clay.frame; return [place[0], felt[0]]")
        expect(-0.25 * 0.008 < place[2] < -0.2 * 0.008 and felt[2] > 0, f"the tool lags a little behind, and the part pushes back: {place} {felt}")
        pointer(browser, "pen", UP)
        settle(browser)
        expect(abs(browser.run("return flexelView.clay.frame.place[0][2]") / place[2] - 1) < 1e-3, "the tool stays there")
        browser.run("""window.buzz = []; window.shaken = []; flexelView.clay.strongest = 0;
            navigator.vibrate = ms => window.buzz.push(ms) > 0;
            navigator.getGamepads = () => [null, {vibrationActuator: {playEffect: async (kind, how) => window.shaken.push(how.strongMagnitude)}}];""")
        pointer(browser, "touch", moved(x, y, 0), DOWN)
        browser.wait("flexelView.clay.drag?.base")
        pointer(browser, "touch", moved(x, y + 30, 0))
        browser.wait("buzz.length > 0 && shaken.length > 0", 60)
        pointer(browser, "touch", UP)
        settle(browser)
        buzz, shaken = browser.run("return [buzz, shaken]")
        expect(max(shaken) == 1 and min(shaken) >= 0, f"a gamepad shakes with the share of the largest force: {shaken}")
        expect(len(buzz) == len(shaken) and all(abs(ms - 20 * share) <= 0.5 for ms, share in zip(buzz, shaken)), f"a phone as long: {buzz} {shaken}")
        expect_silence(browser)


def test_two_tabs_and_the_end():
    bracket()
    with chromium(WINDOW) as browser:
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

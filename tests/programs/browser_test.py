"""Pages of flexel view in Chromium, headless: loaded, turned, coloured, pointed at, played, by mouse and by keys."""

import os
import pathlib
import struct
import time

from browser import chromium
from harness import SCENE, Skip, ascii_stl, binary_stl, box, box_triangles, bracket, expect, expect_ok, main, run, scene, write
from view_test import deformed, served

HARMLESS = "GPU stall due to ReadPixels"  # said where software draws and a picture is taken


def expect_silence(browser, but=HARMLESS):
    said = [line for line in browser.console() if HARMLESS not in line and but not in line]
    expect(not said, f"the console: {said}")


def expect_drawn(browser, colours=30):
    seen = browser.picture()
    expect(seen["width"] > 500 and seen["height"] > 400 and 0.02 < seen["share"] < 0.9 and seen["colours"] > colours, f"a picture: {seen}")
    return seen


def centre_of_face(browser, name, panel=0):
    """Where in the window a triangle of a face (any without a name) is seen; nothing where it is hidden."""
    return browser.run("""
        const [name, k] = arguments, {picture} = flexelView, panel = picture.panels[k], {shape} = panel;
        for (let t = 0; t < shape.face.length; ++t) {
          if (name && panel.faceName(shape.face[t]).text !== name) continue;
          const at = picture.project(panel, panel.placeOf({triangle: t, weights: [0.4, 0.35, 0.25]}));
          if (picture.pick(...at)?.triangle === t) return at;
        }""", name, panel)


def bent_bracket():
    bracket()
    expect_ok(run("flexel", "deform", "bracket.step", "--fix", "bracket/1", "--push", "bracket/2: 0 0 -100 N", "--material", "PLA", "--size", "4 mm",
                  "-o", "bent.vtu", "-o", "bent.stl", "--summary", "summary.json", "--quiet"))


def test_a_body_is_turned_coloured_and_pointed_at():
    bent_bracket()
    with chromium() as browser, served("bent.vtu", "--summary", "summary.json") as (url, _):
        browser.open(url.geturl())
        first = expect_drawn(browser, 200)
        # The page moves vertices where flexel-map puts them.
        triangles = pathlib.Path("bent.stl").read_bytes()
        corners = [struct.unpack_from("<3f", triangles, 84 + 50 * t + 12 + 12 * k) for t in range(struct.unpack_from("<I", triangles, 80)[0]) for k in range(3)]
        boxes = browser.run("""const {shape} = flexelView.picture.panels[0], box = [[1e9, 1e9, 1e9], [-1e9, -1e9, -1e9]];
            for (let p = 0; p < shape.count; ++p) {
              const u = shape.displacementOf(p, 0);
              shape.restOf(p).forEach((x, k) => { box[0][k] = Math.min(box[0][k], x + u[k]); box[1][k] = Math.max(box[1][k], x + u[k]); });
            }
            return box;""")
        for k in range(3):
            for side, of in ((0, min), (1, max)):
                expect(abs(1e3 * boxes[side][k] - of(c[k] for c in corners)) < 0.003, f"axis {k}: {boxes} of the page beside bent.stl")
        browser.drag(500, 300, 120, 40)
        browser.wait("flexelView.picture.drawn > 1")
        turned = browser.run("return [flexelView.picture.view.azimuth, flexelView.picture.view.elevation]")
        expect(abs(turned[0] - (45 - 0.4 * 120)) < 1 and turned[1] > 45, f"the drag turns it: {turned}")
        expect(browser.picture() != first, "another side is seen")
        # So do a finger and a pen; two fingers zoom and shift, a tap points.
        view = lambda: browser.run("const {view} = flexelView.picture; return [view.azimuth, view.zoom, ...view.shift]")
        for kind in ("touch", "pen"):
            before = view()
            browser.touch([(500, 300), (480, 300), (450, 300)], kind=kind)
            expect(view()[0] > before[0] + 5 and view()[1:] == before[1:], f"{kind} turns: {before} {view()}")
        before = view()
        browser.touch([(450, 300), (430, 300), (400, 300)], [(550, 300), (570, 300), (620, 300)])
        expect(view()[1] > 1.5 * before[1] and view()[0] == before[0], f"two fingers zoom: {before} {view()}")
        browser.run("flexelView.controls.look('iso')")
        browser.touch([centre_of_face(browser, "bracket/2")])
        browser.wait("document.querySelectorAll('#probes li').length === 1")
        browser.run("flexelView.probes.clear(); flexelView.picture.view.turn(30, 10)")
        # Colours, and the legend's largest stress is the summary's.
        browser.choose("colour", "von_mises")
        largest = browser.run("return [flexelView.picture.range('von_mises').largest, flexelView.picture.page.words.summary.simulate.largest_von_mises]")
        expect(abs(largest[0] / largest[1] - 1) < 1e-6, f"one figure everywhere: {largest}")
        coloured = browser.picture()
        browser.choose("scaling", "log")
        expect(browser.picture() != coloured, "logarithmic colours are others")
        browser.choose("low", "1")
        browser.choose("high", "5")
        browser.choose("outside", "2")
        expect(browser.picture()["share"] < coloured["share"], "what is outside the range is hidden")
        browser.choose("outside", "0")
        browser.run("flexelView.controls.look('iso')")
        # A face, its name and its value; displacement of the tip is that of the summary.
        browser.choose("colour", "displacement")
        browser.choose("scale-number", "1")
        x, y = centre_of_face(browser, "bracket/2")
        browser.click(x, y)
        browser.wait("document.querySelectorAll('#probes li').length === 1")
        text = browser.text("probes")
        expect("bracket/2" in text and "--fix bracket/2" in text and 'where = "bracket/2"' in text and "mm" in text, f"the probe: {text}")
        value = browser.run("const p = flexelView.probes.probes[0]; return p.panel.valueOf(p, 'displacement', 0)")
        most = browser.run("return flexelView.picture.page.words.summary.simulate.largest_displacement")
        expect(0.3 * most < value <= 1.01 * most, f"a point of the free end: {value} of {most}")
        expect("bracket/2" in browser.run("return document.getElementById('said').textContent"), "and it is said to who cannot see")
        expect_silence(browser)


def test_before_and_after_sections_and_distances():
    deformed()
    with chromium() as browser:
        expect_ok(run("flexel", "view", "bent.vtu", "--cells", "--html", "bent.html", "--scale", "200"))
        browser.open(f"file://{os.getcwd()}/bent.html")
        pictures = [expect_drawn(browser, 50)]
        for control, value in (("before", "ghost"), ("before", "wipe"), ("wipe", "0.2"), ("cells", True), ("colour", "fill"), ("cells", False),
                               ("colour", "strain"), ("cut", True), ("cut-axis", "y"), ("cut-at", "0.3"), ("steps", "5"), ("dark", True)):
            browser.choose(control, value)
            pictures.append(browser.picture())
            expect(pictures[-1] != pictures[-2], f"{control} = {value} is seen")
        browser.choose("cut", False)
        browser.choose("before", "nothing")
        browser.choose("scale-number", "0")
        browser.choose("pointing", "measure")
        at = browser.run("""const {picture} = flexelView, panel = picture.panels[0], {shape} = panel, found = [];
            for (const wanted of [[0.04, 0, 0.01], [0.04, 0.01, 0.01]])
              for (let p = 0; p < shape.count && found.length < 2; ++p)
                if (Math.hypot(...shape.restOf(p).map((x, k) => x - wanted[k])) < 1e-6) {
                  const inward = [[-0.001, 0.001, 0], [-0.001, -0.001, 0]][found.length];
                  const place = new THREE.Vector3(...wanted.map((x, k) => x + inward[k] - shape.centre[k]));
                  found.push(picture.project(panel, place));
                  break;
                }
            return found;""")
        for x, y in at:
            browser.click(x, y)
        browser.wait("flexelView.probes.measures.length === 1")
        text = browser.text("probes")
        expect("8 mm" in text.replace("\u00a0", " ") or "7.9" in text or "8.0" in text, f"8 mm apart: {text}")
        expect_silence(browser)


def test_a_series_is_played_by_keys():
    expect_ok(run("flexel-voxelize", box(), "--size", "5 mm", "-o", "rest.vtu"))
    scene("run.toml", SCENE + '[run]\ntime = "2 ms"\nframes = 6\n')
    expect_ok(run("flexel-simulate", "run.toml", "rest.vtu", "-o", "run.pvd"))
    with chromium() as browser, served("run.pvd") as (url, _):
        browser.open(url.geturl())
        expect_drawn(browser, 50)
        frames = browser.run("return flexelView.picture.frames")
        expect(frames == 7 and "2e-3" not in browser.text("time"), f"{frames} frames: {browser.text('time')}")
        browser.run("document.getElementById('canvas').focus()")
        browser.choose("frame", "0")
        still = browser.picture()
        browser.keys("...")
        expect(browser.run("return flexelView.picture.state.frame") == 3 and "frame 4 of 7" in browser.text("time"), browser.text("time"))
        expect(browser.picture() != still, "it has moved")
        browser.run("window.seen = new Set(); const {picture} = flexelView; picture.over.push(() => seen.add(picture.state.frame));")
        browser.choose("frame", "0")
        browser.keys(" ")
        browser.wait("document.getElementById('play').textContent === 'Play' && seen.size > 3", 30)
        expect(browser.run("return flexelView.picture.state.frame") == frames - 1, "it plays to the end")
        # Turned, zoomed and pointed at without a mouse.
        view = "return [flexelView.picture.view.azimuth, flexelView.picture.view.zoom]"
        before = browser.run(view)
        browser.keys("\ue012\ue012+\ue007")
        after = browser.run(view)
        expect(after[0] != before[0] and after[1] > before[1], f"{before} {after}")
        browser.wait("flexelView.probes.probes.length === 1")
        browser.keys("\ue00c")
        expect(browser.text("probes") == "", "Escape clears")
        video = browser.run("""const recorder = new flexelView.Recorder(flexelView.picture);
            recorder.start();
            for (let k = 0; k < 12; ++k) {
              const {drawn} = flexelView.picture;
              flexelView.picture.view.turn(5, 0);
              do await new Promise(done => setTimeout(done, 60)); while (flexelView.picture.drawn === drawn);
            }
            const bytes = new Uint8Array(await (await recorder.stop()).arrayBuffer());
            return [bytes.length, ...bytes.slice(0, 4)];""")
        expect(video[0] > 1000 and video[1:] == [0x1A, 0x45, 0xDF, 0xA3], f"a WebM: {video}")
        expect_silence(browser)


def test_every_control_has_a_name():
    with chromium() as browser:
        expect_ok(run("flexel", "view", box(), "--html", "box.html"))
        browser.open(f"file://{os.getcwd()}/box.html")
        unnamed = browser.run("""return [...document.querySelectorAll('button, input, select, canvas[tabindex], summary')].filter(each =>
            !(each.getAttribute('aria-label') || each.textContent.trim() || each.labels?.[0]?.textContent.trim())).map(each => each.outerHTML);""")
        expect(unnamed == [], f"{unnamed}")
        # What the button saves is a PNG under the part's name.
        browser.run("document.getElementById('save-picture').click()")
        saved = pathlib.Path(browser.folder, "downloads", "box.png")
        for _ in range(200):
            if saved.exists():
                break
            time.sleep(0.05)
        expect(saved.exists() and saved.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n", "the picture is saved")
        expect(browser.run("return [...document.querySelectorAll('[tabindex]')].every(each => each.tabIndex >= 0)"), "all are reached by Tab")
        expect_silence(browser)


def test_parts_of_every_kind_side_by_side():
    box("binary.stl")
    write("ascii.stl", ascii_stl(box_triangles()))
    corners = [(x, y, z) for z in (0, 10) for y in (0, 10) for x in (0, 40)]
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    write("quads.obj", "".join(f"v {x} {y} {z}\n" for x, y, z in corners) + "".join(f"g side{k}\nf {' '.join(str(i + 1) for i in quad)}\n" for k, quad in enumerate(quads)))
    write("numbers.obj", pathlib.Path("quads.obj").read_text().replace("side2", "1").replace("side0", "first"))
    write("quads.off", "OFF\n8 6 0\n" + "".join(f"{x} {y} {z}\n" for x, y, z in corners) + "".join(f"4 {' '.join(map(str, quad))}\n" for quad in quads))
    write("quality.ply", "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\nproperty float quality\nelement face 6\n"
          "property list uchar int vertex_indices\nend_header\n" + "".join(f"{x} {y} {z} {x + y}\n" for x, y, z in corners)
          + "".join(f"4 {' '.join(map(str, quad))}\n" for quad in quads))
    files = ["binary.stl", "ascii.stl", "quads.obj", "numbers.obj", "quads.off", "quality.ply"]
    expect_ok(run("flexel-voxelize", "binary.stl", "--size", "5 mm", "-o", "rest.vtu", "--quiet"))
    for kind in ("glb", "3mf"):
        expect_ok(run("flexel-map", "rest.vtu", "-o", f"box.{kind}", "--quiet"))
        files.append(f"box.{kind}")
    try:
        files.append(bracket())
    except Skip:
        pass
    with chromium() as browser, served(*files, "rest.vtu") as (url, _):
        browser.open(url.geturl())
        expect_drawn(browser, 30)
        labels = browser.run("return flexelView.picture.panels.map(panel => panel.about.label)")
        expect(labels == [*files, "rest.vtu"], f"{labels}")
        for k, name in enumerate(files):
            faces = browser.run("return [...new Set([...flexelView.picture.panels[arguments[0]].shape.face])].length", k)
            expect(faces >= 6, f"{name}: {faces} faces")
        part = browser.run("return flexelView.picture.panels[2].about.parts[0].text")
        x, y = centre_of_face(browser, f"{part}/6", files.index("quads.obj"))
        browser.click(x, y)
        browser.wait("document.querySelectorAll('#probes li').length === 1")
        expect(f"{part}/6 (side5)" in browser.text("probes"), browser.text("probes"))
        names = browser.run("const panel = flexelView.picture.panels[3]; return [0, 1, 2].map(face => panel.faceName(face).text)")
        expect(names == ["numbers/#1", "numbers/2", "numbers/3"], f"the file calls another face 1: {names}")
        listed = expect_ok(run("flexel", "info", "numbers.obj")).out.decode()
        expect(all(name in listed for name in names), f"as flexel info says: {listed}")
        browser.choose("colour", "quality")
        x, y = centre_of_face(browser, "quality/6", files.index("quality.ply"))
        browser.click(x, y)
        browser.wait("document.querySelectorAll('#probes li').length === 2")
        value = browser.run("const p = flexelView.probes.probes[1]; return [p.panel.valueOf(p, 'quality', 0), ...p.panel.restOf(p)]")
        expect(abs(value[0] - 1e3 * (value[1] + value[2])) < 2e-3, f"x + y: {value}")
        expect_silence(browser)


def test_hostile_names_do_nothing():
    evil = "<img src=x onerror=document.title='owned'><script>document.title='owned'</script>"
    name = "x';touch owned;'.stl"
    write(name, binary_stl(box_triangles()))
    write("evil.obj", f"o {evil}\n" + "".join(f"v {x} {y} {z}\n" for x, y, z in ((0, 0, 0), (9, 0, 0), (0, 9, 0), (0, 0, 9)))
          + f"g {evil}\nf 1 3 2\nf 1 2 4\ng $(touch\x07owned)\nf 2 3 4\nf 1 4 3\n")
    write("summary.json", '{"warnings": ["%s"], "%s": "%s"}' % (evil.replace('"', "'"), evil, evil))
    expect_ok(run("flexel", "view", "evil.obj", name, "--summary", "summary.json", "--html", "page.html"))
    with chromium() as browser, served("evil.obj", name, "--summary", "summary.json") as (url, _):
        for address in (url.geturl(), f"file://{os.getcwd()}/page.html"):
            browser.open(address)
            expect_drawn(browser, 10)
            title = browser.run("return document.title")
            for panel in (0, 1):
                browser.click(*centre_of_face(browser, None, panel))
            browser.wait("document.querySelectorAll('#probes li').length === 2")
            expect(browser.run("return document.querySelectorAll('img, script[src]').length") == 0, "no element comes from a name")
            expect("owned" not in title.replace("touch owned", "") and browser.run("return document.title") == title, f"nothing ran: {title}")
            expect("<img src=x" in browser.text("words-box") or browser.run("return document.getElementById('words').textContent.includes('<img src=x')"), "names are shown as text")
            buttons = browser.run("return [...document.querySelectorAll('#probes .row button')].map(each => each.textContent)")
            expect("<img src=x" in browser.text("probes"), f"so are those of faces: {browser.text('probes')}")
            quoted = [text for text in buttons if text.startswith("--fix") and "touch" in text]
            for text in quoted:
                words = run("bash", "-c", f"printf '%s\\n' {text}").out.decode().splitlines()
                expect(words[0] == "--fix" and len(words) == 2 and not os.path.exists("owned"), f"one word of a shell: {text}")
            expect(quoted, f"{buttons}")
            expect_silence(browser)


if __name__ == "__main__":
    main(globals())

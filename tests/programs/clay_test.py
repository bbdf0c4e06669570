"""flexel clay from the outside: hands over HTTP, what they get wrong, who holds the tool, and that a run without hands gives the same."""

import contextlib
import http.client
import io
import json
import math
import pathlib
import re
import socket
import struct
import subprocess
import sys
import tarfile
import threading
import time
import urllib.parse

from harness import BIN, SOURCE, ascii_stl, box_triangles, bracket, expect, expect_error, expect_ok, main, run, write

sys.path.insert(0, str(SOURCE / "bench" / "live"))
from client import Frames  # noqa: E402

TIP = "0.0796 0.02 0.003"  # on face 2 of the bracket, at rest


@contextlib.contextmanager
def clay(*arguments):
    """The URL that is printed, while the program runs; it ends by Ctrl-C, without a word and with 130."""
    process = subprocess.Popen([BIN / "flexel", "clay", *arguments, "--quiet"], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    try:
        line = process.stdout.readline().decode()
        expect(re.fullmatch(r"http://127\.0\.0\.1:\d+/[0-9a-f]{32}/\n", line), f"one line with the URL: {line!r} {process.stderr.read1() if not line else ''}")
        yield urllib.parse.urlparse(line.strip()), process
        expect(process.poll() is None, f"it runs still: {process.poll()}")
        process.send_signal(2)
        expect(process.wait(30) == 130, f"Ctrl-C ends it: {process.returncode}")
    finally:
        process.kill()
        process.communicate()


class Hand:
    """A client: reads frames in a thread, posts acts."""

    def __init__(self, url, client):
        self.url, self.client, self.frames, self.last, self.seen = url, client, Frames(), None, 0
        self.connection = http.client.HTTPConnection(url.hostname, url.port, timeout=60)
        self.connection.request("GET", f"{url.path}live?client={client}")
        self.answer = self.connection.getresponse()
        expect(self.answer.status == 200, f"frames: {self.answer.status}")
        self.thread = threading.Thread(target=self.read, daemon=True)
        self.thread.start()

    def read(self):
        try:
            while data := self.answer.read1(1 << 16):
                for frame in self.frames.feed(data):
                    if "positions" not in frame and self.last:
                        frame["positions"] = self.last["positions"]
                    self.last = frame
                    self.seen += 1
        except (OSError, ValueError, AttributeError, http.client.HTTPException):
            pass

    def leave(self):
        self.answer.close()
        with contextlib.suppress(OSError):
            self.connection.sock and self.connection.sock.shutdown(socket.SHUT_RDWR)
        self.connection.close()

    def post(self, *lines, client=None):
        return post(self.url, "\n".join([f"client {client or self.client}", *lines]))

    def act(self, *lines):
        status, text = self.post(*lines)
        expect(status == 200, f"{lines}: {status} {text}")
        return self.settled(json.loads(text)["line"])

    def settled(self, line=0, patience=60):
        """The first frame at rest after a message, once the run has taken it up."""
        status, _, text = ask(self.url, self.url.path + "save/scene.toml")  # waits until it is at rest
        expect(status == 200, f"at rest: {status} {text[:300]}")
        end = time.monotonic() + patience
        while not (self.last and self.last["settled"] and self.last["line"] >= line and "positions" in self.last):
            expect(time.monotonic() < end, f"never at rest: {self.last and {k: v for k, v in self.last.items() if k != 'positions'}}")
            time.sleep(0.02)
        time.sleep(0.1)
        return self.last


def ask(url, path, method="GET", content=None, **headers):
    """Status, headers and bytes of an answer."""
    connection = http.client.HTTPConnection(url.hostname, url.port, timeout=100)
    connection.request(method, path, content, headers)
    answer = connection.getresponse()
    return answer.status, dict(answer.getheaders()), answer.read()


def post(url, content, **headers):
    status, _, text = ask(url, url.path + "act", "POST", content=content.encode() if isinstance(content, str) else content,
                          **{"Content-Length": str(len(content)), **headers})
    return status, text.decode()


def saved(url, name):
    status, _, data = ask(url, url.path + "save/" + name)
    expect(status == 200, f"{name}: {status} {data[:300]}")
    pathlib.Path(name).write_bytes(data)
    return data


def corners(data):
    return [struct.unpack_from("<3f", data, 84 + 50 * t + 12 + 12 * k) for t in range(struct.unpack_from("<I", data, 80)[0]) for k in range(3)]


def farthest(one, other):
    """The largest distance between corners of two STL files [mm]."""
    one, other = corners(one), corners(other)
    expect(len(one) == len(other) and one, f"as many triangles: {len(one)} {len(other)}")
    return max(sum((x - y) ** 2 for x, y in zip(a, b)) ** 0.5 for a, b in zip(one, other))


def test_a_face_that_is_led_is_that_of_flexel_deform():
    bracket()
    with clay("bracket.step", "--size", "5 mm", "--material", "PLA") as (url, _):
        hand = Hand(url, "0123456789abcdef")
        hand.act("hold bracket/1")
        hand.act("grab face bracket/2")
        frame = hand.act("0 0 0 -0.001", "0 0 0 -0.005")
        expect(frame["place"][-1][:3] == [0, 0, -0.005], f"the tool is there: {frame['place']}")
        bent = saved(url, "part.stl")
        scene = saved(url, "scene.toml").decode()
    expect_ok(run("flexel", "deform", "bracket.step", "--fix", "bracket/1", "--move", "bracket/2: 0 0 -5 mm", "--material", "PLA", "--size", "5 mm",
                  "-o", "deform.stl", "--summary", "summary.json", "--quiet"))
    expect(farthest(bent, pathlib.Path("deform.stl").read_bytes()) < 1e-4, "the part is that of flexel deform within 0.1 um")
    reactions = json.loads(pathlib.Path("summary.json").read_text())["simulate"]["reactions"]
    force = next(each for each in reactions if "bracket/2" in each["name"])["force"]
    felt = frame["felt"][-1][:3]
    expect(max(abs(a + b) for a, b in zip(force, felt)) < 1e-5 * max(map(abs, force)), f"and so is the force: {felt} {force}")
    expect("[[fix]]" in scene and "[[move]]" in scene and 'material = "PLA"' in scene, scene)


def test_the_scene_does_the_same_without_hands():
    """A hand pulls and twists at a place, keeps the shape, and pulls again: two scenes in a pipe end in the same."""
    bracket()
    with clay("bracket.step", "--size", "5 mm", "--material", "PLA") as (url, _):
        hand = Hand(url, "0123456789abcdef")
        hand.act("hold bracket/1", f"grab at {TIP} 0.008")
        hand.act("hand 0 0.001 -0.002")
        frame = hand.act("hand 0.0005 0.002 -0.004 0.05 0 0")
        hand.act("stay")
        way, hand_way = frame["place"][-1][:3], [0.0005, 0.002, -0.004]
        lag = sum((a - b) ** 2 for a, b in zip(way, hand_way)) ** 0.5 / sum(a * a for a in hand_way) ** 0.5
        expect(0.02 < lag < 0.3, f"the tool lags behind the hand as a spring does: {lag}")
        first = saved(url, "part.stl")
        frame = hand.act("keep")
        expect(frame["kept"] == 1 and frame["tools"] == [] and not frame["said"], f"{frame['kept']} {frame['tools']} {frame['said']}")
        expect(frame["settled"] and frame["residual"] <= 1e-8, f"nothing acts, and all is in balance: {frame['residual']}")
        expect(farthest(saved(url, "part.stl"), first) < 1e-3, "what is kept is the shape that was seen")
        hand.act("grab face bracket/2")
        base = hand.last["place"][-1]
        hand.act("0 " + " ".join(str(x + d) for x, d in zip(base, [0, 0, 0.002, 0, 0, 0])))
        bent = saved(url, "part.stl")
        for name in ("rest.vtu", "scene-1.toml", "scene.toml"):
            saved(url, name)
    expect_ok(run("flexel-simulate", "scene-1.toml", "rest.vtu", "-o", "one.vtu", "--no-estimate"))
    expect_ok(run("flexel-simulate", "scene.toml", "one.vtu", "-o", "two.vtu", "--no-estimate"))
    for body, stl, hands in (("one.vtu", "one.stl", first), ("two.vtu", "two.stl", bent)):
        expect_ok(run("flexel-map", body, "-o", stl, "--quiet"))
        expect(farthest(pathlib.Path(stl).read_bytes(), hands) < 1e-3, f"{stl} is what hands made, within a micrometre")


def test_while_the_hand_moves_the_part_follows_and_at_rest_it_is_exact():
    """Frames tell their residual; many poses lead to where one does."""
    bracket()
    with clay("bracket.step", "--count", "3000") as (url, _):
        hand = Hand(url, 16 * "a")
        hand.settled()
        hand.act("hold bracket/1", f"grab at {TIP} 0.003")
        told = []
        for step in range(1, 41):
            status, text = hand.post(f"0 0 {2e-3 * math.sin(0.2 * step)} {-1e-4 * step}")
            expect(status == 200, text)
            line, end = json.loads(text)["line"], time.monotonic() + 30
            while hand.last["line"] < line:
                expect(time.monotonic() < end and not hand.last["said"], f"it follows: {hand.last['said']}")
                time.sleep(0.001)
            told.append((hand.last["residual"], hand.last["settled"]))
        expect(max(residual for residual, _ in told) <= 1e-2 and min(residual for residual, _ in told) > 1e-8, f"roughly: {told}")
        expect(sum(settled for _, settled in told) < 5, f"it does not rest on the way: {told}")
        many = hand.settled(line)
        expect(many["residual"] <= 1e-8, f"exactly: {many['residual']}")
        hand.act("undo")
        once = hand.act(f"0 0 {2e-3 * math.sin(8)} -0.004")
        apart = max(abs(a - b) for a, b in zip(many["positions"], once["positions"]))
        expect(apart < 2e-8 and many["place"] == once["place"], f"the same: {apart}")  # single precision of 80 mm
        expect(max(abs(a - b) for a, b in zip(many["felt"][-1], once["felt"][-1])) < 1e-5 * max(map(abs, once["felt"][-1])), f"{many['felt']} {once['felt']}")
        hand.leave()


def test_what_is_done_while_the_hand_moves_is_done_to_the_part_at_rest():
    bracket()
    with clay("bracket.step", "--size", "5 mm") as (url, _):
        hand = Hand(url, 16 * "a")
        hand.settled()
        hand.act("hold bracket/1", "grab face bracket/2")
        places = []
        for rests in (False, True):
            for step in range(1, 21):
                line, end = json.loads(hand.post(f"0 0 {2e-3 * math.sin(0.3 * step)} {-2e-4 * step}")[1])["line"], time.monotonic() + 30
                while hand.last["line"] < line:
                    expect(time.monotonic() < end and not hand.last["said"], f"it follows: {hand.last['said']}")
                    time.sleep(0.001)
            if rests:
                hand.settled(line)
            frame = hand.act("grab at 0.04 0.02 0.003 0.006")
            expect(not frame["said"] and frame["grabs"] == len(places) + 2, f"{frame['said']}")
            places.append(frame["place"][-1])
            hand.act("undo", "undo")
        apart = max(abs(a - b) for a, b in zip(*places))
        expect(apart < 1e-10, f"the new tool begins in the same place: {apart}")


def test_undo_and_redo_lead_back_and_forth():
    bracket()
    with clay("bracket.step", "--size", "5 mm") as (url, _):
        hand = Hand(url, "0123456789abcdef")
        states = [hand.settled()["positions"]]
        for lines in (["hold bracket/1"], [f"grab at {TIP} 0.01"], ["hand 0 0 -0.003", "stay"], ["release"], ["material steel"]):
            states.append(hand.act(*lines)["positions"])
        different = lambda a, b: max(abs(x - y) for x, y in zip(a, b))
        expect(different(states[2], states[3]) > 1e-3 and different(states[4], states[0]) < 1e-7, "it bends, and springs back")
        for state in reversed(states[:-1]):
            frame = hand.act("undo")
            expect(different(frame["positions"], state) < 1e-7, f"undone: {different(frame['positions'], state)}")
        expect(not frame["undo"] and frame["redo"] and frame["holds"] == [], "all is undone")
        for state in states[1:]:
            frame = hand.act("redo")
            expect(different(frame["positions"], state) < 1e-7, f"done again: {different(frame['positions'], state)}")
        expect(frame["undo"] and not frame["redo"], "all is done again")


def gone(frame):
    """The elements that were carved away."""
    return [e for e in range(len(frame["positions"]) // 3) if math.isnan(frame["positions"][3 * e])]


def same(a, b, far=1e-7):
    return all(math.isnan(x) and math.isnan(y) or abs(x - y) < far for x, y in zip(a, b, strict=True))


def felt_of_run(summary):
    """The force of the part on the last tool, as the summary of a run has it."""
    return [-x for x in json.loads(pathlib.Path(summary).read_text())["reactions"][-1]["force"]]


def expect_same_run(url, frame, surface=()):
    """The saved scenes, run without hands, end in what the hands have: the part that was saved, and the force."""
    bent = saved(url, "part.stl")
    with tarfile.open(fileobj=io.BytesIO(saved(url, "scene.tar"))) as files:
        names = files.getnames()
        for name in names:
            pathlib.Path(name).write_bytes(files.extractfile(name).read())
    body = "rest.vtu"
    for name in names[1:]:
        expect_ok(run("flexel-simulate", name, body, "-o", f"{name}.vtu", "--no-estimate", "--summary", "run.json"))
        body = f"{name}.vtu"
    expect_ok(run("flexel-map", body, "-o", "run.stl", "--quiet", *surface))
    data = pathlib.Path("run.stl").read_bytes()
    expect(len(data) == len(bent) and farthest(data, bent) < 1e-3, f"the part is that of the scenes within a micrometre: {len(data)} {len(bent)}")
    force, felt = felt_of_run("run.json"), frame["felt"][-1][:3]
    expect(max(abs(a - b) for a, b in zip(force, felt)) < 1e-4 * max(map(abs, force)), f"and so is the force: {felt} {force}")


def test_carving_is_that_of_the_saved_scene():
    bracket()
    with clay("bracket.step", "--size", "4 mm", "--material", "PLA") as (url, _):
        hand = Hand(url, 16 * "a")
        hand.act("hold bracket/1", "grab face bracket/2")
        whole = hand.act("0 0 0 -0.002")
        carved = hand.act("carve at 0.04 0.02 0.006 0.009")
        expect(not carved["said"] and not gone(whole) and len(gone(carved)) > 10, f"{carved['said']} {len(gone(carved))}")
        expect(len(carved["positions"]) == len(whole["positions"]) and carved["place"] == whole["place"], "the tool stays where it is")
        expect(0.3 < math.hypot(*carved["felt"][-1][:3]) / math.hypot(*whole["felt"][-1][:3]) < 0.95, f"it is weaker: {whole['felt']} {carved['felt']}")
        expect(carved["surface"] != 0 and saved(url, f"surface-{carved['surface']}")[:4] == b"FLXV", "the page gets what is left")
        expect(ask(url, f"{url.path}save/surface-{carved['surface'] + 1}")[0] == 404, "and no other")
        expect_same_run(url, carved, ("--crack", "cap"))
        status, _, text = ask(url, url.path + "save/part.step")
        expect(status == 500 and b"write a mesh" in text, f"STEP keeps faces whole: {status} {text}")
        expect(same(hand.act("undo")["positions"], whole["positions"]) and hand.last["surface"] == 0, "undone")
        expect(same(hand.act("redo")["positions"], carved["positions"]) and hand.last["surface"] == carved["surface"], "done again")
        # kept, carved again and made of another material: two scenes
        hand.act("keep", "carve at 0.02 0.04 0.003 0.006", "material ABS", "grab face bracket/2")
        base = hand.last["place"][-1]
        frame = hand.act("0 " + " ".join(str(x + d) for x, d in zip(base, [0, 0.001, 0, 0, 0, 0])))
        expect(not frame["said"] and len(gone(frame)) > len(gone(carved)), f"{frame['said']}")
        expect_same_run(url, frame, ("--crack", "cap"))
        for lines, said in ((["carve at 1 1 1 0.001"], "no element"), (["carve at 0.04 0.02 0.03 1"], "leaves nothing"), (["carve at 0.08 0.02 0.003 0.025"], "is not held and led as before"), (["glue at 0.04 0.02 0.003 0.01 0.001"], "fuse")):
            frame = hand.act(*lines)
            expect(said in frame["said"] and frame["undo"], f"{lines}: {frame['said']!r}")


def test_carving_along_a_way_is_one_act_and_that_of_the_saved_scene():
    bracket()
    with clay("bracket.step", "--size", "4 mm", "--material", "PLA") as (url, _):
        hand = Hand(url, 16 * "a")
        hand.act("hold bracket/1", "grab face bracket/2")
        whole = hand.act("0 0 0 -0.002")
        way = [f"{0.02 + 0.002 * k} {0.02 + 0.012 * math.sin(0.4 * k)} 0.006" for k in range(21)]
        hand.act(f"carve from {way[0]} 0.007")
        for place in way[1:]:
            hand.act(f"carve to {place}")
        pieces = hand.act("stay")
        expect(not pieces["said"] and len(gone(pieces)) > 15 and 0 < pieces["felt"][-1][2] < whole["felt"][-1][2], f"{pieces['said']} {len(gone(pieces))} {pieces['felt']}")
        expect_same_run(url, pieces, ("--crack", "cap"))
        expect(same(hand.act("undo")["positions"], whole["positions"]) and hand.last["surface"] == 0, "one act")
        at_once = hand.act(f"carve from {way[0]} 0.007", *(f"carve to {place}" for place in way[1:]), "stay")
        expect(gone(at_once) == gone(pieces) and same(at_once["positions"], pieces["positions"]), "it does not matter how fast it came")
        expect(at_once["line"] == pieces["line"] + 21, f"places are counted as poses are: {at_once['line']} {pieces['line']}")
        expect(saved(url, "scene.toml").count(b"[[event]]") == 1, "and one event")
        hand.act("undo")
        # the hand goes back on it
        hand.act(f"carve from {way[0]} 0.007", f"carve to {way[9]}")
        expect(same(hand.act("cancel")["positions"], whole["positions"]), "cancelled")
        hand.act(f"hand 0 0 -0.004")
        frame = hand.act("cancel", "cancel", "stay")
        expect(frame["place"] == whole["place"] and frame["felt"][-1][2] > 0 and same(frame["positions"], whole["positions"]), f"a drag too, once: {frame['place']}")
        # lifted between, over nothing, and where nothing is at all
        frame = hand.act(f"carve from {way[0]} 0.007", f"carve to {way[2]}", "carve from 0.03 0.09 0.006 0.007", "carve to 0.06 0.09 0.006", f"carve from {way[18]} 0.007", "stay")
        expect(not frame["said"] and 0 < len(gone(frame)) < len(gone(pieces)) and saved(url, "scene.toml").count(b"[[event]]") == 1, f"{frame['said']}")
        expect_same_run(url, frame, ("--crack", "cap"))
        hand.act("undo")
        for lines, said in ((["carve from 1 1 1 0.001", "carve to 2 1 1", "stay"], "no element"), (["carve to 0 0 0"], "put the ball down first"),
                            (["carve from 0.02 0.02 0.006 0.0001", "stay"], "no "), (["carve from 0.04 0.02 0.03 1"], "leaves nothing"),
                            (["stay", f"carve from {way[0]} 0.007", *(200 * ["carve to 0.03 0.02 0.006"]), "stay"], "")):
            frame = hand.act(*lines)
            expect(said in frame["said"] and bool(said) == bool(frame["said"]), f"{lines[:3]}: {frame['said']!r}")
        hand.act("undo")
        expect(same(hand.last["positions"], whole["positions"]), "what was refused changed nothing")


def test_carving_along_stops_where_nothing_would_hold_the_part():
    bracket()
    with clay("bracket.step", "--size", "4 mm", "--material", "PLA") as (url, _):
        hand = Hand(url, 16 * "a")
        hand.act("hold bracket/1", "grab face bracket/2")
        whole = hand.act("0 0 0 -0.002")
        hand.act("carve from 0.04 0.02 0.006 0.009")
        some = hand.act("carve to 0.05 0.02 0.006")
        refused = hand.act("carve to 0.079 0.002 0.003", "carve to 0.079 0.038 0.003")
        expect("is not held and led as before" in refused["said"] and gone(refused) == gone(some), f"{refused['said']}")
        after = hand.act("carve to 0.03 0.02 0.006", "carve from 0.03 0.02 0.006 0.009", "stay")
        expect(gone(after) == gone(some) and "is not held" in after["said"], f"the rest of the way is passed over, and it still says why: {after['said']!r}")
        expect_same_run(url, after, ("--crack", "cap"))
        expect(same(hand.act("undo")["positions"], whole["positions"]), "one act")
        # a way has an end, and so has one amid which something else is done
        hand.post("carve from 0.04 0.02 0.006 0.009")
        for _ in range(21):
            expect(hand.post(*(100 * ["carve to 0.045 0.02 0.006"]))[0] == 200, "places of a way wait together")
        expect("2,000 places" in hand.act("stay")["said"], f"{hand.last['said']}")
        places = saved(url, "scene.toml").count(b",\n    [") + 1
        expect(places == 2000, f"what fits is carved, however it came: {places} places")
        while hand.act("undo")["surface"] != 0:
            pass
        frame = hand.act("carve from 0.04 0.02 0.006 0.009", "keep", "carve to 0.05 0.02 0.006")
        expect(frame["kept"] == 1 and "put the ball down first" in frame["said"], f"{frame['kept']} {frame['said']}")
        hand.act("undo", "undo")
        expect(same(hand.last["positions"], whole["positions"]), "undone")
        # another client that takes the tool does not carve on
        hand.act("carve from 0.04 0.02 0.006 0.009")
        other = Hand(url, 16 * "b")
        other.act("take", "carve from 0.055 0.02 0.006 0.009", "stay")
        expect(gone(other.act("undo")) == gone(some) or len(gone(other.last)) > 0, "its act is its own")
        expect(same(other.act("undo")["positions"], whole["positions"]), "and so is the first one's")


def test_a_drag_that_does_not_follow_stays_one_act():
    bracket()
    with clay("bracket.step", "--size", "8 mm") as (url, _):
        hand = Hand(url, 16 * "a")
        hand.act("hold bracket/1", "grab face bracket/2")
        frame = hand.act("0 -0.2 0 0")  # through the wall that holds it
        expect("does not follow" in frame["said"], frame["said"])
        expect("does not follow" in hand.act("stay")["said"], "which it still says when the hand has left")
        hand.act("undo", "0 -0.2 0 0")
        hand.act("0 0 0 -0.001")
        frame = hand.act("undo")
        expect(frame["place"] == [6 * [0]] and not frame["said"], f"all of the drag is undone: {frame['place']}")


ON_TOP = "0.07 0.02 0.006 0 0 1"  # of the arm of the bracket, and where it looks


def test_a_push_is_that_of_the_saved_scene():
    bracket()
    with clay("bracket.step", "--size", "5 mm", "--material", "PLA") as (url, _):
        hand = Hand(url, 16 * "a")
        hand.act("hold bracket/1", f"push ball {ON_TOP} 0.006")
        start = hand.last
        expect(not start["said"] and start["felt"] == [6 * [0]] and start["place"] == [6 * [0]], f"it touches: {start['said']} {start['felt']} {start['place']}")
        expect(start["shapes"] == [{"kind": "ball", "radius": 0.006, "normal": [0, 0, -1]}], f"{start['shapes']}")
        frame = hand.act("0 0 0 -0.002", "stay")
        force = frame["felt"][0]
        expect(frame["place"][0][:3] == [0, 0, -0.002] and force[2] > 1, f"it is there, and the part pushes back: {frame['place']} {force}")
        expect_same_run(url, frame)
        reactions = json.loads(pathlib.Path("run.json").read_text())["reactions"]
        sums = [sum(each["force"][k] for each in reactions) for k in range(3)]
        expect(len(reactions) == 2 and max(map(abs, sums)) < 1e-6 * force[2], f"what the tool pushes with is held: {sums}")
        # away again it feels nothing, and the part is as before
        expect(hand.act("0 0 0 0.001")["felt"][0] == 6 * [0] and same(hand.last["positions"], start["positions"]), "the part springs back")
        for act, state in (("undo", frame), ("undo", start), ("redo", frame)):
            hand.act(act)
            expect(same(hand.last["positions"], state["positions"]) and max(abs(a - b) for a, b in zip(hand.last["felt"][0], state["felt"][0])) < 1e-5 * force[2], act)
        # a plate beside it, turned; a hand by a spring
        hand.act("push plate 0.05 0.02 0.006 0 0 1 0.008", "hand 0 0 -0.0005", "hand 0 0 -0.001 0.02 0 0")
        hand.act("stay")
        expect(not hand.last["said"] and len(hand.last["place"]) == 2 and hand.last["felt"][1][2] > 1, f"{hand.last['said']} {hand.last['felt']}")
        expect_same_run(url, hand.last)


def test_a_push_at_a_bent_part_and_at_one_that_was_kept():
    bracket()
    with clay("bracket.step", "--size", "5 mm", "--material", "PLA") as (url, _):
        hand = Hand(url, 16 * "a")
        hand.act("hold bracket/1", "grab face bracket/2")
        hand.act("0 0 0 -0.006")
        # on top of the arm as it is now: at rest there is matter
        frame = hand.act("push ball 0.05 0.02 0.001 0 0 1 0.005")
        place = frame["place"][-1]
        expect(not frame["said"] and place[2] < -0.001 and max(map(abs, frame["felt"][-1])) < 1, f"it comes from where it is clear: {frame['said']} {place} {frame['felt']}")
        frame = hand.act("0 0 0 " + str(place[2] - 0.002), "stay")
        expect(not frame["said"] and frame["felt"][-1][2] > 1, f"{frame['said']} {frame['felt']}")
        expect_same_run(url, frame)
        kept = hand.act("keep")
        expect(not kept["said"] and kept["kept"] == 1 and kept["tools"] == [], f"{kept['said']}")
        frame = hand.act("push ball 0.07 0.02 -0.002 0 0 1 0.005")  # inside: it is put where it is clear
        expect(not frame["said"] and frame["middles"][-1][2] > 0.003 and frame["felt"][-1] == 6 * [0], f"{frame['middles']} {frame['felt']}")
        hand.act("0 0 0 " + str(frame["place"][-1][2] - 0.004), "stay")
        expect(not hand.last["said"] and hand.last["felt"][-1][2] > 0.5, f"{hand.last['said']} {hand.last['felt']}")
        expect_same_run(url, hand.last)


def test_a_ball_that_is_led_far_at_once_does_not_pass_through():
    bracket()
    with clay("bracket.step", "--size", "5 mm", "--material", "rubber") as (url, _):
        hand = Hand(url, 16 * "a")
        hand.act("hold bracket/1", f"push ball {ON_TOP} 0.005")
        frame = hand.act("0 0 0 -0.02", "stay")
        under = min(range(len(frame["positions"]) // 3), key=lambda e: math.dist(at_rest(url)[3 * e:3 * e + 3], (0.072, 0.02, 0.004)))
        expect(not frame["said"] and frame["place"][0][2] == -0.02 and frame["felt"][0][2] > 0, f"{frame['said']} {frame['place']} {frame['felt']}")
        expect(frame["positions"][3 * under + 2] < -0.013, f"the part is before it: {frame['positions'][3 * under:3 * under + 3]}")
        expect_same_run(url, frame)


def test_a_part_that_is_pulled_onto_a_ball_does_not_pass_through():
    write("bar.stl", ascii_stl(box_triangles((80.0, 20.0, 10.0)), "box"))
    with clay("bar.stl", "--size", "5 mm", "--material", "rubber") as (url, _):
        hand = Hand(url, 16 * "a")
        hand.act("hold box/xmin", "push ball 0.04 0.01 0 0 0 -1 0.006", "0 0 0 -0.002", "stay", "grab face box/xmax")
        at_once = hand.act("0 0 0 -0.02", "stay")["felt"]
        hand.act("undo")
        for k in range(1, 11):
            slowly = hand.act(f"0 0 0 {-0.002 * k}", "stay")["felt"]
        expect(slowly[0][2] < -1, f"the part presses the ball down: {slowly}")
        expect(max(abs(a - b) for one, other in zip(at_once, slowly) for a, b in zip(one[:3], other[:3])) < 1e-3 * abs(slowly[0][2]), f"{at_once} {slowly}")


def test_a_ball_that_was_led_around_the_part_is_in_no_scene():
    bracket()
    with clay("bracket.step", "--size", "5 mm", "--material", "rubber") as (url, _):
        hand = Hand(url, 16 * "a")
        hand.act("hold bracket/1", f"push ball {ON_TOP} 0.005")
        status, text = hand.post("0 0 0.03 0", "stay", "0 0 0.03 -0.02", "stay", "0 0 0 -0.02", "stay", "0 0 0 -0.014", "stay")
        expect(status == 200, text)
        saved(url, "part.stl")  # waits until it is at rest
        for name in ("scene.toml", "scene.tar"):
            status, _, data = ask(url, f"{url.path}save/{name}")
            expect(status == 500 and b"tool 1 was led around the part" in data, f"{name}: {status} {data[:300]}")
        hand.post("keep")
        saved(url, "part.stl")
        time.sleep(0.5)
        expect("led around" in hand.last["said"] and hand.last["kept"] == 0, f"{hand.last['said']} {hand.last['kept']}")
        # as the message says
        frame = hand.act("release", "push ball 0.07 0.02 0 0 0 -1 0.005", "0 0 0 0.001", "stay")
        expect(not frame["said"] and frame["felt"][0][2] < 0, f"{frame['said']} {frame['felt']}")
        expect_same_run(url, frame)


def at_rest(url):
    data = saved(url, "rest.f32")
    return struct.unpack(f"<{len(data) // 4}f", data)


def test_pushes_that_cannot_be_are_refused():
    bracket()
    with clay("bracket.step", "--size", "5 mm", "--material", "PLA") as (url, _):
        hand = Hand(url, 16 * "a")
        for wrong, said in (("push", "push: give"), ("push cone 0 0 0 0 0 1 1", "push: give"), ("push ball 0 0 0 0 0 0 1", "no direction"), ("push ball 0 0 0 0 0 1 0", "radius above 0"), ("push ball 0 0 0 0 0 1 1e9", "no number")):
            status, text = hand.post(wrong)
            expect(status == 400 and said in text, f"{wrong}: {status} {text}")
        push = f"push ball {ON_TOP} 0.006"
        for acts, said in (([push], "nothing holds part"), (["hold bracket/1", f"push ball {ON_TOP} 0.001"], "less than a cell"),
                           (["carve at 0.04 0.02 0.006 0.009", push], "carved out"),
                           (["undo", push, "carve at 0.04 0.02 0.006 0.009"], "carved out")):
            frame = hand.act(*acts)
            expect(said in frame["said"], f"{acts}: {frame['said']!r}")
        expect(hand.act("0 0 0 -0.001", "stay")["felt"][0][2] > 1, "the tool that is there still pushes")
    write("scene.toml", LOAD.format("", '[[indenter]]\nball = { centre = ["40 mm", "20 mm", "20 mm"], radius = "5 mm" }\n'))
    expect_error(run("flexel", "clay", "bracket.step", "--scene", "scene.toml", "--size", "10 mm"), "flexel", "scene.toml", "[[indenter]]")


def test_a_page_gets_the_surface_while_acts_wait():
    bracket()
    with clay("bracket.step", "--size", "5 mm") as (url, _):
        hand = Hand(url, 16 * "a")
        expect("hold a face" in hand.act("carve at 0.04 0.02 0.006 0.009", "keep")["said"], f"nothing holds it: {hand.last['said']}")
        expect(not hand.act("hold bracket/1", "keep")["said"], f"held, it is kept: {hand.last['said']}")
        surface = hand.act("grab face bracket/2", "0 0 0 -0.001")["surface"]
        expect(hand.post(*(["release", "undo"] * 120))[0] == 200, "they take seconds")
        end = time.monotonic() + 30
        while hand.last["settled"]:
            expect(time.monotonic() < end, "they are begun")
            time.sleep(0.005)
        for name in (f"surface-{surface}", "rest.f32"):
            expect(ask(url, f"{url.path}save/{name}")[0] == 200 and not hand.last["settled"], f"{name} does not wait for a part at rest")


def test_glue_holds_parts_together_as_in_the_saved_scene():
    low = box_triangles((40.0, 10.0, 5.0))
    high = [[(x, y, z + 5.3) for x, y, z in triangle] for triangle in low]
    pathlib.Path("two.stl").write_bytes(ascii_stl(low, "low") + ascii_stl(high, "high"))
    with clay("two.stl", "--size", "2.5 mm", "--material", "PLA") as (url, _):
        hand = Hand(url, 16 * "a")
        expect("high" in hand.act("hold low/5")["said"], f"the other part is free: {hand.last['said']}")
        expect("fuse" in hand.act("glue at 0.02 0.005 0.005 1 0.0001")["said"], f"it does not reach so far: {hand.last['said']}")
        hand.act("glue at 0.02 0.005 0.005 1 0.0005", "hold low/5", "grab face high/6")
        frame = hand.act("0 0 0 -0.001")
        expect(not frame["said"], frame["said"])
        expect_same_run(url, frame)
        soft = frame["felt"][-1][2]
        frame = hand.act("material steel")
        expect_same_run(url, frame)  # the glue is as stiff as what it holds
        expect(frame["felt"][-1][2] > 20 * soft > 0, f"{soft} {frame['felt']}")
        # A part of its own material
        hand.act("undo")
        frame = hand.act("paint spring-steel high")
        expect(not frame["said"] and frame["painted"] == {"high": "spring-steel"} and frame["felt"][-1][2] > 1.5 * soft, f"{frame['said']} {frame['felt']}")
        expect_same_run(url, frame)
        expect(b'[parts."high"]' in saved(url, "scene.toml"), "its scene says so")
        expect("no part" in hand.act("paint steel hihg")["said"] and "butter" in hand.act("paint butter low")["said"], "refused by name")
        expect(abs(hand.act("undo")["felt"][-1][2] / soft - 1) < 1e-6 and hand.last["painted"] == {}, "undone")
        # Glued at one end only the two bend side by side.
        hand.act("undo", "undo", "undo", "undo")
        expect(not hand.last["undo"], "all is undone")
        hand.act("glue at 0 0.005 0.005 0.006 0.0005", "hold low/5", "grab face high/6")
        frame = hand.act("0 0 0 -0.001")
        expect(not frame["said"] and 0 < frame["felt"][-1][2] < 0.8 * soft, f"{frame['said']} {frame['felt']} {soft}")


def test_what_cannot_be_is_said_and_harms_nothing():
    bracket()
    with clay("bracket.step", "--size", "8 mm") as (url, process):
        hand = Hand(url, "0123456789abcdef")
        for lines, said in ((["hand 0 0 -0.001"], "no tool"), (["hold bracket/99"], "bracket/99"), (["grab at 5 5 5 0.001"], "no element"),
                            (["keep"], "kept"), (["material butter"], "butter"), (["hold bracket/1", "grab face bracket/1"], "is held")):
            frame = hand.act(*lines)
            expect(said in frame["said"], f"{lines}: {frame['said']!r}")
        hand.act("grab face bracket/2")
        frame = hand.act("0 -0.2 0 0")  # through the wall that holds it
        expect("does not follow" in frame["said"] and frame["residual"] <= 1e-8, f"it rests where it followed to: {frame['said']!r} {frame['residual']}")
        bad = ["", "hold x", "client 1", "client 0123456789abcdeF\n", "client 0123456789abcdef\nfly", "client 0123456789abcdef\nhand nan 0 0",
               "client 0123456789abcdef\nhand 1e9 0 0", "client 0123456789abcdef\ngrab at 0 0 0 -1",
               "client 0123456789abcdef\ncarve at 0 0 0", "client 0123456789abcdef\ncarve at 0 0 0 0", "client 0123456789abcdef\ncarve from 0 0 0", "client 0123456789abcdef\ncarve from 0 0 0 0", "client 0123456789abcdef\ncarve to 0 0", "client 0123456789abcdef\ncarve to 0 0 nan",
               "client 0123456789abcdef\ncancel now", "client 0123456789abcdef\nglue at 0 0 0 1", "client 0123456789abcdef\npaint steel", "client 0123456789abcdef\npaint  bracket",
               "client 0123456789abcdef\nglue at 0 0 0 1 nan", "client 0123456789abcdef\ncarve face bracket/1", "client 0123456789abcdef\nhold \x1b[31m",
               "client 0123456789abcdef\n0 1 2", "client 0123456789abcdef\nundo now", "client 0123456789abcdef\n" + 300 * "undo\n"]
        for content in bad:
            status, text = post(url, content)
            expect(status == 400 and text.count("\n") == 1, f"{content[:60]!r}: {status} {text!r}")
        expect(post(url, "client 0123456789abcdef\n" + "x" * 20000)[0] == 413, "a message that is too large")
        expect(post(url, b"\xff\xfe\x00" * 100)[0] == 400, "bytes that are no text")
        expect(post(url, "client 0123456789abcdef\nundo", Origin="http://evil.example")[0] == 403, "another page")
        for method, path, wanted in (("GET", "act", 404), ("POST", "live", 405), ("POST", "", 405), ("GET", "live", 503), ("GET", "save/part.exe", 404),
                                     ("GET", "save/../scene.toml", 404), ("GET", "save/scene-1.toml", 404)):
            status = ask(url, url.path + path, method)[0]
            expect(status == wanted, f"{method} {path}: {status}")
        expect(ask(url, "/" + 32 * "0" + "/act", "POST")[0] == 405, "another token has no acts")
        expect(hand.act("undo")["said"] == "", "it goes on")


def test_one_holds_the_tool_and_others_watch():
    bracket()
    with clay("bracket.step", "--size", "5 mm") as (url, _):
        first = Hand(url, 16 * "a")
        first.act("hold bracket/1")
        others = [Hand(url, f"{k:016x}") for k in range(10)]
        status, text = others[0].post("undo")
        expect(status == 409 and "another page" in text, f"{status} {text}")
        first.act("grab face bracket/2")
        first.act("hand 0 0 -0.002")
        for other in others:
            frame = other.settled(1)
            expect(list(frame["positions"]) == list(first.last["positions"]) and frame["holder"] == 8 * "a", "all see the same")
        others[1].act("take", "stay")
        expect(first.post("undo")[0] == 409, "the tool is taken")
        others[1].leave()  # vanishes with the tool in its hand
        end = time.monotonic() + 15
        while first.post("stay")[0] != 200:
            expect(time.monotonic() < end, "the tool is free again")
            time.sleep(0.1)
        expect(first.settled()["place"][-1][2] < -0.001, "and the part is where it was left")


def test_readers_that_sleep_or_vanish_hold_nothing_up():
    bracket()
    with clay("bracket.step", "--size", "3 mm") as (url, _):
        hand = Hand(url, 16 * "a")
        sleepers = []
        for k in range(10):
            sleeper = socket.create_connection((url.hostname, url.port))
            sleeper.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            sleeper.sendall(f"GET {url.path}live?client={k:016x} HTTP/1.1\r\nHost: {url.netloc}\r\n\r\n".encode())
            sleepers.append(sleeper)
        hand.act("hold bracket/1")
        hand.act("grab face bracket/2")
        for k in range(60):
            expect(hand.post(f"0 0 0 {-1e-5 * k}")[0] == 200, "acts get through")
            time.sleep(0.01)
            if k == 30:
                for sleeper in sleepers[:5]:
                    sleeper.close()
        frame = hand.act("0 0 0 -0.003")
        expect(frame["place"][-1][2] == -0.003 and hand.seen > 5, "the hand that is awake is served")
        for sleeper in sleepers[5:]:
            sleeper.close()


def test_many_acts_at_once_are_refused_not_kept():
    bracket()
    with clay("bracket.step", "--size", "10 mm") as (url, _):
        hand = Hand(url, 16 * "a")
        hand.act("hold bracket/1", "grab face bracket/2")
        statuses = [hand.post(*(["release", "undo"] * 100))[0] for _ in range(6)]
        expect(set(statuses) <= {200, 429} and 429 in statuses, f"{statuses}")
        expect(hand.settled()["said"] == "", "and it comes to rest")


def test_a_page_that_comes_back_keeps_the_tool():
    bracket()
    with clay("bracket.step", "--size", "10 mm") as (url, _):
        old = Hand(url, 16 * "a")
        old.act("hold bracket/1")
        again, other = Hand(url, 16 * "a"), Hand(url, 16 * "b")
        old.leave()  # its old connection ends after the new one has come
        end = time.monotonic() + 4
        while time.monotonic() < end:
            expect(other.post("stay")[0] == 409, "the tool stays with the page that came back")
            time.sleep(0.05)
        expect(again.post("stay")[0] == 200, "which goes on")
        again.leave()
        end = time.monotonic() + 8  # before the lease ends
        while other.post("stay")[0] != 200:
            expect(time.monotonic() < end, "its last connection frees the tool")
            time.sleep(0.05)


def test_what_is_saved_right_after_an_act_has_it():
    bracket()
    with clay("bracket.step", "--size", "10 mm") as (url, _):
        for _ in range(40):
            for act, there in (("hold bracket/1", True), ("undo", False)):
                expect(post(url, f"client {16 * 'a'}\n{act}")[0] == 200, act)
                expect((b"[[fix]]" in saved(url, "scene.toml")) == there, f"{act} is in what is saved")


LOAD = 'material = "PLA"\n{}[[fix]]\nwhere = "bracket/1"\n[[load]]\nwhere = "bracket/2"\nforce = ["0 N", "0 N", "-1 N"]\n{}'


def test_scenes_that_hands_cannot_go_with_are_refused():
    bracket()
    for run_keys, tables, said in (
            ("[run]\nmodes = 3\n", "", "modes"), ("[run]\nbuckling = 2\n", "", "buckling"), ("[run]\nrenormalise = true\n", "", "renormalise"),
            ("", '[thermal]\nchange = "80 K"\n', "[thermal]"), ("", '[shrinkage]\nlayer = "0.2 mm"\nalong = "-0.2 %"\nacross = "-0.3 %"\n', "[shrinkage]"),
            ("", '[[temperature]]\nwhere = "bracket/1"\nvalue = "100 degC"\n', "conduction"), ("run = { tolerance = 1e-8 }\n", "", "[run]")):
        write("scene.toml", LOAD.format(run_keys, tables))
        expect_error(run("flexel", "clay", "bracket.step", "--scene", "scene.toml", "--size", "10 mm"), "flexel", "scene.toml", said)
    write("scene.toml", 'material = "PLA"\n[thermal]\nchange = "80 K"\n')  # and where nothing is held yet
    expect_error(run("flexel", "clay", "bracket.step", "--scene", "scene.toml", "--size", "10 mm"), "flexel", "scene.toml", "[thermal]")
    write("scene.toml", 'material = "PLA"\nfix = [{ where = "bracket/1" }]\n')
    expect_error(run("flexel", "clay", "bracket.step", "--scene", "scene.toml", "--size", "10 mm"), "flexel", "scene.toml", "[[fix]]")


def test_a_kept_scene_has_one_run_table():
    bracket()
    write("scene.toml", LOAD.format("  \t[run] # mine\n  tolerance = 1e-8\n", ""))
    with clay("bracket.step", "--scene", "scene.toml", "--size", "10 mm") as (url, _):
        hand = Hand(url, 16 * "a")
        expect(not hand.act("grab face bracket/8", "keep")["said"], "the shape is kept")
        expect(saved(url, "scene-1.toml").count(b"[run]") == 1, "one [run]")
        saved(url, "rest.vtu")
    expect_ok(run("flexel-simulate", "scene-1.toml", "rest.vtu", "-o", "one.vtu", "--no-estimate"))


def test_arguments():
    bracket()
    write("time.toml", 'material = "PLA"\n[run]\ntime = "1 s"\n[[fix]]\nwhere = "bracket/1"\n[[load]]\nwhere = "bracket/2"\nforce = ["0 N", "0 N", "-1 N"]\n')
    refused = lambda *arguments: run("flexel", "clay", *arguments)
    expect_error(refused("none.step"), "flexel", "none.step")
    expect_error(refused("bracket.step", "--material", "butter"), "flexel", "butter")
    expect_error(refused("bracket.step", "--size", "1 mm", "--count", "5"), "flexel", "--count")
    expect_error(refused("bracket.step", "--scene", "time.toml"), "flexel", "run in time")
    expect_error(refused("bracket.step", "--scene", "time.toml", "--material", "ABS"), "flexel", "give one")
    write("load.toml", 'material = "PLA"\n[parts.bracket]\nmaterial = "PLA"\n[run]\ntolerance = 1e-8\n[[fix]]\nwhere = "bracket/1"\n[[load]]\nwhere = "bracket/2"\nforce = ["0 N", "0 N", "-50 N"]\n')
    with clay("bracket.step", "--scene", "load.toml", "--size", "5 mm") as (url, _):
        hand = Hand(url, 16 * "a")
        bent = hand.settled()["positions"]
        hand.act("grab face bracket/8")
        expect("the scene says" in hand.act("material ABS")["said"], "its material is the scene's")
        expect("[parts.bracket]" in hand.act("paint ABS bracket")["said"], "and that of its parts")
        saved(url, "part.stl")
        saved(url, "scene.toml")
        expect(max(abs(a - b) for a, b in zip(bent, hand.last["positions"])) < 1e-3, "the load acts on")
        expect(not hand.act("keep")["said"], "with a [run] of its own the shape is kept too")
        expect(b"renormalise = true" in saved(url, "scene-1.toml"), "and its scene says so")


if __name__ == "__main__":
    main(globals())

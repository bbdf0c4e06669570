"""Drives Chromium, headless, through chromedriver's HTTP interface (W3C WebDriver); nothing but the standard library."""

import base64
import contextlib
import json
import pathlib
import re
import shutil
import struct
import subprocess
import tempfile
import time
import urllib.request
import zlib

from harness import Skip, expect

FLAGS = ["--headless=new", "--no-sandbox", "--disable-gpu", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
         "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync",
         "--disable-default-apps", "--disable-extensions", "--disable-dev-shm-usage", "--mute-audio", "--force-device-scale-factor=1"]


class Browser:
    def __init__(self, driver, folder, size):
        self.driver, self.folder = driver, folder
        flags = [*FLAGS, f"--user-data-dir={folder}/profile", f"--window-size={size[0]},{size[1]}"]
        options = {"args": flags, "binary": shutil.which("chromium"),
                   "prefs": {"download.default_directory": f"{folder}/downloads", "download.prompt_for_download": False}}
        asked = {"capabilities": {"alwaysMatch": {"browserName": "chrome", "goog:chromeOptions": options,
                                                  "goog:loggingPrefs": {"browser": "ALL"}}}}
        self.session = self.call("POST", "/session", asked)["sessionId"]
        self.messages = []

    def call(self, method, path, content=None):
        data = None if content is None else json.dumps(content).encode()
        request = urllib.request.Request(self.driver + path, data, {"Content-Type": "application/json"}, method=method)
        try:
            with urllib.request.urlopen(request, timeout=60) as answer:
                return json.load(answer)["value"]
        except urllib.error.HTTPError as error:
            raise AssertionError(f"{path}: {json.load(error)['value']['message']}") from error

    def ask(self, method, path, content=None):
        return self.call(method, f"/session/{self.session}{path}", content)

    def open(self, url):
        """Loads a page of flexel view and waits until it has drawn."""
        self.ask("POST", "/url", {"url": url})
        self.wait("document.documentElement.dataset.ready !== undefined")
        expect(self.run("return document.documentElement.dataset.ready") == "yes",
               f"the page begins: {self.run('return document.body.innerText')[:300]} {self.console()}")

    def run(self, script, *arguments):
        """What a script returns; a promise is waited for."""
        return self.ask("POST", "/execute/sync", {"script": script, "args": list(arguments)})

    def wait(self, condition, seconds=20):
        end = time.monotonic() + seconds
        while not self.run(f"return !!({condition})"):
            expect(time.monotonic() < end, f"never: {condition}")
            time.sleep(0.05)

    def mouse(self, *steps, buttons=0):
        """steps: ("move", x, y), ("down",), ("up",); in pixels of the window."""
        kinds = {"move": lambda x, y: {"type": "pointerMove", "duration": 0, "x": round(x), "y": round(y)},
                 "down": lambda: {"type": "pointerDown", "button": buttons}, "up": lambda: {"type": "pointerUp", "button": buttons}}
        actions = [kinds[step[0]](*step[1:]) for step in steps]
        self.ask("POST", "/actions", {"actions": [{"type": "pointer", "id": "mouse", "parameters": {"pointerType": "mouse"}, "actions": actions}]})

    def click(self, x, y):
        self.mouse(("move", x, y), ("down",), ("up",))

    def drag(self, x, y, dx, dy):
        self.mouse(("move", x, y), ("down",), ("move", x + dx / 2, y + dy / 2), ("move", x + dx, y + dy), ("up",))

    def keys(self, text):
        presses = [{"type": kind, "value": key} for key in text for kind in ("keyDown", "keyUp")]
        self.ask("POST", "/actions", {"actions": [{"type": "key", "id": "keys", "actions": presses}]})

    def choose(self, control, value):
        """Sets a control of the page as a hand would: a value, and the event that follows."""
        self.run("""const box = document.getElementById(arguments[0]);
                    if (box.type === 'checkbox') { if (box.checked !== arguments[1]) box.click(); return; }
                    box.value = arguments[1];
                    for (const name of ['input', 'change']) box.dispatchEvent(new Event(name, {bubbles: true}));""", control, value)

    def text(self, control):
        return self.run("return document.getElementById(arguments[0]).innerText", control)

    def picture(self):
        """The page's own picture, as the button saves it: (width, height, rows of RGB bytes)."""
        data = self.run("""const blob = await flexelView.pictureBlob(flexelView.picture), reader = new FileReader();
                           return await new Promise(done => { reader.onload = () => done(reader.result); reader.readAsDataURL(blob); });""")
        return read_png(base64.b64decode(data.split(",")[1]))

    def screenshot(self, name):
        pathlib.Path(name).write_bytes(base64.b64decode(self.ask("GET", "/screenshot")))

    def console(self):
        """All that the page said to the console so far."""
        self.messages += [entry["message"] for entry in self.ask("POST", "/se/log", {"type": "browser"}) if entry["level"] != "INFO"]
        return self.messages


def read_png(data):
    """Rows of RGB bytes of an 8-bit PNG with or without opacity."""
    at, packed, size = 8, b"", None
    while at < len(data):
        length, kind = struct.unpack_from(">I4s", data, at)
        content = data[at + 8:at + 8 + length]
        size = struct.unpack(">IIBB", content[:10]) if kind == b"IHDR" else size
        packed += content if kind == b"IDAT" else b""
        at += 12 + length
    width, height, depth, colour = size
    expect(depth == 8 and colour in (2, 6), f"an 8-bit PNG: {size}")
    channels = 3 if colour == 2 else 4
    raw, rows, above = zlib.decompress(packed), [], bytes(channels * width)
    for y in range(height):
        start = y * (channels * width + 1)
        above = unfilter(raw[start], bytearray(raw[start + 1:start + 1 + channels * width]), above, channels)
        rows.append(above if channels == 3 else bytes(b for i, b in enumerate(above) if i % 4 < 3))
    return width, height, rows


def unfilter(kind, line, above, n):
    for i in range(len(line)):
        left, up, corner = (line[i - n] if i >= n else 0), above[i], (above[i - n] if i >= n else 0)
        if kind == 4:
            guess = left + up - corner
            nearest = min((abs(guess - left), 0, left), (abs(guess - up), 1, up), (abs(guess - corner), 2, corner))[2]
        else:
            nearest = (0, left, up, (left + up) // 2)[kind]
        line[i] = (line[i] + nearest) & 255
    return bytes(line)


@contextlib.contextmanager
def chromium(size=(1280, 800)):
    """A browser with an empty profile; the test is skipped where there is none."""
    for program in ("chromium", "chromedriver"):
        if shutil.which(program) is None:
            raise Skip(f"{program} is not installed")
    with tempfile.TemporaryDirectory(prefix="flexel-browser-", ignore_cleanup_errors=True) as folder:
        driver = subprocess.Popen(["chromedriver", "--port=0"], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        try:
            port = next(found[1] for line in driver.stdout if (found := re.search(r"started successfully on port (\d+)", line)))
            browser = Browser(f"http://127.0.0.1:{port}", folder, size)
            try:
                yield browser
            finally:
                browser.ask("DELETE", "")
        finally:
            driver.terminate()
            driver.wait(timeout=20)

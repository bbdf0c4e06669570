"""Drives Chromium, headless, through chromedriver's HTTP interface (W3C WebDriver); nothing but the standard library."""

import base64
import contextlib
import json
import pathlib
import re
import shutil
import subprocess
import tempfile
import time
import urllib.request

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

    def touch(self, *fingers, kind="touch"):
        """Each finger (or "pen") goes along its places (x, y), all at once."""
        inputs = []
        for k, places in enumerate(fingers):
            moves = [{"type": "pointerMove", "duration": 20, "x": round(x), "y": round(y)} for x, y in places]
            inputs.append({"type": "pointer", "id": f"{kind}{k}", "parameters": {"pointerType": kind},
                           "actions": [moves[0], {"type": "pointerDown", "button": 0}, *moves[1:], {"type": "pointerUp", "button": 0}]})
        self.ask("POST", "/actions", {"actions": inputs})

    def keys(self, text):
        presses = [{"type": kind, "value": key} for key in text for kind in ("keyDown", "keyUp")]
        self.ask("POST", "/actions", {"actions": [{"type": "key", "id": "keys", "actions": presses}]})

    def keys_with_control(self, key):
        held = [{"type": "keyDown", "value": "\ue009"}, *({"type": kind, "value": key} for kind in ("keyDown", "keyUp")), {"type": "keyUp", "value": "\ue009"}]
        self.ask("POST", "/actions", {"actions": [{"type": "key", "id": "keys", "actions": held}]})

    def choose(self, control, value):
        """Sets a control of the page as a hand would: a value, and the event that follows."""
        self.run("""const box = document.getElementById(arguments[0]);
                    if (box.type === 'checkbox') { if (box.checked !== arguments[1]) box.click(); return; }
                    box.value = arguments[1];
                    for (const name of ['input', 'change']) box.dispatchEvent(new Event(name, {bubbles: true}));""", control, value)

    def text(self, control):
        return self.run("return document.getElementById(arguments[0]).innerText", control)

    def picture(self):
        """What is in the page's own picture, the PNG that its button saves: width, height, share of pixels that are not paper, number of
        colours, and a number that tells pictures apart."""
        return self.run("""
            const bitmap = await createImageBitmap(await flexelView.pictureBlob(flexelView.picture)), {width, height} = bitmap;
            const context = Object.assign(document.createElement('canvas'), {width, height}).getContext('2d');
            context.drawImage(bitmap, 0, 0);
            const pixels = new Uint32Array(context.getImageData(0, 0, width, height).data.buffer), colours = new Set();
            let seen = 0, hash = 2166136261;
            for (const pixel of pixels) {
              hash = Math.imul(hash ^ pixel, 16777619);
              if (pixel === pixels[width - 1]) continue;
              ++seen;
              colours.add(pixel);
            }
            return {width, height, share: seen / pixels.length, colours: colours.size, hash};""")

    def screenshot(self, name):
        pathlib.Path(name).write_bytes(base64.b64decode(self.ask("GET", "/screenshot")))

    def console(self):
        """All that the page said to the console so far."""
        self.messages += [entry["message"] for entry in self.ask("POST", "/se/log", {"type": "browser"}) if entry["level"] != "INFO"]
        return self.messages


@contextlib.contextmanager
def chromium(size=(1000, 640)):
    """A browser with an empty profile, whose every pixel the processor draws; the test is skipped where there is none."""
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

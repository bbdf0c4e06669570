"""A screen that nobody sees, for tools that have to draw."""

import contextlib
import os
import subprocess

from harness import expect, need


@contextlib.contextmanager
def screen():
    """The environment variables of an X server of the caller's own.

    The server chooses its number itself. `xvfb-run -a` looks for a free one before it starts a server: of two at once, both may
    find the same, and one then draws on the other's screen and loses it when the other ends.
    """
    need("Xvfb")
    number, told = os.pipe()
    with open("screen.log", "wb") as log:
        # A test that is killed takes its server with it.
        server = subprocess.Popen(["setpriv", "--pdeathsig", "TERM", "Xvfb", "-displayfd", str(told), "-screen", "0", "1280x1024x24",
                                   "-nolisten", "tcp", "-noreset"], stdin=subprocess.DEVNULL, stdout=log, stderr=log, pass_fds=[told])
    os.close(told)
    try:
        with open(number, encoding="ascii") as answer:
            display = answer.readline().strip()
        with open("screen.log", encoding="utf-8", errors="replace") as log:
            expect(display, f"no screen: {log.read()}")
        yield {"DISPLAY": f":{display}", "LIBGL_ALWAYS_SOFTWARE": "1"}
    finally:
        server.terminate()
        server.wait()

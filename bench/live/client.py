"""A client of live runs (docs/guide/live.md): starts one, leads its tools, takes its frames apart."""

import array
import json
import os
import select
import socket
import subprocess
import sys
import time


class Frames:
    """Frames of a stream that is fed to it in pieces."""

    def __init__(self):
        self.buffer, self.header = b"", None

    def feed(self, data):
        """The frames that `data` completes: dictionaries, with `positions` (3 floats an element) where they have them."""
        self.buffer += data
        found = []
        while (end := self.buffer.find(b"\n")) >= 0:
            line = json.loads(self.buffer[:end])
            size = line.get("bytes", 0)
            if len(self.buffer) < end + 1 + size:
                break
            body, self.buffer = self.buffer[end + 1:end + 1 + size], self.buffer[end + 1 + size:]
            if self.header is None:
                if line.get("flexel-live") != 1:
                    raise ValueError(f"no stream of live frames: {line}")
                self.header = line
                continue
            if size:
                line["positions"] = array.array("f", body)
                if sys.byteorder == "big":
                    line["positions"].byteswap()
            found.append(line)
        return found


class Run:
    """A run of flexel-simulate with --live: poses to its stdin, frames from its stdout or a socket."""

    def __init__(self, *arguments, **options):
        self.process = subprocess.Popen(arguments, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, bufsize=0, **options)
        self.frames = Frames()
        self.source = self.process.stdout

    def attach(self, where, patience=60):
        """Takes the frames from ("127.0.0.1", port) or the path of a socket. Waits until it is there."""
        until = time.monotonic() + patience
        while True:
            self.source = socket.socket(socket.AF_INET if isinstance(where, tuple) else socket.AF_UNIX)
            try:
                return self.source.connect(where)
            except (ConnectionRefusedError, FileNotFoundError):
                self.source.close()
                if time.monotonic() > until or self.process.poll() is not None:
                    raise
                time.sleep(0.05)

    def pose(self, line):
        self.process.stdin.write(line.encode() + b"\n")

    def take(self, wait):
        """The frames that come within `wait` seconds (at least those of one piece); None at the end of the stream."""
        if not select.select([self.source], [], [], max(wait, 0))[0]:
            return []
        data = os.read(self.source.fileno(), 1 << 20)
        return self.frames.feed(data) if data else None

    def finish(self, timeout=60):
        """Exit code and what it said."""
        if not self.process.stdin.closed:
            self.process.stdin.close()
        while (self.source is self.process.stdout) and os.read(self.source.fileno(), 1 << 20):
            pass
        text = self.process.stderr.read().decode(errors="replace")
        return self.process.wait(timeout), text

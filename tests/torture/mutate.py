"""Damage: 1 to 4 changes of a file. Each is a list of (from, to, bytes) splices of the sound file, so that a finding can be told with
fewer of them."""

import re

TELLING = [b"nan", b"-inf", b"1e999", b"1e300", b"1e-300", b"-1", b"0", b"4294967296", b"-9223372036854775809", b"1e-320", b"", b"1,5", b"\x1b[31m",
           "\u202e".encode(), b"\xff", b"\x00", b"../../etc/passwd", b"/dev/zero", b"%n"]
SIZES = [0, 1, 0x7fffffff, 0xffffffff, 1 << 40, 0x7fffffffffffffff, 0xffffffffffffffff]


def change(data, random):
    """A splice (from, to, bytes) of the data."""
    at = random.randrange(len(data))
    length = min(len(data) - at, 1 + random.randrange(1 << random.randrange(12)))
    kind = random.randrange(8)
    if kind == 0:
        return at, at + 1, bytes([data[at] ^ 1 << random.randrange(8)])
    if kind == 1:
        return at, at + 1, bytes([random.choice(b"\0\xff\n <>\"=[]{}/-.,\\'#")])
    if kind == 2:
        found = re.compile(rb"[0-9][0-9.eE+-]*").search(data, at)
        return (*found.span(), random.choice(TELLING)) if found else (at, at + 1, b"")
    if kind == 3:
        width = random.choice((2, 4, 8))
        return at, min(len(data), at + width), (random.choice(SIZES) & ((1 << 8 * width) - 1)).to_bytes(width, "little")
    if kind == 4:
        return at, at + length, b""
    if kind == 5:
        return at, at, data[at:at + length] * random.choice((1, 1, 2, 50))
    if kind == 6:
        other = random.randrange(len(data))
        return at, min(len(data), at + length), data[other:other + length]
    return at, len(data), b""


def apply(data, changes):
    for begin, end, new in changes:
        data = data[:min(begin, len(data))] + new + data[min(end, len(data)):]
    return data


def changes(data, random):
    made = []
    for _ in range(random.randrange(1, 5)):
        if data:
            made.append(change(data, random))
            data = apply(data, made[-1:])
    return made

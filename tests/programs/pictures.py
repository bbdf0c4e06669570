"""PNG files by nothing but struct and zlib: 8-bit RGB."""

import struct
import zlib

from harness import expect


def read_png(data):
    """Width, height and rows of RGB bytes, by nothing but struct and zlib; every chunk's checksum is checked."""
    expect(data[:8] == b"\x89PNG\r\n\x1a\n", "the signature of a PNG")
    at, packed, size = 8, b"", None
    while at < len(data):
        (length,) = struct.unpack_from(">I", data, at)
        kind, content = data[at + 4 : at + 8], data[at + 8 : at + 8 + length]
        expect(struct.unpack_from(">I", data, at + 8 + length)[0] == zlib.crc32(kind + content), f"checksum of {kind}")
        if kind == b"IHDR":
            size = struct.unpack(">IIBBBBB", content)
        elif kind == b"IDAT":
            packed += content
        at += 12 + length
    width, height, depth, colour = size[:4]
    expect((depth, colour) == (8, 2), "8-bit RGB")
    raw, rows, above = zlib.decompress(packed), [], bytes(3 * width)
    for y in range(height):
        line = bytearray(raw[y * (3 * width + 1) : (y + 1) * (3 * width + 1)])
        above = unfilter(line[0], line[1:], above)
        rows.append(above)
    return width, height, rows


def unfilter(kind, line, above):
    for i in range(len(line)):
        left, up, corner = (line[i - 3] if i >= 3 else 0), above[i], (above[i - 3] if i >= 3 else 0)
        if kind == 4:
            guess = left + up - corner
            nearest = min((abs(guess - left), 0, left), (abs(guess - up), 1, up), (abs(guess - corner), 2, corner))[2]
        else:
            nearest = (0, left, up, (left + up) // 2)[kind]
        line[i] = (line[i] + nearest) & 255
    return bytes(line)


def write_png(width, height, rows):
    """The bytes of a file of these rows of RGB bytes, unfiltered."""
    def chunk(kind, content):
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    packed = zlib.compress(b"".join(b"\0" + row for row in rows))
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", packed) + chunk(b"IEND", b"")

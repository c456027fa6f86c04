"""Readers of what the tests compare: PNG and EXR files of packtrace, and the frame buffer of Xvfb."""

import struct
import zlib


class Picture:
    """8-bit RGB pixels, rows from top to bottom."""

    def __init__(self, width, height, rgb):
        self.width, self.height, self.rgb = width, height, bytes(rgb)

    def pixel(self, x, y):
        at = 3 * (y * self.width + x)
        return tuple(self.rgb[at:at + 3])

    def part(self, x0, y0, x1, y1):
        """The pixels of a rectangle, as bytes."""
        return b"".join(self.rgb[3 * (y * self.width + x0):3 * (y * self.width + x1)] for y in range(y0, y1))


def _unfilter(kind, row, above, step):
    """Undoes a PNG row filter (PNG specification, section 9) in place."""
    for i in range(len(row)):
        left, up = row[i - step] if i >= step else 0, above[i]
        corner = above[i - step] if i >= step else 0
        if kind == 1:
            guess = left
        elif kind == 2:
            guess = up
        elif kind == 3:
            guess = (left + up) // 2
        elif kind == 4:
            p = left + up - corner
            guess = min((abs(p - left), 0, left), (abs(p - up), 1, up), (abs(p - corner), 2, corner))[2]
        else:
            return
        row[i] = (row[i] + guess) & 255


def read_png(path):
    """A PNG file with 8 bits per channel, grey or RGB, with or without alpha, which is left out."""
    with open(path, "rb") as file:
        data = file.read()
    assert data[:8] == b"\x89PNG\r\n\x1a\n", path
    at, packed, header = 8, b"", None
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        if kind == b"IHDR":
            header = struct.unpack(">IIBBBBB", data[at + 8:at + 8 + length])
        elif kind == b"IDAT":
            packed += data[at + 8:at + 8 + length]
        at += 12 + length
    width, height, bits, color = header[:4]
    channels = {0: 1, 2: 3, 4: 2, 6: 4}[color]
    assert bits == 8 and header[6] == 0, (path, header)
    raw, stride = zlib.decompress(packed), width * channels
    above, rgb = bytearray(stride), bytearray()
    for y in range(height):
        begin = y * (stride + 1)
        row = bytearray(raw[begin + 1:begin + 1 + stride])
        _unfilter(raw[begin], row, above, channels)
        for x in range(width):
            pixel = row[x * channels:(x + 1) * channels]
            rgb += pixel[:3] if channels >= 3 else bytes([pixel[0]]) * 3
        above = row
    return Picture(width, height, rgb)


def _exr_header(data):
    """The attributes of a scan-line EXR file by name, and where its offset table begins."""
    assert struct.unpack("<II", data[:8]) == (20000630, 2), "not a scan-line EXR file"

    def text(at):
        end = data.index(b"\0", at)
        return data[at:end].decode(), end + 1

    at, attributes = 8, {}
    while data[at]:
        name, at = text(at)
        _, at = text(at)
        (size,) = struct.unpack("<I", data[at:at + 4])
        attributes[name] = data[at + 4:at + 4 + size]
        at += 4 + size
    return attributes, at + 1


def _exr_block(block, size):
    """Undoes the ZIP compression of an EXR block (technical introduction to OpenEXR)."""
    if len(block) == size:
        return block  # stored as it is, because compression would not make it smaller
    delta = bytearray(zlib.decompress(block))
    for i in range(1, len(delta)):
        delta[i] = (delta[i - 1] + delta[i] - 128) & 255
    half = (len(delta) + 1) // 2
    out = bytearray(len(delta))
    out[0::2], out[1::2] = delta[:half], delta[half:]
    return bytes(out)


def read_exr_pixel(path, x, y):
    """The channels of one pixel of an EXR file that packtrace wrote, by name."""
    with open(path, "rb") as file:
        data = file.read()
    attributes, table = _exr_header(data)
    x0, y0, x1, y1 = struct.unpack("<iiii", attributes["dataWindow"])
    width, height = x1 - x0 + 1, y1 - y0 + 1
    lines = {0: 1, 2: 1, 3: 16}[attributes["compression"][0]]
    channels, at, text = [], 0, attributes["channels"]
    while text[at]:
        end = text.index(b"\0", at)
        (kind,) = struct.unpack("<i", text[end + 1:end + 5])
        channels.append((text[at:end].decode(), kind))  # 0: uint, 1: half, 2: float
        at = end + 17
    bytes_of = {0: 4, 1: 2, 2: 4}
    line_bytes = width * sum(bytes_of[kind] for _, kind in channels)
    (offset,) = struct.unpack("<Q", data[table + 8 * (y // lines):table + 8 * (y // lines) + 8])
    first, size = struct.unpack("<iI", data[offset:offset + 8])
    count = min(lines, height - (first - y0))
    block = _exr_block(data[offset + 8:offset + 8 + size], line_bytes * count)
    at, values = line_bytes * (y + y0 - first), {}
    for name, kind in channels:
        code = {0: "<I", 1: "<e", 2: "<f"}[kind]
        begin = at + bytes_of[kind] * x
        values[name] = struct.unpack(code, block[begin:begin + bytes_of[kind]])[0]
        at += bytes_of[kind] * width
    return values


def read_xwd(path):
    """The frame buffer that Xvfb keeps in a file (-fbdir), 32 bits per pixel."""
    with open(path, "rb") as file:
        data = file.read()
    header = struct.unpack(">25I", data[:100])
    header_bytes, width, height, order, bits, line, colors = (header[0], header[4], header[5], header[7], header[11],
                                                              header[12], header[19])
    assert bits == 32 and order == 0, header
    at, rgb = header_bytes + 12 * colors, bytearray(3 * width * height)
    for y in range(height):
        row = data[at + y * line:at + y * line + 4 * width]
        begin, end = 3 * width * y, 3 * width * (y + 1)
        rgb[begin:end:3], rgb[begin + 1:end:3], rgb[begin + 2:end:3] = row[2::4], row[1::4], row[0::4]
    return Picture(width, height, rgb)

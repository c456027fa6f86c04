#!/usr/bin/env python3
"""Writes the textures of textured.pbrt: bricks.png, planks.png, globe.png, leaf.png. The same bytes every time."""
import math
import struct
import zlib


def noise(x, y, seed):
    """Value noise in [0, 1], period 8 in x and y."""
    def lattice(i, j):
        n = (i % 8) * 374761393 + (j % 8) * 668265263 + seed * 2147483647
        n = (n ^ (n >> 13)) * 1274126177 & 0xFFFFFFFF
        return ((n ^ (n >> 16)) & 0xFFFF) / 65535.0

    i, j = math.floor(x), math.floor(y)
    fx, fy = x - i, y - j
    sx, sy = fx * fx * (3 - 2 * fx), fy * fy * (3 - 2 * fy)
    top = lattice(i, j) * (1 - sx) + lattice(i + 1, j) * sx
    bottom = lattice(i, j + 1) * (1 - sx) + lattice(i + 1, j + 1) * sx
    return top * (1 - sy) + bottom * sy


def fractal(u, v, seed, octaves=4):
    """Period 1 in u and v."""
    return sum(noise(u * 8 * 2**k, v * 8 * 2**k, seed + k) / 2 ** (k + 1) for k in range(octaves)) / (1 - 0.5**octaves)


def bricks(u, v):
    row = math.floor(v * 8)
    column = u * 4 + 0.5 * (row % 2)
    edge = min(column % 1.0, 1 - column % 1.0) / 4, min(v * 8 % 1.0, 1 - v * 8 % 1.0) / 8
    grain = fractal(u, v, 3)
    if min(edge) < 0.008:
        return 0.62 + 0.2 * grain, 0.60 + 0.2 * grain, 0.56 + 0.2 * grain
    tone = noise(math.floor(column) % 4 * 1.7 + 0.5, row * 1.3 + 0.5, 9)
    light = 0.55 + 0.35 * grain + 0.25 * tone
    return 0.72 * light, 0.34 * light + 0.05 * tone, 0.26 * light


def planks(u, v):
    plank = math.floor(u * 5)
    rings = 0.5 + 0.5 * math.sin(2 * math.pi * (6 * u + 3 * fractal(u, v * 0.25, 20 + plank)))
    light = 0.6 + 0.4 * rings * fractal(u * 1.0, v, 31)
    if u * 5 % 1.0 < 0.04:
        light *= 0.4
    return 0.75 * light, 0.52 * light, 0.30 * light


def globe(u, v):
    height = fractal(u, v, 41, 5) - 0.5
    polar = abs(v - 0.5) * 2
    if polar > 0.82 + height * 0.3:
        return 0.93, 0.95, 0.97
    if height > 0.03:
        green = min(1.0, (height - 0.03) * 6)
        return 0.25 + 0.45 * green, 0.45 + 0.1 * green, 0.18 + 0.15 * green
    depth = min(1.0, -(height - 0.03) * 5)
    return 0.12 - 0.06 * depth, 0.38 - 0.18 * depth, 0.62 - 0.2 * depth


def leaf(u, v):
    x, y = 2 * u - 1, v
    half = 0.85 * math.sin(math.pi * y) ** 0.8
    if abs(x) > half:
        return 0.0, 0.0, 0.0
    vein = min(abs(x), abs((y * 7 - abs(x) * 2.5) % 1.0 - 0.5) * 0.5)
    light = 0.7 + 0.3 * fractal(u, v, 51)
    return (0.30 + (0.35 if vein < 0.04 else 0.0)) * light, 0.62 * light, 0.16 * light


def write_png(name, width, height, colour):
    rows = bytearray()
    for y in range(height):
        rows.append(0)
        for x in range(width):
            texel = colour((x + 0.5) / width, 1 - (y + 0.5) / height)
            rows += bytes(max(0, min(255, round(255 * c))) for c in texel)

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    with open(name, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)) +
                   chunk(b"IDAT", zlib.compress(bytes(rows), 9)) + chunk(b"IEND", b""))


if __name__ == "__main__":
    write_png("bricks.png", 128, 128, bricks)
    write_png("planks.png", 96, 128, planks)
    write_png("globe.png", 256, 128, globe)
    write_png("leaf.png", 33, 61, leaf)

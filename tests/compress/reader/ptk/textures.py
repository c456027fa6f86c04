"""Decodes textures."""

import struct


def rgb_of_565(number):
    red, green, blue = number >> 11, number >> 5 & 63, number & 31
    return red << 3 | red >> 2, green << 2 | green >> 4, blue << 3 | blue >> 2


def bc1_colours(first, second):
    a, b = rgb_of_565(first), rgb_of_565(second)
    if first > second:
        return a, b, [(2 * x + y + 1) // 3 for x, y in zip(a, b)], [(x + 2 * y + 1) // 3 for x, y in zip(a, b)]
    return a, b, [(x + y + 1) // 2 for x, y in zip(a, b)], (0, 0, 0)


def read_texels(texture, data):
    """Returns the texels row by row from the top, three values each."""
    width, height, codec = texture["width"], texture["height"], texture["codec"]
    if codec == 0:
        return list(data[: 3 * width * height])
    if codec == 1:
        return [data[3 * number + c] for number in data[768 : 768 + width * height] for c in range(3)]
    if codec == 2:
        low, high = data[0:3], data[3:6]
        levels = [((code >> 6, 3), (code >> 2 & 15, 15), (code & 3, 3)) for code in data[6 : 6 + width * height]]
        return [(low[c] * (n - q) + high[c] * q + n // 2) // n for texel in levels for c, (q, n) in enumerate(texel)]
    texels = []
    for y in range(height):
        for x in range(width):
            block = 8 * (y // 4 * ((width + 3) // 4) + x // 4)
            colours = bc1_colours(*struct.unpack_from("<HH", data, block))
            texels += colours[data[block + 4 + y % 4] >> 2 * (x % 4) & 3]
    return texels

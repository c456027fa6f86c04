"""Pages of codec small."""


def decode_page(page, geometries):
    raise NotImplementedError

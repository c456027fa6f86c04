"""Decompresses zstd frames with the C library, since Python's standard library cannot."""

import ctypes
import ctypes.util
import functools

from ptk.records import BadFile

GROWTH = 1 << 15  # maximum ratio of a decoded size to its size on disk


@functools.cache
def library():
    zstd = ctypes.CDLL(ctypes.util.find_library("zstd") or "libzstd.so.1")
    zstd.ZSTD_decompress.restype = ctypes.c_size_t
    zstd.ZSTD_decompress.argtypes = (ctypes.c_char_p, ctypes.c_size_t, ctypes.c_char_p, ctypes.c_size_t)
    zstd.ZSTD_getFrameContentSize.restype = ctypes.c_ulonglong
    zstd.ZSTD_getFrameContentSize.argtypes = (ctypes.c_char_p, ctypes.c_size_t)
    return zstd


def decompress(frame, size=None):
    """Returns the content of a frame. @param size its expected size; None: the size that the frame states"""
    stated = library().ZSTD_getFrameContentSize(frame, len(frame))
    if size is None:
        size = stated
    if size > GROWTH * len(frame):
        raise BadFile("a frame of more bytes than a file may ask for")
    out = ctypes.create_string_buffer(size)
    if library().ZSTD_decompress(out, size, frame, len(frame)) != size:
        raise BadFile("a zstd frame does not hold the bytes that it should")
    return out.raw

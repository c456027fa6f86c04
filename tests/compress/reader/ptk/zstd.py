"""zstd frames, through the C library: the one thing of the disk form that the standard library lacks."""

import ctypes
import ctypes.util

from ptk.records import BadFile

GROWTH = 1 << 15  # no size may exceed this many times the bytes it comes from


def load():
    library = ctypes.CDLL(ctypes.util.find_library("zstd") or "libzstd.so.1")
    library.ZSTD_decompress.restype = ctypes.c_size_t
    library.ZSTD_decompress.argtypes = (ctypes.c_char_p, ctypes.c_size_t, ctypes.c_char_p, ctypes.c_size_t)
    library.ZSTD_getFrameContentSize.restype = ctypes.c_ulonglong
    library.ZSTD_getFrameContentSize.argtypes = (ctypes.c_char_p, ctypes.c_size_t)
    return library


LIBRARY = load()


def decompress(frame, size=None):
    """The bytes of a frame: `size`, or where that is None as many as the frame says."""
    stated = LIBRARY.ZSTD_getFrameContentSize(frame, len(frame))
    if size is None:
        size = stated
    if size > GROWTH * len(frame):
        raise BadFile("a frame of more bytes than a file may ask for")
    out = ctypes.create_string_buffer(size)
    if LIBRARY.ZSTD_decompress(out, size, frame, len(frame)) != size:
        raise BadFile("a zstd frame does not hold the bytes that it should")
    return out.raw

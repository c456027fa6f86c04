"""Drops a file on a window, as a file manager does: the source's side of the XDND protocol, version 5, through Xlib."""

import ctypes
import ctypes.util
import struct
import time

SELECTION_REQUEST, SELECTION_NOTIFY, CLIENT_MESSAGE = 30, 31, 33


def _xlib():
    x = ctypes.CDLL(ctypes.util.find_library("X11") or "libX11.so.6")
    x.XOpenDisplay.restype = ctypes.c_void_p
    for function in (x.XDefaultRootWindow, x.XCreateSimpleWindow, x.XInternAtom):
        function.restype = ctypes.c_ulong
    return x


class FileDrop:
    """A source of one file name. Events are packed by the layouts of Xlib.h on machines with 64-bit pointers."""

    def __init__(self, display_name, uri):
        self.x = _xlib()
        self.display = ctypes.c_void_p(self.x.XOpenDisplay(display_name.encode()))
        assert self.display.value, display_name
        root = self.x.XDefaultRootWindow(self.display)
        zero = ctypes.c_ulong(0)
        self.window = self.x.XCreateSimpleWindow(self.display, ctypes.c_ulong(root), 0, 0, 1, 1, 0, zero, zero)
        self.uri = (uri + "\r\n").encode()
        self.x.XSetSelectionOwner(self.display, self._atom("XdndSelection"), ctypes.c_ulong(self.window), zero)

    def _atom(self, name):
        return ctypes.c_ulong(self.x.XInternAtom(self.display, name.encode(), 0))

    def _send(self, window, event):
        buffer = ctypes.create_string_buffer(event, 192)
        self.x.XSendEvent(self.display, ctypes.c_ulong(window), 0, ctypes.c_long(0), buffer)
        self.x.XFlush(self.display)

    def _tell(self, window, message, *data):
        words = [self.window, *data] + [0] * (4 - len(data))
        self._send(window, struct.pack("@iLiPLLi5l", CLIENT_MESSAGE, 0, 1, self.display.value, window,
                                       self._atom(message).value, 32, *words))

    def _answer_request(self):
        """Gives the file name to who asks for it. Returns whether somebody did."""
        event = ctypes.create_string_buffer(192)
        while self.x.XPending(self.display):
            self.x.XNextEvent(self.display, event)
            kind, _, _, _, _, requestor, selection, target, place, when = struct.unpack_from("@iLiPLLLLLL", event.raw)
            if kind != SELECTION_REQUEST:
                continue
            self.x.XChangeProperty(self.display, ctypes.c_ulong(requestor), ctypes.c_ulong(place), ctypes.c_ulong(target), 8,
                                   0, self.uri, len(self.uri))
            self._send(requestor, struct.pack("@iLiPLLLLL", SELECTION_NOTIFY, 0, 1, self.display.value, requestor,
                                              selection, target, place, when))
            return True
        return False

    def drop_on(self, window, x, y, seconds):
        self._tell(window, "XdndEnter", 5 << 24, self._atom("text/uri-list").value)
        self._tell(window, "XdndPosition", 0, x << 16 | y, 0, self._atom("XdndActionCopy").value)
        self._tell(window, "XdndDrop", 0, 0)
        end = time.monotonic() + seconds
        while not self._answer_request():
            assert time.monotonic() < end, "nobody asks for the dropped file"
            time.sleep(0.02)

    def close(self):
        self.x.XCloseDisplay(self.display)

"""A display of its own, and packtrace view on it."""

import json
import os
import queue
import re
import select
import shutil
import subprocess
import tempfile
import threading
import time

from drop import FileDrop
from pictures import read_xwd

PATIENCE_S = 60  # for whatever takes milliseconds on an idle machine


def wait_until(what, condition, seconds=PATIENCE_S):
    """Returns the condition's first value that is true. `what` is waited for, for the message."""
    end = time.monotonic() + seconds
    while True:
        value = condition()
        if value:
            return value
        if time.monotonic() > end:
            raise AssertionError(f"waited {seconds} s in vain for {what}")
        time.sleep(0.02)


class Display:
    """Xvfb, under a number that is free, with OpenGL by software."""

    WIDTH, HEIGHT = 1024, 768

    def __init__(self):
        self.folder = tempfile.mkdtemp(prefix="packtrace_display_")
        reader, writer = os.pipe()
        self.server = subprocess.Popen(
            ["Xvfb", "-displayfd", str(writer), "-screen", "0", f"{self.WIDTH}x{self.HEIGHT}x24", "-fbdir", self.folder,
             "-nolisten", "tcp", "-noreset"], pass_fds=[writer], stderr=subprocess.DEVNULL)
        os.close(writer)
        with os.fdopen(reader) as numbers:
            ready, _, _ = select.select([numbers], [], [], PATIENCE_S)
            number = numbers.readline().strip() if ready else ""
        if not number:
            self.close()
            raise AssertionError("Xvfb does not start")
        self.environment = dict(os.environ, DISPLAY=f":{number}", LIBGL_ALWAYS_SOFTWARE="1")

    def screen(self):
        return read_xwd(os.path.join(self.folder, "Xvfb_screen0"))

    def xdotool(self, *words):
        done = subprocess.run(["xdotool", *map(str, words)], env=self.environment, capture_output=True, text=True,
                              timeout=PATIENCE_S, check=False)
        return done.stdout.strip() if done.returncode == 0 else ""

    def close(self):
        self.server.terminate()
        self.server.wait()
        shutil.rmtree(self.folder, ignore_errors=True)


class Viewer:
    """packtrace view in a window. Saved files go to its folder."""

    def __init__(self, display, program, arguments, folder, size="320x180", wait=True):
        self.display, self.program, self.folder = display, program, folder
        self.errors = open(os.path.join(folder, "errors.txt"), "w+", encoding="utf-8")
        self.process = subprocess.Popen([program, "view", *arguments, "--size", size], cwd=folder,
                                        env=display.environment, stdout=subprocess.PIPE, stderr=self.errors, text=True)
        self.lines, self.seen, self.drops = queue.Queue(), [], []
        self.reader = threading.Thread(target=self._read, daemon=True)
        self.reader.start()
        self.window = wait_until("the window", self._find_window)
        self.display.xdotool("windowmove", self.window, 0, 0)
        if wait:
            self.still(2)

    def _read(self):
        for line in self.process.stdout:
            self.lines.put(json.loads(line))

    def _find_window(self):
        if self.process.poll() is not None:
            raise AssertionError(f"view ended with {self.process.returncode}: {self.error_text()}")
        return self.display.xdotool("search", "--class", "packtrace").split("\n")[0]

    def error_text(self):
        self.errors.flush()
        with open(self.errors.name, encoding="utf-8") as file:
            return file.read()

    # What the window says.

    def title(self):
        return self.display.xdotool("getwindowname", self.window)

    def still_frames(self):
        found = re.search(r" - (\d+) frames$", self.title())
        return int(found.group(1)) if found else 0

    def still(self, frames):
        """Waits until the still picture has as many frames."""
        return wait_until(f"{frames} frames of a still picture ({self.title()})", lambda: self.still_frames() >= frames)

    def moving(self):
        return wait_until("a moving picture", lambda: self.title().endswith(" - moving"))

    def size(self):
        """Width and height that the window has now."""
        found = re.findall(r"(?:WIDTH|HEIGHT)=(\d+)", self.display.xdotool("getwindowgeometry", "--shell", self.window))
        return tuple(map(int, found)) if len(found) == 2 else None

    def printed(self, key, wanted=lambda line: True):
        """The next printed line with this key, of those that nobody waited for yet."""
        end = time.monotonic() + PATIENCE_S
        while True:
            for i, line in enumerate(self.seen):
                if key in line and wanted(line):
                    return self.seen.pop(i)
            try:
                self.seen.append(self.lines.get(timeout=max(0.01, end - time.monotonic())))
            except queue.Empty:
                raise AssertionError(f"no {key} was printed, but {self.seen}; {self.error_text()}") from None

    def message(self, part):
        return self.printed("message", lambda line: part in line["message"])["message"]

    # What people do with it.

    def _xdotool(self, *words):
        self.display.xdotool("windowfocus", "--sync", self.window, *words)

    def press(self, *keys):
        self._xdotool("key", *keys)

    def hold(self, key):
        self._xdotool("keydown", key)

    def release(self, key):
        self._xdotool("keyup", key)

    def drag(self, start, end, button=1):
        self._xdotool("mousemove", *start, "mousedown", button)
        for step in range(1, 5):
            self._xdotool("mousemove", *(round(a + (b - a) * step / 4) for a, b in zip(start, end)))
        self._xdotool("mouseup", button)

    def click(self, x, y, count=1):
        self._xdotool("mousemove", x, y, "click", "--repeat", count, "--delay", 50, 1)

    def drop(self, file):
        """Drops a file on the window."""
        source = FileDrop(self.display.environment["DISPLAY"], "file://" + file)
        self.drops.append(source)  # the window answers it until it ends
        source.drop_on(int(self.window), 100, 100, PATIENCE_S)

    def pick(self, x, y):
        """Clicks until the picture stands still. Returns the printed pick, and the command."""
        def clicked():
            self.click(x, y)
            line = self.printed("pick")
            time.sleep(0.35)  # the next click is no double click
            return (line["pick"], line["command"]) if line["command"] else None

        return wait_until("a still picture", clicked)

    def resize(self, width, height):
        self.display.xdotool("windowsize", self.window, width, height)

    def _saved(self):
        line = self.printed("screenshot")
        return line["command"], [os.path.join(self.folder, name) for name in line["screenshot"]]

    def screenshot(self):
        """Presses P until the picture stands still. Returns the words of the command and the files."""
        def pressed():
            self.press("p")
            saved = self._saved()
            return saved if saved[0] else None

        return wait_until("a still picture", pressed)

    def split_screenshot(self):
        """Presses P. Returns the commands and files of both views, and the file of the screen."""
        self.press("p")
        return self._saved(), self._saved(), os.path.join(self.folder, self.printed("screen")["screen"])

    def camera(self):
        """The camera of the command."""
        command = self.screenshot()[0]
        return command[command.index("--camera") + 1]

    def shown(self):
        """The command of what is shown, as text."""
        return " ".join(self.screenshot()[0])

    # The end.

    def wait_for_end(self, seconds=PATIENCE_S):
        """The exit code."""
        return self.process.wait(timeout=seconds)

    def close(self):
        """Ends it for sure."""
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        for source in self.drops:
            source.close()
        self.reader.join(timeout=PATIENCE_S)
        self.process.stdout.close()
        self.errors.close()

"""What the tests of the window share."""

import os
import shutil
import subprocess
import tempfile
import unittest

from viewer import PATIENCE_S, Display, Viewer


def read_bytes(path):
    with open(path, "rb") as file:
        return file.read()


class WindowTest(unittest.TestCase):
    """A display and baked scenes for all tests, and a folder and viewers for each."""

    program, sources = "", ""  # set by window_test.py

    @classmethod
    def setUpClass(cls):
        cls.display = Display()
        cls.baked = tempfile.mkdtemp(prefix="packtrace_baked_")
        for name, source in {"room": "room/room.pbrt", "textured": "textured/textured.pbrt",
                             "moving": "features/animated_transform.pbrt"}.items():
            subprocess.run([cls.program, "bake", os.path.join(cls.sources, "assets", source), "-o", os.path.join(cls.baked, name + ".ptk"), "-q"], check=True)
        subprocess.run([cls.program, "bake", os.path.join(cls.sources, "assets", "features/instances.pbrt"), "-o", os.path.join(cls.baked, "lit.ptk"), "--for", "shading", "-q"], check=True)

    @classmethod
    def tearDownClass(cls):
        cls.display.close()
        shutil.rmtree(cls.baked, ignore_errors=True)

    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="packtrace_window_")
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)

    def scene(self, name):
        return os.path.join(self.sources, "assets", name)

    def file(self, name):
        return os.path.join(self.baked, name + ".ptk")

    def open(self, *arguments, **options):
        viewer = Viewer(self.display, self.program, arguments, self.folder, **options)
        self.addCleanup(viewer.close)
        return viewer

    def run_words(self, words):
        return subprocess.run(words, cwd=self.folder, capture_output=True, text=True, timeout=PATIENCE_S, check=False)

    def expect_bytes_of_render(self, command, files):
        """Runs the command that the view stated, with other files, and compares them."""
        self.assertEqual(command[:2], ["packtrace", "render"])
        again = [os.path.join(self.folder, "again" + os.path.splitext(name)[1]) for name in files]
        outputs = [word for name in again for word in ("-o", name)]
        done = self.run_words([self.program, *command[1:], *outputs, "--force", "-q"])
        self.assertEqual(done.returncode, 0, done.stderr)
        for name, other in zip(files, again):
            self.assertTrue(read_bytes(name) == read_bytes(other), f"{name} differs from {' '.join(command)}")

    def end(self, viewer):
        viewer.press("Escape")
        self.assertEqual(viewer.wait_for_end(), 0, viewer.error_text())

    def screen(self, viewer):
        """The window's pixels on the screen; it lies in the corner."""
        screen, (width, height) = self.display.screen(), viewer.size()
        return screen.part(0, 0, min(width, screen.width), min(height, screen.height))

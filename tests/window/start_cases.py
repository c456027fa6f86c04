"""The window opens, or says why it cannot."""

import os
import struct
import subprocess

from viewer import PATIENCE_S
from window_case import WindowTest


class Start(WindowTest):
    def test_names_the_file_while_it_loads_and_then_shows_frames(self):
        viewer = self.open(self.file("room"), wait=False)
        self.assertRegex(viewer.title(), r"packtrace")
        viewer.still(2)
        self.assertRegex(viewer.title(), r"room\.ptk - packtrace - \d+ fps, [\d.]+ ms - (AVX-512|AVX2|scalar) - 320 x 180, 1 spp - ")
        colors = set(struct.iter_unpack("3B", self.screen(viewer)))
        self.assertGreater(len(colors), 20)
        self.end(viewer)

    def test_imports_a_scene(self):
        viewer = self.open(self.scene("features/materials.pbrt"))
        self.expect_bytes_of_render(*viewer.screenshot())
        self.end(viewer)

    def test_settings_come_back(self):
        viewer = self.open(self.file("room"))
        viewer.hold("d")
        viewer.moving()
        viewer.release("d")
        camera = viewer.camera()
        self.end(viewer)
        for version, problem in ((1, ""), (2, "settings.toml:1:11: only version 1 can be read")):
            with open(os.path.join(self.folder, "settings.toml"), "w", encoding="utf-8") as file:
                file.write(f'version = {version}\n[view]\nsplit = "divider"\ncamera = "{camera.removeprefix("lookat:")}"\n'
                           '[first]\nview = "ao_raw"\n')
            if problem:
                done = subprocess.run([self.program, "view", self.file("room"), "--settings", "settings.toml"], cwd=self.folder,
                                      env=self.display.environment, capture_output=True, text=True, timeout=PATIENCE_S,
                                      check=False)
                self.assertEqual(done.returncode, 3)
                self.assertIn(problem, done.stderr)
            else:
                viewer = self.open(self.file("room"), "--settings", "settings.toml")
                (command, files), _, _ = viewer.split_screenshot()
                self.assertIn(camera, command)
                self.assertIn("ao_raw", command)
                self.assertIn("-first", files[0])
                self.end(viewer)

    def test_settings_that_are_garbage_are_refused(self):
        with open(os.path.join(self.folder, "garbage.toml"), "wb") as file:
            file.write(bytes(range(256)))
        done = subprocess.run([self.program, "view", self.file("room"), "--settings", "garbage.toml"], cwd=self.folder,
                              env=self.display.environment, capture_output=True, text=True, timeout=PATIENCE_S, check=False)
        self.assertEqual(done.returncode, 3)
        self.assertIn("garbage.toml:1:1: ", done.stderr)

    def test_files_that_cannot_be_read_end_it(self):
        with open(os.path.join(self.folder, "garbage.ptk"), "wb") as file:
            file.write(b"garbage" * 100)
        for name in ("garbage.ptk", "none.ptk"):
            done = subprocess.run([self.program, "view", name], cwd=self.folder, env=self.display.environment,
                                  capture_output=True, text=True, timeout=PATIENCE_S, check=False)
            self.assertEqual(done.returncode, 3, done.stderr)
            self.assertIn(name, done.stderr)

    def test_it_needs_no_float_pixels(self):
        # Without ARB_texture_float Mesa offers no OpenGL 3.3 and crashes when it is asked for.
        self.display.environment["MESA_EXTENSION_OVERRIDE"] = "-GL_ARB_half_float_pixel -GL_ARB_color_buffer_float"
        self.addCleanup(self.display.environment.pop, "MESA_EXTENSION_OVERRIDE")
        viewer = self.open(self.file("room"))
        viewer.press("BackSpace")
        viewer.still(4)
        self.assertGreater(len(set(struct.iter_unpack("3B", self.screen(viewer)))), 20)
        self.end(viewer)

    def test_without_a_display_it_says_what_to_do(self):
        environment = {name: value for name, value in self.display.environment.items() if name != "DISPLAY"}
        old_opengl = dict(self.display.environment, MESA_GL_VERSION_OVERRIDE="2.1")
        for changed in (environment, dict(environment, DISPLAY=":9876"), old_opengl):
            done = subprocess.run([self.program, "view", self.file("room")], env=changed, capture_output=True, text=True,
                                  timeout=PATIENCE_S, check=False)
            self.assertEqual(done.returncode, 4, done.stderr)
            self.assertIn("--headless SCRIPT", done.stderr)
            self.assertIn("xvfb-run", done.stderr)

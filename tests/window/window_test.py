#!/usr/bin/env python3
"""Tests of packtrace view in a real window: Xvfb, OpenGL by Mesa in software, xdotool for keys and mouse.

Usage: window_test.py PROGRAM SOURCE_FOLDER WITH_WINDOW [unittest options]
Ends with code 77, which ctest shows as skipped, if the program has no window (WITH_WINDOW is 0), or Xvfb or xdotool is
not installed.
"""

import os
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest

from pictures import read_exr_pixel, read_png
from viewer import PATIENCE_S, Display, Viewer, wait_until

PROGRAM, SOURCES = "", ""
VIEWS = ["ao", "ground_truth", "ao_raw", "depth", "normal", "instance", "albedo", "shaded", "hit_distance", "motion",
         "previous_depth", "local_variance", "variance", "history", "disocclusion", "material_flags", "cluster",
         "visited_nodes", "visited_leaves", "tested_triangles"]


def scene(name):
    return os.path.join(SOURCES, "assets", name)


def read_bytes(path):
    with open(path, "rb") as file:
        return file.read()


class WindowTest(unittest.TestCase):
    """A display and baked scenes for all tests, and a folder and viewers for each."""

    @classmethod
    def setUpClass(cls):
        cls.display = Display()
        cls.baked = tempfile.mkdtemp(prefix="packtrace_baked_")
        for name, source in {"room": "room/room.pbrt", "textured": "textured/textured.pbrt",
                             "moving": "features/animated_transform.pbrt"}.items():
            subprocess.run([PROGRAM, "bake", scene(source), "-o", os.path.join(cls.baked, name + ".ptk"), "-q"], check=True)

    @classmethod
    def tearDownClass(cls):
        cls.display.close()
        shutil.rmtree(cls.baked, ignore_errors=True)

    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="packtrace_window_")
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)

    def file(self, name):
        return os.path.join(self.baked, name + ".ptk")

    def open(self, *arguments, **options):
        viewer = Viewer(self.display, PROGRAM, arguments, self.folder, **options)
        self.addCleanup(viewer.close)
        return viewer

    def run_words(self, words):
        return subprocess.run(words, cwd=self.folder, capture_output=True, text=True, timeout=PATIENCE_S, check=False)

    def expect_bytes_of_render(self, command, files):
        """Runs the command that the view stated, with other files, and compares them."""
        self.assertEqual(command[:2], ["packtrace", "render"])
        again = [os.path.join(self.folder, "again" + os.path.splitext(name)[1]) for name in files]
        outputs = [word for name in again for word in ("-o", name)]
        done = self.run_words([PROGRAM, *command[1:], *outputs, "--force", "-q"])
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


class Start(WindowTest):
    def test_names_the_file_while_it_loads_and_then_shows_frames(self):
        viewer = self.open(self.file("room"), wait=False)
        self.assertRegex(viewer.title(), r"packtrace")
        viewer.still(2)
        self.assertRegex(viewer.title(), r"room\.ptk - packtrace - \d+ fps, [\d.]+ ms - (AVX-512|AVX2|scalar) - 320 x 180 - ")
        colors = set(struct.iter_unpack("3B", self.screen(viewer)))
        self.assertGreater(len(colors), 20)
        self.end(viewer)

    def test_imports_a_scene(self):
        viewer = self.open(scene("features/materials.pbrt"))
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
                done = subprocess.run([PROGRAM, "view", self.file("room"), "--settings", "settings.toml"], cwd=self.folder,
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
        done = subprocess.run([PROGRAM, "view", self.file("room"), "--settings", "garbage.toml"], cwd=self.folder,
                              env=self.display.environment, capture_output=True, text=True, timeout=PATIENCE_S, check=False)
        self.assertEqual(done.returncode, 3)
        self.assertIn("garbage.toml:1:1: ", done.stderr)

    def test_files_that_cannot_be_read_end_it(self):
        with open(os.path.join(self.folder, "garbage.ptk"), "wb") as file:
            file.write(b"garbage" * 100)
        for name in ("garbage.ptk", "none.ptk"):
            done = subprocess.run([PROGRAM, "view", name], cwd=self.folder, env=self.display.environment,
                                  capture_output=True, text=True, timeout=PATIENCE_S, check=False)
            self.assertEqual(done.returncode, 3, done.stderr)
            self.assertIn(name, done.stderr)

    def test_without_a_display_it_says_what_to_do(self):
        environment = {name: value for name, value in self.display.environment.items() if name != "DISPLAY"}
        old_opengl = dict(self.display.environment, MESA_GL_VERSION_OVERRIDE="2.1")
        for changed in (environment, dict(environment, DISPLAY=":9876"), old_opengl):
            done = subprocess.run([PROGRAM, "view", self.file("room")], env=changed, capture_output=True, text=True,
                                  timeout=PATIENCE_S, check=False)
            self.assertEqual(done.returncode, 4, done.stderr)
            self.assertIn("--headless SCRIPT", done.stderr)
            self.assertIn("xvfb-run", done.stderr)


class Keys(WindowTest):
    def test_held_keys_fly(self):
        viewer = self.open(self.file("room"))
        start = viewer.camera()
        cameras = {start}
        for key in "wsadqe":
            viewer.hold(key)
            viewer.moving()
            viewer.release(key)
            camera = viewer.camera()
            self.assertNotIn(camera, cameras, key)
            cameras.add(camera)
        self.expect_bytes_of_render(*viewer.screenshot())
        viewer.press("Home")
        self.assertEqual(viewer.camera(), start)
        viewer.press("F")
        self.assertNotIn(viewer.camera(), cameras)
        self.end(viewer)

    def test_the_mouse_moves_the_camera(self):
        viewer = self.open(self.file("room"))
        viewer.press("BackSpace")
        cameras = {viewer.camera()}
        for button in (1, 2, 3):
            viewer.drag((150, 90), (190, 80), button)
            camera = viewer.camera()
            self.assertNotIn(camera, cameras, f"button {button}")
            cameras.add(camera)
        self.end(viewer)

    def test_number_keys_choose_views(self):
        viewer = self.open(self.file("room"))
        for key, words in (("0", "--ground-truth"), ("1", "--aov ao_raw"), ("2", "--aov ao"), ("3", "--aov shaded"),
                           ("Return", "--aov albedo"), ("Return", "--aov shaded")):
            viewer.press(key)
            command = viewer.shown()
            self.assertTrue(words in command.removesuffix(" --aov ao") if key == "0" else command.endswith(words), command)
        long_rays = viewer.shown()
        viewer.press("4")
        self.assertIn("--ao-set radius=", viewer.shown())
        viewer.press("4")
        self.assertNotIn("--ao-set", viewer.shown())
        self.assertNotIn("--ao-set", long_rays)
        viewer.still(2)
        self.expect_bytes_of_render(*viewer.screenshot())
        self.end(viewer)

    def test_orbit_pause_and_motion(self):
        viewer = self.open(self.file("moving"))
        viewer.press("c")
        viewer.moving()
        viewer.press("space")
        viewer.still(3)
        viewer.press("space")
        viewer.moving()
        viewer.press("c")
        viewer.still(3)
        viewer.press("t")
        viewer.moving()
        viewer.press("space")
        viewer.still(3)
        command, files = viewer.screenshot()
        self.assertIn("--start-time", command)
        self.expect_bytes_of_render(command, files)
        viewer.press("t")
        viewer.still(3)
        self.assertNotIn("--start-time", viewer.screenshot()[0])
        self.end(viewer)

    def test_what_does_not_move_says_so(self):
        viewer = self.open(self.file("room"))
        viewer.press("t")
        self.assertIn("nothing moves in", viewer.message("room.ptk"))
        viewer.press("n")
        viewer.message("no such key: n")
        self.end(viewer)

    def test_recorded_paths_are_played_by_render(self):
        viewer = self.open(self.file("room"))
        viewer.press("r")
        viewer.message("recording")
        viewer.hold("a")
        viewer.moving()
        viewer.release("a")
        viewer.still(1)
        viewer.press("r")
        viewer.message("saved room-0001.json")
        self.end(viewer)
        done = self.run_words([PROGRAM, "render", self.file("room"), "--path", "room-0001.json", "--frames", "2", "-o",
                               "frame_%d.png", "--size", "32x18", "-q"])
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_profile_saves_a_table(self):
        viewer = self.open(self.file("moving"), size="64x36")
        viewer.press("F9")
        viewer.message("saved moving-0001.csv")
        with open(os.path.join(self.folder, "moving-0001.csv"), encoding="utf-8") as file:
            self.assertEqual(len(file.readlines()), 301)
        self.end(viewer)

    def test_bookmarks(self):
        viewer = self.open(self.file("room"))
        viewer.press("BackSpace")
        viewer.drag((300, 90), (310, 95), 3)
        first = viewer.camera()
        viewer.press("ctrl+F1")
        viewer.hold("e")
        viewer.moving()
        viewer.release("e")
        self.assertNotEqual(viewer.camera(), first)
        viewer.press("F1")
        self.assertEqual(viewer.camera(), first)
        self.expect_bytes_of_render(*viewer.screenshot())
        self.end(viewer)

    def test_panels_help_and_full_screen(self):
        viewer = self.open(self.file("room"), size="640x360")
        viewer.press("2")
        viewer.still(4)
        with_panels = self.screen(viewer)
        viewer.press("BackSpace")
        # The picture is denoised occlusion, which is grey; panels have colours.
        colorful = lambda: any(max(p) - min(p) > 8 for p in struct.iter_unpack("3B", self.screen(viewer)))
        self.assertTrue(any(max(p) - min(p) > 8 for p in struct.iter_unpack("3B", with_panels)))
        wait_until("the panels to go", lambda: not colorful())
        viewer.press("h")
        wait_until("the help", colorful)
        viewer.press("h")
        wait_until("the help to go", lambda: not colorful())
        viewer.press("alt+Return")
        wait_until("full screen", lambda: viewer.size() == (self.display.WIDTH, self.display.HEIGHT))
        wait_until("a picture of it", lambda: f"{self.display.WIDTH} x {self.display.HEIGHT}" in viewer.title())
        viewer.press("alt+Return")
        wait_until("the window's size", lambda: viewer.size() == (640, 360))
        viewer.press("F11")
        wait_until("full screen", lambda: viewer.size() == (self.display.WIDTH, self.display.HEIGHT))
        self.end(viewer)


class Views(WindowTest):
    def test_tab_shows_each_view_as_render_writes_it(self):
        viewer = self.open(self.file("room"), size="160x90")
        viewer.press("2")
        for number in range(len(VIEWS)):
            if number > 0:
                viewer.press("Tab")
            viewer.press("Home")  # begins again, so that render has few frames to do
            command, files = viewer.screenshot()
            expected = VIEWS[number]
            self.assertEqual("--ground-truth" in command, expected == "ground_truth", command)
            self.assertEqual(command[-1], "ao" if expected == "ground_truth" else expected)
            self.expect_bytes_of_render(command, files)
        viewer.press("Tab")
        self.assertEqual(viewer.screenshot()[0][-1], "ao")
        viewer.press("v")
        self.assertEqual(viewer.screenshot()[0][-1], VIEWS[-1])
        self.end(viewer)

    def test_split_and_difference(self):
        viewer = self.open(self.file("room"))
        viewer.press("BackSpace", "x", "3")
        viewer.still(2)
        first, second, screen = viewer.split_screenshot()
        self.assertEqual((first[0][-1], second[0][-1]), ("shaded", "ao"))
        for saved in (first, second):
            self.expect_bytes_of_render(*saved)
        grey = lambda pixels: all(max(p) == min(p) for p in struct.iter_unpack("3B", pixels))
        picture = read_png(screen)
        self.assertEqual((picture.width, picture.height), (320, 180))
        self.assertTrue(grey(picture.part(160, 0, 320, 180)))  # occlusion
        self.assertFalse(grey(picture.part(0, 0, 160, 180)))   # times albedo
        viewer.drag((160, 90), (80, 90))                       # the divider
        picture = read_png(viewer.split_screenshot()[2])
        self.assertTrue(grey(picture.part(80, 0, 320, 180)))
        self.assertFalse(grey(picture.part(0, 0, 80, 180)))
        viewer.press("2", "z")
        picture = read_png(viewer.split_screenshot()[2])
        hits = [p for p in struct.iter_unpack("3B", picture.rgb) if p == (0, 0, 0)]
        self.assertGreater(len(hits), 320 * 180 // 2)  # both panes show the same
        viewer.press("z")
        self.assertNotIn("-first", viewer.screenshot()[1][0])
        self.end(viewer)

    def test_two_files(self):
        viewer = self.open(self.file("room"), self.file("textured"))
        viewer.press("BackSpace", "x")
        viewer.still(2)
        for name, saved in zip(("room.ptk", "textured.ptk"), viewer.split_screenshot()):
            self.assertTrue(saved[0][2].endswith(name))
            self.expect_bytes_of_render(*saved)
        viewer.press("x", "Next")
        self.assertTrue(viewer.screenshot()[0][2].endswith("textured.ptk"))
        self.end(viewer)

    def test_picks_are_what_render_writes(self):
        viewer = self.open(self.file("room"))
        viewer.press("BackSpace")
        for x, y in ((160, 120), (40, 60), (300, 170)):
            viewer.press("Home")
            pick, command = viewer.pick(x, y)
            self.assertEqual(pick["pixel"], [x, y])
            self.assertTrue(pick["hit"], pick)
            words = [PROGRAM, *command[1:command.index("--aov")], "--aov", "all", "-o", "pick.exr", "--force", "-q"]
            done = self.run_words(words)
            self.assertEqual(done.returncode, 0, done.stderr)
            layers = read_exr_pixel(os.path.join(self.folder, "pick.exr"), x, y)
            for name, value in pick.items():
                if name in ("pixel", "hit", "surface"):
                    continue
                if name == "normal":
                    written = [layers["normal." + c] for c in "XYZ"]
                elif name == "albedo":
                    written = [layers["albedo." + c] for c in "RGB"]
                else:
                    written = [layers[name]]
                # Normals and colours are written with 16 bits.
                tolerance = 1e-3 if name in ("normal", "albedo") else 1e-6
                for got, expected in zip(value if isinstance(value, list) else [value], written):
                    self.assertAlmostEqual(got, expected, delta=tolerance * max(1.0, abs(expected)), msg=name)
            self.assertIn("position", pick["surface"])
            self.assertNotEqual(pick["surface"]["material_name"], "")
        self.end(viewer)

    def test_a_double_click_sets_the_pivot(self):
        viewer = self.open(self.file("room"))
        viewer.press("BackSpace")
        cameras = []
        for at in ((160, 120), (20, 150)):
            viewer.press("Home")
            viewer.still(2)
            viewer.click(*at, count=2)
            viewer.drag((160, 90), (180, 90), 3)
            cameras.append(viewer.camera())
        self.assertNotEqual(*cameras)
        self.end(viewer)


class Files(WindowTest):
    def replace(self, content):
        with open(os.path.join(self.folder, "new"), "wb") as file:
            file.write(content)
        os.replace(os.path.join(self.folder, "new"), os.path.join(self.folder, "shown.ptk"))

    def test_changed_files_are_read_again_and_bad_ones_are_not_shown(self):
        room = read_bytes(self.file("room"))
        self.replace(room)
        viewer = self.open("shown.ptk")
        viewer.press("BackSpace", "Tab")
        while viewer.screenshot()[0][-1] != "instance":
            viewer.press("Tab")
        before = read_png(viewer.screenshot()[1][0]).rgb
        self.replace(read_bytes(self.file("textured")))
        viewer.message("read shown.ptk again")
        viewer.still(2)
        command, files = viewer.screenshot()
        self.assertNotEqual(read_png(files[0]).rgb, before)
        self.expect_bytes_of_render(command, files)
        self.replace(room)
        viewer.message("read shown.ptk again")
        viewer.still(2)
        self.assertEqual(read_png(viewer.screenshot()[1][0]).rgb, before)
        for garbage in (b"garbage" * 1000, room[:len(room) // 2], room[:5000] + bytes(100) + room[5100:], b""):
            self.replace(garbage)
            self.assertIn("shown.ptk", viewer.message("the picture shows what was there before"))
            self.assertEqual(read_png(viewer.screenshot()[1][0]).rgb, before)
        os.remove(os.path.join(self.folder, "shown.ptk"))
        viewer.message("the picture shows what was there before")
        self.assertEqual(read_png(viewer.screenshot()[1][0]).rgb, before)
        self.replace(room)
        viewer.message("read shown.ptk again")
        viewer.still(2)
        self.expect_bytes_of_render(*viewer.screenshot())
        self.end(viewer)


class Size(WindowTest):
    def test_resized_while_frames_are_rendered(self):
        viewer = self.open(self.file("room"), "--supersample", "3", "--spp", "8", wait=False)
        for width, height in ((400, 300), (90, 500), (333, 41), (700, 500), (257, 131)):
            viewer.resize(width, height)
            wait_until(f"{width} x {height}", lambda: viewer.size() == (width, height))
        wait_until("the last size", lambda: f" {3 * 257} x {3 * 131} " in viewer.title())
        viewer.still(1)
        command, files = viewer.screenshot()
        self.assertIn("257x131", command)
        self.expect_bytes_of_render(command, files)
        self.end(viewer)

    def test_one_pixel(self):
        viewer = self.open(self.file("room"), size="1x1")
        self.expect_bytes_of_render(*viewer.screenshot())
        viewer.resize(64, 48)
        wait_until("a larger picture", lambda: " 64 x 48 " in viewer.title())
        viewer.resize(1, 1)
        wait_until("one pixel", lambda: " 1 x 1 " in viewer.title())
        viewer.still(2)
        command, files = viewer.screenshot()
        self.assertIn("1x1", command)
        self.expect_bytes_of_render(command, files)
        self.end(viewer)

    def test_pictures_that_need_too_much_memory_are_refused(self):
        viewer = self.open(self.file("room"), "--max-memory", "60M")
        viewer.resize(1000, 700)
        viewer.message("memory")
        viewer.resize(200, 100)
        wait_until("a smaller picture", lambda: " 200 x 100 " in viewer.title())
        self.expect_bytes_of_render(*viewer.screenshot())
        self.end(viewer)

    def test_closed_while_a_frame_is_rendered(self):
        viewer = self.open(self.file("room"), "--supersample", "8", "--spp", "64", size="640x480", wait=False)
        wait_until("the window's content", lambda: len(set(struct.iter_unpack("3B", self.screen(viewer)))) > 1)
        self.end(viewer)  # the first frame alone takes a minute

    def test_closed_while_it_moves(self):
        viewer = self.open(self.file("room"))
        viewer.press("c")
        viewer.moving()
        self.end(viewer)


def main():
    global PROGRAM, SOURCES
    program, SOURCES, with_window = sys.argv[1:4]
    PROGRAM = os.path.abspath(program)
    if with_window == "0":
        print("packtrace was built without its window (.ci/install_packages.sh window)")
        return 77
    for tool in ("Xvfb", "xdotool"):
        if shutil.which(tool) is None:
            print(f"{tool} is not installed (.ci/install_packages.sh tests)")
            return 77
    return 0 if unittest.main(argv=[sys.argv[0], *sys.argv[4:]], exit=False, verbosity=2).result.wasSuccessful() else 1


if __name__ == "__main__":
    sys.exit(main())

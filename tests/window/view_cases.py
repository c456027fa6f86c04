"""Views, two panes, and picks."""

import os
import struct

from pictures import read_exr_pixel, read_png
from window_case import WindowTest

VIEWS = ["ao", "ground_truth", "ao_raw", "depth", "normal", "instance", "albedo", "shaded", "hit_distance", "motion",
         "previous_depth", "local_variance", "variance", "history", "disocclusion", "material_flags", "cluster",
         "visited_nodes", "visited_leaves", "tested_triangles"]


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
            words = [self.program, *command[1:command.index("--aov")], "--aov", "all", "-o", "pick.exr", "--force", "-q"]
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
            self.assertGreater(pick["surface"]["cluster_bytes"]["positions"], 0)
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

"""Keys and mouse."""

import json
import os
import struct

from viewer import wait_until
from window_case import WindowTest


class Keys(WindowTest):
    def test_held_keys_fly(self):
        viewer = self.open(self.file("room"))
        start = viewer.camera()
        cameras = {start}
        for key in "wsadqe":
            viewer.hold(key)
            viewer.moving()
            viewer.release(key)
            viewer.still(1)  # else moving() may see this key's movement when the next one is held
            camera = viewer.camera()
            self.assertNotIn(camera, cameras, key)
            cameras.add(camera)
        self.expect_bytes_of_render(*viewer.screenshot())
        viewer.press("Home")
        self.assertEqual(viewer.camera(), start)
        viewer.press("F")
        self.assertNotIn(viewer.camera(), cameras)
        self.end(viewer)

    def test_movements_are_timed_to_their_pictures(self):
        viewer = self.open(self.file("room"))
        for key in "wasd":
            viewer.hold(key)
            viewer.moving()
            viewer.release(key)
            viewer.still(2)
        self.end(viewer)
        latency = viewer.printed("input_to_picture")["input_to_picture"]
        self.assertGreaterEqual(latency["inputs"], 4)
        self.assertGreater(latency["median_ms"], 0)
        self.assertGreaterEqual(latency["p95_ms"], latency["median_ms"])

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

    def test_scenes_with_lights_are_shaded(self):
        viewer = self.open(self.file("lit"))
        for key, words in (("3", "--view pbr+ao"), ("Return", "--view pbr"), ("Return", "--view pbr+ao")):
            viewer.press(key)
            self.assertIn(words + " --aov pbr", viewer.shown())
        viewer.still(2)
        self.expect_bytes_of_render(*viewer.screenshot())
        viewer.press("l")
        viewer.moving()
        viewer.press("space")
        viewer.still(2)
        command, files = viewer.screenshot()
        self.assertIn("light_turn=", " ".join(command))
        self.expect_bytes_of_render(command, files)
        self.end(viewer)

    def test_the_clicked_object_moves(self):
        viewer = self.open(self.file("lit"))
        viewer.press("u")
        viewer.message("nothing is picked")
        viewer.press("BackSpace")
        place = self.object_in(viewer)
        shown = set()
        for key in "uyjmhk":
            viewer.press("b")
            viewer.hold(key)
            viewer.moving()
            viewer.release(key)
            viewer.still(2)
            command, files = viewer.screenshot()
            keys = command[command.index("--keys") + 1]
            with open(os.path.join(self.folder, keys), encoding="utf-8") as file:
                shown.add(file.read())
            if key == "u":
                self.expect_bytes_of_render(command, files)
        self.assertEqual(len(shown), 6)
        viewer.press("b")
        viewer.still(2)
        self.assertNotIn("--keys", viewer.screenshot()[0])
        viewer.click(1, 1)  # the sky
        viewer.printed("pick")
        viewer.press("k")
        viewer.message("nothing is picked")
        self.assertIsNotNone(place)
        self.end(viewer)

    ARROWS = {"x": (235, 70, 60), "y": (70, 190, 70), "z": (70, 120, 245)}

    def arrow(self, viewer, axis):
        """The pixels of an arrow of the clicked object."""
        def found():
            width = viewer.size()[0]
            pixels = struct.iter_unpack("3B", self.screen(viewer))
            places = [(i % width, i // width) for i, p in enumerate(pixels) if p == self.ARROWS[axis]]
            return places if len(places) > 20 else None

        return wait_until(f"the arrow {axis}", found)

    def test_an_arrow_of_the_clicked_object_is_dragged(self):
        viewer = self.open(self.file("lit"), size="960x540")
        viewer.press("BackSpace")
        self.object_in(viewer)
        viewer.press("BackSpace")  # the arrows are shown with the panels
        viewer.still(4)
        for number, axis in enumerate("xy"):  # that of z hides a part of y's
            centre = max(self.arrow(viewer, "z"), key=lambda p: p[1])
            pixels = self.arrow(viewer, axis)
            middle = [sum(p[i] for p in pixels) / len(pixels) for i in range(2)]
            start = min(pixels, key=lambda p: (p[0] - middle[0]) ** 2 + (p[1] - middle[1]) ** 2)
            viewer.drag(start, (2 * start[0] - centre[0], 2 * start[1] - centre[1]))
            viewer.still(2)
            command = viewer.screenshot()[0]
            self.assertIn("--keys", command, axis)
            with open(os.path.join(self.folder, command[command.index("--keys") + 1]), encoding="utf-8") as file:
                moved = json.load(file)["instances"][0]["keys"][0]["translate"]
            self.assertEqual([by != 0 for by in moved], [other == number for other in range(3)], axis)
            viewer.press("b")
            viewer.still(4)
        self.end(viewer)

    def object_in(self, viewer):
        """Clicks until an object is picked that can be moved. Returns where."""
        width, height = viewer.size()
        for y in (0.5, 0.56, 0.45, 0.6):
            for x in (0.5, 0.47, 0.53, 0.42, 0.6):
                at = round(width * x), round(height * y)
                pick = viewer.pick(*at)[0]
                if pick["hit"] and pick.get("surface", {}).get("instance_name", "") in self.OBJECTS:
                    return at
        self.fail("no object in the picture")

    OBJECTS = {"letter"}

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
        done = self.run_words([self.program, "render", self.file("room"), "--path", "room-0001.json", "--frames", "2", "-o",
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
        viewer.press("i")
        wait_until("the help", colorful)
        viewer.press("i")
        wait_until("the help to go", lambda: not colorful())
        viewer.press("alt+Return")
        wait_until("full screen", lambda: viewer.size() == (self.display.WIDTH, self.display.HEIGHT))
        wait_until("a picture of it", lambda: f"{self.display.WIDTH} x {self.display.HEIGHT}" in viewer.title())
        viewer.press("alt+Return")
        wait_until("the window's size", lambda: viewer.size() == (640, 360))
        viewer.press("F11")
        wait_until("full screen", lambda: viewer.size() == (self.display.WIDTH, self.display.HEIGHT))
        self.end(viewer)

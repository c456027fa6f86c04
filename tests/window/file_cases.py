"""Files that change, and sizes of the window."""

import os
import struct

from pictures import read_png
from viewer import wait_until
from window_case import WindowTest, read_bytes


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


    def test_dropped_files_are_opened(self):
        viewer = self.open(self.file("room"))
        viewer.press("BackSpace")
        viewer.drop(self.file("textured"))
        viewer.message("opened " + self.file("textured"))
        command, files = viewer.screenshot()
        self.assertEqual(command[2], self.file("textured"))
        self.expect_bytes_of_render(command, files)
        garbage = os.path.join(self.folder, "garbage.ptk")
        with open(garbage, "wb") as file:
            file.write(b"garbage" * 100)
        viewer.drop(garbage)
        self.assertIn("garbage.ptk", viewer.message("the picture shows what was there before"))
        viewer.drop(self.scene("features/materials.pbrt"))
        viewer.message("opened " + self.scene("features/materials.pbrt"))
        self.expect_bytes_of_render(*viewer.screenshot())
        viewer.press("Next")
        self.assertEqual(viewer.screenshot()[0][2], self.file("room"))
        self.end(viewer)


class Size(WindowTest):
    def test_resized_while_frames_are_rendered(self):
        viewer = self.open(self.file("room"), "--supersample", "3", "--spp", "8", wait=False)
        for width, height in ((400, 300), (90, 500), (333, 41), (700, 500), (257, 131)):
            viewer.resize(width, height)
            wait_until(f"{width} x {height}", lambda: viewer.size() == (width, height))
        wait_until("the last size", lambda: f" {3 * 257} x {3 * 131}, " in viewer.title())
        viewer.still(1)
        command, files = viewer.screenshot()
        self.assertIn("257x131", command)
        self.expect_bytes_of_render(command, files)
        self.end(viewer)

    def test_one_pixel(self):
        viewer = self.open(self.file("room"), size="1x1")
        self.expect_bytes_of_render(*viewer.screenshot())
        viewer.resize(64, 48)
        wait_until("a larger picture", lambda: " 64 x 48, " in viewer.title())
        viewer.resize(1, 1)
        wait_until("one pixel", lambda: " 1 x 1, " in viewer.title())
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
        wait_until("a smaller picture", lambda: " 200 x 100, " in viewer.title())
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

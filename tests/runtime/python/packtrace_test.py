"""Tests of the Python module. Usage: packtrace_test.py SOURCE_DIR [unittest options]; PYTHONPATH has the module."""

import ast
import gc
import pathlib
import re
import sys
import tempfile
import threading
import unittest

import numpy as np

import packtrace

SOURCE = pathlib.Path(sys.argv.pop(1))
ROOM = SOURCE / "assets/room/room.pbrt"


class Module(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.path = pathlib.Path(cls.folder.name) / "room.ptk"
        cls.report = packtrace.bake(ROOM, cls.path, purpose="shading", codec="small")

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def test_bake_reports_what_the_file_holds(self):
        info = packtrace.open(self.path).info()
        self.assertGreater(info["triangles"], 10000)
        self.assertEqual(self.report["triangles"], info["triangles"])
        self.assertEqual(info["disk"]["codec"], "small")
        self.assertEqual(info["disk"]["bytes"], self.path.stat().st_size)
        self.assertIsInstance(self.report["problems"], list)
        self.assertTrue(packtrace.open(str(self.path)).info(by_geometry=True)["requirements"]["geometries"])

    def test_options_reach_the_bake(self):
        coarse = packtrace.bake(ROOM, self.path.with_name("coarse.ptk"), position_bits=8, lod="instanced")
        self.assertLess(coarse["bytes"]["positions"], self.report["bytes"]["positions"])
        self.assertIsNotNone(coarse["lod"])

    def test_streams_are_views(self):
        file = packtrace.open(self.path)
        streams = file.streams()
        self.assertEqual(len(streams["geometries"]), file.geometry_count)
        clusters = streams["clusters"]
        self.assertEqual(clusters.dtype.itemsize, 44)
        self.assertEqual(clusters["triangle_count"].sum(), streams["geometries"]["triangle_count"].sum())
        self.assertEqual(streams["instances"]["world_from_object"].shape[1], 12)
        again = file.streams()["clusters"]
        self.assertEqual(clusters.__array_interface__["data"][0], again.__array_interface__["data"][0])
        for name, stream in streams.items():
            self.assertFalse(stream.flags.writeable, name)
            self.assertFalse(stream.flags.owndata, name)
        total = sum(stream.nbytes for stream in streams.values())
        self.assertLessEqual(total, file.file_bytes)
        self.assertGreater(total, 0.9 * file.file_bytes)
        with self.assertRaises(ValueError):
            clusters["flags"][0] = 1

    def test_streams_keep_the_file_alive(self):
        payload = packtrace.open(self.path).streams()["payload"]
        kept = payload.tobytes()
        for _ in range(4):
            gc.collect()
            packtrace.open(self.path)
        self.assertEqual(payload.tobytes(), kept)

    def test_decodes_geometries(self):
        file = packtrace.open(self.path)
        records = file.streams()["geometries"]
        with_normals = 0
        for geometry in range(file.base_geometry_count):
            mesh, record = file.decode(geometry), records[geometry]
            self.assertEqual(mesh["positions"].shape, (record["vertex_count"], 3))
            self.assertEqual(mesh["triangles"].shape, (record["triangle_count"], 3))
            self.assertLess(mesh["triangles"].max(), record["vertex_count"])
            np.testing.assert_array_equal(mesh["positions"].min(axis=0), record["bounds_lo"])
            np.testing.assert_array_equal(mesh["positions"].max(axis=0), record["bounds_hi"])
            self.assertLess(mesh["clusters"].max(), record["cluster_count"])
            if "normals" in mesh:
                length = np.linalg.norm(mesh["normals"], axis=1)
                np.testing.assert_allclose(length[np.isfinite(length)], 1, atol=1e-5)
                with_normals += 1
        self.assertGreater(with_normals, 0)
        with self.assertRaises(IndexError):
            file.decode(file.geometry_count)

    def test_renders_to_arrays(self):
        file = packtrace.open(self.path)
        image = packtrace.render(file, size=(64, 36), frames=2)
        self.assertEqual(image["ao"].shape, (36, 64))
        self.assertEqual(image["normal"].shape, (36, 64, 3))
        hit = image["instance"] != 0xFFFFFFFF
        self.assertGreater(hit.mean(), 0.5)
        self.assertTrue((image["ao"][~hit] == -1).all())
        self.assertTrue(((image["ao"][hit] >= 0) & (image["ao"][hit] <= 1)).all())
        np.testing.assert_array_equal(image["ao"], packtrace.render(file, size=(64, 36), frames=2)["ao"])
        other = packtrace.render(file, size=(64, 36), frames=2, backend="embree", denoise=False, camera=None)
        self.assertFalse(np.array_equal(image["depth"], other["depth"]))

    def test_denoiser_and_layers_can_be_chosen(self):
        file = packtrace.open(self.path)

        def view(**options):
            return packtrace.render(file, size=(64, 36), frames=2, **options)

        chosen = view(denoiser_settings={"max_tspp": 8}, layers=["ao", "history"])
        self.assertEqual(sorted(chosen), ["ao", "history"])
        self.assertEqual(chosen["history"].max(), 2)
        layers = view(layers=["motion", "hit_distance", "variance", "local_variance", "disocclusion"])
        self.assertEqual(layers["motion"].shape, (36, 64, 2))
        self.assertGreater(layers["hit_distance"].max(), 0)
        np.testing.assert_array_equal(view(denoiser="off")["ao"], view(denoise=False)["ao"])
        for option in ({"denoiser": "x"}, {"denoiser_settings": {"x": 1}}, {"layers": ["x"]},
                       {"denoiser": "off", "layers": ["history"]}):
            with self.assertRaises(packtrace.Error) as caught:
                view(**option)
            self.assertEqual(caught.exception.kind, "usage", option)

    def test_occlusion_can_be_chosen(self):
        file = packtrace.open(self.path)

        def view(**options):
            return packtrace.render(file, size=(64, 36), frames=2, denoise=False, **options)["ao"]

        plain = view()
        for option in ({"ao_resolution": "quarter"}, {"ao_rate": "checkerboard"}, {"ao_sampler": "sobol"},
                       {"ao_settings": {"falloff": 0}}):
            self.assertFalse(np.array_equal(plain, view(**option)), option)
        np.testing.assert_array_equal(plain, view(ao_settings={"sort_rays": 1}))
        np.testing.assert_array_equal(plain, view(ao_rate="adaptive"))  # all surfaces are equally new
        np.testing.assert_array_equal(view(ao_radius=0.5), view(ao_settings={"radius": 0.5}))
        for option in ({"ao_resolution": "x"}, {"ao_rate": "x"}, {"ao_sampler": "x"}, {"ao_settings": {"x": 1}},
                       {"ao_settings": {"lambda": 99}}):
            with self.assertRaises(packtrace.Error) as caught:
                view(**option)
            self.assertEqual(caught.exception.kind, "usage", option)

    def test_views_can_be_shaded(self):
        scene, path = self.path.parent / "lit.pbrt", self.path.parent / "lit.ptk"
        scene.write_text("LookAt 0 1 -4 0 0 0 0 1 0 Camera \"perspective\" WorldBegin LightSource \"point\" "
                         "\"point from\" [0 3 -2] Shape \"sphere\" WorldEnd\n")
        packtrace.bake(scene, path, purpose="shading", force=True)
        file = packtrace.open(path)

        def view(**options):
            return packtrace.render(file, size=(64, 36), frames=2, **options)

        shaded = view(view="pbr+ao")
        self.assertEqual(shaded["pbr"].shape, (36, 64, 3))
        self.assertGreater(shaded["direct"].max(), 0)
        self.assertNotIn("pbr", view())
        brighter = view(view="pbr+ao", shade_settings={"ambient": 2})
        self.assertGreater(brighter["pbr"].sum(), shaded["pbr"].sum())
        for option in ({"view": "x"}, {"shade_settings": {"depth": 1}}, {"view": "pbr", "shade_settings": {"x": 1}}):
            with self.assertRaises(packtrace.Error) as caught:
                view(**option)
            self.assertEqual(caught.exception.kind, "usage", option)
        packtrace.bake(scene, path, force=True)
        with self.assertRaises(packtrace.Error) as caught:
            packtrace.render(packtrace.open(path), size=(64, 36), view="pbr")
        self.assertEqual(caught.exception.kind, "unsupported")

    def test_other_threads_run_meanwhile(self):
        file = packtrace.open(self.path)
        turns, done = 0, threading.Event()

        def work():
            packtrace.render(file, size=(320, 180), frames=8)
            done.set()

        thread = threading.Thread(target=work)
        thread.start()
        while not done.wait(0.001):
            turns += 1
        thread.join()
        self.assertGreater(turns, 10)

    def test_errors_have_a_kind(self):
        def raised(call, *arguments, **options):
            with self.assertRaises(packtrace.Error) as caught:
                call(*arguments, **options)
            return caught.exception

        missing = raised(packtrace.open, "there/is/no.ptk")
        self.assertEqual((missing.kind, missing.exit_code), ("input", 3))
        self.assertIn("no.ptk", str(missing))
        self.assertEqual(raised(packtrace.bake, ROOM, self.path).kind, "io")  # it exists, and force is not given
        for option in ({"purpose": "x"}, {"codec": "x"}, {"lod": "x"}, {"normals": "x"}, {"position_bits": 99},
                       {"precision_abs": 1.0, "precision_edge": 0.1}):
            self.assertEqual(raised(packtrace.bake, ROOM, self.path, force=True, **option).kind, "usage", option)
        file = packtrace.open(self.path)
        for option in ({"camera": 99}, {"backend": "x"}, {"frames": 0}, {"ao_radius": -1.0}):
            self.assertEqual(raised(packtrace.render, file, **option).kind, "usage", option)
        self.assertTrue(issubclass(packtrace.Error, RuntimeError))
        with self.assertRaises(TypeError):
            packtrace.render(None)

    def test_stubs_name_what_is_there(self):
        stub = pathlib.Path(packtrace.__file__).with_name("__init__.pyi")
        public = {}
        for node in ast.parse(stub.read_text()).body:
            if isinstance(node, ast.FunctionDef):
                public[node.name] = node
            elif isinstance(node, ast.ClassDef):
                public[node.name] = node
        self.assertEqual(sorted(public), sorted(packtrace.__all__))
        self.assertRegex(packtrace.__version__, r"^\d+\.\d+\.\d+$")

        def arguments(node):
            return [a.arg for a in node.args.args + node.args.kwonlyargs]

        def documented(function):  # pybind11 writes "name(arg: type, *, arg: type = value) -> type"
            signature = function.__doc__.split(") -> ")[0]
            return re.findall(r"[(,] ?(\w+): ", re.sub(r"\[[^\[\]]*\]", "", re.sub(r"\[[^\[\]]*\]", "", signature)))

        for name in ("bake", "open", "render"):
            self.assertEqual(arguments(public[name]), documented(getattr(packtrace, name)), name)
        members = {n.name: n for n in public["File"].body if isinstance(n, ast.FunctionDef)}
        self.assertEqual(sorted(members), sorted(m for m in vars(packtrace.File) if not m.startswith("_")))
        for name in ("info", "streams", "decode"):
            self.assertEqual(arguments(members[name]), documented(getattr(packtrace.File, name)), name)


if __name__ == "__main__":
    unittest.main()

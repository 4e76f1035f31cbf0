#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""waymark import and export: maps of another program in, files for others out, read back here.

The real map of stella_vslam needs WAYMARK_DATA with stella_bookstore/map.msg (or .msg.xz)."""
import json
import lzma
import math
import os
import pathlib
import struct
import unittest

import cv2

from cli_support import CliTest, waymark, write_png
from exchange_formats import ColmapModel, pack, read_ply, rotate, small_msg

SETTINGS = """Camera:
  name: "cam"
  setup: "monocular"
  model: "perspective"
  fx: 400.0
  fy: 402.0
  cx: 320.0
  cy: 240.0
  k1: -0.1
  k2: 0.02
  cols: 640
  rows: 480
Mapping:
  backend: "g2o"
"""


def rms(errors):
    return math.sqrt(sum(error * error for error in errors) / len(errors))


class ExchangeTest(CliTest):
    def assert_refused(self, done, *words):
        """Status 2 and one line with these words."""
        self.assertEqual((done.returncode, len(done.stderr.strip().split("\n"))), (2, 1), done.stderr)
        for word in words:
            self.assertIn(word, done.stderr)


class Exchange(ExchangeTest):
    def setUp(self):
        super().setUp()
        self.out.mkdir()
        self.msg = self.folder / "map.msg"
        self.map = self.out / "map.wmap"

    def import_map(self, document, *arguments):
        self.msg.write_bytes(document if isinstance(document, bytes) else pack(document))
        return waymark("import", self.msg, "-o", self.map, *arguments)

    def export(self, kind, name, *arguments):
        done = waymark("export", self.map, "--format", kind, "-o", self.folder / name, *arguments)
        self.assertEqual(done.returncode, 0, done.stderr)
        return self.folder / name

    def colmap_models(self):
        return [ColmapModel(self.export("colmap", f"colmap{form}", *form) / "sparse" / "0", suffix)
                for suffix, form in ((".bin", []), (".txt", ["--text"]))]

    def real_map(self):
        if "WAYMARK_DATA" not in os.environ:
            self.skipTest("needs WAYMARK_DATA, the folder of the recorded sequences")
        path = pathlib.Path(os.environ["WAYMARK_DATA"]) / "stella_bookstore" / "map.msg"
        if path.exists():
            return path.read_bytes()
        packed = path.with_suffix(".msg.xz")
        if packed.exists():
            return lzma.decompress(packed.read_bytes())
        self.skipTest("WAYMARK_DATA has no stella_bookstore/map.msg")


class Export(Exchange):
    def test_what_is_exported_is_what_was_imported(self):
        document = small_msg()
        done = self.import_map(document)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("3 keyframes, 40 landmarks", done.stdout)
        self.assertIn("sound", waymark("map", "check", self.map).stdout)
        points = [landmark["pos_w"] for landmark in document["landmarks"].values()]
        for model in self.colmap_models():
            self.assertEqual(len(model.images), 3)
            self.assertEqual([p["xyz"] for p in model.points.values()], points)
            self.assertLess(rms(model.errors()), 0.01)
            self.assertEqual(model.points[1]["rgb"], [128, 128, 128])
        for point, (x, y, z, *_) in zip(points, read_ply(self.export("ply", "points.ply"))):
            self.assertEqual(struct.pack("<3f", *point), struct.pack("<3f", x, y, z))
        tum = [list(map(float, row.split())) for row in
               self.export("tum", "tum.txt").read_text().split("\n")[:-1]]
        self.assertEqual(tum, [[5 + i, 0.2 * i, 0, 0, 0, 0, 0, 1] for i in range(3)])
        kitti = self.export("kitti", "kitti.txt").read_text().split("\n")[:-1]
        self.assertEqual(list(map(float, kitti[2].split())),
                         [1, 0, 0, 0.4, 0, 1, 0, 0, 0, 0, 1, 0])

    def test_nerfstudio_finds_its_files(self):
        self.import_map(small_msg())
        folder = self.export("nerfstudio", "nerf")
        transforms = json.loads((folder / "transforms.json").read_text())
        self.assertEqual(transforms["camera_model"], "OPENCV")
        self.assertEqual(transforms["k1"], -0.1)
        self.assertEqual(transforms["cx"], 320.5)
        self.assertEqual(len(read_ply(folder / transforms["ply_file_path"])), 40)
        last = transforms["frames"][2]["transform_matrix"]
        self.assertEqual(last, [[1, 0, 0, 0.4], [0, -1, 0, 0], [0, 0, -1, 0], [0, 0, 0, 1]])

    def test_an_earlier_export_is_replaced(self):
        document = small_msg()
        document["cameras"]["cam"].update(model_type="Fisheye", k4=0.0)
        self.import_map(document)
        folder = self.export("colmap", "again", "--text", "--split-views", 5)
        self.export("colmap", "again")
        self.assertEqual({path.name for path in (folder / "sparse" / "0").iterdir()},
                         {"cameras.bin", "images.bin", "points3D.bin"})
        (folder / "sparse" / "0" / "mine.txt").write_text("mine")
        done = waymark("export", self.map, "--format", "nerfstudio", "-o", folder)
        self.assert_refused(done, "again", "mine.txt", "expected a new or empty folder")
        self.assertTrue((folder / "sparse" / "0" / "images.bin").exists())
        self.assertEqual([path for path in self.folder.iterdir() if path.name.startswith(".")], [])

    def test_split_views(self):
        document = small_msg()
        document["cameras"]["cam"].update(model_type="Fisheye", k4=0.0)
        self.import_map(document)
        folder = self.export("colmap", "split", "--split-views", 5) / "sparse" / "0"
        model = ColmapModel(folder, ".bin")
        self.assertEqual(len(model.images), 15)
        self.assertEqual(len(model.points), 40)
        self.assertLess(rms(model.errors()), 0.1)
        done = waymark("export", self.map, "--format", "colmap", "-o", self.out / "x",
                       "--split-views", 2)
        self.assertEqual(done.returncode, 2)

    def test_every_submap_gets_files(self):
        document = small_msg()
        document["keyframes"]["2"]["span_parent"] = -1
        done = self.import_map(document)
        self.assertIn("note: ", done.stderr)
        self.export("ply", "points.ply")
        self.export("tum", "tum.txt")
        self.assertEqual(len((self.folder / "tum.txt").read_text().split("\n")), 3)
        self.assertEqual(len((self.folder / "tum_1.txt").read_text().split("\n")), 2)
        self.assertEqual(read_ply(self.folder / "points_1.ply"), [])

    def test_real_map_of_another_program(self):
        done = self.import_map(self.real_map())
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("26 keyframes, 3158 landmarks", done.stdout)
        self.assertIn("sound", waymark("map", "check", self.map).stdout)
        for model in self.colmap_models():
            self.assertGreater(len(model.points), 3000)
            self.assertLess(rms(model.errors()), 1.5)


class Recorded(ExchangeTest):
    """Exports with the images of the recording: of both cameras, and of other frames than keyframes."""

    def setUp(self):
        super().setUp()
        self.recording = self.sequence("stereo")
        self.assertEqual(self.run_on(self.recording, "--map-out", self.folder / "map.wmap").returncode, 0)
        self.trajectory = self.out / "trajectory.txt"

    def export(self, kind, *arguments):
        return waymark("export", self.folder / "map.wmap", "--format", kind, "-o", self.folder / "export", *arguments)

    def frames(self, kind, *which):
        done = self.export(kind, "--input", self.recording, "--trajectory", self.trajectory, "--frames", *which)
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_both_cameras(self):
        self.assertEqual(self.export("colmap", "--input", self.recording).returncode, 0)
        model = ColmapModel(self.folder / "export/sparse/0", ".bin")
        for image in model.images.values():
            self.assertTrue((self.folder / "export/images" / image["name"]).exists())
        cameras = {image["name"][:5]: image["camera"] for image in model.images.values()}
        self.assertEqual(set(cameras), {"cam0/", "cam1/"})
        self.assertNotEqual(cameras["cam0/"], cameras["cam1/"])
        self.assertLess(rms(model.errors()), 1.0)
        seen = [{model.images[image]["name"][:5] for image, _ in point["track"]} for point in model.points.values()]
        self.assertGreater(sum(len(names) == 2 for names in seen), len(seen) / 2)
        self.assertTrue(any(point["rgb"] != [128, 128, 128] for point in model.points.values()))
        rig, = json.loads((self.folder / "export/rig.json").read_text())
        self.assertEqual(rig["cameras"][1]["rel_tvec"], [-0.2, 0.003, 0.0])

    def test_undistorted(self):
        self.assertEqual(self.export("colmap", "--input", self.recording, "--undistort").returncode, 0)
        model = ColmapModel(self.folder / "export/sparse/0", ".bin")
        self.assertEqual({name for name, _ in model.cameras.values()}, {"PINHOLE"})
        self.assertEqual(len(model.cameras), 2)
        self.assertLess(rms(model.errors()), 1.0)
        for image in model.images.values():
            height, width, _ = cv2.imread(str(self.folder / "export/images" / image["name"])).shape
            self.assertEqual((width, height), model.sizes[image["camera"]])
        self.assertEqual(self.export("nerfstudio", "--input", self.recording, "--undistort").returncode, 0)
        transforms = json.loads((self.folder / "export/transforms.json").read_text())
        self.assertEqual(transforms["camera_model"], "PINHOLE")
        self.assertNotIn("k1", transforms["frames"][0])
        self.assert_refused(self.export("colmap", "--undistort", "--split-views", 6), "--undistort")
        self.assert_refused(self.export("ply", "--undistort"), "--undistort")

    def test_frames_lie_on_the_trajectory(self):
        self.frames("colmap", "all")
        poses = [list(map(float, row.split())) for row in self.trajectory.read_text().split("\n")[:-1]]
        images = ColmapModel(self.folder / "export/sparse/0", ".bin").images.values()
        self.assertEqual(len(images), 2 * len(poses))
        left = sorted((image for image in images if image["name"].startswith("cam0")), key=lambda image: image["name"])
        for pose, image in zip(poses, left):
            turned_back = [image["q"][0]] + [-part for part in image["q"][1:]]
            centre = rotate(turned_back, [-part for part in image["t"]])
            self.assertLess(math.dist(centre, pose[1:4]), 1e-6)
        self.frames("nerfstudio", "every", 10)
        views = json.loads((self.folder / "export/transforms.json").read_text())["frames"]
        self.assertEqual(len(views), 2 * math.ceil(len(poses) / 10))

    def test_what_cannot_be(self):
        self.assert_refused(self.export("colmap", "--frames", "all"), "--input")
        self.assert_refused(self.export("colmap", "--frames", "all", "--input", self.recording), "--trajectory")
        self.assert_refused(self.export("ply", "--input", self.recording), "colmap or nerfstudio")
        for which in (["some"], ["every"], ["every", 0], ["all", 3], ["sharpest", "x"]):
            self.assert_refused(self.export("colmap", "--frames", *which), "--frames", "expected keyframes, all")
        other = self.folder / "other.txt"
        other.write_text("".join(f"{1000 + i}.0 0 0 0 0 0 0 1\n" for i in range(5)))
        done = self.export("colmap", "--frames", "all", "--input", self.recording, "--trajectory", other)
        self.assert_refused(done, "has no frame of the map")
        small = self.folder / "small"
        small.mkdir()
        for i in range(3):
            write_png(small / f"{i}.png", 64, 48)
        self.assert_refused(self.export("colmap", "--input", small), "64x48", "376x240")
        self.assertFalse((self.folder / "export").exists())


class Import(Exchange):
    def test_same_file_same_bytes(self):
        self.import_map(small_msg())
        first = self.map.read_bytes()
        self.import_map(small_msg())
        self.assertEqual(first, self.map.read_bytes())

    def test_settings(self):
        settings = self.config(SETTINGS)
        done = waymark("import", "--settings", settings)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("Mapping", done.stderr)
        camchain = self.config(done.stdout, "camchain.yaml")
        self.assertIn("1 camera", waymark("config", camchain).stdout)
        waymark("import", "--settings", settings, "-o", self.folder / "again.yaml")
        self.assertEqual((self.folder / "again.yaml").read_text(), done.stdout)
        self.assertNotIn("its camera", self.import_map(small_msg(), "--settings", settings).stderr)
        other = self.config(SETTINGS.replace("fx: 400", "fx: 500"))
        self.assertIn("its camera", self.import_map(small_msg(), "--settings", other).stderr)

    def test_bad_input(self):
        damaged = small_msg()
        damaged["keyframes"]["1"]["rot_cw"] = [0.0, 0.0, 0.0]
        self.assert_fails(self.import_map(damaged), 2, "keyframes.1.rot_cw", "expected 4")
        whole = pack(small_msg())
        self.assert_fails(self.import_map(whole[:-9]), 2, "map.msg", "truncated")
        self.assert_fails(self.import_map(b""), 2, "map.msg", "truncated")
        self.assert_fails(self.import_map(b"%PDF-1.4 and so on"), 2, "map.msg", "expected a map")
        missing = waymark("import", self.folder / "none.msg", "-o", self.map)
        self.assert_fails(missing, 2, "none.msg", "missing")
        self.assert_fails(waymark("import", self.msg), 2, "-o")
        self.assert_fails(waymark("import", "-o", self.map), 2, "MAP")
        self.assert_fails(waymark("export", self.msg, "-o", self.out / "x.ply"), 2, "map.msg")

    def test_bad_output(self):
        self.msg.write_bytes(pack(small_msg()))
        done = waymark("import", self.msg, "-o", self.folder / "none" / "map.wmap")
        self.assert_fails(done, 1, "map.wmap")


if __name__ == "__main__":
    unittest.main()

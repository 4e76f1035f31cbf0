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

from cli_support import CliTest, waymark
from exchange_formats import ColmapModel, pack, read_ply, small_msg

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


class Exchange(CliTest):
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
        (folder / "sparse" / "0" / "mine.txt").write_text("mine")
        self.export("colmap", "again")
        self.assertEqual({path.name for path in (folder / "sparse" / "0").iterdir()},
                         {"cameras.bin", "images.bin", "points3D.bin", "mine.txt"})

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
        self.assertIn("1 cameras", waymark("config", camchain).stdout)
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

#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""What the program does with maps and inputs, from Python: merge, align, export, import, info, view; and what
objects say of themselves."""
import json
import pathlib
import sys
import urllib.request
import xml.etree.ElementTree
from html.parser import HTMLParser
import unittest

import numpy as np
import waymark
from support import DATA, Test, camchain, frames, map_stereo

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "tests"))
import map_records  # noqa: E402
from exchange_formats import ColmapModel, pack, read_ply, small_msg  # noqa: E402

STEREO = DATA / "stereo_out/map.wmap"
MONO = DATA / "mono_out/map.wmap"


def way_in(html):
    """Pixels of the way of the camera in a picture."""
    svg = xml.etree.ElementTree.fromstring(html[html.index("<svg"):html.index("</svg>") + 6])
    way = next(element for element in svg if element.tag.endswith("polyline")).get("points").split()
    return np.array([pair.split(",") for pair in way], float)


class Merge(Test):
    def test_one_map_of_two(self):
        first, second = waymark.Map.load(STEREO), waymark.Map.load(STEREO)
        merged = first.merge(second)
        self.assertEqual(merged.map.num_keyframes, 2 * first.num_keyframes)
        self.assertGreaterEqual(merged.num_joins, 1)
        self.assertFalse(merged.is_incomparable)
        self.assertEqual(len([s for s in merged.map.submaps() if s.joined_into is None]), 1)
        self.assertRegex(repr(merged), r"^<MergedMap of \d+ keyframes, 1 join, \d+ loops?>$")
        np.testing.assert_array_equal(first.merge(second, seed=0).map.landmarks().positions_in_world,
                                      merged.map.landmarks().positions_in_world)

    def test_scale_free_with_metres(self):
        self.assertTrue(waymark.Map.load(STEREO).merge(waymark.Map.load(MONO)).is_incomparable)
        self.assert_raises(ValueError, "seed", waymark.Map.load(MONO).merge, waymark.Map.load(MONO), seed=-1)


class Align(Test):
    @classmethod
    def setUpClass(cls):
        cls.mono = waymark.Map.load(MONO)
        cls.ids = cls.mono.keyframes().ids

    def test_known_distance(self):
        a, b = int(self.ids[0]), int(self.ids[-1])
        scaled = self.mono.align(distances=[(a, b, 2.5)])
        where = scaled.keyframes().world_from_rig[:, :3, 3]
        self.assertAlmostEqual(np.linalg.norm(where[-1] - where[0]), 2.5, places=9)
        self.assertTrue(scaled.is_metric)
        self.assertFalse(self.mono.is_metric, "maps do not change")
        self.assertIsNotNone(scaled.image(a))

    def test_up(self):
        level = waymark.Map.load(STEREO).align(up=[0, -1, 0])
        np.testing.assert_allclose(level.keyframes().world_from_rig[0, :3, :3] @ [0, -1, 0], [0, 0, 1], atol=1e-9)

    def test_trajectory(self):
        turned = waymark.Map.load(DATA / "stereo_out/map.wmap").align(up=[0.3, -1, 0.2])
        keyframes = waymark.Map.load(DATA / "stereo_out/map.wmap").keyframes()
        back = turned.align(trajectory=DATA / "stereo_out/trajectory.txt")
        np.testing.assert_allclose(back.keyframes().world_from_rig[:, :3, 3], keyframes.world_from_rig[:, :3, 3],
                                   atol=1e-3)
        self.assertGreater(np.abs(turned.keyframes().world_from_rig - keyframes.world_from_rig).max(), 0.1)

    def test_what_cannot_be(self):
        self.assert_raises(TypeError, "one of", self.mono.align)
        self.assert_raises(TypeError, "one of", self.mono.align, up=[0, 0, 1], distances=[])
        self.assert_raises(TypeError, "distances", self.mono.align, distances=[(1, 2)])
        self.assert_raises(waymark.InputError, ["distances", "99999"], self.mono.align, distances=[(0, 99999, 1.0)])
        self.assert_raises(waymark.InputError, "distances", self.mono.align, distances=[])
        self.assert_raises(waymark.InputError, "no direction", self.mono.align, up=[0, 0, 0])
        self.assert_raises(TypeError, "three numbers", self.mono.align, up=[0, 0])


class Export(Test):
    def test_formats(self):
        saved = waymark.Map.load(STEREO)
        for format in ("ply", "tum", "kitti"):
            saved.export(self.folder / f"out.{format}", format)
        self.assertGreater(len(read_ply(self.folder / "out.ply")), 100)
        self.assertEqual((self.folder / "out.tum").read_text(), (DATA / "stereo_out/keyframes.txt").read_text())
        saved.export(self.folder / "colmap", "colmap", text=True)
        model = ColmapModel(self.folder / "colmap/sparse/0", ".txt")
        self.assertEqual(len(model.images), saved.num_keyframes)
        self.assertTrue((self.folder / "colmap/database.db").exists())

    def test_every_frame_of_both_cameras(self):
        system = map_stereo()
        trajectory = system.trajectory()
        system.map().export(self.folder / "out", "nerfstudio", frames="all", input=DATA / "stereo",
                            trajectory=trajectory)
        views = json.loads((self.folder / "out/transforms.json").read_text())["frames"]
        self.assertEqual(len(views), 2 * len(trajectory))
        for i in (0, len(trajectory) - 1):
            left = views[2 * i]
            self.assertTrue((self.folder / "out" / left["file_path"]).exists())
            np.testing.assert_allclose(np.array(left["transform_matrix"])[:3, 3],
                                       trajectory.world_from_rig[i][:3, 3], atol=1e-6)
        system.map().export(self.folder / "out", "nerfstudio", frames=("sharpest", 5), input=DATA / "stereo",
                            trajectory=trajectory)
        self.assertLessEqual(len(list((self.folder / "out/images/cam0").iterdir())), 5)

    def test_what_cannot_be(self):
        saved = waymark.Map.load(MONO)
        out = self.folder / "out"
        self.assert_raises(ValueError, "format", saved.export, out, "obj")
        self.assert_raises(ValueError, "frames", saved.export, out, "colmap", frames="some")
        self.assert_raises(ValueError, "frames", saved.export, out, "colmap", frames=("all", 3))
        self.assert_raises(ValueError, "frames", saved.export, out, "colmap", frames=("every", 0))
        self.assert_raises(waymark.InputError, "--input", saved.export, out, "colmap", frames="all")
        self.assert_raises(ValueError, "split_views", saved.export, out, "colmap", split_views=2)
        out.mkdir()
        (out / "mine.txt").write_text("mine")
        self.assert_raises(waymark.InputError, "mine.txt", saved.export, out, "colmap")
        self.assertEqual([path.name for path in self.folder.iterdir()], ["out"])


class Inputs(Test):
    def test_info(self):
        info = waymark.info(DATA / "stereo", cameras=camchain())
        self.assertEqual((info["format"], info["setup"], info["frames"]), ("euroc", "stereo", 40))
        self.assert_raises(waymark.InputError, "none", waymark.info, self.folder / "none")

    def test_import(self):
        document = small_msg()
        document["landmarks"]["99"] = {**document["landmarks"]["1"]}
        document["landmark_next_id"] = 100
        (self.folder / "map.msg").write_bytes(pack(document))
        imported, notes = waymark.import_map(self.folder / "map.msg")
        self.assertEqual((imported.num_keyframes, imported.num_landmarks), (3, 40))
        self.assertEqual(len(notes), 1)
        self.assert_raises(waymark.InputError, "none.msg", waymark.import_map, self.folder / "none.msg")
        (self.folder / "settings.yaml").write_text(
            "Camera:\n  name: c\n  setup: monocular\n  model: perspective\n  fx: 400.0\n  fy: 402.0\n  cx: 320.0\n"
            "  cy: 240.0\n  k1: -0.1\n  k2: 0.02\n  cols: 640\n  rows: 480\nMapping:\n  backend: g2o\n")
        calibration = waymark.import_settings(self.folder / "settings.yaml")
        self.assertEqual(calibration.cameras[0].intrinsics, [400, 402, 320, 240])
        self.assertTrue(any("Mapping" in note for note in calibration.notes))


class Reports(Test):
    def test_of_one_run(self):
        page = waymark.report(DATA / "stereo_out", path=self.folder / "page.html")
        self.assertEqual(page, str(self.folder / "page.html"))
        self.assertIn("Quality", (self.folder / "page.html").read_text())
        waymark.report([DATA / "stereo_out"], ground_truth=DATA / "stereo/groundtruth.txt", align="sim3", path=page)
        self.assertIn("Position error", (self.folder / "page.html").read_text())

    def test_of_several(self):
        page = waymark.report([DATA / "stereo_out", DATA / "mono_out"], path=self.folder / "page.html")
        self.assertIn("2 runs compared", pathlib.Path(page).read_text())

    def test_what_cannot_be(self):
        self.assert_raises(waymark.InputError, "gone", waymark.report, self.folder / "gone")
        self.assert_raises(waymark.InputError, "has no folder", waymark.report, [])
        self.assert_raises(ValueError, "align: is 'se2', expected se3, sim3, none", waymark.report, DATA / "stereo_out",
                           align="se2")
        self.assert_raises(waymark.OutputError, "page.html", waymark.report, DATA / "stereo_out",
                           path=self.folder / "no/such/page.html")
        self.assert_raises(TypeError, "folders", waymark.report, None)


class Evaluations(Test):
    def test_of_a_file(self):
        found = waymark.evaluate(DATA / "stereo_out/trajectory.txt", DATA / "stereo/groundtruth.txt",
                                 plot=self.folder / "plot.svg")
        self.assertEqual(found["align"], "se3")
        self.assertLess(found["ate_rmse_m"], 0.05)
        self.assertEqual(found["pairs"], found["poses"])
        self.assertIn("<svg", (self.folder / "plot.svg").read_text())
        mono = waymark.evaluate(DATA / "mono_out/trajectory.txt", DATA / "stereo/groundtruth.txt")
        self.assertEqual(mono["align"], "sim3")
        self.assertIn("no scale of its own", mono["notes"][0])

    def test_of_a_trajectory_in_memory(self):
        with waymark.System(waymark.Calibration(camchain("stereo"))) as system:
            for frame in list(waymark.open_input(DATA / "stereo")):
                system.feed(frame.timestamp_ns + 10**9, frame.image0, frame.image1)
        truth = DATA / "stereo/groundtruth.txt"
        found = waymark.evaluate(system.trajectory(), truth, time_offset=-1)
        self.assertLess(found["ate_rmse_m"], 0.05)
        self.assertEqual(found["time_offset_s"], -1)

    def test_what_cannot_be(self):
        path = DATA / "stereo_out/trajectory.txt"
        self.assert_raises(waymark.InputError, "gone", waymark.evaluate, path, self.folder / "gone")
        self.assert_raises(ValueError, "align: is 'se2'", waymark.evaluate, path, path, align="se2")
        self.assert_raises(ValueError, "time_offset: is 10000000000.0, expected seconds or auto", waymark.evaluate, path, path,
                           time_offset=1e10)
        self.assert_raises(TypeError, "time_offset", waymark.evaluate, path, path, time_offset=None)
        self.assert_raises(TypeError, "estimate", waymark.evaluate, None, path)


class Viewers(Test):
    def page_of(self, viewer):
        with urllib.request.urlopen(viewer.url, timeout=10) as answer:
            return answer.read().decode()

    def test_map(self):
        with waymark.Map.load(STEREO).view(0) as viewer:
            self.assertIn("<html", self.page_of(viewer))
            self.assertIn(viewer.url, repr(viewer))
            self.assertEqual(viewer.requests(), [])
        self.assertEqual((viewer.url, repr(viewer)), ("", "<Viewer, closed>"))

    def test_system(self):
        with waymark.System(camchain()) as system:
            viewer = system.view("127.0.0.1:0")
            for frame in frames()[:5]:
                system.feed(frame.timestamp_ns, frame.image0, frame.image1)
            self.assertIn("<html", self.page_of(viewer))
            viewer.close()
            for frame in frames()[5:8]:
                system.feed(frame.timestamp_ns, frame.image0, frame.image1)
        self.assertEqual(len(system.trajectory()), 8)
        self.assert_raises(RuntimeError, "after finish()", system.view, 0)

    def test_addresses(self):
        saved = waymark.Map.load(STEREO)
        self.assert_raises(waymark.InputError, "address", saved.view, "here:there")
        self.assert_raises(waymark.InputError, "address", saved.view, 70000)
        self.assert_raises(TypeError, "address", saved.view, None)


class Tags(HTMLParser):
    def __init__(self, text):
        super().__init__()
        self.open = []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


class Words(Test):
    def test_objects_print_themselves(self):
        system = map_stereo()
        saved = waymark.Map.load(STEREO)
        self.assertRegex(repr(system.statistics()), r"^<Statistics: \d+ keyframes, \d+ landmarks, 1 sub-map, \d+ loops?, ")
        self.assertRegex(repr(system.trajectory()), r"^<Trajectory of 40 frames in 1 sub-map, [\d.]+ long>$")
        self.assertEqual(repr(saved.submaps()[0]), "<Submap 0, in metres>")
        self.assertEqual(repr(waymark.Map.load(MONO).submaps()[0]), "<Submap 0, scale free>")

    def test_statistics_while_live(self):
        system = waymark.System(camchain())
        counts = []
        for frame in frames():
            system.feed(frame.timestamp_ns, frame.image0, frame.image1)
            counts.append(system.statistics().num_keyframes)
        self.assertGreater(counts[-1], 1)
        self.assertEqual(sorted(counts), counts)
        system.finish()

    def test_pictures(self):
        system = map_stereo()
        for shown, words in ((system.map(), "keyframes"), (system.trajectory(), "40 frames")):
            html = shown._repr_html_()
            self.assertEqual(Tags(html).open, [])
            self.assertIn(words, html)
            self.assertNotIn("nan", html)
            pixels = way_in(html)
            self.assertTrue(((pixels >= 0) & (pixels <= [420, 280])).all())
            self.assertGreater(np.ptp(pixels, axis=0).max(), 20)
        self.assertGreater(len(system.map()._repr_html_()), 2000)
        self.assertLess(len(system.map()._repr_html_()), 60000)

    def test_points_far_out_do_not_shrink_the_picture(self):
        size = np.ptp(way_in(waymark.Map.load(STEREO)._repr_html_()), axis=0).max()
        records = map_records.split(STEREO.read_bytes())
        for record in records:
            if record.get("kind") == "landmarks":
                array = record["position_in_world"]
                places = np.frombuffer(array["data"], array["dtype"]).reshape(array["shape"]).copy()
                places[::13] *= 1000
                array["data"] = places.tobytes()
        (self.folder / "far.wmap").write_bytes(map_records.join(records))
        far = way_in(waymark.Map.load(self.folder / "far.wmap")._repr_html_())
        self.assertGreater(np.ptp(far, axis=0).max(), 0.7 * size)

    def test_nothing_to_see(self):
        system = waymark.System(camchain())
        self.assertIn("0 keyframes", system.map()._repr_html_())
        self.assertIn("0 frames", system.trajectory()._repr_html_())
        self.assertEqual(repr(system.trajectory()), "<Trajectory of 0 frames in 0 sub-maps, 0 long>")


if __name__ == "__main__":
    unittest.main()

#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""The real COLMAP (Debian's colmap) goes on with what waymark export writes, as it is written.

It runs without a graphics card and without a display. Skipped where it is not installed."""
import json
import os
import shutil
import subprocess
import unittest

import numpy as np
from cli_support import CAMERA, CliTest, shared_folder, waymark
from exchange_formats import ColmapModel, rotate

NUM_FRAMES = 60
GLOBE = """cam0:
  camera_model: equirectangular
  resolution: [640, 320]
"""


def colmap(*arguments):
    """Runs it to its end; what it says."""
    environment = {**os.environ, "QT_QPA_PLATFORM": "offscreen"}
    done = subprocess.run(["colmap", *map(str, arguments)], capture_output=True, text=True, timeout=240,
                          env=environment, check=False)
    assert done.returncode == 0, f"colmap {arguments[0]}: {done.stdout[-2000:]} {done.stderr[-2000:]}"
    return done.stdout


def centres(model):
    """Where the cameras are, by name."""
    return {image["name"]: -np.array(rotate([image["q"][0], *(-x for x in image["q"][1:])], image["t"]))
            for image in model.images.values()}


def distance_after_fit(model, other):
    """The largest distance between cameras of the same name, of the length of all they span, once the
    other model is turned, moved and scaled onto the first (Umeyama 1991)."""
    first, second = centres(model), centres(other)
    assert first.keys() == second.keys()
    # What no point ties to the others stays where it was while they are moved.
    tied = {image["name"] for image in model.images.values() if any(point != -1 for *_, point in image["pixels"])}
    first = {name: centre for name, centre in first.items() if name in tied}
    a = np.array([first[name] for name in first])
    b = np.array([second[name] for name in first])
    span = np.linalg.norm(a.max(axis=0) - a.min(axis=0))
    a, b = a - a.mean(axis=0), b - b.mean(axis=0)
    u, s, vt = np.linalg.svd(a.T @ b)
    sign = np.diag([1, 1, np.sign(np.linalg.det(u @ vt))])
    scale = np.trace(np.diag(s) @ sign) / (b * b).sum()
    return np.linalg.norm(a - scale * b @ (u @ sign @ vt).T, axis=1).max() / span


@unittest.skipUnless(shutil.which("colmap"), "colmap is not installed (script/setup colmap)")
class Colmap(CliTest):
    @classmethod
    def setUpClass(cls):
        cls.made = shared_folder() / "colmap"
        if cls.made.exists():
            return
        cls.made.mkdir()
        for name, camera, arguments in (("pair", CAMERA, ("--setup", "stereo", "--motion", "inspect")),
                                        ("globe", GLOBE, ("--setup", "mono", "--motion", "loop"))):
            (cls.made / "camera.yaml").write_text(camera)
            waymark("simulate", "room", "--camera", cls.made / "camera.yaml", "--frames", NUM_FRAMES, "-o",
                    cls.made / name, *arguments)
        for name, source, setup in (("pair", "pair", "stereo"), ("one", "pair", "mono"), ("globe", "globe", "mono")):
            done = waymark("run", cls.made / source, "-c", cls.made / source / "camchain.yaml", "--setup", setup,
                           "--keep-images", "--map-out", cls.made / f"{name}.wmap", "-o", cls.made / f"{name}_out")
            assert done.returncode == 0, done.stderr

    def export(self, name, *arguments):
        """The folder of an export of a map, and its model."""
        folder = self.folder / "model"
        suffix = ".txt" if "--text" in arguments else ".bin"
        done = waymark("export", self.made / f"{name}.wmap", "--format", "colmap", "-o", folder, *arguments)
        self.assertEqual(done.returncode, 0, done.stderr)
        return folder, ColmapModel(folder / "sparse/0", suffix)

    def other_frames(self, name, *which):
        return ("--input", self.made / "pair", "--trajectory", self.made / f"{name}_out/trajectory.txt",
                "--frames", *which)

    def result(self, name):
        (self.folder / name).mkdir()
        return self.folder / name

    def triangulate(self, folder, model, database="database.db", *arguments):
        out = self.result(f"triangulated_{database}")
        colmap("point_triangulator", "--database_path", folder / database, "--image_path", folder / "images",
               "--input_path", folder / "sparse/0", "--output_path", out, *arguments)
        triangulated = ColmapModel(out, ".bin")
        where = centres(triangulated)
        for name, centre in centres(model).items():
            np.testing.assert_allclose(where[name], centre, atol=1e-9)
        return triangulated

    def adjust(self, folder, model):
        out = self.result("adjusted")
        colmap("bundle_adjuster", "--input_path", folder / "sparse/0", "--output_path", out,
               "--BundleAdjustment.refine_focal_length", 0, "--BundleAdjustment.refine_extra_params", 0)
        return distance_after_fit(model, ColmapModel(out, ".bin"))

    def check(self, folder, model, max_distance):
        """All of it is read, triangulated and adjusted; few points go, and the poses stay near."""
        self.assertIn(f"Registered images: {len(model.images)}",
                      colmap("model_analyzer", "--path", folder / "sparse/0"))
        seen_twice = [point for point in model.points.values() if len(point["track"]) > 1]
        triangulated = self.triangulate(folder, model)
        self.assertGreater(len(triangulated.points), 0.9 * len(seen_twice))
        self.assertLess(self.adjust(folder, model), max_distance)

    def test_one_camera(self):
        for form in ((), ("--text",)):
            with self.subTest(form):
                folder, model = self.export("one", *form)
                self.check(folder, model, 0.02)
                shutil.rmtree(self.folder)
                self.folder.mkdir()

    def test_undistorted(self):
        folder, model = self.export("one", "--undistort")
        self.assertEqual({name for name, _ in model.cameras.values()}, {"PINHOLE"})
        self.check(folder, model, 0.02)

    def test_own_features(self):
        """Features that COLMAP finds itself are others: --clear_points takes ours away."""
        folder, model = self.export("one")
        database = ("--database_path", self.folder / "model/own.db")
        colmap("feature_extractor", *database, "--image_path", folder / "images", "--ImageReader.single_camera", 1,
               "--SiftExtraction.use_gpu", 0)
        colmap("sequential_matcher", *database, "--SiftMatching.use_gpu", 0)
        triangulated = self.triangulate(folder, model, "own.db", "--clear_points", 1)
        self.assertGreater(len(triangulated.points), 300)

    def test_both_cameras_of_a_pair(self):
        folder, model = self.export("pair", "--input", self.made / "pair")
        names = {image["name"] for image in model.images.values()}
        self.assertEqual({name[5:] for name in names if name.startswith("cam0/")},
                         {name[5:] for name in names if name.startswith("cam1/")})
        for name in names:
            self.assertTrue((folder / "images" / name).exists(), name)
        self.check(folder, model, 0.02)
        where = centres(model)
        for name in names:
            if name.startswith("cam0/"):
                apart = np.linalg.norm(where[name] - where["cam1/" + name[5:]])
                self.assertAlmostEqual(apart, np.hypot(0.2, 0.003), places=3)

    def test_rig(self):
        folder, model = self.export("pair", "--input", self.made / "pair")
        rig, = json.loads((folder / "rig.json").read_text())
        self.assertEqual([camera["image_prefix"] for camera in rig["cameras"]], ["cam0/", "cam1/"])
        out = self.result("rig")
        colmap("rig_bundle_adjuster", "--input_path", folder / "sparse/0", "--output_path", out,
               "--rig_config_path", folder / "rig.json", "--estimate_rig_relative_poses", 0,
               "--BundleAdjustment.refine_focal_length", 0, "--BundleAdjustment.refine_extra_params", 0)
        self.assertLess(distance_after_fit(model, ColmapModel(out, ".bin")), 0.02)

    def test_every_frame(self):
        folder, model = self.export("one", *self.other_frames("one", "all"), "--text")
        self.assertGreater(len(model.images), 0.8 * NUM_FRAMES)
        self.assertEqual(len(list((folder / "images").iterdir())), len(model.images))
        self.check(folder, model, 0.02)

    def test_sharpest_frames(self):
        folder, model = self.export("pair", *self.other_frames("pair", "sharpest", 15))
        self.assertLessEqual(len(model.images), 30)
        self.check(folder, model, 0.03)  # Few of them are keyframes.

    def test_360_degrees_split(self):
        folder, model = self.export("globe", "--split-views", 6)
        # COLMAP does not know that the views of a moment are in one place.
        self.check(folder, model, 0.03)


if __name__ == "__main__":
    unittest.main()

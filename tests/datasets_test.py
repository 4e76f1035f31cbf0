#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Data sets that have no reader of their own, laid out as they are: the commands of docs/inputs.md map them."""
import pathlib
import re
import shutil
import unittest

import cv2

from cli_support import NUM_FRAMES, CliTest, waymark

PAGE = pathlib.Path(__file__).resolve().parent.parent / "docs/inputs.md"
RESOLUTION = (376, 240)


def cameras_of_page(name):
    """The camchain that the page gives for a data set."""
    return re.search(rf"```yaml\n(cam0: +# {name}.*?)```", PAGE.read_text(), re.DOTALL)[1]


class Datasets(CliTest):
    def images_of(self, folder, *streams):
        for stream in streams:
            if (folder / stream).is_dir():
                return sorted((folder / stream).glob("*.png"))
        self.fail(f"no images in {folder}")

    def lay_out(self, images, target, name, convert=None):
        target.mkdir(parents=True)
        for i, image in enumerate(images):
            path = target / name(i)
            if convert:
                cv2.imwrite(str(path), convert(cv2.imread(str(image), cv2.IMREAD_UNCHANGED)))
            else:
                shutil.copy(image, path)

    def camchain(self, text, source):
        """A camchain of the page with the numbers of the simulated cameras in place of the real ones."""
        chain = (source / "camchain.yaml").read_text()
        intrinsics = re.search(r"intrinsics: (\[.*?\])", chain)[1]
        baseline = re.search(r"T_cn_cnm1: ?\n? *(\[\[.*?\]\])", chain, re.DOTALL)
        text = re.sub(r"intrinsics: \[.*?\]", f"intrinsics: {intrinsics}", text)
        coefficients = re.search(r"distortion_coeffs: (\[.*?\])", chain)
        text = text.replace("distortion_model: none",
                            f"distortion_model: radtan\n  distortion_coeffs: {coefficients[1]}")
        text = re.sub(r"resolution: \[.*?\]", f"resolution: {list(RESOLUTION)}", text)
        if baseline:
            text = re.sub(r"T_cn_cnm1: \[\[.*?\]\]", f"T_cn_cnm1: {baseline[1]}", text)
        return self.config(text, "camchain.yaml")

    def assert_maps(self, setup, *arguments):
        done = waymark("run", *arguments, "-o", self.out)
        self.assertEqual(done.returncode, 0, done.stderr)
        summary = self.summary()
        self.assertEqual(summary["setup"], setup)
        poses = (self.out / "trajectory.txt").read_text().splitlines()
        self.assertEqual(len(poses), NUM_FRAMES, done.stderr)

    def test_tartanair(self):
        source = self.sequence("stereo")
        run = self.folder / "P001"
        for stream, side in (("cam0", "left"), ("cam1", "right")):
            self.lay_out(self.images_of(source, f"mav0/{stream}/data", f"image_{stream[3]}", side), run / f"image_{side}",
                         lambda i, side=side: f"{i:06d}_{side}.png")
        self.assert_maps("stereo", run / "image_left", run / "image_right", "-c",
                         self.camchain(cameras_of_page("tartanair"), source), "--fps", 10)

    def test_icl_nuim(self):
        source = self.sequence("rgbd")
        for stream in ("rgb", "depth"):
            self.lay_out(self.images_of(source, stream), self.folder / "living" / stream, lambda i: f"{i}.png")
        self.assert_maps("rgbd", self.folder / "living/rgb", "--depth", self.folder / "living/depth", "-c",
                         self.camchain(cameras_of_page("icl"), source))

    def test_scannet(self):
        """Colour as JPEG, depth in millimetres with fewer pixels."""
        source = self.sequence("rgbd")
        scene = self.folder / "scene0000_00"
        self.lay_out(self.images_of(source, "rgb"), scene / "color", lambda i: f"{i}.jpg", lambda image: image)
        self.lay_out(self.images_of(source, "depth"), scene / "depth", lambda i: f"{i}.png",
                     lambda depth: cv2.resize(depth // 5, (188, 120), interpolation=cv2.INTER_NEAREST))
        self.assert_maps("rgbd", scene / "color", "--depth", scene / "depth", "-c",
                         self.camchain(cameras_of_page("scannet"), source))

    def test_4seasons(self):
        """Names are times."""
        source = self.sequence("stereo")
        recording = self.folder / "undistorted_images"
        for stream in ("cam0", "cam1"):
            self.lay_out(self.images_of(source, f"mav0/{stream}/data", f"image_{stream[3]}"), recording / stream,
                         lambda i: f"{1585573880000000000 + 50000000 * i}.png")
        self.assert_maps("stereo", recording / "cam0", recording / "cam1", "-c",
                         self.camchain(cameras_of_page("tartanair"), source))
        times = [float(line.split()[0]) for line in (self.out / "trajectory.txt").read_text().splitlines()]
        self.assertAlmostEqual(times[-1] - times[0], 0.05 * (NUM_FRAMES - 1), places=3)
        self.assertGreater(times[0], 1.5e9)


if __name__ == "__main__":
    unittest.main()

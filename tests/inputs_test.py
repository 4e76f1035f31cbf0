#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Ways to name an input: lists, addresses, turned images, calibrations of other programs give the map of a folder."""
import functools
import http.server
import json
import pathlib
import shutil
import socket
import subprocess
import threading
import unittest

import cv2

from cli_support import CliTest, waymark

# The calibration of the sequence of cli_support, as other programs write it.
NERFSTUDIO = json.dumps({"camera_model": "OPENCV", "w": 376, "h": 240, "fl_x": 290, "fl_y": 291, "cx": 187.5,
                         "cy": 121.5, "k1": -0.2, "k2": 0.05, "p1": 0.0002, "p2": -0.0001, "frames": []})
ORBSLAM = """%YAML:1.0
Camera.type: "PinHole"
Camera1.fx: 290.0
Camera1.fy: 291.0
Camera1.cx: 187.0
Camera1.cy: 121.0
Camera1.k1: -0.2
Camera1.k2: 0.05
Camera1.p1: 0.0002
Camera1.p2: -0.0001
Camera.width: 376
Camera.height: 240
ORBextractor.nFeatures: 1000
"""
STELLA = """Camera:
  setup: monocular
  model: perspective
  fx: 290.0
  fy: 291.0
  cx: 187.0
  cy: 121.0
  k1: -0.2
  k2: 0.05
  p1: 0.0002
  p2: -0.0001
  cols: 376
  rows: 240
"""


class QuietHandler(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *arguments):
        pass


class Inputs(CliTest):
    def setUp(self):
        super().setUp()
        self.source = self.image_folder()
        self.camchain = self.folder / "camchain.yaml"

    def trajectory(self, *arguments, **options):
        done = waymark("run", *arguments, "-o", self.out, "--quiet", **options)
        self.assertEqual(done.returncode, 0, done.stderr)
        return (self.out / "trajectory.txt").read_text()

    def make_video(self):
        video = self.folder / "walk.mkv"
        subprocess.run(["ffmpeg", "-v", "error", "-framerate", "20", "-i", self.source / "%06d.png", "-c:v", "ffv1", video],
                       check=True)
        return video

    def test_lists_and_calibrations_of_other_programs(self):
        expected = self.trajectory(self.source, "-c", self.camchain)
        self.assertGreater(expected.count("\n"), 30)
        names = [str(path) for path in sorted(self.source.glob("*.png"))]
        timed = "".join(f"{0.05 * i:.3f} {name}\n" for i, name in enumerate(names))
        for listed, options in ((timed, ()), ("\n".join(names), ("--fps", 20))):
            self.assertEqual(self.trajectory("-", "-c", self.camchain, *options, input=listed), expected)
        for name, text in (("transforms.json", NERFSTUDIO), ("orbslam.yaml", ORBSLAM), ("stella.yaml", STELLA)):
            with self.subTest(name):
                config = self.config(text, name)
                self.assertEqual(self.trajectory(self.source, "-c", config, "--set", "calibration.refine=off"),
                                 self.trajectory(self.source, "-c", self.camchain, "--set", "calibration.refine=off"))
                self.assertIn("valid: 1 camera", waymark("config", config).stdout)
        done = self.run_on(self.source, "-c", self.folder / "orbslam.yaml", "--frames", 3)
        self.assertIn("algorithms are ignored: ORBextractor", done.stderr)

        self.assert_refused(waymark("info", "-", input="gone.png\n"), "gone.png: missing")
        self.assert_refused(waymark("info", "-", input=""), "standard input: holds no line")

    def assert_refused(self, done, *words):
        shutil.rmtree(self.out, ignore_errors=True)
        self.assert_fails(done, 2, *words)

    def camchain_on_its_side(self):
        """Of the images turned counter-clockwise."""
        return self.config("cam0:\n  camera_model: pinhole\n  intrinsics: [291, 290, 121, 188]\n  distortion_model: radtan\n"
                           "  distortion_coeffs: [-0.2, 0.05, 0.0001, 0.0002]\n  resolution: [240, 376]\n")

    def test_turned_images(self):
        expected = [list(map(float, line.split()[1:4])) for line in
                    self.trajectory(self.source, "-c", self.camchain).splitlines()]
        turned = self.folder / "turned"
        shutil.copytree(self.source, turned)
        for path in turned.glob("*.png"):
            cv2.imwrite(str(path), cv2.rotate(cv2.imread(str(path), cv2.IMREAD_GRAYSCALE), cv2.ROTATE_90_COUNTERCLOCKWISE))
        # Turned twice, each the same way round: the images are as they were, their calibration is stated on its side.
        self.assertGreater(len(expected), 30)
        again = self.trajectory(turned, "-c", self.camchain_on_its_side(), "--rotate", 90)
        self.assertEqual([list(map(float, line.split()[1:4])) for line in again.splitlines()], expected)
        self.assertIn("turned clockwise by 90 degrees: 376x240 px",
                      waymark("info", turned, "--rotate", 90).stdout)
        self.assert_refused(waymark("info", turned, "--rotate", 45), "--rotate")

    def test_a_video_that_says_how_it_is_turned(self):
        """What a phone held upright writes: images on their side, and a tag."""
        plain, tagged = self.folder / "plain.mp4", self.folder / "tagged.mp4"
        subprocess.run(["ffmpeg", "-v", "error", "-framerate", "20", "-i", self.source / "%06d.png", "-vf", "transpose=cclock",
                        "-c:v", "mpeg4", "-q:v", "2", plain], check=True)
        subprocess.run(["ffmpeg", "-v", "error", "-i", plain, "-metadata:s:v", "rotate=270", "-c", "copy", tagged], check=True)
        shown = subprocess.run(["ffprobe", "-v", "error", "-show_streams", tagged], capture_output=True, text=True)
        self.assertIn("rotation=-90\n", shown.stdout)  # To be turned clockwise, as phones have it.
        self.assertIn("240x376 px", waymark("info", plain).stdout)
        self.assertIn("376x240 px", waymark("info", tagged).stdout)
        upright = self.trajectory(tagged, "-c", self.camchain)
        self.assertEqual(upright, self.trajectory(plain, "-c", self.camchain_on_its_side(), "--rotate", 90))
        self.assertGreater(upright.count("\n"), 30)
        sensor = self.camchain_on_its_side()
        self.assertEqual(upright, self.trajectory(tagged, "-c", sensor))
        lines = json.loads((self.out / "summary.json").read_text())["input"]
        self.assertIn("note: the calibration is that of the sensor: turned clockwise by 90 degrees, as the video says of its "
                      "pictures", lines)
        self.assert_refused(waymark("run", plain, "-c", self.camchain, "-o", self.out), "is 240x376 px, expected 376x240 px")

    def test_360_degree_images_with_pixels_that_are_not_square(self):
        camera = self.config("cam0:\n  camera_model: equirectangular\n  intrinsics: []\n  distortion_model: none\n"
                             "  resolution: [640, 322]\n", "camera.yaml")
        source = self.folder / "sphere"
        done = waymark("simulate", "room", "--setup", "mono", "--camera", camera, "--frames", 40, "-o", source)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(self.trajectory(source).count("\n"), 40)
        judged = waymark("eval", self.out / "trajectory.txt", source / "groundtruth.txt", "--align", "sim3", "--json")
        self.assertLess(json.loads(judged.stdout)["ate_rmse_m"], 0.01)

    def test_a_video_in_the_network(self):
        video = self.make_video()
        handler = functools.partial(QuietHandler, directory=self.folder)
        with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
            threading.Thread(target=server.serve_forever, daemon=True).start()
            address = f"http://127.0.0.1:{server.server_address[1]}"
            self.assertEqual(self.trajectory(f"{address}/walk.mkv", "-c", self.camchain),
                             self.trajectory(video, "-c", self.camchain))
            self.assert_refused(waymark("info", f"{address}/gone.mp4"), "gone.mp4", "cannot be opened as a video")
            server.shutdown()

    def test_a_stream(self):
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        sender = subprocess.Popen(["ffmpeg", "-v", "error", "-re", "-i", self.make_video(), "-c:v", "mpeg2video", "-q:v", "2",
                                   "-f", "mpegts", f"tcp://127.0.0.1:{port}?listen=1"])
        try:
            def is_listening():
                return f"0100007F:{port:04X}" in pathlib.Path("/proc/net/tcp").read_text()
            self.wait_until(is_listening)
            done = self.run_on(f"tcp://127.0.0.1:{port}", "-c", self.camchain)
            self.assertIn(done.returncode, (0, 3), done.stderr)  # As fast as the machine is.
            self.assertIn(f"tcp://127.0.0.1:{port}: stream (mono)", done.stderr)
            self.assertGreater(self.summary()["frames"], 20)
            self.assertEqual(self.summary()["timing"], "realtime")
        finally:
            sender.kill()
            sender.wait()
        self.assert_refused(waymark("info", "rtsp://me:secret@127.0.0.1:9/cam"),
                            "rtsp://127.0.0.1:9/cam: cannot be opened")


if __name__ == "__main__":
    unittest.main()

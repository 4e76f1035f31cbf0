#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Images, videos and bags as users have them. Those that were recorded need WAYMARK_CASES, those that are made of
them ffmpeg, too."""
import json
import subprocess
import unittest

from cli_support import CliTest, users_case, waymark


def ffmpeg(*arguments):
    subprocess.run(["ffmpeg", "-v", "error", "-nostdin", "-y", *map(str, arguments)], check=True)


class UsersInputs(CliTest):
    def trajectory_of(self, source, *arguments, frames):
        """Maps all frames; gives what was printed."""
        done = self.run_on(source, *arguments)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual((self.summary()["tracked"], self.summary()["frames"]), (frames, frames), done.stderr)
        return done.stdout + done.stderr

    def assert_error_below(self, limit_m, truth, align="sim3"):
        done = waymark("eval", self.out / "trajectory.txt", truth, "--align", align, "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertLess(json.loads(done.stdout)["ate_rmse_m"], limit_m)

    def wide_images(self, levels):
        """The frames of a video as 16-bit images, levels: an expression of the 8-bit value."""
        images = self.folder / "wide"
        images.mkdir()
        ffmpeg("-i", users_case("04_zero_distortion") / "walk.mp4", "-frames:v", 60,
               "-vf", f"format=gray,format=gray16le,lut=y={levels}", "-pix_fmt", "gray16be", images / "%04d.png")
        return images

    def assert_wide_images_are_mapped(self, levels, words):
        case = users_case("04_zero_distortion")
        images = self.wide_images(levels)
        told = self.trajectory_of(images, "-c", case / "true.yaml", "--fps", 20, frames=60)
        self.assertIn(words, told)
        self.assert_error_below(0.03, case / "truth.txt")
        threaded = (self.out / "trajectory.txt").read_bytes()
        self.trajectory_of(images, "-c", case / "true.yaml", "--fps", 20, "--timing", "inline", frames=60)
        self.assertEqual((self.out / "trajectory.txt").read_bytes(), threaded)

    def test_twelve_bits_of_sixteen(self):
        self.assert_wide_images_are_mapped("val/16", "16-bit images: ")

    def test_thermal_numbers(self):
        self.assert_wide_images_are_mapped("7000+val/257*4.7", "is black, 8")

    def test_interlaced(self):
        case = users_case("06_interlaced")
        told = self.trajectory_of(case / "walk_1080i.mp4", "-c", case / "camera.yaml", frames=120)
        self.assertIn("interlaced, top field first: of each picture that field is used", told)
        self.assert_error_below(0.045, case / "truth.txt")

    def test_side_by_side(self):
        case = users_case("07_side_by_side")
        told = self.trajectory_of(case / "pair_sbs.mp4", "-c", case / "pair.yaml", frames=60)
        self.assertIn("two cameras of 320x240 px side by side in each picture, taken as a pair", told)
        self.assert_error_below(0.015, case / "truth.txt", "se3")
        told = waymark("info", case / "pair_sbs.mp4").stdout
        self.assertIn("side by side in each picture, of which the first is used", told)
        told = waymark("info", case / "pair_sbs.mp4", "--split", "none").stdout
        self.assertIn("images of 640x240 px", told)
        self.assertNotIn("side by side", told)

    def test_one_above_the_other_and_two_tracks(self):
        case = users_case("07_side_by_side")
        left, right = "[0:v]crop=320:240:0:0[a]", "[0:v]crop=320:240:320:0[b]"
        video = self.folder / "stacked.mp4"
        ffmpeg("-i", case / "pair_sbs.mp4", "-filter_complex", f"{left};{right};[a][b]vstack", "-crf", 15, video)
        told = self.trajectory_of(video, "-c", case / "pair.yaml", "--frames", 40, frames=40)
        self.assertIn("one above the other in each picture, taken as a pair", told)
        self.assert_error_below(0.02, case / "truth.txt", "se3")
        self.assertIn("one above the other", waymark("info", video).stdout)
        video = self.folder / "tracks.mkv"
        ffmpeg("-i", case / "pair_sbs.mp4", "-filter_complex", f"{left};{right}", "-map", "[a]", "-map", "[b]",
               "-crf", 15, video)
        told = self.trajectory_of(video, "-c", case / "pair.yaml", "--frames", 40, frames=40)
        self.assertIn("camera 1: the second track of", told)
        self.assert_error_below(0.02, case / "truth.txt", "se3")
        done = self.run_on(video, "-c", case / "pair.yaml", "--split", "none", "--frames", 40)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("(mono)", done.stderr)

    def camchain_of(self, *files, name="any"):
        done = waymark("config", "--from", name, *files)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout

    def assert_camchain(self, camchain, *parts):
        for part in parts:
            self.assertIn(part, camchain)

    def test_messages_of_a_camera(self):
        case = users_case("01_ros2_echo_end")
        for file in "camera_info.yaml", "two_messages.yaml":
            camchain = self.camchain_of(case / file, name="ros")
            self.assert_camchain(camchain, "intrinsics: [420, 421, 317, 242]", "distortion_model: radtan",
                                 "distortion_coeffs: [-0.19, 0.048, 0.0002, -0.0001, 0]", "resolution: [640, 480]")
            self.assertIn("valid: 1 camera\n", waymark("config", case / file).stdout)
        other = self.folder / "other.yaml"
        text = (case / "camera_info.yaml").read_text()
        other.write_text(text + text.replace("- 420.0", "- 430.0"))
        self.assert_fails(waymark("config", other), 2, "message 2 has other numbers than the first")

    def test_zeros_of_a_driver(self):
        case = users_case("04_zero_distortion")
        told = self.trajectory_of(case / "walk.mp4", "-c", case / "driver.yaml", frames=160)
        self.assertIn("once more with what the images tell", told)
        self.assert_error_below(0.04, case / "truth.txt")
        # With fewer features the map bends, and does not tell by itself.
        told = self.trajectory_of(case / "walk.mp4", "-c", case / "driver.yaml", "--set", "features.count=900",
                                  frames=160)
        self.assertIn("warning: calibration: the images contradict a lens without distortion", told)
        self.assertIn("once more with what the images tell", told)
        self.assert_error_below(0.04, case / "truth.txt")
        self.assertIn("the images contradict a lens without distortion", self.summary()["mistakes"][0])
        k1 = float((self.out / "calibration.yaml").read_text().split("distortion_coeffs: [")[1].split(",")[0])
        self.assertAlmostEqual(k1, -0.25, delta=0.01)
        exact = self.folder / "exact.yaml"
        exact.write_text((case / "driver.yaml").read_text() + "  distortion_coeffs_sigma: [0, 0, 0, 0]\n")
        told = self.trajectory_of(case / "walk.mp4", "-c", exact, "--frames", 40, frames=40)
        self.assertNotIn("contradict a lens without distortion", told)

    def test_numbers_that_nobody_measured(self):
        case = users_case("04_zero_distortion")
        placeholder = self.folder / "identity.yaml"
        placeholder.write_text((case / "driver.yaml").read_text().replace("[210, 210, 159.5, 119.5]", "[1, 1, 0, 0]"))
        told = self.trajectory_of(case / "walk.mp4", "-c", placeholder, frames=160)
        self.assertIn("a placeholder, which is taken as unknown", told)
        self.assertIn("calibration estimated: ", told)
        self.assert_error_below(0.04, case / "truth.txt")

    def test_two_files_of_a_pair(self):
        case = users_case("13_ros_pair_of_files")
        files = case / "left.yaml", case / "right.yaml"
        self.assert_fails(waymark("config", files[0], files[0]), 2, "has no baseline to ")
        self.assertIn("valid: 2 cameras", waymark("config", *files).stdout)
        self.assertIn("  - [1, 0, 0, -0.12]\n", self.camchain_of(*files, name="ros"))
        told = self.trajectory_of(case / "left", case / "right", "-c", files[0], "-c", files[1], frames=4)
        self.assertIn("(stereo)", told)

    def test_calibrations_of_many_programs(self):
        case = users_case("18_calibrations_elsewhere")
        fisheye = "distortion_model: equidistant"
        for file, *parts in (
                ("basalt.json", "intrinsics: [190.9, 190.9, 254.9, 256.8]", "[190.4, 190.4, 252.5, 254.9]", fisheye,
                 "  - [1, 0, 0, -0.11]\n"),
                ("cv.xml", "intrinsics: [420, 421, 317, 242]", "[-0.2, 0.05, 0.0002, -0.0001, 0]", "resolution: [640, 480]"),
                ("opensfm.json", "[902.4", "959.5, 719.5]", fisheye, "distortion_coeffs: [0.03, 0.01, 0, 0]"),
                ("odm.json", "[3666.24", "2740.97", "1812.5", "distortion_coeffs: [-0.01, 0.01, 0.0001, 0.0001, 0.001]"),
                ("metashape.xml", "intrinsics: [420, 420, 316.5, 241.5]", "distortion_coeffs: [-0.2, 0.05, 0, 0, 0]"),
                ("vins.yaml", "intrinsics: [285.1, 285, 424.1, 396]", fisheye, "[-0.006, 0.043, -0.041, 0.007]"),
                ("vinsmei.yaml", "camera_model: omni", "2130, 2120, 360, 240]", "[-0.06, 0.7, 0.0003, 0.0001]"),
                ("sensor.yaml", "intrinsics: [458.5, 457.25, 367.215, 248.375]", "[-0.28, 0.074, 0.00019359")):
            with self.subTest(file):
                self.assert_camchain(self.camchain_of(case / file), *parts)
                self.assertIn("valid: ", waymark("config", case / file).stdout)
        for file, *words in (
                ("stereo_one.yml", "is a stereo calibration of OpenCV without the size of its images, expected image_width"),
                ("zed.conf", "looks like the factory calibration of a ZED, which is not read, expected"),
                ("dso_camera.txt", "looks like camera.txt of DSO, which is not read, expected"),
                ("thin.txt", "model is 'THIN_PRISM_FISHEYE', expected one of: "),
                ("openicc.json", "expected a number")):
            with self.subTest(file):
                self.assert_fails(waymark("config", case / file), 2, *words)

    def test_two_tracks(self):
        case = users_case("12_two_video_tracks")
        told = self.trajectory_of(case / "preview_first.mp4", "-c", case / "camera.yaml", frames=60)
        self.assertIn("a track of 80x60 px (h264) beside it is not used", told)
        told = waymark("info", case / "two_lenses.mkv").stdout
        self.assertIn("a track of 320x240 px (h264) beside it is not used; as the other camera of a pair", told)
        done = waymark("info", case / "preview_first.mp4", "--split", "tracks")
        self.assertEqual(done.returncode, 2)
        self.assertIn("error: --split: is tracks, but ", done.stderr)

    def test_clock_that_is_set_back(self):
        bag = users_case("15_clock_step_or_doubles") / "clock_step.mcap"
        done = self.run_on(bag)
        self.assertEqual(self.summary()["frames"], 24, done.stderr)
        self.assertIn("goes back by 1.9", done.stderr + done.stdout)
        times = [int(row["timestamp_ns"]) for row in self.frames()]
        self.assertEqual(times, sorted(times))
        self.assertIn("24 frames", waymark("info", bag, "--times", "bag").stdout)
        done = waymark("info", bag, "--times", "headers")
        self.assertEqual(done.returncode, 2)
        self.assertIn("expected increasing times", done.stderr)

    def test_messages_that_are_there_twice(self):
        done = self.run_on(users_case("15_clock_step_or_doubles") / "doubled.mcap")
        self.assertEqual((self.summary()["frames"], self.summary()["out_of_order"]), (12, 12), done.stderr)
        self.assertIn("12 messages of ", done.stderr + done.stdout)

    def test_tiny_images(self):
        case = users_case("16_tiny_images")
        video, camera, map_file = case / "walk160.mp4", case / "camera.yaml", self.folder / "tiny.wmap"
        told = self.trajectory_of(video, "-c", camera, "--map-out", map_file, frames=80)
        self.assertIn("small images, enlarged to 480x360 px", told)
        self.assertNotIn("the result is poor", told)
        self.assert_error_below(0.15, case / "truth.txt")
        done = waymark("localize", map_file, video, "-c", camera, "-o", self.out)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("small images, enlarged to 480x360 px", done.stderr)
        self.assertGreater(self.summary()["localized"], 76)
        self.assert_error_below(0.15, case / "truth.txt")
        done = waymark("export", map_file, "--format", "colmap", "--input", video, "-o", self.folder / "colmap")
        self.assertEqual(done.returncode, 0, done.stderr)
        found = self.folder / "found.yaml"
        done = waymark("calibrate", video, "-o", found)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("images: as turned or resized, 480x360 px", done.stdout)
        self.trajectory_of(video, "-c", found, frames=80)

    def test_small_images_as_they_are(self):
        case = users_case("16_tiny_images")
        done = self.run_on(case / "walk160.mp4", "-c", case / "camera.yaml", "--resize", 159)
        self.assertNotIn("enlarged", done.stderr)
        self.assertIn("the result is poor: the reprojection error of 0.", done.stderr)
        self.assertIn("coarse", [advice["cause"] for advice in self.summary()["advice"]])

    def test_video_in_a_bag(self):
        case = users_case("17_h264_in_a_bag")
        for name in "foxglove.mcap", "compressed_image.mcap":
            self.trajectory_of(case / name, frames=60)

    def test_recording_that_was_not_closed(self):
        done = waymark("info", users_case("20_recording_not_closed") / "not_closed.mp4")
        self.assert_fails(done, 2, "was not closed", "its index (moov) is missing")

    def test_videos_of_any_name(self):
        case = users_case("23_video_by_suffix")
        unnamed = self.folder / "walk"
        unnamed.write_bytes((case / "walk.ts").read_bytes())
        for video in case / "walk.h264", unnamed:
            self.trajectory_of(video, "-c", case / "camera.yaml", frames=62)


if __name__ == "__main__":
    unittest.main()

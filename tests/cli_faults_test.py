#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""What the command line does with inputs it cannot read and outputs it cannot write."""
import os
import resource
import shutil
import subprocess
import unittest

from cli_support import NUM_FRAMES, CliTest, png_size, truncate, waymark, write_png


class BadInput(CliTest):
    def test_missing_folder(self):
        self.assert_fails(self.run_on(self.folder / "nowhere"), 2, "nowhere")

    def test_folder_without_images(self):
        empty = self.folder / "empty"
        empty.mkdir()
        self.assert_fails(self.run_on(empty), 2, "empty")

    def assert_skips(self, source, index, reason):
        done = self.run_on(source)
        self.assertEqual(done.returncode, 0, done.stderr)
        row = self.frames()[index]
        self.assertEqual((row["state"], row["reason"]), ("unreadable", reason))
        self.assertEqual(self.summary()["unreadable"], 1)
        self.assertEqual(self.summary()["frames"], NUM_FRAMES)
        self.assertRegex(done.stderr, f"unreadable: {reason}, skipped \\({self.images(source)[index]}( .camera 0.)?: ")
        return done.stderr

    def test_truncated_image_is_skipped_and_counted(self):
        source = self.sequence("stereo")
        truncate(self.images(source)[9])
        self.assert_skips(source, 9, "unreadable_image")
        # The libraries that decode images have their own words for it, which are no help to anybody.
        self.images(source)[9].write_bytes(b"P5 376 240 255\n" + bytes(100))
        done = self.run_on(source, "--frames", 10, "--quiet")
        self.assertRegex(done.stderr, r"\Awarning: frame 9: unreadable[^\n]*\n\Z")

    def test_libraries_do_not_speak_for_the_program(self):
        # A byte too many is no reason to skip a JPEG, but libjpeg has to say something to it.
        source, target = self.image_folder(), self.folder / "jpeg"
        target.mkdir()
        subprocess.run(["ffmpeg", "-v", "error", "-i", source / "%06d.png", "-start_number", "0", "-q:v", "2",
                        target / "%06d.jpg"], check=True)
        for image in target.iterdir():
            image.write_bytes(image.read_bytes()[:-2] + bytes(9) + b"\xff\xd9")
        shutil.copy(source / "times.txt", target)
        done = self.run_on(target, "-c", self.folder / "camchain.yaml", "--quiet")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertEqual(self.summary()["unreadable"], 0)

    def test_image_of_another_size_is_skipped_and_counted(self):
        source = self.sequence("stereo")
        write_png(self.images(source)[9], 64, 48)
        self.assert_skips(source, 9, "wrong_size")

    def test_huge_image_is_skipped_and_counted(self):
        source = self.sequence("stereo")
        with open(self.images(source)[9], "wb") as image:  # A bitmap, which the disk need not hold.
            image.truncate(image.write(b"P4 12000 12000\n") + 12000 * 12000 // 8)
        said = self.assert_skips(source, 9, "unreadable_image")
        self.assertIn("is 12000x12000 px, expected at most 135 megapixels", said)

    def test_bad_depth_image_is_told_and_counted(self):
        source = self.sequence("rgbd")
        depth = sorted((source / "depth").iterdir())[9]
        truncate(depth)
        done = self.run_on(source, "-c", source / "camchain.yaml")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn(f"frame 9: used without depth ({depth}: unreadable", done.stderr)
        self.assertIn("used with camera 0 alone, as other files could not be read: 1 frame", done.stderr)
        self.assertEqual(self.frames()[9]["state"], "tracked")

    def test_first_image_contradicts_the_calibration(self):
        source = self.image_folder()
        for image in source.glob("*.png"):
            write_png(image, 64, 48)
        self.assert_fails(self.run_on(source, "-c", self.folder / "camchain.yaml"), 2, "64")

    def test_resolution_contradicts_the_images(self):
        source = self.image_folder()
        width, height = png_size(source / "000000.png")
        chain = (self.folder / "camchain.yaml").read_text()
        wrong = chain.replace(str(width), str(width + 2))
        self.assertNotEqual(wrong, chain)
        done = self.run_on(source, "-c", self.config(wrong))
        self.assert_fails(done, 2, width, width + 2)

    def test_right_images_that_are_missing_are_counted(self):
        source = self.sequence("stereo")
        right = source / "mav0/cam1"
        rows = (right / "data.csv").read_text().rstrip("\n").split("\n")
        (right / "data.csv").write_text("\n".join(rows[:-3]) + "\n")
        damaged = sorted((right / "data").iterdir())[9]
        truncate(damaged)
        done = self.run_on(source)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("note: 3 frames have no image of camera 1", done.stderr)
        self.assertIn(f"frame 9: used without camera 1 ({damaged} (camera 1): unreadable", done.stderr)
        self.assertEqual(self.summary()["without_partner"], 4)
        self.assertEqual(self.frames()[9]["state"], "tracked")

    def test_empty_times(self):
        source = self.image_folder()
        (source / "times.txt").write_text("")
        done = self.run_on(source, "-c", self.folder / "camchain.yaml")
        self.assert_fails(done, 2, "times.txt")

    def test_nan_in_the_calibration(self):
        source = self.image_folder()
        bad = self.config("cam0:\n  camera_model: pinhole\n  intrinsics: [.nan, 458, 367, 248]\n"
                          "  distortion_model: none\n  resolution: [752, 480]\n")
        self.assert_fails(self.run_on(source, "-c", bad), 2, "intrinsics")

    def test_unknown_key_names_the_nearest(self):
        bad = self.config("tracking:\n  minimum_matchs: 3\n")
        self.assert_fails(self.run_on(self.sequence("stereo"), "-c", bad), 2,
                          "tracking.minimum_matchs", "tracking.min")
        self.assert_fails(self.run_on(self.folder / "input_stereo", "--set",
                                      "features.cuont=900"), 2, "features.cuont", "features.count")

    def test_nan_in_the_calibration_of_a_data_set(self):
        source = self.sequence("stereo")
        sensor = source / "mav0/cam1/sensor.yaml"
        lines = [line if not line.startswith("intrinsics") else "intrinsics: [290, .nan, 187, 121]"
                 for line in sensor.read_text().split("\n")]
        sensor.write_text("\n".join(lines))
        self.assert_fails(self.run_on(source), 2, "sensor.yaml", "intrinsics")

    def test_malformed_yaml(self):
        bad = self.config("cam0: [1,\n")
        self.assert_fails(self.run_on(self.sequence("stereo"), "-c", bad), 2, bad)
        self.assert_fails(waymark("config", bad), 2, bad)

    def test_part_beyond_the_end(self):
        done = self.run_on(self.sequence("stereo"), "--first", NUM_FRAMES)
        self.assert_fails(done, 2, "--first", NUM_FRAMES)

    def test_mask_that_is_no_image(self):
        mask = self.config("no image", "mask.png")
        self.assert_fails(self.run_on(self.sequence("stereo"), "--mask", mask), 2, mask)

    def test_trajectories_that_cannot_be_evaluated(self):
        truth = self.sequence("stereo") / "groundtruth.txt"
        plot = self.folder / "plot.svg"
        long_ago = "".join(f"{t} 0 0 0 0 0 0 1\n" for t in range(5))
        for text in (None, "", "hello\n", "1 nan 0 0 0 0 0 1\n", "1 0 0 0 0 0 0 3\n", long_ago):
            estimate = self.folder / "estimate.txt"
            if text is not None:
                estimate.write_text(text)
            done = waymark("eval", estimate, truth, "--plot", plot)
            self.assert_fails(done, 2, "evaluation" if text == long_ago else estimate)
            self.assertFalse(plot.exists())

    def test_worlds_that_cannot_be_simulated(self):
        self.assert_fails(waymark("simulate", "moon", "-o", self.out), 2, "moon", "--list")
        self.assert_fails(waymark("simulate", "room"), 2, "--out")
        self.assert_fails(waymark("simulate", "room", "--told", "fokal=1", "-o", self.out), 2, "fokal=1", "focal")
        self.assert_fails(waymark("simulate", "room", "--told", "imu_turn=5", "-o", self.out), 2, "no IMU", "--imu")
        self.assert_fails(waymark("simulate", "room", "--imu", "fone", "-o", self.out), 2, "fone")
        self.assert_fails(waymark("simulate", "room", "--imu", "phone,shft=1", "-o", self.out), 2, "--imu", "'shift'")
        self.assert_fails(waymark("simulate", "room", "--black", "3", "-o", self.out), 2, "--black", "FIRST,COUNT")
        self.assert_fails(waymark("simulate", "room", "--setup", "mono", "--turn", "1,0,0", "-o", self.out), 2, "--turn")
        camera = self.config("cam0: {camera_model: pinhole}\n")
        self.assert_fails(waymark("simulate", "room", "--camera", camera, "--setup", "mono", "-o",
                                  self.out), 2, camera)

    def test_pipes_in_a_data_set(self):
        for name in ("mav0/cam0/sensor.yaml", "mav0/cam0/data.csv"):
            source = self.sequence("stereo")
            (source / name).unlink()
            os.mkfifo(source / name)
            self.assert_fails(self.run_on(source), 2, name, "is no regular file, expected")
            shutil.rmtree(source)
        video = self.folder / "videos" / "walk.mkv"
        video.parent.mkdir()
        os.mkfifo(video)
        self.assert_fails(self.run_on(video.parent), 2, "walk.mkv: is no regular file")

    def test_settings_from_a_pipe(self):
        reading, writing = os.pipe()
        os.write(writing, b"features: {count: 900}\n")
        os.close(writing)
        done = waymark("config", f"/dev/fd/{reading}", pass_fds=[reading])
        os.close(reading)
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_missing_config(self):
        done = self.run_on(self.sequence("stereo"), "-c", self.folder / "no.yaml")
        self.assert_fails(done, 2, "no.yaml")

    def test_no_pose_at_all(self):
        source = self.image_folder()
        width, height = png_size(source / "000000.png")
        for image in source.glob("*.png"):
            write_png(image, width, height)
        done = self.run_on(source, "-c", self.folder / "camchain.yaml")
        self.assertEqual(done.returncode, 3, done.stderr)
        self.assertNotIn("reprojection error", done.stderr)
        self.assertNotIn("quality", self.summary())
        self.assertEqual(self.summary()["tracked"], 0)
        self.assertIsNone(self.summary()["initialized_at"])
        self.assertEqual({f["reason"] for f in self.frames()}, {"no_features"})
        self.assertIn(f"without a pose: {NUM_FRAMES} no_features", done.stderr)


class BadOutput(CliTest):
    @staticmethod
    def no_room():
        resource.setrlimit(resource.RLIMIT_FSIZE, (512, 512))

    def test_full_disk(self):
        done = self.run_on(self.sequence("stereo"), preexec_fn=self.no_room)
        self.assertEqual(done.returncode, 1, done.stderr)
        for name in ("trajectory.txt", "summary.json", "frames.csv"):
            self.assertIn(f"{self.out / name}: cannot be written", done.stderr)
        # What has room is there, and nothing else.
        self.assertEqual([path.name for path in self.out.iterdir()], ["keyframes.txt"])
        self.assertTrue((self.out / "keyframes.txt").read_text().endswith("\n"))

    def test_full_disk_leaves_earlier_results_that_it_cannot_replace(self):
        source = self.sequence("stereo")
        self.assertEqual(self.run_on(source, "--frames", 5).returncode, 0)
        before = {path.name: path.read_bytes() for path in self.out.iterdir()}
        done = self.run_on(source, preexec_fn=self.no_room)
        self.assertEqual(done.returncode, 1, done.stderr)
        after = {path.name: path.read_bytes() for path in self.out.iterdir()}
        self.assertEqual(after.keys(), before.keys())
        for name in ("trajectory.txt", "summary.json", "frames.csv"):
            self.assertEqual(after[name], before[name])

    def test_full_disk_for_a_simulation_or_a_plot(self):
        done = waymark("simulate", "room", "--frames", 2, "-o", self.out, preexec_fn=self.no_room)
        self.assert_fails(done, 1, self.out)
        truth = self.sequence("stereo") / "groundtruth.txt"
        plot = self.out / "plot.svg"
        done = waymark("eval", truth, truth, "--plot", plot, preexec_fn=self.no_room)
        self.assert_fails(done, 1, plot)

    def test_a_file_in_the_way(self):
        source = self.sequence("stereo")
        for out in (self.out, self.out / "below"):
            self.out.write_text("mine")
            done = waymark("run", source, "-o", out)
            self.assertEqual(done.returncode, 1, done.stderr)
            self.assertTrue(done.stderr.rstrip("\n").split("\n")[-1].startswith(f"error: {out}"))
            self.assertEqual(self.out.read_text(), "mine")

    def test_a_log_that_cannot_be_written(self):
        log = self.config("", "file") / "run.log"
        self.assert_fails(self.run_on(self.sequence("stereo"), "--log", log), 1, log.parent)


if __name__ == "__main__":
    unittest.main()

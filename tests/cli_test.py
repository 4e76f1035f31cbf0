#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""The contract of the command line: inputs, outputs, exit status, one-line errors."""
import array
import fcntl
import json
import os
import pathlib
import pty
import resource
import shutil
import signal
import subprocess
import termios
import unittest

from cli_support import NUM_FRAMES, PROGRAM, CliTest, waymark


def bytes_in(pipe):
    """What a pipe holds that nobody has read yet."""
    count = array.array("i", [0])
    fcntl.ioctl(pipe, termios.FIONREAD, count)
    return count[0]


def status_of(process):
    """The fields of /proc/PID/status; none once the process has ended."""
    try:
        lines = pathlib.Path(f"/proc/{process.pid}/status").read_text().split("\n")
    except (FileNotFoundError, ProcessLookupError):
        return {}
    return dict(line.split(":\t", 1) for line in lines if ":\t" in line)


def is_asleep(process):
    return status_of(process).get("State", "").startswith("S")


def has_pending(process):
    """Whether a signal has been sent but not yet handled."""
    status = status_of(process)
    return any(int(status.get(key, "0"), 16) for key in ("SigPnd", "ShdPnd"))


class Usage(CliTest):
    def test_help_is_complete(self):
        top = waymark("--help")
        self.assertEqual(top.returncode, 0)
        self.assertIn("Exit status", top.stdout)
        for command in ("run", "localize", "map", "eval", "simulate", "config"):
            self.assertIn(command, top.stdout)
            self.assertEqual(waymark(command, "--help").returncode, 0)
        text = waymark("run", "--help").stdout
        for option in ("--config", "--set", "--setup", "--out", "--timing", "--first", "--frames",
                       "--every", "--mask", "--pace", "--seed", "--quiet", "--verbose", "--log",
                       "--format", "--map-in", "--map-out", "--autosave",
                       "--keep-images"):
            self.assertIn(option, text)
        text = waymark("localize", "--help").stdout
        for option in ("MAP", "INPUT", "--config", "--unordered", "--out", "--first", "--verbose"):
            self.assertIn(option, text)

    def test_help_of_commands(self):
        self.assertEqual(waymark("help").stdout, waymark("--help").stdout)
        self.assertEqual(waymark("help", "map", "merge").stdout, waymark("map", "merge", "--help").stdout)
        self.assert_fails(waymark("help", "fly"), 2, "'fly'", "run, info")
        text = waymark("help", "run").stdout
        for part in ("Input:", "Cameras and settings:", "Part of the input:", "How it runs:", "Map:",
                     "Results and messages:", "Examples:\n  waymark run MH_01_easy\n"):
            self.assertIn(part, text)

    def test_mistakes_name_the_help_of_their_command(self):
        for mistake, command in ((("run",), "run"), (("run", "x", "--wings"), "run"), (("map", "fly"), "map"),
                                 (("map", "merge", "a"), "map merge"), (("export", "m", "--split-views", 2), "export")):
            self.assert_fails(waymark(*mistake), 2, f", see waymark {command} --help")

    def test_config_makes_a_camchain_of_other_calibrations(self):
        cameras = self.folder / "cameras.txt"
        cameras.write_text("1 OPENCV 640 480 500 501 320 240 -0.1 0.01 0 0\n")
        result = waymark("config", "--from", "colmap", cameras)
        self.assertEqual(result.returncode, 0)
        self.assertIn("intrinsics: [500, 501, 319.5, 239.5]", result.stdout)
        camchain = self.folder / "camchain.yaml"
        camchain.write_text(result.stdout)
        self.assertIn("valid: 1 camera", waymark("config", camchain).stdout)
        self.assert_fails(waymark("config", "--from", "ros", cameras), 2, "cameras.txt")
        self.assert_fails(waymark("config", "--from", "kalibr", cameras), 2, "--from")
        self.assert_fails(waymark("config", "--from", "ros"), 2, "expected one calibration")

    def test_wrong_usage(self):
        self.assert_fails(waymark(), 2)
        self.assert_fails(waymark("fly"), 2, "'fly'", "run, info, localize, map, atlas, fleet, view, eval, report, simulate")
        self.assert_fails(waymark("run"), 2, "INPUT")
        self.assert_fails(waymark("run", self.folder, "--wings"), 2, "--wings")
        self.assert_fails(waymark("run", self.folder, "--setup", "quad"), 2, "quad")
        self.assert_fails(waymark("run", self.folder, "--every", "0"), 2, "--every")
        for number in ("0", "nan", "inf", "1e9", "fast"):
            self.assert_fails(waymark("run", self.folder, f"--pace={number}"), 2, "--pace",
                              f"is {number}, expected a number from 0.001 to 1000")
        self.assert_fails(waymark("run", self.folder, "--map-out", "m.wmap", "--autosave", "nan"), 2, "--autosave")
        self.assert_fails(waymark("simulate", "room", "--rate", "nan"), 2, "--rate")
        self.assert_fails(waymark("simulate", "room", "--noise", "nan"), 2, "--noise")
        for number in ("0", "-1", "nan", "1.5"):
            self.assert_fails(waymark("run", self.folder, "--frames", number), 2,
                              f"--frames: is {number}, expected 1 or more")
        self.assert_fails(waymark("run", self.folder, "--quiet", "--verbose"), 2, "--quiet")

    def test_settings_are_no_map(self):
        settings = self.config("Camera: {name: a}\n")
        self.assert_fails(waymark("import", settings, "-o", self.folder / "map.wmap"), 2, "--settings")
        self.assertFalse((self.folder / "map.wmap").exists())

    def test_control_characters_of_names_stay_out_of_the_terminal(self):
        name = "\x1b]0;owned\a.wmap"
        for arguments in (("map", "info", self.folder / name), ("run", self.folder / name),
                          ("run", self.folder, f"--{name}"), (name,)):
            done = waymark(*arguments)
            self.assert_fails(done, 2, "\\x1b]0;owned\\x07")
            self.assertNotRegex(done.stderr, "[\x00-\x09\x0b-\x1f]")

    def test_what_the_system_denies_is_no_internal_failure(self):
        done = waymark("run", 300 * "a")
        self.assert_fails(done, 2, "a: File name too long, expected")
        self.assertNotIn("internal", done.stderr)

        def no_room_for_stacks():
            resource.setrlimit(resource.RLIMIT_STACK, (2**47, resource.RLIM_INFINITY))

        if resource.getrlimit(resource.RLIMIT_STACK)[1] == resource.RLIM_INFINITY:
            done = self.run_on(self.sequence("stereo"), preexec_fn=no_room_for_stacks)
            self.assert_fails(done, 1, "cannot start another thread", "expected higher limits")

    def test_too_few_features_to_start_with_are_refused(self):
        done = waymark("config", self.config("features: {count: 79}\n"))
        self.assert_fails(done, 2, "features.count", "79", "80")

    def test_settings_are_printed_and_checked(self):
        printed = waymark("config")
        self.assertEqual(printed.returncode, 0)
        for words in ("features", "count", "1000"):
            self.assertIn(words, printed.stdout)
        # What is printed is itself a valid file.
        self.assertEqual(waymark("config", self.config(printed.stdout)).returncode, 0)
        self.assert_fails(waymark("config", self.config("features: {count: -5}\n")), 2, "count")
        self.assert_fails(waymark("config", self.config("features: {count: many}\n")), 2, "count")


class Inputs(CliTest):
    def assert_maps(self, source, *arguments):
        done = self.run_on(source, *arguments)
        self.assertEqual(done.returncode, 0, done.stderr)
        summary = self.summary()
        self.assertEqual(summary["frames"], NUM_FRAMES)
        self.assertGreater(summary["coverage"], 0.5)
        return summary

    def test_euroc_needs_no_calibration(self):
        summary = self.assert_maps(self.sequence("stereo"))
        self.assertEqual(summary["setup"], "stereo")
        self.assertEqual(summary["mistakes"], [])

    def test_one_camera_of_a_pair(self):
        summary = self.assert_maps(self.sequence("stereo"), "--setup", "mono")
        self.assertEqual(summary["setup"], "mono")

    def test_usual_mistakes_are_named(self):
        source = self.sequence("stereo")
        mav0 = source / "mav0"
        (mav0 / "cam0" / "data").rename(mav0 / "other")
        (mav0 / "cam1" / "data").rename(mav0 / "cam0" / "data")
        (mav0 / "other").rename(mav0 / "cam1" / "data")
        for sensor in ("cam0", "cam1"):
            listed = mav0 / sensor / "data.csv"
            rows = [row.split(",") for row in listed.read_text().splitlines()[1:]]
            listed.write_text("".join(f"{int(time) // 10**6},{name}\n" for time, name in rows))
        done = self.run_on(source)
        for text in ("time stamps in milliseconds? Expected nanoseconds", "left and right images are swapped"):
            self.assertIn(text, done.stderr)
        mistakes = self.summary()["mistakes"]
        self.assertEqual(len(mistakes), 2, mistakes)
        for mistake in mistakes:
            self.assertIn(f"warning: {mistake}\n", done.stderr)

    def test_tum(self):
        source = self.sequence("rgbd")
        summary = self.assert_maps(source, "-c", source / "camchain.yaml")
        self.assertEqual(summary["setup"], "rgbd")

    def test_two_folders_are_a_pair(self):
        source = self.sequence("stereo")
        left, right = (source / "mav0" / camera / "data" for camera in ("cam0", "cam1"))
        sorted(right.iterdir())[20].unlink()
        summary = self.assert_maps(left, right, "-c", source / "camchain.yaml", "--fps", 20)
        self.assertEqual((summary["setup"], summary["without_partner"]), ("stereo", 1))
        (source / "mav0" / "left").mkdir()
        for images, name in ((left, "left"), (right, "right")):
            images.rename(source / "mav0" / "left" / name)
        done = self.run_on(source / "mav0" / "left")
        self.assertEqual(done.returncode, 2)
        self.assertIn("left/ and right/ hold 40 and 39 images: for a stereo pair say waymark run", done.stderr)

    def test_info(self):
        source = self.sequence("stereo")
        done = waymark("info", source, "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        info = json.loads(done.stdout)
        self.assertEqual((info["format"], info["setup"], info["frames"]), ("euroc", "stereo", NUM_FRAMES))
        self.assertEqual([camera["width_px"] for camera in info["cameras"]], [376, 376])
        self.assertEqual(info["gaps"], [])
        self.assertIn("gaps: none", waymark("info", source).stdout)

    def test_image_folder(self):
        source = self.image_folder()
        self.assertIn("or found from the images of one camera", waymark("info", source).stdout)
        self.assert_maps(source, "-c", self.folder / "camchain.yaml")

    def test_a_third_camera_is_said_to_be_ignored(self):
        source = self.sequence("stereo")
        chain = (source / "camchain.yaml").read_text()
        third = self.config(chain + chain[chain.index("cam1:"):].replace("cam1:", "cam2:"))
        note = "note: %s:%d: cam2 is ignored" % (third, chain.count("\n") + 1)
        done = self.run_on(source, "-c", third, "--frames", 2)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn(note, done.stderr)
        self.assertIn(note, waymark("config", third).stdout)

    def test_video(self):
        source, video = self.image_folder(), self.folder / "walk.mkv"
        subprocess.run(["ffmpeg", "-v", "error", "-framerate", "20", "-i", source / "%06d.png",
                        "-c:v", "ffv1", video], check=True)
        self.assert_maps(video, "-c", self.folder / "camchain.yaml")

    def test_calibration_that_folds_back_in_the_corners(self):
        camera = self.config("cam0:\n  camera_model: pinhole\n  intrinsics: [265, 265, 187.5, 119.5]\n"
                             "  distortion_model: radtan\n  distortion_coeffs: [-0.35, 0.05, 0, 0]\n"
                             "  resolution: [376, 240]\n")
        source, saved = self.folder / "folded", self.folder / "folded.wmap"
        done = waymark("simulate", "room", "--motion", "slide", "--camera", camera, "--setup", "rgbd", "--frames", 12,
                       "-o", source)
        self.assertEqual(done.returncode, 0, done.stderr)
        done = self.run_on(source, "-c", source / "camchain.yaml", "--map-out", saved)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex(done.stderr, r"camera 0: the calibration has no direction for \d+\.\d % of the pixels")
        self.assertEqual(self.summary()["tracked"], 12)
        self.assertEqual(waymark("map", "check", saved).returncode, 0)

    def test_part_of_an_input(self):
        done = self.run_on(self.sequence("stereo"), "--first", 4, "--frames", 6, "--every", 2)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual([int(f["index"]) for f in self.frames()], [4, 6, 8, 10, 12, 14])
        self.assertEqual(self.summary()["frames"], 6)


class Outputs(CliTest):
    def test_files_agree(self):
        self.assertEqual(self.run_on(self.sequence("stereo"), "--seed", 3).returncode, 0)
        summary, frames = self.summary(), self.frames()
        lines = (self.out / "trajectory.txt").read_text().strip().split("\n")
        has_pose = [f for f in frames if f["state"] in ("tracked", "filled")]
        self.assertEqual(len(frames), NUM_FRAMES)
        self.assertEqual(summary["tracked"], len(has_pose))
        self.assertEqual(len(lines), len(has_pose))
        self.assertAlmostEqual(summary["coverage"], len(lines) / NUM_FRAMES, places=6)
        for line, frame in zip(lines, has_pose):
            seconds, *pose = line.split()
            self.assertEqual(round(float(seconds.split(".")[0]) * 10**9) +
                             int(seconds.split(".")[1]), int(frame["timestamp_ns"]))
            self.assertEqual(len(seconds.split(".")[1]), 9)
            self.assertEqual(len(pose), 7)
        keyframes = (self.out / "keyframes.txt").read_text().strip().split("\n")
        self.assertEqual(len(keyframes), summary["keyframes"])
        self.assertTrue(set(keyframes) <= set(lines))
        self.assertEqual((summary["seed"], summary["timing"]), (3, "lockstep"))
        for key in ("filled", "unreadable", "dropped", "initialized_at", "lost_count", "landmarks",
                    "submaps", "loops", "relocalizations", "wall_s", "cpu_s", "peak_rss_mb",
                    "tracking_ms", "mapping_ms", "stages_ms", "setup", "version"):
            self.assertIn(key, summary)
        self.assertEqual(set(summary["tracking_ms"]), {"mean", "median", "p95", "max"})

    def test_eval_reads_what_run_wrote(self):
        source, plot = self.sequence("stereo"), self.folder / "plot.svg"
        self.assertEqual(self.run_on(source).returncode, 0)
        done = waymark("eval", self.out / "trajectory.txt", source / "groundtruth.txt",
                       "--align", "se3", "--json", "--plot", plot)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("ate_rmse_m", done.stdout)
        self.assertIn("<svg", plot.read_text())

    def test_log_has_every_message(self):
        log = self.folder / "logs/run.log"
        done = self.run_on(self.sequence("stereo"), "--frames", 3, "--quiet", "--log", log)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        text = log.read_text()
        for words in ("EuRoC", "376x240", "frame 2", "results in"):
            self.assertIn(words, text)
        done = self.run_on(self.folder / "nowhere", "--log", log)
        self.assertEqual(done.returncode, 2)
        self.assertEqual(log.read_text(), done.stderr)

    def test_verbosity(self):
        source = self.sequence("stereo")
        normal = self.run_on(source, "--frames", 3).stderr
        self.assertIn("376x240", normal)
        self.assertNotIn("frame 2: ", normal)
        self.assertIn("frame 2: ", self.run_on(source, "--frames", 3, "--verbose").stderr)

    def test_pace_feeds_no_faster_than_the_input_was_taken(self):
        source = self.sequence("stereo")
        for pace, slowest in ((["--pace"], 4 * 0.05), (["--pace", 0.5], 4 * 0.1)):
            done = self.run_on(source, "--frames", 5, *pace)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertGreaterEqual(self.summary()["wall_s"], slowest)


class Interrupts(CliTest):
    def test_first_one_finishes_early_and_saves(self):
        for which in (signal.SIGINT, signal.SIGTERM):
            # At a tenth of its own rate the sequence takes long enough to be interrupted.
            with subprocess.Popen([PROGRAM, "run", self.sequence("stereo"), "-o", self.out,
                                   "--verbose", "--pace", "0.1"],
                                  stderr=subprocess.PIPE, text=True) as process:
                for line in process.stderr:  # --verbose has a line per frame.
                    if "frame 3" in line:
                        break
                process.send_signal(which)
                process.stderr.read()
                self.assertEqual(process.wait(timeout=120), 0)
            self.assertLess(self.summary()["frames"], NUM_FRAMES)
            self.assertGreater(self.summary()["tracked"], 0)
            self.assertTrue((self.out / "trajectory.txt").exists())
            shutil.rmtree(self.folder / "input_stereo")
            shutil.rmtree(self.out)

    def test_second_one_stops_at_once(self):
        # So many bad images that what is said of them fills the pipe: the program waits for its
        # reader, who never reads, and cannot end in any other way.
        source = self.image_folder()
        times = []
        for i in range(4000):
            image = source / f"{i:06d}.png"
            if i >= NUM_FRAMES:
                image.write_bytes(b"")
            times.append(f"{0.05 * i:.3f}\n")
        (source / "times.txt").write_text("".join(times))
        with subprocess.Popen([PROGRAM, "run", source, "-c", self.folder / "camchain.yaml", "-o",
                               self.out], stderr=subprocess.PIPE) as process:
            self.wait_until(lambda: bytes_in(process.stderr) > 0xE000 and is_asleep(process))
            for which in (signal.SIGINT, signal.SIGTERM):
                self.assertIsNone(process.poll())
                process.send_signal(which)
                self.wait_until(lambda: process.poll() is not None or not has_pending(process))
            self.assertEqual(process.wait(timeout=60), 130)
        self.assertFalse((self.out / "trajectory.txt").exists())


class Demo(CliTest):
    def demo(self, *more):
        return ["demo", "--world", "room", "--frames", "30", "--port", "0", "-o", self.out, *more]

    def test_ends_with_a_map_and_its_accuracy(self):
        done = waymark(*self.demo("--setup", "stereo"))
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("waymark run ", done.stdout)
        self.assertRegex(done.stdout, r"coverage 100\.0 %")
        self.assertRegex(done.stderr, "open http://")
        self.assertEqual(waymark("map", "check", self.out / "map.wmap").returncode, 0)

    def test_shows_the_map_until_interrupted_when_somebody_looks(self):
        terminal, inner = pty.openpty()
        process = subprocess.Popen([PROGRAM, *map(str, self.demo())], stdout=inner, stderr=subprocess.DEVNULL)
        os.close(inner)
        shown = ""
        while "Ctrl-C ends" not in shown:
            shown += os.read(terminal, 4096).decode()
        process.send_signal(signal.SIGINT)
        self.assertEqual(process.wait(timeout=60), 0)
        os.close(terminal)


if __name__ == "__main__":
    unittest.main()

#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""However a run ends, what was computed is in its files, and the exit status says what happened."""
import os
import random
import resource
import shutil
import signal
import subprocess
import unittest

from cli_support import NUM_FRAMES, PROGRAM, CliTest, shared_sequence, waymark

FULL = "/dev/full"
NUM_MOMENTS = 3
RESULTS = ["frames.csv", "keyframes.txt", "points.ply", "summary.json", "trajectory.txt"]
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


def pipe_without_reader():
    reader, writer = os.pipe()
    os.close(reader)
    return os.fdopen(writer, "w")


class Endings(CliTest):
    def setUp(self):
        super().setUp()
        self.map = self.folder / "map.wmap"

    def command(self, *arguments, setup="stereo"):
        return [PROGRAM, "run", shared_sequence(setup), "-o", self.out, "--map-out", self.map,
                *map(str, arguments)]

    def assert_saved(self, num_frames=NUM_FRAMES):
        self.assertEqual(sorted(path.name for path in self.out.iterdir()), RESULTS)
        self.assertEqual(self.summary()["frames"], num_frames)
        self.assertEqual(len(self.frames()), num_frames)
        lines = (self.out / "trajectory.txt").read_text().splitlines()
        self.assertEqual(len(lines), self.summary()["tracked"])
        self.assert_map_is_sound()

    def assert_map_is_sound(self):
        done = waymark("map", "check", self.map)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)


class Streams(Endings):
    def test_nobody_reads_the_messages(self):
        with open(FULL, "w") as full, pipe_without_reader() as unread:
            for stream in (full, unread):
                done = subprocess.run(self.command("--verbose"), stderr=stream, timeout=240)
                self.assertEqual(done.returncode, 0)
                self.assert_saved()

    def test_closed_streams_are_not_taken_for_files(self):
        for closed in ((2,), (0, 1, 2)):
            done = subprocess.run(self.command("--verbose"), timeout=240,
                                  preexec_fn=lambda: [os.close(stream) for stream in closed])
            self.assertEqual(done.returncode, 0)
            self.assert_saved()

    def test_lost_results_on_standard_output_are_a_failure(self):
        def on_standard_output(stream, **options):
            done = subprocess.run([PROGRAM, "config"], stdout=stream, stderr=subprocess.PIPE,
                                  text=True, timeout=60, **options)
            self.assertEqual(done.returncode, 1)
            self.assertRegex(done.stderr, r"\Aerror: standard output: cannot be written: .*\n\Z")

        with open(FULL, "w") as full, pipe_without_reader() as unread:
            on_standard_output(full)
            on_standard_output(unread)
        on_standard_output(None, preexec_fn=lambda: os.close(1))

    def test_a_full_log_is_a_failure_with_results(self):
        done = subprocess.run(self.command("--log", FULL), stderr=subprocess.PIPE, text=True,
                              timeout=240)
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertIn(f"error: {FULL}: messages got lost", done.stderr)
        self.assert_saved()


class Disks(Endings):
    def limited(self, num_bytes, *arguments):
        def limit():
            resource.setrlimit(resource.RLIMIT_FSIZE, (num_bytes, num_bytes))
        return subprocess.run(self.command(*arguments), capture_output=True, text=True,
                              timeout=240, preexec_fn=limit)

    def test_without_room_for_the_map_the_results_are_there(self):
        done = self.limited(100000, "--autosave", 0.1, "--pace", 4)
        self.assert_fails_with_files(done, RESULTS, self.map)
        self.assertFalse(self.map.exists())
        self.assertIn("warning: autosave: ", done.stderr)

    def test_without_room_for_all_results_what_has_room_is_there(self):
        subprocess.run(self.command(), capture_output=True, check=True, timeout=240)
        sizes = sorted((self.out / name).stat().st_size for name in RESULTS)
        done = self.limited(sizes[1] + 200)  # Times of stages vary in length.
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertIn(str(self.out / "frames.csv"), done.stderr)
        self.assertIn(str(self.map), done.stderr)
        self.assert_map_is_sound()  # That of the first run.

    def assert_fails_with_files(self, done, names, *words):
        self.assertEqual(done.returncode, 1, done.stderr)
        error = done.stderr.rstrip("\n").split("\n")[-1]
        self.assertTrue(error.startswith("error: "), done.stderr)
        for word in words:
            self.assertIn(str(word), error)
        self.assertEqual(sorted(path.name for path in self.out.iterdir()), names)

    def test_outputs_are_tried_before_the_first_frame(self):
        (self.out / "summary.json").mkdir(parents=True)
        done = subprocess.run(self.command("--verbose"), capture_output=True, text=True, timeout=240)
        self.assert_fails_with_files(done, ["summary.json"], self.out / "summary.json")
        self.assertNotIn("frame 0", done.stderr)


class Signals(Endings):
    def begin(self, pace="0.1", **options):
        # At a tenth of its own rate the sequence takes long enough to be interrupted.
        return subprocess.Popen(self.command("--verbose", "--pace", pace),
                                stderr=subprocess.PIPE, text=True, **options)

    def read_until(self, process, word):
        for line in process.stderr:
            if word in line:
                return
        self.fail(f"ended before {word}")

    def test_a_lost_terminal_is_as_an_interrupt_however_often_it_says_so(self):
        with self.begin() as process:
            self.read_until(process, "frame 3")
            for _ in range(3):
                process.send_signal(signal.SIGHUP)
            process.stderr.close()  # As the terminal does.
            self.assertEqual(process.wait(timeout=120), 0)
        self.assertGreaterEqual(self.summary()["tracked"], 3)
        self.assert_saved(self.summary()["frames"])

    def test_nohup_is_respected(self):
        def ignore():
            signal.signal(signal.SIGHUP, signal.SIG_IGN)
        with self.begin("2", preexec_fn=ignore) as process:
            self.read_until(process, "frame 3")
            process.send_signal(signal.SIGHUP)
            process.stderr.read()
            self.assertEqual(process.wait(timeout=120), 0)
        self.assert_saved()

    def test_whenever_it_is_interrupted_all_is_saved(self):
        moments = random.Random(5)
        for which in SIGNALS:
            for _ in range(NUM_MOMENTS):
                frame = moments.randrange(1, NUM_FRAMES - 2)
                with self.begin("2") as process:
                    self.read_until(process, f"frame {frame}:")
                    process.send_signal(which)
                    said = process.stderr.read()
                    self.assertEqual(process.wait(timeout=120), 0, said)
                self.assertGreater(self.summary()["frames"], frame)
                self.assert_saved(self.summary()["frames"])


class Memory(Endings):
    def with_memory(self, megabytes, command=None, max_file_bytes=resource.RLIM_INFINITY):
        def limit():
            resource.setrlimit(resource.RLIMIT_AS, (megabytes << 20, megabytes << 20))
            resource.setrlimit(resource.RLIMIT_FSIZE, (max_file_bytes, max_file_bytes))
        return subprocess.run(command or self.command("--verbose"), capture_output=True, text=True,
                              timeout=240, preexec_fn=limit)

    def smallest_to_start_with(self):
        for megabytes in range(100, 4000, 20):
            if self.with_memory(megabytes).returncode == 0:
                return megabytes
        self.skipTest("does not run in any limited memory, as with sanitizers")

    def test_what_there_was_before_memory_ran_out_is_saved(self):
        enough = self.smallest_to_start_with()
        for megabytes in range(enough - 60, enough, 4):
            shutil.rmtree(self.out, ignore_errors=True)
            done = self.with_memory(megabytes)
            if "camera 0: " not in done.stderr:
                continue  # Not even its libraries could be loaded.
            self.assertIn(done.returncode, (0, 1), done.stderr)
            if "frame 1: " in done.stderr:
                self.assertEqual(sorted(path.name for path in self.out.iterdir()), RESULTS)
                self.assertGreaterEqual(self.summary()["frames"], 2)
        self.assert_map_is_sound()

    def test_what_ended_it_is_told_together_with_what_cannot_be_saved(self):
        enough = self.smallest_to_start_with()
        command = [PROGRAM, "run", shared_sequence("stereo"), "-o", self.out, "--verbose"]
        for megabytes in range(enough - 60, enough, 4):
            said = self.with_memory(megabytes, command, max_file_bytes=512).stderr
            if "frame 1: " in said and "out of memory" in said:
                error = said.rstrip("\n").split("\n")[-1]
                self.assertRegex(error, r"\Aerror: .*frames\.csv: cannot be written.*; waymark: out of memory\Z")
                return
        self.fail("memory never ran out between two frames")


if __name__ == "__main__":
    unittest.main()

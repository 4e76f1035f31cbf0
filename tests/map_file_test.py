#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Maps that runs save: while they go on, when they are killed, and as docs/map-format.md says."""
import json
import pathlib
import random
import re
import signal
import subprocess
import time
import unittest

from cli_support import PROGRAM, CliTest, waymark

ROOT = pathlib.Path(__file__).resolve().parent.parent
NUM_KILLS = 20


class MapFile(CliTest):
    def setUp(self):
        super().setUp()
        self.map = self.folder / "map.wmap"

    def saved(self, setup="stereo"):
        done = self.run_on(self.sequence(setup), "--map-out", self.map)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done

    def check(self):
        done = waymark("map", "check", self.map)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertEqual(done.stdout, f"{self.map}: sound\n")

    def test_a_run_saves_its_map(self):
        self.assertIn(f"map in {self.map}", self.saved().stderr)
        self.check()
        info = waymark("map", "info", self.map)
        self.assertEqual(info.returncode, 0, info.stderr)
        summary = self.summary()
        for text in ("written by waymark", "rig 0, camera 1: pinhole, distortion radtan, 376x240",
                     "sub-map 0:", "in metres",
                     f"{summary['keyframes']} keyframes, {summary['landmarks']} landmarks"):
            self.assertIn(text, info.stdout)

    def test_the_same_run_gives_the_same_bytes(self):
        source, again = self.sequence("mono"), self.folder / "again.wmap"
        self.assertEqual(self.run_on(source, "--map-out", self.map).returncode, 0)
        self.assertEqual(self.run_on(source, "--map-out", again).returncode, 0)
        self.assertEqual(self.map.read_bytes(), again.read_bytes())

    def keep_images(self, source, saved, *arguments):
        done = self.run_on(source, "--keep-images", "--map-out", saved, *arguments)
        self.assertEqual(done.returncode, 0, done.stderr)
        info = waymark("map", "info", saved).stdout
        numbers = re.search(r"(\d+) keyframes, .* (\d+) images", info)
        self.assertEqual(numbers[1], numbers[2], info)

    def test_keeps_images_of_keyframes(self):
        """Also those of the session before, when another one goes on in its map."""
        source, again = self.sequence("mono"), self.folder / "again.wmap"
        self.keep_images(source, self.map, "--frames", 30)
        self.keep_images(source, again, "--map-in", self.map, "--first", 20)
        done = waymark("export", again, "--format", "nerfstudio", "-o", self.folder / "scene")
        self.assertEqual(done.returncode, 0, done.stderr)
        for image in (self.folder / "scene" / "images").iterdir():
            self.assertEqual(image.read_bytes()[:2], b"\xff\xd8")

    def test_damaged_maps_are_named(self):
        self.saved("mono")
        whole = self.map.read_bytes()
        self.map.write_bytes(whole[:len(whole) // 2])
        for task in ("info", "check"):
            self.assert_one_error(waymark("map", task, self.map), "map.wmap")
        self.assertIn("is truncated", waymark("map", "check", self.map).stdout)
        self.assert_one_error(waymark("map", "info", self.folder / "none.wmap"), "missing")

    def assert_one_error(self, done, word):
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertEqual(len(done.stderr.strip().split("\n")), 1, done.stderr)
        self.assertIn(word, done.stderr)

    def test_wrong_usage(self):
        source = self.sequence("mono")
        self.assert_fails(self.run_on(source, "--autosave", "3"), 2, "--map-out")
        self.assert_fails(waymark("map"), 2)
        self.assert_fails(self.run_on(source, "--map-out", self.folder / "no" / "a.wmap"), 1,
                          "a.wmap")

    def test_without_a_map_the_file_stays(self):
        self.map.write_text("an older map")
        done = self.run_on(self.sequence("mono"), "--map-out", self.map, "--frames", "2")
        self.assertEqual(done.returncode, 3, done.stderr)
        self.assertIn("no map to save", done.stderr)
        self.assertEqual(self.map.read_text(), "an older map")


class Autosave(CliTest):
    def test_whenever_killed_the_last_map_is_whole(self):
        """At its own pace the sequence takes 2 s, during which a map is saved at most every 20 ms."""
        source, saved, rng = self.sequence("stereo"), self.folder / "map.wmap", random.Random(1)
        stamp = lambda: saved.stat().st_mtime_ns if saved.exists() else 0  # noqa: E731
        num_saved = 0
        for _ in range(NUM_KILLS):
            before = stamp()
            run = subprocess.Popen([PROGRAM, "run", source, "-o", self.out, "--map-out", saved,
                                    "--autosave", "0.02", "--pace", "--quiet"])
            self.wait_until(lambda: stamp() != before or run.poll() is not None)
            time.sleep(rng.uniform(0.0, 1.5))
            run.send_signal(signal.SIGKILL)
            run.wait()
            num_saved += stamp() != before
            done = waymark("map", "check", saved)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertEqual(num_saved, NUM_KILLS)
        # What the killed ones left half-written goes when one comes to its end.
        self.assertEqual(self.run_on(source, "--map-out", saved).returncode, 0)
        self.assertEqual([path.name for path in self.folder.glob(".map.wmap*")], [])

    def test_does_not_change_the_results(self):
        source, saved = self.sequence("mono"), self.folder / "map.wmap"
        self.assertEqual(self.run_on(source).returncode, 0)
        trajectory = (self.out / "trajectory.txt").read_bytes()
        done = self.run_on(source, "--map-out", saved, "--autosave", "0.01")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual((self.out / "trajectory.txt").read_bytes(), trajectory)


class MaxMemory(CliTest):
    def test_does_not_change_the_results(self):
        source, before = self.sequence("stereo"), self.folder / "before.wmap"
        self.assertEqual(self.run_on(source, "--map-out", before, "--frames", 20).returncode, 0)
        for arguments in ((), ("--map-in", before)):
            results = []
            for limit in ((), ("--max-memory", "0")):
                saved = self.folder / f"map{len(limit)}.wmap"
                done = self.run_on(source, "--map-out", saved, *arguments, *limit)
                self.assertEqual(done.returncode, 0, done.stderr)
                results.append(((self.out / "trajectory.txt").read_bytes(), saved.read_bytes()))
            self.assertEqual(results[0], results[1])
        self.assertEqual([path for path in self.out.iterdir() if "memory" in path.name], [])

    def test_wrong_usage(self):
        self.assert_fails(self.run_on(self.sequence("stereo"), "--max-memory", "-1"), 2, "--max-memory")


class Readers(CliTest):
    """The programs of docs/map-format.md are run as they stand there."""

    def program(self, language):
        text = (ROOT / "docs" / "map-format.md").read_text()
        code = re.search(rf"```{language}\n(.*?)```", text, re.DOTALL).group(1)
        path = self.folder / f"reader.{language}"
        path.write_text(code)
        return path

    def run_reader(self, interpreter, language):
        saved = self.folder / "map.wmap"
        self.assertEqual(self.run_on(self.sequence("stereo"), "--map-out", saved).returncode, 0)
        done = subprocess.run([interpreter, self.program(language), saved], capture_output=True,
                              text=True, timeout=60)
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout)

    def judge(self, read):
        """A reader prints the numbers of keyframes and landmarks and where the keyframes are."""
        self.assertEqual(read["keyframes"], self.summary()["keyframes"])
        self.assertEqual(read["landmarks"], self.summary()["landmarks"])
        lines = (self.out / "keyframes.txt").read_text().split("\n")
        expected = [[float(x) for x in line.split()[1:4]] for line in lines if line]
        self.assertEqual(len(read["positions"]), len(expected))
        for position, other in zip(read["positions"], expected):
            for a, b in zip(position, other):
                self.assertAlmostEqual(a, b, places=6)

    def test_python(self):
        self.judge(self.run_reader("/usr/bin/python3", "python"))

    def test_javascript(self):
        self.judge(self.run_reader("node", "javascript"))


if __name__ == "__main__":
    unittest.main()

#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Files that are made to do harm: whatever they hold, the program says in one line what is wrong or does its work, soon and in
little memory.

WAYMARK_HOSTILE is how many are made of them (20), WAYMARK_HOSTILE_SEED the first of their seeds (0): with a program that has
sanitizers, WAYMARK_PROGRAM=build/asan/apps/waymark WAYMARK_HOSTILE=2000 tests/hostile_test.py Made"""
import os
import pathlib
import random
import resource
import shutil
import subprocess
import tempfile
import time
import unittest

import hostile_files as files
from cli_support import PROGRAM, CliTest, shared_sequence, waymark, write_png
from exchange_formats import make_database, pack, small_msg
from inputs_test import ORBSLAM, STELLA

FUZZ = pathlib.Path(__file__).resolve().parent.parent / "fuzz"

NUM_MADE = int(os.environ.get("WAYMARK_HOSTILE", "20"))
FIRST_SEED = int(os.environ.get("WAYMARK_HOSTILE_SEED", "0"))
MAX_BYTES = 1 << 30
MAX_SECONDS = 60  # Of work; of waiting five times as long.
CAMERA = """cam0:
  camera_model: pinhole
  intrinsics: [30, 30, 9.5, 9.5]
  distortion_model: radtan
  distortion_coeffs: [0, 0, 0, 0]
  resolution: [20, 20]
features: {count: 300}
"""


class Hostile(CliTest):
    def bounded(self, *arguments, **options):
        """Runs the program within bounds of time and memory; gives its status and what it said."""
        with tempfile.TemporaryFile() as said:
            child = subprocess.Popen([PROGRAM, *map(str, arguments)], stdin=subprocess.DEVNULL, stdout=said, stderr=said, **options)
            resource.prlimit(child.pid, resource.RLIMIT_CPU, (MAX_SECONDS, MAX_SECONDS))
            end = time.monotonic() + 5 * MAX_SECONDS
            pid = 0
            while not pid:
                pid, status, usage = os.wait4(child.pid, os.WNOHANG)
                if not pid and time.monotonic() > end:
                    child.kill()
                time.sleep(0.002)
            child.returncode = os.waitstatus_to_exitcode(status)
            said.seek(0)
            text = said.read().decode(errors="replace")
        self.assertIn(child.returncode, (0, 1, 2, 3), text[-3000:])
        self.assertNotIn("internal failure", text)
        self.assertLessEqual(text.count("error: "), 1, text)
        if child.returncode in (1, 2):
            self.assertIn("error: ", text)
        self.assertLess(usage.ru_maxrss * 1024, MAX_BYTES, text)
        return child.returncode, text

    def refuses(self, words, *arguments):
        status, text = self.bounded(*arguments)
        self.assertEqual(status, 2, text)
        self.assertIn(words, text)


class Made(Hostile):
    """A share of what a generator makes."""

    def setUp(self):
        super().setUp()
        (self.folder / "camera.yaml").write_text(CAMERA)
        made = self.folder / "made"
        self.map, self.tiled = made / "a.wmap", made / "atlas"
        for command in (("run", shared_sequence("mono"), "-o", made / "out", "--map-out", self.map, "--quiet"),
                        ("map", "tile", self.map, "-o", self.tiled, "--keyframes", 8)):
            done = waymark(*command)
            self.assertEqual(done.returncode, 0, done.stderr)

    def run_bag(self, rng, path):
        if rng.random() < 0.5:
            self.bounded("info", path)
        else:
            camera = () if rng.random() < 0.3 else ("-c", self.folder / "camera.yaml")
            self.bounded("run", path, "-o", self.out, *camera, "--quiet", *rng.choice(((), ("--keep-images", "--map-out", self.folder / "o.wmap"))))

    def bag(self, rng):
        size = (rng.choice((1, 8, 15, 16, 20, 20, 300)), rng.choice((1, 15, 16, 20, 20)))
        topics = rng.choice((1, 1, 2, 50))
        name, data = rng.choice((
            ("a.mcap", lambda: files.mcap(size, num_topics=topics)),
            ("a.bag", lambda: files.ros1_bag(size, compression=rng.choice((b"bz2", b"none")), num_topics=topics))))
        (self.folder / name).write_bytes(files.change_bytes(rng, data()) if rng.random() < 0.8 else data())
        self.run_bag(rng, self.folder / name)

    def sqlite(self, rng):
        path = self.folder / "a.db3"
        files.sqlite_bag(path, num_topics=rng.choice((1, 2)))
        files.change_base(rng, path)
        self.run_bag(rng, path)

    def stella(self, rng):
        path = self.folder / rng.choice(("a.db", "a.db", "a.msg"))
        if path.suffix == ".db":
            make_database(path, small_msg(4))
            files.change_base(rng, path)
        else:
            path.write_bytes(files.change_bytes(rng, pack(small_msg(4))))
        self.bounded("import", path, "-o", self.folder / "o.wmap")

    def atlas(self, rng):
        atlas = self.folder / "atlas"
        shutil.copytree(self.tiled, atlas)
        if rng.random() < 0.7:
            files.change_base(rng, atlas / "atlas.db")
        for path in sorted((atlas / "tiles").iterdir()):
            if rng.random() < 0.2:
                path.write_bytes(files.change_bytes(rng, path.read_bytes()))
        self.bounded(*rng.choice((("atlas", "check", atlas), ("atlas", "export", atlas, "-o", self.folder / "o.wmap"),
                                  ("atlas", "info", atlas), ("atlas", "optimize", atlas), ("atlas", "add", atlas, self.map),
                                  ("localize", atlas, shared_sequence("mono"), "-o", self.out, "--frames", "3", "--quiet"))))

    def fleet(self, rng):
        recordings, work = [self.folder / name for name in ("a.wmap", "a.bag", "b.wmap")], self.folder / "work"
        recordings[0].write_bytes(files.change_bytes(rng, self.map.read_bytes()))
        recordings[1].write_bytes(files.change_bytes(rng, files.ros1_bag((300, 200))))
        shutil.copy(self.map, recordings[2])
        command = ("fleet", *rng.sample(recordings, rng.choice((1, 2))), "-o", self.folder / "atlas", "--work", work, "--workers", "1",
                   "-c", self.folder / "camera.yaml")
        self.bounded(*command)
        for path in sorted(path for folder in (work, self.folder / "atlas") for path in folder.rglob("*") if path.is_file()):
            if rng.random() < 0.3:
                path.write_bytes(files.change_bytes(rng, path.read_bytes()))
        self.bounded(*command)

    def map_file(self, rng):
        path = self.folder / "a.wmap"
        path.write_bytes(files.change_bytes(rng, self.map.read_bytes()))
        self.bounded(*rng.choice((("map", "check", path), ("map", "info", path), ("export", path, "-o", self.folder / "o.ply"),
                                  ("atlas", "add", self.folder / "atlas", path), ("map", "tile", path, "-o", self.folder / "atlas"))))

    def image(self, rng):
        source = self.folder / "images"
        source.mkdir()
        data, ending = files.image_file(rng)
        for i in range(rng.choice((1, 3, 20))):
            (source / f"{i:03d}{ending}").write_bytes(data if rng.random() < 0.8 else files.image_file(rng)[0])
        self.bounded(*rng.choice((
            ("info", source), ("calibrate", source, "-o", self.folder / "c.yaml"), ("run", source, "-o", self.out, "--quiet"),
            ("run", source, "-o", self.out, "--keep-images", "--map-out", self.folder / "o.wmap", "--quiet"),
            ("run", source, "-o", self.out, "-c", self.folder / "camera.yaml", "--quiet"),
            ("run", source, "-o", self.out, "--rotate", "90", "--quiet"), ("run", source, "-o", self.out, "--resize", "16", "--quiet"))))

    def calibration(self, rng):
        seeds = [path.read_text(errors="replace") for path in sorted((FUZZ / "seeds/text").rglob("*")) if path.is_file()]
        path = self.folder / f"a{rng.choice(('', '.yaml', '.json', '.txt', '.xml'))}"
        path.write_text(files.change_text(rng, rng.choice((*seeds, ORBSLAM, STELLA))), errors="surrogateescape")
        self.bounded(*rng.choice((("config", path), ("config", path), ("config", "--from", "colmap", path), ("config", "--from", "ros", path),
                                  ("import", "--settings", path),
                                  ("run", shared_sequence("mono"), "-c", path, "-o", self.out, "--frames", "2", "--quiet"))))

    def test_does_no_harm(self):
        kinds = (self.bag, self.bag, self.sqlite, self.sqlite, self.stella, self.atlas, self.map_file, self.image, self.image, self.calibration,
                 self.fleet)
        failed = []
        for seed in range(FIRST_SEED, FIRST_SEED + NUM_MADE):
            rng = random.Random(seed)
            kind = kinds[seed % len(kinds)]
            begin = time.monotonic()
            try:
                kind(rng)
            except AssertionError as error:
                failed.append(f"seed {seed} ({kind.__name__}): {error}")
            if NUM_MADE > 100:
                print(f"seed {seed} {kind.__name__} {time.monotonic() - begin:.2f} s", failed[-1:], flush=True)
            for path in self.folder.iterdir():
                if path.name not in ("camera.yaml", "made"):
                    shutil.rmtree(path, ignore_errors=True) if path.is_dir() else path.unlink()
        self.assertEqual(failed, [])


class Known(Hostile):
    def test_images_that_no_camera_takes(self):
        for width, height in ((8, 40), (40, 15), (1, 1), (16, 12)):
            source = self.folder / f"{width}x{height}"
            source.mkdir()
            for i in range(3):
                write_png(source / f"{i}.png", width, height, i)
            for command in ("run", "calibrate"):
                self.refuses("expected width and height from 16 to 20000", command, source, "-o", self.out)
        (self.folder / "a.bag").write_bytes(files.ros1_bag((8, 40)))
        self.refuses("expected width and height from 16 to 20000", "run", self.folder / "a.bag", "-o", self.out)

    def test_images_that_no_jpeg_holds(self):
        source = self.folder / "wide"
        source.mkdir()
        write_png(source / "0.png", 76800, 1)
        self.refuses("expected at most 135 megapixels and 65500 px a side", "run", source, "-o", self.out, "--keep-images",
                     "--map-out", self.folder / "o.wmap")

    def test_bags_that_grow(self):
        (self.folder / "bombs.bag").write_bytes(files.ros1_bag(bomb=100 << 20))
        status, text = self.bounded("info", self.folder / "bombs.bag")
        self.assertEqual(status, 0, text)
        self.assertIn("8 damaged chunks are left out", text)
        files.sqlite_bag(self.folder / "topics.db3", num_topics=100_000)
        (self.folder / "topics.bag").write_bytes(files.ros1_bag(num_topics=100_000))
        for name in ("topics.db3", "topics.bag"):
            self.bounded("info", self.folder / name)

    def test_pipes_that_nobody_writes_to(self):
        image = shared_sequence("mono")
        for name, commands in (
                ("a.mkv", (("info",), ("run", image), ("run", image, "--mask"))), ("a.mcap", (("info",),)), ("a.bag", (("info",),)),
                ("a.db3", (("info",),)), ("a", (("info",), ("run", image, "-c"), ("markers",))),
                ("a.wmap", (("map", "info"), ("run", image, "--map-in"), ("export",), ("view",))), ("a.db", (("import", "-o", self.out),)),
                ("a.yaml", (("config",), ("config", "--from", "opencv"), ("run", image, "-c"), ("simulate", "room", "--setup", "mono",
                                                                                            "-o", self.out, "--camera"))),
                ("a.txt", (("config", "--from", "colmap"), ("eval", image / "groundtruth.txt")))):
            path = self.folder / name
            os.mkfifo(path)
            for command in commands:
                status, text = self.bounded(*command, path, cwd=self.folder)
                self.assertEqual(status, 2, (command, text))
        for name, command in (("metadata.yaml", ("info",)), ("atlas.db", ("atlas", "info"))):
            os.mkfifo(self.folder / name)
            self.assertEqual(self.bounded(*command, self.folder)[0], 2)

    def test_settings_that_are_given_too_often(self):
        settings = self.config(CAMERA)
        self.refuses("expected at most 100", "run", shared_sequence("mono"), "-o", self.out, *("-c", settings) * 10_000)


if __name__ == "__main__":
    unittest.main()

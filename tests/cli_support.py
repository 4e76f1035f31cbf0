# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""What the tests of the command line share: running the program, and small sequences to feed it."""
import atexit
import csv
import functools
import json
import os
import pathlib
import shutil
import struct
import subprocess
import tempfile
import time
import unittest
import zlib

PROGRAM = os.environ.get("WAYMARK_PROGRAM", "waymark")
NUM_FRAMES = 40
CAMERA = """cam0:
  camera_model: pinhole
  intrinsics: [290, 291, 187, 121]
  distortion_model: radtan
  distortion_coeffs: [-0.2, 0.05, 0.0002, -0.0001]
  resolution: [376, 240]
cam1:
  camera_model: pinhole
  intrinsics: [290, 291, 187, 121]
  distortion_model: radtan
  distortion_coeffs: [-0.2, 0.05, 0.0002, -0.0001]
  resolution: [376, 240]
  T_cn_cnm1: [[1, 0, 0, -0.2], [0, 1, 0, 0.003], [0, 0, 1, 0], [0, 0, 0, 1]]
"""


def waymark(*arguments, **options):
    """Runs the program to its end."""
    return subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True,
                          timeout=240, **options)


def write_png(path, width, height, grey=128):
    """A uniform grey image."""
    def chunk(kind, data):
        return (struct.pack(">I", len(data)) + kind + data +
                struct.pack(">I", zlib.crc32(kind + data)))
    rows = (b"\0" + bytes([grey]) * width) * height
    header = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) +
                     chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


def png_size(path):
    return struct.unpack(">II", path.read_bytes()[16:24])


def truncate(path):
    path.write_bytes(path.read_bytes()[:path.stat().st_size // 2])


@functools.cache
def shared_folder():
    """For what programs of tests share during one run of ctest, or for this program alone."""
    shared = os.environ.get("WAYMARK_SHARED")
    if not shared:
        shared = tempfile.mkdtemp(prefix="waymark_sequences_")
        atexit.register(shutil.rmtree, shared)
    folder = pathlib.Path(shared)
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def made_once(name, *arguments, files=()):
    """What `waymark simulate` makes, once for all programs of tests; not to be changed. files: names and texts beside it."""
    made = shared_folder() / name
    if not made.exists():
        own = pathlib.Path(tempfile.mkdtemp(dir=shared_folder()))
        for file, text in files:
            (own / file).write_text(text)
        done = waymark("simulate", *arguments, "-o", own / name, cwd=own)
        assert done.returncode == 0, done.stderr
        try:
            os.rename(own / name, made)
        except OSError:  # Another program has just made it, too.
            if not made.exists():
                raise
        shutil.rmtree(own)
    return made


def shared_sequence(setup):
    """A short simulated sequence."""
    return made_once(setup, "room", "--motion", "slide", "--camera", "camera.yaml", "--setup", setup,
                     "--frames", NUM_FRAMES, files=(("camera.yaml", CAMERA),))


def users_case(name):
    """A folder with a small input as users have it, not to be changed; skips the test where it is not there."""
    if "WAYMARK_CASES" not in os.environ:
        raise unittest.SkipTest("needs WAYMARK_CASES, the folder of small inputs of users")
    folder = pathlib.Path(os.environ["WAYMARK_CASES"]) / name
    if not folder.is_dir():
        raise unittest.SkipTest(f"WAYMARK_CASES lacks {name}")
    return folder


class CliTest(unittest.TestCase):
    """A folder per test, and simulated sequences made once for all programs of tests."""

    def setUp(self):
        self._folder = tempfile.TemporaryDirectory(prefix="waymark_test_")
        self.folder = pathlib.Path(self._folder.name)
        self.out = self.folder / "out"

    def tearDown(self):
        self._folder.cleanup()

    def sequence(self, setup):
        """A copy, free to be damaged, of a simulated sequence."""
        copy = self.folder / f"input_{setup}"
        shutil.copytree(shared_sequence(setup), copy)
        return copy

    def images(self, folder):
        """Images of camera 0 in order, whatever the layout."""
        for below in ("mav0/cam0/data", "image_0", "rgb", "images"):
            if (folder / below).is_dir():
                return sorted((folder / below).glob("*.png"))
        self.fail(f"no images in {folder}")

    def image_folder(self):
        """The mono sequence as a plain folder of images with times.txt and camchain.yaml."""
        source, target = self.sequence("mono"), self.folder / "plain"
        target.mkdir()
        for i, image in enumerate(self.images(source)):
            shutil.copy(image, target / f"{i:06d}.png")
        (target / "times.txt").write_text("".join(f"{0.05 * i:.3f}\n" for i in range(NUM_FRAMES)))
        shutil.copy(source / "camchain.yaml", self.folder / "camchain.yaml")
        return target

    def config(self, text, name="settings.yaml"):
        path = self.folder / name
        path.write_text(text)
        return path

    def run_on(self, source, *arguments, **options):
        return waymark("run", source, "-o", self.out, *arguments, **options)

    def wait_until(self, is_true, timeout_s=120):
        end = time.monotonic() + timeout_s
        while not is_true():
            self.assertLess(time.monotonic(), end, "waited in vain")
            time.sleep(0.01)

    def summary(self):
        return json.loads((self.out / "summary.json").read_text())

    def frames(self):
        with open(self.out / "frames.csv", newline="") as file:
            return list(csv.DictReader(file))

    def assert_fails(self, done, status, *words):
        """One line on standard error, with these words, and nothing under a final name."""
        self.assertEqual(done.returncode, status, done.stderr)
        errors = [line for line in done.stderr.split("\n") if line.startswith("error: ")]
        self.assertEqual(len(errors), 1, done.stderr)
        self.assertTrue(done.stderr.rstrip("\n").endswith(errors[0]), done.stderr)
        for word in words:
            self.assertIn(str(word), errors[0])
        left = [p.name for p in self.out.rglob("*") if p.is_file()] if self.out.exists() else []
        self.assertEqual(left, [])

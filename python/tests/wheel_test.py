#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""A wheel of the module, made by pip of the folder that is built, installed in an environment of its own."""
import os
import pathlib
import subprocess
import sys
import unittest
import zipfile

from support import Test

ROOT = pathlib.Path(__file__).resolve().parents[2]


class Wheel(Test):
    def run_python(self, python, *arguments):
        environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
        done = subprocess.run([python, *map(str, arguments)], stdout=subprocess.PIPE, text=True,
                              stderr=subprocess.STDOUT, timeout=250, cwd=self.folder, env=environment)
        self.assertEqual(done.returncode, 0, done.stdout)
        return done.stdout

    def test_made_and_installed(self):
        self.run_python(sys.executable, "-m", "pip", "wheel", ROOT, "--no-deps", "--no-index", "-w", self.folder,
                        "--config-settings", f"build-folder={os.environ['WAYMARK_BUILD']}")
        wheels = list(self.folder.glob("waymark-*.whl"))
        self.assertEqual(len(wheels), 1)
        with zipfile.ZipFile(wheels[0]) as wheel:
            name, = (name for name in wheel.namelist() if name.endswith(".dist-info/copyright"))
            notices = wheel.read(name).decode()
            self.assertEqual(wheel.read(name.replace("copyright", "LICENSE")), (ROOT / "LICENSE").read_bytes())
        for holder in ("2009 Willow Garage", "(OpenCV,", "(Highway,", "(fmt,", "(yaml-cpp,", "(nlohmann-json,",
                       "(CLI11,", "(pybind11,", "(Boost,", "(Eigen,", "three.js authors"):
            self.assertIn(holder, notices)
        self.run_python(sys.executable, "-m", "venv", "--system-site-packages", "--without-pip",
                        self.folder / "venv")
        python = self.folder / "venv/bin/python"
        pip = (sys.executable, "-m", "pip", "--python", python)
        self.run_python(*pip, "install", "--no-index", wheels[0])
        said = self.run_python(python, "-c", "import waymark; print(waymark.__file__, waymark.__version__, "
                               "waymark.System.feed.__doc__.split('.')[0])")
        self.assertIn(str(self.folder / "venv"), said)
        self.assertIn("Tracks one frame", said)
        self.assertIn("waymark", self.run_python(self.folder / "venv/bin/waymark", "--version"))
        self.assertIn("Name: waymark", self.run_python(*pip, "show", "waymark"))
        self.run_python(*pip, "uninstall", "-y", "waymark")
        left = [path for path in self.folder.rglob("*waymark*") if (self.folder / "venv") in path.parents]
        self.assertEqual(left, [])


if __name__ == "__main__":
    unittest.main()

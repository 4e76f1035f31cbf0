#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""cmake --install, and projects of users that are built against what it installs and run.

WAYMARK_BUILD is the folder of the build, WAYMARK_LAUNCHER the compiler cache or empty.
"""
import os
import pathlib
import platform
import re
import shutil
import subprocess
import sys
import unittest

from cli_support import CAMERA, write_png

BUILD = pathlib.Path(os.environ["WAYMARK_BUILD"])
ROOT = pathlib.Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "script"))
from documentation.pages import Page  # noqa: E402

WORK = BUILD / "install_test"  # Always the same, for the compiler cache.
PREFIX = WORK / "prefix"


def run(*command, **options):
    return subprocess.run([str(part) for part in command], stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, text=True, timeout=900, **options)


class Install(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        shutil.rmtree(WORK, ignore_errors=True)
        done = run("cmake", "--install", BUILD, "--prefix", WORK / "first")
        if done.returncode:
            raise RuntimeError(done.stdout)
        (WORK / "first").rename(PREFIX)  # It works wherever it is moved.

    def succeed(self, *command, **options):
        done = run(*command, **options)
        self.assertEqual(done.returncode, 0, done.stdout)
        return done.stdout

    def configure(self, source, folder, **options):
        return run("cmake", "-G", "Ninja", "-S", source, "-B", folder, f"-DCMAKE_PREFIX_PATH={PREFIX}",
                   f"-DCMAKE_CXX_COMPILER={os.environ['CXX']}",
                   f"-DCMAKE_CXX_COMPILER_LAUNCHER={os.environ['WAYMARK_LAUNCHER']}", **options)

    def build(self, source, name):
        done = self.configure(source, WORK / name)
        self.assertEqual(done.returncode, 0, done.stdout)
        self.succeed("cmake", "--build", WORK / name)
        return WORK / name

    def project(self, name, text):
        folder = WORK / name
        folder.mkdir()
        (folder / "CMakeLists.txt").write_text(
            f"cmake_minimum_required(VERSION 3.25)\nproject({name} LANGUAGES CXX)\n{text}\n")
        return folder

    def test_examples(self):
        folder = self.build(ROOT / "examples", "examples")
        self.succeed(sys.executable, "-B", "examples_test.py", cwd=ROOT / "tests",
                     env={**os.environ, "WAYMARK_EXAMPLES": str(folder),
                          "WAYMARK_PROGRAM": str(PREFIX / "bin" / "waymark")})

    def test_a_camera_of_ones_own(self):
        folder = self.build(ROOT / "examples" / "custom_camera", "custom_camera")
        self.succeed("ctest", "--test-dir", folder, "--output-on-failure")

    def test_every_header_is_complete(self):
        headers = sorted(str(p.relative_to(PREFIX / "include")) for p in (PREFIX / "include").rglob("*.h"))
        self.assertIn("waymark/system/system.h", headers)
        source = self.project("headers", "find_package(waymark REQUIRED)\nadd_library(headers STATIC all.cc)\n"
                                         "target_link_libraries(headers PRIVATE waymark::waymark)")
        (source / "all.cc").write_text("".join(f'#include "{header}"\n' for header in headers))
        self.build(source, "headers_build")

    def test_a_module_that_does_not_exist(self):
        source = self.project("typing_error", "find_package(waymark REQUIRED COMPONENTS system sistem)")
        done = self.configure(source, WORK / "typing_error_build")
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("waymark has no module 'sistem'", done.stdout)

    def test_another_version(self):
        source = self.project("newer", "find_package(waymark 99 REQUIRED)")
        done = self.configure(source, WORK / "newer_build")
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("99", done.stdout)

    @unittest.skipUnless(platform.machine() == "x86_64", "AVX is of x86-64")
    def test_another_instruction_set(self):
        source = self.project("wider", "find_package(waymark REQUIRED)\nadd_library(wider STATIC wider.cc)\n"
                                       "target_compile_options(wider PRIVATE -mavx)\n"
                                       "target_link_libraries(wider PRIVATE waymark::system)")
        (source / "wider.cc").write_text('#include "waymark/system/system.h"\n')
        self.assertEqual(self.configure(source, WORK / "wider_build").returncode, 0)
        done = run("cmake", "--build", WORK / "wider_build")
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("Eigen's alignment depends on the instruction set", done.stdout)

    def test_python_finds_its_module(self):
        """Below /usr, /usr/local and in an environment, without PYTHONPATH."""
        if not list(BUILD.glob("python/waymark/_waymark*.so")):
            self.skipTest("the Python module is not built")
        root, python, environment = WORK / "root", "/usr/bin/python3", WORK / "environment"
        self.succeed(python, "-m", "venv", "--without-pip", environment)
        cases = [(python, "/usr", root), (python, "/usr/local", root), (environment / "bin/python", environment, "")]
        for interpreter, prefix, below in cases:
            self.succeed("cmake", "--install", BUILD, "--prefix", prefix, "--component", "python",
                         env={**os.environ, "DESTDIR": str(below)})
            looked = self.succeed(interpreter, "-I", "-c", "import sys; print(*sys.path, sep='\\n')").split("\n")
            found = [folder for folder in looked if folder and pathlib.Path(f"{below}{folder}/waymark/__init__.py").exists()]
            self.assertTrue(found and found[0].startswith(f"{prefix}/lib"), (prefix, looked))
            shutil.rmtree(f"{below}{found[0]}/waymark")
        said = self.succeed("cmake", "--install", BUILD, "--prefix", WORK / "elsewhere", "--component", "python")
        folder, = (word.removeprefix("PYTHONPATH=") for word in said.split() if word.startswith("PYTHONPATH="))
        self.assertTrue((pathlib.Path(folder) / "waymark/__init__.py").exists())

    def test_messages_name_pages_that_are_there(self):
        blank = WORK / "blank"
        blank.mkdir()
        for i in range(10):
            write_png(blank / f"{i}.png", 376, 240)
        (WORK / "camera.yaml").write_text(CAMERA.split("cam1")[0])
        done = run(PREFIX / "bin/waymark", "run", blank, "-c", WORK / "camera.yaml", "-o", WORK / "blank-out")
        page, _, anchor = re.search(r"\((\S+\.md)#?(\S*)\)", done.stdout).group(0)[1:-1].partition("#")
        self.assertTrue(pathlib.Path(page).is_file(), page)
        self.assertTrue(page.startswith(str(PREFIX)), page)
        self.assertIn(anchor, Page(pathlib.Path(page)).anchors())

    def test_nothing_knows_where_it_was_built(self):
        places = [str(place).encode() for place in (ROOT, BUILD, WORK)]
        files = [path for path in PREFIX.rglob("*") if path.is_file() and path.suffix != ".md"]
        self.assertGreater(len(files), 50)
        self.assertEqual([path for path in files if any(place in path.read_bytes() for place in places)], [])


if __name__ == "__main__":
    unittest.main()

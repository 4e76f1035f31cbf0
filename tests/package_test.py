#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""The Debian packages of script/package: installed in an empty root, used from there, removed.

usage: package_test.py, after script/package
"""
import os
import pathlib
import re
import shutil
import subprocess
import unittest

from cli_support import CAMERA, write_png

ROOT = pathlib.Path(__file__).resolve().parent.parent
PACKAGES = ROOT / "build" / "package"
CLEAN = PACKAGES / "root"  # Always the same, for the compiler cache.
KEPT_BY_DPKG = re.compile(r"(var|var/log|var/lib|var/lib/dpkg)$|var/lib/dpkg/|var/log/dpkg.log$")


def run(*command, **options):
    options = {"stderr": subprocess.STDOUT, **options}
    done = subprocess.run([str(part) for part in command], stdout=subprocess.PIPE, text=True,
                          timeout=300, **options)
    if done.returncode:
        raise AssertionError(f"{' '.join(map(str, command))}: {done.stdout}")
    return done.stdout


def dpkg(*arguments):
    """Into the clean root, without its dependencies, which the machine has."""
    as_root = [] if os.geteuid() == 0 else ["fakeroot"]
    return run(*as_root, "dpkg", f"--root={CLEAN}", "--force-depends", "--force-not-root", *arguments)


def field(package, name):
    return run("dpkg-deb", "--field", package, name).strip()


def left_behind():
    paths = (str(path.relative_to(CLEAN)) for path in CLEAN.rglob("*"))
    return sorted(path for path in paths if not KEPT_BY_DPKG.match(path))


class Package(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.packages = {field(path, "Package"): path for path in PACKAGES.glob("*.deb")}
        if not cls.packages:
            raise unittest.SkipTest("script/package has not been run")
        shutil.rmtree(CLEAN, ignore_errors=True)
        for folder in ("updates", "info", "triggers"):
            (CLEAN / "var/lib/dpkg" / folder).mkdir(parents=True)
        (CLEAN / "var/log").mkdir(parents=True)
        (CLEAN / "var/lib/dpkg/status").touch()
        dpkg("--install", *cls.packages.values())

    @classmethod
    def tearDownClass(cls):
        dpkg("--purge", *cls.packages)
        left = left_behind()
        if left:
            raise AssertionError(f"left behind by the removal: {left}")
        shutil.rmtree(CLEAN)

    def setUp(self):
        self.program = CLEAN / "usr/bin/waymark"
        self.work = PACKAGES / "work"
        shutil.rmtree(self.work, ignore_errors=True)
        self.work.mkdir()
        self.addCleanup(shutil.rmtree, self.work)

    def test_python_module(self):
        if "python3-waymark" not in self.packages:
            raise unittest.SkipTest("the Python module is not built")
        said = run("/usr/bin/python3", "-c", "import waymark; print(waymark.__file__, waymark.__version__)",
                   env={**os.environ, "PYTHONPATH": str(CLEAN / "usr/lib/python3/dist-packages"),
                        "PYTHONDONTWRITEBYTECODE": "1"})
        self.assertIn(str(CLEAN), said)
        self.assertIn(field(self.packages["python3-waymark"], "Version").split("-")[0], said)

    def test_demo(self):
        out = self.work / "demo"
        run(self.program, "demo", "--frames", 100, "--once", "--port", "127.0.0.1:0", "-o", out)
        self.assertGreater(len((out / "trajectory.txt").read_text().split("\n")), 80)
        run(self.program, "map", "check", out / "map.wmap")

    def test_another_project(self):
        run("cmake", "-G", "Ninja", "-S", ROOT / "examples", "-B", self.work / "examples", f"-DCMAKE_PREFIX_PATH={CLEAN}/usr",
            f"-DCMAKE_CXX_COMPILER_LAUNCHER={shutil.which('ccache') or ''}")
        run("cmake", "--build", self.work / "examples", "--target", "waymark_example_map_images")
        camera = self.work / "camera.yaml"
        camera.write_text(CAMERA)
        run(self.program, "simulate", "room", "--motion", "slide", "--camera", camera, "--frames", 40,
            "-o", self.work / "room")
        poses = run(self.work / "examples/waymark_example_map_images", self.work / "room/mav0/cam0/data",
                    self.work / "room/camchain.yaml", stderr=subprocess.DEVNULL)
        self.assertGreater(poses.count("\n"), 20)

    def test_what_the_packages_say(self):
        self.assertLessEqual({"waymark", "libwaymark-dev"}, set(self.packages))
        for name, path in self.packages.items():
            self.assertIn("The Waymark authors", field(path, "Maintainer"))
            self.assertGreater(len(field(path, "Description").split("\n")), 2)
            for document in ("copyright", "changelog.gz", "changelog.Debian.gz"):
                self.assertTrue((CLEAN / "usr/share/doc" / name / document).is_file())
        self.assertIn("libopencv-core", field(self.packages["waymark"], "Depends"))
        self.assertNotIn("-dev", field(self.packages["waymark"], "Depends"))
        self.assertEqual(dpkg("--verify"), "")

    def test_documentation(self):
        docs = CLEAN / "usr/share/doc/waymark"
        self.assertTrue((docs / "examples/live_view.cc").is_file())
        blank = self.work / "blank"
        blank.mkdir()
        for i in range(10):
            write_png(blank / f"{i}.png", 376, 240)
        (self.work / "camera.yaml").write_text(CAMERA.split("cam1")[0])
        done = subprocess.run([self.program, "run", blank, "-c", self.work / "camera.yaml", "-o", self.work / "out"],
                              capture_output=True, text=True, timeout=60)
        self.assertIn(f"({docs}/docs/troubleshooting.md#", done.stderr)
        self.assertTrue((docs / "docs/troubleshooting.md").is_file())

    def test_nothing_of_ceres(self):
        """Debian's Ceres brings parts of SuiteSparse that are under the GPL (docs/licenses.md)."""
        self.assertIn("libopencv_core", run("ldd", self.program))
        self.assertNotRegex(run("ldd", self.program), "(?i)ceres|suitesparse|cholmod|glog|gflags")
        self.assertNotIn("libceres", field(self.packages["libwaymark-dev"], "Depends"))

    def test_every_command_is_in_manual_and_completion(self):
        listed = run(self.program, "--help").split("Subcommands:\n")[1].split("\n\n")[0]
        commands = [line.split()[0] for line in listed.split("\n")]
        self.assertIn("demo", commands)
        manual = run("gzip", "-dc", CLEAN / "usr/share/man/man1/waymark.1.gz")
        self.assertEqual(re.findall(r"\n\.TP\n\.B (\w+)", manual), commands)
        completion = CLEAN / "usr/share/bash-completion/completions/waymark"
        complete = 'source "$1"; COMP_WORDS=("$2" "${@:3}"); COMP_CWORD=$(($# - 2)); _waymark; echo "${COMPREPLY[@]}"'
        self.assertEqual(run("bash", "-c", complete, "-", completion, self.program, "").split(), commands)
        self.assertIn("--frames", run("bash", "-c", complete, "-", completion, self.program, "demo", "--f").split())

    def test_lintian(self):
        if not shutil.which("lintian"):
            self.skipTest("lintian is not installed")
        run("lintian", "--fail-on", "error", *self.packages.values())


if __name__ == "__main__":
    unittest.main()

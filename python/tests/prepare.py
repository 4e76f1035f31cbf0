#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Installs the module and simulates what its tests need.

usage: prepare.py BUILD_FOLDER OUT

OUT/installed   the module, installed from the build
OUT/stereo      a simulated stereo pair; OUT/stereo_out what the program made of it, with map.wmap
OUT/rgbd        a simulated camera with depth; OUT/rgbd_out
OUT/mono_out    what the program made of camera 0 of the stereo pair
OUT/turned      a pair whose calibration leaves out that camera 1 is turned by 2 mrad
"""
import pathlib
import shutil
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "tests"))
from cli_support import CAMERA  # noqa: E402

NUM_FRAMES = 40


def run(*command):
    subprocess.run([str(part) for part in command], check=True, stdout=subprocess.DEVNULL)


def main():
    build, out = map(pathlib.Path, sys.argv[1:])
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    run("cmake", "--install", build, "--prefix", out / "installed", "--component", "python")
    program = build / "waymark"
    (out / "camera.yaml").write_text(CAMERA)
    for setup in ("stereo", "rgbd"):
        run(program, "simulate", "room", "--motion", "slide", "--camera", out / "camera.yaml",
            "--setup", setup, "--frames", NUM_FRAMES, "-o", out / setup)
    run(program, "simulate", "room", "--motion", "loop", "--camera", out / "camera.yaml", "--setup", "stereo",
        "--frames", 60, "--told", "turn_y=2", "-o", out / "turned")
    for setup, source in (("stereo", "stereo"), ("mono", "stereo"), ("rgbd", "rgbd")):
        run(program, "run", out / source, "-c", out / source / "camchain.yaml", "--setup", setup,
            "-o", out / f"{setup}_out", "--map-out", out / f"{setup}_out/map.wmap",
            "--keep-images", "--quiet")


if __name__ == "__main__":
    main()

# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Reports of a good, a middling and a bad run of a small simulated sequence, and of all three compared: for
the test in the browser and the pictures of docs/report.md."""
import pathlib
import shutil
import subprocess
import sys

import cv2

from evaluation.degrade import blur, dark

NUM_FRAMES = 200
SEVERE = 3


def spoil(sequence):
    """Images of camera 0 blurred and dark from the third on: of four quarters the last three."""
    images = sorted((sequence / "mav0" / "cam0" / "data").glob("*.png"))
    for frame, path in enumerate(images[len(images) // 4:]):
        image = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
        cv2.imwrite(str(path), dark(blur(image, frame, 0, SEVERE), frame, 0, SEVERE))


def make_runs(program, folder):
    """Folders of results by name: good, check, bad. The sequences stay beside them."""
    def waymark(*arguments):
        subprocess.run([str(program), *map(str, arguments)], check=True, capture_output=True, timeout=600)

    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    shared = ("simulate", "room", "--setup", "mono", "--motion", "inspect", "--frames", NUM_FRAMES, "--quiet", "-o")
    waymark(*shared, folder / "sequence")
    waymark(*shared, folder / "told_wrong", "--told", "focal=1.08")
    shutil.copytree(folder / "sequence", folder / "spoilt")
    spoil(folder / "spoilt")
    wrong = folder / "told_wrong" / "camchain.yaml"
    for name, sequence, options in (("good", "sequence", ()),
                                    ("check", "told_wrong", ("-c", wrong, "--set", "calibration.refine=off")),
                                    ("bad", "spoilt", ())):
        waymark("run", folder / sequence, "--report", "--quiet", "-o", folder / name, *options)
    return [folder / name for name in ("good", "check", "bad")]


def make_pages(program, folder):
    """The pages good.html, check.html, bad.html, with the ground truth, and comparison.html."""
    runs = make_runs(program, folder)
    truth = folder / "sequence" / "groundtruth.txt"
    for run in runs:
        subprocess.run([str(program), "report", str(run), "--ground-truth", str(truth), "-o", str(folder / f"{run.name}.html")],
                       check=True, capture_output=True, timeout=60)
    subprocess.run([str(program), "report", *map(str, runs), "--ground-truth", str(truth), "-o", str(folder / "comparison.html")],
                   check=True, capture_output=True, timeout=60)


if __name__ == "__main__":
    make_pages(pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]))

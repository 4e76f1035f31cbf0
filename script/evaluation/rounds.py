# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Thirty times the same round through the hall: memory must follow the ground, not the way. A test does
that with points (system/rounds_test.cc); here it is the whole program, which keeps its frames, too."""
from .program import map_sequence
from .simulated import simulate
from .tables import table

NUM_ROUNDS = 30
SETTLED_ROUNDS = 3
FRAMES_PER_ROUND = 1000
CAMERA = """cam{}:
  camera_model: pinhole
  intrinsics: [210, 210, 159.5, 119.5]
  distortion_model: none
  resolution: [320, 240]
"""
BESIDE = "  T_cn_cnm1: [[1, 0, 0, -0.2], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n"
CAMCHAINS = {"mono": CAMERA.format(0), "stereo": CAMERA.format(0) + CAMERA.format(1) + BESIDE}


def rounds_table(work, only=None):
    rows = []
    work.mkdir(parents=True, exist_ok=True)
    for setup, camchain in CAMCHAINS.items():
        if only and setup not in only:
            continue
        camera = work / f"{setup}.yaml"
        camera.write_text(camchain)
        folder = simulate(work / setup, "hall", "--motion", "thirty_rounds", "--setup", setup, "--camera",
                          camera, "--frames", NUM_ROUNDS * FRAMES_PER_ROUND, "--seed", 7)
        settled, last = (map_sequence(folder, work / f"{setup}_out", setup, "--frames",
                                      num_rounds * FRAMES_PER_ROUND).summary
                         for num_rounds in (SETTLED_ROUNDS, NUM_ROUNDS))
        pairs = [f"{settled[key]} / {last[key]}" for key in ("keyframes", "landmarks")]
        before, now = settled["peak_rss_mb"], last["peak_rss_mb"]
        rows.append([setup, f"{last['coverage']:.3f}", *pairs, f"{before:.1f} / {now:.1f} = {now / before:.3f}"])
    return (f"After {SETTLED_ROUNDS} and after {NUM_ROUNDS} of the same rounds of {FRAMES_PER_ROUND} frames:\n\n" +
            table(["set-up", "coverage", "keyframes", "landmarks", "peak memory in MB"], rows))

#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Maps a recorded sequence, prints where the camera was, and saves the map.

usage: map_images.py SEQUENCE CAMCHAIN.yaml MAP.wmap

SEQUENCE is whatever `waymark run` takes: a data set, a folder of images, a video file.
"""
import sys

import waymark


def main(sequence, camchain, map_file):
    frames = waymark.open_input(sequence, cameras=camchain)
    with waymark.System(frames.calibration) as system:
        for frame in frames:
            if frame.image0 is None:  # An image that cannot be read is a gap, no more.
                continue
            result = system.feed(frame.timestamp_ns, frame.image0, frame.image1, frame.depth)
            print(f"frame {frame.index}: {result.state}, {result.num_inliers} landmarks seen",
                  file=sys.stderr)

    # Where the rig was and how it stood; of one camera without depth the unit of length is free.
    trajectory = system.trajectory()
    for timestamp_ns, pose in zip(trajectory.timestamps_ns, trajectory.world_from_rig):
        x, y, z = pose[:3, 3]
        print(f"{1e-9 * timestamp_ns:.3f} {x:.6f} {y:.6f} {z:.6f}")
    system.save(map_file)


if __name__ == "__main__":
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    try:
        main(*sys.argv[1:])
    except (waymark.InputError, waymark.OutputError) as error:
        sys.exit(f"error: {error}")

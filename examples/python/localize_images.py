#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Finds single images of one camera in a saved map and says where each was taken, or why it was not found.

usage: localize_images.py MAP.wmap CAMCHAIN.yaml IMAGE...
"""
import sys

import waymark


def main(map_file, camchain, *images):
    localizer = waymark.Localizer(waymark.Map.load(map_file), camchain, setup="mono")
    for image in images:
        result = localizer.locate(waymark.read_grey_image(image))
        if result.world_from_rig is None:
            print(f"{image}: not found, {result.reason}: {result.num_matches} landmarks recognised, "
                  f"{result.num_inliers} agree")
        else:
            x, y, z = result.world_from_rig[:3, 3]
            print(f"{image}: {x:.3f} {y:.3f} {z:.3f}, {result.num_inliers} landmarks agree")


if __name__ == "__main__":
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    try:
        main(*sys.argv[1:])
    except waymark.InputError as error:
        sys.exit(f"error: {error}")

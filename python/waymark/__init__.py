# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Visual SLAM for any camera: images in, trajectory and map out.

>>> import waymark
>>> sequence = waymark.open_input("sequence")
>>> with waymark.System(sequence.calibration) as system:
...     for frame in sequence:
...         result = system.feed(frame.timestamp_ns, frame.image0, frame.image1)
>>> result.state
'tracked'
>>> system.trajectory().world_from_rig[-1].shape
(4, 4)

Poses are named b_from_a and map points of frame a into frame b. world_from_rig is where the rig,
that is its camera 0, is in the world and how it stands. Units are metres, radians, pixels and, for
times, nanoseconds; lengths of a map made by one camera without depth have no unit. Arrays that come
out are read-only.
"""
from ._waymark import (NO_ID, Atlas, AtlasLocalizer, Calibration, CalibrationEstimate, Camera, EstimatedCalibration,
                       Features, FrameDetails, InertialReport, Input, InputError, InputFrame, Keyframe,
                       Keyframes, Landmark, Landmarks, Localizer, LoopEdge, Map, Markers,
                       MarkerObservations, MergedMap, NavigationState, OutputError, Statistics, Submap, System, TrackingResult, Trajectory, Viewer,
                       __version__, calibrate, evaluate, info, open_input, read_depth_image, read_grey_image, report)
from .importing import import_map, import_settings

__all__ = [
    "NO_ID", "Atlas", "AtlasLocalizer", "Calibration", "CalibrationEstimate", "Camera", "EstimatedCalibration", "Features",
    "FrameDetails", "InertialReport", "Input", "InputError", "InputFrame", "Keyframe", "Keyframes",
    "Landmark", "Landmarks", "Localizer", "LoopEdge", "Map", "Markers",
    "MarkerObservations", "MergedMap", "NavigationState", "OutputError",
    "Statistics", "Submap", "System", "TrackingResult", "Trajectory", "Viewer", "__version__",
    "calibrate", "evaluate", "import_map", "import_settings", "info", "open_input", "read_depth_image",
    "read_grey_image", "report",
]

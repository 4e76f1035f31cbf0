// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "waymark/simulate/sequence.h"

namespace waymark {

/// Writes all frames below the folder, as a data set in a standard layout:
///   RGB-D           TUM RGB-D: rgb/, depth/, rgb.txt, depth.txt
///   stereo          EuRoC: mav0/cam0, mav0/cam1 with sensor.yaml (T_BS; the body is the rig); for
///                   cameras that sensor.yaml cannot describe as TUM-VI: dso/camchain.yaml instead
///   mono            EuRoC for perspective cameras, else images/ and times.txt
/// With markers: markers.yaml, their sizes and true poses.
/// With each: groundtruth.txt (TUM format, world_from_camera0) and camchain.yaml (Kalibr); where
/// the spec tells a wrong calibration the right one is in calibration_true.yaml. With an IMU: its
/// samples in mav0/imu0 (data.csv, and sensor.yaml of EuRoC, whose body is the rig) or imu0.csv,
/// imu.yaml (Kalibr), T_cam_imu and timeshift_cam_imu in camchain.yaml, as far as they are told.
/// Calls done(frame) after each frame, if given.
/// Throws OutputError, and InputError for what cannot be told wrong.
void write_dataset(SimulatedSequence& sequence,
                   const std::filesystem::path& folder,
                   const std::function<void(int frame)>& done = {});

/// A sequence for evaluation, and what it exercises.
struct SuiteEntry {
  SequenceSpec spec;
  std::string setup;  ///< "mono", "stereo" or "rgbd".
  std::string about;  ///< One line for reports.
};

/// Ten fixed sequences. They are a yardstick: they never change for the sake of a result.
std::vector<SuiteEntry> simulated_suite();

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/camera/rig.h"
#include "waymark/exchange/openvslam_camera.h"
#include "waymark/image/features.h"
#include "waymark/input/input.h"

namespace waymark {

/// Levels of the image pyramid that key points come from.
struct OpenvslamPyramid {
  double scale_factor = 1.2;
  std::int64_t num_levels = 8;
};

struct OpenvslamKeyframe {
  double timestamp_s = 0.0;
  std::string camera;
  std::optional<std::string> orb_params;  ///< Name of a pyramid; older files have its own instead.
  OpenvslamPyramid pyramid;
  Eigen::Quaterniond rotation_cw = Eigen::Quaterniond::Identity();  ///< As written.
  Eigen::Vector3d translation_cw = Eigen::Vector3d::Zero();
  /// In the pixels of a pinhole camera with the focal lengths and the centre of the camera and no
  /// distortion; of an equirectangular camera in its own pixels. The level is that of the pyramid.
  std::vector<Keypoint> keypoints;
  std::vector<float> right_columns_px;  ///< Negative: none. Empty in mono.
  std::vector<float> depths_m;          ///< Along z, negative: none. Empty in mono.
  std::vector<Descriptor> descriptors;
  std::vector<std::int64_t> landmarks;  ///< Negative: none.
  std::int64_t parent = -1;             ///< Negative: none.
  std::vector<std::int64_t> loop_edges;
};

struct OpenvslamLandmark {
  Eigen::Vector3d position_in_world = Eigen::Vector3d::Zero();
  std::int64_t reference = -1;
  std::int64_t num_visible = 0;
  std::int64_t num_found = 0;
};

/// A map file of OpenVSLAM or stella_vslam (.msg) as it stands, each value checked on its own.
struct OpenvslamRecords {
  std::map<std::string, OpenvslamCamera> cameras;
  std::map<std::string, OpenvslamPyramid> pyramids;  ///< By name; empty in older files.
  std::map<std::int64_t, OpenvslamKeyframe> keyframes;
  std::map<std::int64_t, OpenvslamLandmark> landmarks;
};

/// Reads both the keys of stella_vslam and those of OpenVSLAM of 2019 and 2020. Throws InputError
/// for whatever is missing, malformed or beyond all bounds; name is what errors call the file.
OpenvslamRecords read_openvslam_records(std::string_view bytes, const std::string& name);

/// The same of a map in SQLite (.db) of stella_vslam. Pyramids are not stored there: all keyframes
/// get the given one. Memory stays within that of the file. Throws InputError.
OpenvslamRecords read_openvslam_database(const std::filesystem::path& path,
                                         const OpenvslamPyramid& pyramid);

/// The pyramid that settings (YAML) of these programs state, else that of their defaults.
OpenvslamPyramid read_openvslam_pyramid(const ConfigSource& settings);

/// What the key points of a keyframe were seen by.
struct OpenvslamView {
  OpenvslamPyramid pyramid;
  Setup setup = Setup::kMono;
  std::shared_ptr<const Rig> rig;
  /// Of camera 0; nothing where key points are pixels of the camera itself (equirectangular).
  std::vector<double> undistorted_intrinsics;
  std::string where;  ///< Begins error messages.
};

struct OpenvslamFeatures {
  std::shared_ptr<const Features> features;
  std::vector<std::uint32_t> feature_of_keypoint;  ///< kNoFeature where it has no bearing.
};

/// The key points of a keyframe as our features: distorted again, with the level of our pyramid
/// that comes next to theirs, and with what follows from the camera computed by our own code. Key
/// points that the camera cannot have seen are left out.
OpenvslamFeatures convert_openvslam_features(const OpenvslamKeyframe& keyframe,
                                             const OpenvslamView& view);

}  // namespace waymark

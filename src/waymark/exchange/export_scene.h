// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "waymark/camera/camera.h"
#include "waymark/map/map.h"
#include "waymark/mapfile/map_file.h"
#include "waymark/results/trajectory.h"

namespace waymark {

/// Camera 0 of the keyframes of a sub-map in the world, by time.
std::vector<StampedPose> keyframe_trajectory(const Map& map, SubmapId submap);

inline constexpr std::uint32_t kNoPoint = UINT32_MAX;  ///< In place of the index of a point: none.

/// What a camera saw at a moment, or a part of it.
struct ExportView {
  std::string name;               ///< Of its image file.
  std::string mask_name;          ///< Of the mask that belongs to it; empty if everything is seen.
  KeyframeId keyframe;            ///< Whose it is; invalid for a frame that is none.
  std::int64_t timestamp_ns = 0;  ///< Of its image.
  std::size_t rig_camera = 0;     ///< Which camera of the rig: 0, or 1 of a stereo pair.
  std::size_t camera = 0;         ///< Index in ExportScene::cameras.
  Rigid3 cam_from_world;          ///< In metres (map units where the scale is free).
  std::vector<Eigen::Vector2d> pixels;  ///< Of its features.
  std::vector<std::uint32_t> points;    ///< Per feature the index in ExportScene::points, or none.
};

/// A view that sees a point.
struct ExportObservation {
  std::uint32_t view = 0;     ///< Index in ExportScene::views.
  std::uint32_t feature = 0;  ///< Index in its pixels.
};

/// A landmark.
struct ExportPoint {
  LandmarkId landmark;  ///< Which one of the map.
  /// In metres (map units where the scale is free).
  Eigen::Vector3d position_in_world = Eigen::Vector3d::Zero();
  std::array<std::uint8_t, 3> color = {128, 128, 128};  ///< Red, green, blue.
  double error_px = 0.0;                                ///< Mean reprojection error.
  std::vector<ExportObservation> observations;          ///< Two at least, or none.
  /// Mean unit vector towards the cameras that see it: the side of its surface that is seen.
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
};

/// A sub-map as other programs know maps: cameras, views with features, points with tracks.
struct ExportScene {
  std::vector<CameraDescription> cameras;  ///< Of the views; equal ones in the same place once.
  std::vector<Rigid3> cam_from_rig;        ///< Of each of them, in metres.
  std::vector<ExportView> views;           ///< By id of the keyframe, then by camera; or by time.
  std::vector<ExportPoint> points;         ///< By id of the landmark.
};

/// Which cameras of the keyframes become views.
enum class ExportCameras { kFirst, kAll };

/// A sub-map in these terms; image files of several cameras are named "cam0/..." and "cam1/...".
/// VisibleShare that are off by more than kMaxExportErrorPx are left out,
/// and points that are then seen by fewer than two views. What shows a point on an edge lies across
/// the edge where it was measured and along it where the point should be seen. Points are coloured
/// as the images show them where there are images (broken ones count as none), else grey.
/// InputError for cameras that carry no description.
ExportScene make_export_scene(const Map& map,
                              SubmapId submap,
                              const KeyframeImages& images = {},
                              ExportCameras cameras = ExportCameras::kFirst);

/// Features far up the pyramid may be off by more of the image's pixels than tools for dense
/// reconstruction expect: 4 px is where COLMAP draws the line, too (its filter_max_reproj_error).
inline constexpr double kMaxExportErrorPx = 4.0;

}  // namespace waymark

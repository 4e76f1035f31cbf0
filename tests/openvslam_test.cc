// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// A real map of stella_vslam is imported, and images of another camera find themselves in it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "waymark/base/median.h"
#include "waymark/base/text.h"
#include "waymark/evaluate/evaluation.h"
#include "waymark/exchange/openvslam_map.h"
#include "waymark/exchange/trajectory.h"
#include "waymark/image/frame_builder.h"
#include "waymark/input/input.h"
#include "waymark/track/relocalizer.h"

namespace waymark {
namespace {

/// WAYMARK_DATA with the map, the sequence it is of, and the images to be found in it.
std::optional<std::filesystem::path> data_folder() {
  const char* data = std::getenv("WAYMARK_DATA");
  if (data == nullptr) return std::nullopt;
  const std::filesystem::path folder = data;
  for (const char* name : {"stella_bookstore/map.msg",
                           "sim_bookstore_mono/groundtruth.txt",
                           "sim_bookstore_query_mono/groundtruth.txt"}) {
    if (!std::filesystem::exists(folder / name)) return std::nullopt;
  }
  return folder;
}

ImportedMap import(const std::filesystem::path& data) {
  const std::filesystem::path path = data / "stella_bookstore/map.msg";
  return import_openvslam_map(read_text_file(path, "a map"), path.string());
}

/// Of every observation, in pixels of the image.
std::vector<double> reprojection_errors(const Map& map) {
  std::vector<double> errors;
  map.keyframes().for_each([&](KeyframeId, const Keyframe& keyframe) {
    const Features& features = *keyframe.features;
    for (std::size_t i = 0; i < features.num_primary; ++i) {
      if (!keyframe.landmarks[i].is_valid()) continue;
      const Landmark& landmark = map.landmarks().at(keyframe.landmarks[i]);
      const Eigen::Vector3d point = keyframe.rig_from_world * landmark.position_in_world;
      Eigen::Vector2d pixel;
      std::uint8_t is_visible = 0;
      keyframe.rig->cameras[0].camera->project({&point, 1}, {&pixel, 1}, {&is_visible, 1});
      const Keypoint& keypoint = features.keypoints[i];
      const Eigen::Vector2d measured(keypoint.x_px, keypoint.y_px);
      errors.push_back(is_visible ? (pixel - measured).norm() : 1e3);
    }
  });
  return errors;
}

Sim3 truth_from_map(const Map& map, const std::filesystem::path& data) {
  std::vector<StampedPose> keyframes;
  map.keyframes().for_each([&](KeyframeId, const Keyframe& keyframe) {
    keyframes.push_back({keyframe.timestamp_ns, keyframe.rig_from_world.inverse()});
  });
  std::sort(keyframes.begin(), keyframes.end(), [](const StampedPose& a, const StampedPose& b) {
    return a.timestamp_ns < b.timestamp_ns;
  });
  EvaluationOptions options;
  options.alignment = TrajectoryAlignment::kSim3;
  const Evaluation evaluation =
      evaluate(keyframes, read_trajectory(data / "sim_bookstore_mono/groundtruth.txt"), options);
  EXPECT_LT(evaluation.ate_m.rmse, 0.12);
  return evaluation.groundtruth_from_estimate;
}

TEST(OpenvslamMapRecorded, IsSoundAndFitsItsObservations) {
  const auto data = data_folder();
  if (!data) GTEST_SKIP() << "WAYMARK_DATA has no stella_bookstore/map.msg";
  const ImportedMap imported = import(*data);
  EXPECT_EQ(imported.map.broken_invariants(), "");
  EXPECT_EQ(imported.map.keyframes().size(), 26u);
  EXPECT_EQ(imported.map.landmarks().size(), 3158u);
  std::vector<double> errors = reprojection_errors(imported.map);
  EXPECT_GT(errors.size(), 10'000u);
  EXPECT_LT(median(errors), 1.5);
  RecordProperty("median_px", std::to_string(median(errors)));
}

/// The other camera has another lens, walked another way and under other light. Some 150 of the
/// images show what the map shows.
TEST(OpenvslamMapRecorded, LocalisesAnotherCamera) {
  const auto data = data_folder();
  if (!data) GTEST_SKIP() << "WAYMARK_DATA has no stella_bookstore/map.msg";
  const ImportedMap imported = import(*data);
  const Sim3 truth_from_estimate = truth_from_map(imported.map, *data);
  PlaceIndex places;
  imported.map.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    places.add(id, keyframe.submap, keyframe.features->descriptors);
  });

  const std::filesystem::path query = *data / "sim_bookstore_query_mono";
  InputOptions reading;
  reading.calibration =
      read_camchain(parse_config(ConfigSource::from_file(query / "camchain.yaml")));
  const auto rig = std::make_shared<const Rig>(make_rig(*reading.calibration));
  FrameBuilder builder(*rig, {});
  Relocalizer relocalizer(rig, {}, 0);
  const std::vector<StampedPose> truth = read_trajectory(query / "groundtruth.txt");
  const auto input = open_input(query, reading);
  std::vector<double> errors;
  while (const std::optional<InputFrame> image = input->next()) {
    const auto index = static_cast<std::uint32_t>(image->index);
    const Frame frame = {
        FrameId{index}, image->timestamp_ns, builder.build({.image0 = image->images[0].view()})};
    const auto located = relocalizer.locate(frame, imported.map, places);
    if (!located) continue;
    const Eigen::Vector3d position =
        truth_from_estimate * located->rig_from_world.origin_in_source();
    errors.push_back((position - truth[index].world_from_camera.translation).norm());
  }
  RecordProperty("localised", static_cast<int>(errors.size()));
  RecordProperty("median_error_m", std::to_string(median(errors)));
  EXPECT_GE(errors.size(), 90u);
  EXPECT_LE(median(errors), 0.15);
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <string>
#include <utility>

#include "waymark/atlas/atlas.h"
#include "waymark/loop/testing/loop.h"
#include "waymark/map/parts.h"

namespace waymark {

/// A map of the steps from one to another of a walk round a circle, in a frame and units of its
/// own.
inline std::unique_ptr<LoopScene> walk_of_steps(int from_step,
                                                int to_step,
                                                bool is_metric,
                                                double scale = 1.0,
                                                const Vector7d& drift = Vector7d::Zero()) {
  auto scene = std::make_unique<LoopScene>(cloud_all_round(kNumPoints), is_metric, drift);
  // Files want to know what a camera was made of.
  Rig rig = *scene->rig;
  rig.cameras[0].description = CameraDescription{
      "pinhole", {420.0, 420.0, 319.5, 239.5}, "radtan", {0.0, 0.0, 0.0, 0.0}, 640, 480, ""};
  scene->rig = std::make_shared<const Rig>(std::move(rig));
  scene->map = Map();
  const double turn = 0.1 * from_step;
  scene->start_submap(
      {Eigen::Quaterniond(0.8, 0.1, -0.5, 0.3 + turn).normalized(), {3.0, turn, -2.0}, scale});
  for (int step = from_step; step < to_step; ++step) scene->add_keyframe(step);
  return scene;
}

/// The same as a file. Gives its path.
inline std::filesystem::path save_walk(const std::filesystem::path& folder,
                                       const std::string& name,
                                       LoopScene& scene) {
  const std::filesystem::path path = folder / (name + ".wmap");
  MapParts parts = take_apart(scene.map);
  for (MapParts::StoredKeyframe& one : parts.keyframes) {
    one.keyframe.timestamp_ns = one.keyframe.frame.value;  // The step, by which tests know it.
  }
  StoredMap stored;
  stored.map = Map::restore(std::move(parts)).freeze();
  save_map(path, stored);
  return path;
}

/// A folder of a test that is empty.
inline std::filesystem::path empty_folder(const std::string& name) {
  const std::filesystem::path folder = std::filesystem::path(::testing::TempDir()) / name;
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  return folder;
}

}  // namespace waymark

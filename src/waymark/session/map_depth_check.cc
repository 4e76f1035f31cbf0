// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/session/map_depth_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "waymark/base/median.h"
#include "waymark/track/keyframes_near.h"

namespace waymark {
namespace {

/// Of the frames that are found; neighbours show the same.
constexpr int kEvery = 5;
constexpr std::size_t kMinFrames = 3;
constexpr std::size_t kMaxFrames = 20;
constexpr std::size_t kMinLandmarks = 20;
/// What a sensor is off by at most, and what is hidden since, is less.
constexpr double kMinFactor = 1.2;

}  // namespace

MapDepthCheck::MapDepthCheck(std::shared_ptr<const Map> map, Rig rig) : rig_(std::move(rig)) {
  if (!map->keyframes().is_empty() && is_metric(*map)) map_ = std::move(map);
}

void MapDepthCheck::add(const FrameImages& images, const TrackingResult& found) {
  const bool is_of_map = map_ && found.world_from_rig && found.submap.is_valid() &&
                         found.submap.value < map_->submaps().size();
  if (!is_of_map || images.depth.is_empty() || units_per_metre_.size() == kMaxFrames) return;
  if (num_found_++ % kEvery != 0) return;
  const Rigid3 rig_from_world = found.world_from_rig->inverse();
  const auto near = keyframes_near(*map_, found.submap, rig_, rig_from_world, 1);
  if (near.empty()) return;
  const Rigid3 cam_from_world = rig_.cameras[0].cam_from_rig * rig_from_world;
  std::vector<double> units;
  for (const LandmarkId id : map_->keyframes().at(near.front()).landmarks) {
    if (!id.is_valid()) continue;
    const Eigen::Vector3d point = cam_from_world * map_->landmarks().at(id).position_in_world;
    Eigen::Vector2d pixel;
    std::uint8_t is_visible = 0;
    rig_.cameras[0].camera->project({&point, 1}, {&pixel, 1}, {&is_visible, 1});
    if (!is_visible || !(point.z() > 0.0)) continue;
    const int x = static_cast<int>(std::lround(pixel.x()));
    const int y = static_cast<int>(std::lround(pixel.y()));
    if (x < 0 || y < 0 || x >= images.depth.width_px || y >= images.depth.height_px) continue;
    if (const auto depth = images.depth.at(x, y)) units.push_back(depth / point.z());
  }
  if (units.size() >= kMinLandmarks) units_per_metre_.push_back(median(std::move(units)));
}

std::optional<std::string> MapDepthCheck::advise(double units_per_metre) const {
  if (units_per_metre_.size() < kMinFrames) return std::nullopt;
  const double by_map = median(std::vector<double>(units_per_metre_));
  const double factor = by_map / units_per_metre;
  if (std::max(factor, 1.0 / factor) < kMinFactor) return std::nullopt;
  return fmt::format(
      "depth is {:.3g} times what the map says: is depth.factor right? It is {:g}; by the map a "
      "metre has {:.3g} units",
      factor,
      units_per_metre,
      by_map);
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/session/quality.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "waymark/base/text.h"
#include "waymark/mapping/associate.h"
#include "waymark/solver/residual.h"

namespace waymark {
namespace {

void add_reprojection(const Map& map, RunQuality& quality) {
  double sum = 0.0, sum_of_parts = 0.0, count = 0.0;
  map.landmarks().for_each([&](LandmarkId, const Landmark& landmark) {
    for (const Observation& seen : landmark.observations) {
      const Keyframe& keyframe = map.keyframes().at(seen.keyframe);
      const double squared = squared_residual(keyframe, seen.feature, landmark.position_in_world)
                                 .value_or(kGrossSquaredResidual);
      const Camera& camera = *keyframe.rig().cameras.at(0).camera;
      const double side_px = std::max(camera.width_px(), camera.height_px());
      sum += squared;
      sum_of_parts += squared / (side_px * side_px);
      ++count;
    }
  });
  if (count == 0.0) return;
  quality.reprojection_px = std::sqrt(sum / count);
  quality.reprojection_percent = 100.0 * std::sqrt(sum_of_parts / count);
}

double share_of_matches_kept(std::span<const FrameRecord> frames) {
  double num_matches = 0.0;
  double num_inliers = 0.0;
  for (const FrameRecord& frame : frames) {
    if (frame.state != FrameState::kTracked) continue;
    num_matches += frame.num_matches;
    num_inliers += frame.num_inliers;
  }
  return num_matches > 0.0 ? num_inliers / num_matches : 0.0;
}

double length_of(std::span<const std::vector<StampedPose>> trajectories) {
  double length = 0.0;
  for (const std::vector<StampedPose>& poses : trajectories) {
    for (std::size_t i = 1; i < poses.size(); ++i) {
      length +=
          (poses[i].world_from_camera.translation - poses[i - 1].world_from_camera.translation)
              .norm();
    }
  }
  return length;
}

}  // namespace

RunQuality assess(const Map& map,
                  std::span<const FrameRecord> frames,
                  std::span<const std::vector<StampedPose>> trajectories) {
  RunQuality quality;
  add_reprojection(map, quality);
  quality.matches_kept = share_of_matches_kept(frames);
  quality.length = length_of(trajectories);
  quality.is_metric = is_metric(map);
  return quality;
}

std::string describe(const RunQuality& quality, std::size_t num_loops) {
  return fmt::format(
      "reprojection error {:.2f} px, {:.0f} % of the matches kept, {}, {:.1f} {} long",
      quality.reprojection_px,
      100.0 * quality.matches_kept,
      count_of(num_loops, "loop"),
      quality.length,
      quality.is_metric ? "m" : "map units");
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/session/quality.h"

#include <fmt/format.h>

#include <cmath>

#include "waymark/mapping/associate.h"
#include "waymark/optimize/residual.h"

namespace waymark {
namespace {

double rms_reprojection_px(const Map& map) {
  double sum = 0.0;
  std::size_t count = 0;
  map.landmarks().for_each([&](LandmarkId, const Landmark& landmark) {
    for (const Observation& seen : landmark.observations) {
      const Keyframe& keyframe = map.keyframes().at(seen.keyframe);
      sum += squared_residual(keyframe, seen.feature, landmark.position_in_world)
                 .value_or(kGrossSquaredResidual);
      ++count;
    }
  });
  return count == 0 ? 0.0 : std::sqrt(sum / static_cast<double>(count));
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
  quality.reprojection_px = rms_reprojection_px(map);
  quality.matches_kept = share_of_matches_kept(frames);
  quality.length = length_of(trajectories);
  quality.is_metric = is_metric(map);
  return quality;
}

std::string describe(const RunQuality& quality, std::size_t num_loops) {
  return fmt::format(
      "reprojection error {:.2f} px, {:.0f} % of the matches kept, {} loop{}, {:.1f} {} long",
      quality.reprojection_px,
      100.0 * quality.matches_kept,
      num_loops,
      num_loops == 1 ? "" : "s",
      quality.length,
      quality.is_metric ? "m" : "map units");
}

}  // namespace waymark

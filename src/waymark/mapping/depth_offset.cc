// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/depth_offset.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "waymark/mapping/camera_measurements.h"
#include "waymark/mapping/linear_calibration.h"

namespace waymark {
namespace {

/// As for other numbers of a calibration: see docs/decisions/calibrate.md.
constexpr double kMinOffsetSigmas = 7.0;
constexpr double kMinOffsetChange = 2.0;
constexpr int kNumPasses = 3;
/// Ranges that are off by a larger share are of something else.
constexpr double kMaxOff = 0.5;

bool has_depth(const Map& map, std::span<const Observation> observed) {
  return std::ranges::any_of(observed, [&](const Observation& one) {
    const Features& features = *map.keyframes().at(one.keyframe).features;
    return features.measurement(one.feature).inverse_range_sigma > 0.0f;
  });
}

/// Gives the observations their ranges back that an adjustment leaves out as too far off: most are,
/// where depth images are wrong. Points on edges get none: where a surface ends, its nearest part
/// is measured.
void restore_ranges(const Map& map,
                    std::span<const Observation> observed,
                    const Rig& rig,
                    BundleProblem& problem) {
  for (std::size_t i = 0; i < observed.size(); ++i) {
    BundleObservation& observation = problem.observations[i];
    if (problem.rigs[observation.pose] != &rig) continue;
    const Features& features = *map.keyframes().at(observed[i].keyframe).features;
    if (features.is_edge(observed[i].feature)) {
      observation.inverse_range_sigma = 0.0f;
      continue;
    }
    const Measurement measured = features.measurement(observed[i].feature);
    const Eigen::Vector3d point_in_rig =
        problem.rig_from_world[observation.pose] * problem.points[observation.point];
    const double off = measured.inverse_range * point_in_rig.norm() - 1.0;
    observation.inverse_range = measured.inverse_range;
    observation.inverse_range_sigma = std::abs(off) < kMaxOff ? measured.inverse_range_sigma : 0.0f;
  }
}

/// What depth images measure more, in inverse range, per unit of offset.
std::vector<float> ranges_by_offset(const Rig& rig, const BundleProblem& problem) {
  std::vector<float> all;
  for (const BundleObservation& observation : problem.observations) {
    const bool has_range = observation.inverse_range_sigma > 0.0f;
    const bool is_of_rig = problem.rigs[observation.pose] == &rig;
    all.push_back(has_range && is_of_rig ? observation.bearing.z() : 0.0f);
  }
  return all;
}

/// The estimate, with which the problem is measured then.
std::optional<LinearCalibration> adjust_offset(const KnownCalibration& known,
                                               BundleProblem& problem) {
  const auto one = [](double value) { return Eigen::VectorXd::Constant(1, value); };
  LinearCalibration offset{.inverse_range_by = ranges_by_offset(*known.rig, problem),
                           .given = one(known.given_depth_offset),
                           .prior_sigma = one(kDepthOffsetPrior),
                           .value = one(known.rig->inverse_depth_offset)};
  if (!may_be_contradicted(*known.rig, problem, offset, kMinOffsetSigmas)) return std::nullopt;
  for (int pass = 0; pass < kNumPasses; ++pass) {
    const auto change = adjust_linear(*known.rig, problem, offset);
    if (!change) return std::nullopt;
    for (std::size_t i = 0; i < problem.observations.size(); ++i) {
      problem.observations[i].inverse_range -=
          static_cast<float>((*change)[0]) * offset.inverse_range_by[i];
    }
  }
  return offset;
}

}  // namespace

std::optional<KnownCalibration> find_depth_offset(const Map& map,
                                                  std::span<const Observation> observed,
                                                  const KnownCalibration& known,
                                                  BundleProblem& problem) {
  if (known.rig->cameras.size() > 1 || !has_depth(map, observed)) return std::nullopt;
  BundleProblem adjusted = problem;
  restore_ranges(map, observed, *known.rig, adjusted);
  const std::optional<LinearCalibration> estimate = adjust_offset(known, adjusted);
  if (!estimate) return std::nullopt;
  const double offset = estimate->value[0], sigma = estimate->sigma[0];
  const double used = known.rig->inverse_depth_offset;
  if (std::abs(offset - known.given_depth_offset) < kMinOffsetSigmas * sigma) return std::nullopt;
  if (std::abs(offset - used) < kMinOffsetChange * sigma) return std::nullopt;
  KnownCalibration found = known;
  found.given = std::make_shared<const Rig>(with_depth_offset(*known.given, offset));
  found.rig = std::make_shared<const Rig>(with_depth_offset(*known.rig, offset));
  found.depth_offset_sigma = sigma;
  problem.rig_from_world = adjusted.rig_from_world;
  problem.points = adjusted.points;
  recompute(map, observed, *known.rig, found.rig, problem);
  return found;
}

}  // namespace waymark

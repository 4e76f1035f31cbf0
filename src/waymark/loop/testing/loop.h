// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <map>
#include <numbers>
#include <vector>

#include "waymark/base/median.h"
#include "waymark/geometry/alignment.h"
#include "waymark/mapping/appearance.h"
#include "waymark/mapping/associate.h"
#include "waymark/match/testing/scene.h"
#include "waymark/place/place_index.h"
#include "waymark/simulate/testing/points.h"

namespace waymark {

/// The logarithm of a similarity that moves along x, turns round y and scales.
inline Vector7d drift_of(double distance, double angle_rad, double log_scale) {
  Vector7d drift;
  drift << distance, 0.0, 0.0, 0.0, angle_rad, 0.0, log_scale;
  return drift;
}

/// Points all round a circle on which a camera walks and looks outward.
inline PointCloud cloud_all_round(int count) {
  PointCloud box = scatter_in({-11.0, -2.5, -11.0}, {11.0, 2.5, 11.0}, 2 * count, 4.5, 5);
  std::erase_if(box.landmarks, [](const PointLandmark& point) {
    const double radius = std::hypot(point.position.x(), point.position.z());
    return radius < 7.0 || radius > 11.0;
  });
  return box;
}

/// The half round z > 0 again, turned by 180 degrees, in place of the other half.
inline PointCloud cloud_with_twins(int count) {
  PointCloud cloud = cloud_all_round(count);
  std::erase_if(cloud.landmarks,
                [](const PointLandmark& point) { return point.position.z() < 0.0; });
  const std::size_t num_originals = cloud.landmarks.size();
  const Eigen::Vector3d half_turn(-1.0, 1.0, -1.0);
  for (std::size_t i = 0; i < num_originals; ++i) {
    PointLandmark twin = cloud.landmarks[i];
    twin.position = half_turn.cwiseProduct(twin.position);
    twin.tangent = half_turn.cwiseProduct(twin.tangent);
    cloud.landmarks.push_back(twin);
  }
  return cloud;
}

/// A fifth of the half round z > 0 again, turned by 180 degrees, among what the other half has.
inline PointCloud cloud_with_faint_twins(int count) {
  PointCloud cloud = cloud_all_round(count);
  const Eigen::Vector3d half_turn(-1.0, 1.0, -1.0);
  const std::vector<PointLandmark> originals = cloud.landmarks;
  for (std::size_t i = 0; i < originals.size(); i += 5) {
    PointLandmark twin = originals[i];
    if (twin.position.z() < 0.0) continue;
    twin.position = half_turn.cwiseProduct(twin.position);
    twin.tangent = half_turn.cwiseProduct(twin.tangent);
    cloud.landmarks.push_back(twin);
  }
  return cloud;
}

/// One and the same stretch, so many times all round.
inline PointCloud cloud_of_equal_stretches(int count, int num_stretches) {
  PointCloud cloud = cloud_all_round(count);
  const double stretch_rad = 2.0 * std::numbers::pi / num_stretches;
  std::erase_if(cloud.landmarks, [&](const PointLandmark& point) {
    const double angle = std::atan2(point.position.x(), point.position.z());
    return angle < 0.0 || angle >= stretch_rad;
  });
  const std::vector<PointLandmark> originals = cloud.landmarks;
  for (int stretch = 1; stretch < num_stretches; ++stretch) {
    const Eigen::AngleAxisd turn(stretch * stretch_rad, Eigen::Vector3d::UnitY());
    for (PointLandmark point : originals) {
      point.position = turn * point.position;
      point.tangent = turn * point.tangent;
      cloud.landmarks.push_back(point);
    }
  }
  return cloud;
}

/// A map as it is before loops are closed: the camera walks on a circle and keyframes associate
/// what they see with landmarks of the last few keyframes only, so that a place seen again gets
/// landmarks anew. The map drifts steadily from the truth.
class LoopScene {
 public:
  static constexpr int kStepsPerRound = 40;
  static constexpr double kRadius = 4.0;

  /// drift: tangent of map_from_world after one round, zero at the start.
  LoopScene(PointCloud cloud_in, bool is_metric_in, const Vector7d& drift_in)
      : rig(make_test_rig(1)),
        cloud(std::move(cloud_in)),
        is_metric(is_metric_in),
        drift(drift_in) {
    start_submap(Sim3());
  }

  /// Further keyframes belong to another sub-map, whose frame and units are others.
  void start_submap(const Sim3& submap_from_world) {
    submap = map.add_submap(is_metric);
    frame = submap_from_world;
    parent = {};
    landmark_of_point.clear();
  }

  static Rigid3 true_pose(int step) {
    const double angle = 2.0 * std::numbers::pi * step / kStepsPerRound;
    return make_test_pose({kRadius * std::sin(angle), 0.0, kRadius * std::cos(angle)},
                          {0.0, angle, 0.0});
  }

  Sim3 map_from_world(int step) const {
    return frame * Sim3::exp(static_cast<double>(step) / kStepsPerRound * drift);
  }

  /// The true relative pose of two steps, in the units that the map has at the first.
  Sim3 true_motion(int query_step, int match_step) const {
    const Rigid3 relative = true_pose(query_step).inverse() * true_pose(match_step);
    const double query_scale = map_from_world(query_step).scale;
    const double match_scale = map_from_world(match_step).scale;
    return {relative.rotation, query_scale * relative.translation, query_scale / match_scale};
  }

  KeyframeId add_keyframe(int step) {
    const Rigid3 world_from_rig = true_pose(step);
    const PointObservation view =
        observe(cloud, rig, world_from_rig, {.seed = 4}, static_cast<std::uint64_t>(step));
    const Sim3 rig_from_map = Sim3(world_from_rig.inverse()) * map_from_world(step).inverse();
    Keyframe keyframe;
    keyframe.frame = FrameId{static_cast<std::uint32_t>(step)};
    keyframe.submap = submap;
    keyframe.parent = parent;
    keyframe.features = view.features;
    keyframe.rig_from_world = {rig_from_map.rotation,
                               rig_from_map.translation / rig_from_map.scale};
    const KeyframeId id = map.add_keyframe(std::move(keyframe));
    associate_features(id, step, view);
    places.add(id, submap, view.features->descriptors);
    steps.push_back(step);
    parent = id;
    return id;
  }

  std::shared_ptr<const Rig> rig;
  PointCloud cloud;
  bool is_metric;
  Vector7d drift;
  Map map;
  PlaceIndex places;
  SubmapId submap;
  std::vector<int> steps;  ///< Per keyframe.

 private:
  struct KnownPoint {
    LandmarkId landmark;
    int last_step;
  };
  static constexpr int kMemory = 3;

  void associate_features(KeyframeId id, int step, const PointObservation& view) {
    for (std::uint32_t i = 0; i < view.features->num_primary; ++i) {
      const std::uint32_t index = view.landmark_of_feature[i];
      if (index == kNoLandmark) continue;
      const auto [at, is_new] = landmark_of_point.try_emplace(index);
      if (is_new || step - at->second.last_step > kMemory) {
        const Eigen::Vector3d& point = cloud.landmarks[index].position;
        at->second.landmark = map.add_landmark(submap, map_from_world(step + 2) * point, id);
      }
      at->second.last_step = step;
      map.observe(id, i, at->second.landmark);
      map.set_appearance(at->second.landmark, describe_landmark(map, at->second.landmark));
    }
  }

  Sim3 frame;
  KeyframeId parent;
  std::map<std::uint32_t, KnownPoint> landmark_of_point;
};

constexpr int kNumPoints = 4000;
constexpr int kRound = LoopScene::kStepsPerRound;

/// Root mean square distance of the keyframes from the truth after the best similarity.
inline double error_of(const LoopScene& scene) {
  std::vector<Eigen::Vector3d> mapped, truth;
  scene.map.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    mapped.push_back(keyframe.rig_from_world.origin_in_source());
    truth.push_back(LoopScene::true_pose(scene.steps[id.value]).translation);
  });
  const Sim3 truth_from_map = align_similarity(mapped, truth).value();
  double sum = 0.0;
  for (std::size_t i = 0; i < mapped.size(); ++i) {
    sum += (truth_from_map * mapped[i] - truth[i]).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(mapped.size()));
}

/// Median length of the residuals of all observations, in pixels of the level.
inline double median_residual_px(const Map& map) {
  std::vector<double> residuals;
  map.landmarks().for_each([&](LandmarkId, const Landmark& landmark) {
    for (const Observation& observation : landmark.observations) {
      const auto squared = squared_residual(map.keyframes().at(observation.keyframe),
                                            observation.feature,
                                            landmark.position_in_world);
      residuals.push_back(squared ? std::sqrt(*squared) : 1e3);
    }
  });
  return median(residuals);
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/focal_check.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "waymark/camera/scaled_camera.h"
#include "waymark/camera/tangent.h"
#include "waymark/image/pyramid.h"
#include "waymark/mapping/associate.h"
#include "waymark/optimize/bundle.h"

namespace waymark {
namespace {

/// The map has dropped what contradicts the calibration most, which pulls the estimate towards it:
/// of 2 % (3 %) about 1.5 % (2 %) are left.
constexpr double kMaxError = 0.015;
/// An estimate is beyond doubt by so many standard deviations; matches that are wrong together make
/// it less certain than the residuals tell.
constexpr double kSigmas = 3.0;
constexpr std::size_t kNumKeyframes = 12;
constexpr std::size_t kMinLandmarks = 100;
/// Landmarks with fewer keyframes bend to any focal length.
constexpr std::size_t kMinKeyframesPerLandmark = 3;
/// Of the logarithm of the focal length, between the three that make a parabola.
constexpr double kStep = 0.015;
constexpr int kMaxParabolas = 4;
constexpr double kLargestLogFactor = 0.2;
constexpr double kMaxSigma = 0.01;

/// Keyframes, landmarks and their observations, with the pixels that the bearings came from.
struct FocalProblem {
  BundleProblem problem;
  std::vector<Eigen::Vector2d> pixels;  ///< Per observation, of level 0.
  std::vector<float> level_scales;
};

void add_observations(const Map& map,
                      const Landmark& landmark,
                      const std::vector<KeyframeId>& keyframes,
                      FocalProblem& scene) {
  std::vector<BundleObservation> seen;
  std::vector<Eigen::Vector2d> pixels;
  std::vector<float> level_scales;
  std::size_t num_keyframes = 0;
  std::size_t last = keyframes.size();
  for (const Observation& observation : landmark.observations) {
    const auto at = std::lower_bound(keyframes.begin(), keyframes.end(), observation.keyframe);
    if (at == keyframes.end() || *at != observation.keyframe) continue;
    const auto pose = static_cast<std::size_t>(at - keyframes.begin());
    num_keyframes += pose != last;
    last = pose;
    const Features& features = *map.keyframes().at(observation.keyframe).features;
    const Keypoint& keypoint = features.keypoints[observation.feature];
    BundleObservation measured;
    measured.pose = static_cast<std::uint32_t>(pose);
    measured.point = static_cast<std::uint32_t>(scene.problem.points.size());
    measured.camera = keypoint.camera;
    seen.push_back(measured);
    pixels.emplace_back(keypoint.x_px, keypoint.y_px);
    level_scales.push_back(static_cast<float>(Pyramid::scale(keypoint.level)));
  }
  if (num_keyframes < kMinKeyframesPerLandmark) return;
  scene.problem.points.push_back(landmark.position_in_world);
  auto append = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
  append(scene.problem.observations, seen);
  append(scene.pixels, pixels);
  append(scene.level_scales, level_scales);
}

/// The surroundings of the newest keyframe, as far as its rig saw them; its gauge is held by one
/// pose only, since a wrong focal length also bends the motion between two.
FocalProblem collect(const Map& map, KeyframeId newest) {
  std::vector<KeyframeId> keyframes = strongest_neighbours(map, newest, kNumKeyframes - 1);
  std::erase_if(keyframes, [&](KeyframeId id) {
    return map.keyframes().at(id).rig != map.keyframes().at(newest).rig;
  });
  keyframes.push_back(newest);
  std::sort(keyframes.begin(), keyframes.end());
  FocalProblem scene;
  std::vector<LandmarkId> landmarks;
  for (KeyframeId id : keyframes) {
    const Keyframe& keyframe = map.keyframes().at(id);
    scene.problem.rig_from_world.push_back(keyframe.rig_from_world);
    for (LandmarkId landmark : keyframe.landmarks) {
      if (landmark.is_valid()) landmarks.push_back(landmark);
    }
  }
  scene.problem.is_pose_fixed.assign(keyframes.size(), 0);
  scene.problem.is_pose_fixed.front() = 1;
  std::sort(landmarks.begin(), landmarks.end());
  landmarks.erase(std::unique(landmarks.begin(), landmarks.end()), landmarks.end());
  for (LandmarkId id : landmarks) {
    add_observations(map, map.landmarks().at(id), keyframes, scene);
  }
  return scene;
}

/// Bearings and their derivatives of a rig with another focal length; those of pixels that have
/// none there have no weight.
void measure_anew(const Rig& rig, double log_factor, FocalProblem& scene) {
  for (std::size_t camera = 0; camera < rig.cameras.size(); ++camera) {
    const auto scaled = ScaledCamera::refocused(rig.cameras[camera].camera, std::exp(log_factor));
    TangentComputer computer;
    const TangentArrays& tangents = computer.compute(scaled, scene.pixels, scene.level_scales);
    for (std::size_t i = 0; i < scene.pixels.size(); ++i) {
      BundleObservation& observation = scene.problem.observations[i];
      if (observation.camera != camera) continue;
      const bool is_valid = tangents.is_valid[i] != 0;
      observation.level_pixel_from_bearing =
          is_valid ? tangents.level_pixel_from_bearing[i] : Matrix23f(Matrix23f::Zero());
      if (is_valid) observation.bearing = tangents.bearings[i];
    }
  }
}

double least_cost(const Rig& rig, double log_factor, FocalProblem scene) {
  measure_anew(rig, log_factor, scene);
  return adjust_bundle(scene.problem,
                       {.num_rounds = 1,
                        .max_iterations_per_round = 25,
                        .follows_noise = false,
                        .relative_cost_tolerance = 1e-6})
      .final_cost;
}

}  // namespace

bool FocalCheck::is_off() const { return std::abs(factor - 1.0) > kMaxError + kSigmas * sigma; }

std::optional<FocalCheck> check_focal_length(const Map& map) {
  if (map.keyframes().size() < kMinKeyframesPerLandmark) return std::nullopt;
  const KeyframeId newest = map.resolve(KeyframeId{map.keyframes().end_id().value - 1});
  const Rig& rig = *map.keyframes().at(newest).rig;
  for (const RigCamera& camera : rig.cameras) {
    if (camera.camera->wrap_width_px() > 0.0) return std::nullopt;
  }
  FocalProblem scene = collect(map, newest);
  scene.problem.rigs.assign(scene.problem.rig_from_world.size(), &rig);
  if (scene.problem.points.size() < kMinLandmarks) return std::nullopt;
  const double num_unknowns = 6.0 * static_cast<double>(scene.problem.rig_from_world.size()) +
                              3.0 * static_cast<double>(scene.problem.points.size());
  const double freedom = 2.0 * static_cast<double>(scene.pixels.size()) - num_unknowns;
  double log_factor = 0.0;
  for (int round = 0; round < kMaxParabolas; ++round) {
    const double below = least_cost(rig, log_factor - kStep, scene);
    const double middle = least_cost(rig, log_factor, scene);
    const double above = least_cost(rig, log_factor + kStep, scene);
    const double curvature = (below - 2.0 * middle + above) / (kStep * kStep);
    if (!(curvature > 0.0) || !(freedom > 0.0)) return std::nullopt;
    const double step = (below - above) / (2.0 * kStep * curvature);
    const double sigma = std::sqrt(2.0 * middle / freedom / curvature);
    log_factor += std::clamp(step, -4.0 * kStep, 4.0 * kStep);
    if (std::abs(log_factor) > kLargestLogFactor || sigma > kMaxSigma) return std::nullopt;
    if (std::abs(step) < kStep) return FocalCheck{std::exp(log_factor), sigma};
  }
  return std::nullopt;
}

}  // namespace waymark

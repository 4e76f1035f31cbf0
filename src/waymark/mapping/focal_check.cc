// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/focal_check.h"

#include <algorithm>
#include <array>
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
constexpr int kMaxParabolas = 8;
constexpr double kMaxParabolaSteps = 4.0;
/// Forward motion bends maps as lenses do: what it takes for a lens is several percent.
constexpr double kMaxBend = 0.07;

/// By what a calibration is changed.
struct Change {
  double log_focal_length = 0.0;
  double bend = 0.0;  ///< By this part of its distance the corner of the image moves outwards.
};

/// One of the two, within what is searched.
struct Unknown {
  double Change::*member;
  double step;     ///< Between the three values that make a parabola.
  double largest;  ///< On both sides.
};
constexpr Unknown kFocalLength = {&Change::log_focal_length, 0.015, 0.25};
constexpr Unknown kBend = {&Change::bend, 0.01, 0.2};

/// Where the least cost was found, or where the search ended on the way there.
struct Least {
  double value = 0.0;
  double sigma = 0.0;
  bool is_found = false;
};

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
    if (features.is_edge(observation.feature)) continue;
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

/// Where a pixel is once the image is bent around the principal point.
Eigen::Vector2d bent(const Camera& camera, const Eigen::Vector2d& pixel, double bend) {
  const double half_diagonal_px = 0.5 * std::hypot(camera.width_px(), camera.height_px());
  const Eigen::Vector2d centre = principal_point(camera);
  const double radius = (pixel - centre).norm() / half_diagonal_px;
  return centre + (1.0 + bend * radius * radius) * (pixel - centre);
}

/// Bearings and their derivatives of a rig with another calibration; whether the observations have
/// any there.
std::vector<char> measure_anew(const Rig& rig, const Change& change, FocalProblem& scene) {
  std::vector<char> is_valid(scene.pixels.size(), 0);
  for (std::size_t camera = 0; camera < rig.cameras.size(); ++camera) {
    const auto scaled =
        ScaledCamera::refocused(rig.cameras[camera].camera, std::exp(change.log_focal_length));
    std::vector<Eigen::Vector2d> pixels = scene.pixels;
    for (Eigen::Vector2d& pixel : pixels) pixel = bent(scaled, pixel, change.bend);
    TangentComputer computer;
    const TangentArrays& tangents = computer.compute(scaled, pixels, scene.level_scales);
    for (std::size_t i = 0; i < scene.pixels.size(); ++i) {
      BundleObservation& observation = scene.problem.observations[i];
      if (observation.camera != camera) continue;
      is_valid[i] = static_cast<char>(tangents.is_valid[i]);
      observation.level_pixel_from_bearing = tangents.level_pixel_from_bearing[i];
      observation.bearing = tangents.bearings[i];
    }
  }
  return is_valid;
}

/// What three calibrations all have bearings for, so that they are judged by the same observations.
FocalProblem comparable(const Rig& rig, const std::array<Change, 3>& changes, FocalProblem scene) {
  std::vector<char> is_kept(scene.pixels.size(), 1);
  for (const Change& change : changes) {
    const std::vector<char> is_valid = measure_anew(rig, change, scene);
    for (std::size_t i = 0; i < is_kept.size(); ++i) is_kept[i] &= is_valid[i];
  }
  std::size_t count = 0;
  for (std::size_t i = 0; i < is_kept.size(); ++i) {
    if (!is_kept[i]) continue;
    scene.problem.observations[count] = scene.problem.observations[i];
    scene.pixels[count] = scene.pixels[i];
    scene.level_scales[count++] = scene.level_scales[i];
  }
  scene.problem.observations.resize(count);
  scene.pixels.resize(count);
  scene.level_scales.resize(count);
  return scene;
}

double least_cost(const Rig& rig, const Change& change, FocalProblem scene) {
  measure_anew(rig, change, scene);
  return adjust_bundle(scene.problem,
                       {.num_rounds = 1,
                        .max_iterations_per_round = 25,
                        .follows_noise = false,
                        .relative_cost_tolerance = 1e-6})
      .final_cost;
}

/// Costs below, at and above a value, and the degrees of freedom that they have in common.
struct Parabola {
  std::array<double, 3> costs;
  double freedom = 0.0;
};

Parabola costs_around(const Rig& rig,
                      const Unknown& unknown,
                      double value,
                      const FocalProblem& scene) {
  std::array<Change, 3> changes;
  for (int i = 0; i < 3; ++i) changes[i].*unknown.member = value + (i - 1) * unknown.step;
  const FocalProblem judged = comparable(rig, changes, scene);
  Parabola parabola;
  parabola.freedom = 2.0 * static_cast<double>(judged.pixels.size()) -
                     6.0 * static_cast<double>(judged.problem.rig_from_world.size()) -
                     3.0 * static_cast<double>(judged.problem.points.size());
  for (int i = 0; i < 3; ++i) parabola.costs[i] = least_cost(rig, changes[i], judged);
  return parabola;
}

/// The same where no adjustment got stuck on its way from the calibration: where one did, the step
/// of the unknown is shortened, for good.
Parabola sound_costs_around(const Rig& rig,
                            Unknown& unknown,
                            double value,
                            const FocalProblem& scene) {
  constexpr double kMaxRatio = 1.5;
  Parabola parabola = costs_around(rig, unknown, value, scene);
  for (int i = 0; i < 3; ++i) {
    const auto [below, middle, above] = parabola.costs;
    if (std::max(below, above) < kMaxRatio * middle) break;
    unknown.step *= 0.5;
    parabola = costs_around(rig, unknown, value, scene);
  }
  return parabola;
}

/// Downhill by parabolas, each within the reach of what it was made from.
Least find_least(const Rig& rig, Unknown unknown, const FocalProblem& scene) {
  Least least;
  const double reach = kMaxParabolaSteps * unknown.step;
  for (int i = 0; i < kMaxParabolas && std::abs(least.value) + unknown.step < unknown.largest;
       ++i) {
    const Parabola parabola = sound_costs_around(rig, unknown, least.value, scene);
    const auto [below, middle, above] = parabola.costs;
    if (!(parabola.freedom > 0.0)) return {};
    const double curvature = (below - 2.0 * middle + above) / (unknown.step * unknown.step);
    if (curvature > 0.0) {
      const double to_least = (below - above) / (2.0 * unknown.step * curvature);
      least.sigma = std::sqrt(2.0 * middle / parabola.freedom / curvature);
      least.value += std::clamp(to_least, -reach, reach);
      least.is_found = std::abs(to_least) < unknown.step;
    } else {
      least.value += below < above ? -reach : reach;
    }
    if (least.is_found) break;
  }
  return least;
}

}  // namespace

bool FocalCheck::is_off() const { return std::abs(factor - 1.0) > kMaxError + kSigmas * sigma; }

bool FocalCheck::is_bent() const {
  return !is_off() && bend_sigma > 0.0 && std::abs(bend) > kMaxBend + kSigmas * bend_sigma;
}

bool has_focal_check(const Map& map, FrameId first) {
  if (map.keyframes().size() == 0) return false;
  const KeyframeId newest = map.resolve(KeyframeId{map.keyframes().end_id().value - 1});
  return newest.is_valid() &&
         map.keyframes().at(newest).frame.value >= first.value + kFramesToCheck;
}

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

  const Least focal_length = find_least(rig, kFocalLength, scene);
  if (focal_length.sigma == 0.0) return std::nullopt;
  FocalCheck check;
  check.factor = std::exp(focal_length.value);
  check.sigma = focal_length.sigma;
  check.is_beyond = !focal_length.is_found;
  if (check.is_off()) return check;
  const Least bend = find_least(rig, kBend, scene);
  if (bend.is_found) {  // Else rows that lag, or motion that does not tell, lead out of all bounds.
    check.bend = bend.value;
    check.bend_sigma = bend.sigma;
  }
  return check;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/bundle_window.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/mapping/marker_bundle.h"
#include "waymark/solver/residual.h"

namespace waymark {
namespace {

/// Ranges that are off by more standard deviations are of something else.
constexpr double kMaxRangeSigmas = 3.0;

/// What a feature measures of a landmark; without its range where that is of something else, as of
/// a pattern that repeats.
Measurement measurement_of(const Keyframe& keyframe,
                           const Rigid3& rig_from_world,
                           std::uint32_t feature,
                           const Eigen::Vector3d& point_in_world) {
  Measurement measured = keyframe.features->measurement(feature);
  if (!(measured.inverse_range_sigma > 0.0f)) return measured;
  const Rigid3& cam_from_rig = keyframe.rig().cameras[measured.camera].cam_from_rig;
  const InverseRangePoint seen = in_inverse_range(cam_from_rig * (rig_from_world * point_in_world));
  const double off = range_residual(seen, measured.inverse_range, measured.inverse_range_sigma);
  if (std::abs(off) > kMaxRangeSigmas) measured.inverse_range_sigma = 0.0f;
  return measured;
}

template <class Id>
std::size_t index_of(const std::vector<Id>& sorted, Id id) {
  const auto at = std::lower_bound(sorted.begin(), sorted.end(), id);
  return at != sorted.end() && *at == id ? static_cast<std::size_t>(at - sorted.begin())
                                         : sorted.size();
}

template <class Id>
void sort_unique(std::vector<Id>& ids) {
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
}

std::vector<LandmarkId> seen_by(const Map& map, const std::vector<KeyframeId>& keyframes) {
  std::vector<LandmarkId> ids;
  for (KeyframeId keyframe : keyframes) {
    for (LandmarkId id : map.keyframes().at(keyframe).landmarks) {
      if (id.is_valid()) ids.push_back(id);
    }
  }
  sort_unique(ids);
  return ids;
}

/// Keyframes outside the window that see its landmarks, those that see most, ascending.
std::vector<KeyframeId> anchors(const Map& map, const BundleWindow& window, std::size_t max_fixed) {
  std::vector<KeyframeId> seers;
  for (LandmarkId id : window.landmarks) {
    KeyframeId last;
    for (const Observation& observation : map.landmarks().at(id).observations) {
      if (observation.keyframe != last) seers.push_back(observation.keyframe);
      last = observation.keyframe;
    }
  }
  std::sort(seers.begin(), seers.end());
  std::vector<std::pair<std::size_t, KeyframeId>> counts;
  for (auto begin = seers.begin(); begin != seers.end();) {
    const auto end = std::upper_bound(begin, seers.end(), *begin);
    if (index_of(window.moving, *begin) == window.moving.size()) {
      counts.push_back({static_cast<std::size_t>(end - begin), *begin});
    }
    begin = end;
  }
  std::sort(counts.rbegin(), counts.rend());
  if (counts.size() > max_fixed) counts.resize(max_fixed);
  std::vector<KeyframeId> fixed;
  for (const auto& [count, id] : counts) fixed.push_back(id);
  std::sort(fixed.begin(), fixed.end());
  return fixed;
}

/// Holds the gauge: without anchors the oldest keyframe is fixed. In mono the scale stays free, and
/// damping keeps it near where it was: to fix a second pose would fix the error of a short
/// baseline.
void fix_gauge(BundleWindow& window) {
  if (!window.fixed.empty() || window.moving.size() < 2) return;
  window.fixed.push_back(window.moving.front());
  window.moving.erase(window.moving.begin());
}

struct WindowProblem {
  BundleProblem problem;
  /// Parallel to the first of problem.observations; behind them are those of markers.
  std::vector<Observation> observations;
  std::vector<std::shared_ptr<const Rig>> marker_rigs;  ///< That the problem refers to.
};

std::vector<KeyframeId> keyframes_of(const BundleWindow& window) {
  std::vector<KeyframeId> keyframes = window.moving;
  keyframes.insert(keyframes.end(), window.fixed.begin(), window.fixed.end());
  std::sort(keyframes.begin(), keyframes.end());
  return keyframes;
}

/// start: where what it names is by now; null: all is where the map has it.
WindowProblem make_problem(const Map& map,
                           const BundleWindow& window,
                           const MapCorrection* start = nullptr) {
  WindowProblem result;
  BundleProblem& problem = result.problem;
  const std::vector<KeyframeId> keyframes = keyframes_of(window);
  for (KeyframeId id : keyframes) {
    const auto* const moved = start ? start->find(id) : nullptr;
    problem.rig_from_world.push_back(moved ? moved->rig_from_world
                                           : map.keyframes().at(id).rig_from_world);
    problem.rigs.push_back(map.keyframes().at(id).features->rig.get());
    problem.is_pose_fixed.push_back(index_of(window.moving, id) == window.moving.size());
  }
  for (LandmarkId id : window.landmarks) {
    const Landmark& landmark = map.landmarks().at(id);
    const auto point = static_cast<std::uint32_t>(problem.points.size());
    const auto* const moved = start ? start->find(id) : nullptr;
    problem.points.push_back(moved ? moved->position_in_world : landmark.position_in_world);
    for (const Observation& observation : landmark.observations) {
      const std::size_t pose = index_of(keyframes, observation.keyframe);
      if (pose == keyframes.size()) continue;
      problem.observations.push_back({measurement_of(map.keyframes().at(observation.keyframe),
                                                     problem.rig_from_world[pose],
                                                     observation.feature,
                                                     problem.points.back()),
                                      static_cast<std::uint32_t>(pose),
                                      point});
      result.observations.push_back(observation);
    }
  }
  return result;
}

MapCorrection moves_of(const BundleWindow& window, const BundleProblem& problem) {
  MapCorrection correction;
  const std::vector<KeyframeId> keyframes = keyframes_of(window);
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    if (problem.is_pose_fixed[i]) continue;
    correction.keyframes.push_back({keyframes[i], problem.rig_from_world[i]});
  }
  for (std::size_t i = 0; i < window.landmarks.size(); ++i) {
    correction.landmarks.push_back({window.landmarks[i], problem.points[i]});
  }
  return correction;
}

/// A window that shows little tells the readout alone, as long as all else is as given.
FreeParameters free_parameters(const KnownCalibration& known, bool shows_little) {
  bool is_else_given = true;
  for (std::size_t i = 0; i < known.parameters.size(); ++i) {
    const CalibrationParameter& parameter = known.parameters[i];
    const bool is_given = known.sigma[static_cast<Eigen::Index>(i)] == parameter.prior_sigma;
    is_else_given &= is_given || parameter.group == CalibrationGroup::kReadout;
  }
  if (shows_little && is_else_given) return FreeParameters::kReadout;
  return known.is_always_refined ? FreeParameters::kAll : FreeParameters::kLikely;
}

}  // namespace

BundleWindow choose_window(const Map& map,
                           KeyframeId centre,
                           std::size_t num_keyframes,
                           std::size_t max_fixed) {
  BundleWindow window;
  window.moving = strongest_neighbours(map, centre, num_keyframes - 1);
  window.moving.push_back(centre);
  std::sort(window.moving.begin(), window.moving.end());
  window.landmarks = seen_by(map, window.moving);
  window.fixed = anchors(map, window, max_fixed);
  const KeyframeId root = map.submaps()[map.keyframes().at(centre).submap.value].root;
  if (std::erase(window.moving, root) > 0) window.fixed.push_back(root);
  if (!window.moving.empty()) fix_gauge(window);
  std::sort(window.fixed.begin(), window.fixed.end());
  return window;
}

BundleWindow whole_submap(const Map& map, SubmapId submap) {
  BundleWindow window;
  const KeyframeId root = map.submaps().at(submap.value).root;
  map.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    if (keyframe.submap != submap) return;
    (id == root ? window.fixed : window.moving).push_back(id);
  });
  map.landmarks().for_each([&](LandmarkId id, const Landmark& landmark) {
    if (landmark.submap == submap) window.landmarks.push_back(id);
  });
  if (!window.moving.empty()) fix_gauge(window);
  if (is_held_by_survey(map, submap)) {
    window.moving = keyframes_of(window);
    window.fixed.clear();
  }
  return window;
}

BundleWindow whole_map(const Map& map) {
  BundleWindow window;
  map.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    const bool is_root = id == map.submaps().at(keyframe.submap.value).root;
    const bool is_fixed = is_root && !is_held_by_survey(map, keyframe.submap);
    (is_fixed ? window.fixed : window.moving).push_back(id);
  });
  map.landmarks().for_each([&](LandmarkId id, const Landmark&) { window.landmarks.push_back(id); });
  return window;
}

bool is_supported(const Map& map, const Landmark& landmark) {
  if (num_observers(landmark) >= 2) return true;
  for (const Observation& observation : landmark.observations) {
    const Keyframe& keyframe = map.keyframes().at(observation.keyframe);
    const Measurement measured = measurement_of(
        keyframe, keyframe.rig_from_world, observation.feature, landmark.position_in_world);
    if (measured.inverse_range_sigma > 0.0f) return true;
  }
  return false;
}

WindowAdjustment compute_adjustment(const Map& map,
                                    const BundleWindow& window,
                                    const BundleOptions& options,
                                    const KnownCalibration* known,
                                    const MapCorrection* start,
                                    const InertialEvidence* imu) {
  WindowProblem window_problem = make_problem(map, window, start);
  std::optional<KnownCalibration> calibration;
  if (known) {
    const bool shows_little = map.keyframes().size() < known->min_keyframes;
    calibration = recalibrate(map,
                              window_problem.observations,
                              *known,
                              free_parameters(*known, shows_little),
                              window_problem.problem);
  }
  if (!map.markers().empty() && !window_problem.problem.calibration) {
    const std::vector<KeyframeId> keyframes = keyframes_of(window);
    window_problem.marker_rigs = add_markers(map, keyframes, window_problem.problem);
  }
  if (imu) add_inertial_terms(map, keyframes_of(window), *imu, window_problem.problem);
  if (imu && window_problem.problem.motion->terms.empty()) return {};
  const BundleResult result = adjust_bundle(window_problem.problem, options);
  if (imu && contradicts_imu(window_problem.problem, result)) return {};
  WindowAdjustment adjustment{moves_of(window, window_problem.problem), {}, std::move(calibration)};
  for (std::size_t i = 0; i < window_problem.observations.size(); ++i) {
    if (result.is_outlier[i]) adjustment.outliers.push_back(window_problem.observations[i]);
  }
  return adjustment;
}

std::optional<KnownCalibration> look_for_readout(const Map& map,
                                                 const BundleWindow& window,
                                                 const KnownCalibration& known) {
  const FreeParameters free = free_parameters(known, true);
  if (free != FreeParameters::kReadout || window.moving.empty() || window.landmarks.empty()) {
    return std::nullopt;
  }
  WindowProblem window_problem = make_problem(map, window);
  return recalibrate(map, window_problem.observations, known, free, window_problem.problem);
}

std::vector<LandmarkId> drop_outliers(Map& map,
                                      std::span<const Observation> outliers,
                                      std::span<const LandmarkId> landmarks,
                                      DirtyLandmarks& dirty) {
  for (const auto& [keyframe, feature] : outliers) {
    const Keyframe* observer = map.keyframes().find(keyframe);
    if (!observer || !observer->landmarks[feature].is_valid()) continue;
    dirty.insert(observer->landmarks[feature]);
    map.forget(keyframe, feature);
  }
  std::vector<LandmarkId> erased;
  for (LandmarkId id : landmarks) {
    const Landmark* landmark = map.landmarks().find(id);
    if (!landmark || is_supported(map, *landmark)) continue;
    map.erase_landmark(id);
    dirty.erase(id);
    erased.push_back(id);
  }
  return erased;
}

std::vector<LandmarkId> adjust_window(Map& map,
                                      const BundleWindow& window,
                                      const BundleOptions& options,
                                      DirtyLandmarks& dirty) {
  if (window.moving.empty() || window.landmarks.empty()) return {};
  const WindowAdjustment adjustment = compute_adjustment(map, window, options);
  for (const auto& move : adjustment.correction.keyframes) {
    map.move_keyframe(move.keyframe, move.rig_from_world);
  }
  for (const auto& move : adjustment.correction.landmarks) {
    map.move_landmark(move.landmark, move.position_in_world);
  }
  dirty.insert(window.landmarks.begin(), window.landmarks.end());
  return drop_outliers(map, adjustment.outliers, window.landmarks, dirty);
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/initializer.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "waymark/base/adaptive_threshold.h"
#include "waymark/base/median.h"
#include "waymark/features/feature_geometry.h"
#include "waymark/features/range_precision.h"
#include "waymark/geometry/two_view.h"
#include "waymark/track/matched_pair.h"
#include "waymark/track/search_radius.h"

namespace waymark {
namespace {

/// A gyroscope that contradicts a pair is believed unless its bias, in rad/s, may be why: the more
/// frames pass, the larger biases may. After so many frames it is not believed.
constexpr double kUsualBias = 0.05;
constexpr double kBiasPerFrame = 0.0025;
constexpr int kMaxContradicted = 20;

const Camera& camera_of(const Frame& frame) { return *frame.features->rig->cameras[0].camera; }

/// Primary features whose range has at most this relative standard deviation.
std::vector<std::uint32_t> features_with_range(const Features& features,
                                               double max_relative_sigma) {
  std::vector<std::uint32_t> chosen;
  for (std::uint32_t i = 0; i < features.num_primary; ++i) {
    const std::optional<double> sigma = relative_range_sigma(features, i);
    if (sigma && *sigma < max_relative_sigma) chosen.push_back(i);
  }
  return chosen;
}

/// Features to start a map from. Those with a reliable range, and where the baseline is too short
/// for the scene to have plenty of them, all whose range is finite: an error of sigma pixels in the
/// stereo parallax moves a landmark by sigma * d / b pixels in a view at distance d from the first,
/// b being the baseline, however far the landmark is. So far ones serve to track the first frames
/// as well as near ones, and later views refine them.
std::vector<std::uint32_t> features_to_start_from(const Features& features, std::size_t plenty) {
  std::vector<std::uint32_t> chosen = features_with_range(features, kReliableRangeSigma);
  if (chosen.size() >= plenty) return chosen;
  return features_with_range(features, kFiniteRangeSigma);
}

std::vector<Eigen::Vector2f> pixels_of(const Features& features) {
  std::vector<Eigen::Vector2f> pixels;
  for (std::size_t i = 0; i < features.num_primary; ++i) {
    pixels.emplace_back(features.keypoints[i].x_px, features.keypoints[i].y_px);
  }
  return pixels;
}

/// Median distance of points from the origin.
double median_distance(const std::vector<Eigen::Vector3d>& points) {
  std::vector<double> distances;
  for (const Eigen::Vector3d& point : points) distances.push_back(point.norm());
  return median(distances);
}

FrameReason reason_of(TwoViewStatus status) {
  switch (status) {
    case TwoViewStatus::kTooFewMatches:
      return FrameReason::kTooFewMatches;
    case TwoViewStatus::kTooFewInliers:
      return FrameReason::kTooFewInliers;
    default:  // Ambiguity ends once there is more parallax.
      return FrameReason::kTooLittleParallax;
  }
}

/// The landmarks of a new sub-map, as its last keyframe sees them.
LandmarkSet landmark_set(const NewSubmap& submap) {
  const InitialKeyframe& keyframe = submap.keyframes.back();
  const Eigen::Vector3d centre = keyframe.rig_from_world.origin_in_source();
  LandmarkSet set;
  for (const InitialLandmark& initial : submap.landmarks) {
    const std::uint32_t feature = initial.features.back();
    const Eigen::Vector3d to_camera = centre - initial.position_in_world;
    Landmark landmark;
    landmark.position_in_world = initial.position_in_world;
    landmark.appearance.descriptor = keyframe.features->descriptors[feature];
    landmark.appearance.direction = to_camera.normalized();
    landmark.appearance.size_m = to_camera.norm() * keyframe.features->size_rad[feature];
    set.add(LandmarkId{}, landmark);
  }
  return set;
}

/// How the rig moved in a keyframe of a start, by the nearest of the frames that have a pose.
RigMotion motion_at(const InitialKeyframe& keyframe, const std::vector<InitialKeyframe>& posed) {
  const auto distance_ns = [&](const InitialKeyframe& other) {
    const std::int64_t gap_ns = std::abs(other.timestamp_ns - keyframe.timestamp_ns);
    return gap_ns == 0 ? INT64_MAX : gap_ns;
  };
  const InitialKeyframe& other = *std::ranges::min_element(posed, {}, distance_ns);
  const double seconds = 1e-9 * static_cast<double>(other.timestamp_ns - keyframe.timestamp_ns);
  const Rigid3 other_from_keyframe = other.rig_from_world * keyframe.rig_from_world.inverse();
  const Eigen::Vector<float, 6> rate = (other_from_keyframe.log() / seconds).cast<float>();
  constexpr float kMedianDistance = 1.0f;  // The unit of length of a start.
  return {rate.tail<3>(), rate.head<3>(), 1.0f / kMedianDistance};
}

}  // namespace

double Initializer::search_radius_px(const Frame& frame) const {
  const InitializerOptions& options = options_.initializer;
  return waymark::search_radius_px(camera_of(frame), options.search_radius_px, options.search_part);
}

int Initializer::min_landmarks(const Features& features) const {
  return adaptive_threshold(options_.initializer.min_landmarks, features.num_corners());
}

int Initializer::min_landmarks(const Features& a, const Features& b) const {
  return std::min(min_landmarks(a), min_landmarks(b));
}

std::optional<Initialization> Initializer::add(const Frame& frame) {
  if (!references_.empty() && references_.back().frame.features->rig != frame.features->rig) {
    reset();
  }
  if (static_cast<int>(frame.features->num_primary) < min_landmarks(*frame.features)) {
    reason_ = FrameReason::kNoFeatures;
    return std::nullopt;
  }
  return has_range_ ? start_from_range(frame) : start_from_two_views(frame);
}

std::optional<Initialization> Initializer::start_from_range(const Frame& frame) {
  const Features& features = *frame.features;
  Initialization start;
  start.submap.is_metric = true;
  start.submap.keyframes.push_back({frame.id, frame.timestamp_ns, Rigid3{}, frame.features});
  const Rigid3 world_from_cam = features.rig->cameras[0].cam_from_rig.inverse();
  const auto plenty = static_cast<std::size_t>(options_.initializer.plenty_of_landmarks);
  for (const std::uint32_t i : features_to_start_from(features, plenty)) {
    const Eigen::Vector3d point = features.range_m[i] * features.bearings[i].cast<double>();
    start.submap.landmarks.push_back({world_from_cam * point, {i}});
  }
  if (static_cast<int>(start.submap.landmarks.size()) < min_landmarks(features)) {
    reason_ = FrameReason::kTooFewMatches;
    return std::nullopt;
  }
  reason_ = FrameReason::kNone;
  return start;
}

std::optional<Initialization> Initializer::start_from_two_views(const Frame& frame) {
  reason_ = FrameReason::kTooFewMatches;
  StationaryCamera rest;  // Goes on with the next reference.
  for (Reference& reference : references_) {
    match(reference, frame);
    reference.rest.update(camera_of(frame),
                          *reference.frame.features,
                          *frame.features,
                          reference.matches,
                          options_.stationary);
    if (reference.rest.is_at_rest()) rest = reference.rest;
  }
  std::erase_if(references_, [&](const Reference& reference) {
    return static_cast<int>(reference.matches.size()) <
           min_landmarks(*reference.frame.features, *frame.features);
  });
  for (const Reference& reference : references_) {
    if (!has_moved(reference, frame)) {
      reason_ = FrameReason::kTooLittleParallax;
      continue;
    }
    if (std::optional<Initialization> start = start_from_pair(reference, frame)) {
      reason_ = FrameReason::kNone;
      return start;
    }
  }
  num_contradicted_ += std::exchange(is_contradicted_, false);
  passed_.push_back(frame);
  if (references_.empty() ||
      (frame.id.value - references_.back().frame.id.value >=
           static_cast<std::uint32_t>(options_.initializer.reference_interval) &&
       has_moved(references_.back(), frame))) {
    references_.push_back({frame, pixels_of(*frame.features), {}, rest});
    if (references_.size() > static_cast<std::size_t>(options_.initializer.max_references))
      references_.erase(references_.begin() + 1);
  }
  while (passed_.front().id < references_.front().frame.id || passed_.size() > kMaxPassed) {
    passed_.pop_front();
  }
  return std::nullopt;
}

void Initializer::match(Reference& reference, const Frame& frame) {
  match_near_expected(reference, frame);
  const int enough = min_landmarks(*reference.frame.features, *frame.features);
  if (static_cast<int>(reference.matches.size()) >= enough) return;
  if (expect_turned(reference, frame)) match_near_expected(reference, frame);
}

bool Initializer::expect_turned(Reference& reference, const Frame& frame) {
  if (!reference.frame.image || !frame.image) return false;
  const RotationAlignment turn = rotation_aligner_.align(
      frame.features->rig->cameras[0].camera, *reference.frame.image, *frame.image);
  if (!turn.is_certain()) return false;
  const Features& features = *reference.frame.features;
  const std::size_t count = features.num_primary;
  std::vector<Eigen::Vector3d> bearings;
  for (std::size_t i = 0; i < count; ++i) {
    bearings.push_back(turn.b_from_a * features.bearings[i].cast<double>());
  }
  std::vector<Eigen::Vector2d> pixels(count);
  std::vector<std::uint8_t> is_visible(count);
  camera_of(frame).project(bearings, pixels, is_visible);
  for (std::size_t i = 0; i < count; ++i) {
    if (is_visible[i]) reference.expected_pixels[i] = pixels[i].cast<float>();
  }
  return true;
}

void Initializer::match_near_expected(Reference& reference, const Frame& frame) {
  const auto matches = appearance_.match_near(*reference.frame.features,
                                              reference.expected_pixels,
                                              search_radius_px(frame),
                                              *frame.features,
                                              {.max_distance = 60, .max_ratio = 0.85});
  reference.matches.assign(matches.begin(), matches.end());
  for (const FeatureMatch& match : matches) {
    const Keypoint& keypoint = frame.features->keypoints[match.b];
    reference.expected_pixels[match.a] = {keypoint.x_px, keypoint.y_px};
  }
}

bool Initializer::has_moved(const Reference& reference, const Frame& frame) const {
  const double rest_rad = options_.initializer.rest_px * central_pixel_angle(camera_of(frame));
  const auto moved = [&](const FeatureMatch& match) {
    const Eigen::Vector3f& before = reference.frame.features->bearings[match.a];
    return (frame.features->bearings[match.b] - before).norm() >= rest_rad;
  };
  const int enough = min_landmarks(*reference.frame.features, *frame.features);
  return !reference.rest.is_at_rest() && std::ranges::count_if(reference.matches, moved) >= enough;
}

std::optional<Initialization> Initializer::start_from_pair(const Reference& reference,
                                                           const Frame& frame) {
  std::optional<Initialization> start = try_pair(reference, frame);
  if (!start) return std::nullopt;
  fill(reference, *start);
  if (frame.features->rig->cameras[0].readout_s == 0.0) return start;
  // Again, from what the rolling shutter would have seen at once, now that the motion is known.
  Reference straight = reference;
  straight.frame.features = start->submap.keyframes[0].features;
  auto again =
      try_pair(straight, {frame.id, frame.timestamp_ns, start->submap.keyframes[1].features});
  if (!again) return start;
  fill(straight, *again);
  return again;
}

std::optional<Initialization> Initializer::try_pair(const Reference& reference,
                                                    const Frame& frame) {
  const MatchedBearings bearings(*reference.frame.features, *frame.features, reference.matches);
  TwoViewOptions options;
  options.seed = seed_;
  options.stream = frame.id.value;
  const int enough = min_landmarks(*reference.frame.features, *frame.features);
  options.min_num_points = enough;
  options.min_parallax_rad =
      options_.initializer.min_parallax_px * central_pixel_angle(camera_of(frame));
  const TwoViewResult two_view = estimate_two_view(bearings.view(), options);
  if (!two_view.geometry) {
    reason_ = reason_of(two_view.status);
    return std::nullopt;
  }
  const RefinedPair pair = refine_pair(
      *reference.frame.features, *frame.features, reference.matches, *two_view.geometry);
  if (static_cast<int>(pair.matches.size()) < enough) {
    reason_ = FrameReason::kTooFewInliers;
    return std::nullopt;
  }
  if (num_contradicted_ < kMaxContradicted && frame.contradicts_turn &&
      frame.contradicts_turn(reference.frame.timestamp_ns,
                             pair.b_from_a.rotation,
                             kUsualBias + kBiasPerFrame * num_contradicted_)) {
    is_contradicted_ = true;
    reason_ = FrameReason::kNotVerified;
    return std::nullopt;
  }
  Initialization start;
  const double scale = 1.0 / median_distance(pair.points);
  start.rig_from_world = pair.b_from_a;
  start.rig_from_world.translation *= scale;
  start.submap.keyframes = {
      {reference.frame.id, reference.frame.timestamp_ns, Rigid3{}, reference.frame.features},
      {frame.id, frame.timestamp_ns, start.rig_from_world, frame.features}};
  for (std::size_t i = 0; i < pair.matches.size(); ++i) {
    start.submap.landmarks.push_back(
        {scale * pair.points[i], {pair.matches[i].a, pair.matches[i].b}});
  }
  return start;
}

void Initializer::fill(const Reference& reference, Initialization& start) {
  const LandmarkSet landmarks = landmark_set(start.submap);
  std::vector<InitialKeyframe> posed = start.submap.keyframes;
  start.filled.push_back(
      {reference.frame.id, {KeyframeId{0}, 1.0, Rigid3{}}, reference.frame.features});
  // Each pose is the guess for the next one, from the reference outwards. Where the frames next to
  // the reference were dropped, the way goes back from the end of the pair.
  const bool reaches_reference = passed_.front().id <= reference.frame.id;
  auto middle = passed_.end();
  if (reaches_reference) {
    middle = std::find_if(passed_.begin(), passed_.end(), [&](const Frame& passed) {
      return passed.id >= reference.frame.id;
    });
  }
  const auto try_fill = [&](const Frame& passed, Rigid3& guess) {
    const std::optional<Rigid3> rig_from_world = locate(passed, guess, landmarks);
    if (!rig_from_world) return;
    guess = *rig_from_world;
    start.filled.push_back({passed.id, {KeyframeId{0}, 1.0, *rig_from_world}, passed.features});
    posed.push_back({passed.id, passed.timestamp_ns, *rig_from_world, nullptr});
  };
  Rigid3 guess;
  for (auto it = middle; it != passed_.end(); ++it) {
    if (it->id != reference.frame.id) try_fill(*it, guess);
  }
  guess = reaches_reference ? Rigid3{} : start.rig_from_world;
  for (auto it = middle; it != passed_.begin(); --it) try_fill(*std::prev(it), guess);
  for (InitialKeyframe& keyframe : start.submap.keyframes) {
    keyframe.features = moved(keyframe.features, motion_at(keyframe, posed));
  }
}

std::optional<Rigid3> Initializer::locate(const Frame& frame,
                                          const Rigid3& guess,
                                          const LandmarkSet& landmarks) {
  const ProjectionMatches& matches = projection_.match(*frame.features->rig,
                                                       landmarks,
                                                       *frame.features,
                                                       {},
                                                       guess,
                                                       {.radius_px = search_radius_px(frame) / 2});
  PoseObservations observations;
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    if (matches.features[i] == kNoFeature) continue;
    observations.add(landmarks.positions_in_world[i],
                     frame.features->measurement(matches.features[i]));
  }
  const PoseEstimate estimate =
      optimize_pose(*frame.features->rig, observations, guess, pose_workspace_);
  if (estimate.num_inliers < static_cast<std::size_t>(options_.initializer.min_landmarks / 3))
    return std::nullopt;
  return estimate.rig_from_world;
}

}  // namespace waymark

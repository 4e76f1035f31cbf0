// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/seen_through.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <span>

#include "waymark/image/hamming.h"

namespace waymark {
namespace {

/// Keyframes that must look through a landmark.
constexpr std::uint8_t kMinKeyframes = 3;
/// Landmarks around it that must lie beyond it, in each of them.
constexpr int kMinBeyond = 3;
/// Landmarks in a circle around it, where they are as dense as in the whole image.
constexpr double kAround = 6.0;
/// Between the view of a keyframe and a known one.
constexpr double kMinViewCos = 0.866;
constexpr double kMaxDistanceRatio = 1.5;
/// What lies beyond is so much farther away, and by so many standard deviations.
constexpr double kMinBeyondRatio = 1.1;
constexpr double kMinBeyondSigmas = 3.0;
/// Two features that look more alike may show the same (of 256 bits).
constexpr int kMaxAlikeDistance = 80;

/// What is known of a landmark apart from its place.
struct Known {
  FrameId newest;                                            ///< Of its observers.
  double sigma_m = std::numeric_limits<double>::infinity();  ///< Along the view.
};

/// Of its distance: that of the best range, or one pixel between the two views that are farthest
/// apart.
double distance_sigma(const Map& map, const Landmark& landmark) {
  double inverse_variance = 0.0;
  double max_sine = 0.0;
  double least_across_m = std::numeric_limits<double>::infinity();
  Eigen::Vector3d first = Eigen::Vector3d::Zero();
  for (const Observation& observation : landmark.observations) {
    const Keyframe& keyframe = map.keyframes().at(observation.keyframe);
    const Features& features = *keyframe.features;
    if (observation.feature >= features.num_primary) continue;
    const Eigen::Vector3d to =
        landmark.position_in_world - keyframe.rig_from_world.origin_in_source();
    const double distance = to.norm();
    if (first.isZero()) first = to / distance;
    max_sine = std::max(max_sine, first.cross(to).norm() / distance);
    least_across_m =
        std::min(least_across_m, double{features.size_rad[observation.feature]} * distance);
    const double range_sigma =
        double{features.inverse_range_sigma[observation.feature]} * distance * distance;
    if (range_sigma > 0.0) inverse_variance += 1.0 / (range_sigma * range_sigma);
  }
  const double by_views = max_sine > 0.0 ? max_sine / least_across_m : 0.0;
  return 1.0 / std::sqrt(inverse_variance + by_views * by_views);
}

std::vector<Known> list_known(const Map& map) {
  std::vector<Known> known(map.landmarks().end_id().value);
  map.landmarks().for_each([&](LandmarkId id, const Landmark& landmark) {
    Known& entry = known[id.value];
    entry.newest = FrameId{0};
    for (const Observation& observation : landmark.observations) {
      entry.newest = std::max(entry.newest, map.keyframes().at(observation.keyframe).frame);
    }
    entry.sigma_m = distance_sigma(map, landmark);
  });
  return known;
}

/// Whether a landmark was seen from about where an eye is.
bool is_known_view(const Map& map, const Landmark& landmark, const Eigen::Vector3d& eye) {
  const Eigen::Vector3d to_eye = eye - landmark.position_in_world;
  return std::ranges::any_of(landmark.observations, [&](const Observation& observation) {
    const Eigen::Vector3d to_observer =
        map.keyframes().at(observation.keyframe).rig_from_world.origin_in_source() -
        landmark.position_in_world;
    const double ratio = to_observer.norm() / to_eye.norm();
    return ratio < kMaxDistanceRatio && ratio > 1.0 / kMaxDistanceRatio &&
           to_eye.dot(to_observer) > kMinViewCos * to_eye.norm() * to_observer.norm();
  });
}

/// Landmarks of covisible keyframes that were seen for the last time before a keyframe; ascending.
std::vector<LandmarkId> seen_before(const Map& map, KeyframeId id, std::span<const Known> known) {
  const Keyframe& keyframe = map.keyframes().at(id);
  std::vector<LandmarkId> candidates;
  for (const CovisibilityEdge& edge : map.covisible(id)) {
    const Keyframe& other = map.keyframes().at(edge.keyframe);
    if (other.frame > keyframe.frame) continue;
    for (std::size_t i = 0; i < other.features->num_corners(); ++i) {
      const LandmarkId landmark = other.landmarks[i];
      if (landmark.is_valid() && known[landmark.value].newest < keyframe.frame) {
        candidates.push_back(landmark);
      }
    }
  }
  std::sort(candidates.begin(), candidates.end());
  candidates.erase(std::unique(candidates.begin(), candidates.end()), candidates.end());
  return candidates;
}

/// One keyframe that looks at where landmarks were.
class Look {
 public:
  Look(const Map& map, KeyframeId id, std::span<const Known> known)
      : map_(map),
        known_(known),
        keyframe_(map.keyframes().at(id)),
        eye_(keyframe_.rig_from_world.origin_in_source()) {
    const Camera& camera = *keyframe_.rig->cameras[0].camera;
    const auto end = keyframe_.landmarks.begin() +
                     static_cast<std::ptrdiff_t>(keyframe_.features->num_corners());
    const auto num_seen =
        std::count_if(keyframe_.landmarks.begin(), end, [](LandmarkId l) { return l.is_valid(); });
    radius_px_ = std::sqrt(kAround * camera.width_px() * camera.height_px() /
                           (std::numbers::pi * static_cast<double>(std::max(num_seen, 1L))));
  }

  bool is_through(LandmarkId id, const Eigen::Vector2d& pixel) const {
    const Landmark& landmark = map_.landmarks().at(id);
    const Features& features = *keyframe_.features;
    int num_beyond = 0;
    bool is_through = true;
    features.grid.visit_near(pixel.x(), pixel.y(), radius_px_, [&](std::uint32_t i) {
      if (!is_through || features.is_edge(i) || !is_near(features, i, pixel)) return;
      is_through = hamming_distance(features.descriptors[i], landmark.appearance.descriptor) >
                   kMaxAlikeDistance;
      const LandmarkId other = keyframe_.landmarks[i];
      if (!is_through || !other.is_valid()) return;
      is_through = is_beyond(other, landmark.position_in_world, known_[id.value].sigma_m);
      ++num_beyond;
    });
    return is_through && num_beyond >= kMinBeyond && is_known_view(map_, landmark, eye_);
  }

 private:
  bool is_near(const Features& features,
               std::uint32_t feature,
               const Eigen::Vector2d& pixel) const {
    const Keypoint& keypoint = features.keypoints[feature];
    return std::hypot(features.grid.column_distance_px(keypoint.x_px, pixel.x()),
                      keypoint.y_px - pixel.y()) < radius_px_;
  }

  bool is_beyond(LandmarkId other, const Eigen::Vector3d& position, double sigma_m) const {
    const double distance = (position - eye_).norm();
    const double other_distance = (map_.landmarks().at(other).position_in_world - eye_).norm();
    if (other_distance < kMinBeyondRatio * distance) return false;
    // Of inverse distances, which errors spread evenly, however far away it is.
    const double sigma = sigma_m / (distance * distance);
    const double other_sigma = known_[other.value].sigma_m / (other_distance * other_distance);
    return 1.0 / distance - 1.0 / other_distance >
           kMinBeyondSigmas * std::hypot(sigma, other_sigma);
  }

  const Map& map_;
  const std::span<const Known> known_;
  const Keyframe& keyframe_;
  const Eigen::Vector3d eye_;
  double radius_px_ = 0.0;
};

void look_from(const Map& map,
               KeyframeId id,
               std::span<const Known> known,
               std::span<std::uint8_t> num_through) {
  const Keyframe& keyframe = map.keyframes().at(id);
  const RigCamera& camera = keyframe.rig->cameras[0];
  if (!camera.camera->can_project()) return;
  const std::vector<LandmarkId> candidates = seen_before(map, id, known);
  const Rigid3 cam_from_world = camera.cam_from_rig * keyframe.rig_from_world;
  std::vector<Eigen::Vector3d> points(candidates.size());
  std::vector<Eigen::Vector2d> pixels(candidates.size());
  std::vector<std::uint8_t> is_visible(candidates.size());
  std::ranges::transform(candidates, points.begin(), [&](LandmarkId landmark) {
    return Eigen::Vector3d(cam_from_world * map.landmarks().at(landmark).position_in_world);
  });
  camera.camera->project(points, pixels, is_visible);
  const Look look(map, id, known);
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    std::uint8_t& count = num_through[candidates[i].value];
    if (!is_visible[i] || count >= kMinKeyframes) continue;
    count = static_cast<std::uint8_t>(count + look.is_through(candidates[i], pixels[i]));
  }
}

}  // namespace

std::vector<LandmarkId> find_seen_through(const Map& map) {
  const std::vector<Known> known = list_known(map);
  std::vector<std::uint8_t> num_through(known.size(), 0);
  map.keyframes().for_each(
      [&](KeyframeId id, const Keyframe&) { look_from(map, id, known, num_through); });
  std::vector<LandmarkId> found;
  map.landmarks().for_each([&](LandmarkId id, const Landmark&) {
    if (num_through[id.value] >= kMinKeyframes) found.push_back(id);
  });
  return found;
}

}  // namespace waymark

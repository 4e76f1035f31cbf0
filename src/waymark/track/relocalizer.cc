// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/relocalizer.h"

#include <algorithm>
#include <array>
#include <tuple>
#include <utility>

#include "waymark/marker/square_pose.h"
#include "waymark/track/last_frame.h"

namespace waymark {
namespace {

/// How the search may end, from what is furthest; other reasons come before all of these.
constexpr std::array kEnds = {FrameReason::kNone,
                              FrameReason::kNotVerified,
                              FrameReason::kTooFewInliers,
                              FrameReason::kTooFewMatches};

/// The poses that the markers of a frame leave open.
std::vector<MarkerPose> poses_by_markers(const MarkerObservations& observations,
                                         const Rig& rig,
                                         const Map& map) {
  std::vector<MarkerPose> poses;
  for (const MarkerObservation& observation : observations) {
    if (observation.camera >= rig.cameras.size()) continue;  // One camera of a pair is used.
    for (const MapMarker& marker : map.markers()) {
      if (marker.id != observation.id) continue;
      const Rigid3 world_from_marker = map.world_from_marker(marker);
      const Rigid3 rig_from_cam = rig.cameras[observation.camera].cam_from_rig.inverse();
      for (const Rigid3& cam_from_marker : square_poses(observation, marker.side_m)) {
        poses.push_back({map.submap_of(marker),
                         rig_from_cam * cam_from_marker * world_from_marker.inverse(),
                         world_from_marker.translation});
      }
    }
  }
  return poses;
}

/// Keyframes that look at a marker from nearest to a pose, the nearest first.
std::vector<KeyframeId> keyframes_at(const Map& map, const MarkerPose& pose, std::size_t max_num) {
  const Eigen::Vector3d centre = pose.rig_from_world.origin_in_source();
  const Eigen::Vector3d to_marker = (pose.rig_from_world * pose.marker_in_world).normalized();
  const double range = (pose.marker_in_world - centre).norm();
  std::vector<std::pair<double, KeyframeId>> found;
  map.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    if (keyframe.submap != pose.submap) return;
    const Eigen::Vector3d sees = (keyframe.rig_from_world * pose.marker_in_world).normalized();
    const double away = (keyframe.rig_from_world.origin_in_source() - centre).norm() / range;
    found.push_back({away + (sees - to_marker).norm(), id});
  });
  std::ranges::sort(found);
  std::vector<KeyframeId> keyframes;
  for (const auto& [distance, id] : found) {
    if (keyframes.size() < max_num) keyframes.push_back(id);
  }
  return keyframes;
}

bool is_near(const LastPlace& last,
             const Map& map,
             const LocatedFrame& located,
             double max_moved_part) {
  const Eigen::Vector3d centre = located.rig_from_world.origin_in_source();
  const double moved = (centre - last.rig_from_world.origin_in_source()).norm();
  return moved * median_inverse_range(map, located.rig_from_world, located.landmarks) <
         max_moved_part;
}

}  // namespace

std::optional<LocatedFrame> Relocalizer::locate(const Frame& frame,
                                                const Map& map,
                                                const PlaceIndex& places,
                                                const std::optional<LastPlace>& last) {
  const PlaceQuery query = {
      .max_candidates = static_cast<std::size_t>(options_.max_candidates),
      .is_excluded = [&](const PlaceRow& row) { return !map.keyframes().contains(row.keyframe); }};
  std::vector<KeyframeId> candidates;
  if (last) candidates.push_back(last->keyframe);
  for (const PlaceCandidate& candidate : places.find(frame.features->corner_descriptors(), query)) {
    candidates.push_back(candidate.keyframe);
  }
  return locate_among(frame, map, candidates, last);
}

std::optional<LocatedFrame> Relocalizer::locate_at(const Frame& frame,
                                                   const Map& map,
                                                   const MarkerPose& pose) {
  const std::vector<KeyframeId> near =
      keyframes_at(map, pose, static_cast<std::size_t>(options_.max_near_marker));
  if (near.empty()) return std::nullopt;
  auto place = locator_.locate_near(*frame.features, map, near.front(), pose.rig_from_world);
  if (place && place->frame.num_inliers >= min_inliers_) return std::move(place->frame);
  return locate_among(frame, map, near, LastPlace{near.front(), pose.rig_from_world});
}

std::optional<LocatedFrame> Relocalizer::locate_at_markers(const Frame& frame, const Map& map) {
  if (!frame.find_markers || map.markers().empty()) return std::nullopt;
  std::optional<LocatedFrame> best;
  for (const MarkerPose& pose : poses_by_markers(frame.find_markers(), *frame.features->rig, map)) {
    auto located = locate_at(frame, map, pose);
    if (!located || (best && best->num_inliers >= located->num_inliers)) continue;
    best = std::move(located);
  }
  return best;
}

std::optional<LocatedFrame> Relocalizer::locate_among(const Frame& frame,
                                                      const Map& map,
                                                      std::span<const KeyframeId> candidates,
                                                      const std::optional<LastPlace>& last) {
  std::optional<LocatedFrame> best;
  double best_confidence = 0;
  std::vector<KeyframeId> tried;
  diagnosis_ = {.reason = FrameReason::kNoCandidate};
  for (const KeyframeId candidate : candidates) {
    if (std::ranges::find(tried, candidate) != tried.end()) continue;
    const double min_confidence = last ? 0.0 : options_.min_confidence;
    auto place = locator_.locate(*frame.features, map, candidate, frame.id.value, min_confidence);
    const auto matched = locator_.matched_keyframes();
    tried.insert(tried.end(), matched.begin(), matched.end());
    const bool has_inliers = place && place->frame.num_inliers >= min_inliers_;
    PlaceAttempt attempt = locator_.attempt();
    if (place && !has_inliers) attempt.failure = FrameReason::kTooFewInliers;
    const bool is_believed =
        has_inliers && (place->confidence >= options_.min_confidence ||
                        is_near(*last, map, place->frame, options_.max_moved_part));
    if (has_inliers && !is_believed) attempt.failure = FrameReason::kNotVerified;
    note(attempt);
    if (!is_believed || (best && place->confidence <= best_confidence)) continue;
    best_confidence = place->confidence;
    best = std::move(place->frame);
    if (best_confidence >= options_.certain_confidence) break;
  }
  return best;
}

void Relocalizer::note(const PlaceAttempt& attempt) {
  const auto how_far = [](FrameReason reason, int num_inliers, int num_matches) {
    return std::tuple(kEnds.end() - std::ranges::find(kEnds, reason), num_inliers, num_matches);
  };
  ++diagnosis_.num_candidates;
  if (how_far(attempt.failure, attempt.num_inliers, attempt.num_matches) <
      how_far(diagnosis_.reason, diagnosis_.num_inliers, diagnosis_.num_matches)) {
    return;
  }
  diagnosis_.reason = attempt.failure;
  diagnosis_.num_matches = attempt.num_matches;
  diagnosis_.num_inliers = attempt.num_inliers;
}

}  // namespace waymark

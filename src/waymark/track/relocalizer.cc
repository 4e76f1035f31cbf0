// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/relocalizer.h"

#include <algorithm>
#include <array>
#include <tuple>
#include <utility>

#include "waymark/track/last_frame.h"

namespace waymark {
namespace {

constexpr std::size_t kMaxCandidates = 10;
/// What merely looks alike does not get that far; the other candidates need not be tried.
constexpr double kCertainConfidence = 0.5;
/// How far a rig moves from one frame to the next at most, by the distance of what it sees.
constexpr double kMaxMovedPart = 0.5;

/// How the search may end, from what is furthest; other reasons come before all of these.
constexpr std::array kEnds = {FrameReason::kNone,
                              FrameReason::kNotVerified,
                              FrameReason::kTooFewInliers,
                              FrameReason::kTooFewMatches};

bool is_near(const LastPlace& last, const Map& map, const LocatedFrame& located) {
  const Eigen::Vector3d centre = located.rig_from_world.origin_in_source();
  const double moved = (centre - last.rig_from_world.origin_in_source()).norm();
  return moved * median_inverse_range(map, located.rig_from_world, located.landmarks) <
         kMaxMovedPart;
}

}  // namespace

Relocalizer::Relocalizer(std::shared_ptr<const Rig> rig,
                         const TrackingSettings& settings,
                         std::uint64_t seed)
    : locator_(std::move(rig), seed), min_inliers_(settings.min_inliers) {}

std::optional<LocatedFrame> Relocalizer::locate(const Frame& frame,
                                                const Map& map,
                                                const PlaceIndex& places,
                                                const std::optional<LastPlace>& last) {
  const PlaceQuery query = {
      .max_candidates = kMaxCandidates,
      .is_excluded = [&](const PlaceRow& row) { return !map.keyframes().contains(row.keyframe); }};
  std::vector<KeyframeId> candidates;
  if (last) candidates.push_back(last->keyframe);
  for (const PlaceCandidate& candidate : places.find(frame.features->corner_descriptors(), query)) {
    candidates.push_back(candidate.keyframe);
  }
  return locate_among(frame, map, candidates, last);
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
    const double min_confidence = last ? 0.0 : PlaceLocator::kMinConfidence;
    auto place = locator_.locate(*frame.features, map, candidate, frame.id.value, min_confidence);
    const auto matched = locator_.matched_keyframes();
    tried.insert(tried.end(), matched.begin(), matched.end());
    const bool has_inliers = place && place->frame.num_inliers >= min_inliers_;
    PlaceAttempt attempt = locator_.attempt();
    if (place && !has_inliers) attempt.failure = FrameReason::kTooFewInliers;
    const bool is_believed = has_inliers && (place->confidence >= PlaceLocator::kMinConfidence ||
                                             is_near(*last, map, place->frame));
    if (has_inliers && !is_believed) attempt.failure = FrameReason::kNotVerified;
    note(attempt);
    if (!is_believed || (best && place->confidence <= best_confidence)) continue;
    best_confidence = place->confidence;
    best = std::move(place->frame);
    if (best_confidence >= kCertainConfidence) break;
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

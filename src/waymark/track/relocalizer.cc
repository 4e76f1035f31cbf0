// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/relocalizer.h"

namespace waymark {
namespace {

constexpr std::size_t kMaxCandidates = 10;

}  // namespace

Relocalizer::Relocalizer(std::shared_ptr<const Rig> rig,
                         const TrackingSettings& settings,
                         std::uint64_t seed)
    : locator_(std::move(rig), seed), min_inliers_(settings.min_inliers) {}

std::optional<LocatedFrame> Relocalizer::locate(const Frame& frame,
                                                const Map& map,
                                                const PlaceIndex& places,
                                                std::vector<LandmarkId>& landmarks) {
  reason_ = FrameReason::kNoCandidate;
  PlaceQuery query;
  query.max_candidates = kMaxCandidates;
  query.is_excluded = [&map](const PlaceRow& row) {
    return !map.keyframes().contains(row.keyframe);
  };
  for (const PlaceCandidate& candidate : places.find(frame.features->descriptors, query)) {
    reason_ = FrameReason::kNotVerified;
    const auto place =
        locator_.locate(*frame.features, map, candidate.keyframe, frame.id.value, landmarks);
    if (!place || place->frame.num_inliers < min_inliers_) continue;
    reason_ = FrameReason::kNone;
    return place->frame;
  }
  return std::nullopt;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/relocalizer.h"

#include <algorithm>
#include <utility>

namespace waymark {
namespace {

constexpr std::size_t kMaxCandidates = 10;
/// What merely looks alike does not get that far; the other candidates need not be tried.
constexpr double kCertainConfidence = 0.5;

}  // namespace

Relocalizer::Relocalizer(std::shared_ptr<const Rig> rig,
                         const TrackingSettings& settings,
                         std::uint64_t seed)
    : locator_(std::move(rig), seed), min_inliers_(settings.min_inliers) {}

std::optional<LocatedFrame> Relocalizer::locate(const Frame& frame,
                                                const Map& map,
                                                const PlaceIndex& places,
                                                std::vector<LandmarkId>& landmarks) {
  PlaceQuery query;
  query.max_candidates = kMaxCandidates;
  query.is_excluded = [&map](const PlaceRow& row) {
    return !map.keyframes().contains(row.keyframe);
  };
  const auto candidates = places.find(frame.features->descriptors, query);
  std::optional<LocatedPlace> best;
  matched_.clear();
  for (const PlaceCandidate& candidate : candidates) {
    if (std::find(matched_.begin(), matched_.end(), candidate.keyframe) != matched_.end()) continue;
    const auto place =
        locator_.locate(*frame.features, map, candidate.keyframe, frame.id.value, seen_);
    const auto matched = locator_.matched_keyframes();
    matched_.insert(matched_.end(), matched.begin(), matched.end());
    if (!place || place->frame.num_inliers < min_inliers_) continue;
    if (best && place->confidence <= best->confidence) continue;
    best = place;
    landmarks = seen_;
    if (best->confidence >= kCertainConfidence) break;
  }
  reason_ = best                 ? FrameReason::kNone
            : candidates.empty() ? FrameReason::kNoCandidate
                                 : FrameReason::kNotVerified;
  if (!best) return std::nullopt;
  return best->frame;
}

}  // namespace waymark

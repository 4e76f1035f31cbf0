// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/place_locator.h"

#include <algorithm>
#include <array>
#include <span>
#include <utility>

#include "waymark/base/adaptive_threshold.h"
#include "waymark/optimize/locate.h"
#include "waymark/track/place_confidence.h"

namespace waymark {
std::optional<LocatedPlace> PlaceLocator::locate(const Features& features,
                                                 const Map& map,
                                                 KeyframeId candidate,
                                                 std::uint64_t stream,
                                                 double min_confidence) {
  matched_keyframes_ = strongest_neighbours(
      map, candidate, static_cast<std::size_t>(options_.num_matched_keyframes - 1));
  matched_keyframes_.insert(matched_keyframes_.begin(), candidate);
  std::optional<LocatedPlace> place =
      refine(features, map, candidate, stream, match_by_appearance(features, map));
  if (place && place->confidence < min_confidence) {
    attempt_.failure = FrameReason::kNotVerified;
    return std::nullopt;
  }
  return place;
}

std::optional<LocatedPlace> PlaceLocator::locate_near(const Features& features,
                                                      const Map& map,
                                                      KeyframeId candidate,
                                                      const Rigid3& guess) {
  gather_local_map(map, map.keyframes().at(candidate).landmarks, candidate, local_);
  local_.landmarks.keep_corners();
  std::vector<LandmarkId> landmarks =
      locator_.find(features, local_.landmarks, guess, {.radius_px = options_.guess_radius_px});
  return refine(features, map, candidate, candidate.value, std::move(landmarks));
}

/// The pose that most matches agree on, and with it the landmarks around.
std::optional<LocatedPlace> PlaceLocator::refine(const Features& features,
                                                 const Map& map,
                                                 KeyframeId candidate,
                                                 std::uint64_t stream,
                                                 std::vector<LandmarkId> landmarks) {
  const int num_matches = num_valid(landmarks);
  attempt_ = {FrameReason::kTooFewMatches, num_matches, 0};
  if (num_matches < options_.min_matches) return std::nullopt;
  attempt_.failure = FrameReason::kTooFewInliers;
  std::optional<LocatedFrame> located = find_consensus(features, map, stream, std::move(landmarks));
  if (!located) return std::nullopt;
  const int enough = adaptive_threshold(options_.min_inliers, features.num_corners());
  const std::array<std::pair<double, int>, 2> rounds = {
      {{options_.first_radius_px, enough / 2}, {options_.second_radius_px, enough}}};
  for (const auto& [radius_px, min_inliers] : rounds) {
    gather_local_map(map, primary_landmarks(features, located->landmarks), candidate, local_);
    local_.landmarks.keep_corners();
    const int num_kept = num_valid(std::span(located->landmarks).first(features.num_corners()));
    located = locator_.locate_again(features,
                                    map,
                                    *std::move(located),
                                    local_.landmarks,
                                    {.radius_px = radius_px,
                                     .appearance = {.max_distance = options_.guided_max_distance,
                                                    .max_ratio = options_.max_ratio}});
    attempt_.num_matches += located->num_matches - num_kept;
    attempt_.num_inliers = located->num_inliers;
    if (located->num_inliers < min_inliers) return std::nullopt;
  }
  attempt_.failure = FrameReason::kNone;
  const double confidence = place_confidence(
      features, located->landmarks, map, local_.reference, located->rig_from_world);
  return LocatedPlace{*std::move(located), local_.reference, confidence};
}

std::vector<LandmarkId> PlaceLocator::match_by_appearance(const Features& features,
                                                          const Map& map) {
  matches_.clear();
  for (KeyframeId keyframe : matched_keyframes_) match_keyframe(features, map, keyframe);
  std::sort(matches_.begin(), matches_.end(), [](const LandmarkMatch& a, const LandmarkMatch& b) {
    if (a.distance != b.distance) return a.distance < b.distance;
    return a.feature != b.feature ? a.feature < b.feature : a.landmark < b.landmark;
  });
  std::vector<LandmarkId> landmarks(features.size());
  std::vector<LandmarkId> found;  // Ascending.
  for (const LandmarkMatch& match : matches_) {
    const auto at = std::lower_bound(found.begin(), found.end(), match.landmark);
    const bool is_found = at != found.end() && *at == match.landmark;
    if (is_found || landmarks[match.feature].is_valid()) continue;
    landmarks[match.feature] = match.landmark;
    found.insert(at, match.landmark);
  }
  return landmarks;
}

void PlaceLocator::match_keyframe(const Features& features, const Map& map, KeyframeId id) {
  const Keyframe& keyframe = map.keyframes().at(id);
  with_landmark_.clear();
  for (std::uint32_t i = 0; i < keyframe.features->num_primary; ++i) {
    if (keyframe.landmarks[i].is_valid()) with_landmark_.push_back(i);
  }
  const auto alike = appearance_.match_all(
      *keyframe.features,
      with_landmark_,
      features,
      {.max_distance = options_.max_distance, .max_ratio = options_.max_ratio});
  const auto agreeing = rotation_vote_.agreeing(*keyframe.features, features, alike);
  for (const FeatureMatch& match :
       agreeing.size() >= static_cast<std::size_t>(options_.min_agreeing) ? agreeing : alike) {
    matches_.push_back({match.b, keyframe.landmarks[match.a], match.distance});
  }
}

std::optional<LocatedFrame> PlaceLocator::find_consensus(const Features& features,
                                                         const Map& map,
                                                         std::uint64_t stream,
                                                         std::vector<LandmarkId> landmarks) {
  observations_.clear();
  feature_of_observation_.clear();
  for (std::uint32_t i = 0; i < features.num_primary; ++i) {
    if (!landmarks[i].is_valid()) continue;
    observations_.add(map.landmarks().at(landmarks[i]).position_in_world, features.measurement(i));
    feature_of_observation_.push_back(i);
  }
  RansacOptions ransac_options;
  ransac_options.seed = seed_;
  ransac_options.stream = stream;
  // A sparser consensus would be refused, so that it need not be found.
  ransac_options.min_inlier_ratio = std::max(
      options_.min_inlier_ratio,
      static_cast<double>(options_.min_consensus) / static_cast<double>(observations_.size()));
  const std::optional<PoseEstimate> estimate =
      waymark::locate(*features.rig, observations_, ransac_options, workspace_);
  if (estimate) attempt_.num_inliers = static_cast<int>(estimate->num_inliers);
  if (!estimate || estimate->num_inliers < static_cast<std::size_t>(options_.min_consensus))
    return std::nullopt;
  for (std::size_t k = 0; k < feature_of_observation_.size(); ++k) {
    if (!estimate->is_inlier[k]) landmarks[feature_of_observation_[k]] = LandmarkId{};
  }
  LocatedFrame located;
  located.rig_from_world = estimate->rig_from_world;
  located.landmarks = std::move(landmarks);
  return located;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/place_locator.h"

#include <algorithm>
#include <array>
#include <utility>

#include "waymark/optimize/locate.h"
#include "waymark/track/place_confidence.h"

namespace waymark {
namespace {

/// The candidate and those that share most landmarks with it.
constexpr std::size_t kNumMatchedKeyframes = 3;
/// Of the many landmarks that look alike those remain that agree on how the camera turned, unless
/// so few do that it may be chance: where the scene is near, the parallax differs.
constexpr AppearanceOptions kAppearance = {.max_distance = 60, .max_ratio = 0.9};
constexpr std::size_t kMinAgreeing = 8;
/// Fewer matches, or fewer that agree on a pose, are chance more often than not.
constexpr std::size_t kMinMatches = 20;
constexpr std::size_t kMinConsensus = 15;
constexpr double kMinPlaceInlierRatio = 0.2;
/// The pose of a dozen inliers is off by some pixels, that of a hundred by less than one.
constexpr double kFirstRadiusPx = 12.0;
constexpr double kSecondRadiusPx = 5.0;
/// Where drift or a guess put a pose: five degrees of a lens of 460 px.
constexpr double kGuessRadiusPx = 40.0;
/// Laxer than in tracking: light and cameras may have changed, and a few wrong ones do no harm.
constexpr AppearanceOptions kGuidedAppearance = {.max_distance = 80, .max_ratio = 0.9};
constexpr int kMinInliers = 30;

void collect_strongest_neighbours(const Map& map,
                                  KeyframeId candidate,
                                  std::vector<KeyframeId>& keyframes) {
  std::vector<CovisibilityEdge> edges = map.covisible(candidate);
  std::stable_sort(edges.begin(), edges.end(), [](const auto& a, const auto& b) {
    return a.num_shared > b.num_shared;
  });
  keyframes = {candidate};
  for (const CovisibilityEdge& edge : edges) {
    if (keyframes.size() == kNumMatchedKeyframes) break;
    keyframes.push_back(edge.keyframe);
  }
}

/// The landmarks that primary features show, ascending.
void collect_found(const Features& features,
                   const std::vector<LandmarkId>& landmarks,
                   std::vector<LandmarkId>& found) {
  found.clear();
  for (std::size_t i = 0; i < features.num_primary; ++i) {
    if (landmarks[i].is_valid()) found.push_back(landmarks[i]);
  }
  std::sort(found.begin(), found.end());
}

bool contains(const std::vector<LandmarkId>& ascending, LandmarkId id) {
  return std::binary_search(ascending.begin(), ascending.end(), id);
}

}  // namespace

PlaceLocator::PlaceLocator(std::shared_ptr<const Rig> rig, std::uint64_t seed)
    : rig_(rig), seed_(seed), matcher_(rig), locator_(rig) {}

std::optional<LocatedPlace> PlaceLocator::locate(const Features& features,
                                                 const Map& map,
                                                 KeyframeId candidate,
                                                 std::uint64_t stream,
                                                 std::vector<LandmarkId>& landmarks) {
  collect_strongest_neighbours(map, candidate, matched_keyframes_);
  const std::size_t num_matches = match_by_appearance(features, map, landmarks);
  attempt_ = {FrameReason::kTooFewMatches, static_cast<int>(num_matches), 0};
  if (num_matches < kMinMatches) return std::nullopt;
  std::optional<LocatedPlace> place = refine(features, map, candidate, stream, landmarks);
  if (!place) return std::nullopt;
  if (place->confidence < kMinConfidence) {
    attempt_.failure = FrameReason::kNotVerified;
    return std::nullopt;
  }
  return place;
}

std::optional<LocatedPlace> PlaceLocator::locate_near(const Features& features,
                                                      const Map& map,
                                                      KeyframeId candidate,
                                                      const Rigid3& guess,
                                                      std::vector<LandmarkId>& landmarks) {
  gather_local_map(map, map.keyframes().at(candidate).landmarks, candidate, local_);
  const ProjectionMatches& matches =
      matcher_.match(local_.landmarks, features, {}, guess, {.radius_px = kGuessRadiusPx});
  landmarks.assign(features.size(), LandmarkId{});
  for (std::size_t i = 0; i < local_.landmarks.size(); ++i) {
    if (matches.features[i] != kNoFeature) landmarks[matches.features[i]] = local_.landmarks.ids[i];
  }
  attempt_ = {FrameReason::kTooFewMatches, static_cast<int>(matches.num_matches), 0};
  if (matches.num_matches < kMinMatches) return std::nullopt;
  return refine(features, map, candidate, candidate.value, landmarks);
}

/// The pose that most matches agree on, and with it the landmarks around.
std::optional<LocatedPlace> PlaceLocator::refine(const Features& features,
                                                 const Map& map,
                                                 KeyframeId candidate,
                                                 std::uint64_t stream,
                                                 std::vector<LandmarkId>& landmarks) {
  attempt_.failure = FrameReason::kTooFewInliers;
  const std::optional<Rigid3> consensus = find_consensus(features, map, stream, landmarks);
  if (!consensus) return std::nullopt;
  LocatedPlace place;
  place.frame.rig_from_world = *consensus;
  constexpr std::array<std::pair<double, int>, 2> kRounds = {
      {{kFirstRadiusPx, kMinInliers / 2}, {kSecondRadiusPx, kMinInliers}}};
  for (const auto& [radius_px, min_inliers] : kRounds) {
    collect_found(features, landmarks, found_);
    gather_local_map(map, found_, candidate, local_);
    place.frame = match_around(features, map, place.frame.rig_from_world, radius_px, landmarks);
    attempt_.num_inliers = place.frame.num_inliers;
    if (place.frame.num_inliers < min_inliers) return std::nullopt;
  }
  attempt_.failure = FrameReason::kNone;
  place.reference = local_.reference;
  place.confidence = place_confidence(
      *rig_, features, landmarks, map, place.reference, place.frame.rig_from_world);
  return place;
}

std::size_t PlaceLocator::match_by_appearance(const Features& features,
                                              const Map& map,
                                              std::vector<LandmarkId>& landmarks) {
  matches_.clear();
  for (KeyframeId keyframe : matched_keyframes_) match_keyframe(features, map, keyframe);
  std::sort(matches_.begin(), matches_.end(), [](const LandmarkMatch& a, const LandmarkMatch& b) {
    if (a.distance != b.distance) return a.distance < b.distance;
    return a.feature != b.feature ? a.feature < b.feature : a.landmark < b.landmark;
  });
  landmarks.assign(features.size(), LandmarkId{});
  found_.clear();
  for (const LandmarkMatch& match : matches_) {
    const auto at = std::lower_bound(found_.begin(), found_.end(), match.landmark);
    const bool is_found = at != found_.end() && *at == match.landmark;
    if (is_found || landmarks[match.feature].is_valid()) continue;
    landmarks[match.feature] = match.landmark;
    found_.insert(at, match.landmark);
  }
  return found_.size();
}

void PlaceLocator::match_keyframe(const Features& features, const Map& map, KeyframeId id) {
  const Keyframe& keyframe = map.keyframes().at(id);
  with_landmark_.clear();
  for (std::uint32_t i = 0; i < keyframe.features->num_primary; ++i) {
    if (keyframe.landmarks[i].is_valid()) with_landmark_.push_back(i);
  }
  const auto alike =
      appearance_.match_all(*keyframe.features, with_landmark_, features, kAppearance);
  const auto agreeing = turn_vote_.agreeing(*keyframe.features, features, alike);
  for (const FeatureMatch& match : agreeing.size() >= kMinAgreeing ? agreeing : alike) {
    matches_.push_back({match.b, keyframe.landmarks[match.a], match.distance});
  }
}

std::optional<Rigid3> PlaceLocator::find_consensus(const Features& features,
                                                   const Map& map,
                                                   std::uint64_t stream,
                                                   std::vector<LandmarkId>& landmarks) {
  observations_.clear();
  feature_of_observation_.clear();
  for (std::uint32_t i = 0; i < features.num_primary; ++i) {
    if (!landmarks[i].is_valid()) continue;
    append_observation(
        features, i, map.landmarks().at(landmarks[i]).position_in_world, observations_);
    feature_of_observation_.push_back(i);
  }
  RansacOptions ransac_options;
  ransac_options.seed = seed_;
  ransac_options.stream = stream;
  // A sparser consensus would be refused, so that it need not be found.
  ransac_options.min_inlier_ratio =
      std::max(kMinPlaceInlierRatio,
               static_cast<double>(kMinConsensus) / static_cast<double>(observations_.size()));
  const std::optional<PoseEstimate> estimate =
      waymark::locate(*rig_, observations_, PoseOptions{}, ransac_options, workspace_);
  if (estimate) attempt_.num_inliers = static_cast<int>(estimate->num_inliers);
  if (!estimate || estimate->num_inliers < kMinConsensus) return std::nullopt;
  for (std::size_t k = 0; k < feature_of_observation_.size(); ++k) {
    if (!estimate->is_inlier[k]) landmarks[feature_of_observation_[k]] = LandmarkId{};
  }
  return estimate->rig_from_world;
}

LocatedFrame PlaceLocator::match_around(const Features& features,
                                        const Map& map,
                                        const Rigid3& rig_from_world,
                                        double radius_px,
                                        std::vector<LandmarkId>& landmarks) {
  collect_found(features, landmarks, found_);
  is_taken_.assign(features.num_primary, 0);
  for (std::size_t i = 0; i < features.num_primary; ++i) is_taken_[i] = landmarks[i].is_valid();
  const ProjectionOptions options = {.radius_px = radius_px, .appearance = kGuidedAppearance};
  const ProjectionMatches& matches =
      matcher_.match(local_.landmarks, features, is_taken_, rig_from_world, options);
  for (std::size_t i = 0; i < local_.landmarks.size(); ++i) {
    const LandmarkId id = local_.landmarks.ids[i];
    if (matches.features[i] == kNoFeature || contains(found_, id)) continue;
    landmarks[matches.features[i]] = id;
  }
  return locator_.locate(features, map, rig_from_world, landmarks);
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "waymark/base/frame_state.h"
#include "waymark/map/map.h"
#include "waymark/match/appearance.h"
#include "waymark/match/rotation_vote.h"
#include "waymark/optimize/pose.h"
#include "waymark/track/frame_locator.h"
#include "waymark/track/local_map.h"
#include "waymark/track/options.h"

namespace waymark {

/// A pose found near a keyframe, and what speaks for it.
struct LocatedPlace {
  LocatedFrame frame;
  KeyframeId reference;     ///< Shares most landmarks with the features.
  double confidence = 0.0;  ///< See place_confidence(), of the reference.
};

/// How far the comparison with a place got.
struct PlaceAttempt {
  /// kTooFewMatches, kTooFewInliers or kNotVerified, in this order; kNone of a success.
  FrameReason failure = FrameReason::kTooFewMatches;
  int num_matches = 0;  ///< By looks alone, and beyond these near the pose that they agree on.
  int num_inliers = 0;  ///< Of them.
};

/// Finds out whether features show the surroundings of a keyframe, and from where, without a
/// prediction: match by appearance, RANSAC on three bearings, guided matching, refinement (as in
/// Mur-Artal et al. 2015, V.C). The features may come from another camera model than the
/// keyframe's. Keeps its buffers.
class PlaceLocator {
 public:
  explicit PlaceLocator(std::uint64_t seed, const PlaceOptions& options = {})
      : seed_(seed), options_(options) {}

  /// Nothing unless the pose rests on 30 landmarks with this confidence; all of these are of the
  /// candidate's sub-map. Same seed and stream (the frame, for example), same result.
  std::optional<LocatedPlace> locate(const Features& features,
                                     const Map& map,
                                     KeyframeId candidate,
                                     std::uint64_t stream,
                                     double min_confidence = PlaceOptions{}.min_confidence);

  /// The same where a pose is known already, though too coarsely to look for landmarks one by one:
  /// to within some 5 degrees or a tenth of the depth of the scene. Such a pose says more than
  /// confidence: nothing is demanded of that.
  std::optional<LocatedPlace> locate_near(const Features& features,
                                          const Map& map,
                                          KeyframeId candidate,
                                          const Rigid3& guess);

  /// What became of the last call.
  const PlaceAttempt& attempt() const { return attempt_; }

  /// The keyframes whose landmarks the last locate() began with: the candidate and its strongest
  /// neighbours. Another try from one of them would hardly end otherwise.
  std::span<const KeyframeId> matched_keyframes() const { return matched_keyframes_; }

 private:
  struct LandmarkMatch {
    std::uint32_t feature;
    LandmarkId landmark;
    std::uint16_t distance;
  };

  std::vector<LandmarkId> match_by_appearance(const Features& features, const Map& map);
  std::optional<LocatedPlace> refine(const Features& features,
                                     const Map& map,
                                     KeyframeId candidate,
                                     std::uint64_t stream,
                                     std::vector<LandmarkId> landmarks);
  void match_keyframe(const Features& features, const Map& map, KeyframeId keyframe);
  std::optional<LocatedFrame> find_consensus(const Features& features,
                                             const Map& map,
                                             std::uint64_t stream,
                                             std::vector<LandmarkId> landmarks);

  std::uint64_t seed_;
  const PlaceOptions options_;
  AppearanceMatcher appearance_;
  RotationVote rotation_vote_;
  FrameLocator locator_;
  PoseObservations observations_;
  PoseWorkspace workspace_;
  LocalMap local_;
  std::vector<KeyframeId> matched_keyframes_;
  std::vector<LandmarkMatch> matches_;
  std::vector<std::uint32_t> with_landmark_;
  std::vector<std::uint32_t> feature_of_observation_;
  PlaceAttempt attempt_;
};

}  // namespace waymark

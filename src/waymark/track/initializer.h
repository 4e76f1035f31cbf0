// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "waymark/base/frame_state.h"
#include "waymark/map/messages.h"
#include "waymark/match/appearance.h"
#include "waymark/match/projection.h"
#include "waymark/match/rotation_alignment.h"
#include "waymark/optimize/pose.h"
#include "waymark/track/frame.h"
#include "waymark/track/options.h"
#include "waymark/track/stationary_camera.h"

namespace waymark {

/// A new sub-map and what follows from it for the frames seen meanwhile.
struct Initialization {
  NewSubmap submap;
  Rigid3 rig_from_world;           ///< Of the frame that completed it, its last keyframe.
  std::vector<FilledPose> filled;  ///< References count the keyframes of the sub-map from 0.
};

/// Starts a map: from the first frame with enough depth, or in mono from two views. In mono several
/// earlier frames are kept as references; each new frame is matched to all of them, and the first
/// pair with a well conditioned geometry makes the map, unless a gyroscope contradicts its turn:
/// then most features are on what moves. The frames in between are then located in it, the newest
/// kMaxPassed of them at most: a camera may stand still for any time before it moves.
class Initializer {
 public:
  static constexpr std::size_t kMaxPassed = 300;

  Initializer(bool has_range, std::uint64_t seed, const TrackingOptions& options = {})
      : has_range_(has_range), seed_(seed), options_(options) {}

  /// Frames that were measured by cameras calibrated otherwise than this one are forgotten.
  std::optional<Initialization> add(const Frame& frame);
  /// Forgets the frames added so far.
  void reset() { references_.clear(), passed_.clear(); }
  /// Why the last add() gave nothing.
  FrameReason reason() const { return reason_; }

 private:
  struct Reference {
    Frame frame;
    std::vector<Eigen::Vector2f> expected_pixels;  ///< Where its features were last seen.
    std::vector<FeatureMatch> matches;             ///< With the newest frame.
    StationaryCamera rest = {};                    ///< Since that frame.
  };

  /// Around where a feature was last seen.
  double search_radius_px(const Frame& frame) const;
  /// Of a map that begins.
  int min_landmarks(const Features& features) const;
  /// Of a pair: the image that offers less counts.
  int min_landmarks(const Features& a, const Features& b) const;
  std::optional<Initialization> start_from_range(const Frame& frame);
  std::optional<Initialization> start_from_two_views(const Frame& frame);
  void match(Reference& reference, const Frame& frame);
  void match_near_expected(Reference& reference, const Frame& frame);
  /// Expects the features where the turn of the camera takes them. Whether the images tell it.
  bool expect_turned(Reference& reference, const Frame& frame);
  /// Whether as many features as a map needs moved, and not just before a camera at rest; if not,
  /// the pair has no parallax to look for.
  bool has_moved(const Reference& reference, const Frame& frame) const;
  std::optional<Initialization> start_from_pair(const Reference& reference, const Frame& frame);
  std::optional<Initialization> try_pair(const Reference& reference, const Frame& frame);
  /// Locates the frames between, which also tell how the rig moved in the keyframes.
  void fill(const Reference& reference, Initialization& start);
  std::optional<Rigid3> locate(const Frame& frame,
                               const Rigid3& guess,
                               const LandmarkSet& landmarks);

  bool has_range_;
  std::uint64_t seed_;
  const TrackingOptions options_;
  FrameReason reason_ = FrameReason::kNone;
  AppearanceMatcher appearance_;
  RotationAligner rotation_aligner_;
  ProjectionMatcher projection_;
  PoseWorkspace pose_workspace_;
  std::deque<Reference> references_;
  bool is_contradicted_ = false;  ///< A pair with the newest frame.
  int num_contradicted_ = 0;      ///< Frames whose pairs a gyroscope contradicted.
  std::deque<Frame> passed_;      ///< The newest frames since the oldest reference.
};

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "waymark/map/map.h"
#include "waymark/match/appearance.h"
#include "waymark/match/projection.h"
#include "waymark/optimize/pose.h"
#include "waymark/track/frame_locator.h"
#include "waymark/track/local_map.h"

namespace waymark {

/// A pose found near a keyframe, and what speaks for it.
struct LocatedPlace {
  LocatedFrame frame;
  KeyframeId reference;  ///< Shares most landmarks with the features.
  /// Landmarks around that the features should show at this pose, and those that they do show.
  int num_expected = 0;
  int num_found = 0;

  double found_ratio() const { return num_expected > 0 ? double(num_found) / num_expected : 0.0; }
};

/// Finds out whether features show the surroundings of a keyframe, and from where, without a
/// prediction: match by appearance, RANSAC on three bearings, guided matching, refinement (as in
/// Mur-Artal et al. 2015, V.D). The features may come from another camera model than the
/// keyframe's. Keeps its buffers.
class PlaceLocator {
 public:
  /// rig: the one that sees the features.
  PlaceLocator(std::shared_ptr<const Rig> rig, std::uint64_t seed);

  /// Nothing unless the pose is beyond doubt. landmarks: on success per feature the landmark that
  /// it shows, all of the candidate's sub-map. Same seed and stream (the frame, for example), same
  /// result.
  std::optional<LocatedPlace> locate(const Features& features,
                                     const Map& map,
                                     KeyframeId candidate,
                                     std::uint64_t stream,
                                     std::vector<LandmarkId>& landmarks);

 private:
  struct LandmarkMatch {
    std::uint32_t feature;
    LandmarkId landmark;
    std::uint16_t distance;
  };

  std::size_t match_by_appearance(const Features& features,
                                  const Map& map,
                                  KeyframeId candidate,
                                  std::vector<LandmarkId>& landmarks);
  void match_keyframe(const Features& features, const Map& map, KeyframeId keyframe);
  std::optional<Rigid3> find_consensus(const Features& features,
                                       const Map& map,
                                       std::uint64_t stream,
                                       std::vector<LandmarkId>& landmarks);
  LocatedFrame match_around(const Features& features,
                            const Map& map,
                            const Rigid3& rig_from_world,
                            double radius_px,
                            std::vector<LandmarkId>& landmarks);
  void count_expected(const Features& features,
                      const std::vector<LandmarkId>& landmarks,
                      LocatedPlace& place) const;

  const std::shared_ptr<const Rig> rig_;
  const std::uint64_t seed_;
  AppearanceMatcher appearance_;
  ProjectionMatcher matcher_;
  FrameLocator locator_;
  PoseObservations observations_;
  PoseWorkspace workspace_;
  LocalMap local_;
  std::vector<LandmarkMatch> matches_;
  std::vector<std::uint32_t> with_landmark_;
  std::vector<std::uint32_t> feature_of_observation_;
  std::vector<std::uint8_t> is_taken_;
  std::vector<LandmarkId> found_;  ///< Ascending.
  std::vector<std::uint8_t> is_visible_;
};

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "waymark/map/map.h"
#include "waymark/match/appearance.h"
#include "waymark/match/projection.h"
#include "waymark/optimize/pose.h"
#include "waymark/track/tracking_result.h"

namespace waymark {

/// Where a frame was taken, and the landmarks that say so.
struct LocatedFrame {
  Rigid3 rig_from_world;
  Matrix6d covariance = Matrix6d::Zero();
  int num_matches = 0;  ///< Primary features with a landmark before outliers were removed.
  int num_inliers = 0;  ///< Primary features with a landmark after.
  std::vector<LandmarkId> landmarks;  ///< Per feature, invalid where none.
  std::vector<LandmarkId> visible;    ///< Of the local map: what should be seen from there.
};

/// The result of a frame that was located, but for what the landmarks are and belong to.
void set_located(const LocatedFrame& located, TrackingResult& result);

/// How many features show a landmark.
int num_valid(std::span<const LandmarkId> landmarks);

/// The landmarks that primary features show, in the order of the features.
std::vector<LandmarkId> primary_landmarks(const Features& features,
                                          std::span<const LandmarkId> landmarks);

/// Pose of a frame from the landmarks that its features show. Keeps its buffers.
class FrameLocator {
 public:
  /// landmarks: per feature; primary features have candidates (living in the map). Of these
  /// outliers are cleared.
  LocatedFrame locate(const Features& features,
                      const Map& map,
                      const Rigid3& initial_rig_from_world,
                      std::vector<LandmarkId> landmarks);

  /// The landmark of the set that each feature may show, seen from about this pose. visible: gets
  /// those of the set that should be seen; null: not asked for.
  std::vector<LandmarkId> find(const Features& features,
                               const LandmarkSet& set,
                               const Rigid3& rig_from_world,
                               const ProjectionOptions& options,
                               std::vector<LandmarkId>* visible = nullptr);

  /// The landmark of a keyframe that each feature looks like without doubt, wherever it is in the
  /// image.
  std::vector<LandmarkId> find_alike(const Features& features, const Keyframe& keyframe);

  /// Locates a frame again, with those landmarks of the set in addition that its other features
  /// show, seen from where it was located first. Points on edges are all looked for anew.
  LocatedFrame locate_again(const Features& features,
                            const Map& map,
                            LocatedFrame first,
                            const LandmarkSet& set,
                            const ProjectionOptions& options);

 private:
  void collect(const Features& features, const Map& map, const std::vector<LandmarkId>& landmarks);

  ProjectionMatcher matcher_;
  AppearanceMatcher appearance_;
  PoseObservations observations_;
  std::vector<std::uint32_t> feature_of_observation_;
  std::vector<std::uint8_t> is_taken_;
  PoseWorkspace workspace_;
};

}  // namespace waymark

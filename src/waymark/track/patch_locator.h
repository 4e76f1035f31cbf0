// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "waymark/match/landmark_set.h"
#include "waymark/match/patch_alignment.h"
#include "waymark/track/frame.h"
#include "waymark/track/frame_locator.h"

namespace waymark {

/// Where an image was taken before, as its patches are compared with.
struct LocatedPatches {
  const SmallImage& image;
  const Rigid3& rig_from_world;
};

/// Indices of the landmarks of a set whose distance is known well: that many keyframes see.
std::vector<std::uint32_t> well_known(const LandmarkSet& landmarks, const Map& map);

/// Pose of a frame from the images around landmarks, where corners do not tell: by aligning them
/// directly with those of the frame before. The landmarks that look alike there become features of
/// the frame, so that keyframes, new landmarks and adjustments rest on them as on others.
class PatchLocator {
 public:
  /// around: landmarks that surround the camera; well_known: the indices of those that are tried
  /// first; predicted: the frame's rig_from_world by the motion before. Nothing where the images do
  /// not tell, or the frame has none.
  std::optional<PatchAlignment> align(const LocatedPatches& before,
                                      const LandmarkSet& around,
                                      const std::vector<std::uint32_t>& well_known,
                                      const Frame& frame,
                                      const Rigid3& predicted);

  /// The pose that an alignment of the last call tells.
  static LocatedFrame pose_of(const Rig& rig,
                              const LocatedPatches& before,
                              const PatchAlignment& found);

  /// Adds features that show landmarks around, as aligned in the last call, to a frame and to what
  /// is known of it; but of those whose landmark it shows already.
  void add_features(const PatchAlignment& found,
                    const LandmarkSet& around,
                    Frame& frame,
                    LocatedFrame& located) const;

 private:
  /// Of the landmarks around by their indices.
  std::optional<PatchAlignment> align_some(const LocatedPatches& before,
                                           const std::vector<std::uint32_t>& chosen,
                                           const Frame& frame,
                                           const Rigid3& initial_b_from_a);

  PatchAligner aligner_;
  std::vector<Eigen::Vector3d> points_in_cam_;  ///< When the image before was taken.
  std::vector<Eigen::Vector3d> chosen_points_;
};

}  // namespace waymark

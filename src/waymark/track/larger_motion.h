// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "waymark/camera/rig.h"
#include "waymark/optimize/pose.h"

namespace waymark {

/// Of two motions that landmarks make, that of the world. Where somebody walks before the camera
/// most features may be theirs, and far ones fit any small motion; but the world is large and far:
/// its motion is the one that explains more surface. Keeps its buffers.
class LargerMotion {
 public:
  explicit LargerMotion(std::shared_ptr<const Rig> rig) : rig_(std::move(rig)) {}

  /// The pose by what the first estimate leaves out, if that agrees on one which explains more;
  /// all observations are of camera 0. initial_rig_from_world: where the search begins.
  std::optional<Rigid3> find(const PoseObservations& observations,
                             const Rigid3& initial_rig_from_world,
                             const PoseEstimate& first);

  /// Whether an observation contradicts a pose, even one that is not known well yet.
  bool is_contradicted(const PoseObservations& observations,
                       std::size_t index,
                       const Rigid3& rig_from_world) const;

 private:
  /// Of the landmark in the image, in squared pixels of the level.
  double squared_error(const PoseObservations& observations,
                       std::size_t index,
                       const Rigid3& rig_from_world) const;
  /// About the surface of what is seen as a pose has it, in squared lengths.
  double explained_surface(const PoseObservations& observations, const Rigid3& rig_from_world);

  std::shared_ptr<const Rig> rig_;
  PoseObservations others_;
  PoseWorkspace workspace_;
  std::vector<double> ranges_, sorted_ranges_;
};

}  // namespace waymark

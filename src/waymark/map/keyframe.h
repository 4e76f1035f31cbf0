// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "waymark/base/id.h"
#include "waymark/camera/rig.h"
#include "waymark/geometry/rigid3.h"
#include "waymark/geometry/sim3.h"
#include "waymark/image/features.h"

namespace waymark {

/// A frame that stays in the map.
struct Keyframe {
  FrameId frame;                  ///< Unique in a map: a session that extends one counts on.
  std::int64_t timestamp_ns = 0;  ///< Of its images.
  SubmapId submap;                ///< Whose frame the pose is in.
  Rigid3 rig_from_world;          ///< In metres (map units where the scale is free).
  KeyframeId parent;              ///< In the spanning tree; invalid for the root of a sub-map.
  /// Product of the scale corrections applied to this keyframe's surroundings; poses stored
  /// relative to it are rescaled by how much it changed since.
  double applied_scale = 1.0;
  std::shared_ptr<const Rig> rig;            ///< The cameras that saw it; never null.
  std::shared_ptr<const Features> features;  ///< Never null.
  std::vector<LandmarkId> landmarks;         ///< One per feature, invalid where none.
};

/// How many landmarks two keyframes share.
struct CovisibilityEdge {
  KeyframeId keyframe;           ///< The other one.
  std::uint32_t num_shared = 0;  ///< At least 1.
};

/// Edges of one keyframe, ascending by id.
struct Covisibility {
  std::vector<CovisibilityEdge> edges;  ///< Without the keyframe itself.
};

/// Where an erased keyframe went: poses relative to it are read relative to its heir.
struct KeyframeForwarding {
  KeyframeId heir;          ///< Invalid while the keyframe lives.
  Rigid3 rig_from_heir;     ///< The erased keyframe's rig from the heir's.
  double heir_scale = 1.0;  ///< applied_scale of the heir at that time.
  double scale = 1.0;       ///< That of the erased keyframe.
};

/// Two keyframes that were found to show the same place, and how they lie to each other.
struct LoopEdge {
  KeyframeId from;    ///< The one that was in the map before.
  KeyframeId to;      ///< The one that shows its place again.
  Sim3 to_from_from;  ///< Of the rigs; lengths in the units of the map around `to`.
};

}  // namespace waymark

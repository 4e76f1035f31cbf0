// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <variant>
#include <vector>

#include "waymark/base/id.h"
#include "waymark/geometry/rigid3.h"
#include "waymark/image/features.h"

namespace waymark {

/// A pose by reference: moves when the map is corrected. Read it with Map::rig_from_world.
struct RelativePose {
  KeyframeId reference;
  Rigid3 rig_from_reference;
  double reference_scale = 1.0;  ///< applied_scale of the reference when this was stored.
};

/// How often the tracker should have seen a landmark since the last keyframe, and did.
struct Sighting {
  LandmarkId landmark;
  std::uint32_t num_visible = 0;
  std::uint32_t num_found = 0;
};

/// The tracker asks the mapper to add a frame to the map.
struct NewKeyframe {
  FrameId frame;
  std::int64_t timestamp_ns = 0;
  RelativePose pose;
  std::shared_ptr<const Features> features;
  std::vector<LandmarkId> landmarks;  ///< Per feature, invalid where none.
  std::vector<Sighting> sightings;    ///< Ascending by landmark.
};

/// A point of a new sub-map and the primary feature that sees it in each of its keyframes.
struct InitialLandmark {
  Eigen::Vector3d position_in_world;
  std::vector<std::uint32_t> features;  ///< Per keyframe; kNoFeature where unseen.
};

struct InitialKeyframe {
  FrameId frame;
  std::int64_t timestamp_ns = 0;
  Rigid3 rig_from_world;
  std::shared_ptr<const Features> features;
};

/// The tracker starts a sub-map: one keyframe where there is stereo or depth, else two.
struct NewSubmap {
  bool is_metric = false;
  std::vector<InitialKeyframe> keyframes;
  std::vector<InitialLandmark> landmarks;
};

using MapperMessage = std::variant<NewSubmap, NewKeyframe>;

}  // namespace waymark

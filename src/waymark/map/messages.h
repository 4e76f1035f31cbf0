// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <variant>
#include <vector>

#include "waymark/base/id.h"
#include "waymark/features/features.h"
#include "waymark/geometry/rigid3.h"
#include "waymark/geometry/sim3.h"
#include "waymark/marker/marker.h"

namespace waymark {

/// A pose by reference: moves when the map is corrected. Read it with Map::rig_from_world.
struct RelativePose {
  KeyframeId reference;          ///< The keyframe that it moves with.
  double reference_scale = 1.0;  ///< applied_scale of the reference when this was stored.
  Rigid3 rig_from_reference;     ///< The rig from that of the reference, lengths as they were then.
};

/// A frame that got its pose after the fact.
struct FilledPose {
  FrameId frame;                             ///< Which one.
  RelativePose pose;                         ///< Moves with the map.
  std::shared_ptr<const Features> features;  ///< Never null.
};

/// How often the tracker should have seen a landmark since the last keyframe, and did.
struct LandmarkVisibility {
  LandmarkId landmark;            ///< Which one.
  std::uint32_t num_visible = 0;  ///< Frames in which it should have been seen.
  std::uint32_t num_found = 0;    ///< Frames in which it was.
};

/// The tracker asks the mapper to add a frame to the map.
struct NewKeyframe {
  FrameId frame;                               ///< Which one.
  std::int64_t timestamp_ns = 0;               ///< Of its images.
  RelativePose pose;                           ///< Moves with the map.
  std::shared_ptr<const Features> features;    ///< Never null.
  std::vector<LandmarkId> landmarks;           ///< Per feature, invalid where none.
  std::vector<LandmarkVisibility> visibility;  ///< Ascending by landmark.
  std::shared_ptr<const MarkerObservations> markers = nullptr;  ///< That it sees; null: none.
};

/// A point of a new sub-map and the primary feature that sees it in each of its keyframes.
struct InitialLandmark {
  Eigen::Vector3d position_in_world;    ///< In the frame of the new sub-map.
  std::vector<std::uint32_t> features;  ///< Per keyframe; kNoFeature where unseen.
};

/// A keyframe of a new sub-map.
struct InitialKeyframe {
  FrameId frame;                             ///< Which one.
  std::int64_t timestamp_ns = 0;             ///< Of its images.
  Rigid3 rig_from_world;                     ///< In the frame of the new sub-map.
  std::shared_ptr<const Features> features;  ///< Never null.
  std::shared_ptr<const MarkerObservations> markers = nullptr;  ///< That it sees; null: none.
};

/// The tracker starts a sub-map: one keyframe where there is stereo or depth, else two.
struct NewSubmap {
  bool is_metric = false;                  ///< Whether lengths are in metres.
  std::vector<InitialKeyframe> keyframes;  ///< By time.
  std::vector<InitialLandmark> landmarks;  ///< In no order.
};

/// A part of the map is to be in another frame and other units, as an IMU tells them.
struct SubmapPlacement {
  SubmapId submap;    ///< Which one.
  Sim3 new_from_old;  ///< Of its frames.
};

/// What the tracker sends to the mapper.
using MapperMessage = std::variant<NewSubmap, NewKeyframe>;

}  // namespace waymark

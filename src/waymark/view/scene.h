// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "waymark/view/keyframe_layer.h"
#include "waymark/view/landmark_layer.h"
#include "waymark/view/message.h"
#include "waymark/view/trajectory_layer.h"
#include "waymark/view/update.h"

namespace waymark {

/// What viewers are shown of a session: takes updates in and tells of it in binary messages, as a
/// whole or as differences. A viewer that got the snapshot and all differences since has the same
/// as one that gets a snapshot now.
class Scene {
 public:
  /// Takes the update in. If is_watched, gives what it changes; after a reset: a snapshot.
  std::vector<Message> advance(ViewUpdate& update, bool is_watched);
  /// From `begin` to `end`.
  std::vector<Message> snapshot();

  const Map& map() const { return *map_; }
  std::int64_t start_ns() const { return trajectory_.start_ns(); }

 private:
  void reset();

  std::shared_ptr<const Map> map_ = std::make_shared<const Map>();
  LandmarkLayer landmarks_;
  KeyframeLayer keyframes_;
  TrajectoryLayer trajectory_;
  std::uint32_t generation_ = 0;
};

}  // namespace waymark

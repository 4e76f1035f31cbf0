// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "waymark/camera/rig.h"
#include "waymark/map/map.h"
#include "waymark/view/message.h"

namespace waymark {

/// How a camera is drawn: a pyramid through the corners of its image, or a sphere.
struct CameraShape {
  bool is_sphere = false;
  std::uint32_t rig = 0;
  Eigen::Vector3d position_in_rig = Eigen::Vector3d::Zero();
  /// Unit; top left, top right, bottom right, bottom left. 0 for a sphere.
  std::array<Eigen::Vector3d, 4> corners_in_rig{Eigen::Vector3d::Zero(),
                                                Eigen::Vector3d::Zero(),
                                                Eigen::Vector3d::Zero(),
                                                Eigen::Vector3d::Zero()};
};

/// The shape of a camera of any model. Where the corners of the image show nothing (fisheye), the
/// outermost pixels towards them that do stand for them. The rig is left to the caller.
CameraShape shape_of(const RigCamera& camera);

/// The edges of a keyframe to older ones that are told: the ten strongest of those that share 15
/// landmarks, ascending by id.
std::vector<CovisibilityEdge> strongest_older(const Covisibility& covisibility, KeyframeId id);

/// Tells of the keyframes of a map, their cameras, the edges between them and its sub-maps.
class KeyframeLayer {
 public:
  void reset() { rigs_.clear(); }

  /// What turns one state of a map into a later one.
  void differences(const Map& before,
                   const Map& after,
                   std::int64_t start_ns,
                   std::vector<Message>& messages);
  /// start_ns: when the session began.
  void snapshot(const Map& map, std::int64_t start_ns, std::vector<Message>& messages);

 private:
  std::uint16_t rig_of(const Keyframe& keyframe) const;
  /// Makes known the rigs of all keyframes that are not in `before`; true if there are new ones.
  bool learn_rigs(const Map& before, const Map& after);
  Message encode_cameras() const;
  Message encode(const Map& map, std::span<const KeyframeId> ids, std::int64_t start_ns) const;

  std::vector<std::shared_ptr<const Rig>> rigs_;  ///< Few.
};

}  // namespace waymark

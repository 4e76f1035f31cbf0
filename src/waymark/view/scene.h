// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "waymark/camera/rig.h"
#include "waymark/map/map.h"
#include "waymark/view/message.h"
#include "waymark/view/update.h"

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

inline bool is_same_pose(const Keyframe& a, const Keyframe& b) {
  return a.rig_from_world.translation == b.rig_from_world.translation &&
         a.rig_from_world.rotation.coeffs() == b.rig_from_world.rotation.coeffs();
}

/// Tells of the keyframes of a map, their cameras, the edges between them and its sub-maps.
class KeyframeLayer {
 public:
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

/// Tells of the landmarks of a map: all of them, or the differences between two states of it.
class LandmarkLayer {
 public:
  /// Colours at the features of a frame, which may become a keyframe. Remembers those of the newest
  /// 1000 frames.
  void add_colors(FeatureColors colors);
  /// Gives new landmarks their colours. Before differences() and snapshot() of `after`.
  void color_landmarks(const Map& before, const Map& after);

  /// What turns one state of a map into a later one.
  void differences(const Map& before, const Map& after, std::vector<Message>& messages) const;
  void snapshot(const Map& map, std::vector<Message>& messages) const;

 private:
  using Rgb = std::array<std::uint8_t, 3>;

  Message encode(const Map& map, std::span<const LandmarkId> ids) const;

  std::unordered_map<std::uint32_t, FeatureColors>
      colors_of_frames_;                           ///< By frame; only looked up.
  std::unordered_map<std::uint32_t, Rgb> colors_;  ///< By living landmark; only looked up.
};

/// Tells of the markers of a map: all of them, whenever one is another than before.
class MarkerLayer {
 public:
  void differences(const Map& map, std::vector<Message>& messages);
  void snapshot(const Map& map, std::vector<Message>& messages);

 private:
  Message told_;  ///< Null: none were ever told.
};

/// Half of the piece of its edge that a landmark is drawn as: from its place to either end, in the
/// world; zero for a landmark that is no point on an edge.
Eigen::Vector3d half_of_edge(const Landmark& landmark);

/// Tells of the frames of a session: their poses, which move with the map, and what became of them.
class TrajectoryLayer {
 public:
  std::size_t size() const { return notes_.size(); }
  /// When the first frame came, 0 before.
  std::int64_t start_ns() const { return start_ns_; }
  /// Of the newest frame, in m/s in the frame of its sub-map; see Scene.
  std::optional<Eigen::Vector3d> velocity(const Map& map, SubmapId metric) const;

  /// Takes in new notes and the next state of the map; tells what became new by that.
  void advance(std::span<const FrameSummary> notes,
               const Map& before,
               const Map& after,
               std::vector<Message>& messages);
  void snapshot(const Map& map, std::vector<Message>& messages) const;

 private:
  void take(const FrameSummary& note);
  /// Files a frame under the living keyframe that it moves with, or under pending_.
  void file(std::uint32_t index, const Map& map);
  void follow_keyframes(const Map& before, const Map& after);
  Message encode(std::span<const std::uint32_t> indices, const Map& map) const;

  std::int64_t start_ns_ = 0;
  std::vector<FrameSummary> notes_;                    ///< Ascending by frame.
  std::vector<std::vector<std::uint32_t>> followers_;  ///< By keyframe: indices of notes.
  std::vector<std::uint32_t> pending_;                 ///< Whose keyframe is not in the map yet.
  std::vector<std::uint32_t> changed_;                 ///< Since the last message.
};

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
  /// Of the newest frame, in m/s in the frame of its sub-map, where that is metric: the mean over
  /// about .2 s. Nothing while the camera is lost. metric: a sub-map that is, whatever the map
  /// says.
  std::optional<Eigen::Vector3d> velocity(SubmapId metric = {}) const {
    return trajectory_.velocity(*map_, metric);
  }

 private:
  std::shared_ptr<const Map> map_ = std::make_shared<const Map>();
  LandmarkLayer landmarks_;
  KeyframeLayer keyframes_;
  MarkerLayer markers_;
  TrajectoryLayer trajectory_;
  std::uint32_t generation_ = 0;
};

}  // namespace waymark

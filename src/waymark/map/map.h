// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Keyframes, landmarks, and who sees what. What System and files give is frozen, to be read from
// any thread.
//
//   const std::shared_ptr<const Map> frozen = system.map();
//   frozen->keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
//     const Eigen::Vector3d position = keyframe.rig_from_world.origin_in_source();
//     std::cout << id.value << " at " << position.transpose() << "\n";
//   });
//   frozen->landmarks().for_each([](LandmarkId, const Landmark& landmark) {
//     std::cout << landmark.observations.size() << " keyframes see "
//               << landmark.position_in_world.transpose() << "\n";
//   });

#include <Eigen/Core>
#include <algorithm>
#include <compare>
#include <cstdint>
#include <memory>
#include <memory_resource>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "waymark/base/copy_on_write_table.h"
#include "waymark/base/id.h"
#include "waymark/camera/rig.h"
#include "waymark/features/features.h"
#include "waymark/geometry/rigid3.h"
#include "waymark/geometry/sim3.h"
#include "waymark/marker/marker.h"

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
  std::shared_ptr<const Features> features;  ///< Never null.
  RigMotion motion;                          ///< At its time, as far as it is known.
  std::vector<LandmarkId> landmarks;         ///< One per feature, invalid where none.
  /// Markers that it sees; null where there are none or none were looked for.
  std::shared_ptr<const MarkerObservations> markers = nullptr;

  /// The cameras that measured its features.
  const Rig& rig() const { return *features->rig; }
};

/// A square marker that is known in the map, by where it lies to a keyframe: it moves with that.
struct MapMarker {
  int id = 0;                    ///< Its number within the family.
  double side_m = 0.0;           ///< Of its black square, in metres.
  KeyframeId reference;          ///< May be erased: see Map::world_from_marker().
  double reference_scale = 1.0;  ///< applied_scale of the reference when this was stored.
  Rigid3 marker_from_reference;  ///< From its rig, lengths as they were then.
  /// Where it was surveyed to be in the frame of the map, if so: it holds the map in place.
  std::optional<Rigid3> surveyed_world_from_marker = std::nullopt;
};

/// How many landmarks two keyframes share.
struct CovisibilityEdge {
  KeyframeId keyframe;           ///< The other one.
  std::uint32_t num_shared = 0;  ///< At least 1.
  /// Of the same keyframe, as strong.
  friend bool operator==(const CovisibilityEdge&, const CovisibilityEdge&) = default;
};

/// Edges of one keyframe, ascending by id.
struct Covisibility {
  std::vector<CovisibilityEdge> edges;  ///< Without the keyframe itself.
};

/// Where an erased keyframe went: poses relative to it are read relative to its heir.
struct KeyframeForwarding {
  KeyframeId heir;          ///< May be erased in turn.
  Rigid3 rig_from_heir;     ///< The erased keyframe's rig from the heir's.
  double heir_scale = 1.0;  ///< applied_scale of the heir at that time.
  double scale = 1.0;       ///< That of the erased keyframe.
};

/// Where a merged landmark went.
struct LandmarkForwarding {
  LandmarkId survivor;  ///< May be gone in turn.
  FrameId frame;        ///< Of the newest keyframe when they were merged.
};

/// Two keyframes that were found to show the same place, and how they lie to each other.
struct LoopEdge {
  KeyframeId from;    ///< The one that was in the map before.
  KeyframeId to;      ///< The one that shows its place again.
  Sim3 to_from_from;  ///< Of the rigs; lengths in the units of the map around `to`.
};

/// How a keyframe lay to its parent by what was seen on the way, before any loop moved them: what a
/// loop that bent the map can still be contradicted by.
struct OdometryNode {
  KeyframeId parent;     ///< In the spanning tree then; invalid for a root.
  Sim3 rig_from_parent;  ///< Lengths in the units before any correction, as of loop edges.
  double depth = 1.0;    ///< Median distance of what it saw, in these units.
};

/// A feature of a keyframe that sees a landmark.
struct Observation {
  KeyframeId keyframe;                 ///< That sees the landmark.
  std::uint32_t feature = kNoFeature;  ///< Index in its Features.
  /// By keyframe, then by feature.
  friend constexpr auto operator<=>(const Observation&, const Observation&) = default;
};

/// What a landmark looks like and from where; a pure function of its observations.
struct Appearance {
  /// Of its newest observers' the one with the least median distance to the others.
  Descriptor descriptor{};
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< Mean unit vector towards its observers.
  /// Extent in metres of one pixel of the level it was seen at: distance times size_rad.
  double size_m = 0.0;
  /// Of a point on an edge: a unit vector across it, in the world; zero otherwise.
  Eigen::Vector3d across = Eigen::Vector3d::Zero();
};

/// A point of the map.
struct Landmark {
  SubmapId submap;  ///< Whose frame the position is in.
  /// In metres (map units where the scale is free).
  Eigen::Vector3d position_in_world = Eigen::Vector3d::Zero();
  KeyframeId reference;                   ///< The keyframe it was made from; moves with it.
  std::vector<Observation> observations;  ///< Ascending.
  Appearance appearance;                  ///< Brought up to date by the mapper.
  std::uint32_t num_visible = 0;          ///< Frames in which it should have been seen.
  std::uint32_t num_found = 0;            ///< Frames in which it was.
};

/// Number of distinct keyframes among observations in ascending order.
inline std::size_t num_observers(const Landmark& landmark) {
  std::size_t count = 0;
  KeyframeId last;
  for (const Observation& observation : landmark.observations) {
    count += observation.keyframe != last;
    last = observation.keyframe;
  }
  return count;
}

/// Whether a keyframe is among the observers.
inline bool is_observed_by(const Landmark& landmark, KeyframeId keyframe) {
  const auto first = std::lower_bound(
      landmark.observations.begin(), landmark.observations.end(), Observation{keyframe, 0});
  return first != landmark.observations.end() && first->keyframe == keyframe;
}

/// A connected part of the session's map with its own frame.
struct Submap {
  bool is_metric = false;  ///< False where the scale is free (mono).
  KeyframeId root;         ///< Invalid once joined.
  SubmapId joined_into;    ///< Invalid while it is a part of its own.
};

/// All of a map in plain lists, as files hold it. Covisibility and the observations of the
/// landmarks follow from the landmarks of the keyframes.
struct MapParts {
  /// A keyframe and its id.
  struct StoredKeyframe {
    KeyframeId id;      ///< Of the keyframe.
    Keyframe keyframe;  ///< With its features and the landmarks it sees.
  };
  /// A landmark and its id.
  struct StoredLandmark {
    LandmarkId id;      ///< Of the landmark.
    Landmark landmark;  ///< Without observations.
  };
  /// A keyframe that is gone.
  struct ErasedKeyframe {
    KeyframeId id;                  ///< Its former id.
    KeyframeForwarding forwarding;  ///< Where it went.
  };
  /// A landmark that is gone.
  struct MergedLandmark {
    LandmarkId id;        ///< Its former id.
    LandmarkId survivor;  ///< The one it was merged into.
  };
  /// How a keyframe lay to its parent.
  struct StoredOdometry {
    KeyframeId id;      ///< Of the keyframe, which may be gone.
    OdometryNode node;  ///< As it was noted.
  };
  std::vector<Submap> submaps;                   ///< By id; joined ones stay in the list.
  std::vector<StoredKeyframe> keyframes;         ///< Ascending.
  std::vector<StoredLandmark> landmarks;         ///< Ascending.
  std::vector<ErasedKeyframe> erased_keyframes;  ///< Ascending.
  std::vector<MergedLandmark> merged_landmarks;  ///< Ascending; that are gone.
  std::vector<LoopEdge> loop_edges;              ///< As Map::measured_loop_edges() gives them.
  std::vector<StoredOdometry> odometry;          ///< Ascending.
  std::vector<MapMarker> markers;                ///< By number.
  KeyframeId end_keyframe;                       ///< One past the largest id ever given.
  LandmarkId end_landmark;                       ///< The same.
};

/// The map of a session: a value with one owner, changed through its mutators only, which keep both
/// sides of every association and the covisibility counts in step.
///
/// References obtained from the map stay valid until the next freeze(), but an edit may leave them
/// at the old value: collect ids first, then edit.
class Map {
 public:
  /// So many frames after a merge nobody holds the id of what was merged: it covers the frames that
  /// the trajectory's memory finds again, which are the longest to wait.
  static constexpr std::uint32_t kRemembersMerged = 2000;

  Map() = default;
  /// Takes everything over; what is left may only be assigned to or destroyed.
  Map(Map&&) noexcept = default;
  Map& operator=(Map&&) noexcept = default;  ///< As the constructor.

  /// The map that was taken apart. Ids must ascend below their ends, features and rigs be there;
  /// of whatever else is wrong, list_broken_invariants() tells.
  static Map restore(MapParts parts);

  /// Editable map that starts as a frozen one, which stays valid and unchanged.
  static Map thaw(const Map& frozen);

  /// Immutable copy that shares all unchanged pages; takes microseconds.
  std::shared_ptr<const Map> freeze();

  /// The living keyframes, by id.
  const CopyOnWriteTable<KeyframeId, Keyframe>& keyframes() const { return keyframes_; }
  /// The living landmarks, by id.
  const CopyOnWriteTable<LandmarkId, Landmark>& landmarks() const { return landmarks_; }
  /// All sub-maps by id, joined ones, too.
  const std::vector<Submap>& submaps() const { return submaps_; }
  /// Covisible keyframes of a living keyframe, ascending by id.
  const std::vector<CovisibilityEdge>& covisible(KeyframeId id) const {
    return covisibility_.at(id).edges;
  }
  /// Covisible keyframes of every living keyframe.
  const CopyOnWriteTable<KeyframeId, Covisibility>& covisibility() const { return covisibility_; }
  /// Where each keyframe that is gone went.
  const CopyOnWriteTable<KeyframeId, KeyframeForwarding>& keyframe_forwarding() const {
    return keyframe_forwarding_;
  }
  /// What landmarks were merged into, for at least kRemembersMerged frames after that.
  const CopyOnWriteTable<LandmarkId, LandmarkForwarding>& landmark_forwarding() const {
    return landmark_forwarding_;
  }
  /// The landmark that an id stands for now, through merges; invalid if erased or merged long ago.
  LandmarkId resolve(LandmarkId id) const;
  /// The sub-map that an id stands for now, through joins.
  SubmapId resolve(SubmapId id) const;
  /// Places seen again, in the order they were found, as measured then and in the units of now.
  std::vector<LoopEdge> loop_edges() const;
  /// The same, lengths in the units before any correction. For writers of files.
  const std::vector<LoopEdge>& measured_loop_edges() const { return loop_edges_; }
  /// Where keyframes lay before any loop moved them, as far as it was noted; of erased ones, too.
  const CopyOnWriteTable<KeyframeId, OdometryNode>& odometry() const { return odometry_; }
  /// The markers that hold the map in metres, by number; one may be there once per sub-map.
  const std::vector<MapMarker>& markers() const { return markers_; }
  /// Where a marker is, in metres in the frame of its sub-map.
  Rigid3 world_from_marker(const MapMarker& marker) const {
    return rig_from_world(marker.reference, marker.marker_from_reference, marker.reference_scale)
        .inverse();
  }
  /// The sub-map that a marker is in.
  SubmapId submap_of(const MapMarker& marker) const {
    return keyframes_.at(resolve(marker.reference)).submap;
  }
  /// Whether a keyframe is an end of a loop edge.
  bool has_loop_edge(KeyframeId id) const;
  /// Pose of a rig that was stored relative to a keyframe: the rig from the world as of now.
  /// scale_then is the keyframe's applied_scale when rig_from_keyframe was stored.
  Rigid3 rig_from_world(KeyframeId reference,
                        const Rigid3& rig_from_keyframe,
                        double scale_then) const;
  /// New by old lengths around a keyframe since its applied_scale was scale_then.
  double scale_since(KeyframeId reference, double scale_then) const;
  /// The living keyframe that stands for a possibly erased one.
  KeyframeId resolve(KeyframeId id) const;

  /// Features that come in from now on are copied into this memory; null: they stay where they are.
  /// Frozen copies share what there is; maps thawed or restored start without.
  void keep_features_in(std::shared_ptr<std::pmr::memory_resource> memory) {
    feature_memory_ = std::move(memory);
  }
  /// Adds an empty sub-map.
  SubmapId add_submap(bool is_metric);
  /// Adds a keyframe without observations; the first of a sub-map becomes its root.
  KeyframeId add_keyframe(Keyframe keyframe);
  /// Adds a landmark without observations. reference is a living keyframe of the sub-map.
  LandmarkId add_landmark(SubmapId submap,
                          const Eigen::Vector3d& position_in_world,
                          KeyframeId reference);
  /// Associates a free feature with a landmark. Who sees one that nobody sees is its reference.
  void observe(KeyframeId keyframe, std::uint32_t feature, LandmarkId landmark);
  /// Removes one association. The landmark stays, even without observations.
  void forget(KeyframeId keyframe, std::uint32_t feature);
  /// Moves the observations of one landmark to another, which survives; where a keyframe already
  /// sees the survivor, the absorbed one's feature is freed.
  void merge_landmarks(LandmarkId survivor, LandmarkId absorbed);
  /// Erases a landmark with its observations.
  void erase_landmark(LandmarkId id);
  /// Erases a keyframe that is neither a root nor in a loop edge, its observations and the
  /// landmarks only it saw.
  void erase_keyframe(KeyframeId id);
  /// Sets the pose of a keyframe; the landmarks stay where they are.
  void move_keyframe(KeyframeId id, const Rigid3& rig_from_world);
  /// Takes the same features of a keyframe as a rig measures them that is calibrated otherwise.
  void recompute_keyframe(KeyframeId id, std::shared_ptr<const Features> features);
  /// Notes how the rig moved at a keyframe; its features stay as they are.
  void set_motion(KeyframeId id, const RigMotion& motion) { keyframes_.edit(id).motion = motion; }
  /// Sets the markers that a keyframe sees; null: none.
  void observe_markers(KeyframeId id, std::shared_ptr<const MarkerObservations> markers) {
    keyframes_.edit(id).markers = std::move(markers);
  }
  /// Takes the place of all markers there were.
  void set_markers(std::vector<MapMarker> markers) { markers_ = std::move(markers); }
  /// Notes that lengths around a keyframe were multiplied by a factor.
  void rescale_keyframe(KeyframeId id, double factor);
  /// Adds an edge between two living keyframes, measured in the units of now.
  void add_loop_edge(const LoopEdge& edge);
  /// Drops loop edges: is_kept has 1 or 0 per loop edge, in their order.
  void drop_loop_edges(std::span<const std::uint8_t> is_kept);
  /// Notes where a keyframe lies, once for each: see odometry().
  void note_odometry(KeyframeId id, const OdometryNode& node) { odometry_.put(id, node); }
  /// What belongs to one sub-map belongs to another from now on, and nothing moves: `child` of the
  /// first becomes its root and hangs below `parent` of the second.
  void join_submaps(KeyframeId child, KeyframeId parent);
  /// Sets the position of a landmark, in the frame of its sub-map.
  void move_landmark(LandmarkId id, const Eigen::Vector3d& position_in_world);
  /// Sets what a landmark looks like.
  void set_appearance(LandmarkId id, const Appearance& appearance);
  /// Adds to the counts of how often a landmark should have been and was seen.
  void count_visibility(LandmarkId id, std::uint32_t num_visible, std::uint32_t num_found);

  /// Recomputes everything derived from scratch; empty if sound, else what is wrong first.
  std::string broken_invariants() const;
  /// Everything that is wrong, a line each, up to so many.
  std::vector<std::string> list_broken_invariants(std::size_t max_count) const;

 private:
  /// Drops what was merged so long ago that nobody asks any more.
  void forget_old_merges();
  void change_covisibility(KeyframeId a, KeyframeId b, int change);
  std::shared_ptr<const Features> kept(std::shared_ptr<const Features> features) const;
  /// From scratch; what is associated but not there is passed over.
  CopyOnWriteTable<KeyframeId, Covisibility> count_covisibility() const;

  CopyOnWriteTable<KeyframeId, Keyframe> keyframes_;
  CopyOnWriteTable<LandmarkId, Landmark> landmarks_;
  CopyOnWriteTable<KeyframeId, Covisibility> covisibility_;
  CopyOnWriteTable<KeyframeId, KeyframeForwarding> keyframe_forwarding_;
  CopyOnWriteTable<LandmarkId, LandmarkForwarding> landmark_forwarding_;
  CopyOnWriteTable<KeyframeId, OdometryNode> odometry_;
  std::shared_ptr<std::pmr::memory_resource> feature_memory_;  ///< Null: where they come from.
  FrameId newest_frame_{0};                                    ///< Of all keyframes that ever were.
  std::vector<Submap> submaps_;
  std::vector<LoopEdge> loop_edges_;        ///< Lengths in the units before any correction.
  std::vector<MapMarker> markers_;          ///< By number.
  std::shared_ptr<const Map> last_frozen_;  ///< Keeps references alive until the next freeze().
};

/// Whether all sub-maps have a scale in metres.
bool is_metric(const Map& map);

/// Keyframes most covisible with one, at most max_count, most shared landmarks first; of equal ones
/// the younger first.
std::vector<KeyframeId> strongest_neighbours(const Map& map,
                                             KeyframeId keyframe,
                                             std::size_t max_count);

/// The sub-maps that have keyframes, that with most of them first, of equal ones the older.
std::vector<SubmapId> submaps_by_size(const Map& map);

}  // namespace waymark

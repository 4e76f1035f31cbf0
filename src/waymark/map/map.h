// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "waymark/base/cow_table.h"
#include "waymark/map/keyframe.h"
#include "waymark/map/landmark.h"

namespace waymark {

/// A connected part of the session's map with its own frame.
struct Submap {
  bool is_metric = false;  ///< False where the scale is free (mono).
  KeyframeId root;         ///< Invalid once joined.
  SubmapId joined_into;    ///< Invalid while it is a part of its own.
};

/// The map of a session: a value with one owner, changed through its mutators only, which keep both
/// sides of every association and the covisibility counts in step.
///
/// References obtained from the map stay valid until the next freeze(), but an edit may leave them
/// at the old value: collect ids first, then edit.
class Map {
 public:
  Map() = default;
  Map(Map&&) noexcept = default;
  Map& operator=(Map&&) noexcept = default;

  /// Immutable copy that shares all unchanged pages; takes microseconds.
  std::shared_ptr<const Map> freeze();

  const CowTable<KeyframeId, Keyframe>& keyframes() const { return keyframes_; }
  const CowTable<LandmarkId, Landmark>& landmarks() const { return landmarks_; }
  const std::vector<Submap>& submaps() const { return submaps_; }
  /// Covisible keyframes of a living keyframe, ascending by id.
  const std::vector<CovisibilityEdge>& covisible(KeyframeId id) const {
    return covisibility_.at(id).edges;
  }
  /// The landmark that an id stands for now, through merges; invalid if erased.
  LandmarkId resolve(LandmarkId id) const;
  /// The sub-map that an id stands for now, through joins.
  SubmapId resolve(SubmapId id) const;
  /// Places seen again, in the order they were found, as measured then and in the units of now.
  std::vector<LoopEdge> loop_edges() const;
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

  SubmapId add_submap(bool is_metric);
  /// Adds a keyframe without observations; the first of a sub-map becomes its root.
  KeyframeId add_keyframe(Keyframe keyframe);
  LandmarkId add_landmark(SubmapId submap,
                          const Eigen::Vector3d& position_in_world,
                          KeyframeId reference);
  /// Associates a free feature with a landmark.
  void observe(KeyframeId keyframe, std::uint32_t feature, LandmarkId landmark);
  /// Removes one association. The landmark stays, even without observations.
  void forget(KeyframeId keyframe, std::uint32_t feature);
  /// Moves the observations of one landmark to another, which survives; where a keyframe already
  /// sees the survivor, the absorbed one's feature is freed.
  void merge_landmarks(LandmarkId survivor, LandmarkId absorbed);
  void erase_landmark(LandmarkId id);
  /// Erases a keyframe that is neither a root nor in a loop edge, its observations and the
  /// landmarks only it saw.
  void erase_keyframe(KeyframeId id);
  void move_keyframe(KeyframeId id, const Rigid3& rig_from_world);
  /// Notes that lengths around a keyframe were multiplied by a factor.
  void rescale_keyframe(KeyframeId id, double factor);
  void add_loop_edge(const LoopEdge& edge);
  /// What belongs to one sub-map belongs to another from now on, and nothing moves: `child` of the
  /// first becomes its root and hangs below `parent` of the second.
  void join_submaps(KeyframeId child, KeyframeId parent);
  void move_landmark(LandmarkId id, const Eigen::Vector3d& position_in_world);
  void set_appearance(LandmarkId id, const Appearance& appearance);
  /// Adds to the counts of how often a landmark should have been and was seen.
  void count_sightings(LandmarkId id, std::uint32_t num_visible, std::uint32_t num_found);

  /// Recomputes everything derived from scratch; empty if sound, else what is wrong.
  std::string broken_invariants() const;

 private:
  void change_covisibility(KeyframeId a, KeyframeId b, int change);

  CowTable<KeyframeId, Keyframe> keyframes_;
  CowTable<LandmarkId, Landmark> landmarks_;
  CowTable<KeyframeId, Covisibility> covisibility_;
  CowTable<KeyframeId, KeyframeForwarding> keyframe_forwarding_;
  CowTable<LandmarkId, LandmarkId> landmark_forwarding_;
  std::vector<Submap> submaps_;
  std::vector<LoopEdge> loop_edges_;        ///< Lengths in the units before any correction.
  std::shared_ptr<const Map> last_frozen_;  ///< Keeps references alive until the next freeze().
};

}  // namespace waymark

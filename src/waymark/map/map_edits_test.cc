// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// All mutators of the map in random order, with frozen copies taken in between.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "waymark/base/rng.h"
#include "waymark/map/correction.h"
#include "waymark/map/map.h"
#include "waymark/map/parts.h"

namespace waymark {
namespace {

constexpr std::uint32_t kNumFeatures = 30;

void write(std::ostream& out, const Rigid3& pose) { out << pose.matrix().format({17, 0}) << '\n'; }

/// All that a map holds, to the last bit, as text.
std::string content_of(const Map& map) {
  std::ostringstream out;
  out.precision(17);
  for (const Submap& submap : map.submaps()) {
    out << submap.is_metric << ' ' << submap.root.value << ' ' << submap.joined_into.value << '\n';
  }
  map.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    out << "keyframe " << id.value << ' ' << keyframe.frame.value << ' ' << keyframe.submap.value
        << ' ' << keyframe.parent.value << ' ' << keyframe.applied_scale << '\n';
    write(out, keyframe.rig_from_world);
    for (const LandmarkId landmark : keyframe.landmarks) out << landmark.value << ' ';
    for (const auto& [other, shared] : map.covisible(id))
      out << other.value << ':' << shared << ' ';
  });
  map.landmarks().for_each([&](LandmarkId id, const Landmark& landmark) {
    out << "landmark " << id.value << ' ' << landmark.submap.value << ' '
        << landmark.position_in_world.transpose() << ' ' << landmark.reference.value << ' '
        << landmark.appearance.descriptor[0] << ' ' << landmark.appearance.size_m << ' '
        << landmark.num_visible << ' ' << landmark.num_found << '\n';
    for (const auto& [keyframe, feature] : landmark.observations) {
      out << keyframe.value << ':' << feature << ' ';
    }
  });
  map.keyframe_forwarding().for_each([&](KeyframeId id, const KeyframeForwarding& forwarding) {
    out << id.value << '>' << forwarding.heir.value << ' ' << forwarding.scale << '\n';
    write(out, forwarding.rig_from_heir);
  });
  map.landmark_forwarding().for_each([&](LandmarkId id, const LandmarkForwarding& forwarding) {
    out << id.value << '>' << forwarding.survivor.value << ' ';
  });
  map.odometry().for_each([&](KeyframeId id, const OdometryNode& node) {
    out << id.value << " below " << node.parent.value << ' ' << node.depth << ' '
        << node.rig_from_parent.scale << ' ' << node.rig_from_parent.translation.transpose()
        << '\n';
  });
  for (const LoopEdge& edge : map.measured_loop_edges()) {
    out << edge.from.value << '-' << edge.to.value << ' ' << edge.to_from_from.scale << '\n';
  }
  return out.str();
}

enum class Edit {
  kAddSubmap,
  kAddKeyframe,
  kAddLandmark,
  kObserve,
  kForget,
  kMergeLandmarks,
  kEraseLandmark,
  kEraseKeyframe,
  kMoveKeyframe,
  kRescaleKeyframe,
  kAddLoopEdge,
  kDropLoopEdges,
  kNoteOdometry,
  kJoinSubmaps,
  kMoveLandmark,
  kSetAppearance,
  kCountObservations,
  kCorrect,
  kNumEdits
};

/// Tries edits of all kinds at random and counts those that the map allowed.
class RandomEditor {
 public:
  explicit RandomEditor(std::uint64_t seed) : rng_(seed, 0) { add_keyframe(map.add_submap(true)); }

  void step() {
    keyframes_.clear();
    landmarks_.clear();
    map.keyframes().for_each([&](KeyframeId id, const Keyframe&) { keyframes_.push_back(id); });
    map.landmarks().for_each([&](LandmarkId id, const Landmark&) { landmarks_.push_back(id); });
    // What makes a map grow and tie together is tried more often.
    static constexpr std::array kOften = {
        Edit::kAddKeyframe, Edit::kAddLandmark, Edit::kObserve, Edit::kObserve, Edit::kObserve};
    const std::uint32_t draw = rng_.below(static_cast<std::uint32_t>(Edit::kNumEdits) + 15);
    const auto edit = draw < static_cast<std::uint32_t>(Edit::kNumEdits)
                          ? static_cast<Edit>(draw)
                          : kOften[draw % kOften.size()];
    num_done[static_cast<std::size_t>(edit)] += apply(edit);
  }

  Map map;
  std::array<int, static_cast<std::size_t>(Edit::kNumEdits)> num_done{};

 private:
  bool apply(Edit edit) {
    const KeyframeId keyframe = pick(keyframes_);
    if (edit <= Edit::kAddKeyframe || landmarks_.empty()) return grow(edit, keyframe);
    const LandmarkId landmark = pick(landmarks_);
    if (edit <= Edit::kEraseKeyframe) return associate(edit, keyframe, landmark);
    if (edit <= Edit::kJoinSubmaps) return tie(edit, keyframe, pick(keyframes_));
    return change(edit, keyframe, landmark);
  }

  bool grow(Edit edit, KeyframeId parent) {
    if (edit == Edit::kAddLandmark) return add_landmark(parent);
    // Few sub-maps at a time, so that those there are grow.
    if (edit == Edit::kAddSubmap && rng_.below(8) != 0) return false;
    if (edit == Edit::kAddSubmap) {
      add_keyframe(map.add_submap(true));
    } else {
      add_keyframe(map.keyframes().at(parent).submap, parent);
    }
    return true;
  }

  bool associate(Edit edit, KeyframeId keyframe, LandmarkId landmark) {
    const std::uint32_t feature = rng_.below(kNumFeatures);
    const bool is_free = !map.keyframes().at(keyframe).landmarks[feature].is_valid();
    const SubmapId submap = map.landmarks().at(landmark).submap;
    const LandmarkId other = pick(landmarks_);
    switch (edit) {
      case Edit::kAddLandmark:
        return add_landmark(keyframe);
      case Edit::kObserve:
        if (!is_free || map.keyframes().at(keyframe).submap != submap) return false;
        return map.observe(keyframe, feature, landmark), true;
      case Edit::kForget:
        if (is_free) return false;
        return map.forget(keyframe, feature), true;
      case Edit::kMergeLandmarks:
        if (other == landmark || map.landmarks().at(other).submap != submap) return false;
        map.merge_landmarks(landmark, other);
        EXPECT_EQ(map.resolve(other), landmark);
        return true;
      case Edit::kEraseLandmark:
        return map.erase_landmark(landmark), true;
      default: {
        const bool is_root = !map.keyframes().at(keyframe).parent.is_valid();
        if (is_root || map.has_loop_edge(keyframe) || rng_.below(2) == 0) return false;
        return map.erase_keyframe(keyframe), true;
      }
    }
  }

  bool tie(Edit edit, KeyframeId a, KeyframeId b) {
    const bool is_one_part = map.keyframes().at(a).submap == map.keyframes().at(b).submap;
    switch (edit) {
      case Edit::kMoveKeyframe:
        return map.move_keyframe(a, random_pose()), true;
      case Edit::kRescaleKeyframe:
        return map.rescale_keyframe(a, 0.5 + rng_.uniform()), true;
      case Edit::kAddLoopEdge:
        if (a == b || !is_one_part || rng_.below(4) != 0) return false;
        return map.add_loop_edge({a, b, Sim3(random_pose())}), true;
      case Edit::kDropLoopEdges:
        return drop_loop_edges();
      case Edit::kNoteOdometry:
        if (map.odometry().contains(a)) return false;
        return map.note_odometry(a, {KeyframeId{a.value - 1}, Sim3(random_pose())}), true;
      default:
        if (is_one_part) return false;
        return map.join_submaps(a, b), true;
    }
  }

  bool drop_loop_edges() {
    std::vector<LoopEdge> edges = map.measured_loop_edges();
    if (edges.size() < 2) return false;
    std::vector<std::uint8_t> is_kept(edges.size(), 1);
    const std::uint32_t dropped = rng_.below(static_cast<std::uint32_t>(edges.size()));
    is_kept[dropped] = 0;
    map.drop_loop_edges(is_kept);
    edges.erase(edges.begin() + dropped);
    EXPECT_TRUE(std::ranges::equal(
        edges, map.measured_loop_edges(), [](const LoopEdge& one, const LoopEdge& other) {
          return one.from == other.from && one.to == other.to &&
                 one.to_from_from.translation == other.to_from_from.translation;
        }));
    return true;
  }

  bool change(Edit edit, KeyframeId keyframe, LandmarkId landmark) {
    switch (edit) {
      case Edit::kMoveLandmark:
        return map.move_landmark(landmark, random_point()), true;
      case Edit::kSetAppearance:
        return map.set_appearance(landmark, {{rng_.next()}, random_point(), 0.1}), true;
      case Edit::kCountObservations:
        return map.count_visibility(landmark, 2, 1), true;
      default:
        apply_correction(map, {{{keyframe, random_pose(), 1.5}}, {{landmark, random_point()}}});
        return true;
    }
  }

  void add_keyframe(SubmapId submap, KeyframeId parent = {}) {
    auto features = std::make_shared<Features>();
    features->rig = rig_;
    features->keypoints.resize(kNumFeatures);
    features->num_primary = kNumFeatures;
    Keyframe keyframe;
    keyframe.frame = FrameId{num_frames_++};
    keyframe.submap = submap;
    keyframe.parent = parent;
    keyframe.rig_from_world = random_pose();
    keyframe.features = features;
    map.add_keyframe(keyframe);
  }

  bool add_landmark(KeyframeId keyframe) {
    const std::uint32_t feature = rng_.below(kNumFeatures);
    if (map.keyframes().at(keyframe).landmarks[feature].is_valid()) return false;
    const SubmapId submap = map.keyframes().at(keyframe).submap;
    map.observe(keyframe, feature, map.add_landmark(submap, random_point(), keyframe));
    return true;
  }

  template <class Id>
  Id pick(const std::vector<Id>& ids) {
    return ids[rng_.below(static_cast<std::uint32_t>(ids.size()))];
  }
  Eigen::Vector3d random_point() { return {rng_.normal(), rng_.normal(), rng_.normal()}; }
  Rigid3 random_pose() {
    Vector6d tangent;
    for (int i = 0; i < 6; ++i) tangent[i] = rng_.normal();
    return Rigid3::exp(tangent);
  }

  Rng rng_;
  std::shared_ptr<const Rig> rig_ = std::make_shared<const Rig>();
  std::uint32_t num_frames_ = 0;
  std::vector<KeyframeId> keyframes_;
  std::vector<LandmarkId> landmarks_;
};

TEST(MapEdits, KeepTheMapSoundAndFrozenCopiesAsTheyWere) {
  std::array<int, static_cast<std::size_t>(Edit::kNumEdits)> num_done{};
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    RandomEditor editor(seed);
    std::vector<std::pair<std::shared_ptr<const Map>, std::string>> frozen;
    for (int step = 0; step < 2500; ++step) {
      editor.step();
      ASSERT_EQ(editor.map.broken_invariants(), "") << "seed " << seed << ", step " << step;
      if (step % 7 == 0 && step % 100 < 50) {
        frozen.emplace_back(editor.map.freeze(), content_of(editor.map));
      }
      if (frozen.size() > 20) frozen.erase(frozen.begin() + step % 20);
    }
    ASSERT_EQ(frozen.size(), 20u);
    for (const auto& [map, content] : frozen) {
      EXPECT_EQ(content_of(*map), content) << "seed " << seed;
      EXPECT_EQ(map->broken_invariants(), "");
    }
    EXPECT_NE(content_of(editor.map), frozen.front().second);
    for (std::size_t i = 0; i < num_done.size(); ++i) num_done[i] += editor.num_done[i];
  }
  for (std::size_t i = 0; i < num_done.size(); ++i) EXPECT_GT(num_done[i], 8) << "edit " << i;
}

TEST(MapEdits, OfAThawedMapAreThoseOfTheOriginal) {
  RandomEditor editor(9);
  for (int step = 0; step < 400; ++step) editor.step();
  const auto frozen = editor.map.freeze();
  const std::string content = content_of(*frozen);
  editor.map = Map::thaw(*frozen);
  EXPECT_EQ(content_of(editor.map), content);
  for (int step = 0; step < 400; ++step) {
    editor.step();
    ASSERT_EQ(editor.map.broken_invariants(), "") << "step " << step;
  }
  EXPECT_EQ(content_of(*frozen), content);
}

TEST(MapEdits, SurviveBeingTakenApartAndPutTogether) {
  for (std::uint64_t seed = 20; seed < 25; ++seed) {
    RandomEditor editor(seed);
    for (int step = 0; step < 600; ++step) editor.step();
    // What was erased without an heir is not stored; all else is.
    const Map restored = Map::restore(take_apart(editor.map));
    EXPECT_EQ(restored.broken_invariants(), "");
    EXPECT_EQ(content_of(Map::restore(take_apart(restored))), content_of(restored));
    EXPECT_EQ(restored.landmarks().size(), editor.map.landmarks().size());
    const Map both = unite(editor.map, restored);
    EXPECT_EQ(both.broken_invariants(), "");
    EXPECT_EQ(both.keyframes().size(), 2 * restored.keyframes().size());
  }
}

/// What poses relative to a keyframe say must not depend on whether it was erased meanwhile.
TEST(MapEdits, ErasingAKeyframeLeavesPosesRelativeToIt) {
  RandomEditor editor(31);
  const Rigid3 step(Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitY())),
                    {0.1, -0.2, 0.3});
  int num_erased = 0;
  for (int i = 0; i < 3000; ++i) {
    const auto before = editor.map.freeze();
    editor.step();
    before->keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
      if (editor.map.keyframes().contains(id)) return;
      ++num_erased;
      const Rigid3 then = before->rig_from_world(id, step, keyframe.applied_scale);
      const Rigid3 now = editor.map.rig_from_world(id, step, keyframe.applied_scale);
      EXPECT_TRUE(now.matrix().isApprox(then.matrix(), 1e-9)) << "keyframe " << id.value;
    });
  }
  EXPECT_GT(num_erased, 20);
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/view/scene.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace waymark {
namespace {

/// A frame may become a keyframe long after it came: the first one of a monocular start.
constexpr std::uint32_t kMaxFrames = 1000;
/// That the velocity is a mean over: errors of poses are small by then.
constexpr std::int64_t kVelocityNs = 200'000'000;
/// Of the piece of an edge that is drawn, in pixels of the image that it was seen in.
constexpr double kHalfEdgePx = 5.0;

bool is_same_place(const Landmark& a, const Landmark& b) {
  return a.position_in_world.cast<float>() == b.position_in_world.cast<float>();
}

bool is_same_otherwise(const Landmark& a, const Landmark& b) {
  return a.submap == b.submap && a.reference == b.reference &&
         saturate16(num_observers(a)) == saturate16(num_observers(b));
}

Message encode_positions(const Map& map, std::span<const LandmarkId> ids) {
  MessageWriter writer(MessageKind::kLandmarkPositions, ids.size());
  for (const LandmarkId id : ids) writer.add(id.value);
  for (const LandmarkId id : ids) writer.add(map.landmarks().at(id).position_in_world);
  return writer.finish();
}

Message encode_edges(const Map& map, std::span<const LandmarkId> ids) {
  MessageWriter writer(MessageKind::kEdgePoints, ids.size());
  for (const LandmarkId id : ids) writer.add(id.value);
  for (const LandmarkId id : ids) writer.add(half_of_edge(map.landmarks().at(id)));
  return writer.finish();
}

/// The frame of the keyframe that a landmark was made from, or of what stands for it.
std::uint32_t frame_of(const Map& map, const Landmark& landmark) {
  const Keyframe* keyframe = map.keyframes().find(map.resolve(landmark.reference));
  return keyframe ? keyframe->frame.value : FrameId{}.value;
}

struct Pose {
  Rigid3 world_from_rig;
  SubmapId submap;
};

bool is_known(KeyframeId id, const Map& map) { return id < map.keyframes().end_id(); }

std::optional<Pose> pose_of(const FrameSummary& note, const Map& map) {
  if (note.final_pose) return Pose{*note.final_pose, note.submap};
  if (!note.pose || !is_known(note.pose->reference, map)) return std::nullopt;
  const Keyframe* keyframe = map.keyframes().find(map.resolve(note.pose->reference));
  if (!keyframe) return std::nullopt;
  const Rigid3 rig_from_world = map.rig_from_world(
      note.pose->reference, note.pose->rig_from_reference, note.pose->reference_scale);
  return Pose{rig_from_world.inverse(), keyframe->submap};
}

bool moves_frames(const Keyframe& before, const Keyframe& after) {
  return !is_same_pose(before, after) || before.applied_scale != after.applied_scale ||
         before.submap != after.submap;
}

}  // namespace

Eigen::Vector3d half_of_edge(const Landmark& landmark) {
  const Appearance& appearance = landmark.appearance;
  // Along the edge as its observers see it: its direction in depth was not measured.
  const Eigen::Vector3d along = appearance.direction.cross(appearance.across);
  const double length = along.norm();
  if (!(length > 0.0)) return Eigen::Vector3d::Zero();
  return kHalfEdgePx * appearance.size_m / length * along;
}

void LandmarkLayer::add_colors(FeatureColors colors) {
  const std::uint32_t frame = colors.frame.value;
  if (frame >= kMaxFrames) colors_of_frames_.erase(frame - kMaxFrames);
  colors_of_frames_.insert_or_assign(frame, std::move(colors));
}

void LandmarkLayer::color_landmarks(const Map& before, const Map& after) {
  after.landmarks().for_each_difference(
      before.landmarks(), [&](LandmarkId id, const Landmark* old, const Landmark* now) {
        if (!now) colors_.erase(id.value);
        if (old || !now) return;
        for (const Observation& observation : now->observations) {
          const Keyframe& keyframe = after.keyframes().at(observation.keyframe);
          const auto found = colors_of_frames_.find(keyframe.frame.value);
          if (found == colors_of_frames_.end()) continue;
          const auto& rgb = found->second.rgb;
          if (observation.feature >= rgb.size()) continue;
          colors_[id.value] = rgb[observation.feature];
          return;
        }
      });
}

void LandmarkLayer::differences(const Map& before,
                                const Map& after,
                                std::vector<Message>& messages) const {
  std::vector<LandmarkId> changed;
  std::vector<LandmarkId> moved;
  std::vector<std::uint32_t> erased;
  after.landmarks().for_each_difference(
      before.landmarks(), [&](LandmarkId id, const Landmark* old, const Landmark* now) {
        if (!now) {
          erased.push_back(id.value);
        } else if (!old || !is_same_otherwise(*old, *now)) {
          changed.push_back(id);
        } else if (!is_same_place(*old, *now)) {
          moved.push_back(id);
        }
      });
  add_chunks(
      erased, messages, [&](auto ids) { return encode_ids(MessageKind::kLandmarksErased, ids); });
  add_chunks(changed, messages, [&](auto ids) { return encode(after, ids); });
  add_chunks(moved, messages, [&](auto ids) { return encode_positions(after, ids); });
  std::vector<LandmarkId> turned;
  after.landmarks().for_each_difference(
      before.landmarks(), [&](LandmarkId id, const Landmark* old, const Landmark* now) {
        if (now && half_of_edge(*now) != (old ? half_of_edge(*old) : Eigen::Vector3d::Zero())) {
          turned.push_back(id);
        }
      });
  add_chunks(turned, messages, [&](auto ids) { return encode_edges(after, ids); });
}

void LandmarkLayer::snapshot(const Map& map, std::vector<Message>& messages) const {
  std::vector<LandmarkId> all;
  all.reserve(map.landmarks().size());
  map.landmarks().for_each([&](LandmarkId id, const Landmark&) { all.push_back(id); });
  add_chunks(all, messages, [&](auto ids) { return encode(map, ids); });
  std::erase_if(all, [&](LandmarkId id) { return half_of_edge(map.landmarks().at(id)).isZero(0); });
  add_chunks(all, messages, [&](auto ids) { return encode_edges(map, ids); });
}

Message LandmarkLayer::encode(const Map& map, std::span<const LandmarkId> ids) const {
  const auto& landmarks = map.landmarks();
  MessageWriter writer(MessageKind::kLandmarks, ids.size());
  for (const LandmarkId id : ids) writer.add(id.value);
  for (const LandmarkId id : ids) writer.add(landmarks.at(id).position_in_world);
  for (const LandmarkId id : ids) writer.add(frame_of(map, landmarks.at(id)));
  for (const LandmarkId id : ids) writer.add(saturate16(num_observers(landmarks.at(id))));
  for (const LandmarkId id : ids) writer.add(saturate16(landmarks.at(id).submap.value));
  for (const LandmarkId id : ids) {
    const auto known = colors_.find(id.value);
    const bool is_known = known != colors_.end();
    for (const std::uint8_t value : is_known ? known->second : Rgb{}) writer.add(value);
    writer.add(static_cast<std::uint8_t>(is_known ? 255 : 0));
  }
  return writer.finish();
}

void TrajectoryLayer::take(const FrameSummary& note) {
  if (notes_.empty()) start_ns_ = note.timestamp_ns;
  const auto place = std::ranges::lower_bound(notes_, note.frame, {}, &FrameSummary::frame);
  const auto index = static_cast<std::uint32_t>(place - notes_.begin());
  if (place == notes_.end()) {
    notes_.push_back(note);
  } else if (place->frame == note.frame) {
    // What is known better now is the pose; the time stays.
    const float tracking_ms = std::max(note.tracking_ms, place->tracking_ms);
    *place = note;
    place->tracking_ms = tracking_ms;
  } else {
    return;  // Frames come in order.
  }
  changed_.push_back(index);
  pending_.push_back(index);
}

void TrajectoryLayer::file(std::uint32_t index, const Map& map) {
  const FrameSummary& note = notes_[index];
  if (!note.pose || note.final_pose) return;
  if (!is_known(note.pose->reference, map)) {
    pending_.push_back(index);
    return;
  }
  const KeyframeId living = map.resolve(note.pose->reference);
  if (!living.is_valid()) return;
  followers_.resize(std::max<std::size_t>(followers_.size(), living.value + 1));
  followers_[living.value].push_back(index);
  changed_.push_back(index);
}

void TrajectoryLayer::follow_keyframes(const Map& before, const Map& after) {
  after.keyframes().for_each_difference(
      before.keyframes(), [&](KeyframeId id, const Keyframe* old, const Keyframe* now) {
        if (!old || id.value >= followers_.size()) return;
        std::vector<std::uint32_t>& followers = followers_[id.value];
        if (!now) {
          pending_.insert(pending_.end(), followers.begin(), followers.end());
          followers = {};
        } else if (moves_frames(*old, *now)) {
          changed_.insert(changed_.end(), followers.begin(), followers.end());
        }
      });
}

void TrajectoryLayer::advance(std::span<const FrameSummary> notes,
                              const Map& before,
                              const Map& after,
                              std::vector<Message>& messages) {
  for (const FrameSummary& note : notes) take(note);
  follow_keyframes(before, after);
  for (const std::uint32_t index : std::exchange(pending_, {})) file(index, after);
  std::sort(changed_.begin(), changed_.end());
  changed_.erase(std::unique(changed_.begin(), changed_.end()), changed_.end());
  add_chunks(changed_, messages, [&](auto indices) { return encode(indices, after); });
  changed_.clear();
}

void TrajectoryLayer::snapshot(const Map& map, std::vector<Message>& messages) const {
  std::vector<std::uint32_t> all(notes_.size());
  std::iota(all.begin(), all.end(), 0u);
  add_chunks(all, messages, [&](auto indices) { return encode(indices, map); });
}

Message TrajectoryLayer::encode(std::span<const std::uint32_t> indices, const Map& map) const {
  MessageWriter writer(MessageKind::kTrajectory, indices.size());
  std::vector<Pose> poses;
  const Rigid3 unknown(Eigen::Quaterniond(NAN, NAN, NAN, NAN), Eigen::Vector3d::Constant(NAN));
  for (const std::uint32_t index : indices) {
    poses.push_back(pose_of(notes_[index], map).value_or(Pose{unknown, SubmapId{}}));
  }
  for (const std::uint32_t index : indices) writer.add(notes_[index].frame.value);
  for (const Pose& pose : poses) writer.add(pose.world_from_rig.translation);
  for (const Pose& pose : poses) writer.add(pose.world_from_rig.rotation);
  for (const std::uint32_t index : indices) {
    writer.add(seconds_between(start_ns_, notes_[index].timestamp_ns));
  }
  for (const std::uint32_t index : indices) writer.add(notes_[index].tracking_ms);
  for (const Pose& pose : poses) writer.add(saturate16(pose.submap.value));
  for (const std::uint32_t index : indices) {
    writer.add(static_cast<std::uint8_t>(notes_[index].state));
  }
  for (const std::uint32_t index : indices) {
    writer.add(static_cast<std::uint8_t>(notes_[index].reason));
  }
  return writer.finish();
}

std::optional<Eigen::Vector3d> TrajectoryLayer::velocity(const Map& map, SubmapId metric) const {
  std::optional<Pose> last;
  std::int64_t last_ns = 0;
  std::optional<Eigen::Vector3d> velocity;
  for (auto note = notes_.rbegin(); note != notes_.rend(); ++note) {
    if (!note->pose && !note->final_pose) break;
    const std::optional<Pose> pose = pose_of(*note, map);
    if (!pose && !last) continue;  // Its keyframe is on its way to the map.
    if (!pose) break;
    if (pose->submap != metric && !map.submaps()[pose->submap.value].is_metric) break;
    if (!last) {
      last = pose;
      last_ns = note->timestamp_ns;
      continue;
    }
    if (pose->submap != last->submap) break;
    const std::int64_t passed_ns = last_ns - note->timestamp_ns;
    velocity = (last->world_from_rig.translation - pose->world_from_rig.translation) /
               (1e-9 * static_cast<double>(passed_ns));
    if (passed_ns >= kVelocityNs) break;
  }
  return velocity;
}

std::vector<Message> Scene::advance(ViewUpdate& update, bool is_watched) {
  if (update.is_reset) {
    map_ = std::make_shared<const Map>();
    landmarks_ = {};
    keyframes_ = {};
    trajectory_ = {};
  }
  const std::shared_ptr<const Map> before = map_;
  if (update.map) map_ = update.map;
  for (FeatureColors& colors : update.colors) landmarks_.add_colors(std::move(colors));
  landmarks_.color_landmarks(*before, *map_);
  std::vector<Message> messages;
  // First, since it knows when the session began.
  trajectory_.advance(update.frames, *before, *map_, messages);
  if (!is_watched) return {};
  if (update.is_reset) return snapshot();
  if (map_ == before) return messages;
  keyframes_.differences(*before, *map_, start_ns(), messages);
  landmarks_.differences(*before, *map_, messages);
  markers_.differences(*map_, messages);
  return messages;
}

std::vector<Message> Scene::snapshot() {
  ++generation_;
  std::vector<Message> messages;
  MessageWriter begin(MessageKind::kBegin, 0);
  begin.add(generation_);
  begin.add(static_cast<std::uint32_t>(map_->landmarks().size()));
  begin.add(static_cast<std::uint32_t>(map_->keyframes().size()));
  begin.add(static_cast<std::uint32_t>(trajectory_.size()));
  messages.push_back(begin.finish());
  keyframes_.snapshot(*map_, start_ns(), messages);
  trajectory_.snapshot(*map_, messages);
  landmarks_.snapshot(*map_, messages);
  markers_.snapshot(*map_, messages);
  MessageWriter end(MessageKind::kEnd, 0);
  end.add(generation_);
  messages.push_back(end.finish());
  return messages;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/tracker.h"

#include <algorithm>
#include <utility>

#include "waymark/features/feature_geometry.h"
#include "waymark/track/keyframe_decision.h"

namespace waymark {
namespace {

/// Frames after a loss until a single one with range may start a new sub-map.
constexpr int kMinLost = 5;
/// Where an IMU tells where the rig is, so many frames that show something must not be found before
/// that is believed to be a place not seen before.
constexpr int kMaxUnfound = 10;

}  // namespace

Tracker::Tracker(bool has_range, const TrackingSettings& settings, std::uint64_t seed)
    : has_range_(has_range),
      settings_(settings),
      initializer_(has_range, seed, settings.options),
      search_(settings, seed) {}

void Tracker::begin_in(const Map& map, TrackingPurpose purpose) {
  purpose_ = purpose;
  mode_ = Mode::kLost;
  ids_ = PredictedIds(map);
}

void Tracker::continue_in(const Map& map, TrackingPurpose purpose) {
  purpose_ = purpose;
  ids_ = PredictedIds(map, ids_.newest_frame());
  visibility_.clear();
  search_.continue_in(map);
  const std::vector<KeyframeId>& around = search_.local_map().keyframes;
  const bool had_pose = last_.has_pose();
  last_.forget_missing(*visible_.map, map, around.empty() ? KeyframeId{} : around.front());
  if (had_pose && !last_.has_pose()) mode_ = Mode::kLost;
}

RigMotion Tracker::predict_motion() const {
  return mode_ == Mode::kTracking ? last_.predict_motion(*visible_.map) : RigMotion{};
}

PoseSearch::Context Tracker::context() {
  return {visible_, last_, mode_ == Mode::kLost, num_lost_, purpose_ == TrackingPurpose::kMapping};
}

std::optional<MapperMessage> Tracker::track(const Frame& seen,
                                            const MapSnapshot& visible,
                                            TrackingResult& result) {
  Frame frame = seen;
  visible_ = visible;
  if (mode_ == Mode::kInitializing) return initialize(frame, result);
  if (frame.features->num_primary == 0) {
    return lose(frame, {.reason = FrameReason::kNoFeatures}, result);
  }
  std::optional<LocatedFrame> located = search_.locate(frame, context(), result.stages);
  if (!located) return lose(frame, search_.failure(), result);
  return accept(frame, *std::move(located), result);
}

void Tracker::count_visibility(const Features& features, const LocatedFrame& located) {
  if (purpose_ == TrackingPurpose::kLocalizing) return;
  for (const LandmarkId id : located.visible) visibility_.count_visible(id);
  for (const LandmarkId id : primary_landmarks(features, located.landmarks)) {
    visibility_.count_found(id);
  }
  visibility_.end_frame();
}

bool Tracker::is_keyframe(const Frame& frame, const LocatedFrame& located) const {
  if (purpose_ == TrackingPurpose::kLocalizing) return false;
  const Map& map = *visible_.map;
  const std::size_t num_pending = ids_.num_pending(map);
  // What the newest keyframe is about to bring need not be brought again.
  const KeyframeView reference = num_pending > 0 && newest_view_
                                     ? *newest_view_
                                     : view_of(map.keyframes().at(search_.local_map().reference));
  KeyframeSituation situation = compare_with_reference(*frame.features,
                                                       has_range_,
                                                       located,
                                                       map,
                                                       reference,
                                                       ids_.submap_age(map),
                                                       settings_.options.keyframes);
  situation.num_pending = num_pending;
  situation.frames_since_keyframe = static_cast<int>(frame.id.value - ids_.newest_frame().value);
  return should_make_keyframe(situation, settings_);
}

std::optional<MapperMessage> Tracker::accept(const Frame& frame,
                                             LocatedFrame located,
                                             TrackingResult& result) {
  StageTimer timer(result.stages, Stage::kKeyframe);
  count_visibility(*frame.features, located);
  const KeyframeId reference_id = search_.local_map().reference;
  const Keyframe& reference = visible_.map->keyframes().at(reference_id);
  const RelativePose pose{reference_id,
                          reference.applied_scale,
                          located.rig_from_world * reference.rig_from_world.inverse()};
  set_located(located, result);
  result.submap = reference.submap;
  result.is_relocalized = mode_ == Mode::kLost;
  result.is_keyframe = is_keyframe(frame, located);
  result.frame_in_map = frame.id;
  result.features = frame.features;
  result.pose = pose;
  std::optional<MapperMessage> message;
  if (result.is_keyframe) {
    const RigMotion motion =
        last_.motion_in(*visible_.map, frame, located.rig_from_world, located.landmarks);
    message = NewKeyframe{frame.id,
                          frame.timestamp_ns,
                          pose,
                          moved(frame.features, motion),
                          located.landmarks,
                          visibility_.take()};
    newest_view_ = view_of(*frame.features, located.landmarks, located.rig_from_world);
    // A keyframe is its own reference, so that it moves as the map moves it.
    result.pose = {ids_.add_keyframe(frame.id), pose.reference_scale, Rigid3{}};
  }
  last_.set(frame, pose, located.rig_from_world, located.landmarks);
  result.landmarks = std::move(located.landmarks);
  mode_ = Mode::kTracking;
  num_lost_ = 0;
  return message;
}

std::optional<MapperMessage> Tracker::lose(const Frame& frame,
                                           const FrameStatus& why,
                                           TrackingResult& result) {
  if (mode_ != Mode::kLost) {
    mode_ = Mode::kLost;
    num_lost_ = num_unfound_ = 0;
    initializer_.reset();
  }
  ++num_lost_;
  if (why.reason != FrameReason::kNoFeatures) ++num_unfound_;
  const std::optional<ReckonedPose> reckoned =
      frame.dead_reckon ? frame.dead_reckon() : std::nullopt;
  // With keyframes outstanding a new sub-map could not show in the next frame.
  const bool may_start = ids_.num_pending(*visible_.map) == 0 &&
                         (!has_range_ || num_lost_ > kMinLost) &&
                         (!reckoned || num_unfound_ > kMaxUnfound);
  if (may_start) {
    if (auto started = start_submap(frame, result)) return started;
  }
  static_cast<FrameStatus&>(result) = why;  // Perhaps found, but not again in the local map.
  if (result.reason == FrameReason::kNone) result.reason = FrameReason::kTooFewInliers;
  result.frame_in_map = frame.id;
  result.features = frame.features;
  if (reckoned) go_on_reckoned(*reckoned, result);
  return std::nullopt;
}

void Tracker::go_on_reckoned(const ReckonedPose& reckoned, TrackingResult& result) {
  const Map& map = *visible_.map;
  last_.carry_over(map);
  const Rigid3 rig_from_world = reckoned.rig_from_rig_then * last_.rig_from_world();
  const KeyframeId reference_id = map.resolve(last_.reference());
  const Keyframe& reference = map.keyframes().at(reference_id);
  result.state = FrameState::kFilled;
  result.world_from_rig = rig_from_world.inverse();
  result.covariance = reckoned.covariance;
  result.submap = reference.submap;
  result.pose = {
      reference_id, reference.applied_scale, rig_from_world * reference.rig_from_world.inverse()};
}

std::optional<MapperMessage> Tracker::initialize(const Frame& frame, TrackingResult& result) {
  if (auto started = start_submap(frame, result)) return started;
  result.state = FrameState::kInitializing;
  result.reason = initializer_.reason();
  result.frame_in_map = frame.id;
  result.features = frame.features;
  return std::nullopt;
}

std::optional<MapperMessage> Tracker::start_submap(const Frame& frame, TrackingResult& result) {
  if (purpose_ == TrackingPurpose::kLocalizing) return std::nullopt;
  StageTimer timer(result.stages, Stage::kInitialize);
  std::optional<Initialization> start = initializer_.add(frame);
  if (!start) return std::nullopt;
  initializer_.reset();
  if (!has_range_ && last_.has_pose()) {
    const std::vector<KeyframeId> nearby = search_.keyframes_nearby(context());
    scale_keeper_.keep(*visible_.map, *std::ranges::max_element(nearby), *start);
  }
  result.state = FrameState::kTracked;
  result.num_matches = result.num_inliers = static_cast<int>(start->submap.landmarks.size());
  newest_view_.reset();
  result.submap = ids_.add_submap(start->submap.keyframes.size(), frame.id);
  result.world_from_rig = start->rig_from_world.inverse();
  result.is_keyframe = true;
  result.frame_in_map = frame.id;
  result.features = frame.features;
  result.pose = {ids_.newest_keyframe(), 1.0, Rigid3{}};
  result.filled = std::move(start->filled);
  for (FilledPose& filled : result.filled) {
    filled.pose.reference.value += ids_.submap_start().value;
  }
  last_.forget_motion();
  last_.set(frame, result.pose, start->rig_from_world, {});
  mode_ = Mode::kTracking;
  return std::move(start->submap);
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/tracker.h"

#include <algorithm>
#include <utility>

#include "waymark/image/feature_geometry.h"
#include "waymark/track/search_radius.h"

namespace waymark {
namespace {

/// For a camera turned by hand the prediction is off by 12 px of 640 x 480 in one frame of 20 and
/// by 22 px in one of 100 (docs/decisions.md).
constexpr double kPredictedRadiusPx = 15.0;
constexpr double kPredictedPart = 1.0 / 64.0;
constexpr double kWideRadiusPx = 40.0;
constexpr double kWidePart = 1.0 / 24.0;
/// Around a pose that rests on what it sees; of the landmark's level (docs/decisions.md).
constexpr double kLocatedRadiusPx = 5.0;
constexpr int kMaxLocalMapAge = 5;
constexpr std::size_t kRecoveryKeyframes = 12;
/// Frames after a loss in which the camera is looked for near where it was.
constexpr int kRecoveryFrames = 30;
/// Frames after a loss until a single one with range may start a new sub-map, and in which a place
/// near the last pose is believed.
constexpr int kPatience = 5;

std::array<double, 2> search_radii(const Rig& rig) {
  const Camera& camera = *rig.cameras.at(0).camera;
  return {search_radius_px(camera, kPredictedRadiusPx, kPredictedPart),
          search_radius_px(camera, kWideRadiusPx, kWidePart)};
}

}  // namespace

Tracker::Tracker(std::shared_ptr<const Rig> rig,
                 bool has_range,
                 const TrackingSettings& settings,
                 std::uint64_t seed)
    : rig_(rig),
      has_range_(has_range),
      settings_(settings),
      seed_(seed),
      initializer_(rig, has_range, seed),
      turn_aligner_(rig->cameras.at(0).camera),
      patch_locator_(rig),
      locator_(rig),
      relocalizer_(rig, settings, seed),
      scale_keeper_(seed),
      keyframe_assessor_(rig, has_range),
      search_radii_px_(search_radii(*rig)) {}

void Tracker::look_with(std::shared_ptr<const Rig> rig) {
  rig_ = std::move(rig);
  initializer_ = Initializer(rig_, has_range_, seed_);
  turn_aligner_ = TurnAligner(rig_->cameras[0].camera);
  patch_locator_ = PatchLocator(rig_);
  locator_ = FrameLocator(rig_);
  relocalizer_ = Relocalizer(rig_, settings_, seed_);
  keyframe_assessor_ = KeyframeAssessor(rig_, has_range_);
  search_radii_px_ = search_radii(*rig_);
}

void Tracker::begin_in(const Map& map, TrackingPurpose purpose) {
  purpose_ = purpose;
  mode_ = Mode::kLost;
  ids_ = SentIds(map);
}

void Tracker::continue_in(const Map& map, TrackingPurpose purpose) {
  purpose_ = purpose;
  ids_ = SentIds(map);
  sightings_.clear();
  local_map_source_.reset();
  std::erase_if(local_.keyframes, [&](KeyframeId id) { return !map.keyframes().contains(id); });
  const bool had_pose = last_.has_pose();
  last_.forget_missing(
      *map_, map, local_.keyframes.empty() ? KeyframeId{} : local_.keyframes.front());
  if (had_pose && !last_.has_pose()) mode_ = Mode::kLost;
}

RigMotion Tracker::predict_motion() const {
  return mode_ == Mode::kTracking ? last_.predict_motion(*map_) : RigMotion{};
}

Frame Tracker::straightened(const Frame& frame, const LocatedFrame& located) const {
  if (mode_ != Mode::kTracking || rig_->cameras[0].readout_s == 0.0) return frame;
  const RigMotion motion =
      last_.motion_in(*map_, frame.timestamp_ns, located.rig_from_world, located.landmarks);
  return {frame.id,
          frame.timestamp_ns,
          moved(frame.features, *rig_, motion),
          frame.image,
          frame.find_markers};
}

TrackOutcome Tracker::track(const Frame& seen, const MapSnapshot& visible, StageTimes& times) {
  Frame frame = seen;
  map_ = visible.map;
  places_ = visible.places;
  if (mode_ == Mode::kInitializing) return initialize(frame, times);
  if (frame.features->num_primary == 0) {
    return lose(frame, {.reason = FrameReason::kNoFeatures}, times);
  }
  std::optional<LocatedFrame> first = locate_from_last(frame, times);
  if (!first) first = recover(frame, times);
  if (first) frame = straightened(frame, *first);
  std::optional<LocatedFrame> located = locate_in_local_map(frame, std::move(first), times);
  if (!located) located = locate_by_patches(frame, times);
  if (!located) located = locate_in_local_map(frame, relocalize(frame, times), times);
  if (!located) return lose(frame, relocalizer_.diagnosis(), times);
  return accept(frame, *std::move(located), times);
}

std::optional<LocatedFrame> Tracker::locate_from_last(const Frame& frame, StageTimes& times) {
  if (mode_ != Mode::kTracking) return std::nullopt;
  StageTimer timer(times, Stage::kPredict);
  last_.carry_over(*map_);
  const Rigid3 predicted = last_.predict(frame.timestamp_ns);
  const auto [radius_px, wide_radius_px] = search_radii_px_;
  if (auto located = locate_near(frame, predicted, radius_px)) return located;
  std::optional<LocatedFrame> wide = locate_near(frame, predicted, wide_radius_px);
  std::optional<LocatedFrame> by_image = locate_by_image(frame);
  const bool is_better = by_image && (!wide || by_image->num_inliers > wide->num_inliers);
  return is_better ? by_image : wide;
}

std::optional<LocatedFrame> Tracker::locate_by_motion(const Frame& frame) {
  const double radius_px = search_radii_px_.back();
  auto located = locate_near(frame, last_.predict(frame.timestamp_ns), radius_px);
  return located && located->num_inliers >= settings_.min_inliers ? located : std::nullopt;
}

std::optional<LocatedFrame> Tracker::locate_by_image(const Frame& frame) {
  const std::optional<Rigid3> predicted = predict_by_image(frame);
  if (!predicted) return std::nullopt;
  for (const double radius_px : search_radii_px_) {
    if (auto located = locate_near(frame, *predicted, radius_px)) return located;
  }
  return std::nullopt;
}

std::optional<LocatedFrame> Tracker::locate_near(const Frame& frame,
                                                 const Rigid3& rig_from_world,
                                                 double radius_px) {
  std::vector<LandmarkId> matched = locator_.find(
      *frame.features, last_.landmarks(*map_), rig_from_world, {.radius_px = radius_px});
  if (num_valid(matched) < settings_.min_inliers) return std::nullopt;
  LocatedFrame located =
      locator_.locate(*frame.features, *map_, rig_from_world, std::move(matched));
  if (located.num_inliers < settings_.min_inliers / 2) return std::nullopt;
  return located;
}

std::optional<LocatedFrame> Tracker::locate_by_patches(Frame& frame, StageTimes& times) {
  if (mode_ != Mode::kTracking || !last_.has_pose() || !last_.image()) return std::nullopt;
  StageTimer timer(times, Stage::kRecover);
  if (local_map_source_ != map_) {
    gather_local_map(*map_, last_.landmarks(*map_).ids, last_.reference(), local_);
    local_map_source_ = map_;
    local_map_age_ = 0;
  }
  const LocatedPatches before{*last_.image(), last_.rig_from_world()};
  const auto known = well_known(local_.landmarks, *map_);
  const Rigid3 predicted = last_.predict(frame.timestamp_ns);
  const auto found = patch_locator_.align(before, local_.landmarks, known, frame, predicted);
  if (!found) return std::nullopt;
  LocatedFrame located = patch_locator_.pose_of(before, *found);
  located.landmarks = locator_.find(
      *frame.features, local_.landmarks, located.rig_from_world, {.radius_px = kLocatedRadiusPx});
  Frame with_patches = frame;
  patch_locator_.add_features(*found, local_.landmarks, with_patches, located);
  if (located.num_inliers < settings_.min_inliers) return std::nullopt;
  frame = std::move(with_patches);
  return located;
}

std::optional<Rigid3> Tracker::predict_by_image(const Frame& frame) {
  if (!frame.image || !last_.image()) return std::nullopt;
  const TurnAlignment turn = turn_aligner_.align(*last_.image(), *frame.image);
  if (!turn.is_certain()) return std::nullopt;
  const Eigen::Quaterniond cam_from_rig = rig_->cameras[0].cam_from_rig.rotation;
  const Eigen::Quaterniond rig_turn = cam_from_rig.conjugate() * turn.b_from_a * cam_from_rig;
  const Eigen::Quaterniond rotation = (rig_turn * last_.rig_from_world().rotation).normalized();
  const Eigen::Vector3d centre = last_.predict(frame.timestamp_ns).origin_in_source();
  return Rigid3(rotation, -(rotation * centre));
}

std::optional<LocatedFrame> Tracker::recover(const Frame& frame, StageTimes& times) {
  if (!last_.has_pose() || num_lost_ >= kRecoveryFrames) return std::nullopt;
  StageTimer timer(times, Stage::kRecover);
  if (mode_ == Mode::kLost) {
    last_.carry_over(*map_);
    auto located = locate_by_motion(frame);
    if (!located) located = locate_by_image(frame);
    if (located && located->num_inliers >= settings_.min_inliers) {
      local_map_source_.reset();
      return located;
    }
  }
  for (const KeyframeId id : recovery_keyframes()) {
    if (auto located = locate_near_keyframe(frame, id)) {
      local_map_source_.reset();
      return located;
    }
  }
  return std::nullopt;
}

std::vector<KeyframeId> Tracker::recovery_keyframes() const {
  const SubmapId submap = map_->keyframes().at(map_->resolve(last_.reference())).submap;
  std::vector<KeyframeId> keyframes;
  const auto add = [&](KeyframeId id) {
    const Keyframe* keyframe = map_->keyframes().find(id);
    const bool is_known = std::ranges::find(keyframes, id) != keyframes.end();
    if (keyframe && keyframe->submap == submap && !is_known) keyframes.push_back(id);
    return keyframes.size() < kRecoveryKeyframes;
  };
  for (const KeyframeId id : local_.keyframes) {
    if (!add(id)) return keyframes;
  }
  if (purpose_ == TrackingPurpose::kLocalizing) return keyframes;
  // A sub-map that has just begun has no local map yet.
  for (std::uint32_t value = map_->keyframes().end_id().value; value-- > 0;) {
    if (!add(KeyframeId{value})) break;
  }
  return keyframes;
}

std::optional<LocatedFrame> Tracker::locate_near_keyframe(const Frame& frame, KeyframeId id) {
  const Keyframe& keyframe = map_->keyframes().at(id);
  std::vector<std::uint32_t> with_landmark;
  for (std::uint32_t i = 0; i < keyframe.features->num_primary; ++i) {
    if (keyframe.landmarks[i].is_valid()) with_landmark.push_back(i);
  }
  const auto matches = appearance_.match_all(
      *keyframe.features, with_landmark, *frame.features, {.max_distance = 60, .max_ratio = 0.8});
  if (static_cast<int>(matches.size()) < settings_.min_inliers) return std::nullopt;
  std::vector<LandmarkId> matched(frame.features->size());
  for (const FeatureMatch& match : matches) matched[match.b] = keyframe.landmarks[match.a];
  LocatedFrame located =
      locator_.locate(*frame.features, *map_, keyframe.rig_from_world, std::move(matched));
  if (located.num_inliers < settings_.min_inliers) return std::nullopt;
  return located;
}

std::optional<LocatedFrame> Tracker::relocalize(const Frame& frame, StageTimes& times) {
  StageTimer timer(times, Stage::kRecover);
  std::optional<LastPlace> last;
  if (last_.has_pose() && num_lost_ < kPatience) {
    last = {map_->resolve(last_.reference()), last_.rig_from_world()};
  }
  std::optional<LocatedFrame> located = relocalizer_.locate_at_markers(frame, *map_);
  if (!located) located = relocalizer_.locate(frame, *map_, *places_, last);
  if (!located) return std::nullopt;
  local_map_source_.reset();
  last_.forget_motion();
  return located;
}

std::optional<LocatedFrame> Tracker::locate_in_local_map(const Frame& frame,
                                                         std::optional<LocatedFrame> first,
                                                         StageTimes& times) {
  if (!first) return std::nullopt;
  StageTimer timer(times, Stage::kLocalMap);
  refresh_local_map(*frame.features, *first);
  LocatedFrame located = locator_.locate_again(
      *frame.features, *map_, *std::move(first), local_.landmarks, {.radius_px = kLocatedRadiusPx});
  if (located.num_inliers < settings_.min_inliers) return std::nullopt;
  return located;
}

void Tracker::refresh_local_map(const Features& features, const LocatedFrame& located) {
  if (local_map_source_ == map_ && ++local_map_age_ < kMaxLocalMapAge) return;
  gather_local_map(
      *map_, primary_landmarks(features, located.landmarks), last_.reference(), local_);
  local_map_source_ = map_;
  local_map_age_ = 0;
}

void Tracker::count_sightings(const Features& features, const LocatedFrame& located) {
  if (purpose_ == TrackingPurpose::kLocalizing) return;
  const auto is_visible = locator_.is_visible();
  for (std::size_t i = 0; i < local_.landmarks.size(); ++i) {
    if (is_visible[i]) sightings_.count_visible(local_.landmarks.ids[i]);
  }
  for (std::size_t i = 0; i < features.num_primary; ++i) {
    if (located.landmarks[i].is_valid()) sightings_.count_found(located.landmarks[i]);
  }
  sightings_.end_frame();
}

bool Tracker::is_keyframe(const Frame& frame, const LocatedFrame& located) const {
  if (purpose_ == TrackingPurpose::kLocalizing) return false;
  KeyframeSituation situation = keyframe_assessor_.assess(
      *frame.features, located, *map_, local_.reference, ids_.submap_age(*map_));
  situation.num_pending = ids_.num_pending(*map_);
  situation.frames_since_keyframe = static_cast<int>(frame.id.value - last_keyframe_frame_.value);
  return should_make_keyframe(situation, settings_);
}

TrackOutcome Tracker::accept(const Frame& frame, LocatedFrame located, StageTimes& times) {
  StageTimer timer(times, Stage::kKeyframe);
  count_sightings(*frame.features, located);
  const Keyframe& reference = map_->keyframes().at(local_.reference);
  const RelativePose pose{local_.reference,
                          reference.applied_scale,
                          located.rig_from_world * reference.rig_from_world.inverse()};
  TrackOutcome outcome;
  outcome.state = FrameState::kTracked;
  outcome.num_matches = located.num_matches;
  outcome.num_inliers = located.num_inliers;
  outcome.submap = reference.submap;
  outcome.world_from_rig = located.rig_from_world.inverse();
  outcome.covariance = located.covariance;
  outcome.seen = seen_landmarks(*frame.features, located.landmarks);
  outcome.is_relocalized = mode_ == Mode::kLost;
  outcome.details = {frame.id, frame.features, {}, pose, {}};
  if (is_keyframe(frame, located)) {
    const RigMotion motion =
        last_.motion_in(*map_, frame.timestamp_ns, located.rig_from_world, located.landmarks);
    outcome.message = NewKeyframe{frame.id,
                                  frame.timestamp_ns,
                                  pose,
                                  moved(frame.features, *rig_, motion),
                                  located.landmarks,
                                  sightings_.take(),
                                  rig_};
    // A keyframe is its own reference, so that it moves as the map moves it.
    outcome.details.pose = {ids_.add_keyframe(), pose.reference_scale, Rigid3{}};
    last_keyframe_frame_ = frame.id;
  }
  last_.set(frame, pose, located.rig_from_world, located.landmarks);
  outcome.details.landmarks = std::move(located.landmarks);
  mode_ = Mode::kTracking;
  num_lost_ = 0;
  return outcome;
}

TrackOutcome Tracker::lose(const Frame& frame, const FrameStatus& why, StageTimes& times) {
  if (mode_ != Mode::kLost) {
    mode_ = Mode::kLost;
    num_lost_ = 0;
    initializer_.reset();
  }
  ++num_lost_;
  // With keyframes outstanding a new sub-map could not show in the next frame.
  const bool may_start = ids_.num_pending(*map_) == 0 && (!has_range_ || num_lost_ > kPatience);
  if (may_start) {
    if (auto started = start_submap(frame, times)) return *std::move(started);
  }
  TrackOutcome outcome;
  static_cast<FrameStatus&>(outcome) = why;
  // Found, but not again in the local map.
  if (outcome.reason == FrameReason::kNone) outcome.reason = FrameReason::kTooFewInliers;
  outcome.details.frame = frame.id;
  outcome.details.features = frame.features;
  return outcome;
}

TrackOutcome Tracker::initialize(const Frame& frame, StageTimes& times) {
  if (auto started = start_submap(frame, times)) return *std::move(started);
  TrackOutcome outcome;
  outcome.state = FrameState::kInitializing;
  outcome.reason = initializer_.reason();
  outcome.details.frame = frame.id;
  outcome.details.features = frame.features;
  return outcome;
}

std::optional<TrackOutcome> Tracker::start_submap(const Frame& frame, StageTimes& times) {
  if (purpose_ == TrackingPurpose::kLocalizing) return std::nullopt;
  StageTimer timer(times, Stage::kInitialize);
  std::optional<Initialization> start = initializer_.add(frame);
  if (!start) return std::nullopt;
  initializer_.reset();
  start->submap.rig = rig_;
  if (!has_range_ && last_.has_pose()) scale_keeper_.keep(*map_, recovery_keyframes(), *start);
  TrackOutcome outcome;
  outcome.state = FrameState::kTracked;
  outcome.num_matches = outcome.num_inliers = static_cast<int>(start->submap.landmarks.size());
  outcome.submap = ids_.add_submap(start->submap.keyframes.size());
  outcome.world_from_rig = start->rig_from_world.inverse();
  const RelativePose pose{ids_.newest_keyframe(), 1.0, Rigid3{}};
  outcome.details = {frame.id, frame.features, {}, pose, std::move(start->filled)};
  for (FilledPose& filled : outcome.details.filled) {
    filled.pose.reference.value += ids_.submap_start().value;
  }
  outcome.message = std::move(start->submap);
  last_.forget_motion();
  last_.set(frame, pose, start->rig_from_world, {});
  last_keyframe_frame_ = frame.id;
  mode_ = Mode::kTracking;
  return outcome;
}

}  // namespace waymark

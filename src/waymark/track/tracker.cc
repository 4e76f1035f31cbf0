// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/tracker.h"

#include <algorithm>

#include "waymark/base/check.h"
#include "waymark/base/median.h"
#include "waymark/image/range_precision.h"

namespace waymark {
namespace {

/// Search radii around a predicted pose and around an already optimised one.
constexpr double kPredictedRadiusPx = 15.0;
constexpr double kWideRadiusPx = 40.0;
constexpr double kLocatedRadiusPx = 5.0;
constexpr int kMaxLocalMapAge = 5;
/// Landmarks that so many keyframes see, or all in a young map, count as established.
constexpr std::size_t kEstablishedObservers = 3;
constexpr std::uint32_t kRecoveryKeyframes = 12;
/// Frames after a loss in which the camera is looked for near where it was.
constexpr int kRecoveryFrames = 30;
/// Frames after a loss until a single one with range may start a new sub-map.
constexpr int kPatience = 5;

}  // namespace

Tracker::Tracker(std::shared_ptr<const Rig> rig,
                 bool has_range,
                 const TrackingSettings& settings,
                 std::uint64_t seed)
    : rig_(rig),
      has_range_(has_range),
      settings_(settings),
      pixel_rad_(central_pixel_angle(*rig->cameras.at(0).camera)),
      initializer_(rig, has_range, seed),
      matcher_(rig),
      locator_(rig),
      relocalizer_(rig, settings, seed) {}

void Tracker::begin_in(const Map& map, TrackingPurpose purpose) {
  purpose_ = purpose;
  mode_ = Mode::kLost;
  num_sent_ = map.keyframes().end_id().value;
  num_submaps_ = static_cast<std::uint32_t>(map.submaps().size());
}

void Tracker::continue_in(const Map& map, TrackingPurpose purpose) {
  purpose_ = purpose;
  num_sent_ = map.keyframes().end_id().value;
  sightings_.clear();
  local_map_source_.reset();
  std::erase_if(local_.keyframes, [&](KeyframeId id) { return !map.keyframes().contains(id); });
  for (LandmarkId& id : last_landmarks_) {
    if (!map.landmarks().contains(id)) id = LandmarkId{};
  }
  if (!last_pose_.reference.is_valid() || map.keyframes().contains(last_pose_.reference)) return;
  const Rigid3 last = map_->rig_from_world(
      last_pose_.reference, last_pose_.rig_from_reference, last_pose_.reference_scale);
  last_pose_ = RelativePose{};
  if (local_.keyframes.empty()) {
    mode_ = Mode::kLost;
    return;
  }
  const Keyframe& reference = map.keyframes().at(local_.keyframes.front());
  last_pose_ = {
      local_.keyframes.front(), last * reference.rig_from_world.inverse(), reference.applied_scale};
}

TrackOutcome Tracker::track(const Frame& frame, const MapSnapshot& visible, StageTimes& times) {
  map_ = visible.map;
  places_ = visible.places;
  TrackOutcome outcome =
      mode_ == Mode::kInitializing ? initialize(frame, times) : follow(frame, times);
  if (!outcome.pose) return outcome;
  last_pose_ = *outcome.pose;
  last_features_ = frame.features;
  last_landmarks_ = landmarks_;
  motion_.update(frame.timestamp_ns, outcome.rig_from_world);
  return outcome;
}

TrackOutcome Tracker::initialize(const Frame& frame, StageTimes& times) {
  StageTimer timer(times, Stage::kInitialize);
  const bool may_start = purpose_ == TrackingPurpose::kMapping;
  if (auto started = may_start ? start_submap(frame) : std::nullopt) return *std::move(started);
  TrackOutcome outcome;
  outcome.state = FrameState::kInitializing;
  outcome.reason = initializer_.reason();
  return outcome;
}

std::optional<TrackOutcome> Tracker::start_submap(const Frame& frame) {
  std::optional<Initialization> start = initializer_.add(frame);
  if (!start) return std::nullopt;
  initializer_.reset();
  submap_start_ = num_sent_;
  num_sent_ += static_cast<std::uint32_t>(start->submap.keyframes.size());
  TrackOutcome outcome;
  outcome.state = FrameState::kTracked;
  outcome.pose = RelativePose{KeyframeId{num_sent_ - 1}, Rigid3{}, 1.0};
  outcome.rig_from_world = start->rig_from_world;
  outcome.num_matches = outcome.num_inliers = static_cast<int>(start->submap.landmarks.size());
  outcome.filled = std::move(start->filled);
  for (FilledPose& filled : outcome.filled) {
    filled.pose.reference = KeyframeId{submap_start_ + filled.pose.reference.value};
  }
  outcome.message = std::move(start->submap);
  outcome.submap = SubmapId{num_submaps_++};
  landmarks_.clear();  // They have no ids yet; carry_over() takes them from the keyframe.
  last_keyframe_frame_ = frame.id;
  mode_ = Mode::kTracking;
  return outcome;
}

TrackOutcome Tracker::follow(const Frame& frame, StageTimes& times) {
  if (frame.features->num_primary == 0) {
    return lose(frame, {.reason = FrameReason::kNoFeatures}, times);
  }
  std::optional<LocatedFrame> located = locate_near_last(frame, times);
  if (!located) located = relocalize(frame, times);
  if (!located) {
    PlaceDiagnosis diagnosis = relocalizer_.diagnosis();
    // Found, but not again in the local map.
    if (diagnosis.reason == FrameReason::kNone) diagnosis.reason = FrameReason::kTooFewInliers;
    return lose(frame, diagnosis, times);
  }
  StageTimer timer(times, Stage::kKeyframe);
  return accept(frame, *located);
}

std::optional<LocatedFrame> Tracker::locate_near_last(const Frame& frame, StageTimes& times) {
  std::optional<LocatedFrame> located;
  if (mode_ == Mode::kTracking) {
    StageTimer timer(times, Stage::kPredict);
    carry_over();
    located = locate_from_last(frame);
  }
  const bool was_somewhere = last_pose_.reference.is_valid();
  if (!located && was_somewhere && num_lost_ < kRecoveryFrames) {
    StageTimer timer(times, Stage::kRecover);
    located = recover(frame);
  }
  if (!located) return std::nullopt;
  StageTimer timer(times, Stage::kLocalMap);
  located = locate_in_local_map(frame, *located);
  if (located->num_inliers < settings_.min_inliers) return std::nullopt;
  return located;
}

std::optional<LocatedFrame> Tracker::relocalize(const Frame& frame, StageTimes& times) {
  StageTimer timer(times, Stage::kRecover);
  const auto located = relocalizer_.locate(frame, *map_, *places_, landmarks_);
  if (!located) return std::nullopt;
  local_map_source_.reset();
  const LocatedFrame refined = locate_in_local_map(frame, *located);
  if (refined.num_inliers < settings_.min_inliers) return std::nullopt;
  return refined;
}

void Tracker::carry_over() {
  if (last_landmarks_.empty())
    last_landmarks_ = map_->keyframes().at(last_pose_.reference).landmarks;
  for (LandmarkId& id : last_landmarks_) id = map_->resolve(id);
  motion_.move_last(
      map_->rig_from_world(
          last_pose_.reference, last_pose_.rig_from_reference, last_pose_.reference_scale),
      map_->scale_since(last_pose_.reference, last_pose_.reference_scale));
}

std::optional<LocatedFrame> Tracker::locate_from_last(const Frame& frame) {
  last_set_.clear();
  for (std::uint32_t i = 0; i < last_features_->num_primary; ++i) {
    if (!last_landmarks_[i].is_valid()) continue;
    last_set_.add(last_landmarks_[i], map_->landmarks().at(last_landmarks_[i]));
    last_set_.descriptors.back() = last_features_->descriptors[i];
  }
  const Rigid3 predicted = motion_.predict(frame.timestamp_ns);
  for (const double radius_px : {kPredictedRadiusPx, kWideRadiusPx}) {
    const ProjectionMatches& matches =
        matcher_.match(last_set_, *frame.features, {}, predicted, {.radius_px = radius_px});
    if (static_cast<int>(matches.num_matches) < settings_.min_inliers) continue;
    landmarks_.assign(frame.features->size(), LandmarkId{});
    for (std::size_t i = 0; i < last_set_.size(); ++i) {
      if (matches.features[i] != kNoFeature) landmarks_[matches.features[i]] = last_set_.ids[i];
    }
    const LocatedFrame located = locator_.locate(*frame.features, *map_, predicted, landmarks_);
    if (located.num_inliers >= settings_.min_inliers / 2) return located;
  }
  return std::nullopt;
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
  landmarks_.assign(frame.features->size(), LandmarkId{});
  for (const FeatureMatch& match : matches) landmarks_[match.b] = keyframe.landmarks[match.a];
  const LocatedFrame located =
      locator_.locate(*frame.features, *map_, keyframe.rig_from_world, landmarks_);
  if (located.num_inliers < settings_.min_inliers) return std::nullopt;
  return located;
}

std::optional<LocatedFrame> Tracker::recover(const Frame& frame) {
  for (const KeyframeId id : recovery_keyframes()) {
    if (auto located = locate_near_keyframe(frame, id)) {
      local_map_source_.reset();
      return located;
    }
  }
  return std::nullopt;
}

std::vector<KeyframeId> Tracker::recovery_keyframes() const {
  std::vector<KeyframeId> keyframes;
  if (purpose_ == TrackingPurpose::kLocalizing) {
    keyframes = local_.keyframes;
    keyframes.resize(std::min<std::size_t>(keyframes.size(), kRecoveryKeyframes));
    return keyframes;
  }
  const SubmapId submap = map_->keyframes().at(map_->resolve(last_pose_.reference)).submap;
  for (std::uint32_t value = map_->keyframes().end_id().value; value-- > 0;) {
    const Keyframe* keyframe = map_->keyframes().find(KeyframeId{value});
    if (!keyframe || keyframe->submap != submap) continue;
    keyframes.push_back(KeyframeId{value});
    if (keyframes.size() == kRecoveryKeyframes) break;
  }
  return keyframes;
}

void Tracker::refresh_local_map(const Frame& frame) {
  if (local_map_source_ == map_ && ++local_map_age_ < kMaxLocalMapAge) return;
  std::vector<LandmarkId> seen;
  for (std::uint32_t i = 0; i < frame.features->num_primary; ++i) {
    if (landmarks_[i].is_valid()) seen.push_back(landmarks_[i]);
  }
  gather_local_map(*map_, seen, last_pose_.reference, local_);
  local_map_source_ = map_;
  local_map_age_ = 0;
}

LocatedFrame Tracker::locate_in_local_map(const Frame& frame, const LocatedFrame& first) {
  refresh_local_map(frame);
  is_taken_.assign(frame.features->num_primary, 0);
  std::vector<LandmarkId> found;
  for (std::uint32_t i = 0; i < frame.features->num_primary; ++i) {
    if (!landmarks_[i].is_valid()) continue;
    is_taken_[i] = 1;
    found.push_back(landmarks_[i]);
  }
  std::sort(found.begin(), found.end());
  const ProjectionMatches& matches = matcher_.match(local_.landmarks,
                                                    *frame.features,
                                                    is_taken_,
                                                    first.rig_from_world,
                                                    {.radius_px = kLocatedRadiusPx});
  for (std::size_t i = 0; i < local_.landmarks.size(); ++i) {
    const LandmarkId id = local_.landmarks.ids[i];
    if (matches.features[i] == kNoFeature) continue;
    if (std::binary_search(found.begin(), found.end(), id)) continue;
    landmarks_[matches.features[i]] = id;
  }
  const LocatedFrame located =
      locator_.locate(*frame.features, *map_, first.rig_from_world, landmarks_);
  count_sightings(matches);
  return located;
}

void Tracker::count_sightings(const ProjectionMatches& matches) {
  if (purpose_ == TrackingPurpose::kLocalizing) return;
  for (std::size_t i = 0; i < local_.landmarks.size(); ++i) {
    if (matches.is_visible[i]) sightings_.push_back({local_.landmarks.ids[i], 1, 0});
  }
  for (std::size_t i = 0; i < is_taken_.size(); ++i) {  // Primary features only.
    if (landmarks_[i].is_valid()) sightings_.push_back({landmarks_[i], 0, 1});
  }
  constexpr std::size_t kMany = 100'000;  // At rest no keyframe takes them.
  if (sightings_.size() > kMany) sightings_ = take_sightings();
}

TrackOutcome Tracker::accept(const Frame& frame, const LocatedFrame& located) {
  TrackOutcome outcome;
  outcome.is_relocalized = mode_ == Mode::kLost;
  mode_ = Mode::kTracking;
  num_lost_ = 0;
  outcome.state = FrameState::kTracked;
  outcome.submap = map_->keyframes().at(local_.reference).submap;
  outcome.rig_from_world = located.rig_from_world;
  outcome.covariance = located.covariance;
  outcome.num_matches = located.num_matches;
  outcome.num_inliers = located.num_inliers;
  outcome.seen = seen_landmarks(*frame.features, landmarks_);
  outcome.landmarks = landmarks_;
  const Keyframe& reference = map_->keyframes().at(local_.reference);
  outcome.pose = RelativePose{local_.reference,
                              located.rig_from_world * reference.rig_from_world.inverse(),
                              reference.applied_scale};
  if (purpose_ == TrackingPurpose::kLocalizing) return outcome;
  if (should_make_keyframe(assess(frame, located), settings_)) {
    outcome.message = make_keyframe(frame, *outcome.pose);
    outcome.keyframe = KeyframeId{num_sent_ - 1};
  }
  return outcome;
}

TrackOutcome Tracker::lose(const Frame& frame, const PlaceDiagnosis& diagnosis, StageTimes& times) {
  if (mode_ != Mode::kLost) {
    mode_ = Mode::kLost;
    num_lost_ = 0;
    motion_.reset();
    initializer_.reset();
  }
  ++num_lost_;
  // With keyframes outstanding a new sub-map could not show in the next frame.
  const bool is_up_to_date = num_sent_ == map_->keyframes().end_id().value;
  const bool may_start = purpose_ == TrackingPurpose::kMapping && is_up_to_date;
  if (may_start && (!has_range_ || num_lost_ > kPatience)) {
    StageTimer timer(times, Stage::kInitialize);
    if (auto started = start_submap(frame)) return *std::move(started);
  }
  TrackOutcome outcome;
  outcome.state = FrameState::kLost;
  outcome.reason = diagnosis.reason;
  outcome.num_candidates = diagnosis.num_candidates;
  outcome.num_matches = diagnosis.num_matches;
  outcome.num_inliers = diagnosis.num_inliers;
  return outcome;
}

KeyframeSituation Tracker::assess(const Frame& frame, const LocatedFrame& located) const {
  const Keyframe& reference = map_->keyframes().at(local_.reference);
  const std::size_t age = map_->keyframes().end_id().value - submap_start_;
  const std::size_t established = std::min(kEstablishedObservers, age);
  KeyframeSituation situation;
  situation.has_range = has_range_;
  situation.num_pending = num_sent_ - map_->keyframes().end_id().value;
  situation.frames_since_keyframe = static_cast<int>(frame.id.value - last_keyframe_frame_.value);
  for (std::uint32_t i = 0; i < reference.features->num_primary; ++i) {
    const Landmark* landmark = map_->landmarks().find(reference.landmarks[i]);
    situation.num_reference += landmark && num_observers(*landmark) >= established;
  }
  const Eigen::Vector3d centre = located.rig_from_world.origin_in_source();
  const Eigen::Vector3d reference_centre = reference.rig_from_world.origin_in_source();
  std::vector<double> parallaxes_px;
  for (std::uint32_t i = 0; i < frame.features->num_primary; ++i) {
    const bool is_near = has_range_ && has_reliable_range(*rig_, *frame.features, i);
    situation.num_near_tracked += is_near && landmarks_[i].is_valid();
    situation.num_near_untracked += is_near && !landmarks_[i].is_valid();
    if (!landmarks_[i].is_valid()) continue;
    const Landmark& landmark = map_->landmarks().at(landmarks_[i]);
    situation.num_shared +=
        num_observers(landmark) >= established && is_observed_by(landmark, local_.reference);
    const Eigen::Vector3d& point = landmark.position_in_world;
    const Eigen::Vector3d a = (point - centre).normalized();
    const Eigen::Vector3d b = (point - reference_centre).normalized();
    parallaxes_px.push_back((a - b).norm() / pixel_rad_);
  }
  if (!parallaxes_px.empty()) situation.median_parallax_px = median(parallaxes_px);
  return situation;
}

NewKeyframe Tracker::make_keyframe(const Frame& frame, const RelativePose& pose) {
  NewKeyframe keyframe;
  keyframe.frame = frame.id;
  keyframe.timestamp_ns = frame.timestamp_ns;
  keyframe.pose = pose;
  keyframe.features = frame.features;
  keyframe.landmarks = landmarks_;
  keyframe.sightings = take_sightings();
  last_keyframe_frame_ = frame.id;
  ++num_sent_;
  return keyframe;
}

std::vector<Sighting> Tracker::take_sightings() {
  std::stable_sort(sightings_.begin(), sightings_.end(), [](const Sighting& a, const Sighting& b) {
    return a.landmark < b.landmark;
  });
  std::vector<Sighting> merged;
  for (const Sighting& sighting : sightings_) {
    if (merged.empty() || merged.back().landmark != sighting.landmark) {
      merged.push_back({sighting.landmark, 0, 0});
    }
    merged.back().num_visible += sighting.num_visible;
    merged.back().num_found += sighting.num_found;
  }
  sightings_.clear();
  return merged;
}

}  // namespace waymark

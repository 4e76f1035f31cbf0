// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/pose_search.h"

#include <algorithm>
#include <array>
#include <utility>

#include "waymark/features/feature_geometry.h"
#include "waymark/track/keyframes_near.h"
#include "waymark/track/search_radius.h"

namespace waymark {
namespace {

/// Where the rig rests landmarks are found where they were, in pixels of their level. It has come
/// to rest where that part of them is, and where it moved less from frame to frame, by
/// distance_from(); then people may hide nearly all, and for a while all of it. After that it went
/// straight on at a constant speed.
constexpr double kRestRadiusPx = 2.0;
constexpr double kRestPart = 0.1;
constexpr double kRestMotion = 0.001;
constexpr double kRestOffsetPx = 0.4;
constexpr int kMaxUnseen = 10;  // Frames; nor more than showed the rest.

/// Around a prediction, and when that fails.
std::array<double, 2> search_radii_px(const Frame& frame, const PoseSearchOptions& options) {
  const Camera& camera = *frame.features->rig->cameras[0].camera;
  return {search_radius_px(camera, options.predicted_radius_px, options.predicted_part),
          search_radius_px(camera, options.wide_radius_px, options.wide_part)};
}

/// Whether the camera cannot be far from its last pose.
bool is_recent(const PoseSearch::Context& context, const PoseSearchOptions& options) {
  return context.last.has_pose() && context.num_lost < options.recovery_frames;
}

/// The frame as it would be with the motion that its pose shows; of a rolling shutter alone.
void straighten(Frame& frame, const PoseSearch::Context& context, const LocatedFrame& located) {
  if (context.is_lost || frame.features->rig->cameras[0].readout_s == 0.0) return;
  const RigMotion motion = context.last.motion_in(
      *context.visible.map, frame, located.rig_from_world, located.landmarks);
  frame.features = moved(frame.features, motion);
}

}  // namespace

/// A way to a pose.
struct PoseSearch::Step {
  std::string_view name;
  Stage stage;
  bool (*is_possible)(const Context&, const PoseSearchOptions&);
  Found (PoseSearch::*locate)(Frame&, const Context&);
  bool is_alternative = false;  ///< Only where the steps before had nothing to be confirmed.
  bool is_confirmed = false;    ///< By itself, without the local map.
};

const std::array<PoseSearch::Step, 7> PoseSearch::kSteps = {{
    {.name = "rest",
     .stage = Stage::kPredict,
     .is_possible = [](const Context& context,
                       const PoseSearchOptions&) { return !context.is_lost; },
     .locate = &PoseSearch::at_rest,
     .is_alternative = true,
     .is_confirmed = true},
    {.name = "motion",
     .stage = Stage::kPredict,
     .is_possible = [](const Context& context,
                       const PoseSearchOptions&) { return !context.is_lost; },
     .locate = &PoseSearch::by_motion,
     .is_alternative = true},
    {.name = "inertial",
     .stage = Stage::kRecover,
     .is_possible = [](const Context& context,
                       const PoseSearchOptions&) { return context.last.has_pose(); },
     .locate = &PoseSearch::by_dead_reckoning,
     .is_alternative = true},
    {.name = "last pose",
     .stage = Stage::kRecover,
     .is_possible =
         [](const Context& context, const PoseSearchOptions& options) {
           return context.is_lost && is_recent(context, options);
         },
     .locate = &PoseSearch::near_last_pose,
     .is_alternative = true},
    {.name = "keyframes nearby",
     .stage = Stage::kRecover,
     .is_possible = is_recent,
     .locate = &PoseSearch::by_keyframes_nearby,
     .is_alternative = true},
    {.name = "patches",
     .stage = Stage::kRecover,
     .is_possible =
         [](const Context& context, const PoseSearchOptions&) {
           return !context.is_lost && context.last.image();
         },
     .locate = &PoseSearch::by_patches,
     .is_confirmed = true},
    {.name = "places",
     .stage = Stage::kRecover,
     .is_possible = [](const Context&, const PoseSearchOptions&) { return true; },
     .locate = &PoseSearch::anywhere},
}};

std::optional<LocatedFrame> PoseSearch::locate(Frame& frame,
                                               const Context& context,
                                               StageTimes& times) {
  const bool is_motion_known = !context.is_lost || is_recent(context, options());
  if (is_motion_known) context.last.carry_over(*context.visible.map);
  check_.begin(is_motion_known ? std::optional(context.last.predict(frame.timestamp_ns, frame.turn))
                               : std::nullopt);
  found_by_ = {};
  bool has_found = false;
  for (const Step& step : kSteps) {
    if (!step.is_possible(context, options()) || (step.is_alternative && has_found)) continue;
    Found found;
    {
      StageTimer timer(times, step.stage);
      found = (this->*step.locate)(frame, context);
    }
    has_found = has_found || found.has_value();
    if (found && !step.is_confirmed) {
      StageTimer timer(times, Stage::kLocalMap);
      if (step.is_alternative) straighten(frame, context, *found);
      found = confirm_in_local_map(frame, context, *std::move(found));
    }
    if (!found) continue;
    found_by_ = step.name;
    return found;
  }
  return std::nullopt;
}

std::optional<LocatedFrame> PoseSearch::at_rest(Frame& frame, const Context& context) {
  if (!frame.is_at_rest) {
    resting_.reset();
    num_rested_ = num_unseen_ = 0;
  }
  if (!frame.is_at_rest || num_unseen_ > std::min(kMaxUnseen, num_rested_)) return std::nullopt;
  const Map& map = *context.visible.map;
  const Rigid3 rig_from_world = resting_.value_or(context.last.rig_from_world());
  local_map_.refresh(
      context.visible.map,
      [&] { return context.last.landmarks(map).ids; },
      context.last.reference());
  std::vector<LandmarkId> visible;
  std::vector<LandmarkId> stay = locator_.find(*frame.features,
                                               local_map().landmarks,
                                               rig_from_world,
                                               {.radius_px = kRestRadiusPx},
                                               &visible);
  const double part = static_cast<double>(num_valid(stay)) / static_cast<double>(visible.size());
  const bool is_seen = num_valid(stay) >= settings_.min_inliers;
  if (is_seen &&
      median_offset_px(*frame.features, map, stay, rig_from_world).norm() > kRestOffsetPx) {
    num_unseen_ = kMaxUnseen + 1;  // All of it begins to move.
    return std::nullopt;
  }
  num_unseen_ = is_seen ? 0 : num_unseen_ + 1;
  if (!resting_ && num_unseen_ > 0) return std::nullopt;
  LocatedFrame located = locator_.locate(*frame.features, map, rig_from_world, std::move(stay));
  located.rig_from_world = rig_from_world;
  const Rigid3 predicted = context.last.predict(frame.timestamp_ns);
  const bool comes_to_rest =
      part > kRestPart && distance_from(predicted, map, located) < kRestMotion;
  if (!resting_ && !comes_to_rest) return std::nullopt;
  located.visible = std::move(visible);
  resting_ = rig_from_world;
  num_rested_ += num_unseen_ == 0;
  return located;
}

std::optional<LocatedFrame> PoseSearch::by_motion(Frame& frame, const Context& context) {
  const Rigid3 predicted = context.last.predict(frame.timestamp_ns, frame.turn);
  const auto [radius_px, wide_radius_px] = search_radii_px(frame, options());
  if (auto located = locate_near(frame, context, predicted, radius_px)) return located;
  Found wide = locate_near(frame, context, predicted, wide_radius_px);
  Found by_image = locate_by_image(frame, context);
  const bool is_better = by_image && (!wide || by_image->num_inliers > wide->num_inliers);
  return is_better ? by_image : wide;
}

std::optional<LocatedFrame> PoseSearch::by_dead_reckoning(Frame& frame, const Context& context) {
  const std::optional<ReckonedPose> reckoned =
      frame.dead_reckon ? frame.dead_reckon() : std::nullopt;
  if (!reckoned) return std::nullopt;
  const Map& map = *context.visible.map;
  context.last.carry_over(map);
  const Rigid3 predicted = reckoned->rig_from_rig_then * context.last.rig_from_world();
  check_.begin(predicted);
  Found found = locate_near(frame, context, predicted, search_radii_px(frame, options()).back());
  if (!found || found->num_inliers < settings_.min_inliers) {
    const KeyframeId reference = map.resolve(context.last.reference());
    const std::vector<KeyframeId> near =
        keyframes_near(map,
                       map.keyframes().at(reference).submap,
                       *frame.features->rig,
                       predicted,
                       static_cast<std::size_t>(options().recovery_keyframes));
    found = relocalizer_.locate_among(frame, map, near, LastPlace{reference, predicted});
  }
  if (!found) return std::nullopt;
  local_map_.forget();
  context.last.forget_motion();
  return found;
}

std::optional<LocatedFrame> PoseSearch::near_last_pose(Frame& frame, const Context& context) {
  const auto is_enough = [&](const Found& found) {
    return found && found->num_inliers >= settings_.min_inliers;
  };
  Found found = locate_near(frame,
                            context,
                            context.last.predict(frame.timestamp_ns, frame.turn),
                            search_radii_px(frame, options()).back());
  if (!is_enough(found)) found = locate_by_image(frame, context);
  if (!is_enough(found)) return std::nullopt;
  local_map_.forget();
  return found;
}

std::optional<LocatedFrame> PoseSearch::by_keyframes_nearby(Frame& frame, const Context& context) {
  for (const KeyframeId id : keyframes_nearby(context)) {
    if (auto located = locate_near_keyframe(frame, *context.visible.map, id)) {
      local_map_.forget();
      return located;
    }
  }
  return std::nullopt;
}

std::optional<LocatedFrame> PoseSearch::by_patches(Frame& frame, const Context& context) {
  const Map& map = *context.visible.map;
  local_map_.gather_once(
      context.visible.map,
      [&] { return context.last.landmarks(map).ids; },
      context.last.reference());
  const LandmarkSet& around = local_map().landmarks;
  const LocatedPatches before{*context.last.image(), context.last.rig_from_world()};
  const Rigid3 predicted = context.last.predict(frame.timestamp_ns, frame.turn);
  const auto aligned =
      patch_locator_.align(before, around, well_known(around, map), frame, predicted);
  if (!aligned) return std::nullopt;
  LocatedFrame located = patch_locator_.pose_of(*frame.features->rig, before, *aligned);
  located.landmarks = locator_.find(*frame.features,
                                    around,
                                    located.rig_from_world,
                                    {.radius_px = options().located_radius_px},
                                    &located.visible);
  Frame with_patches = frame;
  patch_locator_.add_features(*aligned, around, with_patches, located);
  if (located.num_inliers < settings_.min_inliers) return std::nullopt;
  if (!check_.is_verified(*frame.features, map, located, locator_)) return std::nullopt;
  frame = std::move(with_patches);
  return located;
}

std::optional<LocatedFrame> PoseSearch::anywhere(Frame& frame, const Context& context) {
  const Map& map = *context.visible.map;
  std::optional<LastPlace> last;
  if (context.last.has_pose() && context.num_lost < options().patience_frames) {
    last = {map.resolve(context.last.reference()), context.last.rig_from_world()};
  }
  Found located = relocalizer_.locate_at_markers(frame, map);
  if (!located) located = relocalizer_.locate(frame, map, *context.visible.places, last);
  if (!located) return std::nullopt;
  local_map_.forget();
  context.last.forget_motion();
  return located;
}

std::optional<LocatedFrame> PoseSearch::locate_near(const Frame& frame,
                                                    const Context& context,
                                                    const Rigid3& rig_from_world,
                                                    double radius_px) {
  const Map& map = *context.visible.map;
  std::vector<LandmarkId> matched = locator_.find(
      *frame.features, context.last.landmarks(map), rig_from_world, {.radius_px = radius_px});
  if (num_valid(matched) < settings_.min_inliers) return std::nullopt;
  LocatedFrame located = locator_.locate(*frame.features, map, rig_from_world, std::move(matched));
  if (located.num_inliers < settings_.min_inliers / 2) return std::nullopt;
  return located;
}

std::optional<LocatedFrame> PoseSearch::locate_by_image(const Frame& frame,
                                                        const Context& context) {
  const std::optional<Rigid3> predicted = predict_by_image(frame, context);
  if (!predicted) return std::nullopt;
  for (const double radius_px : search_radii_px(frame, options())) {
    if (auto located = locate_near(frame, context, *predicted, radius_px)) return located;
  }
  return std::nullopt;
}

std::optional<Rigid3> PoseSearch::predict_by_image(const Frame& frame, const Context& context) {
  const LastFrame& last = context.last;
  if (!frame.image || !last.image()) return std::nullopt;
  const RigCamera& camera = frame.features->rig->cameras[0];
  const RotationAlignment turn =
      rotation_aligner_.align(camera.camera, *last.image(), *frame.image);
  if (!turn.is_certain()) return std::nullopt;
  const Eigen::Quaterniond cam_from_rig = camera.cam_from_rig.rotation;
  const Eigen::Quaterniond rig_turn = cam_from_rig.conjugate() * turn.b_from_a * cam_from_rig;
  const Eigen::Quaterniond rotation = (rig_turn * last.rig_from_world().rotation).normalized();
  const Eigen::Vector3d centre = last.predict(frame.timestamp_ns, frame.turn).origin_in_source();
  return Rigid3(rotation, -(rotation * centre));
}

std::vector<KeyframeId> PoseSearch::keyframes_nearby(const Context& context) const {
  const Map& map = *context.visible.map;
  const SubmapId submap = map.keyframes().at(map.resolve(context.last.reference())).submap;
  std::vector<KeyframeId> keyframes;
  const auto add = [&](KeyframeId id) {
    const Keyframe* keyframe = map.keyframes().find(id);
    const bool is_known = std::ranges::find(keyframes, id) != keyframes.end();
    if (keyframe && keyframe->submap == submap && !is_known) keyframes.push_back(id);
    return keyframes.size() < static_cast<std::size_t>(options().recovery_keyframes);
  };
  for (const KeyframeId id : local_map().keyframes) {
    if (!add(id)) return keyframes;
  }
  if (!context.is_extending) return keyframes;
  // A sub-map that has just begun has no local map yet.
  for (std::uint32_t value = map.keyframes().end_id().value; value-- > 0;) {
    if (!add(KeyframeId{value})) break;
  }
  return keyframes;
}

std::optional<LocatedFrame> PoseSearch::locate_near_keyframe(const Frame& frame,
                                                             const Map& map,
                                                             KeyframeId id) {
  const Keyframe& keyframe = map.keyframes().at(id);
  std::vector<LandmarkId> matched = locator_.find_alike(*frame.features, keyframe);
  if (num_valid(matched) < settings_.min_inliers) return std::nullopt;
  LocatedFrame located =
      locator_.locate(*frame.features, map, keyframe.rig_from_world, std::move(matched));
  if (located.num_inliers < settings_.min_inliers) return std::nullopt;
  return located;
}

std::optional<LocatedFrame> PoseSearch::confirm_in_local_map(const Frame& frame,
                                                             const Context& context,
                                                             LocatedFrame first) {
  const Map& map = *context.visible.map;
  local_map_.refresh(
      context.visible.map,
      [&] { return primary_landmarks(*frame.features, first.landmarks); },
      context.last.reference());
  LocatedFrame located = locator_.locate_again(*frame.features,
                                               map,
                                               std::move(first),
                                               local_map().landmarks,
                                               {.radius_px = options().located_radius_px});
  if (located.num_inliers < settings_.min_inliers) return std::nullopt;
  if (check_.is_verified(*frame.features, map, located, locator_)) return located;
  local_map_.forget();
  return std::nullopt;
}

void PoseSearch::continue_in(const Map& map) { local_map_.continue_in(map); }

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/system/frame_preparation.h"

#include <optional>
#include <utility>

namespace waymark {
namespace {

FrameSettings frame_settings(const Settings& settings) {
  return {settings.features, settings.stereo, settings.depth, settings.view};
}

}  // namespace

FramePreparation::FramePreparation(std::shared_ptr<const Rig> rig,
                                   const Settings& settings,
                                   unsigned num_threads)
    : builder_(std::move(rig), frame_settings(settings)),
      prefetch_(builder_, frame_settings(settings), num_threads),
      marker_finder_(settings.markers) {}

void FramePreparation::set_calibration(std::shared_ptr<const Rig> rig) {
  if (rig != builder_.rig()) builder_.set_calibration(std::move(rig));
}

Frame FramePreparation::make_frame(FrameId id,
                                   const FrameImages& images,
                                   const std::function<RigMotion()>& motion,
                                   TrackingResult& result) {
  auto features = build(images, motion, result.stages);
  result.num_features = static_cast<std::uint32_t>(features->num_primary);
  return {id,
          images.timestamp_ns,
          std::move(features),
          builder_.small_image(),
          marker_finder_.search_in(images, rig())};
}

std::shared_ptr<const Features> FramePreparation::build(const FrameImages& images,
                                                        const std::function<RigMotion()>& motion,
                                                        StageTimes& times) {
  const RigMotion predicted = builder_.needs_motion(images) ? motion() : RigMotion{};
  std::optional<FoundFrame> found;
  {
    StageTimer timer(times, Stage::kWait);
    found = prefetch_.take(images);
  }
  auto features = found ? builder_.build(*std::move(found), images, predicted)
                        : builder_.build(images, predicted);
  times[Stage::kFeatures] = builder_.times().features_ms;
  times[Stage::kDepth] = builder_.times().depth_ms;
  return features;
}

void FramePreparation::watch(ImageView image0, TrackingResult& result) {
  if (!result.world_from_rig) return;
  StageTimer timer(result.stages, Stage::kFeatures);
  const Rigid3 world_from_cam = *result.world_from_rig * rig()->cameras[0].cam_from_rig.inverse();
  builder_.watch({image0, world_from_cam.rotation, *result.features, result.landmarks},
                 result.submap == watched_submap_);
  watched_submap_ = result.submap;
}

}  // namespace waymark

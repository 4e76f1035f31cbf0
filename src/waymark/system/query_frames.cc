// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/system/query_frames.h"

#include <algorithm>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/base/median.h"
#include "waymark/camera/pixel_angles.h"
#include "waymark/camera/scaled_camera.h"
#include "waymark/image/convert.h"

namespace waymark {
namespace {

/// Images that are finer than those of the map by less are taken as they are.
constexpr double kMinReduction = 0.8;
/// No side becomes shorter than this.
constexpr double kMinSidePx = 120.0;

double reduction_for(const Rig& rig, double map_pixel_angle) {
  if (map_pixel_angle == 0.0) return 1.0;
  const Camera& camera = *rig.cameras.at(0).camera;
  const double smallest = kMinSidePx / std::min(camera.width_px(), camera.height_px());
  const double reduction = std::max(central_pixel_angle(camera) / map_pixel_angle, smallest);
  return reduction < kMinReduction ? reduction : 1.0;
}

Rig reduced(Rig rig, double factor) {
  if (factor == 1.0) return rig;
  const auto resized = [factor](std::shared_ptr<const Camera> camera) {
    return std::make_shared<const ScaledCamera>(std::move(camera), factor);
  };
  for (RigCamera& camera : rig.cameras) {
    camera.camera = resized(camera.camera);
    if (!camera.remake) continue;
    camera.remake = [resized, remake = camera.remake](const CameraDescription& description) {
      return resized(remake(description));
    };
  }
  return rig;
}

}  // namespace

double middling_pixel_angle(const Map& map) {
  std::map<const Camera*, double> angle_of_camera;
  std::vector<double> angles;
  map.keyframes().for_each([&](KeyframeId, const Keyframe& keyframe) {
    const Camera* camera = keyframe.rig().cameras.at(0).camera.get();
    const auto [at, is_new] = angle_of_camera.try_emplace(camera, 0.0);
    if (is_new) at->second = central_pixel_angle(*camera);
    angles.push_back(at->second);
  });
  return angles.empty() ? 0.0 : median(angles);
}

QueryFrames::QueryFrames(Rig rig, const Settings& settings, double map_pixel_angle, bool uses_range)
    : full_rig_(std::make_shared<const Rig>(
          with_depth_offset(std::move(rig), settings.depth.inverse_offset))),
      reduction_(reduction_for(*full_rig_, map_pixel_angle)),
      uses_range_(uses_range),
      builder_(reduced(*full_rig_, reduction_),
               {settings.features, settings.stereo, settings.depth, settings.view}),
      marker_finder_(settings.markers) {}

Rig QueryFrames::full_rig() const {
  Rig rig = *full_rig_;
  for (std::size_t c = 0; c < rig.cameras.size(); ++c) {
    const RigCamera& now = builder_.rig()->cameras[c];
    rig.cameras[c].cam_from_rig = now.cam_from_rig;
    rig.cameras[c].description = now.description;
    rig.cameras[c].readout_s = now.readout_s;
    if (rig.cameras[c].remake) rig.cameras[c].camera = rig.cameras[c].remake(*now.description);
  }
  return rig;
}

Frame QueryFrames::build_next(const FrameImages& images,
                              const RigMotion& motion,
                              TrackingResult& result) {
  if (last_timestamp_ns_ && images.timestamp_ns <= *last_timestamp_ns_) {
    throw InputError("frame " + std::to_string(num_frames_),
                     "time stamp is not later than that of the frame before");
  }
  Frame frame = build(images, motion, result);
  last_timestamp_ns_ = images.timestamp_ns;
  return frame;
}

Frame QueryFrames::build(const FrameImages& images,
                         const RigMotion& motion,
                         TrackingResult& result) {
  FrameImages used = images;
  if (!uses_range_) used.image1 = {}, used.depth = {};
  auto features = find_features(used, motion);
  result.num_features = static_cast<std::uint32_t>(features->num_primary);
  Frame frame{FrameId{num_frames_},
              images.timestamp_ns,
              std::move(features),
              builder_.small_image(),
              marker_finder_.search_in(images, full_rig_)};
  ++num_frames_;
  result.frame = frame.id;
  result.stages[Stage::kFeatures] = builder_.times().features_ms;
  result.stages[Stage::kDepth] = builder_.times().depth_ms;
  return frame;
}

std::shared_ptr<const Features> QueryFrames::find_features(const FrameImages& images,
                                                           const RigMotion& motion) {
  if (reduction_ == 1.0) return builder_.build(images, motion);
  check_sizes(images, *full_rig_);
  const Image image0 = reduce(images.image0, reduction_);
  Image image1, mask;
  DepthImage depth;
  if (!images.image1.is_empty()) image1 = reduce(images.image1, reduction_);
  if (!images.depth.is_empty()) depth = pick_reduced(images.depth, reduction_);
  if (!images.mask.is_empty()) mask = pick_reduced(images.mask, reduction_);
  FrameImages smaller = images;
  smaller.image0 = image0.view(), smaller.image1 = image1.view();
  smaller.depth = depth.view(), smaller.mask = mask.view();
  return builder_.build(smaller, motion);
}

}  // namespace waymark

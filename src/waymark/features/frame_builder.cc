// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/features/frame_builder.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/features/feature_geometry.h"
#include "waymark/features/rolling_shutter.h"

namespace waymark {
namespace {

/// Moves keypoints and their bearings to where they were when the depth image was taken: lag_s
/// after the frame's time, all rows at once.
void move_to_depth(const RigCamera& camera,
                   const RigMotion& motion,
                   float lag_s,
                   const Features& features,
                   std::span<Keypoint> keypoints,
                   std::span<Eigen::Vector3f> bearings) {
  const auto readout_s = static_cast<float>(camera.readout_s);
  for (std::size_t i = 0; i < keypoints.size(); ++i) {
    Keypoint& keypoint = keypoints[i];
    const float seconds = lag_s - readout_s * row_delay(*camera.camera, keypoint.y_px);
    const Eigen::Vector3f shift = seconds * bearing_rate(motion, camera, features, i);
    const Eigen::Vector2f shift_px = static_cast<float>(Pyramid::scale(keypoint.level)) *
                                     (features.level_pixel_from_bearing[i] * shift);
    keypoint.x_px += shift_px.x();
    keypoint.y_px += shift_px.y();
    bearings[i] = (bearings[i] + shift).normalized();
  }
}

}  // namespace

FrameBuilder::FrameBuilder(std::shared_ptr<const Rig> rig, const FrameSettings& settings)
    : rig_(std::move(rig)),
      depth_(settings.depth),
      is_auto_masked_(settings.view.is_auto_masked()),
      finder_(rig_, settings) {
  for (const RigCamera& camera : rig_->cameras) {
    view_masks_.emplace_back(camera.camera, settings.view);
  }
}

void FrameBuilder::set_calibration(std::shared_ptr<const Rig> rig) {
  rig_ = std::move(rig);
  depth_.inverse_offset = rig_->inverse_depth_offset;
}

FrameView FrameBuilder::view() const {
  FrameView view{rig_, {}};
  for (const ViewMask& mask : view_masks_) view.masks.push_back(mask.levels());
  return view;
}

bool FrameBuilder::is_learning() const {
  return std::ranges::any_of(view_masks_, &ViewMask::is_learning);
}

std::shared_ptr<const Features> FrameBuilder::build(const FrameImages& images,
                                                    const RigMotion& motion) {
  check_sizes(images, *rig_);
  view_masks_[0].learn(images.image0);
  if (!images.image1.is_empty()) view_masks_[1].learn(images.image1);
  return build(finder_.find(images, view()), images, motion);
}

std::shared_ptr<const Features> FrameBuilder::build(FoundFrame found,
                                                    const FrameImages& images,
                                                    const RigMotion& motion) {
  Features& features = *found.features;
  times_ = found.times;
  small_image_ = std::move(found.small_image);
  if (images.image1.is_empty() && !images.depth.is_empty()) {
    const auto start = std::chrono::steady_clock::now();
    add_depth(images, motion, features);
    const std::chrono::duration<double, std::milli> taken =
        std::chrono::steady_clock::now() - start;
    times_.depth_ms = taken.count();
  }
  keep_across(features);
  return moved(std::move(found.features), motion);
}

void FrameBuilder::watch(const LocatedImage& located, bool is_same_world) {
  if (is_auto_masked_) view_masks_[0].watch(located, is_same_world);
}

bool FrameBuilder::needs_motion(const FrameImages& images) const {
  const bool has_lag = images.depth_lag_ns != 0 || depth_.lag_ms != 0.0;
  return rig_->cameras[0].readout_s != 0.0 || (!images.depth.is_empty() && has_lag);
}

/// Looks where the features were when the depth image was taken, all at once, and how far away
/// they were at the frame's time.
void FrameBuilder::add_depth(const FrameImages& images,
                             const RigMotion& motion,
                             Features& features) {
  const RigCamera& camera = rig_->cameras[0];
  const float lag_s =
      1e-9f * static_cast<float>(images.depth_lag_ns) + 1e-3f * static_cast<float>(depth_.lag_ms);
  keypoints_.assign(features.keypoints.begin(), features.keypoints.end());
  FeatureArray<Eigen::Vector3f> bearings = features.bearings;
  if (motion != RigMotion{}) move_to_depth(camera, motion, lag_s, features, keypoints_, bearings);
  sample_depth(images.depth,
               depth_,
               keypoints_,
               bearings,
               features.level_pixel_from_bearing,
               features.num_edges,
               features.range_m,
               features.inverse_range_sigma);
  features.inverse_depth_offset = static_cast<float>(depth_.inverse_offset);
  const Eigen::Vector3f shift = lag_s * camera_shift(motion, camera);
  for (std::size_t i = 0; i < keypoints_.size(); ++i) {
    const float farther_m = bearings[i].dot(shift);
    if (features.range_m[i] > 2.0f * std::abs(farther_m)) features.range_m[i] -= farther_m;
  }
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/image/frame_builder.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/image/brief.h"
#include "waymark/image/feature_geometry.h"
#include "waymark/image/rolling_shutter.h"
#include "waymark/image/small_image.h"

namespace waymark {
namespace {

template <class T>
void check_size(const BasicImageView<T>& image, const Camera& camera, const char* where) {
  if (image.width_px == camera.width_px() && image.height_px == camera.height_px()) return;
  throw InputError(where,
                   fmt::format("{} x {} px, expected {} x {} as calibrated",
                               image.width_px,
                               image.height_px,
                               camera.width_px(),
                               camera.height_px()));
}

/// Columns repeated at the seam, so that the patches of all levels that are centred in the image
/// lie within, with some room for rounding and cropped columns.
int seam_margin_px(const Camera& camera) {
  const double patch_px = (kBriefRadius + 2) * Pyramid::scale(Pyramid::kNumLevels - 1);
  return std::min(static_cast<int>(std::ceil(patch_px)), camera.width_px());
}

double ms_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
      .count();
}

/// An image of all directions is given half as many features again: as many that tell of the
/// motion as other cameras see, and those ahead and behind, which tell little.
FeatureSettings settings_for(const Rig& rig, FeatureSettings settings) {
  WAYMARK_CHECK(!rig.cameras.empty());
  if (rig.cameras[0].camera->wrap_width_px() > 0.0) settings.count += settings.count / 2;
  return settings;
}

void resize(Image& image, int width_px, int height_px) {
  if (image.width_px != width_px || image.height_px != height_px) image = {width_px, height_px};
}

/// Moves keypoints and their bearings to where they were when the depth image was taken: lag_s
/// after the frame's time, all rows at once.
void move_to_depth(const RigCamera& camera,
                   const RigMotion& motion,
                   float lag_s,
                   const Features& features,
                   std::vector<Keypoint>& keypoints,
                   std::vector<Eigen::Vector3f>& bearings) {
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

ImageView SeamPadding::widen(ImageView image) {
  WAYMARK_CHECK(margin_px_ >= 0 && margin_px_ <= image.width_px);
  resize(image_, image.width_px + 2 * margin_px_, image.height_px);
  for (int y = 0; y < image.height_px; ++y) {
    const std::uint8_t* const row = image.row(y);
    std::uint8_t* next =
        std::copy(row + image.width_px - margin_px_, row + image.width_px, image_.row(y));
    next = std::copy(row, row + image.width_px, next);
    std::copy(row, row + margin_px_, next);
  }
  return image_.view();
}

ImageView SeamPadding::widen_mask(ImageView mask,
                                  int width_px,
                                  int height_px,
                                  std::uint8_t otherwise) {
  resize(mask_, width_px + 2 * margin_px_, height_px);
  std::fill(mask_.values.begin(), mask_.values.end(), std::uint8_t{0});
  for (int y = 0; y < height_px; ++y) {
    std::uint8_t* const row = mask_.row(y) + margin_px_;
    if (mask.is_empty()) {
      std::fill(row, row + width_px, otherwise);
    } else {
      std::copy(mask.row(y), mask.row(y) + width_px, row);
    }
  }
  return mask_.view();
}

FrameBuilder::FrameBuilder(Rig rig, const FrameSettings& settings)
    : rig_(std::move(rig)),
      settings_(settings),
      is_auto_masked_(settings.view.is_auto_masked()),
      extractor_(settings_for(rig_, settings.features)) {
  for (const RigCamera& camera : rig_.cameras) {
    view_masks_.emplace_back(camera.camera, settings.view);
  }
  const Camera& camera0 = *rig_.cameras[0].camera;
  if (camera0.wrap_width_px() > 0.0) seam_.emplace(seam_margin_px(camera0));
  if (rig_.cameras.size() == 2) stereo_.emplace(rig_, settings.stereo);
}

void FrameBuilder::look_with(const Rig& rig) {
  rig_ = rig;
  settings_.depth.inverse_offset = rig.inverse_depth_offset;
  if (stereo_) stereo_.emplace(rig_, settings_.stereo);
}

void check_sizes(const FrameImages& images, const Rig& rig) {
  check_size(images.image0, *rig.cameras[0].camera, "image");
  if (!images.image1.is_empty()) {
    WAYMARK_CHECK(rig.cameras.size() == 2);
    check_size(images.image1, *rig.cameras[1].camera, "right image");
  }
  if (!images.depth.is_empty()) check_size(images.depth, *rig.cameras[0].camera, "depth image");
  if (!images.mask.is_empty()) check_size(images.mask, *rig.cameras[0].camera, "mask");
}

std::shared_ptr<const Features> FrameBuilder::build(const FrameImages& images,
                                                    const RigMotion& motion) {
  check_sizes(images, rig_);
  auto features = std::make_shared<Features>();
  const auto features_start = std::chrono::steady_clock::now();
  extract_primary(images, *features);
  times_.features_ms = ms_since(features_start);
  const auto depth_start = std::chrono::steady_clock::now();
  if (!images.image1.is_empty()) {
    add_stereo(images, *features);
  } else if (!images.depth.is_empty()) {
    add_depth(images, motion, *features);
  }
  times_.depth_ms = ms_since(depth_start);
  keep_across(*features);
  return moved(std::move(features), rig_, motion);
}

void FrameBuilder::watch(const LocatedImage& located, bool is_same_world) {
  if (is_auto_masked_) view_masks_[0].watch(located, is_same_world);
}

bool FrameBuilder::needs_motion(const FrameImages& images) const {
  const bool has_lag = images.depth_lag_ns != 0 || settings_.depth.lag_ms != 0.0;
  return rig_.cameras[0].readout_s != 0.0 || (!images.depth.is_empty() && has_lag);
}

/// Looks where the features were when the depth image was taken, all at once, and how far away
/// they were at the frame's time.
void FrameBuilder::add_depth(const FrameImages& images,
                             const RigMotion& motion,
                             Features& features) {
  const RigCamera& camera = rig_.cameras[0];
  const float lag_s = 1e-9f * static_cast<float>(images.depth_lag_ns) +
                      1e-3f * static_cast<float>(settings_.depth.lag_ms);
  keypoints_ = features.keypoints;
  std::vector<Eigen::Vector3f> bearings = features.bearings;
  if (motion != RigMotion{}) move_to_depth(camera, motion, lag_s, features, keypoints_, bearings);
  sample_depth(images.depth,
               settings_.depth,
               keypoints_,
               bearings,
               features.level_pixel_from_bearing,
               features.num_edges,
               features.range_m,
               features.inverse_range_sigma);
  features.inverse_depth_offset = static_cast<float>(settings_.depth.inverse_offset);
  const Eigen::Vector3f shift = lag_s * camera_shift(motion, camera);
  for (std::size_t i = 0; i < keypoints_.size(); ++i) {
    const float farther_m = bearings[i].dot(shift);
    if (features.range_m[i] > 2.0f * std::abs(farther_m)) features.range_m[i] -= farther_m;
  }
}

const TangentArrays& FrameBuilder::compute_tangents(const Camera& camera) {
  return tangent_computer_.compute(camera, pixels_, level_scales_);
}

std::size_t FrameBuilder::extract_keypoints(const FrameImages& images) {
  view_masks_[0].learn(images.image0);
  const ImageView mask = view_masks_[0].num_levels(images.mask);
  small_image_ = std::make_shared<const SmallImage>(make_small_image(images.image0, mask));
  if (!seam_) {
    return extractor_.extract(images.image0, mask, keypoints_, descriptors_);
  }
  const int width = images.image0.width_px;
  const ImageView wide_mask =
      seam_->widen_mask(mask, width, images.image0.height_px, Pyramid::kNumLevels);
  const std::size_t num_edges =
      extractor_.extract(seam_->widen(images.image0), wide_mask, keypoints_, descriptors_);
  for (Keypoint& keypoint : keypoints_) {
    keypoint.x_px -= static_cast<float>(seam_->margin_px());
    const auto right = static_cast<float>(width) - 0.5f;
    if (keypoint.x_px < -0.5f) keypoint.x_px += static_cast<float>(width);
    if (keypoint.x_px >= right) keypoint.x_px -= static_cast<float>(width);
  }
  return num_edges;
}

/// Features without a usable bearing are dropped.
void FrameBuilder::extract_primary(const FrameImages& images, Features& features) {
  const std::size_t num_edges = extract_keypoints(images);
  const std::size_t num_corners = keypoints_.size() - num_edges;
  pixels_.clear();
  level_scales_.clear();
  for (const Keypoint& keypoint : keypoints_) {
    pixels_.emplace_back(keypoint.x_px, keypoint.y_px);
    level_scales_.push_back(static_cast<float>(Pyramid::scale(keypoint.level)));
  }
  const Camera& camera = *rig_.cameras[0].camera;
  const TangentArrays& tangents = compute_tangents(camera);
  reserve(features, (images.image1.is_empty() ? 1 : 2) * keypoints_.size());
  features.descriptors.reserve(keypoints_.size());
  for (std::size_t i = 0; i < keypoints_.size(); ++i) {
    if (!tangents.is_valid[i]) continue;
    append(features, keypoints_[i], tangents, i);
    features.descriptors.push_back(descriptors_[i]);
    features.num_edges += i >= num_corners;
  }
  const std::size_t count = features.keypoints.size();
  features.num_primary = count;
  features.partner.assign(count, kNoFeature);
  features.range_m.assign(count, 0.0f);
  features.inverse_range_sigma.assign(count, 0.0f);
  features.grid = FeatureGrid(
      camera.width_px(), camera.height_px(), camera.wrap_width_px(), count, [&](std::size_t i) {
        return std::pair(features.keypoints[i].x_px, features.keypoints[i].y_px);
      });
}

void FrameBuilder::add_stereo(const FrameImages& images, Features& features) {
  view_masks_[1].learn(images.image1);
  pyramid1_.build(images.image1);
  if (seam_) pyramid0_.build(images.image0);
  const std::span<const StereoMatch> matches =
      stereo_->search(seam_ ? pyramid0_ : extractor_.pyramid(), pyramid1_, features);
  pixels_.clear();
  level_scales_.clear();
  for (const StereoMatch& match : matches) {
    pixels_.push_back(match.pixel);
    level_scales_.push_back(static_cast<float>(Pyramid::scale(match.level)));
  }
  const TangentArrays& tangents = compute_tangents(*rig_.cameras[1].camera);
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const StereoMatch& match = matches[i];
    if (!tangents.is_valid[i] || !view_masks_[1].allows(match.pixel, match.level)) continue;
    Keypoint keypoint = features.keypoints[match.primary];
    keypoint.x_px = static_cast<float>(match.pixel.x());
    keypoint.y_px = static_cast<float>(match.pixel.y());
    keypoint.level = match.level;
    keypoint.camera = 1;
    features.partner[match.primary] = static_cast<std::uint32_t>(features.size());
    features.partner.push_back(match.primary);
    append(features, keypoint, tangents, i);
  }
  measure_stereo_ranges(rig_, features);
}

void FrameBuilder::reserve(Features& features, std::size_t count) {
  features.keypoints.reserve(count);
  features.bearings.reserve(count);
  features.level_pixel_from_bearing.reserve(count);
  features.size_rad.reserve(count);
  features.partner.reserve(count);
}

void FrameBuilder::append(Features& features,
                          const Keypoint& keypoint,
                          const TangentArrays& tangents,
                          std::size_t i) {
  features.keypoints.push_back(keypoint);
  features.bearings.push_back(tangents.bearings[i]);
  features.level_pixel_from_bearing.push_back(tangents.level_pixel_from_bearing[i]);
  features.size_rad.push_back(tangents.size_rad[i]);
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/features/feature_finder.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <span>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/features/brief.h"
#include "waymark/features/feature_geometry.h"
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

}  // namespace

void check_sizes(const FrameImages& images, const Rig& rig) {
  check_size(images.image0, *rig.cameras[0].camera, "image");
  if (!images.image1.is_empty()) {
    WAYMARK_CHECK(rig.cameras.size() == 2);
    check_size(images.image1, *rig.cameras[1].camera, "right image");
  }
  if (!images.depth.is_empty()) check_size(images.depth, *rig.cameras[0].camera, "depth image");
  if (!images.mask.is_empty()) check_size(images.mask, *rig.cameras[0].camera, "mask");
}

FeatureFinder::FeatureFinder(const std::shared_ptr<const Rig>& rig, const FrameSettings& settings)
    : stereo_settings_(settings.stereo), extractor_(settings_for(*rig, settings.features)) {
  const Camera& camera0 = *rig->cameras[0].camera;
  if (camera0.wrap_width_px() > 0.0) seam_.emplace(seam_margin_px(camera0));
  if (rig->cameras.size() == 2) stereo_search(rig);
}

FoundFrame FeatureFinder::find(const FrameImages& images, const FrameView& view) {
  check_sizes(images, *view.rig);
  FoundFrame found;
  found.features = std::make_shared<Features>();
  found.features->rig = view.rig;
  const auto features_start = std::chrono::steady_clock::now();
  extract_primary(images, view, found);
  found.times.features_ms = ms_since(features_start);
  if (images.image1.is_empty()) return found;
  const auto depth_start = std::chrono::steady_clock::now();
  add_stereo(images, view, *found.features);
  found.times.depth_ms = ms_since(depth_start);
  return found;
}

const TangentArrays& FeatureFinder::compute_tangents(const Camera& camera) {
  return tangent_computer_.compute(camera, pixels_, level_scales_);
}

std::size_t FeatureFinder::extract_keypoints(const FrameImages& images, ImageView mask) {
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
void FeatureFinder::extract_primary(const FrameImages& images,
                                    const FrameView& view,
                                    FoundFrame& found) {
  const ImageView mask = view.masks[0].combined_with(images.mask, mask_);
  found.small_image = std::make_shared<const SmallImage>(make_small_image(images.image0, mask));
  const std::size_t num_edges = extract_keypoints(images, mask);
  const std::size_t num_corners = keypoints_.size() - num_edges;
  pixels_.clear();
  level_scales_.clear();
  for (const Keypoint& keypoint : keypoints_) {
    pixels_.emplace_back(keypoint.x_px, keypoint.y_px);
    level_scales_.push_back(static_cast<float>(Pyramid::scale(keypoint.level)));
  }
  const Camera& camera = *view.rig->cameras[0].camera;
  const TangentArrays& tangents = compute_tangents(camera);
  Features& features = *found.features;
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

StereoSearch& FeatureFinder::stereo_search(const std::shared_ptr<const Rig>& rig) {
  if (stereo_rig_ != rig) {
    stereo_.emplace(*rig, stereo_settings_);
    stereo_rig_ = rig;
  }
  return *stereo_;
}

void FeatureFinder::add_stereo(const FrameImages& images,
                               const FrameView& view,
                               Features& features) {
  pyramid1_.build(images.image1);
  if (seam_) pyramid0_.build(images.image0);
  const std::span<const StereoMatch> matches =
      stereo_search(view.rig).search(seam_ ? pyramid0_ : extractor_.pyramid(), pyramid1_, features);
  pixels_.clear();
  level_scales_.clear();
  for (const StereoMatch& match : matches) {
    pixels_.push_back(match.pixel);
    level_scales_.push_back(static_cast<float>(Pyramid::scale(match.level)));
  }
  const TangentArrays& tangents = compute_tangents(*view.rig->cameras[1].camera);
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const StereoMatch& match = matches[i];
    if (!tangents.is_valid[i] || !view.masks[1].allows(match.pixel, match.level)) continue;
    Keypoint keypoint = features.keypoints[match.primary];
    keypoint.x_px = static_cast<float>(match.pixel.x());
    keypoint.y_px = static_cast<float>(match.pixel.y());
    keypoint.level = match.level;
    keypoint.camera = 1;
    features.partner[match.primary] = static_cast<std::uint32_t>(features.size());
    features.partner.push_back(match.primary);
    append(features, keypoint, tangents, i);
  }
  measure_stereo_ranges(*view.rig, features);
}

void FeatureFinder::reserve(Features& features, std::size_t count) {
  features.keypoints.reserve(count);
  features.bearings.reserve(count);
  features.level_pixel_from_bearing.reserve(count);
  features.size_rad.reserve(count);
  features.partner.reserve(count);
}

void FeatureFinder::append(Features& features,
                           const Keypoint& keypoint,
                           const TangentArrays& tangents,
                           std::size_t i) {
  features.keypoints.push_back(keypoint);
  features.bearings.push_back(tangents.bearings[i]);
  features.level_pixel_from_bearing.push_back(tangents.level_pixel_from_bearing[i]);
  features.size_rad.push_back(tangents.size_rad[i]);
}

}  // namespace waymark

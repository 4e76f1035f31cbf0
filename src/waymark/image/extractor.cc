// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/image/extractor.h"

#include <fmt/format.h>

#include <algorithm>
#include <span>

#include "waymark/base/check.h"
#include "waymark/image/brief.h"
#include "waymark/image/fast.h"
#include "waymark/image/gaussian.h"
#include "waymark/image/orientation.h"
#include "waymark/image/spread.h"
#include "waymark/image/subpixel.h"

namespace waymark {
namespace {

// Corners keep this distance from the border of their level, so that the patch that describes them
// lies within.
constexpr int kBorderPx = kBriefRadius;

// Larger images would not fit the 16 bits of a corner.
constexpr int kMaxSizePx = 32768;

struct Level {
  PaddedImage scores;
  std::vector<Corner> buffer;
  std::span<Corner> corners;
};

void check_input(ImageView image, ImageView mask) {
  if (image.is_empty()) throw InputError("image", "no pixels, expected a grey image");
  if (image.width_px > kMaxSizePx || image.height_px > kMaxSizePx) {
    throw InputError("image",
                     fmt::format("{}x{} pixels, expected at most {} to a side",
                                 image.width_px,
                                 image.height_px,
                                 kMaxSizePx));
  }
  if (mask.is_empty()) return;
  if (mask.width_px != image.width_px || mask.height_px != image.height_px) {
    throw InputError("mask",
                     fmt::format("{}x{} pixels, expected the size of the image, {}x{}",
                                 mask.width_px,
                                 mask.height_px,
                                 image.width_px,
                                 image.height_px));
  }
}

bool is_large_enough(const PaddedImage& image) {
  return std::min(image.width_px(), image.height_px()) > 2 * kBorderPx;
}

// The corners of a level that the mask lets through.
std::span<Corner> apply_mask(ImageView mask, int level, std::span<Corner> corners) {
  const auto nearest = [&](int coordinate_px, int size) {
    const double at = Pyramid::level0_from_level(coordinate_px, level) + 0.5;
    return std::min(static_cast<int>(at), size - 1);
  };
  const auto end = std::remove_if(corners.begin(), corners.end(), [&](const Corner& corner) {
    return mask.at(nearest(corner.x_px, mask.width_px), nearest(corner.y_px, mask.height_px)) == 0;
  });
  return corners.first(static_cast<std::size_t>(end - corners.begin()));
}

}  // namespace

struct FeatureExtractor::Workspace {
  Pyramid pyramid;
  std::array<Level, Pyramid::kNumLevels> levels;
  PaddedImage smooth;
  BlurWorkspace blur;
  SpreadSelector selector;
  std::vector<Corner> selected;
  std::vector<float> angles_rad;

  void reserve(int width_px, int height_px, int count);
  void detect(int level, ImageView mask, int min_contrast);
  void choose(int level, int count);
  void append(int level, std::vector<Keypoint>& keypoints, std::vector<Descriptor>& descriptors);
};

void FeatureExtractor::Workspace::reserve(int width_px, int height_px, int count) {
  smooth.resize(width_px, height_px);
  blur.reserve(width_px);
  selector.reserve(width_px, height_px, count);
  selected.reserve(static_cast<std::size_t>(count));
  angles_rad.reserve(static_cast<std::size_t>(count));
}

void FeatureExtractor::Workspace::detect(int level, ImageView mask, int min_contrast) {
  const PaddedImage& image = pyramid.image(level);
  Level& its = levels[static_cast<std::size_t>(level)];
  its.corners = {};
  if (!is_large_enough(image)) return;
  fast_scores(image, kBorderPx - 1, min_contrast, its.scores);
  its.corners = find_corners(its.scores, kBorderPx - 1, min_contrast, its.buffer);
  if (!mask.is_empty()) its.corners = apply_mask(mask, level, its.corners);
}

void FeatureExtractor::Workspace::choose(int level, int count) {
  const PaddedImage& image = pyramid.image(level);
  selector.select(levels[static_cast<std::size_t>(level)].corners,
                  image.width_px(),
                  image.height_px(),
                  count,
                  selected);
}

void FeatureExtractor::Workspace::append(int level,
                                         std::vector<Keypoint>& keypoints,
                                         std::vector<Descriptor>& descriptors) {
  const PaddedImage& image = pyramid.image(level);
  const Level& its = levels[static_cast<std::size_t>(level)];
  angles_rad.resize(selected.size());
  orient(image, selected, angles_rad);
  gaussian_blur(image, blur, smooth);
  const std::size_t num_before = descriptors.size();
  descriptors.resize(num_before + selected.size());
  describe(smooth, selected, angles_rad, std::span(descriptors).subspan(num_before));
  for (std::size_t i = 0; i < selected.size(); ++i) {
    const Corner& corner = selected[i];
    const SubpixelOffset offset = locate_peak(its.scores, corner);
    Keypoint keypoint;
    keypoint.x_px =
        static_cast<float>(Pyramid::level0_from_level(corner.x_px + offset.x_px, level));
    keypoint.y_px =
        static_cast<float>(Pyramid::level0_from_level(corner.y_px + offset.y_px, level));
    keypoint.angle_rad = angles_rad[i];
    keypoint.response = corner.score;
    keypoint.level = static_cast<std::uint8_t>(level);
    keypoints.push_back(keypoint);
  }
}

FeatureExtractor::FeatureExtractor(const FeatureSettings& settings)
    : settings_(settings), workspace_(std::make_unique<Workspace>()) {}
FeatureExtractor::~FeatureExtractor() = default;
FeatureExtractor::FeatureExtractor(FeatureExtractor&&) noexcept = default;
FeatureExtractor& FeatureExtractor::operator=(FeatureExtractor&&) noexcept = default;

const Pyramid& FeatureExtractor::pyramid() const { return workspace_->pyramid; }

void FeatureExtractor::extract(ImageView image,
                               ImageView mask,
                               std::vector<Keypoint>& keypoints,
                               std::vector<Descriptor>& descriptors) {
  check_input(image, mask);
  keypoints.clear();
  descriptors.clear();
  keypoints.reserve(static_cast<std::size_t>(settings_.count));
  descriptors.reserve(static_cast<std::size_t>(settings_.count));
  workspace_->reserve(image.width_px, image.height_px, settings_.count);
  workspace_->pyramid.build(image);
  LevelCounts available{};
  for (int level = 0; level < Pyramid::kNumLevels; ++level) {
    workspace_->detect(level, mask, settings_.min_contrast);
    const auto i = static_cast<std::size_t>(level);
    available[i] = static_cast<int>(workspace_->levels[i].corners.size());
  }
  const LevelCounts counts = share_among_levels(settings_.count, available);
  for (int level = 0; level < Pyramid::kNumLevels; ++level) {
    const int count = counts[static_cast<std::size_t>(level)];
    if (count == 0) continue;
    workspace_->choose(level, count);
    workspace_->append(level, keypoints, descriptors);
  }
}

}  // namespace waymark

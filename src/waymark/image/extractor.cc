// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/image/extractor.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <span>

#include "waymark/base/check.h"
#include "waymark/image/brief.h"
#include "waymark/image/corners.h"
#include "waymark/image/fast.h"
#include "waymark/image/spread.h"

namespace waymark {
namespace {

// Corners keep this distance from the border of their level, so that the patch that describes them
// lies within.
constexpr int kBorderPx = kBriefRadius;

// Larger images would not fit the 16 bits of a corner.
constexpr int kMaxSizePx = 32768;

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

// What a level must give per pixel if corners were the same everywhere.
double needed_density(const PaddedImage& image, int level, int count) {
  LevelCounts plenty;
  plenty.fill(count);
  const int share = share_among_levels(count, plenty)[static_cast<std::size_t>(level)];
  const double area = static_cast<double>(std::max(image.width_px() - 2 * kBorderPx, 1)) *
                      std::max(image.height_px() - 2 * kBorderPx, 1);
  return share / area;
}

// The corners of a level that the mask lets through: it counts the levels from 0 up.
std::span<Corner> apply_mask(ImageView mask, int level, std::span<Corner> corners) {
  const auto nearest = [&](int coordinate_px, int size) {
    const double at = Pyramid::level0_from_level(coordinate_px, level) + 0.5;
    return std::min(static_cast<int>(at), size - 1);
  };
  const auto end = std::remove_if(corners.begin(), corners.end(), [&](const Corner& corner) {
    return mask.at(nearest(corner.x_px, mask.width_px), nearest(corner.y_px, mask.height_px)) <=
           level;
  });
  return corners.first(static_cast<std::size_t>(end - corners.begin()));
}

}  // namespace

struct FeatureExtractor::Workspace {
  struct Candidates {
    std::vector<Corner> buffer;
    std::span<Corner> corners;
  };

  Pyramid pyramid;
  CornerWorkspace corner;
  std::array<Candidates, Pyramid::kNumLevels> candidates;
  SpreadSelector selector;
  std::vector<Corner> selected;
  std::vector<ScorePatch> score_patches;
  std::vector<float> angles_rad;
  PaddedImage smooth;
  BlurWorkspace blur;

  void reserve(int width_px, int height_px, int count);
  LevelCounts detect(ImageView mask, const FeatureSettings& settings);
  void choose(int level, int count);
  void append(int level, std::vector<Keypoint>& keypoints, std::vector<Descriptor>& descriptors);
};

void FeatureExtractor::Workspace::reserve(int width_px, int height_px, int count) {
  smooth.resize(width_px, height_px);
  blur.reserve(width_px);
  selector.reserve(width_px, height_px, count);
  selected.reserve(static_cast<std::size_t>(count));
  score_patches.reserve(static_cast<std::size_t>(count));
  angles_rad.reserve(static_cast<std::size_t>(count));
}

// Fills the candidates of all levels; returns how many there are.
LevelCounts FeatureExtractor::Workspace::detect(ImageView mask, const FeatureSettings& settings) {
  LevelCounts available{};
  for (int level = 0; level < Pyramid::kNumLevels; ++level) {
    const auto i = static_cast<std::size_t>(level);
    const PaddedImage& image = pyramid.image(level);
    const CornerRequest request{.border_px = kBorderPx,
                                .min_contrast = settings.min_contrast,
                                .density = needed_density(image, level, settings.count)};
    auto& corners = candidates[i].corners;
    corners = find_corners(image, request, corner, candidates[i].buffer);
    if (!mask.is_empty()) corners = apply_mask(mask, level, corners);
    available[i] = static_cast<int>(corners.size());
  }
  return available;
}

void FeatureExtractor::Workspace::choose(int level, int count) {
  const PaddedImage& image = pyramid.image(level);
  selector.select(candidates[static_cast<std::size_t>(level)].corners,
                  image.width_px(),
                  image.height_px(),
                  count,
                  selected);
}

void FeatureExtractor::Workspace::append(int level,
                                         std::vector<Keypoint>& keypoints,
                                         std::vector<Descriptor>& descriptors) {
  const PaddedImage& image = pyramid.image(level);
  score_patches.resize(selected.size());
  fast_score_patches(image, selected, score_patches);
  angles_rad.resize(selected.size());
  orient(image, selected, angles_rad);
  gaussian_blur(image, blur, smooth);
  const std::size_t num_before = descriptors.size();
  descriptors.resize(num_before + selected.size());
  describe(smooth, selected, angles_rad, std::span(descriptors).subspan(num_before));
  const auto level0 = [&](double coordinate_px) {
    return static_cast<float>(Pyramid::level0_from_level(coordinate_px, level));
  };
  for (std::size_t i = 0; i < selected.size(); ++i) {
    const SubpixelOffset offset = locate_peak(score_patches[i]);
    Keypoint keypoint;
    keypoint.x_px = level0(selected[i].x_px + offset.x_px);
    keypoint.y_px = level0(selected[i].y_px + offset.y_px);
    keypoint.angle_rad = angles_rad[i];
    keypoint.response = selected[i].score;
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
  const LevelCounts available = workspace_->detect(mask, settings_);
  const LevelCounts counts = share_among_levels(settings_.count, available);
  for (int level = 0; level < Pyramid::kNumLevels; ++level) {
    const int count = counts[static_cast<std::size_t>(level)];
    if (count == 0) continue;
    workspace_->choose(level, count);
    workspace_->append(level, keypoints, descriptors);
  }
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/features/extractor.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "waymark/base/check.h"
#include "waymark/features/brief.h"
#include "waymark/features/corners.h"
#include "waymark/features/edges.h"
#include "waymark/features/fast.h"
#include "waymark/features/non_maximal_suppression.h"

namespace waymark {
namespace {

// Corners keep this distance from the border of their level, so that the patch that describes them
// lies within.
constexpr int kBorderPx = kBriefRadius;

// Points on edges join in where strong corners are in less than this part of the image, whose
// longer side has so many blocks (docs/decisions/image.md).
constexpr double kFewCovered = 0.45;
// So many corners in all are needed per block that is expected to have some.
constexpr int kCornersPerBlock = 4;
constexpr int kNumBlocks = 8;
// The level of edges: one that noise and blur change little.
constexpr int kEdgeLevel = 2;
// Slope of an edge, per grey value of its height, in pixels of its level.
constexpr double kSlopeOfHeight = 0.35;
// The least height of an edge, in grey values, in an image without noise.
constexpr double kLeastHeight = 2.0;
// A corner of this part of an edge's height is one where edges meet, however dark the image is;
// what noise makes on an edge is as high as the noise.
constexpr double kCornerOfHeight = 0.75;

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

// Whether the mask lets a pixel of a level through: it counts the levels from 0 up.
bool allows(ImageView mask, int level, int x_px, int y_px) {
  const auto nearest = [&](int coordinate_px, int size) {
    const double at = Pyramid::level0_from_level(coordinate_px, level) + 0.5;
    return std::min(static_cast<int>(at), size - 1);
  };
  return mask.at(nearest(x_px, mask.width_px), nearest(y_px, mask.height_px)) > level;
}

// Parts of this size that cover a length.
int num_cells(int length, int cell) { return (length + cell - 1) / cell; }

// The cells of the level of edges, row by row.
struct EdgeCells {
  int columns = 0;
  int rows = 0;

  explicit EdgeCells(const PaddedImage& image)
      : columns(num_cells(image.width_px(), EdgeFinder::kCellPx)),
        rows(num_cells(image.height_px(), EdgeFinder::kCellPx)) {}

  std::size_t count() const { return static_cast<std::size_t>(columns * rows); }

  // Coordinates are pixels of the level; what is beyond the border is in the cell beside it.
  std::size_t at(double x_px, double y_px) const {
    const int column = std::clamp(static_cast<int>(x_px) / EdgeFinder::kCellPx, 0, columns - 1);
    const int row = std::clamp(static_cast<int>(y_px) / EdgeFinder::kCellPx, 0, rows - 1);
    return static_cast<std::size_t>(row * columns + column);
  }

  std::size_t of(const Keypoint& keypoint) const {
    return at(Pyramid::level_from_level0(keypoint.x_px, kEdgeLevel),
              Pyramid::level_from_level0(keypoint.y_px, kEdgeLevel));
  }
};

// Strong corners tell more than edges do.
bool is_strong(const Keypoint& corner) {
  return corner.response >= static_cast<float>(kStrongContrast);
}

// The corners of a level that the mask lets through.
std::span<Corner> apply_mask(ImageView mask, int level, std::span<Corner> corners) {
  const auto end = std::remove_if(corners.begin(), corners.end(), [&](const Corner& corner) {
    return !allows(mask, level, corner.x_px, corner.y_px);
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
  NonMaximalSuppression selector;
  std::vector<Corner> selected;
  std::vector<ScorePatch> score_patches;
  std::vector<float> angles_rad;
  PaddedImage smooth;
  BlurWorkspace blur;
  EdgeFinder edge_finder;
  std::vector<std::uint8_t> has_no_corner;
  std::vector<float> noise_contrast;  ///< Per cell: below that corners are noise on an edge.
  std::vector<std::uint8_t> is_covered;

  void reserve(int width_px, int height_px, int count);
  LevelCounts detect(ImageView mask, const FeatureSettings& settings);
  void choose(int level, int count);
  void append(int level, std::vector<Keypoint>& keypoints, std::vector<Descriptor>& descriptors);
  void mark_strong_corners(std::span<const Keypoint> keypoints);
  bool has_few_corners(ImageView mask, int count);
  void drop_corners_on_edges(std::span<const EdgePoint> points,
                             std::vector<Keypoint>& keypoints,
                             std::vector<Descriptor>& descriptors);
  std::size_t append_edges(ImageView mask,
                           const FeatureSettings& settings,
                           std::vector<Keypoint>& keypoints,
                           std::vector<Descriptor>& descriptors);
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

// The cells of strong corners.
void FeatureExtractor::Workspace::mark_strong_corners(std::span<const Keypoint> keypoints) {
  const EdgeCells cells(pyramid.image(kEdgeLevel));
  has_no_corner.assign(cells.count(), 1);
  for (const Keypoint& keypoint : keypoints) {
    if (is_strong(keypoint)) has_no_corner[cells.of(keypoint)] = 0;
  }
}

// Whether strong corners, of `count` corners in all, are in few of the blocks whose centre the mask
// lets through.
bool FeatureExtractor::Workspace::has_few_corners(ImageView mask, int count) {
  const PaddedImage& image = pyramid.image(kEdgeLevel);
  const EdgeCells cells(image);
  const int block_cells = std::max(num_cells(std::max(cells.columns, cells.rows), kNumBlocks), 1);
  const int block_px = block_cells * EdgeFinder::kCellPx;
  const int block_columns = num_cells(image.width_px(), block_px);
  const int num_blocks = block_columns * num_cells(image.height_px(), block_px);
  is_covered.assign(static_cast<std::size_t>(num_blocks), 0);
  for (int row = 0; row < cells.rows; ++row) {
    for (int column = 0; column < cells.columns; ++column) {
      const int block = row / block_cells * block_columns + column / block_cells;
      is_covered[static_cast<std::size_t>(block)] |=
          !has_no_corner[static_cast<std::size_t>(row * cells.columns + column)];
    }
  }
  int num_allowed = 0;
  int num_covered = 0;
  for (int i = 0; i < num_blocks; ++i) {
    const int x = i % block_columns * block_px + block_px / 2;
    const int y = i / block_columns * block_px + block_px / 2;
    if (!mask.is_empty() && !allows(mask, kEdgeLevel, x, y)) continue;
    ++num_allowed;
    num_covered += is_covered[static_cast<std::size_t>(i)];
  }
  return num_covered < kFewCovered * std::min(num_allowed, count / kCornersPerBlock);
}

// Corners on edges that are weak for that edge are where noise makes them: their place along the
// edge tells nothing.
void FeatureExtractor::Workspace::drop_corners_on_edges(std::span<const EdgePoint> points,
                                                        std::vector<Keypoint>& keypoints,
                                                        std::vector<Descriptor>& descriptors) {
  const EdgeCells cells(pyramid.image(kEdgeLevel));
  noise_contrast.assign(cells.count(), 0.0f);
  for (const EdgePoint& point : points) {
    noise_contrast[cells.at(point.x_px, point.y_px)] =
        static_cast<float>(kCornerOfHeight / kSlopeOfHeight) * point.slope;
  }
  std::size_t num_kept = 0;
  for (std::size_t i = 0; i < keypoints.size(); ++i) {
    const float least = noise_contrast[cells.of(keypoints[i])];
    if (!is_strong(keypoints[i]) && keypoints[i].response < least) continue;
    keypoints[num_kept] = keypoints[i];
    descriptors[num_kept++] = descriptors[i];
  }
  keypoints.resize(num_kept);
  descriptors.resize(num_kept);
}

std::size_t FeatureExtractor::Workspace::append_edges(ImageView mask,
                                                      const FeatureSettings& settings,
                                                      std::vector<Keypoint>& keypoints,
                                                      std::vector<Descriptor>& descriptors) {
  mark_strong_corners(keypoints);
  if (!has_few_corners(mask, settings.count)) return 0;
  const PaddedImage& image = pyramid.image(kEdgeLevel);
  const double least_height = std::min<double>(kLeastHeight, settings.min_contrast);
  const auto points = edge_finder.find(image,
                                       has_no_corner,
                                       {.border_px = kBorderPx + 1,
                                        .min_slope = kSlopeOfHeight * least_height,
                                        .clear_slope = kSlopeOfHeight * settings.min_contrast,
                                        .count = static_cast<std::size_t>(settings.count) / 2});
  drop_corners_on_edges(points, keypoints, descriptors);
  selected.clear();
  angles_rad.clear();
  for (const EdgePoint& point : points) {
    const auto x = static_cast<std::uint16_t>(std::lround(point.x_px));
    const auto y = static_cast<std::uint16_t>(std::lround(point.y_px));
    if (!mask.is_empty() && !allows(mask, kEdgeLevel, x, y)) continue;
    selected.push_back({x, y, 0});
    angles_rad.push_back(point.angle_rad);
    Keypoint keypoint;
    keypoint.x_px = static_cast<float>(Pyramid::level0_from_level(point.x_px, kEdgeLevel));
    keypoint.y_px = static_cast<float>(Pyramid::level0_from_level(point.y_px, kEdgeLevel));
    keypoint.angle_rad = point.angle_rad;
    keypoint.response = point.slope;
    keypoint.level = kEdgeLevel;
    keypoints.push_back(keypoint);
  }
  if (selected.empty()) return 0;
  gaussian_blur(image, blur, smooth);
  const std::size_t num_before = descriptors.size();
  descriptors.resize(num_before + selected.size());
  describe(smooth, selected, angles_rad, std::span(descriptors).subspan(num_before));
  return selected.size();
}

FeatureExtractor::FeatureExtractor(const FeatureSettings& settings)
    : settings_(settings), workspace_(std::make_unique<Workspace>()) {}
FeatureExtractor::~FeatureExtractor() = default;
FeatureExtractor::FeatureExtractor(FeatureExtractor&&) noexcept = default;
FeatureExtractor& FeatureExtractor::operator=(FeatureExtractor&&) noexcept = default;

const Pyramid& FeatureExtractor::pyramid() const { return workspace_->pyramid; }

std::size_t FeatureExtractor::extract(ImageView image,
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
  if (!settings_.edges) return 0;
  return workspace_->append_edges(mask, settings_, keypoints, descriptors);
}

}  // namespace waymark

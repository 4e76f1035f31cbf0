// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/features/ego_mask.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <utility>

#include "waymark/base/median.h"
#include "waymark/camera/pixel_angles.h"
#include "waymark/image/convert.h"

namespace waymark {
namespace {

/// Of larger images every so many pixels are taken that this comes out: what is looked for is not
/// finer, and means take longer than all the rest.
constexpr double kUsualWidthPx = 1024.0;
/// Cells in a row of the image; as many rows as make them square.
constexpr int kColumns = 48;
constexpr int kFirstInterval = 3, kLaterInterval = 10;
/// Root mean square of the gradient in every direction; with less, noise decides.
constexpr double kMinGrayPerPx = 2.0;
constexpr double kSobelSum = 8.0;
/// Gradients of a world that moved less are still alike.
constexpr double kSamePx = 2.5;
/// With more pairs of images in the same direction nothing is told.
constexpr double kMaxUnturnedPart = 0.5;
/// The part of the gradients that stays, beyond that of a world at infinity: .15 at most in
/// recordings in which nothing moves along, .3 to .9 of burnt-in text (docs/decisions/image.md).
constexpr double kAlong = 0.25, kNotAlong = 0.1;
/// So many landmarks within this distance, in the median, are where they were.
constexpr std::size_t kMinAnchors = 8;
constexpr double kRestingPx = 1.5;
/// Of the images of a window, in which what the places rest on stays. Where the camera rests so
/// long, kAlongAtRest of the gradients are left anywhere.
constexpr double kRestingPart = 0.75, kAlongAtRest = 0.5, kMaxAlongPartAtRest = 0.4;
/// Where more of the image stays it is the camera that does, whatever its direction.
constexpr double kMaxAlongPart = 0.5;
/// What comes in from the upper or lower edge is as high, in parts of the image: where all
/// directions are seen, and else.
constexpr double kEgoReachAllAround = 0.5, kEgoReach = 1.0 / 3.0;
/// Gaps of up to twice as many columns belong to it.
constexpr int kGap = 6;

int begin_of(int cell, int num_cells, int size_px) { return cell * size_px / num_cells; }

/// Calls visit(cell, y, first, end) for the stretches of all rows of an image but the outermost
/// pixels.
template <class Visit>
void visit_cells(int width_px, int height_px, int rows, Visit visit) {
  for (int row = 0; row < rows; ++row) {
    const int end_y = std::min(begin_of(row + 1, rows, height_px), height_px - 1);
    for (int y = std::max(begin_of(row, rows, height_px), 1); y < end_y; ++y) {
      for (int column = 0; column < kColumns; ++column) {
        visit(static_cast<std::size_t>(row * kColumns + column),
              y,
              std::max(begin_of(column, kColumns, width_px), 1),
              std::min(begin_of(column + 1, kColumns, width_px), width_px - 1));
      }
    }
  }
}

/// Extremes of kGap values to either side, which wrap around or are 0 beyond the ends.
template <class Choose>
std::vector<int> extremes(const std::vector<int>& values, bool wraps, Choose choose) {
  const int count = static_cast<int>(values.size());
  std::vector<int> result = values;
  for (int i = 0; i < count; ++i) {
    for (int k = i - kGap; k <= i + kGap; ++k) {
      const bool is_known = wraps || (k >= 0 && k < count);
      const int value = is_known ? values[static_cast<std::size_t>((k + count) % count)] : 0;
      int& chosen = result[static_cast<std::size_t>(i)];
      chosen = choose(chosen, value);
    }
  }
  return result;
}

/// Heights without their gaps: a dilation, then an erosion (Serra 1982).
std::vector<int> close_gaps(std::vector<int> heights, bool wraps) {
  const std::size_t margin = wraps ? 0 : kGap;  // Room for the dilation.
  heights.insert(heights.begin(), margin, 0);
  heights.insert(heights.end(), margin, 0);
  heights = extremes(heights, wraps, [](int a, int b) { return std::max(a, b); });
  heights = extremes(heights, wraps, [](int a, int b) { return std::min(a, b); });
  return {heights.begin() + static_cast<std::ptrdiff_t>(margin),
          heights.end() - static_cast<std::ptrdiff_t>(margin)};
}

template <class Structure>
Eigen::Matrix2d matrix(const Structure& structure) {
  Eigen::Matrix2d result;
  result << structure.xx, structure.xy, structure.xy, structure.yy;
  return result;
}

}  // namespace

EgoMask::EgoMask(std::shared_ptr<const Camera> camera)
    : camera_(std::move(camera)),
      factor_(1.0 / std::max(1.0, std::round(camera_->width_px() / kUsualWidthPx))),
      rows_(std::clamp(kColumns * camera_->height_px() / camera_->width_px(), 1, kColumns)),
      interval_(kFirstInterval),
      is_along_(static_cast<std::size_t>(rows_ * kColumns), 0) {
  const PixelAngles angles(*camera_);
  std::vector<Eigen::Vector2d> centres;
  for (int i = 0; i < rows_ * kColumns; ++i) {
    centres.emplace_back((i % kColumns + 0.5) * camera_->width_px() / kColumns - 0.5,
                         (i / kColumns + 0.5) * camera_->height_px() / rows_ - 0.5);
    pixels_rad_.push_back(angles.at(centres.back()) / factor_);
  }
  bearings_.resize(centres.size());
  std::vector<std::uint8_t> is_valid(centres.size());
  camera_->unproject(centres, bearings_, is_valid);
  for (std::size_t i = 0; i < centres.size(); ++i) {
    if (!is_valid[i]) bearings_[i].setZero();
  }
}

bool EgoMask::watch(const LocatedImage& located, ImageView levels) {
  if (++num_passed_ < interval_) return false;
  num_passed_ = 0;
  note_landmarks(located);
  directions_.push_back(located.world_from_cam);
  if (factor_ < 1.0) {
    accumulate(pick_reduced(located.image, factor_).view());
  } else {
    accumulate(located.image);
  }
  if (directions_.size() < kNumImages) return false;
  const bool has_changed = judge(levels);
  if (has_changed) draw();
  restart();
  return has_changed;
}

void EgoMask::restart() {
  directions_.clear();
  num_resting_ = 0;
  std::ranges::fill(gradients_, Eigen::Vector2i::Zero());
  std::ranges::fill(structures_, Structure{});
}

void EgoMask::note_landmarks(const LocatedImage& located) {
  const bool is_first = directions_.empty();
  if (is_first) anchors_.clear();
  std::vector<double> distances_px;
  for (std::size_t i = 0; i < located.landmarks.size(); ++i) {
    const LandmarkId id = located.landmarks[i];
    const Keypoint& keypoint = located.features.keypoints[i];
    if (!id.is_valid() || keypoint.camera != 0) continue;
    const Eigen::Vector2f pixel(keypoint.x_px, keypoint.y_px);
    if (is_first) {
      anchors_.emplace_back(id, pixel);
      continue;
    }
    const auto by_id = [](const auto& anchor) { return anchor.first; };
    const auto anchor = std::ranges::lower_bound(anchors_, id, {}, by_id);
    if (anchor == anchors_.end() || anchor->first != id) continue;
    distances_px.push_back((anchor->second - pixel).norm());
  }
  if (is_first) std::ranges::sort(anchors_, {}, [](const auto& anchor) { return anchor.first; });
  num_resting_ += distances_px.size() >= kMinAnchors && median(distances_px) < kRestingPx;
}

void EgoMask::accumulate(ImageView image) {
  width_px_ = image.width_px, height_px_ = image.height_px;
  gradients_.resize(static_cast<std::size_t>(width_px_ * height_px_), Eigen::Vector2i::Zero());
  structures_.resize(is_along_.size());
  visit_cells(width_px_, height_px_, rows_, [&](std::size_t cell, int y, int first, int end) {
    const std::uint8_t *above = image.row(y - 1), *row = image.row(y), *below = image.row(y + 1);
    Eigen::Vector2i* const sums = gradients_.data() + static_cast<std::ptrdiff_t>(y) * width_px_;
    int xx = 0, xy = 0, yy = 0;
    for (int x = first; x < end; ++x) {
      const int falling = below[x + 1] - above[x - 1], rising = above[x + 1] - below[x - 1];
      const int gx = falling + rising + 2 * (row[x + 1] - row[x - 1]);
      const int gy = falling - rising + 2 * (below[x] - above[x]);
      sums[x] += Eigen::Vector2i(gx, gy);
      xx += gx * gx, xy += gx * gy, yy += gy * gy;
    }
    Structure& sum = structures_[cell];
    sum.xx += xx, sum.xy += xy, sum.yy += yy;
  });
}

/// Of the mean gradients, times the squared number of images.
std::vector<EgoMask::Structure> EgoMask::mean_structures() const {
  std::vector<Structure> result(structures_.size());
  visit_cells(width_px_, height_px_, rows_, [&](std::size_t cell, int y, int first, int end) {
    const Eigen::Vector2i* const sums =
        gradients_.data() + static_cast<std::ptrdiff_t>(y) * width_px_;
    for (int x = first; x < end; ++x) {
      const Eigen::Vector2d sum = sums[x].cast<double>();
      result[cell].xx += sum.x() * sum.x();
      result[cell].xy += sum.x() * sum.y();
      result[cell].yy += sum.y() * sum.y();
    }
  });
  return result;
}

/// Part of the pairs of images in which a point at infinity is at the same place.
double EgoMask::unturned_part(std::size_t cell) const {
  const double near = kSamePx * pixels_rad_[cell];
  std::vector<Eigen::Vector3d> seen;
  for (const Eigen::Quaterniond& direction : directions_) {
    seen.push_back(direction * bearings_[cell]);
  }
  int num_near = 0;
  for (const Eigen::Vector3d& a : seen) {
    for (const Eigen::Vector3d& b : seen) num_near += (a - b).squaredNorm() < near * near;
  }
  return static_cast<double>(num_near) / static_cast<double>(seen.size() * seen.size());
}

bool EgoMask::judge(ImageView levels) {
  const double num_images = static_cast<double>(directions_.size());
  const bool rests = static_cast<double>(num_resting_) > kRestingPart * num_images;
  const double along = rests ? kAlongAtRest : kAlong;
  std::vector<std::uint8_t> found = is_along_;
  int num_told = 0, num_along = 0;
  const std::vector<std::optional<double>> staying = staying_parts(levels);
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (!staying[i]) continue;
    const double unturned = rests ? 0.0 : unturned_part(i);
    if (unturned > kMaxUnturnedPart) continue;
    const double beyond = (*staying[i] - unturned) / (1.0 - unturned);
    ++num_told;
    num_along += beyond > along;
    if (beyond > along) found[i] = 1;
    if (beyond < kNotAlong) found[i] = 0;
  }
  const double max_part = rests ? kMaxAlongPartAtRest : kMaxAlongPart;
  if (num_told == 0 || num_along > max_part * num_told) return false;
  interval_ = kLaterInterval;
  if (found == is_along_) return false;
  is_along_ = std::move(found);
  return true;
}

/// Part of the gradients that stays, per cell: in the direction in which least does, as the world
/// may move along its lines. Nothing where there is too little structure to tell.
std::vector<std::optional<double>> EgoMask::staying_parts(ImageView levels) const {
  std::vector<std::uint8_t> has_features(is_along_.size(), 1);
  if (!levels.is_empty()) {
    visit_cells(
        levels.width_px, levels.height_px, rows_, [&](std::size_t cell, int y, int first, int end) {
          for (int x = first; x < end; ++x) has_features[cell] &= levels.at(x, y) != 0;
        });
  }
  const std::vector<Structure> means = mean_structures();
  const double num_images = static_cast<double>(directions_.size());
  const double num_pixels =
      static_cast<double>(gradients_.size()) / static_cast<double>(is_along_.size());
  const double min_structure = num_images * num_pixels * std::pow(kMinGrayPerPx * kSobelSum, 2);
  std::vector<std::optional<double>> result(is_along_.size());
  for (std::size_t i = 0; i < result.size(); ++i) {
    if (!has_features[i] || bearings_[i].isZero()) continue;
    const Eigen::Matrix2d all = matrix(structures_[i]);
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> structure(all, Eigen::EigenvaluesOnly);
    if (structure.eigenvalues()[0] < min_structure) continue;
    const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::Matrix2d> part(
        matrix(means[i]), all, Eigen::EigenvaluesOnly);
    result[i] = part.eigenvalues()[0] / num_images;
  }
  return result;
}

/// Per cell whether it moves along, with what lies between what was found and the upper or the
/// lower edge: parts without structure of their own, or that mirror the world.
std::vector<std::uint8_t> EgoMask::region() const {
  const bool wraps = camera_->wrap_width_px() > 0.0;
  const int reach = static_cast<int>((wraps ? kEgoReachAllAround : kEgoReach) * rows_);
  std::vector<std::uint8_t> result = is_along_;
  for (const bool is_upper : {false, true}) {
    const auto cell = [&](int height, int column) {
      const int row = is_upper ? height : rows_ - 1 - height;
      return static_cast<std::size_t>(row * kColumns + column);
    };
    std::vector<int> heights(kColumns, 0);
    for (int i = 0; i < reach * kColumns; ++i) {
      if (is_along_[cell(i / kColumns, i % kColumns)]) {
        heights[static_cast<std::size_t>(i % kColumns)] = i / kColumns + 1;
      }
    }
    heights = close_gaps(std::move(heights), wraps);
    for (int i = 0; i < reach * kColumns; ++i) {
      if (i / kColumns < heights[static_cast<std::size_t>(i % kColumns)]) {
        result[cell(i / kColumns, i % kColumns)] = 1;
      }
    }
  }
  return result;
}

void EgoMask::draw() {
  const std::vector<std::uint8_t> is_ego = region();
  mask_ = Image();
  if (std::ranges::count(is_ego, 1) == 0) return;
  mask_ = Image(camera_->width_px(), camera_->height_px());
  for (int y = 0; y < mask_.height_px; ++y) {
    const int row = ((y + 1) * rows_ - 1) / mask_.height_px;
    for (int x = 0; x < mask_.width_px; ++x) {
      const int column = ((x + 1) * kColumns - 1) / mask_.width_px;
      mask_.row(y)[x] = is_ego[static_cast<std::size_t>(row * kColumns + column)] ? 0 : 255;
    }
  }
}

}  // namespace waymark

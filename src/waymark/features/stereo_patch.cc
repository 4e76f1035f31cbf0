// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/features/stereo_patch.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace waymark {
namespace {

/// Below this standard deviation (grey values) a patch shows noise.
constexpr float kMinContrast = 2.0f;

constexpr int kMaxIterations = 10;
constexpr double kConvergedPx = 0.01;
constexpr double kMaxStepPx = 1.0;
constexpr float kMinGain = 0.25f;
constexpr float kMaxGain = 4.0f;

template <int kSize>
using Samples = std::array<float, static_cast<std::size_t>(kSize) * kSize>;

/// Square of kSize x kSize pixels around the centre, bilinear.
template <int kSize>
bool sample(ImageView image, const PatchFrame& frame, Samples<kSize>& samples) {
  constexpr double kReach = 0.5 * (kSize - 1);
  const Eigen::Vector2d extent = kReach * frame.image_from_patch.cwiseAbs().rowwise().sum();
  const Eigen::Vector2d low = frame.center - extent;
  const Eigen::Vector2d high = frame.center + extent;
  if (!(low.minCoeff() >= 0.0 && high.x() < image.width_px - 1 && high.y() < image.height_px - 1)) {
    return false;
  }
  const Eigen::Vector2f column = frame.image_from_patch.col(0).cast<float>();
  const Eigen::Vector2f row = frame.image_from_patch.col(1).cast<float>();
  const Eigen::Vector2f corner =
      (frame.center - frame.image_from_patch * Eigen::Vector2d::Constant(kReach)).cast<float>();
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      const float px =
          corner.x() + static_cast<float>(x) * column.x() + static_cast<float>(y) * row.x();
      const float py =
          corner.y() + static_cast<float>(x) * column.y() + static_cast<float>(y) * row.y();
      // Not negative but for rounding, so that truncation is floor.
      const int left = static_cast<int>(px);
      const int top = static_cast<int>(py);
      const float fx = px - static_cast<float>(left);
      const float fy = py - static_cast<float>(top);
      const std::uint8_t* above = image.row(top) + left;
      const std::uint8_t* below = above + image.stride;
      const float a = above[0] + fx * static_cast<float>(above[1] - above[0]);
      const float b = below[0] + fx * static_cast<float>(below[1] - below[0]);
      samples[static_cast<std::size_t>(y * kSize + x)] = a + fy * (b - a);
    }
  }
  return true;
}

/// Takes the mean from the values; the sum of their squares then.
float centre(std::array<float, kAlignArea>& values) {
  float sum = 0.0f, square = 0.0f;
  for (const float value : values) sum += value;
  for (float& value : values) {
    value -= sum / kAlignArea;
    square += value * value;
  }
  return square;
}

/// Makes the derivatives blind to gain and bias; values have mean 0. A sum waits for itself: four
/// at a time take as long as one.
void project_out(float value_square, AlignPatch& patch) {
  float along = 0.0f, across = 0.0f, value_along = 0.0f, value_across = 0.0f;
  for (std::size_t i = 0; i < patch.value.size(); ++i) {
    along += patch.along[i];
    across += patch.across[i];
    value_along += patch.value[i] * patch.along[i];
    value_across += patch.value[i] * patch.across[i];
  }
  const float along_bias = along / kAlignArea, along_gain = value_along / value_square;
  const float across_bias = across / kAlignArea, across_gain = value_across / value_square;
  for (std::size_t i = 0; i < patch.value.size(); ++i) {
    patch.along[i] -= along_bias + along_gain * patch.value[i];
    patch.across[i] -= across_bias + across_gain * patch.value[i];
  }
}

/// Sums of the squared derivatives and of their products.
void sum_squares(AlignTemplate& result) {
  const AlignPatch& patch = result.patch;
  float along = 0.0f, across = 0.0f, both = 0.0f;
  for (std::size_t i = 0; i < patch.value.size(); ++i) {
    along += patch.along[i] * patch.along[i];
    across += patch.across[i] * patch.across[i];
    both += patch.along[i] * patch.across[i];
  }
  result.along_square = along;
  result.across_square = across;
  result.along_across = both;
}

}  // namespace

std::optional<SearchPatch> cut_search_patch(ImageView image, const PatchFrame& frame) {
  Samples<kSearchSize> samples;
  if (!sample<kSearchSize>(image, frame, samples)) return std::nullopt;
  SearchPatch patch;
  for (std::size_t i = 0; i < patch.size(); ++i) {
    patch[i] = static_cast<std::int16_t>(samples[i] + 0.5f);
  }
  return patch;
}

std::optional<AlignTemplate> cut_align_template(ImageView image,
                                                const PatchFrame& frame,
                                                const Eigen::Vector2d& direction) {
  constexpr int kSize = kAlignSize + 2;  // A border for the derivatives.
  Samples<kSize> samples;
  if (!sample<kSize>(image, frame, samples)) return std::nullopt;
  std::optional<AlignTemplate> result(std::in_place);
  AlignPatch& patch = result->patch;
  const float dx = static_cast<float>(0.5 * direction.x());
  const float dy = static_cast<float>(0.5 * direction.y());
  for (int y = 0; y < kAlignSize; ++y) {
    for (int x = 0; x < kAlignSize; ++x) {
      const float* sample = samples.data() + (y + 1) * kSize + x + 1;
      const float gradient_x = sample[1] - sample[-1];
      const float gradient_y = sample[kSize] - sample[-kSize];
      const auto i = static_cast<std::size_t>(y * kAlignSize + x);
      patch.value[i] = *sample;
      patch.along[i] = dx * gradient_x + dy * gradient_y;
      patch.across[i] = dx * gradient_y - dy * gradient_x;
    }
  }
  result->value_square = centre(patch.value);
  if (result->value_square < kAlignArea * kMinContrast * kMinContrast) return std::nullopt;
  project_out(result->value_square, patch);
  sum_squares(*result);
  result->direction = direction;
  if (result->along_square < kAlignArea) return std::nullopt;
  return result;
}

std::optional<Alignment> align(const AlignTemplate& patch,
                               ImageView image,
                               const Eigen::Vector2d& start) {
  constexpr double kReach = 0.5 * (kAlignSize - 1);
  Alignment result{0.0, 0.0, 0.0f};
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    const Eigen::Vector2d corner =
        start + result.along_px * patch.direction - Eigen::Vector2d::Constant(kReach);
    const Eigen::Vector2d whole = corner.array().floor();
    const PatchCorner at{static_cast<int>(whole.x()), static_cast<int>(whole.y())};
    if (at.x < 0 || at.y < 0 || at.x + kAlignSize >= image.width_px ||
        at.y + kAlignSize >= image.height_px) {
      return std::nullopt;
    }
    const Eigen::Vector2f fraction = (corner - whole).cast<float>();
    const AlignSums sums = sum_patch(patch.patch, image, at, fraction.x(), fraction.y());
    const float gain = sums.v_value / patch.value_square;
    if (!(gain > kMinGain && gain < kMaxGain)) return std::nullopt;
    const double step = -sums.v_along / (gain * patch.along_square);
    if (std::abs(step) < kConvergedPx) {
      const float variation = std::max(sums.v_v - sums.v * sums.v / kAlignArea, 1.0f);
      result.correlation = sums.v_value / std::sqrt(variation * patch.value_square);
      const float determinant =
          patch.along_square * patch.across_square - patch.along_across * patch.along_across;
      result.across_px = -sums.v_across * patch.along_square / (gain * determinant);
      return result;
    }
    result.along_px += std::clamp(step, -kMaxStepPx, kMaxStepPx);
    if (std::abs(result.along_px) > kMaxAlignPx) return std::nullopt;
  }
  return std::nullopt;
}

}  // namespace waymark

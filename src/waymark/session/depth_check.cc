// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/session/depth_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "waymark/base/text.h"
#include "waymark/image/convert.h"

namespace waymark {
namespace {

/// Depth cameras measure from some 0.25 m on to some 10 m; less than 5 % of an image is nearer,
/// less than 5 % is further.
constexpr double kNearM = 0.25;
constexpr double kFarM = 15.0;

/// Outlines are compared in images of about this width.
constexpr double kComparedWidthPx = 320.0;
/// Depth jumps there by this factor at least.
constexpr float kMinJump = 1.15f;
/// An image has enough outlines from so many on; of more a part is used.
constexpr std::size_t kMinOutlines = 100;
constexpr std::size_t kMaxOutlines = 2000;
/// Contrast beyond that does not count more, in grey values.
constexpr int kMaxContrast = 40;

/// How outlines are moved: enlarged about the middle of the image, then shifted.
constexpr std::array kScales = {0.85, 0.92, 1.0, 1.08, 1.17};
constexpr int kReachPx = 16;
constexpr int kStepPx = 2;
constexpr int kNumShifts = 2 * kReachPx / kStepPx + 1;

struct Move {
  double scale;
  int dx_px;
  int dy_px;
};

constexpr std::size_t kNumMoves =
    kScales.size() * static_cast<std::size_t>(kNumShifts) * static_cast<std::size_t>(kNumShifts);

Move move_of(std::size_t index) {
  const int shift = static_cast<int>(index) % (kNumShifts * kNumShifts);
  return {kScales[index / static_cast<std::size_t>(kNumShifts * kNumShifts)],
          kStepPx * (shift % kNumShifts) - kReachPx,
          kStepPx * (shift / kNumShifts) - kReachPx};
}

/// Where outlines have that much more contrast elsewhere, they belong there. While the camera moves
/// fast they do, too, as depth is taken a little later: three of 15 images of TUM fr1_rpy. So it
/// has to be the same place in most images.
constexpr double kMinGain = 1.08;
constexpr double kMinAgreeing = 0.65;
constexpr std::size_t kMinCompared = 8;

/// Outlines are jagged, and lag a little.
bool is_small(const Move& move) {
  return move.scale == 1.0 && std::hypot(move.dx_px, move.dy_px) <= 1.5 * kStepPx;
}

/// The contrast where the outlines are.
double at_rest(const std::vector<double>& contrasts) {
  double most = 0.0;
  for (std::size_t m = 0; m < kNumMoves; ++m) {
    if (is_small(move_of(m))) most = std::max(most, contrasts[m]);
  }
  return most;
}

/// Of the grey values on both sides.
int contrast_at(const Image& image, int x, int y, bool is_vertical) {
  if (x < 2 || y < 2 || x >= image.width_px - 2 || y >= image.height_px - 2) return -1;
  const std::uint8_t* const row = image.row(y) + x;
  const int width = image.width_px;
  const int difference = is_vertical ? row[2] - row[-2] : row[2 * width] - row[-2 * width];
  return std::min(std::abs(difference), kMaxContrast);
}

}  // namespace

DepthCheck::DepthCheck() : histogram_(65536) {}

void DepthCheck::add(ImageView image, DepthView depth) {
  ++num_images_;
  add_units(depth);
  reduction_ = std::min(0.5, kComparedWidthPx / image.width_px);
  const Image small = reduce(image, reduction_);
  const DepthImage small_depth = pick_reduced(depth, reduction_);
  std::vector<Outline> outlines;
  const auto add_jump = [&](std::uint16_t a, std::uint16_t b, const Outline& outline) {
    if (a == 0 || b == 0) return;
    const auto [nearer, further] = std::minmax(a, b);
    if (static_cast<float>(further) > kMinJump * static_cast<float>(nearer)) {
      outlines.push_back(outline);
    }
  };
  for (int y = 0; y + 1 < small_depth.height_px; ++y) {
    const std::uint16_t* const row = small_depth.row(y);
    const std::uint16_t* const below = small_depth.row(y + 1);
    for (int x = 0; x + 1 < small_depth.width_px; ++x) {
      const auto u = static_cast<float>(x), v = static_cast<float>(y);
      add_jump(row[x], row[x + 1], {u + 0.5f, v, true});
      add_jump(row[x], below[x], {u, v + 0.5f, false});
    }
  }
  if (outlines.size() >= kMinOutlines) add_outlines(outlines, small);
}

void DepthCheck::add_units(DepthView depth) {
  for (int y = 0; y < depth.height_px; ++y) {
    for (int x = 0; x < depth.width_px; ++x) ++histogram_[depth.row(y)[x]];
  }
  histogram_[0] = 0;
}

/// The mean contrast for each move, in units of that over all moves.
void DepthCheck::add_outlines(const std::vector<Outline>& outlines, const Image& image) {
  const std::size_t every = outlines.size() / kMaxOutlines + 1;
  const double centre_x = 0.5 * image.width_px, centre_y = 0.5 * image.height_px;
  std::vector<double> means(kNumMoves);
  double total = 0.0;
  for (std::size_t m = 0; m < kNumMoves; ++m) {
    const Move move = move_of(m);
    double sum = 0.0, count = 0.0;
    for (std::size_t i = 0; i < outlines.size(); i += every) {
      const Outline& outline = outlines[i];
      const double x = centre_x + move.scale * (outline.x_px - centre_x) + move.dx_px;
      const double y = centre_y + move.scale * (outline.y_px - centre_y) + move.dy_px;
      const int contrast = contrast_at(image,
                                       static_cast<int>(std::lround(x)),
                                       static_cast<int>(std::lround(y)),
                                       outline.is_vertical);
      if (contrast < 0) continue;
      sum += contrast;
      count += 1.0;
    }
    means[m] = count > 0.0 ? sum / count : 0.0;
    total += means[m] / static_cast<double>(kNumMoves);
  }
  if (total == 0.0) return;
  for (double& mean : means) mean /= total;
  contrasts_.push_back(std::move(means));
}

double DepthCheck::quantile(double share) const {
  std::uint64_t total = 0;
  for (const std::uint64_t count : histogram_) total += count;
  std::uint64_t so_far = 0;
  for (std::size_t units = 0; units < histogram_.size(); ++units) {
    so_far += histogram_[units];
    if (static_cast<double>(so_far) > share * static_cast<double>(total)) {
      return static_cast<double>(units);
    }
  }
  return 0.0;
}

std::optional<std::string> DepthCheck::advise_on_units(double units_per_metre) const {
  const double near_m = quantile(0.05) / units_per_metre;
  const double far_m = quantile(0.95) / units_per_metre;
  const bool is_nothing = far_m == 0.0;
  if (is_nothing || (near_m >= kNearM && far_m <= kFarM)) return std::nullopt;
  return fmt::format(
      "depth reaches from {:.3g} to {:.3g} m, which no depth camera measures: is depth.factor "
      "right? It is {:g}; 1000 is for depth images in millimetres, 5000 for the TUM benchmark",
      near_m,
      far_m,
      units_per_metre);
}

std::optional<std::string> DepthCheck::advise_on_registration() const {
  if (contrasts_.size() < kMinCompared) return std::nullopt;
  std::vector<double> sums(kNumMoves);
  for (const std::vector<double>& contrasts : contrasts_) {
    for (std::size_t m = 0; m < kNumMoves; ++m) sums[m] += contrasts[m];
  }
  const auto best =
      static_cast<std::size_t>(std::max_element(sums.begin(), sums.end()) - sums.begin());
  const auto num_agreeing = std::ranges::count_if(contrasts_, [&](const auto& contrasts) {
    return contrasts[best] > kMinGain * at_rest(contrasts);
  });
  if (static_cast<double>(num_agreeing) < kMinAgreeing * static_cast<double>(contrasts_.size())) {
    return std::nullopt;
  }
  const Move move = move_of(best);
  return fmt::format(
      "depth fits the images where it is moved by {:.0f} px to the right and {:.0f} px down and "
      "enlarged by {:g}: is it registered to the colour camera? Use the aligned depth of the "
      "camera's driver",
      unsigned_zero(move.dx_px / reduction_),
      unsigned_zero(move.dy_px / reduction_),
      move.scale);
}

}  // namespace waymark

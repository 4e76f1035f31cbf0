// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/calibrate/model_selection.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <numeric>
#include <optional>

#include "waymark/base/median.h"
#include "waymark/calibrate/lens.h"
#include "waymark/camera/tangent.h"
#include "waymark/features/frame_builder.h"
#include "waymark/features/pyramid.h"
#include "waymark/geometry/two_view.h"
#include "waymark/match/appearance.h"

namespace waymark {
namespace {

constexpr double kNoisePx = 0.6;
constexpr std::size_t kNumPairs = 48;
constexpr std::size_t kMinMatches = 120;
constexpr std::size_t kMaxApart = 64;

/// Features of the images that are asked for, as far as they do not depend on the camera.
class FeatureStore {
 public:
  FeatureStore(std::span<const Image> images,
               std::span<const Image> masks,
               const CameraDescription& any)
      : images_(images),
        masks_(masks),
        builder_({{{changed(any, LensChange::Zero())->camera, Rigid3(), any}}}, {}) {}

  const Features& of(std::size_t index) {
    std::shared_ptr<const Features>& features = features_[index];
    if (!features) {
      FrameImages frame;
      frame.image0 = images_[index].view();
      frame.mask = masks_[index].view();
      features = builder_.build(frame);
    }
    return *features;
  }

 private:
  std::span<const Image> images_;
  std::span<const Image> masks_;
  FrameBuilder builder_;
  std::map<std::size_t, std::shared_ptr<const Features>> features_;
};

PixelMatches pixels_of(const Features& a,
                       const Features& b,
                       std::span<const FeatureMatch> matches) {
  PixelMatches pixels;
  std::vector<double> shifts;
  for (const FeatureMatch& match : matches) {
    const Keypoint& in_a = a.keypoints[match.a];
    const Keypoint& in_b = b.keypoints[match.b];
    pixels.pixels_a.emplace_back(in_a.x_px, in_a.y_px);
    pixels.pixels_b.emplace_back(in_b.x_px, in_b.y_px);
    pixels.scales_a.push_back(static_cast<float>(Pyramid::scale(in_a.level)));
    pixels.scales_b.push_back(static_cast<float>(Pyramid::scale(in_b.level)));
    shifts.push_back((pixels.pixels_a.back() - pixels.pixels_b.back()).norm());
  }
  if (!shifts.empty()) pixels.shift_px = median(shifts);
  return pixels;
}

/// The image furthest from one that is recognised in it, by doubling.
std::optional<PixelMatches> widest_pair(FeatureStore& store, std::size_t first, std::size_t end) {
  const Features& a = store.of(first);
  std::optional<PixelMatches> widest;
  for (std::size_t apart = 4; apart <= kMaxApart && first + apart < end; apart *= 2) {
    auto next = match_pixels(a, store.of(first + apart));
    if (!next) break;
    widest = std::move(next);
  }
  return widest;
}

struct SideOfMatches {
  std::vector<Eigen::Vector3d> bearings;
  std::vector<double> sigmas_rad;
  std::vector<std::uint8_t> is_valid;
};

SideOfMatches look_through(const Camera& camera,
                           std::span<const Eigen::Vector2d> pixels,
                           std::span<const float> scales) {
  TangentComputer computer;
  const TangentArrays& tangents = computer.compute(camera, pixels, scales);
  SideOfMatches side;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    side.bearings.push_back(tangents.bearings[i].cast<double>().normalized());
    side.sigmas_rad.push_back(kNoisePx * tangents.size_rad[i]);
    side.is_valid.push_back(tangents.is_valid[i]);
  }
  return side;
}

/// Only what has a direction in both images.
void keep_valid(SideOfMatches& a, SideOfMatches& b) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < a.bearings.size(); ++i) {
    if (!a.is_valid[i] || !b.is_valid[i]) continue;
    for (SideOfMatches* side : {&a, &b}) {
      side->bearings[count] = side->bearings[i];
      side->sigmas_rad[count] = side->sigmas_rad[i];
    }
    ++count;
  }
  for (SideOfMatches* side : {&a, &b}) {
    side->bearings.resize(count);
    side->sigmas_rad.resize(count);
  }
}

constexpr double kNarrowestRad = 35.0 * kRadiansPerDegree;
constexpr double kWidestRad = 200.0 * kRadiansPerDegree;
constexpr double kUsualFovRad = 65.0 * kRadiansPerDegree;  ///< Many cameras have about that.
constexpr double kFovRatio = 1.2;
constexpr std::array<double, 5> kDivisions = {0.0, -0.1, -0.2, -0.33, -0.45};
constexpr int kNumRefinements = 2;
constexpr double kNever = std::numeric_limits<double>::infinity();

struct RankedLens {
  DivisionLens lens;
  double cost = kNever;
};

/// What a lens costs for being unusual: it decides where the images hardly tell. Per match.
double unlikeliness(const DivisionLens& lens, double likely_fov_rad) {
  constexpr double kSpreadOfFov = 0.35;  // Standard deviation of its logarithm.
  constexpr double kSpreadOfDivision = 0.2;
  constexpr double kWeight = 0.002;
  const double of_fov = std::log(lens.fov_rad / likely_fov_rad) / kSpreadOfFov;
  const double of_division = lens.division / kSpreadOfDivision;
  return kWeight * (of_fov * of_fov + of_division * of_division);
}

/// How much finer a lens shows the corner of the image around the axis than away from it. Beyond
/// what residuals allow for, a lens would be let off its errors; no lens in use does that.
double stretch_in_corner(const DivisionLens& lens, const CameraDescription& size) {
  const double radius =
      0.5 * std::hypot(size.width_px, size.height_px) / lens.focal_px(size.width_px);
  const double bent = lens.division * radius * radius;
  return std::hypot(radius, 1.0 + bent) / std::max(1.0 - bent, 1e-9);
}

/// The better of two lenses; the costs of the first are known.
RankedLens better_of(const RankedLens& known,
                     const DivisionLens& lens,
                     std::span<const PixelMatches> pairs,
                     const CameraDescription& assumed,
                     double likely_fov_rad) {
  CameraDescription description = assumed;
  const double focal_px = lens.focal_px(assumed.width_px);
  if (!(focal_px > 0.1 * assumed.width_px)) return known;
  if (stretch_in_corner(lens, assumed) > TangentComputer::kMaxStretch) return known;
  description.camera_model = "division";
  description.distortion_model = "division";
  description.distortion_coeffs = {lens.division};
  description.intrinsics[0] = description.intrinsics[1] = focal_px;
  const auto camera = make_if_possible(description);
  if (!camera) return known;
  const double cost = two_view_cost(*camera, pairs) + unlikeliness(lens, likely_fov_rad);
  return cost < known.cost ? RankedLens{lens, cost} : known;
}

}  // namespace

std::optional<PixelMatches> match_pixels(const Features& a, const Features& b) {
  AppearanceMatcher matcher;
  std::vector<std::uint32_t> indices(a.num_primary);
  std::iota(indices.begin(), indices.end(), 0u);
  const auto matches = matcher.match_all(a, indices, b, AppearanceOptions{});
  if (matches.size() < kMinMatches) return std::nullopt;
  return pixels_of(a, b, matches);
}

std::vector<PixelMatches> match_stretch(std::span<const Image> images,
                                        std::span<const Image> masks,
                                        const CameraDescription& any) {
  std::vector<PixelMatches> pairs;
  if (images.empty()) return pairs;
  FeatureStore store(images, masks, any);
  for (std::size_t i = 0; i < kNumPairs; ++i) {
    const std::size_t first = i * images.size() / kNumPairs;
    if (auto pair = widest_pair(store, first, images.size())) pairs.push_back(*std::move(pair));
  }
  return pairs;
}

double two_view_cost(const Camera& camera, std::span<const PixelMatches> pairs) {
  constexpr double kCostWithout = 8.0;
  double sum = 0.0;
  double num_matches = 0.0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    SideOfMatches a = look_through(camera, pairs[i].pixels_a, pairs[i].scales_a);
    SideOfMatches b = look_through(camera, pairs[i].pixels_b, pairs[i].scales_b);
    keep_valid(a, b);
    const TwoViewModels models = fit_two_view_models(
        {a.bearings, b.bearings, a.sigmas_rad, b.sigmas_rad}, {.stream = i, .confidence = 0.99});
    const double num_seen = static_cast<double>(a.bearings.size());
    sum += std::min(models.cost, kCostWithout * num_seen) +
           kCostWithout * (static_cast<double>(pairs[i].pixels_a.size()) - num_seen);
    num_matches += static_cast<double>(pairs[i].pixels_a.size());
  }
  return sum / std::max(num_matches, 1.0);
}

double DivisionLens::focal_px(int width_px) const {
  const double cotangent = 1.0 / std::tan(0.5 * fov_rad);
  const double radius = 2.0 / (cotangent + std::sqrt(cotangent * cotangent - 4.0 * division));
  return 0.5 * width_px / radius;
}

DivisionLens find_division_lens(std::span<const PixelMatches> pairs,
                                const CameraDescription& assumed,
                                std::optional<double> known_fov_rad) {
  const double likely_fov_rad = known_fov_rad.value_or(kUsualFovRad);
  std::vector<PixelMatches> half;
  for (std::size_t i = 0; i < pairs.size(); i += 2) half.push_back(pairs[i]);
  std::vector<double> fovs_rad;
  if (known_fov_rad) {
    fovs_rad = {*known_fov_rad};
  } else {
    for (double fov = kNarrowestRad; fov <= kWidestRad; fov *= kFovRatio) fovs_rad.push_back(fov);
  }
  RankedLens best;
  for (const double fov : fovs_rad) {
    for (const double division : kDivisions) {
      best = better_of(best, {fov, division}, half, assumed, likely_fov_rad);
    }
  }
  best.cost = kNever;
  double fov_ratio = known_fov_rad ? 1.0 : std::sqrt(kFovRatio);
  double step = 0.06;
  for (int round = 0; round < kNumRefinements; ++round) {
    const DivisionLens center = best.lens;
    for (const double ratio : {1.0, 1.0 / fov_ratio, fov_ratio}) {
      for (const double offset : {0.0, -step, step}) {
        const DivisionLens lens{center.fov_rad * ratio, center.division + offset};
        best = better_of(best, lens, pairs, assumed, likely_fov_rad);
      }
    }
    fov_ratio = std::sqrt(fov_ratio);
    step *= 0.5;
  }
  return best.lens;
}

}  // namespace waymark

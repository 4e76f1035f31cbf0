// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/rectification_error.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "waymark/base/rng.h"
#include "waymark/camera/pixel_angles.h"

namespace waymark {
namespace {

/// Of the draws; frames have those from 0 on.
constexpr std::uint64_t kRectificationStream = ~std::uint64_t{0};
/// The worst place is looked for at so many pixels per row and column, corners included.
constexpr int kNumSamples = 33;

std::vector<BearingError::Terms> terms_over_image(const Camera& camera) {
  std::vector<Eigen::Vector2d> pixels;
  for (int i = 0; i < kNumSamples * kNumSamples; ++i) {
    const Eigen::Vector2d share(i % kNumSamples, i / kNumSamples);
    pixels.push_back(
        share.cwiseProduct(Eigen::Vector2d(camera.width_px() - 1, camera.height_px() - 1)) /
        (kNumSamples - 1));
  }
  std::vector<Eigen::Vector3d> bearings(pixels.size());
  std::vector<std::uint8_t> is_valid(pixels.size());
  camera.unproject(pixels, bearings, is_valid);
  std::vector<BearingError::Terms> terms;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (is_valid[i]) terms.push_back(BearingError::terms(bearings[i]));
  }
  return terms;
}

/// Terms that all matter alike at the sides, whose sum is nowhere larger than this.
BearingError::Terms draw_terms(const std::vector<BearingError::Terms>& of_image,
                               double largest_rad,
                               Rng& rng) {
  BearingError::Terms sides = BearingError::Terms::Zero();
  for (const BearingError::Terms& terms : of_image) sides = sides.cwiseMax(terms.cwiseAbs());
  BearingError::Terms drawn;
  for (int i = 0; i < BearingError::kNumTerms; ++i) drawn[i] = rng.normal() / sides[i];
  double largest = 0.0;
  for (const BearingError::Terms& terms : of_image) {
    largest = std::max(largest, std::abs(drawn.dot(terms)));
  }
  return largest_rad / largest * drawn;
}

}  // namespace

RectificationError::RectificationError(const RigCamera& camera1,
                                       const Eigen::Vector2d& largest_px,
                                       std::uint64_t seed)
    : baseline_(camera1.cam_from_rig.translation.normalized()) {
  const std::vector<BearingError::Terms> of_image = terms_over_image(*camera1.camera);
  const Eigen::Vector2d largest_rad = central_pixel_angle(*camera1.camera) * largest_px;
  Rng rng(seed, kRectificationStream);
  error_.along_rad = draw_terms(of_image, largest_rad[0], rng);
  error_.across_rad = draw_terms(of_image, largest_rad[1], rng);
}

Eigen::Vector3d RectificationError::true_bearing(const Eigen::Vector3d& told) const {
  const Eigen::Vector3d toward = baseline_ - baseline_.dot(told) * told;
  if (!(toward.norm() > 0.0)) return told;  // There is no line, or there are all of them.
  const Eigen::Vector3d along = toward.normalized();
  const Eigen::Vector2d off_rad = error_.at(told);
  return (told - off_rad[0] * along - off_rad[1] * told.cross(along)).normalized();
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/stitch.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace waymark {
namespace {

/// The angle over which one image fades into the other.
constexpr double kBlendRad = 2.0 * std::numbers::pi / 180.0;

}  // namespace

Stitch::Stitch(const Camera& camera) {
  std::vector<Eigen::Vector2d> pixels;
  for (int y = 0; y < camera.height_px(); ++y) {
    for (int x = 0; x < camera.width_px(); ++x) pixels.emplace_back(x, y);
  }
  std::vector<Eigen::Vector3d> bearings(pixels.size());
  std::vector<std::uint8_t> is_valid(pixels.size());
  camera.unproject(pixels, bearings, is_valid);
  front_share_.reserve(bearings.size());
  for (const Eigen::Vector3d& bearing : bearings) {
    const double share = 0.5 + std::asin(std::clamp(bearing.z(), -1.0, 1.0)) / kBlendRad;
    front_share_.push_back(static_cast<float>(std::clamp(share, 0.0, 1.0)));
  }
}

Image Stitch::join(const Image& front, const Image& back) const {
  Image joined = back;
  for (std::size_t i = 0; i < front_share_.size(); ++i) {
    const auto from_back = static_cast<float>(back.values[i]);
    const float grey =
        from_back + front_share_[i] * (static_cast<float>(front.values[i]) - from_back);
    joined.values[i] = static_cast<std::uint8_t>(grey + 0.5f);
  }
  return joined;
}

}  // namespace waymark

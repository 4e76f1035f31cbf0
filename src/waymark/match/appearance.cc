// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/match/appearance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

#include "waymark/base/check.h"
#include "waymark/match/nearest.h"

namespace waymark {
namespace {

constexpr int kNumBins = 36;
/// Matches in the fullest bin and one on each side of it agree: 30 degrees in all.
constexpr int kNumAgreeingBins = 1;
/// Where less than this part agrees, the image did not turn as one: a camera that sees all round
/// and tilts turns what is on either side against each other. Then the vote says nothing.
constexpr double kMinAgreeing = 0.5;
/// Features two levels apart are not the same corner unless the camera moved far.
constexpr float kMaxSizeRatio = 1.8f;

int rotation_bin(const FeatureMatch& match, const Features& a, const Features& b) {
  constexpr double kTurn = 2.0 * std::numbers::pi;
  const double change = b.keypoints[match.b].angle_rad - a.keypoints[match.a].angle_rad;
  const double turns = change / kTurn - std::floor(change / kTurn);
  return std::min(static_cast<int>(turns * kNumBins), kNumBins - 1);
}

}  // namespace

std::span<const FeatureMatch> AppearanceMatcher::match_all(const Features& a,
                                                           std::span<const std::uint32_t> indices_a,
                                                           const Features& b,
                                                           const AppearanceOptions& options) {
  begin(b);
  candidates_.resize(b.num_corners());
  std::iota(candidates_.begin(), candidates_.end(), 0u);
  for (std::uint32_t index : indices_a) {
    if (!a.is_edge(index)) choose(index, a, b, options);
  }
  return finish(a, b);
}

std::span<const FeatureMatch> AppearanceMatcher::match_near(
    const Features& a,
    std::span<const Eigen::Vector2f> expected_pixels,
    double radius_px,
    const Features& b,
    const AppearanceOptions& options) {
  WAYMARK_CHECK(expected_pixels.size() == a.num_primary);
  begin(b);
  for (std::uint32_t index = 0; index < a.num_corners(); ++index) {
    const Eigen::Vector2f pixel = expected_pixels[index];
    const float size = a.size_rad[index];
    candidates_.clear();
    b.grid.visit_near(pixel.x(), pixel.y(), radius_px, [&](std::uint32_t feature) {
      if (b.is_edge(feature)) return;
      const Keypoint& keypoint = b.keypoints[feature];
      const double across = b.grid.column_distance_px(keypoint.x_px, pixel.x());
      if (std::hypot(across, keypoint.y_px - pixel.y()) > radius_px) return;
      const float ratio = b.size_rad[feature] / size;
      if (ratio < kMaxSizeRatio && ratio > 1.0f / kMaxSizeRatio) candidates_.push_back(feature);
    });
    choose(index, a, b, options);
  }
  return finish(a, b);
}

void AppearanceMatcher::begin(const Features& b) {
  best_of_b_.assign(b.num_primary, FeatureMatch{kNoFeature, kNoFeature, UINT16_MAX});
}

void AppearanceMatcher::choose(std::uint32_t index_a,
                               const Features& a,
                               const Features& b,
                               const AppearanceOptions& options) {
  if (candidates_.empty()) return;
  const auto nearest =
      find_nearest(a.descriptors[index_a], b.descriptors, candidates_, options, distances_);
  if (!nearest) return;
  FeatureMatch& owner = best_of_b_[nearest->feature];
  if (nearest->distance < owner.distance) owner = {index_a, nearest->feature, nearest->distance};
}

std::span<const FeatureMatch> AppearanceMatcher::finish(const Features& a, const Features& b) {
  matches_.clear();
  std::array<int, kNumBins> votes{};
  for (const FeatureMatch& match : best_of_b_) {
    if (match.a == kNoFeature) continue;
    matches_.push_back(match);
    ++votes[static_cast<std::size_t>(rotation_bin(match, a, b))];
  }
  const auto fullest = std::max_element(votes.begin(), votes.end()) - votes.begin();
  const auto disagrees = [&](const FeatureMatch& match) {
    const int apart = std::abs(rotation_bin(match, a, b) - static_cast<int>(fullest));
    return std::min(apart, kNumBins - apart) > kNumAgreeingBins;
  };
  const auto num_disagreeing = std::count_if(matches_.begin(), matches_.end(), disagrees);
  if (static_cast<double>(num_disagreeing) <=
      (1.0 - kMinAgreeing) * static_cast<double>(matches_.size())) {
    std::erase_if(matches_, disagrees);
  }
  return matches_;
}

}  // namespace waymark

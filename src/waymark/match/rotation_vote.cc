// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/match/rotation_vote.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace waymark {
namespace {

/// Cosine of half the angle that two rotations may differ by: 30 degrees, for the noise of
/// orientations and the parallax of what is near.
constexpr float kMinHalfCos = 0.966f;

/// A frame with the bearing as third axis and the orientation of the patch, on the sphere, as
/// first.
Eigen::Matrix3f frame_of(const Features& features, std::uint32_t index) {
  const Eigen::Vector3f bearing = features.bearings[index];
  const Matrix23f& pixel_from_bearing = features.level_pixel_from_bearing[index];
  const float angle = features.keypoints[index].angle_rad;
  const Eigen::Vector2f in_image(std::cos(angle), std::sin(angle));
  const Eigen::Matrix2f gram = pixel_from_bearing * pixel_from_bearing.transpose();
  Eigen::Vector3f along = pixel_from_bearing.transpose() * (gram.inverse() * in_image);
  along = (along - along.dot(bearing) * bearing).normalized();
  Eigen::Matrix3f frame;
  frame << along, bearing.cross(along), bearing;
  return frame;
}

}  // namespace

std::span<const FeatureMatch> RotationVote::agreeing(const Features& a,
                                                     const Features& b,
                                                     std::span<const FeatureMatch> matches) {
  turns_.clear();
  for (const FeatureMatch& match : matches) {
    const Eigen::Matrix3f turn = frame_of(b, match.b) * frame_of(a, match.a).transpose();
    turns_.push_back(Eigen::Quaternionf(turn).coeffs());
  }
  const auto agrees = [&](std::size_t i, std::size_t j) {
    return std::abs(turns_[i].dot(turns_[j])) >= kMinHalfCos;
  };
  std::size_t best = 0;
  std::size_t most = 0;
  for (std::size_t i = 0; i < turns_.size(); ++i) {
    std::size_t count = 0;
    for (std::size_t j = 0; j < turns_.size(); ++j) count += agrees(i, j);
    if (count > most) {
      most = count;
      best = i;
    }
  }
  agreeing_.clear();
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (agrees(best, i)) agreeing_.push_back(matches[i]);
  }
  return agreeing_;
}

}  // namespace waymark

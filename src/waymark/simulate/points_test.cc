// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/testing/points.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <set>

#include "waymark/camera/perspective.h"
#include "waymark/features/pyramid.h"
#include "waymark/simulate/motion.h"

namespace waymark {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

Rig make_rig_of(int num_cameras) {
  const auto camera = std::make_shared<PerspectiveCamera>(
      PerspectiveModel({420.0, 420.0}, {319.5, 239.5}), 640, 480);
  Rig rig;
  rig.cameras.push_back({camera, Rigid3()});
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.04, Vector3d(0.2, 1.0, 0.1).normalized()));
  if (num_cameras > 1) rig.cameras.push_back({camera, Rigid3(turn, {-0.12, 0.01, 0.0})});
  return rig;
}

class Points : public ::testing::Test {
 protected:
  /// W * (predicted bearing - measured bearing) of a feature that is no outlier.
  Vector2d residual(const PointObservation& seen, std::size_t feature) const {
    const Features& features = *seen.features;
    const Keypoint& keypoint = features.keypoints[feature];
    const Rigid3 cam_from_world =
        stereo_->cameras[keypoint.camera].cam_from_rig * world_from_rig_.inverse();
    const PointLandmark& landmark = cloud_.landmarks[seen.landmark_of_feature[feature]];
    const Vector3d predicted = (cam_from_world * landmark.position).normalized();
    const Vector3d difference = predicted - features.bearings[feature].cast<double>();
    return features.level_pixel_from_bearing[feature].cast<double>() * difference;
  }

  double range_of(const PointObservation& seen, std::size_t feature) const {
    const PointLandmark& landmark = cloud_.landmarks[seen.landmark_of_feature[feature]];
    return (landmark.position - world_from_rig_.translation).norm();
  }

  std::shared_ptr<const World> world_ = make_world("bare", 2);
  PointCloud cloud_ = scatter_on(world_, 6000, 3.0, 5);
  const std::shared_ptr<const Rig> mono_ = std::make_shared<const Rig>(make_rig_of(1));
  const std::shared_ptr<const Rig> stereo_ = std::make_shared<const Rig>(make_rig_of(2));
  Rigid3 world_from_rig_ = make_motion("bare", "loop", 10.0).world_from_rig(2.0);
};

TEST_F(Points, ResidualsHaveTheSigmaAskedFor) {
  PointNoise noise;
  noise.pixel_sigma = 0.7;
  double squares = 0.0;
  double count = 0.0;
  for (std::uint64_t frame = 0; frame < 4; ++frame) {
    const PointObservation seen = observe(cloud_, stereo_, world_from_rig_, noise, frame);
    ASSERT_GT(seen.features->num_primary, 200u);
    for (std::size_t i = 0; i < seen.features->num_primary; ++i) {
      squares += residual(seen, i).squaredNorm();
      count += 2.0;
    }
  }
  EXPECT_NEAR(std::sqrt(squares / count), 0.7, 0.03);
}

TEST_F(Points, ArraysAreCompleteAndOrdered) {
  PointNoise noise;
  noise.outlier_share = 0.2;
  const PointObservation seen = observe(cloud_, stereo_, world_from_rig_, noise, 1);
  const Features& features = *seen.features;
  const std::size_t primary = features.num_primary;
  ASSERT_GT(features.size(), primary);
  EXPECT_EQ(features.descriptors.size(), primary);
  EXPECT_EQ(features.range_m.size(), primary);
  EXPECT_EQ(features.inverse_range_sigma.size(), primary);
  EXPECT_EQ(features.bearings.size(), features.size());
  EXPECT_EQ(features.level_pixel_from_bearing.size(), features.size());
  EXPECT_EQ(features.size_rad.size(), features.size());
  EXPECT_EQ(features.partner.size(), features.size());
  EXPECT_EQ(seen.landmark_of_feature.size(), features.size());
  std::size_t num_outliers = 0;
  for (std::size_t i = 0; i < features.size(); ++i) {
    EXPECT_EQ(features.keypoints[i].camera, i < primary ? 0 : 1);
    num_outliers += seen.landmark_of_feature[i] == kNoLandmark ? 1 : 0;
    const std::uint32_t partner = features.partner[i];
    if (i >= primary) {
      EXPECT_LT(partner, primary);
    }
    if (partner == kNoFeature) continue;
    EXPECT_EQ(features.partner[partner], i);
    EXPECT_EQ(seen.landmark_of_feature[partner], seen.landmark_of_feature[i]);
  }
  EXPECT_NEAR(static_cast<double>(num_outliers), 0.2 * static_cast<double>(primary), 3.0);
  const Keypoint& keypoint = features.keypoints[primary / 2];
  std::set<std::uint32_t> near;
  features.grid.visit_near(
      keypoint.x_px, keypoint.y_px, 5.0, [&](std::uint32_t index) { near.insert(index); });
  EXPECT_TRUE(near.contains(static_cast<std::uint32_t>(primary / 2)));
}

TEST_F(Points, SizeAndLevelFollowFromDistance) {
  PointNoise noise;
  noise.pixel_sigma = 0.0;
  const PointObservation seen = observe(cloud_, mono_, world_from_rig_, noise, 1);
  std::set<int> levels;
  for (std::size_t i = 0; i < seen.features->num_primary; ++i) {
    const PointLandmark& landmark = cloud_.landmarks[seen.landmark_of_feature[i]];
    const double expected = landmark.size_m / range_of(seen, i);
    const double half_level = std::sqrt(Pyramid::kScaleFactor) + 1e-3;
    EXPECT_LT(seen.features->size_rad[i], expected * half_level);
    EXPECT_GT(seen.features->size_rad[i], expected / half_level);
    levels.insert(seen.features->keypoints[i].level);
  }
  EXPECT_EQ(levels.size(), 8u);
}

TEST_F(Points, DescriptorsFlipAsAsked) {
  PointNoise noise;
  noise.flip_probability = 0.1;
  const PointObservation seen = observe(cloud_, mono_, world_from_rig_, noise, 1);
  double flips = 0.0;
  for (std::size_t i = 0; i < seen.features->num_primary; ++i) {
    const Descriptor& look = cloud_.landmarks[seen.landmark_of_feature[i]].descriptor;
    for (std::size_t word = 0; word < 4; ++word) {
      flips += std::popcount(look[word] ^ seen.features->descriptors[i][word]);
    }
  }
  EXPECT_NEAR(flips / (256.0 * static_cast<double>(seen.features->num_primary)), 0.1, 0.005);
}

TEST_F(Points, StereoRangesAreRight) {
  PointNoise noise;
  noise.pixel_sigma = 0.0;
  const PointObservation seen = observe(cloud_, stereo_, world_from_rig_, noise, 1);
  int num_ranges = 0;
  for (std::size_t i = 0; i < seen.features->num_primary; ++i) {
    if (seen.features->range_m[i] <= 0.0f) continue;
    EXPECT_NEAR(seen.features->range_m[i] / range_of(seen, i), 1.0, 0.01);
    ++num_ranges;
  }
  EXPECT_GT(num_ranges, static_cast<int>(seen.features->num_primary / 2));
}

TEST_F(Points, MeasuredRangesHaveTheSigmaAskedFor) {
  PointNoise noise;
  noise.inverse_range_sigma = 0.01;
  const PointObservation seen = observe(cloud_, mono_, world_from_rig_, noise, 1);
  double squares = 0.0;
  for (std::size_t i = 0; i < seen.features->num_primary; ++i) {
    EXPECT_FLOAT_EQ(seen.features->inverse_range_sigma[i], 0.01f);
    squares += std::pow(1.0 / seen.features->range_m[i] - 1.0 / range_of(seen, i), 2);
  }
  EXPECT_NEAR(std::sqrt(squares / static_cast<double>(seen.features->num_primary)), 0.01, 1e-3);
}

TEST_F(Points, WhatIsHiddenIsNotSeen) {
  const PointObservation seen = observe(cloud_, mono_, world_from_rig_, PointNoise(), 1);
  ASSERT_GT(seen.landmark_of_feature.size(), 100u);
  for (const std::uint32_t landmark : seen.landmark_of_feature) {
    const Vector3d eye = world_from_rig_.translation;
    const auto hit = world_->intersect(eye, cloud_.landmarks[landmark].position - eye);
    ASSERT_TRUE(hit.has_value());
    EXPECT_NEAR(hit->hit.distance, 1.0, 1e-2);
  }
}

TEST_F(Points, DependOnSeedAndFrameOnly) {
  PointNoise noise;
  noise.max_features = 150;
  const PointObservation first = observe(cloud_, stereo_, world_from_rig_, noise, 7);
  observe(cloud_, stereo_, world_from_rig_, noise, 8);
  const PointObservation again = observe(cloud_, stereo_, world_from_rig_, noise, 7);
  const PointObservation other = observe(cloud_, stereo_, world_from_rig_, noise, 8);
  EXPECT_EQ(first.features->num_primary, 150u);
  EXPECT_EQ(first.landmark_of_feature, again.landmark_of_feature);
  EXPECT_EQ(first.features->descriptors, again.features->descriptors);
  EXPECT_EQ(first.features->bearings, again.features->bearings);
  EXPECT_NE(first.features->bearings, other.features->bearings);
}

TEST_F(Points, InABoxNothingHides) {
  const PointCloud cloud = scatter_in({-2.0, -2.0, 2.0}, {2.0, 2.0, 6.0}, 300, 4.0, 1);
  PointNoise noise;
  noise.miss_probability = 0.0;
  const PointObservation seen = observe(cloud, mono_, Rigid3(), noise, 0);
  EXPECT_GT(seen.features->num_primary, 150u);
}

}  // namespace
}  // namespace waymark

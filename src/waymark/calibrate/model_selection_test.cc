// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/calibrate/model_selection.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "waymark/base/rng.h"
#include "waymark/calibrate/lens.h"
#include "waymark/calibrate/missing_distortion.h"
#include "waymark/geometry/rigid3.h"

namespace waymark {
namespace {

Eigen::Vector2d noise(Rng& rng) {
  return {0.5 * (rng.uniform() - 0.5), 0.5 * (rng.uniform() - 0.5)};
}

/// Points in front of a lens, seen before and after a step to the side with a turn.
std::vector<PixelMatches> see_points(const CameraDescription& lens, int num_pairs) {
  const auto camera = make_if_possible(lens);
  Rng rng(7, 0);
  std::vector<PixelMatches> pairs;
  for (int i = 0; i < num_pairs; ++i) {
    Vector6d tangent;
    tangent << 1.0, 0.3 * i, 0.2, 0.02 * i, 0.1 - 0.03 * i, 0.05;
    const Rigid3 b_from_a = Rigid3::exp(tangent);
    PixelMatches pair;
    while (pair.pixels_a.size() < 150) {
      const std::vector<Eigen::Vector2d> at = {
          {rng.uniform() * lens.width_px, rng.uniform() * lens.height_px}};
      std::vector<Eigen::Vector3d> bearing(1);
      std::vector<std::uint8_t> is_seen(1);
      camera->unproject(at, bearing, is_seen);
      if (!is_seen[0]) continue;
      const std::vector<Eigen::Vector3d> in_b = {b_from_a *
                                                 (bearing[0] * (3.0 + 9.0 * rng.uniform()))};
      std::vector<Eigen::Vector2d> pixel(1);
      camera->project(in_b, pixel, is_seen);
      if (!is_seen[0]) continue;
      pair.pixels_a.push_back(at[0] + noise(rng));
      pair.pixels_b.push_back(pixel[0] + noise(rng));
    }
    pair.scales_a.assign(pair.pixels_a.size(), 1.0f);
    pair.scales_b = pair.scales_a;
    pairs.push_back(pair);
  }
  return pairs;
}

CameraDescription any_lens() { return make_lens(LensModel::kPerspective, 640.0, 640, 480); }

TEST(FindDivisionLens, FindsFieldOfViewAndDistortion) {
  const auto found_for = [](LensModel model, double fov_deg, double k1) {
    CameraDescription lens =
        make_lens(model, focal_length_of(model, fov_deg * kRadiansPerDegree, 640), 640, 480);
    lens.distortion_coeffs[0] = k1;
    const DivisionLens found = find_division_lens(see_points(lens, 6), any_lens(), {});
    EXPECT_NEAR(found.focal_px(640) / lens.intrinsics[0], 1.0, 0.1) << fov_deg;
    return found;
  };
  EXPECT_NEAR(found_for(LensModel::kPerspective, 60.0, 0.0).division, 0.0, 0.1);
  EXPECT_LT(found_for(LensModel::kPerspective, 75.0, -0.25).division, -0.1);
  EXPECT_LT(found_for(LensModel::kFisheye, 140.0, 0.0).division, -0.2);
}

TEST(FindDivisionLens, KeepsAFieldOfViewThatIsKnown) {
  const double focal_px = focal_length_of(LensModel::kPerspective, 60.0 * kRadiansPerDegree, 640);
  const auto pairs = see_points(make_lens(LensModel::kPerspective, focal_px, 640, 480), 4);
  EXPECT_EQ(find_division_lens(pairs, any_lens(), 50.0 * kRadiansPerDegree).fov_rad,
            50.0 * kRadiansPerDegree);
}

TEST(FindMissingDistortion, FindsWhatIsSaidToBeZero) {
  CameraDescription lens = make_lens(LensModel::kPerspective, 420.0, 640, 480);
  CameraDescription ideal = lens;
  ideal.distortion_model = "none";
  ideal.distortion_coeffs.clear();
  const auto find = [&](int num_pairs) {
    return find_missing_distortion(see_points(lens, num_pairs), ideal, *make_if_possible(ideal));
  };
  EXPECT_FALSE(find(12));
  for (const double k1 : {-0.25, -0.1, 0.1}) {
    lens.distortion_coeffs[0] = k1;
    const auto found = find(12);
    ASSERT_TRUE(found) << k1;
    EXPECT_EQ(found->intrinsics, ideal.intrinsics);
    EXPECT_NEAR(found->distortion_coeffs.at(0), k1, 0.07);
    EXPECT_FALSE(find_missing_distortion(see_points(lens, 12), ideal, *make_if_possible(lens)))
        << "where it is known by now";
  }
  EXPECT_FALSE(find(4)) << "by too few";
}

TEST(FindDivisionLens, TakesTheLikeliestWhereNothingTells) {
  EXPECT_NEAR(find_division_lens({}, any_lens(), {}).fov_rad,
              65.0 * kRadiansPerDegree,
              8.0 * kRadiansPerDegree);
}

}  // namespace
}  // namespace waymark

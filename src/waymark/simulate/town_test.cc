// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/testing/town.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <set>

#include "waymark/simulate/named_cameras.h"
#include "waymark/simulate/testing/town_map.h"
#include "waymark/simulate/testing/town_recording.h"

namespace waymark {
namespace {

std::shared_ptr<const Town> make_test_town(const TownSettings& settings = {}) {
  return std::make_shared<const Town>(settings);
}

int bits_between(const Descriptor& a, const Descriptor& b) {
  int count = 0;
  for (std::size_t i = 0; i < a.size(); ++i) count += std::popcount(a[i] ^ b[i]);
  return count;
}

/// Descriptors by point.
std::map<std::uint32_t, Descriptor> looks_of(const TownFrame& frame) {
  std::map<std::uint32_t, Descriptor> looks;
  for (std::size_t i = 0; i < frame.features->num_primary; ++i) {
    looks[frame.point_of_feature[i]] = frame.features->descriptors[i];
  }
  return looks;
}

/// Points that two frames show, and the mean of the bits that differ.
std::pair<std::size_t, double> compare(const TownFrame& a, const TownFrame& b) {
  const auto of_b = looks_of(b);
  std::size_t count = 0;
  double sum = 0.0;
  for (const auto& [id, look] : looks_of(a)) {
    const auto other = of_b.find(id);
    if (other == of_b.end()) continue;
    ++count;
    sum += bits_between(look, other->second);
  }
  return {count, count > 0 ? sum / static_cast<double>(count) : 0.0};
}

TEST(Town, StreetsMakeAGrid) {
  const auto town = make_test_town({.num_columns = 5, .num_rows = 4});
  EXPECT_EQ(town->crossings().size(), 20u);
  EXPECT_EQ(town->streets().size(), 4u * 4u + 5u * 3u);
  for (std::uint32_t i = 0; i < town->crossings().size(); ++i) {
    EXPECT_GE(town->streets_at(i).size(), 2u);
    EXPECT_LE(town->streets_at(i).size(), 4u);
  }
}

TEST(Town, HousesHideWhatIsBehind) {
  const auto town = make_test_town();
  const Town::Street& street = town->streets()[0];
  const Eigen::Vector2d eye = 0.5 * (street.begin + street.end);
  std::vector<std::uint32_t> ids;
  town->list_in_sight({.street = 0}, eye, Eigen::Vector2d::Zero(), 1000.0, ids);
  const Eigen::Vector2d across(street.direction.y(), -street.direction.x());
  std::size_t num_own = 0;
  for (const std::uint32_t id : ids) {
    const Eigen::Vector3d point = town->point(id).position;
    const Eigen::Vector2d ray = Eigen::Vector2d(point.x(), point.z()) - eye;
    const double ahead = std::abs(ray.dot(street.direction));
    const double half_length = 0.5 * (street.end - street.begin).norm();
    // Seen through the ends of the street, or on its fronts.
    const double aside = std::abs(ray.dot(across)) * std::min(1.0, half_length / ahead);
    EXPECT_LE(aside, 6.01);
    num_own += ahead <= half_length;
  }
  EXPECT_GT(num_own, 1000u);
  EXPECT_GT(ids.size(), num_own);
}

TEST(Town, HousesOfOneFacadeLookTheSame) {
  const auto town = make_test_town({.repeated_share = 0.5, .num_alike = 3});
  std::map<std::uint32_t, std::set<std::uint32_t>> houses_of_facade;
  const std::uint32_t per_house = 192;  // 24 points per metre, 8 m.
  for (std::uint32_t id = 0; id < town->num_points(); id += per_house) {
    houses_of_facade[town->facade_of(id)].insert(id);
  }
  std::size_t num_repeated = 0;
  std::size_t num_houses = 0;
  for (const auto& [facade, houses] : houses_of_facade) {
    num_houses += houses.size();
    if (houses.size() > 1) num_repeated += houses.size();
    const auto look = town->point(*houses.begin()).look->descriptor;
    for (const std::uint32_t id : houses) EXPECT_EQ(town->point(id).look->descriptor, look);
  }
  EXPECT_NEAR(static_cast<double>(num_repeated) / static_cast<double>(num_houses), 0.5, 0.1);
}

TEST(Town, FramesDependOnNothingButTheirIndex) {
  const auto town = make_test_town();
  const TownRecording recording(town, make_town_rig(2), {.num_frames = 50});
  const TownRecording again(make_test_town(), make_town_rig(2), {.num_frames = 50});
  recording.frame(3);
  const TownFrame a = recording.frame(30);
  const TownFrame b = again.frame(30);
  EXPECT_EQ(a.point_of_feature, b.point_of_feature);
  EXPECT_EQ(a.features->descriptors, b.features->descriptors);
  EXPECT_EQ(a.features->range_m, b.features->range_m);
  EXPECT_EQ(a.features->bearings, b.features->bearings);
  const TownFrame other = recording.frame(31);
  EXPECT_NE(a.features->descriptors, other.features->descriptors);
}

TEST(Town, FeaturesAreCompleteAndRight) {
  const auto town = make_test_town();
  for (const int num_cameras : {1, 2}) {
    const auto rig = make_town_rig(num_cameras);
    const TownRecording recording(
        town, rig, {.num_frames = 400, .inverse_range_sigma = num_cameras == 1 ? 0.002 : 0.0});
    for (const std::uint32_t index : {10u, 150u, 390u}) {
      const TownFrame frame = recording.frame(index);
      const Features& features = *frame.features;
      ASSERT_GT(features.num_primary, 300u);
      EXPECT_LE(features.num_primary, 600u);
      ASSERT_EQ(features.size(), frame.point_of_feature.size());
      EXPECT_EQ(features.descriptors.size(), features.num_primary);
      EXPECT_EQ(features.size() > features.num_primary, num_cameras > 1);
      double squares = 0.0;
      double num_ranges = 0.0;
      for (std::size_t i = 0; i < features.size(); ++i) {
        const Rigid3& cam_from_rig = rig->cameras[features.keypoints[i].camera].cam_from_rig;
        const Eigen::Vector3d point =
            cam_from_rig *
            (frame.world_from_rig.inverse() * town->point(frame.point_of_feature[i]).position);
        if (i >= features.num_primary) continue;
        const Eigen::Vector3d off = point.normalized() - features.bearings[i].cast<double>();
        squares += (features.level_pixel_from_bearing[i].cast<double>() * off).squaredNorm();
        if (features.inverse_range_sigma[i] <= 0.0f) continue;
        const double error = 1.0 / features.range_m[i] - 1.0 / point.norm();
        num_ranges += std::abs(error) < 4.0 * features.inverse_range_sigma[i];
      }
      const auto count = static_cast<double>(features.num_primary);
      EXPECT_NEAR(std::sqrt(squares / (2.0 * count)), 0.5, 0.06);
      EXPECT_GT(num_ranges, 0.8 * count);
    }
  }
}

TEST(Town, LooksChangeSlowlyOnTheWayAndWithTheLight) {
  const auto town = make_test_town();
  const auto rig = make_town_rig(1);
  const TownRecordingSettings day{.num_frames = 200};
  TownRecordingSettings night = day;
  night.light_flips = 0.15;
  const TownRecording by_day(town, rig, day);
  const TownRecording by_night(town, rig, night);
  const auto next = compare(by_day.frame(10), by_day.frame(12));
  EXPECT_GT(next.first, 250u);
  EXPECT_LT(next.second, 35.0);
  const auto other_light = compare(by_day.frame(10), by_night.frame(12));
  EXPECT_NEAR(other_light.second - next.second, 0.15 * 256.0, 10.0);
  const auto same_light = compare(by_night.frame(10), by_night.frame(12));
  EXPECT_NEAR(same_light.second, next.second, 5.0);
  night.light_dropout = 0.5;
  const TownRecording with_dropout(town, rig, night);
  EXPECT_LT(compare(by_day.frame(10), with_dropout.frame(10)).first,
            0.75 * static_cast<double>(compare(by_day.frame(10), by_night.frame(10)).first));
}

TEST(Town, TheWayIsSmoothAndComesBack) {
  const auto town = make_test_town({.num_columns = 3, .num_rows = 3});
  const TownRecording recording(town, make_town_rig(1), {.num_frames = 4000, .step_m = 0.5});
  for (std::uint32_t i = 1; i < recording.num_frames(); ++i) {
    const Rigid3 step = recording.world_from_rig(i - 1).inverse() * recording.world_from_rig(i);
    ASSERT_NEAR(step.translation.norm(), 0.5, 0.2) << i;
    ASSERT_LT(so3_log(step.rotation).norm(), 0.15) << i;
    ASSERT_LE(std::abs(step.translation.x()), step.translation.z()) << i;
  }
  const std::vector<std::uint32_t>& streets = recording.streets();
  EXPECT_GT(streets.size(), std::set<std::uint32_t>(streets.begin(), streets.end()).size());
}

TEST(Town, CamerasThatSeeBehindDoSo) {
  const auto town = make_test_town();
  Rig rig = *make_town_rig(1);
  rig.cameras[0].camera =
      CameraRegistry::with_builtin_models().make_camera(named_camera("equirectangular", 480));
  const TownRecording recording(town, std::make_shared<const Rig>(rig), {.num_frames = 50});
  const TownFrame frame = recording.frame(20);
  std::size_t num_behind = 0;
  for (const Eigen::Vector3f& bearing : frame.features->bearings) num_behind += bearing.z() < 0.0f;
  EXPECT_GT(num_behind, 100u);
}

}  // namespace
}  // namespace waymark

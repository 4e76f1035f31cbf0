// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/results/trajectory.h"

#include <gmock/gmock.h>

#include "waymark/base/check.h"
#include "waymark/base/rng.h"
#include "waymark/base/testing/errors.h"
#include "waymark/base/testing/temporary_folder.h"
#include "waymark/base/text.h"
#include "waymark/input/datasets.h"

namespace waymark {
namespace {

using ::testing::HasSubstr;
using testing::input_error_of;
using testing::TemporaryFolder;

std::vector<StampedPose> make_poses(std::size_t num_poses) {
  Rng rng(3, 0);
  std::vector<StampedPose> poses;
  for (std::size_t i = 0; i < num_poses; ++i) {
    Vector6d tangent;
    for (double& value : tangent) value = rng.uniform(-2.0, 2.0);
    poses.push_back(
        {1403636584763555584 + static_cast<std::int64_t>(i) * 50'000'001, Rigid3::exp(tangent)});
  }
  return poses;
}

void expect_equal(const std::vector<StampedPose>& a,
                  const std::vector<StampedPose>& b,
                  double tolerance) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].timestamp_ns, b[i].timestamp_ns);
    EXPECT_LT((a[i].world_from_camera.inverse() * b[i].world_from_camera).log().norm(), tolerance);
  }
}

TEST(Trajectory, ComesBackFromEveryFormat) {
  const TemporaryFolder folder;
  const std::vector<StampedPose> poses = make_poses(20);
  for (TrajectoryFormat format :
       {TrajectoryFormat::kTum, TrajectoryFormat::kEuroc, TrajectoryFormat::kKitti}) {
    write_trajectory(folder / "poses", poses, format);
    std::string times;
    for (const StampedPose& pose : poses) times += format_seconds(pose.timestamp_ns) + "\n";
    folder.write("times.txt", times);
    SCOPED_TRACE(to_string(format));
    expect_equal(read_trajectory(folder / "poses"), poses, 1e-8);
  }
}

TEST(Trajectory, WritesTheDocumentedColumns) {
  const Rigid3 pose(Eigen::Quaterniond(0.5, -0.5, 0.5, 0.5), {1, -2, 3});
  const std::vector<StampedPose> poses = {{1'500'000'001, pose}};
  EXPECT_EQ(format_trajectory(poses, TrajectoryFormat::kTum),
            "1.500000001 1.000000000 -2.000000000 3.000000000 -0.500000000 0.500000000 0.500000000 "
            "0.500000000\n");
  EXPECT_THAT(
      format_trajectory(poses, TrajectoryFormat::kEuroc),
      HasSubstr("\n1500000001,1.000000000,-2.000000000,3.000000000,0.500000000,-0.500000000,"));
  const Eigen::Matrix3d r = pose.rotation_matrix();
  const std::vector<Rigid3> back =
      parse_kitti_poses(format_trajectory(poses, TrajectoryFormat::kKitti), "f");
  EXPECT_LT((back.at(0).rotation_matrix() - r).norm(), 1e-8);
}

TEST(Trajectory, WritesZeroWithoutASign) {
  const Rigid3 pose(Eigen::Quaterniond(1.0, -0.0, -1e-12, -0.0), {-0.0, -1e-10, -0.0});
  for (TrajectoryFormat format : {TrajectoryFormat::kTum, TrajectoryFormat::kEuroc}) {
    const std::string text = format_trajectory(std::vector<StampedPose>{{0, pose}}, format);
    EXPECT_EQ(text.find("-0.0"), std::string::npos) << text;
  }
  const Rigid3 origin(Eigen::Quaterniond(1.0, -0.0, -0.0, -0.0), {-0.0, -0.0, -0.0});
  const std::string text =
      format_trajectory(std::vector<StampedPose>{{0, origin}}, TrajectoryFormat::kKitti);
  EXPECT_EQ(text.find("-0.0"), std::string::npos) << text;
}

TEST(Trajectory, IsSortedByTime) {
  const TemporaryFolder folder;
  folder.write("t.txt", "2 0 0 0 0 0 0 1\n1 5 0 0 0 0 0 1\n2 9 0 0 0 0 0 1\n");
  const std::vector<StampedPose> poses = read_trajectory(folder / "t.txt");
  ASSERT_EQ(poses.size(), 3u);
  EXPECT_EQ(poses[0].world_from_camera.translation.x(), 5);
  EXPECT_EQ(poses[1].world_from_camera.translation.x(), 0);
  EXPECT_EQ(poses[2].world_from_camera.translation.x(), 9);
}

TEST(Trajectory, TakesTumColumnsInNanoseconds) {
  const std::string name = "f";
  const auto poses = parse_tum_trajectory(
      "1403636579000000000.000000 1 2 3 0 0 0 1\n1403636579025000192.000000 1 2 3 0 0 0 1\n", name);
  ASSERT_EQ(poses.size(), 2u);
  EXPECT_EQ(poses[0].timestamp_ns, 1403636579000000000);
  EXPECT_EQ(poses[1].timestamp_ns, 1403636579025000192);
  EXPECT_THAT(input_error_of([&] { parse_tum_trajectory("-1e18 1 2 3 0 0 0 1\n", name); }),
              HasSubstr("field 1 is '-1e18', expected a time"));
}

TEST(Trajectory, NamesFileAndLineOfWhatIsWrong) {
  const TemporaryFolder folder;
  const auto error = [&](const char* text) {
    folder.write("t.txt", text);
    return input_error_of([&] { read_trajectory(folder / "t.txt"); });
  };
  EXPECT_THAT(error(""), HasSubstr("t.txt: holds no pose, expected"));
  EXPECT_THAT(error("1 2 3\n"),
              HasSubstr("t.txt:1: 3 fields, expected 8 (TUM), 12 (KITTI) or commas"));
  EXPECT_THAT(error("1 0 0 0 0 0 0 1\n1 0 0\n"), HasSubstr("t.txt:2: 3 fields, expected 8"));
  EXPECT_THAT(error("1 0 0 nan 0 0 0 1\n"),
              HasSubstr("t.txt:1: field 4 is 'nan', expected a finite number"));
  EXPECT_THAT(error("1 0 0 0 0 0 0 0\n"), HasSubstr("t.txt:1: quaternion of length 0, expected 1"));
  EXPECT_THAT(error("1,0,0,0,2,0,0,0\n"), HasSubstr("t.txt:1: quaternion of length 2, expected 1"));
  EXPECT_THAT(error("1,0,0,0,1,0,0\n"), HasSubstr("t.txt:1: 7 fields, expected 8 or more"));
  EXPECT_THAT(error("1 0 0 5 0 1 0 6 0 0 1 7\n"),
              HasSubstr("KITTI poses carry no time, expected times.txt"));
  folder.write("times.txt", "1\n2\n");
  EXPECT_THAT(error("1 0 0 5 0 1 0 6 0 0 1 7\n"), HasSubstr("times.txt: 2 times, expected 1"));
  EXPECT_THAT(error("1 0 0 5 0 1 0 6 0 0 2 7\n"), HasSubstr("t.txt:1: the matrix is no rotation"));
  EXPECT_THAT(error("1 0 0 5 0 1 0 6 0 0 -1 7\n"), HasSubstr("t.txt:1: the matrix is no rotation"));
}

/// Damaged versions of good files: every parser either reads them or throws InputError.
TEST(Parsers, SurviveDamagedText) {
  const std::string good =
      "#timestamp [ns],filename\n1403636584763555584,1403636584763555584.png\n"
      "1403636584813555456,1403636584813555456.png\n1305031229.528748 rgb/1305031229.528748.png\n"
      "P0: 7.1e+02 0 6.0e+02 0 0 7.1e+02 1.8e+02 0 0 0 1 0\nP1: 7 0 6 -386 0 7 1 0 0 0 1 0\n"
      "1.0 2 3 4 0 0 0 1\n1e5,1,2,3,1,0,0,0\n1 0 0 5 0 1 0 6 0 0 1 7\n";
  for (std::uint64_t round = 0; round < 3000; ++round) {
    Rng rng(7, round);
    std::string text = good.substr(rng.below(static_cast<std::uint32_t>(good.size())));
    for (std::uint32_t i = rng.below(8); i > 0; --i) {
      text[rng.below(static_cast<std::uint32_t>(text.size()))] = static_cast<char>(rng.below(256));
    }
    const auto try_it = [](const auto& parse) {
      try {
        parse();
      } catch (const InputError& error) {
        EXPECT_THAT(error.what(), HasSubstr("f"));
      }
    };
    try_it([&] { parse_tum_images(text, "f"); });
    try_it([&] { parse_euroc_images(text, "f"); });
    try_it([&] { parse_kitti_calibration(text, "f", 2); });
    try_it([&] { parse_times(text, "f"); });
    try_it([&] { parse_tum_trajectory(text, "f"); });
    try_it([&] { parse_euroc_trajectory(text, "f"); });
    try_it([&] { parse_kitti_poses(text, "f"); });
  }
}

}  // namespace
}  // namespace waymark

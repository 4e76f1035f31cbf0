// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <cmath>

#include "waymark/evaluate/chart.h"
#include "waymark/evaluate/report.h"

namespace waymark {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(AxisTicks, AreRoundAndWithinTheRange) {
  EXPECT_THAT(axis_ticks({-0.3, 9.7}, 6), ElementsAre(0, 2, 4, 6, 8));
  EXPECT_THAT(axis_ticks({0.0, 1.0}, 5),
              ElementsAre(0,
                          ::testing::DoubleEq(0.2),
                          ::testing::DoubleEq(0.4),
                          ::testing::DoubleNear(0.6, 1e-12),
                          0.8,
                          1.0));
  EXPECT_THAT(axis_ticks({5.0, 5.0}, 6), ElementsAre());
  EXPECT_THAT(axis_ticks({1e17, 1e17 + 16}, 6), ElementsAre());
  EXPECT_LE(axis_ticks({-1e300, 1e300}, 6).size(), 7u);
}

TEST(EscapeXml, LeavesNothingThatEndsText) {
  EXPECT_EQ(escape_xml("a<b>&\"\n"), "a&lt;b&gt;&amp;&quot; ");
}

TEST(Chart, MapsRangesToTheFrame) {
  const Chart chart({10, 20, 100, 50}, {0, 1}, {0, 2});
  EXPECT_EQ(chart.line({{0, 0}, {1, 2}, {0.5, 1, true}}, "class=\"c\""),
            "<path class=\"c\" d=\"M10.0 70.0L110.0 20.0M60.0 45.0\"/>\n");
  AxisRange x{0, 10};
  AxisRange y{0, 1};
  Chart::make_isometric({0, 0, 100, 50}, x, y);
  EXPECT_DOUBLE_EQ(x.extent() / 100, y.extent() / 50);
  EXPECT_DOUBLE_EQ(y.low, -2.0);
}

/// A circle in the plane of x and z of so many poses.
std::vector<StampedPose> make_circle(std::size_t num_poses) {
  std::vector<StampedPose> poses(num_poses);
  for (std::size_t i = 0; i < num_poses; ++i) {
    const double angle = 6.0 * static_cast<double>(i) / static_cast<double>(num_poses);
    poses[i].timestamp_ns = static_cast<std::int64_t>(i) * 50'000'000;
    poses[i].world_from_camera.translation = {
        5 * std::cos(angle), 0.1 * std::sin(9 * angle), 5 * std::sin(angle)};
  }
  return poses;
}

std::string plot(const std::vector<StampedPose>& estimate, const std::vector<StampedPose>& truth) {
  return plot_evaluation(evaluate(estimate, truth, {}), estimate, truth, "a & b");
}

TEST(Plot, ShowsThePlaneOfTheLargestExtent) {
  const std::string svg = plot(make_circle(100), make_circle(100));
  EXPECT_THAT(svg, HasSubstr(">x [m]<"));
  EXPECT_THAT(svg, HasSubstr(">z [m]<"));
  EXPECT_THAT(svg, Not(HasSubstr(">y [m]<")));
  EXPECT_THAT(svg, HasSubstr(">time [s]<"));
  EXPECT_THAT(svg, HasSubstr(">ground truth<"));
  EXPECT_THAT(svg, HasSubstr(">a &amp; b<"));
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
  EXPECT_THAT(svg, ::testing::EndsWith("</svg>\n"));
}

TEST(Plot, StaysSmallAndShowsGaps) {
  const std::vector<StampedPose> truth = make_circle(100'000);
  std::vector<StampedPose> estimate = truth;
  EXPECT_LT(plot(estimate, truth).size(), 120'000u);
  estimate.erase(estimate.begin() + 30'000, estimate.begin() + 40'000);
  const auto num_strokes = [](const std::string& svg) {
    const std::size_t begin = svg.find("class=\"estimate\" d=");
    const std::string line = svg.substr(begin, svg.find("/>", begin) - begin);
    return std::count(line.begin(), line.end(), 'M');
  };
  EXPECT_EQ(num_strokes(plot(truth, truth)), 1);
  EXPECT_EQ(num_strokes(plot(estimate, truth)), 2);
}

TEST(Plot, SurvivesACameraThatStands) {
  std::vector<StampedPose> poses = make_circle(10);
  for (StampedPose& pose : poses) pose.world_from_camera.translation.setOnes();
  EXPECT_THAT(plot(poses, poses), Not(HasSubstr("nan")));
}

}  // namespace
}  // namespace waymark

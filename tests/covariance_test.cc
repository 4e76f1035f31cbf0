// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// The covariance that comes with a pose says how wrong the pose is.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <vector>

#include "simulated_run.h"

namespace waymark {
namespace {

/// A pose as it was returned by feed(), with the truth of the same frame.
struct ReportedPose {
  Rigid3 rig_from_world;
  Matrix6d covariance;
  Rigid3 true_rig_from_world;
};

std::vector<ReportedPose> track(const Recording& recording) {
  System system(recording.rig, recording.settings, Timing::kInline);
  std::vector<ReportedPose> poses;
  for (std::size_t i = 0; i < recording.frames.size(); ++i) {
    const InputFrame& frame = recording.frames[i];
    FrameImages input;
    input.timestamp_ns = frame.timestamp_ns;
    input.image0 = frame.images[0].view();
    if (frame.images.size() > 1) input.image1 = frame.images[1].view();
    if (frame.depth) input.depth = frame.depth->view();
    const TrackingResult result = system.feed(input);
    if (!result.world_from_rig || result.is_keyframe) continue;
    poses.push_back({result.world_from_rig->inverse(),
                     result.covariance,
                     recording.groundtruth[i].world_from_camera.inverse()});
  }
  return poses;
}

/// Brings poses of a map of free scale to metres, by the length of the way.
void scale_to_metres(std::vector<ReportedPose>& poses) {
  double estimated = 0.0;
  double expected = 0.0;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    const ReportedPose& a = poses[i - 1];
    const ReportedPose& b = poses[i];
    estimated += (b.rig_from_world.origin_in_source() - a.rig_from_world.origin_in_source()).norm();
    expected +=
        (b.true_rig_from_world.origin_in_source() - a.true_rig_from_world.origin_in_source())
            .norm();
  }
  const double scale = expected / estimated;
  Vector6d of_tangent;
  of_tangent << scale, scale, scale, 1.0, 1.0, 1.0;
  for (ReportedPose& pose : poses) {
    pose.rig_from_world.translation *= scale;
    pose.covariance = of_tangent.asDiagonal() * pose.covariance * of_tangent.asDiagonal();
  }
}

/// Mean of the normalised error squared of the motion between successive frames, in which what the
/// frames have in common (the error of the map, the choice of the world frame) cancels. The two
/// poses are measured independently, so their covariances add; the expected value is 6.
double mean_normalized_error_squared(const std::vector<ReportedPose>& poses) {
  double sum = 0.0;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    const ReportedPose& a = poses[i - 1];
    const ReportedPose& b = poses[i];
    const Rigid3 b_from_a = b.rig_from_world * a.rig_from_world.inverse();
    const Rigid3 true_b_from_a = b.true_rig_from_world * a.true_rig_from_world.inverse();
    const Vector6d error = (b_from_a * true_b_from_a.inverse()).log();
    const Matrix6d adjoint = b_from_a.adjoint();
    const Matrix6d covariance = b.covariance + adjoint * a.covariance * adjoint.transpose();
    sum += error.dot(covariance.ldlt().solve(error));
  }
  return sum / static_cast<double>(poses.size() - 1);
}

class Covariance : public ::testing::TestWithParam<Setup> {};

TEST_P(Covariance, SaysHowWrongThePoseIs) {
  std::vector<ReportedPose> poses = track(simulate(small_sequence(GetParam(), 120)));
  ASSERT_GT(poses.size(), 60u);
  if (GetParam() == Setup::kMono) scale_to_metres(poses);
  const double mean = mean_normalized_error_squared(poses);
  EXPECT_GT(mean, 0.5 * 6.0);
  EXPECT_LT(mean, 2.0 * 6.0);
}

INSTANTIATE_TEST_SUITE_P(Setups,
                         Covariance,
                         ::testing::Values(Setup::kMono, Setup::kStereo, Setup::kRgbd),
                         [](const ::testing::TestParamInfo<Setup>& info) {
                           return std::string(to_string(info.param));
                         });

}  // namespace
}  // namespace waymark

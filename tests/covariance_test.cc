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

/// Means over the motions between successive frames.
struct NormalizedErrors {
  double squared = 0.0;                  // By the inverse of the covariance; 6 is expected.
  Vector6d per_axis = Vector6d::Zero();  // Squared, by the variance of each axis; 1 is expected.
};

/// What the frames have in common (the error of the map, the choice of the world frame) cancels in
/// the motion between them. The two poses are measured independently, so their covariances add.
NormalizedErrors mean_normalized_errors(const std::vector<ReportedPose>& poses) {
  NormalizedErrors sum;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    const ReportedPose& a = poses[i - 1];
    const ReportedPose& b = poses[i];
    const Rigid3 b_from_a = b.rig_from_world * a.rig_from_world.inverse();
    const Rigid3 true_b_from_a = b.true_rig_from_world * a.true_rig_from_world.inverse();
    const Vector6d error = (b_from_a * true_b_from_a.inverse()).log();
    const Matrix6d adjoint = b_from_a.adjoint();
    const Matrix6d covariance = b.covariance + adjoint * a.covariance * adjoint.transpose();
    sum.squared += error.dot(covariance.ldlt().solve(error));
    sum.per_axis += error.cwiseAbs2().cwiseQuotient(covariance.diagonal());
  }
  const double count = static_cast<double>(poses.size() - 1);
  return {sum.squared / count, sum.per_axis / count};
}

struct CovarianceCase {
  const char* world;
  Setup setup;
};

class Covariance : public ::testing::TestWithParam<CovarianceCase> {};

TEST_P(Covariance, SaysHowWrongThePoseIs) {
  SequenceSpec spec = small_sequence(GetParam().setup, 120);
  spec.world = GetParam().world;
  std::vector<ReportedPose> poses = track(simulate(spec));
  ASSERT_GT(poses.size(), 60u);
  const bool is_mono = GetParam().setup == Setup::kMono;
  if (is_mono) scale_to_metres(poses);
  const NormalizedErrors mean = mean_normalized_errors(poses);
  EXPECT_GT(mean.squared, 0.5 * 6.0);
  EXPECT_LT(mean.squared, (is_mono ? 2.0 : 1.5) * 6.0);
  if (is_mono) return;
  // Wider: what a keyframe changes in the map moves the frames after it along some axis.
  EXPECT_GT(mean.per_axis.minCoeff(), 0.3);
  EXPECT_LT(mean.per_axis.maxCoeff(), 2.5);
}

INSTANTIATE_TEST_SUITE_P(Worlds,
                         Covariance,
                         ::testing::Values(CovarianceCase{"room", Setup::kMono},
                                           CovarianceCase{"room", Setup::kStereo},
                                           CovarianceCase{"room", Setup::kRgbd},
                                           CovarianceCase{"apartment", Setup::kStereo},
                                           CovarianceCase{"apartment", Setup::kRgbd},
                                           CovarianceCase{"hall", Setup::kStereo},
                                           CovarianceCase{"hall", Setup::kRgbd}),
                         [](const ::testing::TestParamInfo<CovarianceCase>& info) {
                           return std::string(info.param.world) + "_" +
                                  std::string(to_string(info.param.setup));
                         });

}  // namespace
}  // namespace waymark

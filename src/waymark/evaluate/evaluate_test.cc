// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <nlohmann/json.hpp>

#include "waymark/base/check.h"
#include "waymark/base/rng.h"
#include "waymark/evaluate/association.h"
#include "waymark/evaluate/evaluation.h"
#include "waymark/evaluate/report.h"

namespace waymark {
namespace {

using ::testing::HasSubstr;

constexpr std::int64_t kSecond = 1'000'000'000;

/// A bumpy drive of 2 m per pose and a noisy estimate of it in another frame and scale.
struct Drive {
  std::vector<StampedPose> truth;
  std::vector<StampedPose> estimate;
};

Drive make_drive(std::size_t num_poses, double noise, const Sim3& estimate_from_truth) {
  Drive drive;
  Rng rng(11, 0);
  for (std::size_t i = 0; i < num_poses; ++i) {
    const double angle = 0.02 * static_cast<double>(i);
    const Eigen::Vector3d position(
        100.0 * std::sin(angle), 3.0 * std::cos(3.0 * angle), -100.0 * std::cos(angle));
    const Rigid3 pose(
        Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d(0.1, 1, 0).normalized())),
        position);
    Vector6d wobble;
    for (double& value : wobble) value = noise * rng.normal();
    const Rigid3 noisy = pose * Rigid3::exp(wobble);
    const std::int64_t time_ns = static_cast<std::int64_t>(i) * kSecond / 10;
    drive.truth.push_back({time_ns, pose});
    const Rigid3 moved((estimate_from_truth.rotation * noisy.rotation).normalized(),
                       estimate_from_truth * noisy.translation);
    drive.estimate.push_back({time_ns + 1000, moved});
  }
  return drive;
}

Sim3 some_similarity(double scale) {
  return {Eigen::Quaterniond(0.5, 0.1, -0.7, 0.3).normalized(), {5, -3, 8}, scale};
}

TEST(MatchByTime, TakesTheNearestTruePose) {
  std::vector<StampedPose> truth(3);
  std::vector<StampedPose> estimate(5);
  const std::int64_t truth_ms[] = {0, 10, 20};
  const std::int64_t estimate_ms[] = {-6, 4, 5, 14, 26};
  for (std::size_t i = 0; i < 3; ++i) truth[i].timestamp_ns = truth_ms[i];
  for (std::size_t i = 0; i < 5; ++i) estimate[i].timestamp_ns = estimate_ms[i];
  const std::vector<TimeMatch> matches = match_by_time(estimate, truth, 5);
  ASSERT_EQ(matches.size(), 3u);
  EXPECT_EQ(matches[0].estimate, 1u);
  EXPECT_EQ(matches[0].groundtruth, 0u);
  EXPECT_EQ(matches[1].groundtruth, 1u);  // Halfway: the later one.
  EXPECT_EQ(matches[2].estimate, 3u);
  EXPECT_EQ(matches[2].groundtruth, 1u);
  EXPECT_TRUE(match_by_time(estimate, {}, 5).empty());
  EXPECT_TRUE(match_by_time({}, truth, 5).empty());
  // Times at both ends of the range do not overflow.
  truth[0].timestamp_ns = INT64_MIN;
  truth[2].timestamp_ns = INT64_MAX;
  estimate[4].timestamp_ns = INT64_MAX;
  EXPECT_EQ(match_by_time(estimate, truth, 5).back().groundtruth, 2u);
}

TEST(CoveredPart, LeavesOutGaps) {
  std::vector<StampedPose> truth(101);
  std::vector<StampedPose> estimate;
  for (std::size_t i = 0; i <= 100; ++i) {
    truth[i].timestamp_ns = static_cast<std::int64_t>(i) * kSecond;
    if (i >= 20 && i != 30 && (i < 50 || i > 74)) estimate.push_back(truth[i]);
  }
  // From 20 s to 100 s less the gap of 26 s from 49 s to 75 s; one missing frame is none.
  EXPECT_NEAR(covered_part(estimate, truth), 0.54, 1e-12);
  EXPECT_EQ(covered_part({}, truth), 0.0);
}

TEST(Evaluate, FindsNoErrorUpToTheAlignment) {
  const Drive drive = make_drive(200, 0.0, some_similarity(0.2));
  EvaluationOptions options;
  options.alignment = TrajectoryAlignment::kSim3;
  const Evaluation evaluation = evaluate(drive.estimate, drive.truth, options);
  EXPECT_EQ(evaluation.num_pairs, 200u);
  EXPECT_NEAR(evaluation.groundtruth_from_estimate.scale, 5.0, 1e-9);
  EXPECT_LT(evaluation.ate_m.max, 1e-9);
  EXPECT_LT(evaluation.rpe_m, 1e-9);
  EXPECT_LT(evaluation.rpe_deg, 1e-6);
  ASSERT_TRUE(evaluation.segments);
  EXPECT_LT(evaluation.segments->all.translation_percent, 1e-6);
  options.alignment = TrajectoryAlignment::kSe3;
  EXPECT_GT(evaluate(drive.estimate, drive.truth, options).ate_m.rmse, 10.0);
  EXPECT_EQ(evaluate(drive.estimate, drive.truth, options).groundtruth_from_estimate.scale, 1.0);
}

/// The least-squares similarity by quaternions and sums (Horn 1987), another way than Umeyama's:
/// the rotation is the eigenvector of a 4x4 matrix.
Sim3 align_by_horn(const Drive& drive, bool with_scale) {
  const double n = static_cast<double>(drive.truth.size());
  Eigen::Vector3d mean_from = Eigen::Vector3d::Zero();
  Eigen::Vector3d mean_to = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < drive.truth.size(); ++i) {
    mean_from += drive.estimate[i].world_from_camera.translation / n;
    mean_to += drive.truth[i].world_from_camera.translation / n;
  }
  Eigen::Matrix3d m = Eigen::Matrix3d::Zero();
  double spread = 0.0;
  for (std::size_t i = 0; i < drive.truth.size(); ++i) {
    const Eigen::Vector3d from = drive.estimate[i].world_from_camera.translation - mean_from;
    m += from * (drive.truth[i].world_from_camera.translation - mean_to).transpose();
    spread += from.squaredNorm();
  }
  Eigen::Matrix4d k;
  k(0, 0) = m.trace();
  const Eigen::Vector3d delta(m(1, 2) - m(2, 1), m(2, 0) - m(0, 2), m(0, 1) - m(1, 0));
  k.block<1, 3>(0, 1) = delta.transpose();
  k.block<3, 1>(1, 0) = delta;
  k.block<3, 3>(1, 1) = m + m.transpose() - m.trace() * Eigen::Matrix3d::Identity();
  const Eigen::Vector4d q = Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d>(k).eigenvectors().col(3);
  Sim3 result;
  result.rotation = Eigen::Quaterniond(q[0], q[1], q[2], q[3]);
  if (with_scale) result.scale = (result.rotation.toRotationMatrix() * m).trace() / spread;
  result.translation = mean_to - result.scale * (result.rotation * mean_from);
  return result;
}

/// All figures again, from matrices.
void expect_figures(const Drive& drive, const Sim3& alignment, const Evaluation& evaluation) {
  const double n = static_cast<double>(drive.truth.size());
  double sum2 = 0.0, sum = 0.0, largest = 0.0, length = 0.0, relative_m2 = 0.0, relative_deg2 = 0.0;
  for (std::size_t i = 0; i < drive.truth.size(); ++i) {
    const Eigen::Vector3d truth = drive.truth[i].world_from_camera.translation;
    const double error =
        (alignment * drive.estimate[i].world_from_camera.translation - truth).norm();
    sum += error;
    sum2 += error * error;
    largest = std::max(largest, error);
    if (i == 0) continue;
    length += (truth - drive.truth[i - 1].world_from_camera.translation).norm();
    const Eigen::Matrix4d a = drive.estimate[i - 1].world_from_camera.matrix().inverse() *
                              drive.estimate[i].world_from_camera.matrix();
    const Eigen::Matrix4d b = drive.truth[i - 1].world_from_camera.matrix().inverse() *
                              drive.truth[i].world_from_camera.matrix();
    relative_m2 +=
        (alignment.scale * a.topRightCorner<3, 1>() - b.topRightCorner<3, 1>()).squaredNorm();
    const double cosine =
        ((a.topLeftCorner<3, 3>().transpose() * b.topLeftCorner<3, 3>()).trace() - 1.0) / 2.0;
    relative_deg2 += std::pow(std::acos(std::clamp(cosine, -1.0, 1.0)) * 180.0 / M_PI, 2);
  }
  EXPECT_NEAR(evaluation.ate_m.rmse, std::sqrt(sum2 / n), 1e-9);
  EXPECT_NEAR(evaluation.ate_m.mean, sum / n, 1e-9);
  EXPECT_NEAR(evaluation.ate_m.max, largest, 1e-9);
  EXPECT_NEAR(evaluation.path_length_m, length, 1e-9);
  EXPECT_NEAR(*evaluation.ate_percent, 100.0 * std::sqrt(sum2 / n) / length, 1e-9);
  EXPECT_NEAR(evaluation.rpe_m, std::sqrt(relative_m2 / (n - 1)), 1e-9);
  EXPECT_NEAR(evaluation.rpe_deg, std::sqrt(relative_deg2 / (n - 1)), 1e-5);
}

TEST(Evaluate, AgreesWithIndependentFormulas) {
  for (bool with_scale : {false, true}) {
    const Drive drive = make_drive(60, 0.05, some_similarity(with_scale ? 0.5 : 1.0));
    EvaluationOptions options;
    options.alignment = with_scale ? TrajectoryAlignment::kSim3 : TrajectoryAlignment::kSe3;
    const Sim3 alignment = align_by_horn(drive, with_scale);
    expect_figures(drive, alignment, evaluate(drive.estimate, drive.truth, options));
  }
  const Drive drive = make_drive(60, 0.05, Sim3());
  EvaluationOptions options;
  options.alignment = TrajectoryAlignment::kNone;
  expect_figures(drive, Sim3(), evaluate(drive.estimate, drive.truth, options));
}

TEST(Evaluate, CountsCoverageByFramesWhenTheyAreKnown) {
  const Drive drive = make_drive(60, 0.01, Sim3());
  EvaluationOptions options;
  options.num_frames = 80;
  EXPECT_DOUBLE_EQ(evaluate(drive.estimate, drive.truth, options).coverage, 0.75);
}

TEST(Evaluate, RefusesWhatCannotBeAligned) {
  const Drive drive = make_drive(60, 0.01, Sim3());
  std::vector<StampedPose> late = drive.estimate;
  for (StampedPose& pose : late) pose.timestamp_ns += 1000 * kSecond;
  try {
    evaluate(late, drive.truth, {});
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(),
                 "evaluation: 0 poses have a true one within 0.02 s, expected at least 3");
  }
  std::vector<StampedPose> still = drive.estimate;
  for (StampedPose& pose : still) pose.world_from_camera.translation.setZero();
  EvaluationOptions options;
  options.alignment = TrajectoryAlignment::kSim3;
  EXPECT_THROW(evaluate(still, drive.truth, options), InputError);
  EXPECT_GT(evaluate(still, drive.truth, {}).ate_m.rmse, 1.0);
}

TEST(Evaluate, AcceptsStraightPaths) {
  Drive drive = make_drive(60, 0.0, Sim3());
  for (std::size_t i = 0; i < 60; ++i) {
    drive.truth[i].world_from_camera.translation = {0, 0, static_cast<double>(i)};
    drive.estimate[i].world_from_camera.translation = {2.0 * static_cast<double>(i), 0, 7};
  }
  EvaluationOptions options;
  options.alignment = TrajectoryAlignment::kSim3;
  const Evaluation evaluation = evaluate(drive.estimate, drive.truth, options);
  EXPECT_NEAR(evaluation.groundtruth_from_estimate.scale, 0.5, 1e-9);
  EXPECT_LT(evaluation.ate_m.max, 1e-9);
}

TEST(SegmentErrors, OfAConstantScaleErrorIsThatError) {
  std::vector<Rigid3> truth(401);
  std::vector<Rigid3> estimate(401);
  for (std::size_t i = 0; i < truth.size(); ++i) {
    truth[i].translation = {0, 0, static_cast<double>(i)};
    estimate[i].translation = {0, 0, 1.02 * static_cast<double>(i)};
  }
  const std::optional<SegmentErrors> errors = segment_errors(estimate, truth);
  ASSERT_TRUE(errors);
  ASSERT_EQ(errors->by_length.size(), 3u);  // 100, 200 and 300 m; 400 m are not exceeded.
  EXPECT_EQ(errors->by_length[0].num_segments, 30u);
  EXPECT_EQ(errors->by_length[2].num_segments, 10u);
  // The segment ends with the first pose beyond its length: 101 m for 100 m.
  EXPECT_NEAR(errors->by_length[0].translation_percent, 2.02, 1e-9);
  EXPECT_NEAR(errors->all.rotation_deg_per_100m, 0.0, 1e-9);
  EXPECT_FALSE(segment_errors(std::span(estimate).first(100), std::span(truth).first(100)));
}

TEST(SegmentErrors, OfAConstantTurnIsItsRate) {
  std::vector<Rigid3> truth(301);
  std::vector<Rigid3> estimate(301);
  for (std::size_t i = 0; i < truth.size(); ++i) {
    truth[i].translation = {0, 0, static_cast<double>(i)};
    estimate[i] = truth[i];
    estimate[i].rotation =
        Eigen::AngleAxisd(1e-4 * static_cast<double>(i), Eigen::Vector3d::UnitZ());
  }
  const std::optional<SegmentErrors> errors = segment_errors(estimate, truth);
  ASSERT_TRUE(errors);
  EXPECT_NEAR(errors->by_length[0].rotation_deg_per_100m, 1.01 * 1e-2 * 180.0 / M_PI, 1e-9);
}

TEST(Report, SaysTheSameInJsonAndText) {
  const Drive drive = make_drive(200, 0.05, Sim3());
  const Evaluation evaluation = evaluate(drive.estimate, drive.truth, {});
  const nlohmann::json json = nlohmann::json::parse(format_evaluation_json(evaluation));
  EXPECT_EQ(json["pairs"], 200);
  EXPECT_EQ(json["align"], "se3");
  EXPECT_EQ(json["scale"], 1.0);
  EXPECT_NEAR(json["ate_rmse_m"].get<double>(), evaluation.ate_m.rmse, 1e-6);
  EXPECT_NEAR(json["ate_percent"].get<double>(), *evaluation.ate_percent, 1e-6);
  EXPECT_EQ(json["segments"]["by_length"][0]["length_m"], 100.0);
  const std::string text = format_evaluation(evaluation);
  EXPECT_THAT(text, HasSubstr("pairs      200 of 200 poses, coverage 100.0 %"));
  EXPECT_THAT(text, HasSubstr("ATE        rmse 0.0"));
  EXPECT_THAT(text, HasSubstr("segments   100 m:"));
  EXPECT_TRUE(nlohmann::json::parse(format_evaluation_json(
      evaluate(std::span(drive.estimate).first(20), drive.truth, {})))["segments"]
                  .is_null());
}

}  // namespace
}  // namespace waymark

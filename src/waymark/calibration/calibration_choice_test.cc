// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/calibration/calibration_choice.h"

#include <gtest/gtest.h>

#include "waymark/calibration/testing/calibration.h"

namespace waymark {
namespace {

constexpr Eigen::Index kFocalLength = 0, kAspect = 1, kDistortion = 4;

/// What images tell in ten parts of one camera's focal length and first distortion coefficient:
/// that one by so much or the other by so much, and that the rest is as given.
class CalibrationChoiceTest : public ::testing::Test {
 protected:
  CalibrationCost cost_of(double focal_px, double k1, double disagreement = 0.0) const {
    const auto size = static_cast<Eigen::Index>(parameters_.size());
    // Both move the same pixels, in the ratio of the two numbers.
    Eigen::VectorXd by = Eigen::VectorXd::Zero(size);
    by[kFocalLength] = by[kAspect] = 0.5 / focal_px;
    by[kDistortion] = 1.0 / k1;
    CalibrationCost cost;
    cost.at.setZero(size);
    cost.evidence.whole = {Eigen::MatrixXd::Zero(size, size), Eigen::VectorXd::Zero(size)};
    for (int part = 0; part < 10; ++part) {
      const double told = part % 2 == 0 ? 1.0 + disagreement : 1.0 - disagreement;
      constexpr double kWeight = 100.0;
      cost.evidence.parts.push_back({kWeight * by * by.transpose(), -kWeight * told * by});
      cost.evidence.whole.information += cost.evidence.parts.back().information;
      cost.evidence.whole.gradient += cost.evidence.parts.back().gradient;
    }
    return cost;
  }

  const CalibrationParameters parameters_{*make_described(1, make_test_pinhole(420.0))};
};

TEST_F(CalibrationChoiceTest, TakesTheExplanationThatNeedsTheSmallerError) {
  // 20 px are fifty of the usual standard deviations, .02 is one; then .4 px and .6.
  const CalibrationPosterior distorted =
      choose_prior(parameters_, cost_of(20.0, 0.02), FreeParameters::kLikely);
  EXPECT_NEAR(distorted.change[kDistortion], 0.02, 1e-3);
  EXPECT_LT(std::abs(distorted.change[kFocalLength]), 0.5);
  const CalibrationPosterior longer =
      choose_prior(parameters_, cost_of(0.4, 0.6), FreeParameters::kLikely);
  EXPECT_NEAR(longer.change[kFocalLength], 0.4, 0.1);
  EXPECT_LT(std::abs(longer.change[kDistortion]), 0.02);
}

TEST_F(CalibrationChoiceTest, GoesFarWhereNothingElseExplains) {
  const CalibrationPosterior found =
      choose_prior(parameters_, cost_of(1e9, 0.3), FreeParameters::kLikely);
  EXPECT_NEAR(found.change[kDistortion], 0.3, 0.01);
  EXPECT_GT(found.prior.sigmas[kDistortion], 0.1);
  EXPECT_EQ(found.prior.sigmas[2], 0.0) << "centres are held";
  EXPECT_GT(choose_prior(parameters_, cost_of(1e9, 0.3), FreeParameters::kAll).prior.sigmas[2],
            0.0);
}

TEST_F(CalibrationChoiceTest, PredictsWhatOnlyAllPartsAgreeOn) {
  const auto gain_with = [&](double disagreement) {
    const CalibrationCost cost = cost_of(1e9, 0.02, disagreement);
    const CalibrationPosterior found = choose_prior(parameters_, cost, FreeParameters::kLikely);
    return predicted_gain(cost, found, cost.at);
  };
  EXPECT_GT(gain_with(0.0), 400.0);
  EXPECT_NEAR(gain_with(0.5), gain_with(0.0), 100.0);
  EXPECT_LT(gain_with(20.0), gain_with(0.0));
}

TEST_F(CalibrationChoiceTest, MeasuresHowPartsContradictEachOther) {
  const auto variance_with = [&](double disagreement) {
    const CalibrationCost cost = cost_of(1e9, 0.02, disagreement);
    return variance_between_parts(cost, choose_prior(parameters_, cost, FreeParameters::kLikely));
  };
  EXPECT_NEAR(variance_with(0.0), 0.0, 1e-9);
  EXPECT_GT(variance_with(0.2), 1.0);
  EXPECT_NEAR(variance_with(0.4) / variance_with(0.2), 4.0, 0.1);
}

}  // namespace
}  // namespace waymark

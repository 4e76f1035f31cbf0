// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/imu/imu_samples.h"

#include <gtest/gtest.h>

#include <limits>

namespace waymark {
namespace {

ImuSample sample_at(std::int64_t timestamp_ns) {
  const auto t = static_cast<double>(timestamp_ns);
  return {timestamp_ns, {t, 2.0 * t, -t}, {1.0, 3.0 * t, 0.5 * t}};
}

/// Every 10 ns from 100, without those from 300 to 360.
ImuSamples samples_with_gap() {
  ImuSamples samples;
  for (std::int64_t t = 100; t <= 600; t += 10) {
    if (t < 300 || t > 360) samples.add(sample_at(t));
  }
  return samples;
}

TEST(ImuSamples, RejectAndCountRepeatedAndBackwardStampsAndWhatIsNotFinite) {
  ImuSamples samples;
  EXPECT_TRUE(samples.add(sample_at(100)));
  EXPECT_FALSE(samples.add(sample_at(100)));
  EXPECT_FALSE(samples.add(sample_at(90)));
  ImuSample broken = sample_at(120);
  broken.acceleration.y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(samples.add(broken));
  EXPECT_TRUE(samples.add(sample_at(110)));
  EXPECT_EQ(samples.num_rejected(), 3u);
  EXPECT_EQ(samples.all().size(), 2u);
}

TEST(ImuSamples, InterpolateLinearly) {
  const ImuSamples samples = samples_with_gap();
  for (const std::int64_t t : {100, 101, 157, 290, 370, 599, 600}) {
    const auto found = samples.at(t);
    ASSERT_TRUE(found) << t;
    EXPECT_EQ(found->timestamp_ns, t);
    EXPECT_LT((found->angular_velocity - sample_at(t).angular_velocity).norm(), 1e-9);
    EXPECT_LT((found->acceleration - sample_at(t).acceleration).norm(), 1e-9);
  }
  for (const std::int64_t t : {99, 291, 330, 369, 601}) EXPECT_FALSE(samples.at(t)) << t;
}

TEST(ImuSamples, SpansEndWhereTheyShould) {
  const ImuSamples samples = samples_with_gap();
  for (const auto& [begin, end] : {std::pair{103, 147}, {110, 150}, {141, 142}, {100, 290}}) {
    const std::vector<ImuSample> span = samples.between(begin, end);
    ASSERT_GE(span.size(), 2U);
    EXPECT_EQ(span.front().timestamp_ns, begin);
    EXPECT_EQ(span.back().timestamp_ns, end);
    for (std::size_t i = 1; i < span.size(); ++i) {
      EXPECT_GT(span[i].timestamp_ns, span[i - 1].timestamp_ns);
      EXPECT_LE(span[i].timestamp_ns, span[i - 1].timestamp_ns + 10);
    }
    EXPECT_LT((span.front().acceleration - sample_at(begin).acceleration).norm(), 1e-9);
  }
}

TEST(ImuSamples, SayWhyASpanIsNotTold) {
  const ImuSamples samples = samples_with_gap();
  EXPECT_EQ(samples.coverage(90, 150), ImuCoverage::kOutside);
  EXPECT_EQ(samples.coverage(500, 601), ImuCoverage::kOutside);
  EXPECT_EQ(samples.coverage(250, 291), ImuCoverage::kGap);
  EXPECT_EQ(samples.coverage(369, 400), ImuCoverage::kGap);
  EXPECT_EQ(samples.coverage(280, 400), ImuCoverage::kGap);
  EXPECT_TRUE(samples.between(280, 401).empty());
  EXPECT_EQ(samples.coverage(280, 290), ImuCoverage::kWhole);
  EXPECT_EQ(samples.coverage(370, 400), ImuCoverage::kWhole);
  EXPECT_EQ(ImuSamples().coverage(1, 2), ImuCoverage::kOutside);
}

TEST(ImuSamples, AMissingSampleOrTwoIsNoGap) {
  ImuSamples samples;
  for (std::int64_t t = 100; t <= 600; t += 10) {
    if (t != 300 && t != 310) samples.add(sample_at(t));
  }
  EXPECT_EQ(samples.coverage(150, 550), ImuCoverage::kWhole);
}

TEST(ImuSamples, ForgetWhatIsOldButNotWhatIsNeeded) {
  ImuSamples samples = samples_with_gap();
  const std::vector<ImuSample> before = samples.between(207, 290);
  samples.drop_before(207);
  EXPECT_EQ(samples.all().front().timestamp_ns, 200);
  EXPECT_EQ(samples.between(207, 290).size(), before.size());
  samples.drop_before(210);
  EXPECT_EQ(samples.all().front().timestamp_ns, 210);
  samples.drop_before(5000);
  EXPECT_EQ(samples.all().size(), 1u);  // The next one continues from it.
  samples.drop_before(0);
  EXPECT_EQ(samples.all().size(), 1u);
}

}  // namespace
}  // namespace waymark

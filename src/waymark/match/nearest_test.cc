// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/match/nearest.h"

#include <gtest/gtest.h>

namespace waymark {
namespace {

/// A descriptor with the lowest num_bits bits set.
Descriptor with_bits(int num_bits) {
  Descriptor descriptor{};
  for (int bit = 0; bit < num_bits; ++bit) {
    descriptor[static_cast<std::size_t>(bit / 64)] |= std::uint64_t{1} << (bit % 64);
  }
  return descriptor;
}

class FindNearest : public ::testing::Test {
 protected:
  std::optional<Nearest> find(const std::vector<std::uint32_t>& candidates,
                              const AppearanceOptions& options) {
    return find_nearest(Descriptor{}, descriptors_, candidates, options, distances_);
  }

  std::vector<Descriptor> descriptors_ = {
      with_bits(100), with_bits(30), with_bits(50), with_bits(33), with_bits(30)};
  std::vector<std::uint16_t> distances_;
};

TEST_F(FindNearest, TakesTheMostAlikeOfTheCandidates) {
  const auto nearest = find({0, 2, 1}, {64, 0.8});
  ASSERT_TRUE(nearest);
  EXPECT_EQ(nearest->feature, 1u);
  EXPECT_EQ(nearest->distance, 30);
}

TEST_F(FindNearest, RefusesWhatIsTooFar) {
  EXPECT_TRUE(find({1}, {30, 0.8}));
  EXPECT_FALSE(find({1}, {29, 0.8}));
}

TEST_F(FindNearest, RefusesWhatIsAmbiguousInEitherOrder) {
  EXPECT_FALSE(find({1, 3}, {64, 0.9}));
  EXPECT_FALSE(find({3, 1}, {64, 0.9}));
  EXPECT_TRUE(find({3, 1}, {64, 0.95}));
}

TEST_F(FindNearest, TakesTheFirstOfEqualsWhenAnyRatioWillDo) {
  const auto nearest = find({4, 1}, {64, 1.0});
  ASSERT_TRUE(nearest);
  EXPECT_EQ(nearest->feature, 4u);
}

TEST_F(FindNearest, FindsNothingAmongNone) { EXPECT_FALSE(find({}, {256, 1.0})); }

}  // namespace
}  // namespace waymark

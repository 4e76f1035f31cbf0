// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/camera/polynomial.h"

#include <gmock/gmock.h>

#include "waymark/base/rng.h"

namespace waymark {
namespace {

using ::testing::DoubleNear;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

Polynomial with_roots(const std::vector<double>& roots) {
  Polynomial result = {1.0};
  for (const double root : roots) result = product(result, {-root, 1.0});
  return result;
}

TEST(Polynomial, FindsTheRootsItWasMadeOf) {
  Rng rng(1, 0);
  for (int round = 0; round < 100; ++round) {
    std::vector<double> expected;
    for (int i = 0; i < 5; ++i) expected.push_back(2.0 * i + rng.uniform(0.2, 1.8));
    const std::vector<double> found = roots_between(with_roots(expected), 0.0, 10.0);
    ASSERT_EQ(found.size(), expected.size());
    for (std::size_t i = 0; i < found.size(); ++i) EXPECT_NEAR(found[i], expected[i], 1e-9);
  }
}

TEST(Polynomial, LooksOnlyBetweenTheBounds) {
  EXPECT_THAT(roots_between(with_roots({-1.0, 2.0, 30.0}), 0.0, 10.0),
              ElementsAre(DoubleNear(2.0, 1e-12)));
}

TEST(Polynomial, ConstantsAndComplexRootsGiveNone) {
  EXPECT_THAT(roots_between({}, 0.0, 1.0), IsEmpty());
  EXPECT_THAT(roots_between({3.0}, -1.0, 1.0), IsEmpty());
  EXPECT_THAT(roots_between({1.0, 0.0, 1.0}, -5.0, 5.0), IsEmpty());
}

TEST(Polynomial, LeadingZerosDoNotMatter) {
  EXPECT_THAT(roots_between({-1.0, 1.0, 0.0, 0.0}, 0.0, 10.0), ElementsAre(DoubleNear(1.0, 1e-12)));
}

TEST(Polynomial, Arithmetic) {
  EXPECT_THAT(product({1.0, 2.0}, {3.0, 4.0}), ElementsAre(3.0, 10.0, 8.0));
  EXPECT_THAT(sum({1.0}, {1.0, 2.0}, -2.0), ElementsAre(-1.0, -4.0));
  EXPECT_THAT(derivative({5.0, 3.0, 2.0}), ElementsAre(3.0, 4.0));
  EXPECT_DOUBLE_EQ(evaluate({1.0, 2.0, 3.0}, 2.0), 17.0);
}

}  // namespace
}  // namespace waymark

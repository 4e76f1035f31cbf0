// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/geometry/polynomial.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "waymark/base/rng.h"

namespace waymark {
namespace {

std::vector<double> times_linear(const std::vector<double>& coefficients, double root) {
  std::vector<double> product(coefficients.size() + 1, 0.0);
  for (std::size_t i = 0; i < coefficients.size(); ++i) {
    product[i + 1] += coefficients[i];
    product[i] -= root * coefficients[i];
  }
  return product;
}

void expect_roots(const std::vector<double>& coefficients, const std::vector<double>& expected) {
  const RealRoots roots = real_roots(coefficients);
  ASSERT_EQ(roots.size, expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_NEAR(roots.values[i], expected[i], 1e-6 * (1.0 + std::abs(expected[i])));
  }
}

TEST(RealRoots, FindsRootsInsideAndOutsideTheUnitInterval) {
  const std::vector<double> roots = {-1e4, -20.0, -3.0, -1.0, -0.5, 1e-3, 0.25, 1.0, 7.0, 300.0};
  std::vector<double> coefficients = {2.5};
  for (const double root : roots) coefficients = times_linear(coefficients, root);
  expect_roots(coefficients, roots);
}

TEST(RealRoots, FindsRandomRootsBesideComplexPairs) {
  Rng rng(1, 0);
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<double> roots;
    std::vector<double> coefficients = {rng.uniform(0.5, 2.0)};
    for (int i = 0; i < 4; ++i) {
      roots.push_back(-4.0 + 2.0 * i + rng.uniform(0.1, 1.9));
      coefficients = times_linear(coefficients, roots.back());
    }
    for (int pair = 0; pair < 3; ++pair) {
      // x^2 + 1 + something is never zero.
      std::vector<double> product(coefficients.size() + 2, 0.0);
      const double constant = rng.uniform(0.3, 3.0);
      for (std::size_t i = 0; i < coefficients.size(); ++i) {
        product[i] += constant * coefficients[i];
        product[i + 2] += coefficients[i];
      }
      coefficients = product;
    }
    expect_roots(coefficients, roots);
  }
}

TEST(RealRoots, HandlesVanishingCoefficients) {
  expect_roots({0.0, 1.0}, {0.0});
  expect_roots({-2.0, 1.0, 0.0, 0.0, 0.0}, {2.0});
  expect_roots({0.0, 0.0, 0.0, 1.0}, {0.0});
  expect_roots({1.0}, {});
  expect_roots({0.0, 0.0, 0.0}, {});
  expect_roots({1.0, 0.0, 1.0}, {});
}

TEST(RealRoots, IgnoresPolynomialsThatAreNotFinite) {
  EXPECT_EQ(real_roots(std::vector<double>{1.0, std::nan(""), 1.0}).size, 0u);
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(real_roots(std::vector<double>{1.0, infinity}).size, 0u);
}

}  // namespace
}  // namespace waymark

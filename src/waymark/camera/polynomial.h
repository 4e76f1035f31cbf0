// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

namespace waymark {

/// A real polynomial, coefficients in ascending order of the power: c[0] + c[1] x + ...
using Polynomial = std::vector<double>;

double evaluate(const Polynomial& polynomial, double x);
Polynomial derivative(const Polynomial& polynomial);
Polynomial product(const Polynomial& a, const Polynomial& b);
Polynomial sum(const Polynomial& a, const Polynomial& b, double factor_of_b = 1.0);

/// Real roots in (low, high) where the sign changes, ascending, to the last bits. Isolated between
/// the roots of the derivative, hence none is missed but those that only touch zero.
std::vector<double> roots_between(const Polynomial& polynomial, double low, double high);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>

namespace waymark {

/// Damping of Levenberg-Marquardt (Madsen, Nielsen & Tingleff 2004, 3.2), to be scaled by the
/// diagonal of the Hessian (Marquardt 1963).
class Damping {
 public:
  explicit Damping(double initial, double least = 0.0) : value_(initial), least_(least) {}

  double value() const { return value_; }

  /// After a step that lowered the cost by `gain` times as much as the linear model promised.
  void accept(double gain) {
    value_ *= std::max(1.0 / 3.0, 1.0 - std::pow(2.0 * gain - 1.0, 3));
    value_ = std::max(value_, least_);
    growth_ = 2.0;
  }

  void reject() {
    value_ *= growth_;
    growth_ *= 2.0;
  }

 private:
  double value_;
  double growth_ = 2.0;
  double least_;
};

/// The damping that Marquardt (1963) proposed: a tenth after a step that lowers the cost, ten times
/// as much after one that does not. For small problems, whose steps cost little to try.
class TenfoldDamping {
 public:
  /// Whether there is a point in going on: beyond it steps no longer move anything.
  bool is_below(double most) const { return value_ < most; }
  double value() const { return value_; }
  /// What a diagonal is multiplied by.
  double factor() const { return 1.0 + value_; }

  void accept() { value_ = std::max(0.1 * value_, 1e-9); }
  void reject() { value_ *= 10.0; }

 private:
  double value_ = 1e-4;
};

}  // namespace waymark

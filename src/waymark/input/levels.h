// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "waymark/image/image.h"

namespace waymark {

/// Which numbers of 16-bit images become black and white in 8 bits.
struct Levels {
  double black = 0.0;      ///< Becomes 0, as does what is less.
  double white = 65535.0;  ///< Becomes 255, as does what is more.

  /// "16-bit images: 80 is black, 4100 white"; empty where all that 16 bits can say is used.
  std::string describe() const;
  bool operator==(const Levels&) const = default;  ///< Both numbers.
};

/// Finds the levels of a recording from some of its images, once for all of it, so that they are
/// steady. Cameras of 10 or 12 bits and thermal ones use a small part of what 16 bits can say;
/// where less than a quarter is used, but for the darkest and brightest thousandth, that becomes
/// all.
class GreyRangeEstimator {
 public:
  GreyRangeEstimator();
  /// Takes an image into account.
  void add(const BasicImage<std::uint16_t>& image);
  /// Of the images so far.
  Levels levels() const;

 private:
  std::vector<std::uint64_t> counts_;  ///< Pixels of each number.
  std::uint64_t num_pixels_ = 0;
};

/// Frames that are looked at: this many, evenly over the recording.
inline constexpr std::size_t kNumLevelFrames = 16;

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "waymark/image/image.h"

namespace waymark {

/// Looks at depth images of a session, whether they can be what the settings say they are.
class DepthCheck {
 public:
  DepthCheck();

  /// Both of the same size.
  void add(ImageView image, DepthView depth);
  int num_images() const { return num_images_; }

  /// In words: no depth camera measures such distances with so many units per metre.
  std::optional<std::string> advise_on_units(double units_per_metre) const;
  /// In words: the outlines of depth are those of the image once they are moved.
  std::optional<std::string> advise_on_registration() const;

 private:
  struct Outline {
    float x_px, y_px;
    bool is_vertical;
  };
  void add_units(DepthView depth);
  void add_outlines(const std::vector<Outline>& outlines, const Image& image);
  double quantile(double share) const;

  int num_images_ = 0;
  std::vector<std::uint64_t> histogram_;  ///< Number of pixels of each depth.
  /// Of each image with outlines: the contrast at them, for each way to move them.
  std::vector<std::vector<double>> contrasts_;
  double reduction_ = 1.0;  ///< Size of the images that are compared, as a factor.
};

}  // namespace waymark

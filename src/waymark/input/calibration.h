// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>

#include "waymark/input/input.h"

namespace waymark {

struct ImageSize {
  int width_px = 0;
  int height_px = 0;

  friend bool operator==(const ImageSize&, const ImageSize&) = default;
};

/// The calibration to use: the given one, else that of the data set, else nothing; with as many
/// cameras as the setup needs. Throws InputError when it has fewer.
std::optional<CameraChain> choose_calibration(const std::filesystem::path& path,
                                              const std::optional<CameraChain>& given,
                                              const std::optional<CameraChain>& carried,
                                              Setup setup);

/// Compares a camera with the first image of it. A camera without a resolution takes the size of
/// the image; InputError that names the image when they differ.
void fit_first_image(CameraChain& chain,
                     std::size_t camera,
                     const ImageSize& size,
                     const std::filesystem::path& image);

/// In words, for people.
std::string describe_calibration(bool is_given, const std::optional<CameraChain>& chain);

}  // namespace waymark

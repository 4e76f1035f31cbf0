// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/input/listing.h"

namespace waymark {

/// One row of rgb.txt or depth.txt.
struct TumImage {
  std::int64_t timestamp_ns = 0;
  std::string name;  ///< Below the folder of the data set.
};

/// Rows "seconds name", times increasing, at least one. Throws InputError; name is what it calls
/// the file.
std::vector<TumImage> parse_tum_images(std::string_view text, const std::string& name);

/// For each colour time the index of its depth image: the two are nearest to each other and at most
/// max_difference_ns apart. Both lists increase. A depth image serves one colour image.
std::vector<std::optional<std::size_t>> pair_depth(const std::vector<std::int64_t>& colour_ns,
                                                   const std::vector<std::int64_t>& depth_ns,
                                                   std::int64_t max_difference_ns);

/// Data set in the layout of TUM RGB-D (Sturm et al. 2012): rgb.txt and, for depth, depth.txt.
Listing list_tum_rgbd(const std::filesystem::path& folder, const InputOptions& options);

}  // namespace waymark

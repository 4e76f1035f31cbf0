// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace waymark {

/// The times that images have for names: seconds since 1970 with a point and decimals, or whole
/// milliseconds, microseconds or nanoseconds, all alike and of this century. Nothing for any other.
std::optional<std::vector<std::int64_t>> times_in_names(
    const std::vector<std::filesystem::path>& images);

/// A list of images.
struct ImageList {
  std::vector<std::filesystem::path> images;  ///< At least one.
  std::vector<std::int64_t> times_ns;         ///< As many, or none.
};

/// Parses a line per image, "PATH" or "TIME PATH", all alike, times as time_unit_ns() has them;
/// empty lines and those that begin with # are passed over. Throws InputError with the line; name
/// is what it calls the list.
ImageList parse_image_list(std::string_view text, const std::string& name);

}  // namespace waymark

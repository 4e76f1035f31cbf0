// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/input/listing.h"

namespace waymark {

/// For each image the index of its partner, nothing where it has none.
using Partners = std::vector<std::optional<std::size_t>>;

/// Partners of the same name but for the extension. Where no name fits and both folders have as
/// many images, those of the same place in their order; where they have not, InputError.
Partners partners_by_name(const std::vector<std::filesystem::path>& images,
                          const std::vector<std::filesystem::path>& others);

/// Partners within half a frame, each the nearest of the other. Both lists increase.
Partners partners_by_time(const std::vector<std::int64_t>& times_ns,
                          const std::vector<std::int64_t>& others_ns);

/// Gives the frames of a listing the partners that they have: images of camera 1 in stereo, else
/// depth. What comes before the first pair is left out, as there would be no scale to start by.
/// Notes and counts the frames without one. Throws InputError at `where`, the place of the others,
/// where less than half have one. others_ns: empty, or their times.
void add_partners(Listing& listing,
                  const Partners& partners,
                  const std::vector<std::filesystem::path>& others,
                  const std::vector<std::int64_t>& others_ns,
                  const std::string& where);

/// Leaves out frames whose time is not later than that of the one before, notes and counts them.
/// Gives the indices of those that stay. Throws InputError at `where` for more than a tenth.
std::vector<std::size_t> keep_increasing(Listing& listing,
                                         const std::vector<std::int64_t>& times_ns,
                                         const std::string& where);

/// Whether two names differ as those of a left and a right camera do: left and right, or 0 and 1 or
/// 1 and 2 as the only difference.
bool are_left_and_right(const std::string& left, const std::string& right);

/// What to say where a folder holds no images (or, are_videos, several videos): what its
/// sub-folders or videos are and the command for them; empty if they are none either.
std::string suggest_command(const std::filesystem::path& folder, bool are_videos);

}  // namespace waymark

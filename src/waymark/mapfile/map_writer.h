// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>

#include "waymark/mapfile/map_file.h"
#include "waymark/mapfile/map_sections.h"

namespace waymark {

/// The journal of a map file, whether it has one or not.
std::filesystem::path journal_of(const std::filesystem::path& map_path);

/// As save_map(); gives the checksum of all records, by which a journal knows its map file.
std::uint32_t write_map_file(const std::filesystem::path& path,
                             const StoredMap& stored,
                             const RigTable& rigs);

}  // namespace waymark

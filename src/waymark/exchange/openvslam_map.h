// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/config.h"
#include "waymark/map/map.h"

namespace waymark {

struct ImportedMap {
  Map map;
  std::vector<std::string> notes;  ///< What was left out.
};

/// A map of OpenVSLAM or stella_vslam from the bytes of its MessagePack file (.msg), as if it had
/// been made here: keyframes with features, descriptors and poses, landmarks with observations,
/// the spanning tree and loop edges; what they do not store is computed. Each root of a spanning
/// tree gives a sub-map. Bearings follow from the cameras of the file. Throws InputError for what
/// is malformed; name is what errors call the file. References to landmarks that are gone, which
/// real files have, are left out.
ImportedMap import_openvslam_map(std::string_view bytes, const std::string& name);

/// The same of a file, in MessagePack (.msg) or SQLite (.db), which its content tells. settings:
/// those of the program that made the map, which say how the image pyramid of a data base was made;
/// nothing: as by default, which is noted.
ImportedMap import_openvslam_file(const std::filesystem::path& path,
                                  const std::optional<ConfigSource>& settings = std::nullopt);

}  // namespace waymark

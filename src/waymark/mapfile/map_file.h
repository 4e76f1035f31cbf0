// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Maps on disk.
//
//   save_map("house.wmap", {system.map(), settings_as_yaml(settings), {}});
//   const StoredMap stored = load_map("house.wmap");
//   Localizer localizer(rig, settings, stored.map);

#include <filesystem>
#include <iosfwd>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "waymark/camera/registry.h"
#include "waymark/imu/inertial_report.h"
#include "waymark/map/map.h"

namespace waymark {

/// A JPEG file; shared, for there are many of them and they are large. Never null.
using SharedJpeg = std::shared_ptr<const std::string>;

/// Images of camera 0 of keyframes, as map files hold them.
using KeyframeImages = std::map<KeyframeId, SharedJpeg>;

/// What a map file holds; docs/map-format.md describes its bytes.
struct StoredMap {
  std::shared_ptr<const Map> map;  ///< Never null.
  std::string settings;            ///< Those used, as YAML.
  /// Of some keyframes or none; those of erased ones are not saved.
  KeyframeImages images;
  /// The IMU that it was made with, and gravity in the frame of its largest part; files have it
  /// where it is used. Gravity is 0 where it is not known.
  std::optional<InertialReport> imu = std::nullopt;
  std::string producer = {};  ///< The program that wrote the file; save_map() sets its own.
};

/// Writes a map file, record by record into a temporary file that replaces `path` at the end: at
/// any moment there is the old file or the new one. The same map gives the same bytes. Throws
/// OutputError when that fails, InputError for a camera that was made without a description.
/// Numbers that load_map() would refuse (not finite, or beyond what is possible) are an
/// OutputError, too, before the old file goes: each is compared with its range as it is written.
/// Reading the new file once more would find no more in a map that was sound, and cost its time and
/// memory again.
void save_map(const std::filesystem::path& path, const StoredMap& stored);

/// Reads a map file of any version ever written. Whatever is wrong with it, be it damaged or made
/// to do harm, is an InputError that names the file, the record and what was expected. `registry`
/// makes the cameras; one of a model that it does not have cannot project (UnknownCamera).
StoredMap load_map(const std::filesystem::path& path,
                   const CameraRegistry& registry = CameraRegistry::with_builtin_models());

/// The same from a stream; `name` is what errors call it.
StoredMap read_map(std::istream& stream,
                   const std::string& name,
                   const CameraRegistry& registry = CameraRegistry::with_builtin_models());

/// The same of a map file and its journal.
StoredMap read_map(std::istream& stream,
                   std::istream& journal,
                   const std::string& name,
                   const CameraRegistry& registry = CameraRegistry::with_builtin_models());

/// What load_map() would complain of: the first damage, or else every invariant of the map that is
/// violated, up to 1000, a line each. Empty if there is nothing.
std::vector<std::string> find_map_faults(
    const std::filesystem::path& path,
    const CameraRegistry& registry = CameraRegistry::with_builtin_models());

}  // namespace waymark

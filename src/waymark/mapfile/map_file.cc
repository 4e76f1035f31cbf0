// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapfile/map_file.h"

#include <fmt/format.h>

#include <fstream>

#include "waymark/base/check.h"
#include "waymark/mapfile/map_layout.h"
#include "waymark/mapfile/map_reader.h"
#include "waymark/mapfile/map_record_stream.h"

namespace waymark {
namespace {

constexpr std::size_t kMaxFaults = 1000;
constexpr std::uint64_t kNewestVersion = 1;

/// Everything but how the parts of the map fit together.
StoredMap read_parts(std::istream& stream,
                     const std::string& name,
                     const CameraRegistry& registry) {
  MapRecordStream records(stream, name);
  MapRecord header = records.next();
  const std::string format = header.text("format", kMaxTextBytes);
  if (format != "waymark-map") throw InputError(name, "is no map file, expected one of Waymark");
  const std::uint64_t version = header.whole("version", UINT32_MAX);
  if (version != kNewestVersion) {
    throw InputError(name,
                     fmt::format("has version {}, expected {}; a newer program may have written it",
                                 version,
                                 kNewestVersion));
  }
  const std::string producer = header.text("producer", kMaxTextBytes);
  header.text("conventions", kMaxTextBytes);
  header.expect_no_more();
  MapReader reader(name, registry);
  while (true) {
    MapRecord record = records.next();
    if (records.kind() != "end") {
      reader.add(record, records.kind());
      continue;
    }
    StoredMap stored = reader.finish(record);
    stored.producer = producer;
    if (!records.is_at_end()) throw InputError(name, "goes on after its end, expected no more");
    return stored;
  }
}

std::ifstream open_map(const std::filesystem::path& path) {
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) {
    throw InputError(path.string(), "missing, expected a map file");
  }
  if (!std::filesystem::is_regular_file(status)) {
    throw InputError(path.string(), "is no regular file, expected a map file");
  }
  std::ifstream stream(path, std::ios::binary);
  if (!stream) throw InputError(path.string(), "cannot be read, expected a map file");
  return stream;
}

}  // namespace

StoredMap read_map(std::istream& stream, const std::string& name, const CameraRegistry& registry) {
  StoredMap stored = read_parts(stream, name, registry);
  const std::string broken = stored.map->broken_invariants();
  if (!broken.empty()) throw InputError(name, broken + ", expected a sound map");
  return stored;
}

StoredMap load_map(const std::filesystem::path& path, const CameraRegistry& registry) {
  std::ifstream stream = open_map(path);
  return read_map(stream, path.string(), registry);
}

std::vector<std::string> find_map_faults(const std::filesystem::path& path,
                                         const CameraRegistry& registry) {
  std::ifstream stream = open_map(path);
  try {
    const StoredMap stored = read_parts(stream, path.string(), registry);
    return stored.map->list_broken_invariants(kMaxFaults);
  } catch (const InputError& error) {
    return {error.what()};
  }
}

}  // namespace waymark

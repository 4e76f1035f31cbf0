// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapfile/map_file.h"

#include <fmt/format.h>

#include "waymark/base/check.h"
#include "waymark/base/regular_file.h"
#include "waymark/mapfile/map_layout.h"
#include "waymark/mapfile/map_reader.h"
#include "waymark/mapfile/map_record_stream.h"
#include "waymark/mapfile/map_writer.h"

namespace waymark {
namespace {

constexpr std::size_t kMaxFaults = 1000;
constexpr std::uint64_t kNewestVersion = kMapVersion;

/// The header of a file of Waymark, up to its version.
MapRecord read_header(MapRecordStream& records, const std::string& name, std::string_view format) {
  MapRecord header = records.next();
  if (header.text("format", kMaxTextBytes) != format) {
    throw InputError(name, "is no map file, expected one of Waymark");
  }
  const std::uint64_t version = header.whole("version", UINT32_MAX);
  if (version != kNewestVersion) {
    throw InputError(name,
                     fmt::format("has version {}, expected {}; a newer program may have written it",
                                 version,
                                 kNewestVersion));
  }
  return header;
}

/// Hands the records up to one of the kind end to the reader.
void read_up_to_end(MapRecordStream& records, MapReader& reader) {
  while (true) {
    MapRecord record = records.next();
    if (records.kind() == "end") return reader.end(record);
    reader.add(record, records.kind());
  }
}

/// Reads a map file; gives its checksum, and the program that wrote it.
std::uint32_t read_file(std::istream& stream,
                        const std::string& name,
                        MapReader& reader,
                        std::string& producer) {
  MapRecordStream records(stream, name);
  MapRecord header = read_header(records, name, "waymark-map");
  producer = header.text("producer", kMaxTextBytes);
  header.text("conventions", kMaxTextBytes);
  header.expect_no_more();
  read_up_to_end(records, reader);
  if (!records.is_at_end()) throw InputError(name, "goes on after its end, expected no more");
  return records.checksum();
}

/// How many changes of a journal are whole: a program that is killed while it writes leaves the
/// beginning of one.
std::size_t count_whole_changes(std::istream& stream, const std::string& name) {
  MapRecordStream records(stream, name);
  std::size_t count = 0;
  try {
    while (true) {
      records.next();
      count += records.kind() == "end";
    }
  } catch (const InputError&) {
    return count;
  }
}

/// Takes in the changes of a journal that belongs to the file of that checksum; of another one
/// nothing, as it is of the file before.
void read_journal(std::istream& stream,
                  const std::string& name,
                  std::uint32_t file_checksum,
                  MapReader& reader) {
  const std::size_t num_changes = count_whole_changes(stream, name);
  if (num_changes == 0) return;
  stream.clear();
  stream.seekg(0);
  MapRecordStream records(stream, name);
  MapRecord header = read_header(records, name, "waymark-map-journal");
  header.text("producer", kMaxTextBytes);
  if (header.whole("map_checksum", UINT32_MAX) != file_checksum) return;
  header.expect_no_more();
  for (std::size_t i = 0; i < num_changes; ++i) read_up_to_end(records, reader);
}

std::ifstream open_map(const std::filesystem::path& path) {
  return open_regular_file(path, "a map file");
}

/// Everything but how the parts of the map fit together. The journal may be null.
StoredMap read_parts(std::istream& stream,
                     std::istream* journal,
                     const std::filesystem::path& path,
                     const CameraRegistry& registry) {
  MapReader reader(path.string(), registry);
  std::string producer;
  const std::uint32_t checksum = read_file(stream, path.string(), reader, producer);
  if (journal) read_journal(*journal, journal_of(path).string(), checksum, reader);
  StoredMap stored = reader.finish();
  stored.producer = std::move(producer);
  return stored;
}

/// A file, which must be there, with its journal, if there is one.
StoredMap open_parts(std::istream& stream,
                     const std::filesystem::path& path,
                     const CameraRegistry& registry) {
  const std::filesystem::path journal_path = journal_of(path);
  std::error_code ignored;
  if (!std::filesystem::exists(journal_path, ignored)) {
    return read_parts(stream, nullptr, path, registry);
  }
  std::ifstream journal = open_map(journal_path);
  return read_parts(stream, &journal, path, registry);
}

void expect_sound(const Map& map, const std::string& name) {
  const std::string broken = map.broken_invariants();
  if (!broken.empty()) throw InputError(name, broken + ", expected a sound map");
}

}  // namespace

StoredMap read_map(std::istream& stream, const std::string& name, const CameraRegistry& registry) {
  StoredMap stored = read_parts(stream, nullptr, name, registry);
  expect_sound(*stored.map, name);
  return stored;
}

StoredMap read_map(std::istream& stream,
                   std::istream& journal,
                   const std::string& name,
                   const CameraRegistry& registry) {
  StoredMap stored = read_parts(stream, &journal, name, registry);
  expect_sound(*stored.map, name);
  return stored;
}

StoredMap load_map(const std::filesystem::path& path, const CameraRegistry& registry) {
  std::ifstream stream = open_map(path);
  StoredMap stored = open_parts(stream, path, registry);
  expect_sound(*stored.map, path.string());
  return stored;
}

std::vector<std::string> find_map_faults(const std::filesystem::path& path,
                                         const CameraRegistry& registry) {
  std::ifstream stream = open_map(path);
  try {
    return open_parts(stream, path, registry).map->list_broken_invariants(kMaxFaults);
  } catch (const InputError& error) {
    return {error.what()};
  }
}

}  // namespace waymark

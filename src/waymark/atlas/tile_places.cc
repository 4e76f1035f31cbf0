// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/atlas/tile_places.h"

#include <fmt/format.h>

#include <string_view>

#include "waymark/atlas/add.h"
#include "waymark/base/atomic_file.h"
#include "waymark/base/check.h"
#include "waymark/base/regular_file.h"
#include "waymark/mapfile/map_layout.h"
#include "waymark/mapfile/map_record.h"
#include "waymark/mapfile/map_record_stream.h"
#include "waymark/mapfile/map_record_writer.h"
#include "waymark/place/place_segment.h"

namespace waymark {
namespace {

constexpr std::uint32_t kPlacesVersion = 1;

void expect_kind(const MapRecordStream& records, const char* kind, MapRecord& record) {
  if (records.kind() != kind) record.fail(fmt::format("expected a record '{}'", kind));
}

}  // namespace

TilePlaces places_of_tile(const Map& tile) {
  TilePlaces places;
  tile.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    WAYMARK_CHECK(id.value == places.size());
    places.push_back(thin_descriptors(keyframe.features->corner_descriptors()));
  });
  return places;
}

void save_places(const std::filesystem::path& path, const TilePlaces& places) {
  AtomicFile file(path);
  MapRecordWriter writer([&](std::string_view bytes) { file.write(bytes); }, path.string());
  writer.add_text("format", "waymark-places");
  writer.add("version", std::uint64_t{kPlacesVersion});
  writer.add_text("producer", "waymark " WAYMARK_VERSION);
  writer.end();
  for (std::size_t i = 0; i < places.size(); ++i) {
    writer.begin("keyframe", i);
    writer.add_array("descriptor", places[i]);
    writer.end();
  }
  writer.write_counts();
  file.commit();
}

TilePlaces load_places(const std::filesystem::path& path, std::uint32_t num_keyframes) {
  std::ifstream stream = open_regular_file(path, "the places of a tile");
  MapRecordStream records(stream, path.string());
  MapRecord header = records.next();
  if (header.text("format", kMaxTextBytes) != "waymark-places") {
    throw InputError(path.string(), "holds no places, expected those of a tile");
  }
  header.whole("version", kPlacesVersion);
  header.text("producer", kMaxTextBytes);
  header.expect_no_more();
  TilePlaces places;
  while (places.size() < num_keyframes) {
    MapRecord record = records.next();
    expect_kind(records, "keyframe", record);
    if (record.whole("id", kMaxKeyframesPerTile) != places.size()) {
      record.fail(fmt::format("expected keyframe {}", places.size()));
    }
    places.push_back(record.array<Descriptor>("descriptor", std::nullopt));
    if (places.back().size() > PlaceSegment::kMaxDescriptors) record.fail("expected fewer");
    record.expect_no_more();
  }
  MapRecord end = records.next();
  expect_kind(records, "end", end);
  if (!records.is_at_end()) throw InputError(path.string(), "goes on after its end");
  return places;
}

}  // namespace waymark

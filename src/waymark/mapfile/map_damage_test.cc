// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// Map files that are damaged or made to do harm.
#include <gmock/gmock.h>

#include <algorithm>
#include <cstring>
#include <functional>
#include <limits>
#include <sstream>

#include "waymark/base/testing/errors.h"
#include "waymark/base/testing/temporary_folder.h"
#include "waymark/base/text.h"
#include "waymark/map/parts.h"
#include "waymark/map/testing/random_map.h"
#include "waymark/mapfile/map_file.h"
#include "waymark/mapfile/testing/map_checksums.h"

namespace waymark {
namespace {

using ::testing::HasSubstr;
using testing::input_error_of;
using testing::join_records;
using ::testing::Not;
using testing::RandomMap;
using testing::seal_record;
using testing::split_records;
using ::testing::StartsWith;
using testing::TemporaryFolder;
using Records = std::vector<std::string>;

/// The n-th record of a kind.
std::string& find(Records& records, const std::string& kind, int n = 0) {
  std::string start = "kind" + std::string(1, static_cast<char>(0xA0 + kind.size())) + kind;
  for (std::string& record : records) {
    if (record.substr(0, 40).find(start) != std::string::npos && n-- == 0) return record;
  }
  throw std::runtime_error("no " + kind);
}

/// Puts bytes over those that begin `offset` after a key, and seals the record.
void patch(std::string& record,
           const std::string& key,
           std::size_t offset,
           const std::string& bytes) {
  const std::string packed = static_cast<char>(0xA0 + key.size()) + key;
  const std::size_t at = record.find(packed);
  ASSERT_NE(at, std::string::npos) << key;
  std::copy(bytes.begin(),
            bytes.end(),
            record.begin() + static_cast<std::ptrdiff_t>(at + packed.size() + offset));
  seal_record(record);
}

/// Puts bytes over those that begin `offset` into the data of an array, and seals the record.
void patch_array(std::string& record,
                 const std::string& key,
                 std::size_t offset,
                 const std::string& bytes) {
  const std::string data =
      "\xa4"
      "data";
  const std::size_t array = record.find(static_cast<char>(0xA0 + key.size()) + key);
  const std::size_t type = record.find(data, array) + data.size();
  ASSERT_LT(array, type);
  const std::size_t size_bytes = std::size_t{1}
                                 << (static_cast<unsigned char>(record[type]) - 0xC4);
  std::copy(bytes.begin(),
            bytes.end(),
            record.begin() + static_cast<std::ptrdiff_t>(type + 1 + size_bytes + offset));
  seal_record(record);
}

/// The other name must be as long.
void rename(std::string& record, const std::string& key, const std::string& other) {
  patch(record, key, static_cast<std::size_t>(0) - key.size(), other);
}

std::string packed(double value) {
  std::string bytes(8, '\0');
  std::memcpy(bytes.data(), &value, 8);
  std::reverse(bytes.begin(), bytes.end());
  return "\xcb" + bytes;
}

template <class T>
std::string raw(T value) {
  std::string bytes(sizeof(T), '\0');
  std::memcpy(bytes.data(), &value, sizeof(T));
  return bytes;
}

class MapDamage : public ::testing::Test {
 protected:
  static std::string bytes_of(std::shared_ptr<const Map> map) {
    StoredMap stored;
    stored.map = std::move(map);
    stored.settings = "seed: 1\n";
    stored.images[stored.map->submaps()[0].root] = std::make_shared<const std::string>("jpeg");
    const TemporaryFolder folder;
    save_map(folder / "a.wmap", stored);
    return read_text_file(folder / "a.wmap", "a map");
  }

  static std::string error_of(const std::string& bytes) {
    return input_error_of([&] {
      std::istringstream stream(bytes);
      const StoredMap stored = read_map(stream, "DIR/a.wmap");
      EXPECT_EQ(stored.map->broken_invariants(), "");
    });
  }

  void expect_error(const std::string& bytes, const std::string& expected) const {
    const std::string error = error_of(bytes);
    EXPECT_THAT(error, StartsWith("DIR/a.wmap: ")) << expected;
    EXPECT_THAT(error, HasSubstr("expected")) << expected;
    EXPECT_THAT(error, Not(HasSubstr("\n"))) << expected;
    EXPECT_THAT(error, HasSubstr(expected));
  }

  void expect_error(const Records& records, const std::string& expected) const {
    expect_error(join_records(records), expected);
  }

  const std::string bytes_ = bytes_of(RandomMap(7, 120).map().freeze());
  Records records_ = split_records(bytes_);
};

TEST_F(MapDamage, OfNothingThereIsNoError) {
  EXPECT_EQ(error_of(join_records(records_)), "no error");
}

TEST_F(MapDamage, KeysMayBeInLongerFormats) {
  for (std::string& record : records_) {
    record.replace(record.size() - 12, 1, std::string("\xdb\x00\x00\x00\x06", 5));
    testing::seal_record(record);
  }
  EXPECT_EQ(error_of(join_records(records_)), "no error");
}

TEST_F(MapDamage, OtherFiles) {
  expect_error("", "record 0 at byte 0: is truncated");
  expect_error("Hello, I am a text.\n", "is no map file");
  expect_error(std::string(100, '\xc1'), "record 0 at byte 0: is damaged");
  expect_error(std::string("\x81\xa6"
                           "format\x01",
                           9),
               "does not end with its checksum");
}

TEST_F(MapDamage, Truncated) {
  Rng rng(5, 0);
  for (int i = 0; i < 100; ++i) {
    const std::size_t size = rng.below(static_cast<std::uint32_t>(bytes_.size()));
    expect_error(bytes_.substr(0, size), "is truncated");
  }
  expect_error(bytes_ + '\x01', "goes on after its end");
}

TEST_F(MapDamage, FlippedBits) {
  Rng rng(6, 0);
  for (int i = 0; i < 300; ++i) {
    std::string damaged = bytes_;
    const std::size_t at = rng.below(static_cast<std::uint32_t>(bytes_.size()));
    damaged[at] = static_cast<char>(damaged[at] ^ (1 << rng.below(8)));
    expect_error(damaged, "");
  }
}

TEST_F(MapDamage, OtherVersions) {
  patch(records_[0], "version", 0, "\x02");
  expect_error(records_, "has version 2, expected 1");
  patch(records_[0], "format", 1, "waymark-mop");
  expect_error(records_, "is no map file");
}

TEST_F(MapDamage, RecordsThatAreMissingDoubledOrOutOfOrder) {
  for (std::size_t i = 1; i + 1 < records_.size(); ++i) {
    Records missing = records_, doubled = records_, swapped = records_;
    missing.erase(missing.begin() + static_cast<std::ptrdiff_t>(i));
    doubled.insert(doubled.begin() + static_cast<std::ptrdiff_t>(i), records_[i]);
    std::swap(swapped[i], swapped[i + 1]);
    expect_error(missing, "");
    expect_error(doubled, "");
    expect_error(swapped, "");
  }
}

TEST_F(MapDamage, GiganticLengths) {
  for (const std::string start : {"\xdd", "\xdf", "\xdb", "\xc6", "\xc9"}) {
    Records gigantic = records_;
    gigantic.insert(gigantic.begin() + 1, start + "\xff\xff\xff\xf0");
    expect_error(gigantic, "record 1 at byte");
  }
  Records claimed = records_;
  find(claimed, "image")
      .replace(find(claimed, "image").find("jpeg") + 4, 1, "\xc6\x03\xff\xff\xff");
  expect_error(claimed, "is truncated");
  patch(find(records_, "keyframe"), "landmark", 1 + 6 + 4 + 6, "\xce");  // In its shape.
  expect_error(records_, "record");
}

TEST_F(MapDamage, Nesting) {
  records_[1] = std::string(100000, '\x91') + "\x01";
  expect_error(records_, "record 1 at byte");
}

TEST_F(MapDamage, Keys) {
  Records doubled = records_, unknown = records_;
  rename(find(doubled, "keyframe"), "level", "pixel");
  expect_error(doubled, "keyframe 0: has the key 'pixel' twice");
  rename(find(unknown, "keyframe", 1), "response", "resistor");
  expect_error(unknown, "has no response, expected one");
  Records other = records_;
  rename(find(other, "keyframe"), "kind", "king");
  expect_error(other, "has the kind '', expected one of version 1");
}

TEST_F(MapDamage, Numbers) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  struct Case {
    std::string kind, key;
    std::size_t offset;
    std::string bytes, expected;
  };
  const std::size_t x = 1 + 9 + 1;               // Of a rotation, after two sizes and a key.
  const std::size_t t = x + 4 * 9 + 1 + 11 + 1;  // Of a translation.
  const std::size_t data = 1 + 6 + 4 + 6 + 1;    // Of the shape of an array, before its sizes.
  const std::vector<Case> cases = {
      {"keyframe", "rig_from_world", x, packed(nan), "rig_from_world is nan, expected finite"},
      {"keyframe", "rig_from_world", x, packed(3.0), "expected a unit quaternion"},
      {"keyframe", "rig_from_world", t, packed(HUGE_VAL), "rig_from_world is inf"},
      {"keyframe", "applied_scale", 0, packed(-1.0), "applied_scale is -1, expected a number from"},
      {"keyframe", "applied_scale", 0, packed(nan), "applied_scale is nan"},
      {"keyframe", "submap", 0, "\x7f", "submap is 127, expected a whole number from 0 to 2"},
      {"keyframe", "rig", 0, "\x7f", "rig is 127, expected a whole number"},
      {"keyframe", "pixel", 8, "<f8", "pixel has the dtype '<f8', expected <f4"},
      {"keyframe", "pixel", data, "\x7f", "expected"},
      {"submap", "is_metric", 0, "\x01", "is_metric is 1, expected true or false"},
      {"loop_edge", "scale", 0, packed(0.0), "scale is 0, expected a number from"},
      {"erased_keyframe", "heir", 0, "\xc0", "erased"},
      {"camera", "intrinsics", 1, packed(-1.0), "focal length fu is -1, expected more than 0"},
      {"camera", "intrinsics", 1, packed(nan), "intrinsics is nan, expected finite numbers"},
      {"map", "end_keyframe", 0, "\x7f", "end_keyframe is 127, expected"},
  };
  for (const Case& one : cases) {
    Records damaged = records_;
    patch(find(damaged, one.kind), one.key, one.offset, one.bytes);
    expect_error(damaged, one.expected);
  }
}

/// Numbers inside of arrays, which no map that is wrong would put there.
TEST_F(MapDamage, Arrays) {
  struct Case {
    std::string kind, key;
    std::size_t offset;
    std::string bytes, expected;
  };
  const std::vector<Case> cases = {
      {"keyframe", "pixel", 20, raw(NAN), "pixel holds nan as number 5"},
      {"keyframe", "size_rad", 0, raw(0.0f), "size_rad holds 0"},
      {"keyframe", "range_m", 0, raw(-HUGE_VALF), "range_m holds -inf"},
      {"keyframe",
       "level_pixel_from_bearing",
       20,
       raw(HUGE_VALF),
       "level_pixel_from_bearing holds inf as number 5"},
      {"landmarks", "position_in_world", 8, raw(HUGE_VAL), "position_in_world holds inf"},
      {"odometry", "keyframe", 4, raw(0u), "has keyframe 0 after 0, expected ids that ascend"},
      {"odometry", "rotation", 0, raw(static_cast<double>(NAN)), "rotation holds nan"},
      {"odometry", "rotation", 32, raw(1.9), "rotation 1 has the length"},
      {"odometry", "translation", 8, raw(HUGE_VAL), "translation holds inf as number 1"},
      {"odometry", "scale", 0, raw(0.0), "scale holds 0"},
      {"odometry", "depth", 8, raw(-1.0), "depth holds -1 as number 1"}};
  for (const Case& one : cases) {
    Records damaged = records_;
    patch_array(find(damaged, one.kind), one.key, one.offset, one.bytes);
    expect_error(damaged, one.kind + " 0: " + one.expected);
  }
}

/// What is inside of arrays, through maps that are wrong.
TEST_F(MapDamage, Features) {
  using Break = std::function<void(Features&)>;
  const std::vector<std::pair<std::string, Break>> cases = {
      {"pixel of feature 2 is (1000",
       [](Features& features) { features.keypoints[2].x_px = 1000.0f; }},
      {"level of feature 1 is 8, expected less than 8",
       [](Features& features) { features.keypoints[1].level = 8; }},
      {"camera of feature 0 is 1, expected 0",
       [](Features& features) { features.keypoints[0].camera = 1; }},
      {"bearing of feature 3 has the length 2",
       [](Features& features) { features.bearings[3] *= 2.0f; }},
      {"inverse_range_sigma of feature 0 is 0.5 without a range",
       [](Features& features) {
         features.range_m[0] = 0.0f;
         features.inverse_range_sigma[0] = 0.5f;
       }},
      {"partner of feature 4 is 5", [](Features& features) { features.partner[4] = 5; }},
      {"partner of feature 4 is 4000", [](Features& features) { features.partner[4] = 4000; }},
  };
  for (const auto& [expected, inflict] : cases) {
    MapParts parts = take_apart(RandomMap(7, 120).map());
    auto features = std::make_shared<Features>(*parts.keyframes[0].keyframe.features);
    inflict(*features);
    parts.keyframes[0].keyframe.features = features;
    expect_error(bytes_of(Map::restore(std::move(parts)).freeze()), "keyframe 0: " + expected);
  }
}

TEST_F(MapDamage, MapsThatAreNotSound) {
  using Break = std::function<void(MapParts&)>;
  const std::vector<std::pair<std::string, Break>> cases = {
      {"the spanning tree has a cycle",
       [](MapParts& parts) {
         for (auto& stored : parts.keyframes) {
           if (stored.keyframe.parent.is_valid()) stored.keyframe.parent = stored.id;
         }
       }},
      {"submap 1: is joined in a cycle",
       [](MapParts& parts) { parts.submaps[1].joined_into = SubmapId{1}; }},
      {"was merged in a cycle",
       [](MapParts& parts) { parts.merged_landmarks[0].survivor = parts.merged_landmarks[0].id; }},
      {"keyframe 0: sees landmark 5000000, which is not there",
       [](MapParts& parts) { parts.keyframes[0].keyframe.landmarks[0] = LandmarkId{5000000}; }},
      {"loop_edge 0: ties a keyframe to itself",
       [](MapParts& parts) { parts.loop_edges[0].to = parts.loop_edges[0].from; }},
      {"keyframe 1: its odometry goes round in a cycle",
       [](MapParts& parts) { parts.odometry[1].node.parent = parts.odometry[1].id; }},
  };
  for (const auto& [expected, inflict] : cases) {
    MapParts parts = take_apart(RandomMap(7, 120).map());
    inflict(parts);
    expect_error(bytes_of(Map::restore(std::move(parts)).freeze()), expected);
  }
}

TEST_F(MapDamage, EditsWithRightChecksumsAreRefusedOrHarmless) {
  Rng rng(8, 0);
  int num_refused = 0;
  for (int i = 0; i < 1500; ++i) {
    Records edited = records_;
    std::string& record = edited[rng.below(static_cast<std::uint32_t>(edited.size()))];
    for (std::uint32_t edits = 1 + rng.below(3); edits > 0; --edits) {
      // Half of them among the keys and small values at the start.
      const auto size = static_cast<std::uint32_t>(record.size() - 5);
      const std::uint32_t at = rng.below(rng.below(2) ? size : std::min(size, 300u));
      record[at] = static_cast<char>(rng.below(256));
    }
    seal_record(record);
    const std::string error = error_of(join_records(edited));
    EXPECT_THAT(error, Not(HasSubstr("\n")));
    num_refused += error != "no error";
  }
  EXPECT_GT(num_refused, 500);
}

}  // namespace
}  // namespace waymark

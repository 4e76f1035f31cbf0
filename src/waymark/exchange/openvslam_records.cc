// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/exchange/openvslam_records.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <numbers>
#include <utility>

#include "waymark/base/text.h"
#include "waymark/exchange/msgpack_reader.h"

namespace waymark {
namespace {

using Fields = std::vector<MsgpackReader::Field>;

constexpr std::size_t kMaxFeatures = 100'000;  // Of a keyframe.
constexpr std::int64_t kMaxId = 4'000'000'000;
constexpr std::int64_t kMaxLevels = 64;
constexpr double kMaxLength = 1e9;     // Metres, and pixels.
constexpr double kMaxSeconds = 9.2e9;  // Nanoseconds of it fit 64 bits.

/// Ids are unsigned; those that are none are -1, which comes back as the largest of 32 bits where
/// it was stored so.
std::int64_t read_id(MsgpackReader& reader) {
  const std::int64_t id = reader.read_integer(INT64_MIN, UINT32_MAX);
  if (id == UINT32_MAX || id < 0) return -1;
  if (id > kMaxId) reader.fail(fmt::format("is {}, expected an id up to {}", id, kMaxId));
  return id;
}

std::int64_t parse_id(const MsgpackReader& reader, std::string_view key) {
  std::int64_t id = -1;
  const auto [end, error] = std::from_chars(key.data(), key.data() + key.size(), id);
  if (error != std::errc() || end != key.data() + key.size() || id < 0 || id > kMaxId) {
    reader.fail(
        fmt::format("is the key {}, expected an id from 0 to {}", quote_for_message(key), kMaxId));
  }
  return id;
}

/// A map from names to records, each name once.
template <class Key, class T, class KeyOf, class Read>
void read_table(MsgpackReader& reader, std::map<Key, T>& table, KeyOf key_of, Read read) {
  reader.read_map([&](std::string_view text) {
    const auto [at, is_new] = table.try_emplace(key_of(text));
    if (!is_new) reader.fail("is there twice, expected once");
    read(at->second, text);
  });
}

std::string read_text(MsgpackReader& reader) { return std::string(reader.read_string()); }

template <int kSize>
Eigen::Matrix<double, kSize, 1> read_vector(MsgpackReader& reader) {
  Eigen::Matrix<double, kSize, 1> vector;
  reader.read_array_of(kSize, [&](std::size_t i) {
    vector(static_cast<Eigen::Index>(i)) = reader.read_number(kMaxLength);
  });
  return vector;
}

void read_camera(MsgpackReader& reader, OpenvslamCamera& camera) {
  reader.read_map([&](std::string_view key) {
    if (key == "model_type") {
      camera.model = read_text(reader);
    } else if (key == "setup_type") {
      camera.setup = read_text(reader);
    } else if (reader.is_number()) {
      camera.numbers[std::string(key)] = reader.read_number(kMaxLength);
    } else {
      reader.skip();
    }
  });
}

Fields pyramid_fields(MsgpackReader& reader, OpenvslamPyramid& pyramid, const char* levels_key) {
  const auto read_factor = [&] {
    pyramid.scale_factor = reader.read_number(10.0);
    if (pyramid.scale_factor > 1.0) return;
    reader.fail(fmt::format("is {}, expected a factor of more than 1", pyramid.scale_factor));
  };
  const auto read_levels = [&] { pyramid.num_levels = reader.read_integer(1, kMaxLevels); };
  return {{"scale_factor", read_factor, false}, {levels_key, read_levels, false}};
}

void read_keypoints(MsgpackReader& reader, std::vector<Keypoint>& keypoints) {
  Keypoint* keypoint = nullptr;
  const auto read_pixel = [&] {
    const Eigen::Vector2d pixel = read_vector<2>(reader);
    keypoint->x_px = static_cast<float>(pixel.x());
    keypoint->y_px = static_cast<float>(pixel.y());
  };
  const auto read_angle = [&] {
    const double degrees = reader.read_number(1e6);
    keypoint->angle_rad = static_cast<float>(
        std::remainder(degrees * std::numbers::pi / 180.0, 2.0 * std::numbers::pi));
  };
  const auto read_level = [&] {
    keypoint->level = static_cast<std::uint8_t>(reader.read_integer(0, kMaxLevels - 1));
  };
  const Fields fields = {{"pt", read_pixel}, {"ang", read_angle}, {"oct", read_level}};
  reader.read_array(
      kMaxFeatures,
      [&](std::size_t size) { keypoints.resize(size); },
      [&](std::size_t i) {
        keypoint = &keypoints[i];
        reader.read_record(fields);
      });
}

/// 32 bytes each, as 8 words of the machine that wrote them: little-endian, as good as always.
void read_descriptors(MsgpackReader& reader, std::vector<Descriptor>& descriptors) {
  reader.read_array(
      kMaxFeatures,
      [&](std::size_t size) { descriptors.assign(size, Descriptor{}); },
      [&](std::size_t i) {
        reader.read_array_of(8, [&](std::size_t word) {
          const auto bits = static_cast<std::uint64_t>(reader.read_integer(0, UINT32_MAX));
          descriptors[i][word / 2] |= bits << (32 * (word % 2));
        });
      });
}

template <class T, class Read>
void read_list(MsgpackReader& reader, std::vector<T>& list, Read read) {
  reader.read_array(
      kMaxFeatures,
      [&](std::size_t size) { list.resize(size); },
      [&](std::size_t i) { list[i] = read(); });
}

void expect_parallel(const MsgpackReader& reader,
                     const OpenvslamKeyframe& keyframe,
                     std::int64_t num_keypoints) {
  const auto expect = [&](const char* key, std::size_t size, bool may_be_empty) {
    if (static_cast<std::int64_t>(size) == num_keypoints || (may_be_empty && size == 0)) return;
    reader.fail(fmt::format("has {} {}, expected {} as n_keypts says", size, key, num_keypoints));
  };
  expect("undist_keypts", keyframe.keypoints.size(), false);
  expect("descs", keyframe.descriptors.size(), false);
  expect("lm_ids", keyframe.landmarks.size(), false);
  expect("x_rights", keyframe.right_columns_px.size(), true);
  expect("depths", keyframe.depths_m.size(), true);
}

void read_keyframe(MsgpackReader& reader, OpenvslamKeyframe& keyframe) {
  std::int64_t num_keypoints = 0;
  const auto as_float = [&] { return static_cast<float>(reader.read_number(kMaxLength)); };
  const auto as_id = [&] { return read_id(reader); };
  Fields fields = pyramid_fields(reader, keyframe.pyramid, "n_scale_levels");
  const Fields own = {
      {"ts", [&] { keyframe.timestamp_s = reader.read_number(kMaxSeconds); }},
      {"cam", [&] { keyframe.camera = read_text(reader); }},
      {"orb_params", [&] { keyframe.orb_params = read_text(reader); }, false},
      {"rot_cw", [&] { keyframe.rotation_cw.coeffs() = read_vector<4>(reader); }},
      {"trans_cw", [&] { keyframe.translation_cw = read_vector<3>(reader); }},
      {"n_keypts", [&] { num_keypoints = reader.read_integer(0, kMaxFeatures); }},
      {"undist_keypts", [&] { read_keypoints(reader, keyframe.keypoints); }},
      {"x_rights", [&] { read_list(reader, keyframe.right_columns_px, as_float); }, false},
      {"depths", [&] { read_list(reader, keyframe.depths_m, as_float); }, false},
      {"descs", [&] { read_descriptors(reader, keyframe.descriptors); }},
      {"lm_ids", [&] { read_list(reader, keyframe.landmarks, as_id); }},
      {"span_parent", [&] { keyframe.parent = read_id(reader); }},
      {"loop_edges", [&] { read_list(reader, keyframe.loop_edges, as_id); }, false},
  };
  fields.insert(fields.end(), own.begin(), own.end());
  reader.read_record(fields);
  if (keyframe.timestamp_s < 0.0) reader.fail("has a negative ts, expected a time in seconds");
  expect_parallel(reader, keyframe, num_keypoints);
}

void read_landmark(MsgpackReader& reader, OpenvslamLandmark& landmark) {
  const Fields fields = {
      {"pos_w", [&] { landmark.position_in_world = read_vector<3>(reader); }},
      {"ref_keyfrm", [&] { landmark.reference = read_id(reader); }},
      {"n_vis", [&] { landmark.num_visible = reader.read_integer(0, UINT32_MAX); }, false},
      {"n_fnd", [&] { landmark.num_found = reader.read_integer(0, UINT32_MAX); }, false},
  };
  reader.read_record(fields);
}

}  // namespace

OpenvslamRecords read_openvslam_records(std::string_view bytes, const std::string& name) {
  OpenvslamRecords records;
  MsgpackReader reader(bytes, name);
  const auto as_text = [](std::string_view key) { return std::string(key); };
  const auto as_id = [&](std::string_view key) { return parse_id(reader, key); };
  const auto read_cameras = [&] {
    read_table(
        reader, records.cameras, as_text, [&](OpenvslamCamera& camera, std::string_view key) {
          camera.name = as_text(key);
          camera.where = fmt::format("{}: camera {}", name, quote_for_message(key));
          read_camera(reader, camera);
        });
  };
  const auto read_pyramids = [&] {
    read_table(reader, records.pyramids, as_text, [&](OpenvslamPyramid& pyramid, std::string_view) {
      reader.read_record(pyramid_fields(reader, pyramid, "num_levels"));
    });
  };
  const auto read_keyframes = [&] {
    read_table(
        reader, records.keyframes, as_id, [&](OpenvslamKeyframe& keyframe, std::string_view) {
          read_keyframe(reader, keyframe);
        });
  };
  const auto read_landmarks = [&] {
    read_table(
        reader, records.landmarks, as_id, [&](OpenvslamLandmark& landmark, std::string_view) {
          read_landmark(reader, landmark);
        });
  };
  const Fields fields = {{"cameras", read_cameras},
                         {"orb_params", read_pyramids, false},
                         {"keyframes", read_keyframes},
                         {"landmarks", read_landmarks}};
  reader.read_record(fields);
  reader.expect_end();
  return records;
}

}  // namespace waymark

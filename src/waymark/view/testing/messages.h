// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "waymark/view/message.h"

/// A reader of the viewer's protocol, written from docs/viewer-protocol.md alone: what a page would
/// hold after the messages it got.
namespace waymark {

class MessageReader {
 public:
  explicit MessageReader(const std::string& bytes) : bytes_(bytes) {
    kind = take<std::uint8_t>();
    EXPECT_EQ(take<std::uint8_t>(), 1);
    EXPECT_EQ(take<std::uint16_t>(), 0);
    count = take<std::uint32_t>();
  }

  template <class T>
  T take() {
    T value{};
    EXPECT_LE(position_ + sizeof(T), bytes_.size());
    if (position_ + sizeof(T) <= bytes_.size()) {
      std::memcpy(&value, bytes_.data() + position_, sizeof(T));
    }
    position_ += sizeof(T);
    return value;
  }

  template <class T>
  std::vector<T> take_all(std::size_t number) {
    std::vector<T> values(number);
    for (T& value : values) value = take<T>();
    return values;
  }

  std::size_t num_left() const { return bytes_.size() - position_; }

  std::uint8_t kind = 0;
  std::uint32_t count = 0;

 private:
  const std::string& bytes_;
  std::size_t position_ = 0;
};

/// What a page holds. Comparable.
struct Page {
  using Values = std::vector<double>;
  std::map<std::uint32_t, Values> landmarks;  ///< Position, frame, observations, sub-map, colour.
  std::map<std::uint32_t, Values> keyframes;
  std::map<std::uint32_t, std::vector<std::pair<std::uint32_t, int>>> edges;
  std::map<std::uint32_t, Values> frames;
  Values cameras;
  Values loops;
  Values submaps;
  Values markers;
  std::map<std::uint32_t, Values> on_edges;  ///< Half of the edge, of living landmarks.
  bool is_complete = false;

  void apply(const Message& message);

  friend bool operator==(const Page&, const Page&) = default;

 private:
  template <class T>
  static double plain(T value) {
    const auto number = static_cast<double>(value);
    return std::isnan(number) ? -1e9 : number;
  }
  template <class T>
  static void append(MessageReader& reader, std::vector<Values>& rows, std::size_t per_row) {
    for (Values& row : rows) {
      for (std::size_t i = 0; i < per_row; ++i) row.push_back(plain(reader.take<T>()));
    }
  }
  void forget_landmark(std::uint32_t id) {
    landmarks.erase(id);
    on_edges.erase(id);
  }
  void forget_keyframe(std::uint32_t id) {
    keyframes.erase(id);
    edges.erase(id);
  }
  void take_landmarks(MessageReader& reader);
  void take_keyframes(MessageReader& reader);
  void take_moved(MessageReader& reader, std::map<std::uint32_t, Values>& elements, std::size_t n);
  void take_edges(MessageReader& reader);
  void take_frames(MessageReader& reader);
  void take_edge_points(MessageReader& reader);
  void take_markers(MessageReader& reader);
};

inline void Page::take_landmarks(MessageReader& reader) {
  const auto ids = reader.take_all<std::uint32_t>(reader.count);
  std::vector<Values> rows(ids.size());
  append<float>(reader, rows, 3);
  append<std::uint32_t>(reader, rows, 1);
  append<std::uint16_t>(reader, rows, 1);
  append<std::uint16_t>(reader, rows, 1);
  append<std::uint8_t>(reader, rows, 4);
  for (std::size_t i = 0; i < ids.size(); ++i) landmarks[ids[i]] = rows[i];
}

inline void Page::take_keyframes(MessageReader& reader) {
  const auto ids = reader.take_all<std::uint32_t>(reader.count);
  std::vector<Values> rows(ids.size());
  append<float>(reader, rows, 3);
  append<float>(reader, rows, 4);
  append<std::uint32_t>(reader, rows, 1);
  append<float>(reader, rows, 1);
  append<std::uint32_t>(reader, rows, 1);
  append<std::uint32_t>(reader, rows, 1);
  append<std::uint16_t>(reader, rows, 1);
  append<std::uint16_t>(reader, rows, 1);
  for (std::size_t i = 0; i < ids.size(); ++i) keyframes[ids[i]] = rows[i];
}

inline void Page::take_moved(MessageReader& reader,
                             std::map<std::uint32_t, Values>& elements,
                             std::size_t num_values) {
  const auto ids = reader.take_all<std::uint32_t>(reader.count);
  std::vector<Values> rows(ids.size());
  append<float>(reader, rows, 3);
  if (num_values > 3) append<float>(reader, rows, num_values - 3);
  for (std::size_t i = 0; i < ids.size(); ++i) {
    ASSERT_TRUE(elements.count(ids[i])) << ids[i];
    std::copy(rows[i].begin(), rows[i].end(), elements[ids[i]].begin());
  }
}

inline void Page::take_edges(MessageReader& reader) {
  const auto ids = reader.take_all<std::uint32_t>(reader.count);
  const auto ends = reader.take_all<std::uint32_t>(reader.count);
  const std::size_t num_edges = ends.empty() ? 0 : ends.back();
  const auto others = reader.take_all<std::uint32_t>(num_edges);
  const auto shared = reader.take_all<std::uint16_t>(num_edges);
  if (num_edges % 2 == 1) {
    EXPECT_EQ(reader.take<std::uint16_t>(), 0);
  }
  std::size_t edge = 0;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    edges[ids[i]].clear();
    for (; edge < ends[i]; ++edge) edges[ids[i]].push_back({others[edge], shared[edge]});
  }
}

inline void Page::take_frames(MessageReader& reader) {
  const auto ids = reader.take_all<std::uint32_t>(reader.count);
  std::vector<Values> rows(ids.size());
  append<float>(reader, rows, 3);
  append<float>(reader, rows, 4);
  append<float>(reader, rows, 1);
  append<float>(reader, rows, 1);
  append<std::uint16_t>(reader, rows, 1);
  append<std::uint8_t>(reader, rows, 1);
  append<std::uint8_t>(reader, rows, 1);
  for (std::size_t i = 0; i < ids.size(); ++i) frames[ids[i]] = rows[i];
}

inline void Page::take_edge_points(MessageReader& reader) {
  const auto ids = reader.take_all<std::uint32_t>(reader.count);
  std::vector<Values> rows(ids.size());
  append<float>(reader, rows, 3);
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const bool is_point = rows[i] == Values(3, 0.0);
    if (is_point) on_edges.erase(ids[i]);
    if (!is_point) on_edges[ids[i]] = rows[i];
  }
}

inline void Page::take_markers(MessageReader& reader) {
  std::vector<Values> row(1);
  append<std::uint32_t>(reader, row, reader.count);
  append<float>(reader, row, 12 * reader.count);
  append<std::uint32_t>(reader, row, reader.count);
  append<std::uint16_t>(reader, row, reader.count);
  if (reader.count % 2 == 1) {
    EXPECT_EQ(reader.take<std::uint16_t>(), 0);
  }
  markers = row[0];
}

inline void Page::apply(const Message& message) {
  MessageReader reader(*message);
  std::vector<Values> row(1);
  switch (reader.kind) {
    case 1:
      *this = Page();
      reader.take_all<std::uint32_t>(4);
      break;
    case 2:
      is_complete = true;
      reader.take<std::uint32_t>();
      break;
    case 3:
      take_landmarks(reader);
      break;
    case 4:
      take_moved(reader, landmarks, 3);
      break;
    case 5:
      for (const auto id : reader.take_all<std::uint32_t>(reader.count)) forget_landmark(id);
      break;
    case 6:
      append<std::uint32_t>(reader, row, 2 * reader.count);
      append<float>(reader, row, 15 * reader.count);
      cameras = row[0];
      break;
    case 7:
      take_keyframes(reader);
      break;
    case 8:
      take_moved(reader, keyframes, 7);
      break;
    case 9:
      for (const auto id : reader.take_all<std::uint32_t>(reader.count)) forget_keyframe(id);
      break;
    case 10:
      take_edges(reader);
      break;
    case 11:
      append<std::uint32_t>(reader, row, 2 * reader.count);
      loops = row[0];
      break;
    case 12:
      take_frames(reader);
      break;
    case 14:
      append<std::uint32_t>(reader, row, 2 * reader.count);
      submaps = row[0];
      break;
    case 15:
      take_markers(reader);
      break;
    case 16:
      take_edge_points(reader);
      break;
    default:
      FAIL() << "kind " << int{reader.kind};
  }
  EXPECT_EQ(reader.num_left(), 0u) << "kind " << int{reader.kind};
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <map>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "waymark/exchange/exports.h"

namespace waymark::testing {

/// Takes numbers from binary files of little-endian machines.
class Bytes {
 public:
  explicit Bytes(const std::string& bytes) : bytes_(bytes) {}
  template <class T>
  T take() {
    T value{};
    EXPECT_LE(at_ + sizeof(T), bytes_.size());
    std::memcpy(&value, bytes_.data() + at_, sizeof(T));
    at_ += sizeof(T);
    return value;
  }
  std::string take_name() {
    const std::string name = bytes_.c_str() + at_;
    at_ += name.size() + 1;
    return name;
  }
  bool is_at_end() const { return at_ == bytes_.size(); }

 private:
  const std::string& bytes_;
  std::size_t at_ = 0;
};

/// A model as COLMAP's documentation has it, read by it alone.
struct ReadCamera {
  std::string model;
  std::uint64_t width = 0;
  std::vector<double> params;
};
struct ReadImage {
  std::array<double, 4> rotation_wxyz{};
  std::array<double, 3> translation{};
  std::uint32_t camera = 0;
  std::string name;
  std::vector<std::array<double, 2>> pixels;
  std::vector<std::int64_t> points;
};
struct ReadPoint {
  std::array<double, 3> position{};
  std::array<int, 3> color{};
  double error = 0.0;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> track;
};
struct ReadModel {
  std::map<std::uint32_t, ReadCamera> cameras;
  std::map<std::uint32_t, ReadImage> images;
  std::map<std::int64_t, ReadPoint> points;
};

inline std::vector<std::istringstream> data_lines(const std::string& text) {
  std::vector<std::istringstream> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) {
    if (!line.starts_with('#')) lines.emplace_back(line);
  }
  return lines;
}

inline ReadModel read_text(const ColmapModel& files) {
  ReadModel model;
  for (std::istringstream& line : data_lines(files.cameras)) {
    std::uint32_t id = 0;
    ReadCamera camera;
    double height = 0.0;
    line >> id >> camera.model >> camera.width >> height;
    for (double param = 0.0; line >> param;) camera.params.push_back(param);
    model.cameras[id] = camera;
  }
  std::vector<std::istringstream> lines = data_lines(files.images);
  for (std::size_t i = 0; i + 1 < lines.size(); i += 2) {
    std::uint32_t id = 0;
    ReadImage image;
    lines[i] >> id;
    for (double& value : image.rotation_wxyz) lines[i] >> value;
    for (double& value : image.translation) lines[i] >> value;
    lines[i] >> image.camera >> image.name;
    std::array<double, 2> pixel{};
    for (std::int64_t point = 0; lines[i + 1] >> pixel[0] >> pixel[1] >> point;) {
      image.pixels.push_back(pixel);
      image.points.push_back(point);
    }
    model.images[id] = image;
  }
  for (std::istringstream& line : data_lines(files.points)) {
    std::int64_t id = 0;
    ReadPoint point;
    line >> id;
    for (double& value : point.position) line >> value;
    for (int& value : point.color) line >> value;
    line >> point.error;
    for (std::pair<std::uint32_t, std::uint32_t> seen; line >> seen.first >> seen.second;) {
      point.track.push_back(seen);
    }
    model.points[id] = point;
  }
  return model;
}

inline ReadModel read_binary(const ColmapModel& files) {
  const std::map<std::int32_t, std::pair<const char*, int>> known = {{1, {"PINHOLE", 4}},
                                                                     {4, {"OPENCV", 8}},
                                                                     {5, {"OPENCV_FISHEYE", 8}},
                                                                     {6, {"FULL_OPENCV", 12}}};
  ReadModel model;
  Bytes cameras(files.cameras);
  for (auto left = cameras.take<std::uint64_t>(); left > 0; --left) {
    ReadCamera& camera = model.cameras[cameras.take<std::uint32_t>()];
    const auto [name, num_params] = known.at(cameras.take<std::int32_t>());
    camera.model = name;
    camera.width = cameras.take<std::uint64_t>();
    cameras.take<std::uint64_t>();
    for (int i = 0; i < num_params; ++i) camera.params.push_back(cameras.take<double>());
  }
  Bytes images(files.images);
  for (auto left = images.take<std::uint64_t>(); left > 0; --left) {
    ReadImage& image = model.images[images.take<std::uint32_t>()];
    for (double& value : image.rotation_wxyz) value = images.take<double>();
    for (double& value : image.translation) value = images.take<double>();
    image.camera = images.take<std::uint32_t>();
    image.name = images.take_name();
    for (auto features = images.take<std::uint64_t>(); features > 0; --features) {
      const double x = images.take<double>();
      image.pixels.push_back({x, images.take<double>()});
      image.points.push_back(images.take<std::int64_t>());
    }
  }
  Bytes points(files.points);
  for (auto left = points.take<std::uint64_t>(); left > 0; --left) {
    ReadPoint& point = model.points[static_cast<std::int64_t>(points.take<std::uint64_t>())];
    for (double& value : point.position) value = points.take<double>();
    for (int& value : point.color) value = points.take<std::uint8_t>();
    point.error = points.take<double>();
    for (auto seen = points.take<std::uint64_t>(); seen > 0; --seen) {
      const auto image = points.take<std::uint32_t>();
      point.track.emplace_back(image, points.take<std::uint32_t>());
    }
  }
  EXPECT_TRUE(cameras.is_at_end() && images.is_at_end() && points.is_at_end());
  return model;
}

}  // namespace waymark::testing

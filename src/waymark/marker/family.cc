// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/marker/family.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <opencv2/aruco.hpp>
#include <opencv2/core.hpp>

#include "waymark/base/check.h"

namespace waymark {
namespace {

struct NamedDictionary {
  const char* name;
  int dictionary;
};

constexpr std::array<NamedDictionary, 21> kDictionaries = {
    {{"tag16h5", cv::aruco::DICT_APRILTAG_16h5},
     {"tag25h9", cv::aruco::DICT_APRILTAG_25h9},
     {"tag36h10", cv::aruco::DICT_APRILTAG_36h10},
     {"tag36h11", cv::aruco::DICT_APRILTAG_36h11},
     {"aruco_4x4_50", cv::aruco::DICT_4X4_50},
     {"aruco_4x4_100", cv::aruco::DICT_4X4_100},
     {"aruco_4x4_250", cv::aruco::DICT_4X4_250},
     {"aruco_4x4_1000", cv::aruco::DICT_4X4_1000},
     {"aruco_5x5_50", cv::aruco::DICT_5X5_50},
     {"aruco_5x5_100", cv::aruco::DICT_5X5_100},
     {"aruco_5x5_250", cv::aruco::DICT_5X5_250},
     {"aruco_5x5_1000", cv::aruco::DICT_5X5_1000},
     {"aruco_6x6_50", cv::aruco::DICT_6X6_50},
     {"aruco_6x6_100", cv::aruco::DICT_6X6_100},
     {"aruco_6x6_250", cv::aruco::DICT_6X6_250},
     {"aruco_6x6_1000", cv::aruco::DICT_6X6_1000},
     {"aruco_7x7_50", cv::aruco::DICT_7X7_50},
     {"aruco_7x7_100", cv::aruco::DICT_7X7_100},
     {"aruco_7x7_250", cv::aruco::DICT_7X7_250},
     {"aruco_7x7_1000", cv::aruco::DICT_7X7_1000},
     {"aruco_original", cv::aruco::DICT_ARUCO_ORIGINAL}}};

cv::Ptr<cv::aruco::Dictionary> dictionary_of(int number) {
  return cv::aruco::getPredefinedDictionary(number);
}

}  // namespace

std::vector<std::string> marker_families() {
  std::vector<std::string> names;
  for (const NamedDictionary& named : kDictionaries) names.emplace_back(named.name);
  return names;
}

MarkerFamily::MarkerFamily(std::string_view name, const std::string& where) : name_(name) {
  for (const NamedDictionary& named : kDictionaries) {
    if (name != named.name) continue;
    const auto dictionary = dictionary_of(named.dictionary);
    dictionary_ = named.dictionary;
    size_ = dictionary->bytesList.rows;
    side_modules_ = dictionary->markerSize + 2;
    return;
  }
  throw InputError(
      where,
      fmt::format("'{}' is unknown, expected one of {}", name, fmt::join(marker_families(), " ")));
}

std::vector<std::uint8_t> MarkerFamily::modules(int id) const {
  WAYMARK_CHECK(id >= 0 && id < size_);
  cv::Mat image;
  cv::aruco::drawMarker(dictionary_of(dictionary_), id, side_modules_, image, 1);
  std::vector<std::uint8_t> modules;
  for (int y = 0; y < side_modules_; ++y) {
    for (int x = 0; x < side_modules_; ++x) modules.push_back(image.at<std::uint8_t>(y, x) > 127);
  }
  return modules;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace waymark {

/// The names of the families of square markers there are: tag16h5 tag25h9 tag36h10 tag36h11
/// (AprilTag, Olson 2011) and aruco_4x4_50 to aruco_7x7_1000 and aruco_original (Garrido-Jurado et
/// al. 2014), with the numbering and orientation of OpenCV.
std::vector<std::string> marker_families();

/// One kind of square markers: a black border around bits, each marker known by its number.
class MarkerFamily {
 public:
  /// One of marker_families(). Throws InputError for another name; where: begins its message.
  explicit MarkerFamily(std::string_view name, const std::string& where = "marker family");

  /// As given.
  const std::string& name() const { return name_; }
  /// How many markers there are; their numbers begin at 0.
  int size() const { return size_; }
  /// Modules along a side, the border of one module included.
  int side_modules() const { return side_modules_; }
  /// Number of this family among OpenCV's dictionaries.
  int opencv_dictionary() const { return dictionary_; }
  /// Row by row from the top, side_modules() squared of them: whether a module is white. id in [0,
  /// size()).
  std::vector<std::uint8_t> modules(int id) const;

 private:
  std::string name_;
  int dictionary_ = 0;
  int size_ = 0;
  int side_modules_ = 0;
};

}  // namespace waymark

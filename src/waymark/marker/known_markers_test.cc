// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/marker/known_markers.h"

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "waymark/base/check.h"

namespace waymark {
namespace {

using ::testing::HasSubstr;

KnownMarkers read(const std::string& text) {
  return read_known_markers(parse_config({"m.yaml", text}));
}

std::string refusal_of(const std::string& text) {
  try {
    read(text);
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

TEST(KnownMarkersTest, ReadsWhatItWrites) {
  const KnownMarkers markers = read(
      "family: tag36h11\nsize: 0.16\nmarkers:\n"
      "  - {id: 0, position: [1, -2, 0.5], rotation: [0.5, 0.5, -0.5, 0.5]}\n  - {id: 7, size: "
      "0.3}\n");
  EXPECT_EQ(markers.family, "tag36h11");
  EXPECT_EQ(markers.size_of(0), 0.16);
  EXPECT_EQ(markers.size_of(7), 0.3);
  EXPECT_EQ(markers.size_of(9), 0.16);
  ASSERT_TRUE(markers.pose_of(0));
  EXPECT_EQ(markers.pose_of(7), nullptr);
  EXPECT_EQ(markers.pose_of(0)->translation, Eigen::Vector3d(1.0, -2.0, 0.5));
  EXPECT_DOUBLE_EQ(markers.pose_of(0)->rotation.w(), 0.5);
  EXPECT_EQ(format_known_markers(read(format_known_markers(markers))),
            format_known_markers(markers));
}

TEST(KnownMarkersTest, RefusesWhatIsWrongWithItsLine) {
  EXPECT_EQ(refusal_of("size: -1\n"), "m.yaml:1: size is -1, expected a number from 0.001 to 100");
  EXPECT_THAT(refusal_of("family: tag1\n"), HasSubstr("m.yaml:1: family: 'tag1' is unknown"));
  EXPECT_THAT(refusal_of("sizes: 1\n"), HasSubstr("m.yaml:1"));
  EXPECT_THAT(refusal_of("markers: 3\n"), HasSubstr("markers is 3, expected a list"));
  EXPECT_THAT(refusal_of("markers:\n  - 3\n"), HasSubstr("markers[0] is 3, expected {id: NUMBER"));
  EXPECT_THAT(refusal_of("markers:\n  - {id: 1}\n  - {id: 1}\n"), HasSubstr("1 is there twice"));
  EXPECT_THAT(refusal_of("markers:\n  - {id: 1, position: [0, 0, 0]}\n"),
              HasSubstr("has position but no rotation"));
  EXPECT_THAT(refusal_of("markers:\n  - {id: 1, position: [0, 0], rotation: [0, 0, 0, 1]}\n"),
              HasSubstr("has 2 numbers, expected 3"));
  EXPECT_THAT(refusal_of("markers:\n  - {id: 1, position: [0, 0, 0], rotation: [0, 0, 0, 0.9]}\n"),
              HasSubstr("has length 0.9000, expected a unit quaternion"));
}

TEST(KnownMarkersTest, SettingsAreOffAtFirstAndNeedASize) {
  EXPECT_FALSE(markers_to_look_for({}));
  EXPECT_THROW(markers_to_look_for({.family = "tag36h11", .size = 0.0, .file = {}}), InputError);
  EXPECT_THROW(markers_to_look_for({.family = "tag99", .size = 0.1, .file = {}}), InputError);
  EXPECT_THROW(markers_to_look_for({.file = "/nowhere/markers.yaml"}), InputError);
  const auto markers = markers_to_look_for({.family = "tag36h11", .size = 0.1, .file = {}});
  ASSERT_TRUE(markers);
  EXPECT_EQ(markers->size_of(5), 0.1);
}

TEST(KnownMarkersTest, SettingsComeBeforeTheFile) {
  const auto path = std::filesystem::temp_directory_path() / "waymark_known_markers_test.yaml";
  std::ofstream(path) << "family: tag36h11\nsize: 0.16\nmarkers:\n  - {id: 580}\n";
  EXPECT_EQ(markers_to_look_for({.file = path.string()})->size_m, 0.16);
  EXPECT_EQ(markers_to_look_for({.size = 0.2, .file = path.string()})->size_m, 0.2);
  EXPECT_THROW(markers_to_look_for({.family = "tag16h5", .file = path.string()}), InputError);
  std::filesystem::remove(path);
}

}  // namespace
}  // namespace waymark

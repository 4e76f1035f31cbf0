// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// What is exported is read back by readers of their own, and projected by OpenCV.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/calib3d.hpp>

#include "waymark/base/testing/temporary_folder.h"
#include "waymark/exchange/exports.h"
#include "waymark/exchange/testing/colmap_reader.h"
#include "waymark/exchange/testing/small_map.h"

namespace waymark {
namespace {

using testing::ReadCamera;
using testing::ReadImage;
using testing::ReadModel;
using testing::ReadPoint;
using testing::small_map;

/// Where OpenCV, which counts from the centre of the first pixel, sees a point.
cv::Point2d project(const ReadCamera& camera, const ReadImage& image, const ReadPoint& point) {
  const auto& q = image.rotation_wxyz;
  const Eigen::AngleAxisd turn(Eigen::Quaterniond(q[0], q[1], q[2], q[3]));
  const Eigen::Vector3d r = turn.angle() * turn.axis();
  const cv::Vec3d rotation(r.x(), r.y(), r.z());
  const cv::Vec3d translation(image.translation[0], image.translation[1], image.translation[2]);
  const auto& p = camera.params;
  const cv::Matx33d matrix(p[0], 0.0, p[2] - 0.5, 0.0, p[1], p[3] - 0.5, 0.0, 0.0, 1.0);
  const std::vector<double> distortion(p.begin() + 4, p.end());
  const std::vector<cv::Point3d> points = {
      {point.position[0], point.position[1], point.position[2]}};
  std::vector<cv::Point2d> pixels;
  if (camera.model == "OPENCV_FISHEYE") {
    cv::fisheye::projectPoints(points, pixels, rotation, translation, matrix, distortion);
  } else {
    cv::projectPoints(points, rotation, translation, matrix, distortion, pixels);
  }
  return pixels.at(0) + cv::Point2d(0.5, 0.5);
}

void expect_consistent(const ReadModel& model) {
  std::size_t num_observations = 0;
  for (const auto& [id, point] : model.points) {
    EXPECT_GE(point.track.size(), 2u);
    EXPECT_LT(point.error, 0.01);
    for (const auto& [image_id, feature] : point.track) {
      const ReadImage& image = model.images.at(image_id);
      ASSERT_EQ(image.points.at(feature), id);
      const cv::Point2d pixel = project(model.cameras.at(image.camera), image, point);
      EXPECT_NEAR(pixel.x, image.pixels[feature][0], 0.01);
      EXPECT_NEAR(pixel.y, image.pixels[feature][1], 0.01);
      ++num_observations;
    }
  }
  for (const auto& [id, image] : model.images) {
    num_observations -= static_cast<std::size_t>(
        std::count_if(image.points.begin(), image.points.end(), [](auto p) { return p != -1; }));
  }
  EXPECT_EQ(num_observations, 0u);
}

class ExportColmap : public ::testing::TestWithParam<std::pair<const char*, const char*>> {};

TEST_P(ExportColmap, IsReadBackAndReprojects) {
  const ExportScene scene = make_export_scene(small_map(GetParam().first), SubmapId{0});
  for (const ReadModel& model :
       {testing::read_text(format_colmap(scene, ColmapFormat::kText)),
        testing::read_binary(format_colmap(scene, ColmapFormat::kBinary))}) {
    ASSERT_EQ(model.cameras.size(), 1u);
    EXPECT_EQ(model.cameras.at(1).model, GetParam().second);
    EXPECT_EQ(model.cameras.at(1).width, 640u);
    EXPECT_EQ(model.cameras.at(1).params.at(2), 318.5);  // Counted from the corner.
    EXPECT_EQ(model.images.size(), 3u);
    EXPECT_EQ(model.images.at(2).name, "000001_101500000000.jpg");
    EXPECT_EQ(model.images.at(2).pixels.size(), 31u);
    EXPECT_EQ(model.points.size(), 30u);
    EXPECT_THAT(model.points.at(1).color, ::testing::ElementsAre(128, 128, 128));
    expect_consistent(model);
  }
}

INSTANTIATE_TEST_SUITE_P(Cameras,
                         ExportColmap,
                         ::testing::Values(std::pair("plain", "PINHOLE"),
                                           std::pair("distorted", "FULL_OPENCV"),
                                           std::pair("fisheye", "OPENCV_FISHEYE")),
                         [](const auto& info) { return std::string(info.param.first); });

TEST(ExportColmapFiles, AreWhereColmapLooksForThem) {
  const testing::TemporaryFolder folder;
  const ExportScene scene = make_export_scene(small_map("plain"), SubmapId{0});
  write_colmap(folder.path() / "sparse/0", scene, ColmapFormat::kBinary);
  write_colmap(folder.path() / "sparse/0", scene, ColmapFormat::kText);
  for (const char* name : {"cameras", "images", "points3D"}) {
    for (const char* suffix : {".txt", ".bin"}) {
      EXPECT_TRUE(exists(folder.path() / "sparse/0" / (std::string(name) + suffix)));
    }
  }
}

}  // namespace
}  // namespace waymark

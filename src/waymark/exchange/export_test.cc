// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "waymark/base/check.h"
#include "waymark/base/testing/errors.h"
#include "waymark/base/testing/temporary_folder.h"
#include "waymark/exchange/exports.h"
#include "waymark/exchange/testing/colmap_reader.h"
#include "waymark/exchange/testing/small_map.h"
#include "waymark/map/parts.h"

namespace waymark {
namespace {

using testing::small_map;

TEST(ExportScene, LeavesOutObservationsThatAreOff) {
  testing::SmallMap small = testing::make_small_map();
  small.moved_px[1][4].x() = 6.0;
  for (int id : {1, 2}) small.moved_px[id][5].y() = 6.0;
  const Map map = small.map();
  const ExportScene scene = make_export_scene(map, SubmapId{0});
  EXPECT_EQ(scene.points.size(), 29u);
  EXPECT_EQ(scene.points[4].observations.size(), 2u);
  EXPECT_EQ(scene.views[1].points[4], kNoPoint);
}

/// A map whose feature 29 is a point on an edge in each keyframe, where keyframe 1 saw it moved.
Map map_with_an_edge(float angle_rad, const Eigen::Vector2f& moved_px) {
  MapParts parts = take_apart(small_map("plain"));
  for (MapParts::StoredKeyframe& stored : parts.keyframes) {
    auto features = std::make_shared<Features>(*stored.keyframe.features);
    features->num_edges = features->num_primary - 29;
    Keypoint& keypoint = features->keypoints[29];
    keypoint.angle_rad = angle_rad;
    if (stored.id == KeyframeId{1}) {
      keypoint.x_px += moved_px.x();
      keypoint.y_px += moved_px.y();
    }
    stored.keyframe.features = std::move(features);
  }
  return Map::restore(std::move(parts));
}

TEST(ExportScene, ShowsPointsOnEdgesWhereTheirEdgesAre) {
  const float angle_rad = 0.4f;
  const Eigen::Vector2f across = edge_normal(angle_rad);
  const Eigen::Vector2f along(-across.y(), across.x());
  const ExportScene exact = make_export_scene(small_map("plain"), SubmapId{0});
  ASSERT_EQ(exact.points.size(), 30u);
  const auto place = exact.views[1].pixels[29];
  const ExportScene scene =
      make_export_scene(map_with_an_edge(angle_rad, 7.0f * along + across), SubmapId{0});
  ASSERT_EQ(scene.points.size(), 30u);
  EXPECT_EQ(scene.points[29].observations.size(), 3u);
  EXPECT_NEAR(scene.points[29].error_px, 1.0 / 3.0, 0.1);
  EXPECT_LT((scene.views[1].pixels[29] - place - across.cast<double>()).norm(), 0.1);
  const ExportScene beside =
      make_export_scene(map_with_an_edge(angle_rad, 6.0f * across), SubmapId{0});
  EXPECT_EQ(beside.points[29].observations.size(), 2u);
}

TEST(ExportScene, TakesColoursFromImages) {
  const cv::Mat blue(480, 640, CV_8UC3, cv::Scalar(200, 60, 20));
  std::vector<std::uint8_t> jpeg;
  cv::imencode(".jpg", blue, jpeg);
  std::vector<std::uint8_t> small;
  cv::imencode(".jpg", cv::Mat(8, 8, CV_8UC3, cv::Scalar(0, 0, 0)), small);
  const auto shared = [](auto begin, auto end) {
    return std::make_shared<const std::string>(begin, end);
  };
  const std::string none = "no image";
  const KeyframeImages images = {{KeyframeId{0}, shared(jpeg.begin(), jpeg.end())},
                                 {KeyframeId{1}, shared(none.begin(), none.end())},
                                 {KeyframeId{2}, shared(small.begin(), small.end())}};
  const ExportScene scene = make_export_scene(small_map("plain"), SubmapId{0}, images);
  EXPECT_NEAR(scene.points[3].color[0], 20, 3);
  EXPECT_NEAR(scene.points[3].color[1], 60, 3);
  EXPECT_NEAR(scene.points[3].color[2], 200, 3);
}

TEST(ExportScene, OrdersSubmapsBySizeAndPosesByTime) {
  testing::SmallMap small = testing::make_small_map();
  small.parents[1] = KeyframeId{};
  small.timestamps_ns[1] = 110'000'000'000;
  const Map map = small.map();
  EXPECT_THAT(submaps_by_size(map), ::testing::ElementsAre(SubmapId{1}, SubmapId{0}));
  const std::vector<StampedPose> poses = keyframe_trajectory(map, SubmapId{1});
  ASSERT_EQ(poses.size(), 2u);
  EXPECT_EQ(poses[0].timestamp_ns, 102'500'000'000);
  EXPECT_LT(
      (poses[1].world_from_camera.translation - small.cam_from_world[1].origin_in_source()).norm(),
      1e-9);
}

TEST(ExportPly, HoldsThePointsWithTheirColours) {
  const ExportScene scene = make_export_scene(small_map("plain"), SubmapId{0});
  const std::string file = format_ply(scene);
  const std::size_t body = file.find("end_header\n") + 11;
  std::istringstream header(file.substr(0, body));
  std::vector<std::string> properties;
  std::string format;
  std::size_t count = 0;
  for (std::string word; header >> word;) {
    if (word == "format") header >> format;
    if (word == "vertex") header >> count;
    if (word == "property") {
      header >> word;
      properties.push_back(word);
      header >> word;
      properties.push_back(word);
    }
  }
  EXPECT_EQ(format, "binary_little_endian");
  EXPECT_THAT(properties,
              ::testing::ElementsAre("float",
                                     "x",
                                     "float",
                                     "y",
                                     "float",
                                     "z",
                                     "float",
                                     "nx",
                                     "float",
                                     "ny",
                                     "float",
                                     "nz",
                                     "uchar",
                                     "red",
                                     "uchar",
                                     "green",
                                     "uchar",
                                     "blue"));
  ASSERT_EQ(count, 30u);
  ASSERT_EQ(file.size(), body + 27 * count);
  const std::string data = file.substr(body);
  testing::Bytes bytes(data);
  for (const ExportPoint& point : scene.points) {
    for (int i = 0; i < 3; ++i) {
      EXPECT_EQ(bytes.take<float>(), static_cast<float>(point.position_in_world[i]));
    }
    Eigen::Vector3f normal;
    for (float& coordinate : normal) coordinate = bytes.take<float>();
    EXPECT_NEAR(normal.norm(), 1.0f, 1e-6f);
    EXPECT_LT(normal.z(), -0.8f) << "towards the cameras, which look along z";
    for (int i = 0; i < 3; ++i) EXPECT_EQ(bytes.take<std::uint8_t>(), 128);
  }
}

/// OpenGL's camera: x right, y up, looking along -z.
TEST(ExportNerfstudio, ShowsPointsWhereTheKeyframesDo) {
  const ExportScene scene = make_export_scene(small_map("plain"), SubmapId{0});
  const std::string text = format_nerfstudio(scene, {});
  EXPECT_EQ(text.find("-0.0,"), std::string::npos) << "zero has no sign";
  const auto json = nlohmann::json::parse(text);
  EXPECT_EQ(json["camera_model"], "OPENCV");
  EXPECT_EQ(json["ply_file_path"], "points.ply");
  EXPECT_EQ(json["w"], 640);
  ASSERT_EQ(json["frames"].size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    const auto& frame = json["frames"][i];
    EXPECT_EQ(frame["file_path"], "images/" + scene.views[i].name);
    Eigen::Matrix4d world_from_camera;
    for (int r = 0; r < 4; ++r) {
      for (int c = 0; c < 4; ++c) world_from_camera(r, c) = frame["transform_matrix"][r][c];
    }
    for (std::size_t k = 0; k < scene.views[i].pixels.size(); ++k) {
      const std::uint32_t point = scene.views[i].points[k];
      if (point == kNoPoint) continue;
      const Eigen::Vector3d p =
          world_from_camera.topLeftCorner<3, 3>().transpose() *
          (scene.points[point].position_in_world - world_from_camera.topRightCorner<3, 1>());
      ASSERT_LT(p.z(), 0.0);
      const double u = json["cx"].get<double>() + json["fl_x"].get<double>() * p.x() / -p.z();
      const double v = json["cy"].get<double>() - json["fl_y"].get<double>() * p.y() / -p.z();
      EXPECT_NEAR(u, scene.views[i].pixels[k].x() + 0.5, 0.01);
      EXPECT_NEAR(v, scene.views[i].pixels[k].y() + 0.5, 0.01);
    }
  }
}

TEST(ExportNerfstudio, KnowsLenses) {
  const ExportScene fisheye = make_export_scene(small_map("fisheye"), SubmapId{0});
  const auto json = nlohmann::json::parse(format_nerfstudio(fisheye, {}));
  EXPECT_EQ(json["camera_model"], "OPENCV_FISHEYE");
  EXPECT_EQ(json["k1"], -0.2);
  const ExportScene distorted = make_export_scene(small_map("distorted"), SubmapId{0});
  EXPECT_EQ(nlohmann::json::parse(format_nerfstudio(distorted, {}))["p2"], -2e-4);
}

TEST(Export, RefusesWhatOthersHaveNot) {
  const Map map = testing::make_small_map(testing::camera_around(1280)).map();
  const ExportScene scene = make_export_scene(map, SubmapId{0});
  EXPECT_EQ(scene.points.size(), 30u);
  EXPECT_THAT(testing::input_error_of([&] { format_colmap(scene, ColmapFormat::kText); }),
              ::testing::HasSubstr("--split-views"));
  EXPECT_THAT(testing::input_error_of([&] { format_nerfstudio(scene, {}); }),
              ::testing::HasSubstr("--split-views"));
}

}  // namespace
}  // namespace waymark

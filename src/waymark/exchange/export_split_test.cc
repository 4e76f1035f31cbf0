// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/exchange/export_split.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "waymark/base/testing/temporary_folder.h"
#include "waymark/exchange/exports.h"
#include "waymark/exchange/testing/colmap_reader.h"
#include "waymark/exchange/testing/small_map.h"
#include "waymark/input/decode.h"

namespace waymark {
namespace {

const CameraRegistry kRegistry = CameraRegistry::with_builtin_models();

Map map_around() { return testing::make_small_map(testing::camera_around(640)).map(); }

SplitScene split(const Map& map, int num_views) {
  return split_scene(make_export_scene(map, SubmapId{0}), num_views, kRegistry);
}

std::string content_of(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// Every observation, with the pinhole camera and the pose that the model states.
void expect_small_errors(const ExportScene& scene) {
  const testing::ReadModel model = testing::read_text(format_colmap(scene, ColmapFormat::kText));
  std::size_t num_observations = 0;
  for (const auto& [id, point] : model.points) {
    for (const auto& [image_id, feature] : point.track) {
      const testing::ReadImage& image = model.images.at(image_id);
      const auto& q = image.rotation_wxyz;
      const Eigen::Vector3d x =
          Eigen::Quaterniond(q[0], q[1], q[2], q[3]) * Eigen::Vector3d(point.position.data()) +
          Eigen::Vector3d(image.translation.data());
      const testing::ReadCamera& camera = model.cameras.at(image.camera);
      ASSERT_EQ(camera.model, "PINHOLE");
      ASSERT_GT(x.z(), 0.0);
      EXPECT_NEAR(
          camera.params[0] * x.x() / x.z() + camera.params[2], image.pixels[feature][0], 0.02);
      EXPECT_NEAR(
          camera.params[1] * x.y() / x.z() + camera.params[3], image.pixels[feature][1], 0.02);
      ++num_observations;
    }
  }
  EXPECT_GE(num_observations, 90u);
}

TEST(ExportSplit, PartsSeeThePointsWhereTheyAre) {
  for (const int num_views : {6, 8}) {
    const SplitScene around = split(map_around(), num_views);
    EXPECT_EQ(around.scene.views.size(), 3u * static_cast<std::size_t>(num_views));
    EXPECT_EQ(around.scene.points.size(), 30u);
    EXPECT_EQ(around.scene.views[1].name, "000000_100500000000_1.jpg");
    expect_small_errors(around.scene);
  }
  expect_small_errors(split(testing::small_map("fisheye"), 5).scene);
}

/// The six parts of a cube see every direction, each but the rims once.
TEST(ExportSplit, CubeCoversTheSphere) {
  const SplitScene around = split(map_around(), 6);
  Rng rng(1, 0);
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Vector3d direction =
        Eigen::Vector3d(rng.uniform() - 0.5, rng.uniform() - 0.5, rng.uniform() - 0.5);
    int num_seeing = 0;
    for (std::size_t part = 0; part < 6; ++part) {
      const Eigen::Vector3d p = around.parts[part]->part_from_camera * direction;
      num_seeing += p.z() > 0.0 && std::abs(p.x()) <= p.z() && std::abs(p.y()) <= p.z();
    }
    EXPECT_EQ(num_seeing, 1);
  }
}

SharedJpeg shared(const std::string& jpeg) { return std::make_shared<const std::string>(jpeg); }

TEST(ExportSplit, LeavesPerspectiveCamerasAlone) {
  const ExportScene whole = make_export_scene(testing::small_map("distorted"), SubmapId{0});
  const SplitScene same = split_scene(whole, 6, kRegistry);
  EXPECT_EQ(same.scene.views.size(), 3u);
  EXPECT_EQ(format_colmap(same.scene, ColmapFormat::kText).images,
            format_colmap(whole, ColmapFormat::kText).images);
  const testing::TemporaryFolder folder;
  const std::string jpeg = encode_jpeg(ColorImage(640, 480));
  write_split_images(folder / "images", folder / "masks", same, {{KeyframeId{1}, shared(jpeg)}});
  EXPECT_EQ(content_of(folder / "images" / whole.views[1].name), jpeg);
}

/// Each pixel of the wide image has the colour of its direction; so must each of its parts.
TEST(ExportSplit, ImagesShowTheirDirections) {
  const auto color_of = [](const Eigen::Vector3d& bearing) {
    Rgb color;
    for (int c = 0; c < 3; ++c) {
      color[static_cast<std::size_t>(c)] =
          static_cast<std::uint8_t>(std::lround(127.5 + 120.0 * bearing[c]));
    }
    return color;
  };
  const Map map = map_around();
  const Camera& camera = *map.keyframes().at(KeyframeId{0}).rig().cameras[0].camera;
  ColorImage wide(640, 320);
  for (int y = 0; y < 320; ++y) {
    for (int x = 0; x < 640; ++x) {
      const Eigen::Vector2d pixel(x, y);
      Eigen::Vector3d bearing;
      std::uint8_t is_valid = 0;
      camera.unproject({&pixel, 1}, {&bearing, 1}, {&is_valid, 1});
      wide.row(y)[x] = color_of(bearing);
    }
  }
  const SplitScene around = split(map, 6);
  const testing::TemporaryFolder folder;
  write_split_images(
      folder / "images", folder / "masks", around, {{KeyframeId{0}, shared(encode_jpeg(wide))}});
  EXPECT_FALSE(exists(folder / "masks"));  // Everything is seen.
  for (std::size_t part = 0; part < 6; ++part) {
    const SplitPart& split_part = *around.parts[part];
    const auto image =
        decode_color_image(content_of(folder / "images" / around.scene.views[part].name));
    ASSERT_TRUE(image);
    ASSERT_EQ(image->width_px, split_part.width_px);
    for (int y = 2; y < image->height_px; y += 17) {
      for (int x = 2; x < image->width_px; x += 17) {
        const double half = 0.5 * split_part.width_px, center = half - 0.5;
        const Eigen::Vector3d bearing =
            split_part.part_from_camera.conjugate() *
            Eigen::Vector3d((x - center) / half, (y - center) / half, 1.0).normalized();
        for (std::size_t c = 0; c < 3; ++c) {
          EXPECT_NEAR(image->row(y)[x][c], color_of(bearing)[c], 8);
        }
      }
    }
  }
}

TEST(ExportSplit, MasksShowWhatIsNotSeen) {
  const SplitScene fisheye = split(testing::small_map("fisheye"), 5);
  const testing::TemporaryFolder folder;
  const KeyframeImages images = {{KeyframeId{1}, shared(encode_jpeg(ColorImage(640, 480)))},
                                 {KeyframeId{2}, shared("no image")}};
  write_split_images(folder / "images", folder / "masks", fisheye, images);
  const ExportView& view = fisheye.scene.views[6];  // Of keyframe 1, looking off the axis.
  EXPECT_TRUE(exists(folder / "images" / view.name));
  EXPECT_EQ(view.mask_name, view.name + ".png");
  const auto json = nlohmann::json::parse(format_nerfstudio(fisheye.scene, {}));
  EXPECT_EQ(json["frames"][6]["mask_path"], "masks/" + view.mask_name);
  EXPECT_FALSE(exists(folder / "images" / fisheye.scene.views[11].name));
  const auto mask = decode_color_image(content_of(folder / "masks" / (view.name + ".png")));
  ASSERT_TRUE(mask);
  const Image expected = split_mask(*fisheye.parts[6]);
  std::size_t num_seen = 0;
  for (std::size_t i = 0; i < expected.values.size(); ++i) {
    ASSERT_EQ(mask->values[i][0], expected.values[i]);
    num_seen += expected.values[i] == 255;
  }
  EXPECT_GT(num_seen, expected.values.size() / 20);
  EXPECT_LT(num_seen, expected.values.size() * 19 / 20);
}

/// A camera as OpenCV has it.
struct OpencvCamera {
  cv::Matx33d matrix;
  std::vector<double> distortion;

  explicit OpencvCamera(const CameraDescription& camera)
      : matrix(camera.intrinsics[0],
               0,
               camera.intrinsics[2],
               0,
               camera.intrinsics[1],
               camera.intrinsics[3],
               0,
               0,
               1),
        distortion(camera.distortion_coeffs) {}
};

/// Something smooth in every direction.
ColorImage waves(int width_px, int height_px) {
  ColorImage image(width_px, height_px);
  for (int y = 0; y < height_px; ++y) {
    for (int x = 0; x < width_px; ++x) {
      image.row(y)[x] = {static_cast<std::uint8_t>(std::lround(127 + 100 * std::sin(0.03 * x))),
                         static_cast<std::uint8_t>(std::lround(127 + 100 * std::cos(0.04 * y))),
                         static_cast<std::uint8_t>((x + y) / 8)};
    }
  }
  return image;
}

/// What OpenCV makes of the image for the camera of the export.
TEST(Undistort, IsWhatOpencvMakes) {
  for (const bool is_fisheye : {false, true}) {
    SCOPED_TRACE(is_fisheye);
    const Map map = testing::small_map(is_fisheye ? "fisheye" : "distorted");
    const ExportScene whole = make_export_scene(map, SubmapId{0});
    const SplitScene flat = undistort_scene(whole, kRegistry);
    ASSERT_EQ(flat.scene.views.size(), whole.views.size());
    expect_small_errors(flat.scene);
    const OpencvCamera from(whole.cameras[0]), to(flat.scene.cameras[0]);
    const cv::Size size(flat.scene.cameras[0].width_px, flat.scene.cameras[0].height_px);
    EXPECT_GT(size.width, 500);  // Little of 640 x 480 px goes.
    EXPECT_GT(size.height, 380);
    EXPECT_TRUE(flat.parts[0]->sees_all);

    const ColorImage image = waves(640, 480);
    const testing::TemporaryFolder folder;
    write_split_images(
        folder / "images", folder / "masks", flat, {{KeyframeId{0}, shared(encode_jpeg(image))}});
    const auto written = decode_color_image(content_of(folder / "images" / whole.views[0].name));
    ASSERT_TRUE(written);
    ASSERT_EQ(cv::Size(written->width_px, written->height_px), size);
    cv::Mat map_x, map_y, expected;
    if (is_fisheye) {
      cv::fisheye::initUndistortRectifyMap(
          from.matrix, from.distortion, cv::noArray(), to.matrix, size, CV_32F, map_x, map_y);
    } else {
      cv::initUndistortRectifyMap(
          from.matrix, from.distortion, cv::noArray(), to.matrix, size, CV_32F, map_x, map_y);
    }
    cv::remap(cv::Mat(480, 640, CV_8UC3, const_cast<Rgb*>(image.values.data())),
              expected,
              map_x,
              map_y,
              cv::INTER_LINEAR);
    for (int y = 0; y < size.height; y += 7) {
      for (int x = 0; x < size.width; x += 7) {
        for (int c = 0; c < 3; ++c) {
          ASSERT_NEAR(
              written->row(y)[x][static_cast<std::size_t>(c)], expected.at<cv::Vec3b>(y, x)[c], 8)
              << x << " " << y;
        }
      }
    }
  }
}

TEST(Undistort, LeavesAndRefusesWhatItCannotChange) {
  const ExportScene plain = make_export_scene(testing::small_map("plain"), SubmapId{0});
  const SplitScene same = undistort_scene(plain, kRegistry);
  EXPECT_FALSE(same.parts[0]);  // The image stays as it is.
  EXPECT_NE(format_colmap(same.scene, ColmapFormat::kText).cameras.find(" PINHOLE "),
            std::string::npos);
  EXPECT_THROW(undistort_scene(make_export_scene(map_around(), SubmapId{0}), kRegistry),
               InputError);
}

/// Of a lens of 180 degrees what is up to 60 degrees off the axis; the rest of the circle's square
/// is masked.
TEST(Undistort, OfWideLensesTheMiddle) {
  CameraDescription wide;
  wide.camera_model = "ds";
  wide.intrinsics = {-0.2, 0.58, 160.0, 160.0, 319.5, 319.5};
  wide.width_px = wide.height_px = 640;
  const SplitPart part = undistorted_part(kRegistry.make_camera(wide));
  const Eigen::Vector2d rim = part.pinhole.project({0.0, std::sqrt(3.0), 1.0}).value();
  EXPECT_NEAR(rim.y(), part.height_px - 1, 1.0);
  EXPECT_LE(part.width_px, 2 * wide.width_px);
  const auto middle = part.pinhole.project({0.0, 0.0, 1.0}).value();
  EXPECT_NEAR(middle.x(), 0.5 * (part.width_px - 1), 1.0);
}

}  // namespace
}  // namespace waymark

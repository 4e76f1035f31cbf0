// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/features/ego_mask.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "waymark/camera/equirectangular.h"
#include "waymark/camera/perspective.h"
#include "waymark/features/frame_builder.h"
#include "waymark/image/image_testing.h"

namespace waymark {
namespace {

constexpr int kEgoWidthPx = 480, kEgoHeightPx = 240;
constexpr double kEgoFocalPx = 400.0;
/// Images until they are judged for the first time, and for the second.
constexpr int kFirstImages = 96, kSecondImages = 320;

struct EgoBox {
  int left, top, right, bottom;
};
/// As large as ten by two cells and where a bonnet is, and as six by one.
constexpr EgoBox kBonnet{200, 220, 300, 240}, kText{20, 10, 80, 20};

std::shared_ptr<const Camera> make_ego_camera() {
  return std::make_shared<PerspectiveCamera>(
      PerspectiveModel({kEgoFocalPx, kEgoFocalPx}, {239.5, 119.5}), kEgoWidthPx, kEgoHeightPx);
}

/// A wide landscape at infinity, of which the camera sees a part by where it looks.
const PaddedImage& ego_landscape() {
  static const PaddedImage image = testing::make_texture(3 * kEgoWidthPx, kEgoHeightPx, 5);
  return image;
}

/// How many pixels the camera has turned in an image: to and fro, never by equal steps.
int turn_px(int image) { return static_cast<int>(60.0 * std::sin(0.13 * image)); }

Eigen::Quaterniond direction_of(double turned_px) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(turned_px / kEgoFocalPx, Eigen::Vector3d::UnitY()));
}

Image seen_after(int turned_px) {
  Image image(kEgoWidthPx, kEgoHeightPx);
  for (int y = 0; y < kEgoHeightPx; ++y) {
    std::copy_n(ego_landscape().row(y) + kEgoWidthPx + turned_px, kEgoWidthPx, image.row(y));
  }
  return image;
}

/// Draws a part of another picture, the same each time.
void overlay(const EgoBox& box, Image& image) {
  static const PaddedImage picture = testing::make_texture(kEgoWidthPx, kEgoHeightPx, 6);
  for (int y = box.top; y < box.bottom; ++y) {
    std::copy(picture.row(y) + box.left, picture.row(y) + box.right, image.row(y) + box.left);
  }
}

/// Where there are no landmarks, or ten that are always at the same place.
LocatedImage located(const Image& image,
                     const Eigen::Quaterniond& world_from_cam,
                     bool has_landmarks = false) {
  static const std::vector<LandmarkId> landmarks = [] {
    std::vector<LandmarkId> ids;
    for (std::uint32_t i = 0; i < 10; ++i) ids.push_back(LandmarkId{i});
    return ids;
  }();
  static const Features features = [] {
    Features result;
    result.keypoints.resize(landmarks.size());
    return result;
  }();
  if (!has_landmarks) return {image.view(), world_from_cam, features, {}};
  return {image.view(), world_from_cam, features, landmarks};
}

/// Part of a box that is masked, or of everything else.
double masked_part(const Image& mask, const EgoBox& box) {
  if (mask.values.empty()) return 0.0;
  int count = 0;
  for (int y = box.top; y < box.bottom; ++y) {
    count += static_cast<int>(std::count(mask.row(y) + box.left, mask.row(y) + box.right, 0));
  }
  return count / static_cast<double>((box.right - box.left) * (box.bottom - box.top));
}

double masked_part(const Image& mask) {
  return masked_part(mask, {0, 0, kEgoWidthPx, kEgoHeightPx});
}

/// Shows the images [first, end) of a camera that turns, with these drawn in.
void watch_turning(EgoMask& mask, int first, int end, const std::vector<EgoBox>& drawn) {
  for (int i = first; i < end; ++i) {
    Image image = seen_after(turn_px(i));
    for (const EgoBox& box : drawn) overlay(box, image);
    const bool has_changed = mask.watch(located(image, direction_of(turn_px(i))), {});
    ASSERT_TRUE(!has_changed || i == kFirstImages - 1 || i >= kSecondImages) << i;
  }
}

TEST(EgoMask, FindsWhatMovesAlong) {
  EgoMask mask(make_ego_camera());
  watch_turning(mask, 0, kFirstImages, {kBonnet, kText});
  EXPECT_GT(masked_part(mask.mask(), kBonnet), 0.85);
  EXPECT_GT(masked_part(mask.mask(), kText), 0.85);
  // What is above the text, and cells that they touch.
  EXPECT_LT(masked_part(mask.mask()), 0.05);
}

TEST(EgoMask, IsEmptyWhereNothingMovesAlong) {
  EgoMask mask(make_ego_camera());
  watch_turning(mask, 0, kFirstImages, {});
  EXPECT_TRUE(mask.mask().values.empty());
}

TEST(EgoMask, LetsGoOfWhatIsNoLongerThere) {
  EgoMask mask(make_ego_camera());
  watch_turning(mask, 0, kFirstImages, {kBonnet, kText});
  watch_turning(mask, kFirstImages, kFirstImages + kSecondImages, {kBonnet});
  EXPECT_GT(masked_part(mask.mask(), kBonnet), 0.85);
  EXPECT_EQ(masked_part(mask.mask(), kText), 0.0);
}

TEST(EgoMask, LeavesWhatHasNoFeaturesAnyway) {
  Image levels(kEgoWidthPx, kEgoHeightPx);
  std::ranges::fill(levels.values, std::uint8_t{8});
  for (int y = 0; y < 30; ++y) std::fill_n(levels.row(y), kEgoWidthPx, std::uint8_t{0});
  EgoMask mask(make_ego_camera());
  for (int i = 0; i < kFirstImages; ++i) {
    Image image = seen_after(turn_px(i));
    overlay(kText, image);
    mask.watch(located(image, direction_of(turn_px(i))), levels.view());
  }
  EXPECT_TRUE(mask.mask().values.empty());
}

// As on rails: what is far stays where it is.
TEST(EgoMask, TellsNothingWhileTheCameraDoesNotTurn) {
  EgoMask mask(make_ego_camera());
  for (int i = 0; i < kFirstImages; ++i) {
    Image image = seen_after(turn_px(i));
    overlay({180, 80, 300, 110}, image);
    mask.watch(located(image, direction_of(0.5 * (i % 2))), {});
  }
  EXPECT_TRUE(mask.mask().values.empty());
}

// As the directions say, but the image contradicts.
TEST(EgoMask, FindsWhatThePlacesRestOn) {
  EgoMask mask(make_ego_camera());
  for (int i = 0; i < kFirstImages; ++i) {
    Image image = seen_after(turn_px(i));
    overlay(kText, image);
    mask.watch(located(image, direction_of(0.0), true), {});
  }
  EXPECT_GT(masked_part(mask.mask(), kText), 0.4);
  EXPECT_LT(masked_part(mask.mask()), 0.05);
}

TEST(EgoMask, TellsNothingWhereThePlacesRestOnTheWorld) {
  EgoMask mask(make_ego_camera());
  for (int i = 0; i < kFirstImages; ++i) {
    Image image = seen_after(0);
    overlay({100 + i, 90, 220 + i, 200}, image);  // Something passes.
    mask.watch(located(image, direction_of(0.0), true), {});
  }
  EXPECT_TRUE(mask.mask().values.empty());
}

// Directions that are wrong are no evidence.
TEST(EgoMask, TellsNothingWhileTheCameraIsAtRest) {
  EgoMask mask(make_ego_camera());
  for (int i = 0; i < kFirstImages; ++i) {
    Image image = seen_after(0);
    overlay({100 + i, 90, 220 + i, 200}, image);  // Something passes.
    mask.watch(located(image, direction_of(turn_px(i))), {});
  }
  EXPECT_TRUE(mask.mask().values.empty());
}

TEST(EgoMask, BeginsAnewInAnotherWorld) {
  EgoMask mask(make_ego_camera());
  watch_turning(mask, 0, kFirstImages / 2, {kBonnet});
  mask.restart();
  watch_turning(mask, 0, kFirstImages - 1, {kBonnet});
  EXPECT_TRUE(mask.mask().values.empty());
  watch_turning(mask, kFirstImages - 1, kFirstImages, {kBonnet});
  EXPECT_GT(masked_part(mask.mask(), kBonnet), 0.85);
}

// Parts of it, the outline of something that mirrors the world.
TEST(EgoMask, BelongsTogetherBelowWhatSeesAllAround) {
  const auto camera = std::make_shared<EquirectangularCamera>(
      EquirectangularModel(kEgoWidthPx, kEgoHeightPx), kEgoWidthPx, kEgoHeightPx);
  EgoMask mask(camera);
  const double rad_per_px = 2.0 * std::numbers::pi / kEgoWidthPx;
  for (int i = 0; i < kFirstImages; ++i) {
    Image image = seen_after(turn_px(i));
    for (const int left : {100, 160, 220}) overlay({left, 180, left + 40, 200}, image);
    const Eigen::AngleAxisd turned(turn_px(i) * rad_per_px, Eigen::Vector3d::UnitY());
    mask.watch(located(image, Eigen::Quaterniond(turned)), {});
  }
  EXPECT_EQ(masked_part(mask.mask(), {100, 190, 260, kEgoHeightPx}), 1.0);
  EXPECT_EQ(masked_part(mask.mask(), {0, 0, kEgoWidthPx, 180}), 0.0);
  EXPECT_EQ(masked_part(mask.mask(), {270, 0, kEgoWidthPx, kEgoHeightPx}), 0.0);
}

TEST(EgoMask, IsWhatASettingAsksFor) {
  const auto masked_part_with = [](const std::string& auto_mask) {
    FrameBuilder builder({{{make_ego_camera(), Rigid3()}}}, {.view = {.auto_mask = auto_mask}});
    for (int i = 0; i < kFirstImages; ++i) {
      Image image = seen_after(turn_px(i));
      overlay(kBonnet, image);
      builder.watch(located(image, direction_of(turn_px(i))), true);
    }
    return masked_part(builder.ego_mask(), kBonnet);
  };
  EXPECT_GT(masked_part_with("on"), 0.85);
  EXPECT_EQ(masked_part_with("off"), 0.0);
  EXPECT_THROW(masked_part_with("sometimes"), InputError);
}

}  // namespace
}  // namespace waymark

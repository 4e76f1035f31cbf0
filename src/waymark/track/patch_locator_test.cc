// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/patch_locator.h"

#include <gtest/gtest.h>

#include "waymark/base/thread_pool.h"
#include "waymark/camera/registry.h"
#include "waymark/image/small_image.h"
#include "waymark/simulate/motion.h"
#include "waymark/simulate/named_cameras.h"
#include "waymark/simulate/render.h"

namespace waymark {
namespace {

constexpr double kUnitsPerMetre = 5000.0;

/// A rig, whose camera is not its origin, in a furnished room with landmarks.
class PatchLocatorTest : public ::testing::Test {
 protected:
  PatchLocatorTest()
      : camera_(
            CameraRegistry::with_builtin_models().make_camera(named_camera("perspective", 480))),
        rig_(std::make_shared<const Rig>(Rig{{{camera_, cam_from_rig_}}})),
        renderer_(make_world("room", 3), camera_) {
    const DepthImage depth = renderer_.depth(world_from_cam(before_), kUnitsPerMetre, pool_);
    for (int y = 20; y < camera_->height_px(); y += 20) {
      for (int x = 20; x < camera_->width_px(); x += 20) {
        const Eigen::Vector2d pixel(x, y);
        Eigen::Vector3d bearing;
        std::uint8_t is_valid = 0;
        camera_->unproject({&pixel, 1}, {&bearing, 1}, {&is_valid, 1});
        const double range_m = depth.row(y)[x] / kUnitsPerMetre / bearing.z();
        Landmark landmark;
        landmark.position_in_world = world_from_cam(before_) * (range_m * bearing);
        around_.add(LandmarkId{static_cast<std::uint32_t>(around_.size())}, landmark);
      }
    }
  }

  Rigid3 world_from_cam(const Rigid3& rig_from_world) const {
    return (cam_from_rig_ * rig_from_world).inverse();
  }

  std::shared_ptr<const SmallImage> look(const Rigid3& rig_from_world) {
    const Image image = renderer_.image(world_from_cam(rig_from_world), pool_);
    return std::make_shared<const SmallImage>(make_small_image(image.view(), {}));
  }

  /// That shows nothing but its small image.
  Frame make_frame(std::shared_ptr<const SmallImage> image) {
    auto features = std::make_shared<Features>();
    features->rig = rig_;
    features->num_primary = 0;
    return {FrameId{1}, 0, std::move(features), std::move(image)};
  }

  const Rigid3 cam_from_rig_{so3_exp({0.0, 0.1, 0.0}), {0.1, 0.0, -0.05}};
  const Rigid3 before_ = pose_of({{1.5, 1.3, 1.5}, 35.0, -6.0, 0.0}).inverse();
  ThreadPool pool_{1};
  std::shared_ptr<const Camera> camera_;
  std::shared_ptr<const Rig> rig_;
  Renderer renderer_;
  PatchLocator locator_;
  LandmarkSet around_;
};

TEST_F(PatchLocatorTest, FindsThePoseAndWhereTheLandmarksAre) {
  const Rigid3 motion(so3_exp({0.005, -0.02, 0.01}), {0.03, 0.01, -0.04});
  const auto image_before = look(before_);
  Frame frame = make_frame(look(motion * before_));
  const LocatedPatches before{*image_before, before_};
  const auto found = locator_.align(before, around_, {}, frame, before_);
  ASSERT_TRUE(found);
  LocatedFrame located = locator_.pose_of(*rig_, before, *found);
  const Rigid3 error = located.rig_from_world * (motion * before_).inverse();
  EXPECT_LT(error.translation.norm(), 0.005);
  EXPECT_LT(so3_log(error.rotation).norm(), 0.002);
  locator_.add_features(*found, around_, frame, located);
  ASSERT_GE(frame.features->num_primary, 50u);
  EXPECT_EQ(located.num_inliers, static_cast<int>(frame.features->num_primary));
  for (std::size_t i = 0; i < frame.features->num_primary; ++i) {
    const Eigen::Vector3d& landmark = around_.positions_in_world[located.landmarks[i].value];
    const Eigen::Vector3d seen = cam_from_rig_ * (motion * before_ * landmark);
    const double pixel_rad = renderer_.pixel_rad();
    EXPECT_LT((frame.features->bearings[i].cast<double>() - seen.normalized()).norm(),
              2.0 * pixel_rad);
  }
}

TEST_F(PatchLocatorTest, AddsNoLandmarkTwice) {
  const auto image = look(before_);
  Frame frame = make_frame(image);
  const LocatedPatches before{*image, before_};
  const auto found = locator_.align(before, around_, {}, frame, before_);
  ASSERT_TRUE(found);
  LocatedFrame located = locator_.pose_of(*rig_, before, *found);
  locator_.add_features(*found, around_, frame, located);
  const std::size_t count = frame.features->num_primary;
  locator_.add_features(*found, around_, frame, located);
  EXPECT_EQ(frame.features->num_primary, count);
}

/// By distances that are off a motion comes out too short; those that are known go before.
TEST_F(PatchLocatorTest, TrustsLandmarksThatAreKnownWell) {
  const Rigid3 motion(Eigen::Quaterniond::Identity(), {0.06, 0.0, 0.0});
  const auto image_before = look(before_);
  const Frame frame = make_frame(look(motion * before_));
  const Eigen::Vector3d centre = world_from_cam(before_).translation;
  std::vector<std::uint32_t> known;
  for (std::uint32_t i = 0; i < around_.size(); ++i) {
    if (i % 3 == 0) {
      known.push_back(i);
      continue;
    }
    Eigen::Vector3d& position = around_.positions_in_world[i];
    position = centre + (i % 3 == 1 ? 0.5 : 2.0) * (position - centre);
  }
  const LocatedPatches before{*image_before, before_};
  const auto length_m = [&](const std::vector<std::uint32_t>& well_known) {
    const auto found = locator_.align(before, around_, well_known, frame, motion * before_);
    if (!found) return 0.0;
    const LocatedFrame located = locator_.pose_of(*rig_, before, *found);
    return (located.rig_from_world * before_.inverse()).translation.norm();
  };
  EXPECT_NEAR(length_m(known), 0.06, 0.003);
  EXPECT_LT(length_m({}), 0.057);
}

TEST_F(PatchLocatorTest, NeedsImages) {
  const auto image = look(before_);
  const LocatedPatches before{*image, before_};
  EXPECT_FALSE(locator_.align(before, around_, {}, make_frame(nullptr), before_));
  EXPECT_FALSE(locator_.align(before, {}, {}, make_frame(image), before_));
}

}  // namespace
}  // namespace waymark

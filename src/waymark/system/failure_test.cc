// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// Input and cameras that fail in the middle of a session.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <stdexcept>
#include <thread>

#include "waymark/base/check.h"
#include "waymark/system/testing/sequence.h"

namespace waymark {
namespace {

/// When cameras fail, shared between them and the test.
struct Fuse {
  /// Calls of the thread that feeds until one fails; negative: never.
  std::atomic<int> num_calls_left{-1};
  std::atomic<bool> fails_elsewhere{false};
  const std::thread::id feeder = std::this_thread::get_id();

  void burn() {
    const bool is_feeder = std::this_thread::get_id() == feeder;
    if (!is_feeder && fails_elsewhere) throw std::runtime_error("the camera failed in the mapper");
    if (is_feeder && num_calls_left >= 0 && num_calls_left-- == 0) {
      throw std::runtime_error("the camera failed in the tracker");
    }
  }
};

/// A camera that works until its fuse says otherwise.
class FailingCamera : public Camera {
 public:
  FailingCamera(std::shared_ptr<const Camera> camera, Fuse& fuse)
      : Camera(camera->width_px(), camera->height_px()), camera_(std::move(camera)), fuse_(fuse) {}

  std::string_view model() const override { return camera_->model(); }
  void project(std::span<const Eigen::Vector3d> points_in_cam,
               std::span<Eigen::Vector2d> pixels,
               std::span<std::uint8_t> is_visible) const override {
    fuse_.burn();
    camera_->project(points_in_cam, pixels, is_visible);
  }
  void project_with_jacobian(std::span<const Eigen::Vector3d> points_in_cam,
                             std::span<Eigen::Vector2d> pixels,
                             std::span<Matrix23d> pixel_from_point,
                             std::span<std::uint8_t> is_visible) const override {
    fuse_.burn();
    camera_->project_with_jacobian(points_in_cam, pixels, pixel_from_point, is_visible);
  }
  void unproject(std::span<const Eigen::Vector2d> pixels,
                 std::span<Eigen::Vector3d> bearings,
                 std::span<std::uint8_t> is_valid) const override {
    fuse_.burn();
    camera_->unproject(pixels, bearings, is_valid);
  }

 private:
  std::shared_ptr<const Camera> camera_;
  Fuse& fuse_;
};

Rig failing_rig(Fuse& fuse) {
  Rig rig = small_rig();
  for (RigCamera& camera : rig.cameras) {
    camera.camera = std::make_shared<FailingCamera>(camera.camera, fuse);
  }
  return rig;
}

void feed_range(System& system, std::size_t begin, std::size_t end) {
  for (std::size_t i = begin; i < end; ++i) system.feed(input_of(frames()[i]));
}

void expect_near_truth(const System& system) {
  for (const TrajectoryFrame& frame : system.trajectory()) {
    const auto same_time =
        std::find_if(frames().begin(), frames().end(), [&](const SimulatedFrame& simulated) {
          return simulated.timestamp_ns == frame.timestamp_ns;
        });
    ASSERT_NE(same_time, frames().end());
    const Rigid3 truth = frames()[0].world_from_rig.inverse() * same_time->world_from_rig;
    const Rigid3 error = truth.inverse() * frame.world_from_rig;
    EXPECT_LT(error.translation.norm(), 0.03) << "frame " << frame.frame.value;
  }
}

/// Refused input leaves the session as if it had never been fed: to the bit.
TEST(SystemFailure, RefusedFramesLeaveNoTrace) {
  System usual(small_rig(), small_settings(), Timing::kInline);
  System troubled(small_rig(), small_settings(), Timing::kLockstep);
  const Image small(160, 120);
  for (std::size_t i = 0; i < frames().size(); ++i) {
    usual.feed(input_of(frames()[i]));
    FrameImages wrong = input_of(frames()[i]);
    if (i % 3 == 0) wrong.image0 = small.view();
    if (i % 3 == 1) wrong.timestamp_ns = i == 1 ? frames()[0].timestamp_ns : -1;
    if (i % 3 == 2) wrong.mask = small.view();
    EXPECT_THROW(troubled.feed(wrong), InputError) << "frame " << i;
    troubled.feed(input_of(frames()[i]));
  }
  usual.finish();
  troubled.finish();
  const auto expected = usual.trajectory();
  const auto trajectory = troubled.trajectory();
  ASSERT_EQ(trajectory.size(), frames().size());
  ASSERT_EQ(trajectory.size(), expected.size());
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    EXPECT_EQ(trajectory[i].world_from_rig.matrix(), expected[i].world_from_rig.matrix()) << i;
  }
}

/// Whatever step of tracking fails, the frame is missing and nothing else.
TEST(SystemFailure, WhatThrowsWhileTrackingCostsOneFrame) {
  for (const int num_calls : {0, 2, 5}) {
    Fuse fuse;
    System system(failing_rig(fuse), small_settings(), Timing::kLockstep);
    feed_range(system, 0, 10);
    fuse.num_calls_left = num_calls;
    std::size_t next = 10;
    while (fuse.num_calls_left >= 0) {
      ASSERT_LT(next, frames().size());
      try {
        system.feed(input_of(frames()[next]));
      } catch (const std::runtime_error& error) {
        EXPECT_STREQ(error.what(), "the camera failed in the tracker");
      }
      ++next;
    }
    EXPECT_GE(system.trajectory().size(), 10u);
    EXPECT_EQ(system.frame_states().size(), next - 1) << "after " << num_calls << " calls";
    EXPECT_EQ(system.map()->broken_invariants(), "");
    feed_range(system, next, frames().size());
    system.finish();
    EXPECT_EQ(system.trajectory().size(), frames().size() - 1);
    EXPECT_EQ(system.map()->broken_invariants(), "");
    expect_near_truth(system);
  }
}

/// What fails in the mapper's thread reaches the caller, who keeps what there is.
TEST(SystemFailure, AMapperThatFailsEndsTheSessionButKeepsItsResults) {
  Fuse fuse;
  System system(failing_rig(fuse), small_settings(), Timing::kLockstep);
  feed_range(system, 0, 10);
  fuse.fails_elsewhere = true;
  std::size_t next = 10;
  const auto feed_next = [&] { system.feed(input_of(frames()[next])); };
  for (bool has_failed = false; !has_failed; ++next) {
    ASSERT_LT(next, frames().size()) << "the mapper's failure reached nobody";
    try {
      feed_next();
    } catch (const std::runtime_error& error) {
      EXPECT_STREQ(error.what(), "the camera failed in the mapper");
      has_failed = true;
    }
  }
  EXPECT_THROW(feed_next(), std::runtime_error) << "it does not go away";
  EXPECT_GE(system.trajectory().size(), 10u);
  expect_near_truth(system);
  EXPECT_EQ(system.map()->broken_invariants(), "");
  EXPECT_GT(system.map()->keyframes().size(), 0u);
  EXPECT_THROW(system.finish(), std::runtime_error);
  EXPECT_NO_THROW(system.finish());
  EXPECT_THROW(feed_next(), CheckError);
  EXPECT_GE(system.trajectory().size(), 10u);
}

TEST(SystemFailure, AnotherSessionIsNotTouched) {
  Fuse fuse;
  System broken(failing_rig(fuse), small_settings(), Timing::kInline);
  System sound(small_rig(), small_settings(), Timing::kInline);
  feed_range(broken, 0, 5);
  feed_range(sound, 0, 5);
  fuse.num_calls_left = 0;
  EXPECT_THROW(feed_range(broken, 5, 6), std::runtime_error);
  feed_range(sound, 5, 15);
  sound.finish();
  EXPECT_EQ(sound.trajectory().size(), 15u);
  broken.reset();
  feed_range(broken, 0, 10);
  broken.finish();
  EXPECT_EQ(broken.trajectory().size(), 10u);
  expect_near_truth(broken);
}

}  // namespace
}  // namespace waymark

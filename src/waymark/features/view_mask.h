// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "waymark/camera/camera.h"
#include "waymark/features/ego_mask.h"
#include "waymark/features/settings.h"
#include "waymark/image/image.h"

namespace waymark {

/// Distance in pixels from each pixel to the nearest one that is 0, row by row; infinite where
/// there is none (Felzenszwalb and Huttenlocher 2012, Distance transforms of sampled functions).
std::vector<float> distances_to_zero(ImageView image);

/// How many pyramid levels may have features at each pixel of the images of a camera. Immutable:
/// copies share it, and are what equals it.
class LevelMask {
 public:
  /// No limits.
  LevelMask() = default;
  /// Of the size of the images.
  explicit LevelMask(Image num_levels)
      : num_levels_(std::make_shared<const Image>(std::move(num_levels))) {}

  /// Whether there are no limits.
  bool is_empty() const { return num_levels_ == nullptr; }

  /// The limits, and 0 where the other mask, empty or of the same size, is 0; empty where there are
  /// none. Valid as long as this is and the buffer, which may be used, is left alone.
  ImageView combined_with(ImageView other, Image& buffer) const;

  /// Whether a feature of the level may be at a pixel of the image.
  bool allows(const Eigen::Vector2d& pixel, int level) const;

  bool operator==(const LevelMask&) const = default;

 private:
  std::shared_ptr<const Image> num_levels_;
};

/// Where in the images of a camera features may be. Kept free are pixels without a bearing, the
/// black surroundings of a lens's image circle, directions that the settings exclude, and what is
/// found to move along with the camera.
class ViewMask {
 public:
  /// The first images that are searched for black surroundings; an image may be dark all over.
  static constexpr int kNumLearned = 10;

  ViewMask(std::shared_ptr<const Camera> camera, const ViewSettings& settings);

  /// Looks for the black surroundings of the image circle: the smallest circle around the principal
  /// point outside of which no image so far shows anything. Does so for the first kNumLearned
  /// images of a camera that is wide enough to have one; returns at once afterwards.
  void learn(ImageView image);

  /// Looks for what moves along with the camera, see EgoMask. is_same_world: whether directions
  /// and landmarks can be compared with those of the last one.
  void watch(const LocatedImage& located, bool is_same_world);

  /// What was found to move along, see EgoMask::mask().
  const Image& ego_mask() const { return ego_.mask(); }

  /// Whether learn() may still find surroundings.
  bool is_learning() const { return may_have_circle_ && num_learned_ < kNumLearned; }

  /// Where features may be: a feature's patch does not touch the surroundings.
  const LevelMask& levels() const { return levels_; }

 private:
  void update();
  void exclude_ego();

  std::shared_ptr<const Camera> camera_;
  Eigen::Vector2d center_px_;
  bool may_have_circle_;
  double circle_radius_px_ = 0.0;  // 0: not found.
  int num_learned_ = 0;
  Image has_bearing_;   // 1 or 0; empty: all have.
  Image is_direction_;  // 1 or 0 by the settings; empty: all are used.
  EgoMask ego_;
  Image lens_levels_;  // As levels_, but for what moves along; empty: no limits.
  LevelMask levels_;
};

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "waymark/camera/camera.h"
#include "waymark/image/image.h"

namespace waymark {

/// Finds what moves along with the camera: a bonnet, whoever carries it, text that is burnt in.
/// There the mean of the image's gradients over many frames is as large as the gradients are, while
/// those of a world that moves cancel out (as those behind a watermark do, Dekel et al. 2017). How
/// much would remain of a world at infinity follows from the directions that the camera looked in:
/// while it does not turn, nothing is told.
class EgoMask {
 public:
  /// Images that are judged at once.
  static constexpr std::size_t kNumImages = 32;

  explicit EgoMask(std::shared_ptr<const Camera> camera);

  /// Looks at the next image of which the direction is known: at every third, and once they told
  /// something at every tenth. levels: 0 where there are no features anyway; empty: nowhere. Gives
  /// whether the mask changed.
  bool watch(ImageView image, ImageView levels, const Eigen::Quaterniond& world_from_cam);

  /// From here on the directions are in another world.
  void restart();

  /// 0 where the image moves along, else 255; empty while nothing was found.
  const Image& mask() const { return mask_; }

 private:
  /// Sum of the products of gradients over a cell.
  struct Structure {
    double xx = 0.0, xy = 0.0, yy = 0.0;
  };

  void accumulate(ImageView image);
  std::vector<Structure> mean_structures() const;
  bool judge(ImageView levels);
  double unturned_part(std::size_t cell) const;
  std::vector<std::uint8_t> region() const;
  void draw();

  std::shared_ptr<const Camera> camera_;
  double factor_;  ///< Of the reduced image.
  int rows_;       ///< Of cells.
  int interval_;
  int num_passed_ = 0;
  std::vector<Eigen::Vector3d> bearings_;  ///< Of the cells' centres; zero where there is none.
  std::vector<double> pixels_rad_;         ///< What a pixel of the reduced image covers there.
  std::vector<Eigen::Quaterniond> directions_;  ///< Of the images so far.
  int width_px_ = 0, height_px_ = 0;            ///< Of the reduced image.
  std::vector<Eigen::Vector2i> gradients_;      ///< Their sums over the images, per pixel.
  std::vector<Structure> structures_;           ///< Sums over the images, per cell.
  std::vector<std::uint8_t> is_along_;          ///< Per cell, by the images judged last that told.
  Image mask_;
};

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "waymark/base/id.h"
#include "waymark/camera/camera.h"
#include "waymark/features/features.h"
#include "waymark/image/image.h"

namespace waymark {

/// An image of camera 0 that was located.
struct LocatedImage {
  ImageView image;                        ///< In full size.
  Eigen::Quaterniond world_from_cam;      ///< How the camera stood.
  const Features& features;               ///< Seen in it.
  std::span<const LandmarkId> landmarks;  ///< That the place rests on: per feature, or invalid.
};

/// Finds what moves along with the camera: a bonnet, whoever carries it, text that is burnt in.
/// There the mean of the image's gradients over many frames is as large as the gradients are, while
/// those of a world that moves cancel out (as those behind a watermark do, Dekel et al. 2017). How
/// much would remain of a world at infinity follows from the directions that the camera looked in:
/// while it does not turn, nothing is told. But where what the places rest on stays on its pixels,
/// and nearly all of the image moves, they rest on what moves along.
class EgoMask {
 public:
  /// Images that are judged at once.
  static constexpr std::size_t kNumImages = 32;

  explicit EgoMask(std::shared_ptr<const Camera> camera);

  /// Looks at the next image: at every third, and once they told something at every tenth. levels:
  /// 0 where there are no features anyway; empty: nowhere. Gives whether the mask changed.
  bool watch(const LocatedImage& located, ImageView levels);

  /// From here on the directions are in another world.
  void restart();

  /// 0 where the image moves along, else 255; empty while nothing was found.
  const Image& mask() const { return mask_; }

 private:
  /// Sum of the products of gradients over a cell.
  struct Structure {
    double xx = 0.0, xy = 0.0, yy = 0.0;
  };

  void note_landmarks(const LocatedImage& located);
  void accumulate(ImageView image);
  std::vector<Structure> mean_structures() const;
  bool judge(ImageView levels);
  std::vector<std::optional<double>> staying_parts(ImageView levels) const;
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
  /// What the place of the first image rests on, and where it was seen.
  std::vector<std::pair<LandmarkId, Eigen::Vector2f>> anchors_;
  std::size_t num_resting_ = 0;             ///< Images in which they are still there.
  int width_px_ = 0, height_px_ = 0;        ///< Of the reduced image.
  std::vector<Eigen::Vector2i> gradients_;  ///< Their sums over the images, per pixel.
  std::vector<Structure> structures_;       ///< Sums over the images, per cell.
  std::vector<std::uint8_t> is_along_;      ///< Per cell, by the images judged last that told.
  Image mask_;
};

}  // namespace waymark

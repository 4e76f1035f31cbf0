// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>
#include <vector>

#include "waymark/camera/camera.h"
#include "waymark/camera/scaled_camera.h"
#include "waymark/geometry/rigid3.h"
#include "waymark/image/image.h"

namespace waymark {

/// How a camera moved from one image to another, by what surrounds known points.
struct PatchAlignment {
  Rigid3 b_from_a;
  Matrix6d covariance = Matrix6d::Zero();  ///< Of a perturbation of b_from_a on the left.
  double gain = 1.0;                       ///< Grey value in b by that in a.
  double correlation = 0.0;                ///< Of the grey values that both images show; at most 1.
  /// Standard deviation of where the points are seen, by that of the pose; in px of the images.
  double pixel_sigma = 1e9;
  /// Indices of points whose own patch is alike in both, spread over the image, ascending.
  std::vector<std::uint32_t> alike;

  /// Whether it tells where the camera is; see docs/decisions/track.md.
  bool is_certain() const { return alike.size() >= 15 && correlation >= 0.7 && pixel_sigma <= 0.3; }
};

/// Aligns the patches around points of known place with another image, directly: pose and a
/// common gain by the inverse compositional method (Baker and Matthews 2004; Forster et al. 2014)
/// with a robust weight per pixel, coarse to fine. Each patch counts without its mean. Neither
/// corners nor edges are needed, nor a sharp image; a patch is taken to be as far away as its
/// point.
class PatchAligner {
 public:
  /// camera: what both images are of, in full size; they are handed in reduced by detail_factor().
  /// points_in_a: in the camera's frame when it saw image a, in metres (map units in mono).
  PatchAlignment align(const std::shared_ptr<const Camera>& camera,
                       const Image& a,
                       std::span<const Eigen::Vector3d> points_in_a,
                       const Image& b,
                       const Rigid3& initial_b_from_a);

 private:
  /// Squares of a level of image a, each of as many pixels, row by row.
  struct Patches {
    std::vector<std::uint32_t> indices;   ///< Of the point of each.
    std::vector<double> ranges;           ///< Of the point of each, as its unit is.
    std::vector<Eigen::Vector2d> pixels;  ///< Of all.
  };
  /// What is aligned: the pixels of those patches that the lens shows whole.
  struct Points {
    std::vector<std::uint32_t> indices;   ///< Of the point of each patch.
    std::vector<Eigen::Vector3d> points;  ///< In the camera of image a.
    /// Derivatives by xi, where the point is at exp(xi) * point: of the pixel, in px of the level.
    std::vector<Eigen::Matrix<double, 2, 6>> pixel_by_motion;
    std::vector<Vector6d> gradients;  ///< And of the grey value, less the patch's mean.
    std::vector<float> greys;         ///< Less the patch's mean.
  };

  void build_levels(const std::shared_ptr<const Camera>& camera);
  /// Fills candidates_.
  void choose_candidates(std::span<const Eigen::Vector3d> points_in_a);
  /// Fills patches_ and points_.
  void choose_points(std::size_t level, std::span<const Eigen::Vector3d> points_in_a);
  void linearize(std::size_t level);
  void add_patch(std::size_t level, std::size_t patch);
  /// What image b shows of the points: fills is_seen_ and seen_greys_.
  void look(std::size_t level, const Rigid3& b_from_a);
  void centre();
  /// How far patches move by a motion, in the mean, in pixels of the level.
  double mean_shift_px(const Vector6d& motion) const;
  /// One Gauss-Newton step; how far patches move by it.
  double step(PatchAlignment& alignment);
  void judge(PatchAlignment& alignment);
  void choose_alike(PatchAlignment& alignment) const;

  std::shared_ptr<const Camera> camera_;  ///< Of the levels.
  std::vector<ScaledCamera> levels_;      ///< Fine to coarse.
  std::vector<Image> a_, b_;
  std::vector<std::uint32_t> candidates_;  ///< Of the points that image a shows, ascending.
  Patches patches_;
  Points points_;
  double range_ = 1.0;                       ///< Of the points, in the median.
  Matrix6d information_ = Matrix6d::Zero();  ///< Of the last step, by xi.
  std::vector<Eigen::Vector3d> moved_, bearings_;
  std::vector<Eigen::Vector2d> pixels_;
  std::vector<Matrix23d> pixel_from_point_;
  std::vector<std::uint8_t> is_seen_;
  std::vector<float> seen_greys_, errors_;
};

}  // namespace waymark

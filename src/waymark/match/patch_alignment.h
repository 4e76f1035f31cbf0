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
  double pixel_sigma = 1e9;                ///< What the points move by with the pose's error.
  int num_points = 0;                      ///< With a patch that both images show.
  /// Indices of points whose own patch is alike in both, spread over the image, ascending.
  std::vector<std::uint32_t> alike;

  /// Whether it tells where the camera is; see docs/decisions.md.
  bool is_certain() const { return alike.size() >= 15 && correlation >= 0.7 && pixel_sigma <= 0.3; }
};

/// Aligns the patches around points of known place with another image, directly: pose and an affine
/// change of brightness by the inverse compositional method (Baker and Matthews 2004; Forster et
/// al. 2014) with a robust weight per pixel, coarse to fine. Neither corners nor edges are needed,
/// nor a sharp image; a patch is taken to be as far away as its point.
class PatchAligner {
 public:
  /// camera: what all images are of, in full size; they are handed in reduced by the factor.
  PatchAligner(std::shared_ptr<const Camera> camera, double factor);

  /// points_in_a: in the camera's frame when it saw image a, in metres (map units in mono).
  PatchAlignment align(const Image& a,
                       std::span<const Eigen::Vector3d> points_in_a,
                       const Image& b,
                       const Rigid3& initial_b_from_a);

 private:
  /// The pixels of the patches of a level.
  struct Points {
    std::vector<std::uint32_t> indices;   ///< Of the point of each patch.
    std::vector<Eigen::Vector3d> points;  ///< In the camera of image a.
    std::vector<Vector6d> gradients;      ///< Of the grey value, by a motion of the point.
    std::vector<float> greys;
  };

  void build_levels();
  /// Fills candidates_.
  void choose_candidates(std::span<const Eigen::Vector3d> points_in_a);
  void choose_points(std::size_t level, std::span<const Eigen::Vector3d> points_in_a);
  void look(std::size_t level, const Rigid3& b_from_a);
  void centre();
  /// One Gauss-Newton step; how far the points move by it, in pixels of the level.
  double step(PatchAlignment& alignment);
  void judge(PatchAlignment& alignment);
  void choose_alike(PatchAlignment& alignment) const;

  std::shared_ptr<const Camera> camera_;
  double factor_;
  std::vector<ScaledCamera> levels_;  ///< Fine to coarse; made when first used.
  std::vector<Image> a_, b_;
  std::vector<std::uint32_t> candidates_;  ///< Of the points that image a shows, ascending.
  Points points_;
  double range_ = 1.0;  ///< Of the points, in the median.
  Matrix6d information_;
  std::vector<Eigen::Vector3d> moved_, bearings_;
  std::vector<Eigen::Vector2d> pixels_;
  std::vector<Matrix23d> pixel_from_point_;
  std::vector<std::uint8_t> is_seen_;
  std::vector<float> seen_greys_, errors_;
};

}  // namespace waymark

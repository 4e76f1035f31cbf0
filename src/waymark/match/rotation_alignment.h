// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <vector>

#include "waymark/camera/camera.h"
#include "waymark/camera/scaled_camera.h"
#include "waymark/image/small_image.h"

namespace waymark {

/// How a camera turned from one image to another.
struct RotationAlignment {
  Eigen::Quaterniond b_from_a = Eigen::Quaterniond::Identity();  ///< Turns bearings.
  double gain = 1.0;                                             ///< Grey value in b by that in a.
  double offset = 0.0;                                           ///< Added to that.
  double correlation = 0.0;  ///< Of the grey values that both images show; at most 1.

  /// Whether the images are alike enough to believe it; see docs/decisions/track.md.
  bool is_certain() const { return correlation >= 0.5; }
};

/// How the grey value at a pixel changes by a turn of what is seen: bearing -> exp(turn) * bearing.
/// slope: of the grey value by the pixel.
Eigen::Vector3d gradient_by_turn(const Eigen::Vector3d& bearing,
                                 const Matrix23d& pixel_from_bearing,
                                 const Eigen::Vector2d& slope);

/// Aligns whole images by the turn of the camera and an affine change of brightness: the inverse
/// compositional method (Baker and Matthews 2004) on the rotation of a camera of any model
/// (Lovegrove and Davison 2010), with a robust weight per pixel, coarse to fine. What is near moves
/// otherwise than the turn tells, as the weights allow for. Before that, turns all over the field
/// of view are tried with a quarter of the pixels, so that no guess is needed.
class RotationAligner {
 public:
  /// The turn at which images correlate most. camera: what both are of, in full size.
  RotationAlignment align(const std::shared_ptr<const Camera>& camera,
                          const SmallImage& a,
                          const SmallImage& b);

 private:
  /// The pixels of a level, row by row.
  struct Level {
    ScaledCamera camera;
    std::vector<Eigen::Vector3d> bearings;  ///< Unit.
    std::vector<Matrix23d> pixel_from_bearing;
    std::vector<float> weights;  ///< By the solid angle, at most 1; 0 without a bearing.
  };
  /// A turn that is tried first, and where each pixel of the coarsest level is then seen.
  struct Trial {
    Eigen::Quaterniond turn;
    std::vector<std::int16_t> pixels;  ///< Indices on the level before; negative: not seen.
  };
  /// The pixels of one image that are aligned.
  struct Points {
    std::vector<std::size_t> pixels;
    std::vector<Eigen::Vector3d> bearings;
    std::vector<Eigen::Vector3d> gradients;  ///< Of the grey value, by a turn.
    std::vector<float> greys;
    std::vector<float> weights;
  };
  struct Candidate {
    RotationAlignment alignment;
    double certainty = 0.0;  ///< Fisher's z of the correlation.
  };

  void build_levels();
  void build_trials();
  void set_camera(const std::shared_ptr<const Camera>& camera);
  void set_images(const SmallImage& a, const SmallImage& b);
  void choose_points(std::size_t level);
  /// Where the points are seen after a turn: fills is_seen_ and seen_greys_.
  void look(std::size_t level, const Eigen::Quaterniond& b_from_a);
  void look(const Trial& trial);
  /// Brightness and correlation of what look() found.
  Candidate compare(const Eigen::Quaterniond& b_from_a) const;
  std::vector<RotationAlignment> search();
  RotationAlignment refine(std::size_t level, RotationAlignment alignment);
  /// Turns by one Gauss-Newton step; its size in radians.
  double step(RotationAlignment& alignment);

  std::shared_ptr<const Camera> camera_;  ///< Of the levels and the trials.
  std::vector<Level> levels_;             ///< Fine to coarse.
  std::vector<Trial> trials_;
  std::vector<SmallImage> a_, b_;
  Points points_;
  std::vector<Eigen::Vector3d> turned_;
  std::vector<Eigen::Vector2d> pixels_;
  std::vector<std::uint8_t> is_seen_;
  std::vector<float> seen_greys_;
  std::vector<float> errors_;
};

}  // namespace waymark

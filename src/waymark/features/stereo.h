// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "waymark/camera/rig.h"
#include "waymark/features/features.h"
#include "waymark/features/pyramid.h"
#include "waymark/features/settings.h"
#include "waymark/features/stereo_curve.h"
#include "waymark/features/stereo_kernel.h"
#include "waymark/features/stereo_patch.h"

namespace waymark {

/// A feature of camera 0 found again in camera 1.
struct StereoMatch {
  std::uint32_t primary;  ///< Index of the feature of camera 0.
  Eigen::Vector2d pixel;  ///< In camera 1, level 0, sub-pixel.
  std::uint8_t level;     ///< Pyramid level of camera 1 that shows it as large as camera 0 does.
};

/// Finds features of camera 0 in the image of camera 1 by search along their epipolar curves: the
/// ray of a feature, from infinity to the nearest range, as camera 1 sees it. Nothing is rectified;
/// the two cameras may differ in model, resolution and direction. Keeps its buffers: no allocation
/// after warm-up.
///
/// The search compares patches by normalised cross-correlation, a few pyramid levels above the
/// feature's. The best place is then refined on the feature's own level by alignment along the
/// curve, to sub-pixel accuracy. Where the patch shows enough, the match is where it would leave
/// the curve to: what the two cameras' calibration says wrong is seen there.
class StereoSearch {
 public:
  /// rig: two cameras, some distance apart; else InputError.
  StereoSearch(const Rig& rig, const StereoSettings& settings);

  /// features: the primary ones, with bearings, W and sizes. The result, in ascending order of the
  /// primary feature, stays valid until the next call.
  std::span<const StereoMatch> search(const Pyramid& image0,
                                      const Pyramid& image1,
                                      const Features& features);

 private:
  struct Candidate {
    std::uint32_t primary;
    int level1;        ///< Pyramid level in camera 1.
    double angle_rad;  ///< On the feature's epipolar curve.
    /// Of what is seen from the place on the curve, in pixels of level 0.
    Eigen::Vector2d off_curve = Eigen::Vector2d::Zero();
  };
  /// How camera 1 sees the surroundings of a feature: offsets in pixels of the feature's level in
  /// camera 0 to offsets in pixels of a level in camera 1 of about the same size.
  struct Warp {
    Eigen::Matrix2d level1_from_level0;
    int level1;
  };
  struct Images {
    const Pyramid& image0;
    const Pyramid& image1;
    const Features& features;
  };

  void start_in_the_middle(std::size_t num_features);
  /// Projects the candidates' points on their curves, with derivatives.
  void project_candidates();
  /// Replaces each candidate by what move(index) returns, or drops it.
  template <class Move>
  void move_candidates(Move move);
  std::optional<Warp> warp_at(const Images& images, std::size_t candidate) const;
  std::optional<Candidate> search_curve(const Images& images, std::size_t candidate);
  void sample_curve(std::uint32_t feature, int level1, ImageView image1);
  std::optional<Candidate> refine(const Images& images, std::size_t candidate) const;

  Rigid3 cam1_from_cam0_;
  std::shared_ptr<const Camera> camera1_;
  EpipolarCurves curves_;
  std::vector<Candidate> candidates_;
  // Of the candidates.
  std::vector<Eigen::Vector3d> directions_;
  std::vector<Eigen::Vector2d> pixels_;
  std::vector<Matrix23d> jacobians_;
  std::vector<std::uint8_t> is_visible_;
  // Along the curve that is being searched.
  std::vector<PatchCorner> corners_;
  std::vector<double> angles_;
  std::vector<float> correlations_;
  std::vector<StereoMatch> matches_;
};

}  // namespace waymark

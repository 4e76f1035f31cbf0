// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/features/stereo.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "waymark/base/check.h"

namespace waymark {
namespace {

/// The search compares patches that many levels above the feature's: a wider view for the same
/// work, which is more distinctive, and fewer steps. The alignment bridges the coarser step.
constexpr int kLevelsUp = 3;

constexpr float kMinSearchCorrelation = 0.6f;
constexpr float kMinAlignCorrelation = 0.8f;

/// A patch that would rather leave its curve by more than this shows something else.
constexpr double kMaxAcrossPx = 1.0;

/// Where a patch lies across its curve is measured if it tells at least this share of what it tells
/// of the place along it.
constexpr float kMinToldAcross = 0.5f;

/// Patches may be squeezed, in any direction, by this much at most.
constexpr double kMaxStretch = 2.0;

Rigid3 second_from_first(const Rig& rig) {
  if (rig.cameras.size() != 2) {
    throw InputError("rig",
                     "stereo search needs two cameras, got " + std::to_string(rig.cameras.size()));
  }
  const Rigid3 relative = rig.cameras[1].cam_from_rig * rig.cameras[0].cam_from_rig.inverse();
  if (!(relative.translation.norm() > 1e-6)) {
    throw InputError("rig",
                     "the two cameras of a stereo pair are at the same place, expected a "
                     "baseline above 0");
  }
  return relative;
}

Eigen::Vector2d to_level(const Eigen::Vector2d& pixel, int level) {
  return {Pyramid::level_from_level0(pixel.x(), level),
          Pyramid::level_from_level0(pixel.y(), level)};
}

Eigen::Vector2d center_in_level(const Keypoint& keypoint, int level) {
  return to_level({keypoint.x_px, keypoint.y_px}, level);
}

/// How far a patch that is aligned along its line would move if it were free to, in its pixels;
/// zero where it shows too little across the line, such as an edge.
Eigen::Vector2d off_curve(const AlignTemplate& patch, const Alignment& alignment) {
  const float along_per_across = -patch.along_across / patch.along_square;
  const float told_across = patch.across_square + along_per_across * patch.along_across;
  if (told_across < kMinToldAcross * patch.along_square) return Eigen::Vector2d::Zero();
  const Eigen::Vector2d across(-patch.direction.y(), patch.direction.x());
  return alignment.across_px * (across + double{along_per_across} * patch.direction);
}

int levels_up(int level0, int level1) {
  return std::min(kLevelsUp, Pyramid::kNumLevels - 1 - std::max(level0, level1));
}

}  // namespace

StereoSearch::StereoSearch(const Rig& rig, const StereoSettings& settings)
    : cam1_from_cam0_(second_from_first(rig)),
      camera1_(rig.cameras[1].camera),
      curves_(rig, settings.min_range_baselines * cam1_from_cam0_.translation.norm()) {}

std::span<const StereoMatch> StereoSearch::search(const Pyramid& image0,
                                                  const Pyramid& image1,
                                                  const Features& features) {
  const Images images{image0, image1, features};
  const std::size_t count = features.num_primary;
  WAYMARK_CHECK(features.bearings.size() >= count && features.size_rad.size() >= count);
  curves_.compute(std::span(features.bearings).first(count),
                  std::span(features.size_rad).first(count));
  start_in_the_middle(count);
  move_candidates([&](std::size_t i) { return search_curve(images, i); });
  move_candidates([&](std::size_t i) { return refine(images, i); });

  project_candidates();
  matches_.clear();
  for (std::size_t i = 0; i < candidates_.size(); ++i) {
    if (!is_visible_[i]) continue;
    const Candidate& candidate = candidates_[i];
    matches_.push_back({candidate.primary,
                        pixels_[i] + candidate.off_curve,
                        static_cast<std::uint8_t>(candidate.level1)});
  }
  return matches_;
}

/// Candidates at the middle of their curves; that is where the warp for the search is taken.
void StereoSearch::start_in_the_middle(std::size_t num_features) {
  candidates_.clear();
  for (std::size_t i = 0; i < num_features; ++i) {
    const std::span<const CurveNode> nodes = curves_.nodes(i);
    if (nodes.size() < 2) continue;
    candidates_.push_back({static_cast<std::uint32_t>(i), 0, nodes[nodes.size() / 2].angle_rad});
  }
}

void StereoSearch::project_candidates() {
  const std::size_t count = candidates_.size();
  directions_.resize(count);
  pixels_.resize(count);
  jacobians_.resize(count);
  is_visible_.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    directions_[i] = curves_.ray(candidates_[i].primary).direction(candidates_[i].angle_rad);
  }
  camera1_->project_with_jacobian(directions_, pixels_, jacobians_, is_visible_);
}

template <class Move>
void StereoSearch::move_candidates(Move move) {
  project_candidates();
  std::size_t num_kept = 0;
  for (std::size_t i = 0; i < candidates_.size(); ++i) {
    if (!is_visible_[i]) continue;
    const std::optional<Candidate> moved = move(i);
    if (moved) candidates_[num_kept++] = *moved;
  }
  candidates_.resize(num_kept);
}

/// The surface is taken to face the baseline squarely: its normal is the bearing, less what lies
/// along the baseline. For a parallel pair that makes a plain, unwarped patch.
std::optional<StereoSearch::Warp> StereoSearch::warp_at(const Images& images,
                                                        std::size_t candidate) const {
  const std::uint32_t feature = candidates_[candidate].primary;
  const EpipolarRay& ray = curves_.ray(feature);
  const Matrix23d w = images.features.level_pixel_from_bearing[feature].cast<double>();
  const Eigen::Matrix<double, 3, 2> bearing_from_level0 =
      w.transpose() * (w * w.transpose()).inverse();

  const Eigen::Vector3d baseline = cam1_from_cam0_.translation.normalized();
  Eigen::Vector3d normal = ray.infinity - ray.infinity.dot(baseline) * baseline;
  if (normal.squaredNorm() < 0.25) normal = ray.infinity;
  // In camera 1, at unit range from camera 0.
  Eigen::Matrix<double, 3, 2> point_from_level0 =
      cam1_from_cam0_.rotation_matrix() * bearing_from_level0;
  point_from_level0 -=
      ray.infinity * (normal.transpose() * point_from_level0) / normal.dot(ray.infinity);
  const double inverse_range = ray.inverse_range(candidates_[candidate].angle_rad);
  const double distance = (ray.infinity + inverse_range * cam1_from_cam0_.translation).norm();
  const Eigen::Matrix2d pixel_from_level0 = jacobians_[candidate] * point_from_level0 / distance;

  const double scale = std::sqrt(std::abs(pixel_from_level0.determinant()));
  if (!(scale > 0.0)) return std::nullopt;
  const long level1 = std::lround(std::log(scale) / std::log(Pyramid::kScaleFactor));
  Warp warp;
  warp.level1 = static_cast<int>(std::clamp<long>(level1, 0, Pyramid::kNumLevels - 1));
  warp.level1_from_level0 = pixel_from_level0 / Pyramid::scale(warp.level1);
  const double stretch = warp.level1_from_level0.norm() / std::sqrt(2.0);
  if (!(stretch < kMaxStretch && warp.level1_from_level0.determinant() > 1.0 / kMaxStretch)) {
    return std::nullopt;
  }
  return warp;
}

std::optional<StereoSearch::Candidate> StereoSearch::search_curve(const Images& images,
                                                                  std::size_t candidate) {
  const std::uint32_t feature = candidates_[candidate].primary;
  const Keypoint& keypoint = images.features.keypoints[feature];
  const std::optional<Warp> warp = warp_at(images, candidate);
  if (!warp) return std::nullopt;
  const int up = levels_up(keypoint.level, warp->level1);
  const int level0 = keypoint.level + up;
  const std::optional<SearchPatch> patch =
      cut_search_patch(images.image0.level(level0),
                       {center_in_level(keypoint, level0), warp->level1_from_level0.inverse()});
  if (!patch) return std::nullopt;

  const ImageView image1 = images.image1.level(warp->level1 + up);
  sample_curve(feature, warp->level1 + up, image1);
  correlations_.resize(corners_.size());
  correlate(*patch, image1, corners_, correlations_);
  const auto best = std::max_element(correlations_.begin(), correlations_.end());
  if (best == correlations_.end() || *best < kMinSearchCorrelation) return std::nullopt;
  return Candidate{
      feature, warp->level1, angles_[static_cast<std::size_t>(best - correlations_.begin())]};
}

/// Places for the search patch along the curve of a feature, about one pixel of the level apart.
void StereoSearch::sample_curve(std::uint32_t feature, int level1, ImageView image1) {
  constexpr double kReach = 0.5 * (kSearchSize - 1);
  corners_.clear();
  angles_.clear();
  const std::span<const CurveNode> nodes = curves_.nodes(feature);
  for (std::size_t n = 0; n + 1 < nodes.size(); ++n) {
    const Eigen::Vector2d from = to_level(nodes[n].pixel, level1);
    const Eigen::Vector2d way = to_level(nodes[n + 1].pixel, level1) - from;
    const int num_steps = std::max(1, static_cast<int>(std::ceil(way.norm())));
    const bool is_last = n + 2 == nodes.size();
    for (int step = 0; step < num_steps + is_last; ++step) {
      const double share = static_cast<double>(step) / num_steps;
      const Eigen::Vector2d corner = from + share * way - Eigen::Vector2d::Constant(kReach);
      if (!(corner.minCoeff() > -0.5)) continue;
      // Not negative, so that truncation is floor.
      const PatchCorner rounded{static_cast<int>(corner.x() + 0.5),
                                static_cast<int>(corner.y() + 0.5)};
      if (rounded.x + kSearchSize > image1.width_px || rounded.y + kSearchSize > image1.height_px) {
        continue;
      }
      corners_.push_back(rounded);
      angles_.push_back(nodes[n].angle_rad + share * (nodes[n + 1].angle_rad - nodes[n].angle_rad));
    }
  }
}

std::optional<StereoSearch::Candidate> StereoSearch::refine(const Images& images,
                                                            std::size_t candidate) const {
  const Candidate& found = candidates_[candidate];
  const auto feature = found.primary;
  const double angle_rad = found.angle_rad;
  const Keypoint& keypoint = images.features.keypoints[feature];
  const std::optional<Warp> warp = warp_at(images, candidate);
  if (!warp) return std::nullopt;
  const Eigen::Vector2d level1_from_angle = jacobians_[candidate] *
                                            curves_.ray(feature).direction_derivative(angle_rad) /
                                            Pyramid::scale(warp->level1);
  const double level1_px_per_rad = level1_from_angle.norm();
  const std::optional<AlignTemplate> patch = cut_align_template(
      images.image0.level(keypoint.level),
      {center_in_level(keypoint, keypoint.level), warp->level1_from_level0.inverse()},
      level1_from_angle / level1_px_per_rad);
  if (!patch) return std::nullopt;
  const std::optional<Alignment> alignment =
      align(*patch, images.image1.level(warp->level1), to_level(pixels_[candidate], warp->level1));
  if (!alignment || alignment->correlation < kMinAlignCorrelation ||
      std::abs(alignment->across_px) > kMaxAcrossPx) {
    return std::nullopt;
  }
  return Candidate{feature,
                   warp->level1,
                   angle_rad + alignment->along_px / level1_px_per_rad,
                   Pyramid::scale(warp->level1) * off_curve(*patch, *alignment)};
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "waymark/camera/pixel_angles.h"
#include "waymark/camera/rig.h"
#include "waymark/match/landmark_set.h"
#include "waymark/match/nearest.h"

namespace waymark {

/// How far to look for a landmark and how alike it must be.
struct ProjectionOptions {
  double radius_px = 4.0;  ///< Search radius in pixels of the landmark's expected level.
  AppearanceOptions appearance{.max_distance = 64, .max_ratio = 0.85};
  /// Between the viewing direction and the known one (Mur-Artal et al. 2015, V.D).
  double min_direction_cos = 0.5;
};

/// Result per landmark of the set searched for.
struct ProjectionMatches {
  std::vector<std::uint32_t> features;   ///< Primary feature, or kNoFeature.
  std::vector<std::uint8_t> is_visible;  ///< 1 where it should have been seen.
  std::size_t num_matches = 0;
};

/// Finds landmarks among the primary features of a frame near where a pose puts them (guided
/// matching as in PTAM, Klein and Murray 2007). Expected scale and radius come from the landmark's
/// metric size, so that frames of different cameras compare. A point on an edge is found where the
/// nearest edge of that direction passes it, since its place along the edge is not told. Keeps its
/// buffers.
class ProjectionMatcher {
 public:
  /// rig: the one that sees the frame. One feature serves one landmark: the more similar one.
  /// Features with is_taken set (may be empty) are left alone. The result stays valid until the
  /// next call.
  const ProjectionMatches& match(const Rig& rig,
                                 const LandmarkSet& landmarks,
                                 const Features& features,
                                 std::span<const std::uint8_t> is_taken,
                                 const Rigid3& rig_from_world,
                                 const ProjectionOptions& options);

 private:
  void project(const LandmarkSet& landmarks,
               const Rigid3& rig_from_world,
               double min_direction_cos);
  /// Where points on edges have their edges; not where there are none to match.
  void project_edges(const LandmarkSet& landmarks,
                     const Features& features,
                     const Rigid3& rig_from_world);
  void match_edge(std::size_t landmark,
                  const LandmarkSet& landmarks,
                  const Features& features,
                  std::span<const std::uint8_t> is_taken,
                  double radius_px);
  void take(std::size_t landmark, std::uint32_t feature, std::uint16_t distance);
  void find_candidates(std::size_t landmark,
                       const LandmarkSet& landmarks,
                       const Features& features,
                       std::span<const std::uint8_t> is_taken,
                       double radius_px);
  void choose(std::size_t landmark,
              const LandmarkSet& landmarks,
              const Features& features,
              const ProjectionOptions& options);

  struct View {
    std::shared_ptr<const Camera> camera;
    PixelAngles pixel_angles;
  };

  void set_view(const Rig& rig);

  std::vector<View> views_;  ///< One per camera seen so far: there are few, but they alternate.
  Rigid3 cam_from_rig_;
  const View* view_ = nullptr;  ///< Of these, the one that sees the frame.
  ProjectionMatches matches_;
  std::vector<Eigen::Vector3d> points_in_cam_;
  std::vector<Eigen::Vector2d> pixels_;
  std::vector<std::uint32_t> edges_;        ///< Of the landmarks; in order.
  std::vector<Eigen::Vector2d> across_px_;  ///< Per landmark, unit; of edges_ only.
  std::vector<Eigen::Vector3d> beside_in_cam_;
  std::vector<Eigen::Vector2d> beside_px_;
  std::vector<std::uint8_t> is_beside_visible_;
  std::vector<std::uint32_t> candidates_;
  std::vector<std::uint16_t> distances_;
  std::vector<std::uint32_t> landmark_of_feature_;
  std::vector<std::uint16_t> distance_of_feature_;
};

}  // namespace waymark

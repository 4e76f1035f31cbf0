// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/triangulate_edges.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "waymark/features/feature_geometry.h"

namespace waymark {
namespace {

/// A point on an edge as camera 0 of its keyframe sees it.
struct SeenEdge {
  std::uint32_t feature;
  Eigen::Vector3d bearing;
  Eigen::Vector3d across;  ///< Unit, like `along` at a right angle to the bearing.
  Eigen::Vector3d along;
  double size_rad;
};

std::vector<SeenEdge> free_edges(const Keyframe& keyframe) {
  const Features& features = *keyframe.features;
  std::vector<SeenEdge> edges;
  for (std::size_t i = features.num_corners(); i < features.num_primary; ++i) {
    if (keyframe.landmarks[i].is_valid()) continue;
    const Eigen::Vector3d bearing = features.bearings[i].cast<double>();
    const Eigen::Vector3d across = edge_normal_in_cam(features, i);
    edges.push_back({static_cast<std::uint32_t>(i),
                     bearing,
                     across,
                     bearing.cross(across).normalized(),
                     features.size_rad[i]});
  }
  return edges;
}

Rigid3 camera_pose(const Keyframe& keyframe) {
  return keyframe.rig().cameras[0].cam_from_rig * keyframe.rig_from_world;
}

/// Where a point may be, by a neighbour.
struct Crossing {
  double inverse_range;
  double sigma;
  KeyframeId keyframe;
  std::uint32_t feature;
};

struct Neighbour {
  KeyframeId id;
  Rigid3 b_from_a;
  std::vector<SeenEdge> edges;
};

/// By the law of sines in the epipolar plane, angles measured from the baseline.
std::optional<Crossing> cross(const SeenEdge& a,
                              const Neighbour& neighbour,
                              const SeenEdge& b,
                              const EdgeOptions& options) {
  const Eigen::Matrix3d turn = neighbour.b_from_a.rotation_matrix();
  if ((turn * a.across).dot(b.across) < options.min_edge_cos) return std::nullopt;
  const Eigen::Vector3d ray_a = turn * a.bearing;
  const Eigen::Vector3d normal = neighbour.b_from_a.translation.cross(ray_a).normalized();
  const double sine = normal.dot(b.along);
  if (!(std::abs(sine) > options.min_edge_sine)) return std::nullopt;
  const double step = -normal.dot(b.bearing) / sine;
  if (std::abs(step) > options.reach_px * b.size_rad) return std::nullopt;
  const Eigen::Vector3d ray_b = (b.bearing + step * b.along).normalized();
  const double baseline = neighbour.b_from_a.translation.norm();
  // From the centre of a to that of b.
  const Eigen::Vector3d axis = -neighbour.b_from_a.translation / baseline;
  const auto angle = [&](const Eigen::Vector3d& ray) {
    return std::atan2(axis.cross(ray).norm(), axis.dot(ray));
  };
  const double angle_a = angle(ray_a);
  const double parallax = angle(ray_b) - angle_a;
  if (parallax < options.min_parallax_px * std::max(a.size_rad, b.size_rad)) return std::nullopt;
  const double sine_b = std::sin(angle_a + parallax);
  if (axis.cross(ray_a).dot(axis.cross(ray_b)) <= 0.0 || sine_b < options.min_baseline_sine)
    return std::nullopt;
  const double angle_sigma = options.sigma_px * std::hypot(a.size_rad, b.size_rad) / std::abs(sine);
  return Crossing{std::sin(parallax) / (baseline * sine_b),
                  angle_sigma * std::sin(angle_a) / (baseline * sine_b * sine_b),
                  neighbour.id,
                  b.feature};
}

/// The crossings, one per keyframe, that agree with one of them.
std::vector<Crossing> agreeing(const std::vector<Crossing>& all,
                               const Crossing& one,
                               double agreement_sigmas) {
  std::vector<Crossing> chosen;
  for (const Crossing& other : all) {
    const double off = std::abs(other.inverse_range - one.inverse_range);
    if (off > agreement_sigmas * std::hypot(one.sigma, other.sigma)) continue;
    const auto same = std::ranges::find(chosen, other.keyframe, &Crossing::keyframe);
    if (same == chosen.end()) {
      chosen.push_back(other);
    } else if (off < std::abs(same->inverse_range - one.inverse_range)) {
      *same = other;
    }
  }
  return chosen;
}

/// The largest set that agrees, if it is large enough and none that shares nothing comes near.
std::vector<Crossing> consensus(const std::vector<Crossing>& all, const EdgeOptions& options) {
  std::vector<std::vector<Crossing>> sets;
  for (const Crossing& one : all) sets.push_back(agreeing(all, one, options.agreement_sigmas));
  const auto best = std::ranges::max_element(sets, {}, &std::vector<Crossing>::size);
  if (best == sets.end() || best->size() < static_cast<std::size_t>(options.min_agreeing))
    return {};
  const auto centre = [&](const std::vector<Crossing>& set) {
    return all[static_cast<std::size_t>(&set - sets.data())];
  };
  for (const std::vector<Crossing>& rival : sets) {
    const Crossing a = centre(*best);
    const Crossing b = centre(rival);
    const bool is_apart = std::abs(a.inverse_range - b.inverse_range) >
                          2.0 * options.agreement_sigmas * std::hypot(a.sigma, b.sigma);
    if (is_apart && static_cast<double>(rival.size()) >
                        options.max_rival_ratio * static_cast<double>(best->size())) {
      return {};
    }
  }
  return std::move(*best);
}

double mean_inverse_range(const std::vector<Crossing>& set) {
  double sum = 0.0;
  double weights = 0.0;
  for (const Crossing& crossing : set) {
    const double weight = 1.0 / (crossing.sigma * crossing.sigma);
    sum += weight * crossing.inverse_range;
    weights += weight;
  }
  return sum / weights;
}

void add_edge_landmark(Map& map,
                       KeyframeId id,
                       const SeenEdge& edge,
                       std::vector<Crossing> seen,
                       std::size_t min_agreeing,
                       DirtyLandmarks& dirty) {
  const Keyframe& keyframe = map.keyframes().at(id);
  const Eigen::Vector3d point =
      camera_pose(keyframe).inverse() * (edge.bearing / mean_inverse_range(seen));
  std::erase_if(seen, [&](const Crossing& crossing) {
    return !agrees(map.keyframes().at(crossing.keyframe), crossing.feature, point);
  });
  if (seen.size() < min_agreeing) return;
  const LandmarkId landmark = map.add_landmark(keyframe.submap, point, id);
  map.observe(id, edge.feature, landmark);
  for (const Crossing& crossing : seen) map.observe(crossing.keyframe, crossing.feature, landmark);
  dirty.insert(landmark);
}

}  // namespace

void triangulate_edges(Map& map, KeyframeId id, DirtyLandmarks& dirty, const EdgeOptions& options) {
  const std::vector<SeenEdge> edges = free_edges(map.keyframes().at(id));
  if (edges.empty()) return;
  const Rigid3 a_from_world = camera_pose(map.keyframes().at(id));
  std::vector<Neighbour> neighbours;
  for (const KeyframeId other :
       strongest_neighbours(map, id, static_cast<std::size_t>(options.max_neighbours))) {
    const Keyframe& keyframe = map.keyframes().at(other);
    const Rigid3 b_from_a = camera_pose(keyframe) * a_from_world.inverse();
    if (b_from_a.translation.norm() > 0.0) {
      neighbours.push_back({other, b_from_a, free_edges(keyframe)});
    }
  }
  std::vector<Crossing> crossings;
  for (const SeenEdge& edge : edges) {
    crossings.clear();
    for (const Neighbour& neighbour : neighbours) {
      const std::vector<LandmarkId>& landmarks = map.keyframes().at(neighbour.id).landmarks;
      for (const SeenEdge& other : neighbour.edges) {
        if (landmarks[other.feature].is_valid()) continue;
        if (const auto crossing = cross(edge, neighbour, other, options))
          crossings.push_back(*crossing);
      }
    }
    const std::vector<Crossing> seen = consensus(crossings, options);
    if (!seen.empty())
      add_edge_landmark(map, id, edge, seen, static_cast<std::size_t>(options.min_agreeing), dirty);
  }
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/adjust_parts.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <span>
#include <utility>

namespace waymark {
namespace {

/// Of the keyframes before a cut, by pass.
constexpr std::array kShares = {0.5, 0.4};

struct KeyframePlace {
  Eigen::Vector3d position;
  KeyframeId keyframe;
};

using PlacesOfPart = std::span<KeyframePlace>;

void divide(PlacesOfPart part,
            std::size_t max_size,
            double share,
            std::vector<std::vector<KeyframeId>>& parts) {
  if (part.size() <= max_size) {
    std::vector<KeyframeId>& ids = parts.emplace_back();
    for (const KeyframePlace& placed : part) ids.push_back(placed.keyframe);
    std::sort(ids.begin(), ids.end());
    return;
  }
  Eigen::Vector3d low = part.front().position;
  Eigen::Vector3d high = low;
  for (const KeyframePlace& placed : part) {
    low = low.cwiseMin(placed.position);
    high = high.cwiseMax(placed.position);
  }
  Eigen::Index axis = 0;
  (high - low).maxCoeff(&axis);
  const auto num_before = static_cast<std::size_t>(share * static_cast<double>(part.size()));
  std::nth_element(part.begin(),
                   part.begin() + static_cast<std::ptrdiff_t>(num_before),
                   part.end(),
                   [axis](const KeyframePlace& a, const KeyframePlace& b) {
                     return std::pair(a.position[axis], a.keyframe) <
                            std::pair(b.position[axis], b.keyframe);
                   });
  divide(part.first(num_before), max_size, share, parts);
  divide(part.subspan(num_before), max_size, share, parts);
}

/// Keyframes of a part that move, what they see of the window, and who else sees that.
BundleWindow window_of(const Map& map,
                       const BundleWindow& all,
                       const std::vector<KeyframeId>& part) {
  BundleWindow window;
  std::ranges::set_intersection(part, all.moving, std::back_inserter(window.moving));
  for (const KeyframeId id : part) {
    for (const LandmarkId landmark : map.keyframes().at(id).landmarks) {
      if (landmark.is_valid()) window.landmarks.push_back(landmark);
    }
  }
  std::sort(window.landmarks.begin(), window.landmarks.end());
  const auto rest = std::unique(window.landmarks.begin(), window.landmarks.end());
  window.landmarks.erase(rest, window.landmarks.end());
  std::vector<KeyframeId> seers;
  for (const LandmarkId id : window.landmarks) {
    for (const Observation& observation : map.landmarks().at(id).observations) {
      if (seers.empty() || seers.back() != observation.keyframe) {
        seers.push_back(observation.keyframe);
      }
    }
  }
  std::sort(seers.begin(), seers.end());
  seers.erase(std::unique(seers.begin(), seers.end()), seers.end());
  std::ranges::set_difference(seers, window.moving, std::back_inserter(window.fixed));
  return window;
}

/// Everything of a window as the map has it.
MapCorrection as_mapped(const Map& map, const BundleWindow& window) {
  MapCorrection places;
  places.keyframes.reserve(window.moving.size());
  places.landmarks.reserve(window.landmarks.size());
  for (const KeyframeId id : window.moving) {
    places.keyframes.push_back({id, map.keyframes().at(id).rig_from_world});
  }
  for (const LandmarkId id : window.landmarks) {
    places.landmarks.push_back({id, map.landmarks().at(id).position_in_world});
  }
  return places;
}

void update(MapCorrection& places, const MapCorrection& moved) {
  for (const auto& move : moved.keyframes) *places.find(move.keyframe) = move;
  for (const auto& move : moved.landmarks) *places.find(move.landmark) = move;
}

}  // namespace

std::vector<std::vector<KeyframeId>> divide_by_place(const Map& map,
                                                     std::vector<KeyframeId> keyframes,
                                                     std::size_t max_size,
                                                     double share) {
  std::vector<KeyframePlace> placed;
  for (const KeyframeId id : keyframes) {
    placed.push_back({map.keyframes().at(id).rig_from_world.origin_in_source(), id});
  }
  std::vector<std::vector<KeyframeId>> parts;
  if (!placed.empty()) divide(placed, max_size, share, parts);
  return parts;
}

WindowAdjustment compute_adjustment_in_parts(const Map& map,
                                             const BundleWindow& window,
                                             const BundleOptions& options,
                                             std::size_t max_size) {
  WindowAdjustment result{as_mapped(map, window), {}};
  std::vector<KeyframeId> keyframes;
  std::ranges::set_union(window.moving, window.fixed, std::back_inserter(keyframes));
  for (const double share : kShares) {
    result.outliers.clear();
    for (const auto& part : divide_by_place(map, keyframes, max_size, share)) {
      const BundleWindow of_part = window_of(map, window, part);
      if (of_part.moving.empty() || of_part.landmarks.empty()) continue;
      const WindowAdjustment found =
          compute_adjustment(map, of_part, options, nullptr, &result.correction);
      update(result.correction, found.correction);
      std::ranges::copy_if(
          found.outliers, std::back_inserter(result.outliers), [&](const Observation& outlier) {
            return std::ranges::binary_search(part, outlier.keyframe);
          });
    }
  }
  return result;
}

}  // namespace waymark

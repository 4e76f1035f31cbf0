// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "waymark/map/map.h"

namespace waymark {

/// What lies beside a keyframe though the map does not know that they show the same.
struct SpatialNeighbourOptions {
  int num_known_steps = 1;  ///< Keyframes so near in the covisibility graph are known.
  double distance = 0.0;    ///< Between the rigs, in parts of the median depth of the scene.
  double angle_rad = 0.0;   ///< Of the rotation between them.
};

/// Keyframes of the same sub-map beside the query where the map has it, nearest first. Looks at all
/// keyframes: what the quicker ways below are held against.
std::vector<KeyframeId> find_spatial_neighbours(const Map& map,
                                                KeyframeId query,
                                                const SpatialNeighbourOptions& options);

/// Where the keyframes of a map are, kept up to date as it changes, for a question now and then.
class LivePositions {
 public:
  /// The same as waymark::find_spatial_neighbours(), in a time that follows what has changed since.
  std::vector<KeyframeId> find_spatial_neighbours(const Map& map,
                                                  KeyframeId query,
                                                  const SpatialNeighbourOptions& options);
  /// Notes the positions of a state of the map, from which on changes are looked for.
  void follow(std::shared_ptr<const Map> frozen) {
    catch_up(*frozen);
    followed_ = std::move(frozen);
  }

 private:
  void catch_up(const Map& map);

  std::shared_ptr<const Map> followed_;
  /// By value of the id; of those erased where they were, of others that are none not a number.
  std::vector<Eigen::Vector3d> positions_;
};

/// Where the keyframes of a map are, for many questions: a tree that halves them again and again
/// (Bentley 1975), so that an answer takes a time that follows what lies near.
class KeyframePositions {
 public:
  explicit KeyframePositions(const Map& map);

  /// The same as waymark::find_spatial_neighbours(), as long as no keyframe has moved or come
  /// since; erased ones are passed over.
  std::vector<KeyframeId> find_spatial_neighbours(const Map& map,
                                                  KeyframeId query,
                                                  const SpatialNeighbourOptions& options) const;

 private:
  struct Entry {
    Eigen::Vector3d position;
    KeyframeId keyframe;
    std::uint8_t axis = 0;  ///< Along which it halves its part.
  };

  void halve(std::size_t begin, std::size_t end);
  void list_within(std::size_t begin,
                   std::size_t end,
                   const Eigen::Vector3d& centre,
                   double radius,
                   std::vector<KeyframeId>& ids) const;

  std::vector<Entry> entries_;  ///< What halves a part is in its middle.
};

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/loop/spatial_neighbours.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "waymark/loop/drift.h"
#include "waymark/loop/find.h"

namespace waymark {
namespace {

/// Parts of so few are looked through.
constexpr std::size_t kSmallPart = 8;
/// Of a radius, for what rounding does to distances.
constexpr double kRoundingMargin = 1e-6;

double margin_around(const Eigen::Vector3d& centre, double radius) {
  return kRoundingMargin * (radius + centre.cwiseAbs().maxCoeff());
}

/// Tells what lies beside one keyframe.
class BesideJudge {
 public:
  BesideJudge(const Map& map, KeyframeId query, const SpatialNeighbourOptions& options)
      : here_(map.keyframes().at(query)),
        options_(options),
        depth_(median_depth(map, query)),
        known_(within_steps(map, query, options.num_known_steps)) {}

  Eigen::Vector3d centre() const { return here_.rig_from_world.origin_in_source(); }
  double radius() const { return options_.distance * depth_; }

  /// Takes keyframes in ascending order.
  void judge(KeyframeId id, const Keyframe& other) {
    if (other.submap != here_.submap || std::ranges::binary_search(known_, id)) return;
    const Rigid3 here_from_other = here_.rig_from_world * other.rig_from_world.inverse();
    const double distance = here_from_other.translation.norm() / depth_;
    if (distance >= options_.distance) return;
    const double angle = Eigen::AngleAxisd(here_from_other.rotation).angle();
    if (angle >= options_.angle_rad) return;
    found_.push_back({distance + angle, id});
  }

  /// Nearest first.
  std::vector<KeyframeId> take() {
    std::ranges::stable_sort(found_, {}, &Beside::distance);
    std::vector<KeyframeId> ids;
    for (const Beside& beside : found_) ids.push_back(beside.keyframe);
    return ids;
  }

 private:
  struct Beside {
    double distance;
    KeyframeId keyframe;
  };

  const Keyframe& here_;
  const SpatialNeighbourOptions& options_;
  double depth_;
  std::vector<KeyframeId> known_;
  std::vector<Beside> found_;
};

}  // namespace

std::vector<KeyframeId> find_spatial_neighbours(const Map& map,
                                                KeyframeId query,
                                                const SpatialNeighbourOptions& options) {
  BesideJudge judge(map, query, options);
  map.keyframes().for_each([&](KeyframeId id, const Keyframe& other) { judge.judge(id, other); });
  return judge.take();
}

void LivePositions::catch_up(const Map& map) {
  positions_.resize(map.keyframes().end_id().value,
                    Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()));
  const auto note = [&](KeyframeId id, const Keyframe*, const Keyframe* now) {
    if (now) positions_[id.value] = now->rig_from_world.origin_in_source();
  };
  map.keyframes().for_each_difference(followed_ ? followed_->keyframes() : Map().keyframes(), note);
}

std::vector<KeyframeId> LivePositions::find_spatial_neighbours(
    const Map& map, KeyframeId query, const SpatialNeighbourOptions& options) {
  catch_up(map);
  BesideJudge judge(map, query, options);
  const Eigen::Vector3d centre = judge.centre();
  const double radius = judge.radius() + margin_around(centre, judge.radius());
  for (std::uint32_t i = 0; i < positions_.size(); ++i) {
    if (!((positions_[i] - centre).squaredNorm() <= radius * radius)) continue;
    if (const Keyframe* other = map.keyframes().find(KeyframeId{i}))
      judge.judge(KeyframeId{i}, *other);
  }
  return judge.take();
}

KeyframePositions::KeyframePositions(const Map& map) {
  entries_.reserve(map.keyframes().size());
  map.keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    entries_.push_back({keyframe.rig_from_world.origin_in_source(), id});
  });
  halve(0, entries_.size());
}

/// Along the axis in which the part extends furthest.
void KeyframePositions::halve(std::size_t begin, std::size_t end) {
  if (end - begin <= kSmallPart) return;
  Eigen::Vector3d low = entries_[begin].position;
  Eigen::Vector3d high = low;
  for (std::size_t i = begin; i < end; ++i) {
    low = low.cwiseMin(entries_[i].position);
    high = high.cwiseMax(entries_[i].position);
  }
  Eigen::Index axis = 0;
  (high - low).maxCoeff(&axis);
  const std::size_t middle = begin + (end - begin) / 2;
  const auto at = [&](std::size_t i) { return entries_.begin() + static_cast<std::ptrdiff_t>(i); };
  std::nth_element(at(begin), at(middle), at(end), [axis](const Entry& a, const Entry& b) {
    return a.position[axis] < b.position[axis];
  });
  entries_[middle].axis = static_cast<std::uint8_t>(axis);
  halve(begin, middle);
  halve(middle + 1, end);
}

void KeyframePositions::list_within(std::size_t begin,
                                    std::size_t end,
                                    const Eigen::Vector3d& centre,
                                    double radius,
                                    std::vector<KeyframeId>& ids) const {
  if (end - begin <= kSmallPart) {
    for (std::size_t i = begin; i < end; ++i) ids.push_back(entries_[i].keyframe);
    return;
  }
  const std::size_t middle = begin + (end - begin) / 2;
  const Entry& entry = entries_[middle];
  const double off = centre[entry.axis] - entry.position[entry.axis];
  ids.push_back(entry.keyframe);
  if (off <= radius) list_within(begin, middle, centre, radius, ids);
  if (off >= -radius) list_within(middle + 1, end, centre, radius, ids);
}

std::vector<KeyframeId> KeyframePositions::find_spatial_neighbours(
    const Map& map, KeyframeId query, const SpatialNeighbourOptions& options) const {
  BesideJudge judge(map, query, options);
  const Eigen::Vector3d centre = judge.centre();
  std::vector<KeyframeId> near;
  list_within(
      0, entries_.size(), centre, judge.radius() + margin_around(centre, judge.radius()), near);
  std::sort(near.begin(), near.end());
  for (const KeyframeId id : near) {
    if (const Keyframe* other = map.keyframes().find(id)) judge.judge(id, *other);
  }
  return judge.take();
}

}  // namespace waymark

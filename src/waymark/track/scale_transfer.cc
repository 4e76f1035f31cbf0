// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/track/scale_transfer.h"

#include "waymark/base/median.h"
#include "waymark/track/last_frame.h"

namespace waymark {
namespace {

/// The speed before is that of so many steps from keyframe to keyframe, in the median.
constexpr std::size_t kNumSpeedSteps = 3;
/// Who moved less, as a part of the distance of what is seen, may as well have stood still.
constexpr double kLeastMotion = 0.01;

struct KeyframeStep {
  double length = 0.0;
  double seconds = 0.0;
};

template <class Posed>
KeyframeStep step_between(const Posed& one, const Posed& other) {
  const Eigen::Vector3d moved =
      other.rig_from_world.origin_in_source() - one.rig_from_world.origin_in_source();
  return {moved.norm(), 1e-9 * static_cast<double>(other.timestamp_ns - one.timestamp_ns)};
}

/// The newest one of the same sub-map that is older; invalid where there is none.
KeyframeId keyframe_before(const Map& map, KeyframeId id) {
  const SubmapId submap = map.keyframes().at(id).submap;
  while (id.value-- > 0) {
    const Keyframe* const keyframe = map.keyframes().find(id);
    if (keyframe && keyframe->submap == submap) return id;
  }
  return {};
}

}  // namespace

std::optional<double> scale_by_speed(const Map& map, KeyframeId last, const NewSubmap& start) {
  if (start.keyframes.size() < 2) return std::nullopt;
  std::vector<double> speeds;
  double in_distances = 0.0;  // How far it went, as a part of the distance of what it saw.
  KeyframeId id = last;
  while (speeds.size() < kNumSpeedSteps) {
    const KeyframeId before = keyframe_before(map, id);
    if (!before.is_valid()) break;
    const Keyframe& keyframe = map.keyframes().at(id);
    const KeyframeStep step = step_between(map.keyframes().at(before), keyframe);
    if (!(step.seconds > 0.0)) break;
    speeds.push_back(step.length / step.seconds);
    in_distances +=
        step.length * median_inverse_range(map, keyframe.rig_from_world, keyframe.landmarks);
    id = before;
  }
  const KeyframeStep after = step_between(start.keyframes.front(), start.keyframes.back());
  if (in_distances < kLeastMotion || !(after.length > 0.0)) return std::nullopt;
  const double speed_after = after.length / after.seconds;
  return median(speeds) / speed_after;
}

void scale_by(double factor, Initialization& start) {
  start.rig_from_world.translation *= factor;
  for (InitialKeyframe& keyframe : start.submap.keyframes) {
    keyframe.rig_from_world.translation *= factor;
  }
  for (InitialLandmark& landmark : start.submap.landmarks) landmark.position_in_world *= factor;
  for (FilledPose& filled : start.filled) filled.pose.rig_from_reference.translation *= factor;
}

void ScaleTransfer::keep(const Map& map, KeyframeId last, Initialization& start) {
  const std::optional<double> scale = scale_by_speed(map, last, start.submap);
  if (!scale) return;
  scale_by(*scale, start);
  kept_.push_back({SubmapId{static_cast<std::uint32_t>(map.submaps().size())},
                   map.keyframes().at(last).submap});
}

std::vector<TransferredScale> ScaleTransfer::kept_in(const Map& map) const {
  std::vector<TransferredScale> found;
  for (TransferredScale kept : kept_) {
    if (kept.submap.value >= map.submaps().size()) continue;
    kept.submap = map.resolve(kept.submap);
    kept.before = map.resolve(kept.before);
    const bool is_metric = map.submaps()[kept.submap.value].is_metric;
    if (kept.submap != kept.before && !is_metric) found.push_back(kept);
  }
  return found;
}

}  // namespace waymark

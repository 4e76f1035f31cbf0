// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/system/inertial_join.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <vector>

#include "waymark/geometry/sim3.h"
#include "waymark/map/align.h"
#include "waymark/system/trajectory.h"

namespace waymark {
namespace {

/// Squared difference of two velocities in standard deviations, of three components.
constexpr double kMaxVelocityError = 30.0;
/// What velocities are off by in m/s that nothing states.
constexpr double kVelocityFloor = 0.05;

/// So many poses on either side tell how two parts lie to each other.
constexpr std::size_t kMaxAtBorder = 60;

/// Of the frames of a part, from one on, forward (step 1) or back (-1): a few dozen of ten seconds.
/// In the order of time.
std::vector<VisionPose> poses_beside(std::span<const TrajectoryFrame> frames,
                                     std::size_t from,
                                     int step) {
  const auto at = [&](std::size_t i) -> const TrajectoryFrame& {
    return frames[step > 0 ? from + i : from - i];
  };
  const std::size_t num_left = step > 0 ? frames.size() - from : from + 1;
  std::size_t count = 1;
  while (count < num_left && at(count).submap == at(0).submap &&
         std::abs(at(count).timestamp_ns - at(0).timestamp_ns) < kMaxBridgedNs) {
    ++count;
  }
  std::vector<VisionPose> poses;
  for (std::size_t i = 0; i < count; i += 1 + count / kMaxAtBorder) {
    poses.push_back({at(i).timestamp_ns, at(i).world_from_rig.inverse()});
  }
  if (step < 0) std::ranges::reverse(poses);
  return poses;
}

/// The state of the earlier part carried on to the first pose of the later one.
std::optional<InertialEstimate> carry_on(const InertialKnowledge& earlier,
                                         const InertialStart& start,
                                         std::int64_t begin_ns,
                                         std::int64_t end_ns) {
  const auto shift_ns = static_cast<std::int64_t>(std::llround(1e9 * start.time_shift_s));
  auto carried = predict({start.states.back(), start.covariance()},
                         earlier.samples,
                         begin_ns + shift_ns,
                         end_ns + shift_ns,
                         earlier.noise,
                         start.setup);
  if (!carried || !is_sure(earlier, carried->covariance)) return std::nullopt;
  return carried;
}

/// How two parts lie to each other: earlier_from_later, by what the IMU measured between, and the
/// scale of each. Nothing where that is not sure (is_sure()), or where velocities before and after
/// do not fit each other.
std::optional<Sim3> join_by_imu(const InertialKnowledge& earlier,
                                std::span<const VisionPose> earlier_poses,
                                const InertialKnowledge& later,
                                std::span<const VisionPose> later_poses) {
  const auto before = start_again(earlier, earlier_poses);
  const auto after = start_again(later, later_poses);
  if (!before || !after || before->is_contradicted() || after->is_contradicted()) return {};
  if (std::max(before->sigma(kLogScaleAt), after->sigma(kLogScaleAt)) > kFirmScale) return {};
  const std::int64_t begin_ns = earlier_poses.back().timestamp_ns;
  const std::int64_t end_ns = later_poses.front().timestamp_ns;
  const auto carried = carry_on(earlier, *before, begin_ns, end_ns);
  if (!carried) return std::nullopt;

  const InertialState& found = after->states.front();
  const Rigid3& rig_from_earlier = carried->state.rig_from_world;
  const Eigen::Quaterniond rotation =
      rig_from_earlier.rotation.conjugate() * found.rig_from_world.rotation;
  const Eigen::Vector3d missing = rotation * found.velocity - carried->state.velocity;
  const Eigen::Matrix3d turned = rotation.toRotationMatrix();
  const Eigen::Matrix3d covariance =
      carried->covariance.block<3, 3>(kStateAt + 6, kStateAt + 6) +
      turned * after->covariances.front().block<3, 3>(kStateAt + 6, kStateAt + 6) *
          turned.transpose() +
      kVelocityFloor * kVelocityFloor * Eigen::Matrix3d::Identity();
  if (missing.dot(covariance.llt().solve(missing)) > kMaxVelocityError) return std::nullopt;

  // An acceleration that is wrong all the way explains the velocity that is missing at its end.
  const double metres_per_unit = std::exp(before->setup.log_scale);
  const Eigen::Vector3d place =
      rig_from_earlier.origin_in_source() +
      0.5e-9 * static_cast<double>(end_ns - begin_ns) * missing / metres_per_unit;
  const double scale = std::exp(after->setup.log_scale) / metres_per_unit;
  const Eigen::Vector3d origin = found.rig_from_world.origin_in_source();
  return Sim3(rotation, place - scale * (rotation * origin), scale);
}

}  // namespace

bool join_parts(const TrajectoryMemory& memory,
                const std::function<InertialKnowledge(SubmapId)>& known,
                std::shared_ptr<const Map>& map) {
  std::vector<TrajectoryFrame> frames = list_poses(memory, *map);
  std::erase_if(frames, [&](const TrajectoryFrame& frame) {
    return !memory.entries()[frame.frame.value].is_seen();
  });
  for (std::size_t i = 1; i < frames.size(); ++i) {
    const SubmapId before = frames[i - 1].submap, after = frames[i].submap;
    if (before == after) continue;
    if (frames[i].timestamp_ns - frames[i - 1].timestamp_ns > kMaxBridgedNs) continue;
    const auto placed = join_by_imu(
        known(before), poses_beside(frames, i - 1, -1), known(after), poses_beside(frames, i, 1));
    if (!placed) continue;
    const auto keyframe = [&](std::size_t at) {
      return map->resolve(memory.entries()[frames[at].frame.value].pose().reference);
    };
    Map joined = Map::thaw(*map);
    if (before < after) {
      transform_submap(joined, after, *placed);
      joined.join_submaps(keyframe(i), keyframe(i - 1));
    } else {
      transform_submap(joined, before, placed->inverse());
      joined.join_submaps(keyframe(i - 1), keyframe(i));
    }
    map = joined.freeze();
    return true;
  }
  return false;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "waymark/imu/imu_samples.h"
#include "waymark/imu/inertial_path.h"
#include "waymark/imu/inertial_start.h"
#include "waymark/map/map.h"
#include "waymark/system/dead_reckoning.h"
#include "waymark/system/system.h"
#include "waymark/track/trajectory_memory.h"

namespace waymark {

/// What an IMU adds to a session: from the poses that vision gave and what the IMU measured between
/// them it finds the unit of length, the direction of gravity, biases, and where and when the IMU
/// is (start_inertial()). Anew as the way grows, and once more of the whole; an IMU that vision
/// contradicts is left out.
class InertialEstimator {
 public:
  /// Of the samples to come: what is known of their IMU. What it does not tell stays as told
  /// before.
  void set_calibration(const ImuCalibration& told);
  void add(const ImuSample& sample) { samples_.add(sample); }
  /// Samples per second of late; nothing before there are two.
  std::optional<double> rate_hz() const;
  bool has_samples() const { return samples_.all().size() > 2; }

  /// The same IMU, of a session that begins anew.
  InertialEstimator begin_anew() const;

  /// Looks at the way so far, if it has grown enough since the last time. Gives once what puts the
  /// map into metres, level, where these are known well.
  std::optional<SubmapPlacement> update(const TrajectoryMemory& memory, const Map& map);

  /// The map that is seen from this frame on was put there.
  void note_placement(const SubmapPlacement& placement, FrameId frame);

  /// How the rig turned from one image to another by the gyroscope: rig_end_from_rig_begin. Nothing
  /// before that is known well, and where samples are missing.
  std::optional<Eigen::Quaterniond> turn(std::int64_t begin_ns, std::int64_t end_ns) const;

  /// Whether the gyroscope contradicts that the rig turned so from one image to another, by more
  /// than poses err. Before it is known well by its mounting as told, and a bias of up to
  /// largest_bias, in rad/s; never where none is told.
  bool contradicts_turn(std::int64_t begin_ns,
                        std::int64_t end_ns,
                        const Eigen::Quaterniond& rig_end_from_rig_begin,
                        double largest_bias) const;

  /// Whether samples show nothing but noise for a while up to this moment.
  bool is_at_rest(std::int64_t timestamp_ns) const;

  /// How the rig turns about a moment by the gyroscope, as RigMotion has it; where turn() tells it.
  std::optional<Eigen::Vector3f> turn_rad_s(std::int64_t timestamp_ns) const;

  /// How the rig moved since the newest frame that has a pose. Nothing where that is not told well
  /// enough.
  std::optional<ReckonedPose> dead_reckon(const TrajectoryMemory& memory,
                                          const Map& map,
                                          std::int64_t timestamp_ns);

  /// Joins parts of the map between which it tells the way, and adjusts the largest one with what
  /// was measured between its keyframes. Gives the same map where that is not known well, and where
  /// it contradicts the images.
  std::shared_ptr<const Map> adjust(const TrajectoryMemory& memory, std::shared_ptr<const Map> map);

  /// Looks at the whole way, and gives frames without a pose those that the IMU tells.
  /// is_frame_free: the map was begun in this session and no marker says where it is. Gives the map
  /// with its largest part level (z up), and in metres where these are told; the same map where
  /// nothing is.
  std::shared_ptr<const Map> finish(TrajectoryMemory& memory,
                                    std::shared_ptr<const Map> map,
                                    bool is_frame_free);

  /// Empty without samples.
  const std::optional<InertialReport>& report() const { return report_; }

  /// The frames of the largest part, after finish(); empty where lengths in metres are not told.
  const std::vector<NavigationState>& path() const { return path_; }
  /// The same at the rate of the samples.
  std::vector<NavigationState> path_at_imu_rate() const;

 private:
  /// The same.
  InertialKnowledge knowledge() const;
  InertialKnowledge knowledge_of(SubmapId submap, const Map& map) const;
  void place_other_parts(const TrajectoryMemory& memory, const Map& map, Map& placed) const;
  /// Whether all but the states is known well.
  bool is_firm() const;
  void move_path(const Sim3& new_from_old);
  /// As turn() has it, by an IMU that is mounted and biased so.
  std::optional<Eigen::Quaterniond> turn_by(const Eigen::Quaterniond& imu_from_rig,
                                            double time_shift_s,
                                            const ImuBiases& biases,
                                            std::int64_t begin_ns,
                                            std::int64_t end_ns) const;
  SubmapId look_at_largest(const TrajectoryMemory& memory, const Map& map);
  void look(std::span<const VisionPose> poses, SubmapId submap, const Map& map);

  ImuCalibration told_;
  ImuSamples samples_;
  std::optional<InertialStart> found_;  ///< Last, where vision and IMU agree.
  SubmapId found_in_;
  ImuNoise noise_;
  InertialStartOptions options_;            ///< That it was found with.
  std::optional<DeadReckoning> reckoning_;  ///< From the newest frame that had a pose when asked.
  std::optional<InertialReport> report_;
  std::vector<NavigationState> path_;
  bool is_placement_sent_ = false;
  std::optional<FrameId> metric_from_;
  SubmapId metric_submap_;
  std::size_t next_look_ = 0;  ///< Number of frames.
};

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The whole pipeline: images in, poses and a map out.
//
//   System slam(rig, settings, Timing::kLockstep);
//   while (const std::optional<InputFrame> frame = input.next()) {
//     if (frame->fault != FrameFault::kNone) continue;
//     FrameImages moment;
//     moment.timestamp_ns = frame->timestamp_ns;
//     moment.image0 = frame->images[0].view();
//     const TrackingResult& result = slam.feed(moment);
//     if (result.world_from_rig) std::cout << result.world_from_rig->translation.transpose() <<
//     "\n";
//   }
//   slam.finish();
//   save_map("house.wmap", {slam.map(), settings_as_yaml(settings), {}});

#include <cstddef>
#include <cstdint>
#include <memory>
#include <memory_resource>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "waymark/base/timing.h"
#include "waymark/camera/calibration.h"
#include "waymark/camera/rig.h"
#include "waymark/image/image.h"
#include "waymark/imu/imu.h"
#include "waymark/imu/inertial_path.h"
#include "waymark/imu/inertial_report.h"
#include "waymark/map/map.h"
#include "waymark/marker/survey.h"
#include "waymark/system/settings.h"
#include "waymark/track/tracking_result.h"
#include "waymark/track/transferred_scale.h"

namespace waymark {

/// A frame in the final trajectory.
struct TrajectoryFrame {
  FrameId frame;                         ///< Of this session, from 0 on.
  std::int64_t timestamp_ns = 0;         ///< As it was fed.
  FrameState state = FrameState::kLost;  ///< kTracked or kFilled.
  SubmapId submap;                       ///< Whose frame the pose is in.
  Rigid3 world_from_rig;                 ///< In metres (map units for mono).
};

/// Totals of a session.
struct SystemStatistics {
  int num_keyframes = 0;           ///< Of the map.
  int num_landmarks = 0;           ///< Of the map.
  int num_submaps = 0;             ///< Those that were not joined.
  int num_loops = 0;               ///< Closed in the session.
  int num_relocalizations = 0;     ///< Of the session.
  std::vector<double> mapping_ms;  ///< One entry per keyframe.
};

/// What became of the markers that were looked for.
struct MarkerReport {
  std::string family;                   ///< As it was asked for; empty: none were looked for.
  std::vector<SurveyedMarker> markers;  ///< Of the sub-map with most keyframes, by number.
  std::optional<MarkerFrame> frame;     ///< Of the map, where they define one.
};

/// Visual SLAM on a stream of frames. One thread feeds; mapping runs beside it unless the timing is
/// kInline. kInline and kLockstep give the same bits; kRealtime never waits for the mapper, but for
/// a new sub-map, without which there is nothing to track in.
class System {
 public:
  /// Throws InputError for a rig or settings that cannot work together.
  ///
  /// map: one made before, that is to be extended, by whatever cameras; a copy goes on. The camera
  /// is looked for in it; where it is not found, a new sub-map begins, which is joined once it is.
  /// Their models must be known (see load_map()), else InputError.
  ///
  /// num_threads: that find features of frames before their turn, see prepare(); 0: none.
  System(Rig rig,
         const Settings& settings,
         Timing timing,
         std::shared_ptr<const Map> map = nullptr,
         unsigned num_threads = std::thread::hardware_concurrency());
  ~System();
  System(const System&) = delete;
  System& operator=(const System&) = delete;

  /// Tracks one frame; timestamps must increase. A map without scale takes no images with range:
  /// then the first frame throws InputError. Rethrows what failed in the mapper's thread. The
  /// result stays valid until the next call.
  const TrackingResult& feed(const FrameImages& images);

  /// What is known of the IMU whose samples come; before the first of them. Nothing need be; what
  /// this does not tell stays as it was told before.
  void set_imu(const ImuCalibration& calibration);
  /// One measurement of an IMU; times must increase, others are left out. Before or after the image
  /// of its time: a frame makes use of what was fed before it, the whole way of all.
  void feed_imu(const ImuSample& sample);
  /// What it told so far, nothing without samples. After finish(): final.
  const std::optional<InertialReport>& inertial() const;
  /// What it and vision tell together of the frames of the largest part of the map, after finish();
  /// empty where lengths are not known in metres. Its poses are those of trajectory().
  const std::vector<NavigationState>& inertial_path() const;
  /// The same at the rate of its samples.
  std::vector<NavigationState> inertial_path_at_imu_rate() const;
  /// Samples per second of late; nothing before there are two.
  std::optional<double> imu_rate_hz() const;

  /// Has other threads find the features of a frame that is fed later, while those before it are
  /// tracked: with the images of max_prepared() frames at hand all cores are busy. Only time
  /// depends on it. In the order in which they are fed; what is not fed is forgotten. owner keeps
  /// the images as long as they are looked at, and unchanged.
  void prepare(const FrameImages& images, std::shared_ptr<const void> owner);

  /// So many frames may be prepared at a time, others are left out; 0 unless the timing is
  /// kLockstep.
  std::size_t max_prepared() const;

  /// Of the frame fed last, as feed() gave it; empty before the first.
  const TrackingResult& result() const;

  /// Has the map keep what only searching and joining need (features, the index of places) in this
  /// memory, such as a DiskMemory. Before the first frame. No result depends on it.
  void keep_map_in(std::shared_ptr<std::pmr::memory_resource> memory);

  /// Mapping off: the camera is followed in the map, which stays as it is. On at first.
  void set_mapping(bool is_on);

  /// Begins anew with an empty map; frames count from 0 again. Not after finish().
  void reset();

  /// Ends the input: waits for outstanding mapping, refines globally. No feed() afterwards.
  void finish();

  /// Every frame that has a pose, in order, with what is known now. After finish(): final.
  std::vector<TrajectoryFrame> trajectory() const;

  /// State of every frame fed so far, including those filled in after the fact.
  std::vector<FrameState> frame_states() const;

  /// In mono: parts of the map that began after a loss with the unit of length of another part.
  /// Those that were joined to it meanwhile are not among them.
  std::vector<TransferredScale> kept_scales() const;

  /// The cameras as they are calibrated by now.
  std::shared_ptr<const Rig> rig() const;

  /// What the images told of the calibration up to the map that map() gives; empty as long as they
  /// did not contradict it. After finish(): final.
  std::vector<CalibrationEstimate> calibration() const;

  /// What was found to move along with camera 0 by now: 0 there, else 255, in the size of its
  /// image; empty while nothing was.
  Image ego_mask() const;

  /// What became of the markers that were looked for. Empty before finish().
  MarkerReport markers() const;

  /// The newest finished map, immutable.
  std::shared_ptr<const Map> map() const;

  /// Totals up to the map that map() gives; of the tracker up to the frame fed last. After
  /// finish(): final.
  SystemStatistics statistics() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Rendered images with their truth.
//
//   SequenceSpec spec;
//   CameraDescription camera;
//   camera.camera_model = "pinhole";
//   camera.intrinsics = {400.0, 400.0, 320.0, 240.0};
//   camera.width_px = 640;
//   camera.height_px = 480;
//   spec.chain = mono_chain(camera);
//   spec.world = "room";
//   spec.num_frames = 100;
//   SimulatedSequence sequence(spec);
//   for (int i = 0; i < sequence.num_frames(); ++i) {
//     const SimulatedFrame frame = sequence.frame(i);
//     std::cout << frame.timestamp_ns << " " << frame.world_from_rig.translation.transpose() <<
//     "\n";
//   }

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "waymark/base/thread_pool.h"
#include "waymark/camera/camchain.h"
#include "waymark/marker/known_markers.h"
#include "waymark/simulate/calibration_error.h"
#include "waymark/simulate/imu_device.h"
#include "waymark/simulate/motion.h"
#include "waymark/simulate/render.h"
#include "waymark/simulate/stabilizer.h"
#include "waymark/simulate/stitch.h"

namespace waymark {

/// Other effects for the frames [first_frame, end_frame).
struct EffectSpan {
  int first_frame = 0;                               ///< Index of the first frame.
  int end_frame = 0;                                 ///< One past the last.
  ImageEffects effects;                              ///< In place of those of the sequence.
  std::optional<std::size_t> camera = std::nullopt;  ///< Of one camera alone; none: of all.
};

/// A sequence in words and numbers. The cameras may be of any model the registry knows; with a
/// depth_factor in the chain, camera 0 also measures depth.
struct SequenceSpec {
  std::string name;               ///< For people.
  std::string world = "room";     ///< See make_world().
  std::string motion = "loop";    ///< See make_motion().
  std::uint64_t seed = 0;         ///< Of the world's looks, the sway and the noise.
  CameraChain chain;              ///< One camera, two for stereo, or more.
  double rate_hz = 20.0;          ///< Frames per second.
  int num_frames = 200;           ///< Which also say how long the motion takes.
  ImageEffects effects;           ///< Of the frames that no span holds.
  std::vector<EffectSpan> spans;  ///< The first that holds a frame counts.
  int num_walkers = 0;            ///< People who cross the view at any time, see add_pedestrians().
  bool has_operator = false;      ///< Somebody carries the camera above the head: add_operator().
  int num_changes = 0;            ///< Things that are gone or open later, see add_changes().
  int num_markers = 0;            ///< Square markers on the walls, see add_markers().
  /// Rolling shutter: time from the first row to the last. A frame's time is that of its middle
  /// row; each row is as long exposed as a whole image otherwise.
  double readout_s = 0.0;
  /// Depth images are taken so much later than the other images, as their own times say.
  double depth_lag_s = 0.0;
  /// Each camera is exposed so much later than the one before it, as their own times say.
  double trigger_lag_s = 0.0;
  /// Distance between the two lenses, back to back, that images of a 360 degree camera are stitched
  /// from, see Stitch; the front lens is half of it ahead of the camera. 0: there is one centre.
  double stitched_m = 0.0;
  /// Electronic stabilisation: the largest shift of the picture relative to its width, see
  /// Stabilizer. The chain is that of the pictures, on the average. 0: none.
  double stabilised_share = 0.0;
  /// Gains of the images of camera 1 of a pair beside those of camera 0, in the first frame and in
  /// the last; linear in between.
  Eigen::Vector2d gain1 = Eigen::Vector2d::Ones();
  /// By how many pixels images of camera 1 of a pair are bent along and across the epipolar lines,
  /// see RectificationError.
  Eigen::Vector2d warped_px = Eigen::Vector2d::Zero();
  /// Bit rate of each camera's images in a data set, see VideoCompression. 0: as rendered.
  double compressed_kbit_per_s = 0.0;
  std::optional<ImuDevice> imu;  ///< Which is fixed to the rig; none: no samples.
  CalibrationError told;         ///< Of the calibration that data sets come with.
};

/// Chains of cameras for sequences.
CameraChain mono_chain(const CameraDescription& camera);
/// Two cameras; lengths in metres.
CameraChain stereo_chain(const CameraDescription& camera0,
                         const CameraDescription& camera1,
                         const Rigid3& cam1_from_cam0);
/// A camera that also measures depth, depth_factor units per metre.
CameraChain rgbd_chain(const CameraDescription& camera, double depth_factor);

/// A rendered frame and where the rig was.
struct SimulatedFrame {
  std::int64_t timestamp_ns = 0;                  ///< Frames are 1 / rate_hz apart.
  std::int64_t depth_timestamp_ns = 0;            ///< When the depth image was taken.
  std::vector<Image> images;                      ///< One per camera of the rig.
  std::vector<std::int64_t> image_timestamps_ns;  ///< When each was taken.
  DepthImage depth;                               ///< Registered to camera 0; empty without depth.
  Rigid3 world_from_rig;  ///< Truth at the middle of the exposure and of the rows.
};

/// Renders the frames of a spec, each from (seed, index) alone: in any order, with the same bits
/// for any number of threads. Not for use by several threads at a time.
class SimulatedSequence {
 public:
  /// Throws InputError for an unknown world, motion or camera model, for cameras that cannot be
  /// stitched or stabilised where that is asked for, and for one camera where a pair is needed.
  explicit SimulatedSequence(
      SequenceSpec spec,
      unsigned num_threads = 1,
      const CameraRegistry& registry = CameraRegistry::with_builtin_models());

  /// What was asked for.
  const SequenceSpec& spec() const { return spec_; }
  /// Its cameras.
  const Rig& rig() const { return rig_; }
  /// What they see.
  const World& world() const { return *world_; }
  /// The markers in it, with their true poses.
  const KnownMarkers& markers() const { return markers_; }
  /// That of the spec.
  int num_frames() const { return spec_.num_frames; }
  /// Time of a frame, without rendering it.
  std::int64_t timestamp_ns(int index) const;
  /// True pose of a frame, without rendering it.
  Rigid3 world_from_rig(int index) const;
  /// What the IMU of the spec measures, see record_imu(); nothing without one.
  std::vector<ImuSample> imu_samples() const;
  /// Renders a frame; index in [0, num_frames()).
  SimulatedFrame frame(int index);

 private:
  double seconds(int index, std::size_t camera = 0) const {
    return index / spec_.rate_hz + static_cast<double>(camera) * spec_.trigger_lag_s;
  }
  Rigid3 world_from_cam(std::size_t camera, double time_s) const;
  Image render(std::size_t camera, double time_s);
  Image render_from(std::size_t camera, double ahead_m, double time_s);
  void prepare_flaws(const CameraRegistry& registry);
  ImageEffects effects_of(std::size_t camera, int index) const;
  Image expose(std::size_t camera, int index, const ImageEffects& effects);

  SequenceSpec spec_;
  Rig rig_;
  Motion motion_;
  KnownMarkers markers_;
  std::shared_ptr<const World> world_;
  std::vector<Renderer> renderers_;
  std::vector<Stitch> stitches_;         ///< Per camera, or none.
  std::vector<Stabilizer> stabilizers_;  ///< Per camera, or none.
  std::unique_ptr<ThreadPool> pool_;
};

}  // namespace waymark

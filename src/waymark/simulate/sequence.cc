// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/sequence.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/simulate/changes.h"
#include "waymark/simulate/markers.h"
#include "waymark/simulate/operator.h"
#include "waymark/simulate/pedestrians.h"

namespace waymark {
namespace {

/// Motion blur is the mean of renderings no more than about a pixel apart, as seen at this
/// distance; of so many at most.
constexpr double kBlurDistanceM = 3.0;
constexpr int kMaxSubExposures = 9;

int num_sub_exposures(const Rigid3& begin, const Rigid3& end, double pixel_rad) {
  const double turn = begin.rotation.angularDistance(end.rotation);
  const double shift = (end.translation - begin.translation).norm() / kBlurDistanceM;
  const double blur_px = (turn + shift) / pixel_rad;
  return std::clamp(static_cast<int>(std::ceil(blur_px - 1e-6)), 1, kMaxSubExposures);
}

/// Streams of random numbers of a frame: one for each camera's image, one for depth.
constexpr std::uint64_t kStreamsPerFrame = 64;
constexpr std::uint64_t kDepthStream = kStreamsPerFrame - 1;

/// Sequences start some time after zero, as stamps of real ones do.
constexpr std::int64_t kFirstTimestampNs = 1'000'000'000;

std::uint64_t stream_of(int frame, std::uint64_t stream) {
  return static_cast<std::uint64_t>(frame) * kStreamsPerFrame + stream;
}

std::shared_ptr<const World> populated_world(const SequenceSpec& spec,
                                             const Motion& motion,
                                             KnownMarkers& markers) {
  std::shared_ptr<const World> world = make_world(spec.world, spec.seed);
  if (spec.num_walkers == 0 && spec.num_changes == 0 && !spec.has_operator &&
      spec.num_markers == 0) {
    return world;
  }
  auto populated = std::make_shared<World>(*world);
  markers = add_markers(spec.num_markers, motion, spec.seed, *populated);
  add_changes(spec.num_changes, motion, spec.seed, *populated);
  add_pedestrians(spec.num_walkers, motion, spec.seed, *populated);
  if (spec.has_operator) add_operator(motion, spec.seed, *populated);
  return populated;
}

void expect_pair(const Rig& rig, const char* option) {
  if (rig.cameras.size() < 2) {
    throw InputError(option, "there is one camera, expected a pair (--setup stereo)");
  }
}

}  // namespace

CameraChain mono_chain(const CameraDescription& camera) {
  return {.cameras = {{camera, Rigid3()}}, .depth_factor = {}, .notes = {}};
}

CameraChain stereo_chain(const CameraDescription& camera0,
                         const CameraDescription& camera1,
                         const Rigid3& cam1_from_cam0) {
  return {
      .cameras = {{camera0, Rigid3()}, {camera1, cam1_from_cam0}}, .depth_factor = {}, .notes = {}};
}

CameraChain rgbd_chain(const CameraDescription& camera, double depth_factor) {
  return {.cameras = {{camera, Rigid3()}}, .depth_factor = depth_factor, .notes = {}};
}

SimulatedSequence::SimulatedSequence(SequenceSpec spec,
                                     unsigned num_threads,
                                     const CameraRegistry& registry)
    : spec_(std::move(spec)),
      rig_(make_rig(spec_.chain, registry)),
      motion_(make_motion(spec_.world, spec_.motion, spec_.num_frames / spec_.rate_hz)),
      world_(populated_world(spec_, motion_, markers_)),
      pool_(std::make_unique<ThreadPool>(num_threads)) {
  WAYMARK_CHECK(spec_.num_frames > 0 && spec_.rate_hz > 0.0);
  WAYMARK_CHECK(spec_.readout_s >= 0.0 && spec_.depth_lag_s >= 0.0 && spec_.trigger_lag_s >= 0.0);
  WAYMARK_CHECK(!rig_.cameras.empty() && rig_.cameras.size() < kDepthStream);
  prepare_flaws(registry);
}

void SimulatedSequence::prepare_flaws(const CameraRegistry& registry) {
  CameraChain sensors = spec_.chain;
  for (std::size_t i = 0; i < rig_.cameras.size(); ++i) {
    const Camera& camera = *rig_.cameras[i].camera;
    if (spec_.stitched_m > 0.0) {
      if (camera.wrap_width_px() == 0.0) {
        throw InputError("--stitched", "the camera does not see all round, expected one that does");
      }
      stitches_.emplace_back(camera);
    }
    if (spec_.stabilised_share > 0.0) {
      CameraDescription& picture = sensors.cameras[i].description;
      stabilizers_.emplace_back(
          picture,
          [&](int frame) { return world_from_cam(i, seconds(frame, i)); },
          spec_.num_frames,
          spec_.rate_hz,
          spec_.stabilised_share);
      picture = sensor_of(std::move(picture), spec_.stabilised_share);
    }
  }
  if (!stabilizers_.empty() && spec_.chain.depth_factor) {
    throw InputError("--stabilised", "the camera measures depth, expected one that does not");
  }
  std::vector<RectificationError> errors(rig_.cameras.size());
  if (!spec_.gain1.isOnes(0.0)) expect_pair(rig_, "--gain");
  if (!spec_.warped_px.isZero(0.0)) {
    expect_pair(rig_, "--warped");
    errors[1] = RectificationError(rig_.cameras[1], spec_.warped_px, spec_.seed);
  }
  const Rig rig_of_sensors = make_rig(sensors, registry);
  for (std::size_t i = 0; i < errors.size(); ++i) {
    renderers_.emplace_back(world_, rig_of_sensors.cameras[i].camera, errors[i]);
  }
}

std::int64_t SimulatedSequence::timestamp_ns(int index) const {
  return kFirstTimestampNs + std::llround(1e9 * seconds(index));
}

Rigid3 SimulatedSequence::world_from_rig(int index) const {
  return motion_.world_from_rig(seconds(index));
}

std::vector<ImuSample> SimulatedSequence::imu_samples() const {
  if (!spec_.imu) return {};
  return record_imu(*spec_.imu, motion_, kFirstTimestampNs, spec_.seed);
}

ImageEffects SimulatedSequence::effects_of(std::size_t camera, int index) const {
  const auto span = std::ranges::find_if(spec_.spans, [&](const EffectSpan& each) {
    return index >= each.first_frame && index < each.end_frame &&
           each.camera.value_or(camera) == camera;
  });
  ImageEffects effects = span == spec_.spans.end() ? spec_.effects : span->effects;
  if (camera == 1) {
    const double share = static_cast<double>(index) / std::max(spec_.num_frames - 1, 1);
    effects.gain *= std::lerp(spec_.gain1[0], spec_.gain1[1], share);
  }
  return effects;
}

Rigid3 SimulatedSequence::world_from_cam(std::size_t camera, double time_s) const {
  return motion_.world_from_rig(time_s) * rig_.cameras[camera].cam_from_rig.inverse();
}

Image SimulatedSequence::render(std::size_t camera, double time_s) {
  if (stitches_.empty()) return render_from(camera, 0.0, time_s);
  const double ahead_m = 0.5 * spec_.stitched_m;
  return stitches_[camera].join(render_from(camera, ahead_m, time_s),
                                render_from(camera, -ahead_m, time_s));
}

Image SimulatedSequence::render_from(std::size_t camera, double ahead_m, double time_s) {
  const Rigid3 cam_from_lens(Eigen::Quaterniond::Identity(), {0.0, 0.0, ahead_m});
  const Renderer& renderer = renderers_[camera];
  if (spec_.readout_s == 0.0) {
    return renderer.image(world_from_cam(camera, time_s) * cam_from_lens, *pool_, time_s);
  }
  const int height_px = rig_.cameras[camera].camera->height_px();
  const auto pose_of_row = [&](int row) {
    const double share = height_px > 1 ? static_cast<double>(row) / (height_px - 1) - 0.5 : 0.0;
    return world_from_cam(camera, time_s + share * spec_.readout_s) * cam_from_lens;
  };
  return renderer.rolling_image(pose_of_row, *pool_, time_s);
}

Image SimulatedSequence::expose(std::size_t camera, int index, const ImageEffects& effects) {
  const double middle = seconds(index, camera);
  const double half = 0.5 * effects.exposure_s;
  const int count = num_sub_exposures(motion_.world_from_rig(middle - half),
                                      motion_.world_from_rig(middle + half),
                                      renderers_[camera].pixel_rad());
  if (count == 1) return render(camera, middle);
  std::vector<int> sums;
  Image image;
  for (int k = 0; k < count; ++k) {
    image = render(camera, middle + effects.exposure_s * ((k + 0.5) / count - 0.5));
    sums.resize(image.values.size(), 0);
    for (std::size_t i = 0; i < sums.size(); ++i) sums[i] += image.values[i];
  }
  for (std::size_t i = 0; i < sums.size(); ++i) {
    image.values[i] = static_cast<std::uint8_t>((sums[i] + count / 2) / count);
  }
  return image;
}

SimulatedFrame SimulatedSequence::frame(int index) {
  WAYMARK_CHECK(index >= 0 && index < spec_.num_frames);
  SimulatedFrame frame;
  frame.timestamp_ns = timestamp_ns(index);
  frame.world_from_rig = world_from_rig(index);
  for (std::size_t camera = 0; camera < rig_.cameras.size(); ++camera) {
    const ImageEffects effects = effects_of(camera, index);
    Image image = expose(camera, index, effects);
    Rng rng(spec_.seed, stream_of(index, camera));
    apply_exposure(effects, rng, image);
    if (!stabilizers_.empty()) image = stabilizers_[camera].stabilize(image, index);
    frame.images.push_back(std::move(image));
    frame.image_timestamps_ns.push_back(kFirstTimestampNs +
                                        std::llround(1e9 * seconds(index, camera)));
  }
  if (spec_.chain.depth_factor) {
    const double time_s = seconds(index) + spec_.depth_lag_s;
    frame.depth_timestamp_ns = frame.timestamp_ns + std::llround(1e9 * spec_.depth_lag_s);
    frame.depth =
        renderers_[0].depth(world_from_cam(0, time_s), *spec_.chain.depth_factor, *pool_, time_s);
    Rng rng(spec_.seed, stream_of(index, kDepthStream));
    apply_depth_noise(effects_of(0, index), *spec_.chain.depth_factor, rng, frame.depth);
  }
  return frame;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/system/localizer.h"

#include <algorithm>
#include <map>
#include <utility>
#include <variant>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/base/median.h"
#include "waymark/camera/pixel_angles.h"
#include "waymark/camera/scaled_camera.h"
#include "waymark/image/convert.h"
#include "waymark/image/frame_builder.h"
#include "waymark/system/marker_finder.h"
#include "waymark/system/query_calibration.h"
#include "waymark/system/temporary_map.h"
#include "waymark/track/keyframes_near.h"
#include "waymark/track/relocalizer.h"
#include "waymark/track/tracker.h"

namespace waymark {
namespace {

constexpr std::size_t kMaxNearHint = 5;
/// A stream that sees fewer landmarks of the map needs others; when it sees enough again, not.
constexpr int kFewLandmarks = 80;
constexpr int kEnoughLandmarks = 100;
/// One that has seen fewer than this for longer has left the map.
constexpr int kMinLandmarks = 20;
constexpr std::int64_t kMaxBridgeNs = 2'000'000'000;

/// Frames of a stream that tell of its calibration: neighbours tell the same.
constexpr std::uint32_t kCalibrationSpacing = 5;

/// Images that are finer than those of the map by less are taken as they are.
constexpr double kMinReduction = 0.8;
/// No side becomes shorter than this.
constexpr double kMinSidePx = 120.0;

/// What an image has to be reduced by so that its pixels cover the angle of those of the map's
/// middling camera: finer details are not in the map, and would take up the features.
double reduction_for(const Rig& rig, const Map& map) {
  std::map<const Camera*, double> angle_of_camera;
  std::vector<double> angles;
  map.keyframes().for_each([&](KeyframeId, const Keyframe& keyframe) {
    const Camera* camera = keyframe.rig->cameras.at(0).camera.get();
    const auto [at, is_new] = angle_of_camera.try_emplace(camera, 0.0);
    if (is_new) at->second = central_pixel_angle(*camera);
    angles.push_back(at->second);
  });
  if (angles.empty()) return 1.0;
  const Camera& camera = *rig.cameras.at(0).camera;
  const double smallest = kMinSidePx / std::min(camera.width_px(), camera.height_px());
  const double reduction = std::max(central_pixel_angle(camera) / median(angles), smallest);
  return reduction < kMinReduction ? reduction : 1.0;
}

Rig reduced(Rig rig, double factor) {
  if (factor == 1.0) return rig;
  const auto resized = [factor](std::shared_ptr<const Camera> camera) {
    return std::make_shared<const ScaledCamera>(ScaledCamera::resized(std::move(camera), factor));
  };
  for (RigCamera& camera : rig.cameras) {
    camera.camera = resized(camera.camera);
    if (!camera.remake) continue;
    camera.remake = [resized, remake = camera.remake](const CameraDescription& description) {
      return resized(remake(description));
    };
  }
  return rig;
}

/// The sub-map of the landmarks that were recognised.
SubmapId submap_of(const Map& map, const std::vector<LandmarkId>& landmarks) {
  for (const LandmarkId id : landmarks) {
    if (id.is_valid()) return map.landmarks().at(id).submap;
  }
  return {};
}

}  // namespace

class Localizer::Impl {
 public:
  Impl(Rig rig, const Settings& settings, std::shared_ptr<const Map> map)
      : full_rig_(std::make_shared<const Rig>(
            with_depth_offset(std::move(rig), settings.depth.inverse_offset))),
        reduction_(reduction_for(*full_rig_, *map)),
        rig_(std::make_shared<const Rig>(reduced(*full_rig_, reduction_))),
        uses_range_(is_metric(*map)),
        settings_(settings),
        builder_(*rig_, {settings.features, settings.stereo, settings.depth, settings.view}),
        snapshot_(index_map(std::move(map))),
        temporary_(std::in_place, rig_, snapshot_),
        tracker_(rig_, uses_range_, settings.tracking, static_cast<std::uint64_t>(settings.seed)),
        relocalizer_(rig_, settings.tracking, static_cast<std::uint64_t>(settings.seed)),
        calibration_(rig_, settings.calibration, snapshot_.map),
        marker_finder_(settings.markers) {
    tracker_.begin_in(*snapshot_.map, TrackingPurpose::kLocalizing);
  }

  const Map& map() const { return *snapshot_.map; }
  Rig rig() const;
  std::vector<CalibrationEstimate> calibration() const;
  TrackingResult track(const FrameImages& images);
  TrackingResult locate(const FrameImages& images, const std::optional<PoseHint>& hint);

 private:
  /// motion: of a stream, see Tracker::predict_motion; images by themselves have none.
  Frame build(const FrameImages& images, const RigMotion& motion, TrackingResult& result);
  std::shared_ptr<const Features> find_features(const FrameImages& images, const RigMotion& motion);
  std::optional<LocatedFrame> search(const Frame& frame, const std::optional<PoseHint>& hint);
  /// Makes do with temporary landmarks from when the map shows too little until it shows enough.
  void bridge_gaps(const TrackOutcome& outcome, std::int64_t timestamp_ns);
  /// From the next frame on.
  void look_with(std::shared_ptr<const Rig> rig);

  const std::shared_ptr<const Rig> full_rig_;
  const double reduction_;
  std::shared_ptr<const Rig> rig_;  ///< Of the reduced images, as calibrated by now.
  const bool uses_range_;
  const Settings settings_;
  FrameBuilder builder_;
  const MapSnapshot snapshot_;
  std::optional<TemporaryMap> temporary_;  ///< For the stream; never empty.
  bool is_on_temporary_ = false;
  std::int64_t last_in_map_ns_ = 0;
  Tracker tracker_;
  Relocalizer relocalizer_;
  QueryCalibration calibration_;
  const MarkerFinder marker_finder_;
  std::uint32_t num_frames_ = 0;
  std::uint32_t num_tracked_ = 0;                  ///< Of the stream.
  std::optional<std::int64_t> last_timestamp_ns_;  ///< Of the stream.
};

Frame Localizer::Impl::build(const FrameImages& images,
                             const RigMotion& motion,
                             TrackingResult& result) {
  FrameImages used = images;
  if (!uses_range_) used.image1 = {}, used.depth = {};
  auto features = find_features(used, motion);
  result.num_features = static_cast<std::uint32_t>(features->num_primary);
  Frame frame{FrameId{num_frames_},
              images.timestamp_ns,
              std::move(features),
              builder_.small_image(),
              marker_finder_.search_in(images, full_rig_)};
  ++num_frames_;
  result.frame = frame.id;
  result.stages[Stage::kFeatures] = builder_.times().features_ms;
  result.stages[Stage::kDepth] = builder_.times().depth_ms;
  return frame;
}

std::shared_ptr<const Features> Localizer::Impl::find_features(const FrameImages& images,
                                                               const RigMotion& motion) {
  if (reduction_ == 1.0) return builder_.build(images, motion);
  check_sizes(images, *full_rig_);
  const Image image0 = reduce(images.image0, reduction_);
  Image image1, mask;
  DepthImage depth;
  if (!images.image1.is_empty()) image1 = reduce(images.image1, reduction_);
  if (!images.depth.is_empty()) depth = pick_reduced(images.depth, reduction_);
  if (!images.mask.is_empty()) mask = pick_reduced(images.mask, reduction_);
  FrameImages smaller = images;
  smaller.image0 = image0.view(), smaller.image1 = image1.view();
  smaller.depth = depth.view(), smaller.mask = mask.view();
  return builder_.build(smaller, motion);
}

TrackingResult Localizer::Impl::track(const FrameImages& images) {
  if (last_timestamp_ns_ && images.timestamp_ns <= *last_timestamp_ns_) {
    throw InputError("frame " + std::to_string(num_frames_),
                     "time stamp is not later than that of the frame before");
  }
  TrackingResult result;
  const RigMotion motion = builder_.needs_motion(images) ? tracker_.predict_motion() : RigMotion{};
  const Frame frame = build(images, motion, result);
  last_timestamp_ns_ = images.timestamp_ns;
  const TrackOutcome outcome = tracker_.track(frame, temporary_->visible(), result.stages);
  bridge_gaps(outcome, images.timestamp_ns);
  static_cast<FrameVerdict&>(result) = outcome;
  if (outcome.world_from_rig && ++num_tracked_ % kCalibrationSpacing == 0 &&
      calibration_.add(frame, outcome.world_from_rig->inverse(), outcome.details.landmarks)) {
    look_with(calibration_.known().rig);
  }
  return result;
}

void Localizer::Impl::look_with(std::shared_ptr<const Rig> rig) {
  rig_ = std::move(rig);
  builder_.look_with(*rig_);
  tracker_.look_with(rig_);
  relocalizer_ = Relocalizer(rig_, settings_.tracking, static_cast<std::uint64_t>(settings_.seed));
  temporary_.emplace(rig_, snapshot_);
  if (std::exchange(is_on_temporary_, false)) {
    tracker_.continue_in(*snapshot_.map, TrackingPurpose::kLocalizing);
  }
}

Rig Localizer::Impl::rig() const {
  Rig rig = *full_rig_;
  for (std::size_t c = 0; c < rig.cameras.size(); ++c) {
    const RigCamera& now = rig_->cameras[c];
    rig.cameras[c].cam_from_rig = now.cam_from_rig;
    rig.cameras[c].description = now.description;
    rig.cameras[c].readout_s = now.readout_s;
    if (rig.cameras[c].remake) rig.cameras[c].camera = rig.cameras[c].remake(*now.description);
  }
  return rig;
}

std::vector<CalibrationEstimate> Localizer::Impl::calibration() const {
  const KnownCalibration& known = calibration_.known();
  return known.is_changed() ? known.estimates() : std::vector<CalibrationEstimate>{};
}

void Localizer::Impl::bridge_gaps(const TrackOutcome& outcome, std::int64_t timestamp_ns) {
  const LandmarkId end = snapshot_.map->landmarks().end_id();
  const auto num_lasting =
      std::count_if(outcome.seen.begin(), outcome.seen.end(), [&](const SeenLandmark& seen) {
        return seen.landmark.value < end.value;
      });
  if (num_lasting >= kMinLandmarks) last_in_map_ns_ = timestamp_ns;
  const bool has_left = timestamp_ns - last_in_map_ns_ > kMaxBridgeNs;
  if (is_on_temporary_ && outcome.world_from_rig && num_lasting < kEnoughLandmarks && !has_left) {
    if (!outcome.message) return;
    temporary_->add(std::get<NewKeyframe>(*outcome.message));
  } else if (is_on_temporary_) {
    is_on_temporary_ = false;
    temporary_->clear();
    tracker_.continue_in(*snapshot_.map, TrackingPurpose::kLocalizing);
  } else if (outcome.world_from_rig && num_lasting < kFewLandmarks) {
    is_on_temporary_ = true;
    tracker_.continue_in(*snapshot_.map, TrackingPurpose::kMapping);
  }
}

TrackingResult Localizer::Impl::locate(const FrameImages& images,
                                       const std::optional<PoseHint>& hint) {
  TrackingResult result;
  const Frame frame = build(images, {}, result);
  StageTimer timer(result.stages, Stage::kRecover);
  if (frame.features->num_primary == 0) {
    result.reason = FrameReason::kNoFeatures;
    return result;
  }
  const std::optional<LocatedFrame> located = search(frame, hint);
  static_cast<FrameStatus&>(result) = relocalizer_.diagnosis();
  if (!located) return result;
  result.state = FrameState::kTracked;
  result.world_from_rig = located->rig_from_world.inverse();
  result.covariance = located->covariance;
  result.num_matches = located->num_matches;
  result.num_inliers = located->num_inliers;
  result.submap = submap_of(*snapshot_.map, located->landmarks);
  // Bent by a rolling shutter, and straightened by no motion, an image tells nothing.
  if (rig_->cameras[0].readout_s == 0.0 &&
      calibration_.add(frame, located->rig_from_world, located->landmarks)) {
    look_with(calibration_.known().rig);
  }
  return result;
}

std::optional<LocatedFrame> Localizer::Impl::search(const Frame& frame,
                                                    const std::optional<PoseHint>& hint) {
  if (hint) {
    const std::vector<KeyframeId> near = keyframes_near(
        *snapshot_.map, hint->submap, *rig_, hint->world_from_rig.inverse(), kMaxNearHint);
    if (auto located = relocalizer_.locate_among(frame, *snapshot_.map, near)) {
      return located;
    }
  }
  if (auto located = relocalizer_.locate_at_markers(frame, *snapshot_.map)) return located;
  return relocalizer_.locate(frame, *snapshot_.map, *snapshot_.places);
}

Localizer::Localizer(Rig rig, const Settings& settings, std::shared_ptr<const Map> map)
    : impl_(std::make_unique<Impl>(std::move(rig), settings, std::move(map))) {}
Localizer::~Localizer() = default;
const Map& Localizer::map() const { return impl_->map(); }
Rig Localizer::rig() const { return impl_->rig(); }
std::vector<CalibrationEstimate> Localizer::calibration() const { return impl_->calibration(); }
TrackingResult Localizer::track(const FrameImages& images) { return impl_->track(images); }
TrackingResult Localizer::locate(const FrameImages& images, const std::optional<PoseHint>& hint) {
  return impl_->locate(images, hint);
}

}  // namespace waymark

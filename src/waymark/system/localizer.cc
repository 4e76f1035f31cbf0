// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/system/localizer.h"

#include <algorithm>
#include <utility>
#include <variant>
#include <vector>

#include "waymark/system/query_calibration.h"
#include "waymark/system/query_frames.h"
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
      : settings_(settings),
        frames_(std::move(rig), settings, middling_pixel_angle(*map), is_metric(*map)),
        snapshot_(index_map(std::move(map))),
        temporary_(snapshot_),
        tracker_(is_metric(*snapshot_.map), settings.tracking, seed()),
        relocalizer_(settings.tracking, seed()),
        calibration_(frames_.rig(), settings.calibration, snapshot_.map) {
    tracker_.begin_in(*snapshot_.map, TrackingPurpose::kLocalizing);
  }

  const Map& map() const { return *snapshot_.map; }
  Rig rig() const { return frames_.full_rig(); }
  std::vector<CalibrationEstimate> calibration() const;
  TrackingResult track(const FrameImages& images);
  TrackingResult locate(const FrameImages& images, const std::optional<PosePrior>& hint);

 private:
  std::uint64_t seed() const { return static_cast<std::uint64_t>(settings_.seed); }
  std::optional<LocatedFrame> search(const Frame& frame, const std::optional<PosePrior>& hint);
  /// Makes do with temporary landmarks from when the map shows too little until it shows enough.
  void bridge_gaps(const TrackingResult& result,
                   std::optional<MapperMessage> message,
                   std::int64_t timestamp_ns);
  /// From the next frame on.
  void set_calibration(std::shared_ptr<const Rig> rig);

  const Settings settings_;
  QueryFrames frames_;
  const MapSnapshot snapshot_;
  TemporaryMap temporary_;  ///< For the stream.
  bool is_on_temporary_ = false;
  std::int64_t last_in_map_ns_ = 0;
  Tracker tracker_;
  Relocalizer relocalizer_;
  QueryCalibration calibration_;
  std::uint32_t num_tracked_ = 0;  ///< Of the stream.
};

TrackingResult Localizer::Impl::track(const FrameImages& images) {
  TrackingResult result;
  const RigMotion motion = frames_.needs_motion(images) ? tracker_.predict_motion() : RigMotion{};
  const Frame frame = frames_.build_next(images, motion, result);
  bridge_gaps(result, tracker_.track(frame, temporary_.visible(), result), images.timestamp_ns);
  result.is_keyframe = false;  // Of what is thrown away afterwards.
  if (result.world_from_rig && ++num_tracked_ % kCalibrationSpacing == 0 &&
      calibration_.add(frame, result.world_from_rig->inverse(), result.landmarks)) {
    set_calibration(calibration_.known().rig);
  }
  return result;
}

void Localizer::Impl::set_calibration(std::shared_ptr<const Rig> rig) {
  frames_.set_calibration(std::move(rig));
  temporary_.clear();
  if (std::exchange(is_on_temporary_, false)) {
    tracker_.continue_in(*snapshot_.map, TrackingPurpose::kLocalizing);
  }
}

std::vector<CalibrationEstimate> Localizer::Impl::calibration() const {
  const KnownCalibration& known = calibration_.known();
  return known.is_changed() ? known.estimates() : std::vector<CalibrationEstimate>{};
}

void Localizer::Impl::bridge_gaps(const TrackingResult& result,
                                  std::optional<MapperMessage> message,
                                  std::int64_t timestamp_ns) {
  const LandmarkId end = snapshot_.map->landmarks().end_id();
  const auto num_lasting = std::ranges::count_if(
      result.landmarks, [&](LandmarkId id) { return id.is_valid() && id < end; });
  if (num_lasting >= kMinLandmarks) last_in_map_ns_ = timestamp_ns;
  const bool has_left = timestamp_ns - last_in_map_ns_ > kMaxBridgeNs;
  if (is_on_temporary_ && result.world_from_rig && num_lasting < kEnoughLandmarks && !has_left) {
    if (message) temporary_.add(std::get<NewKeyframe>(*message));
  } else if (is_on_temporary_) {
    is_on_temporary_ = false;
    temporary_.clear();
    tracker_.continue_in(*snapshot_.map, TrackingPurpose::kLocalizing);
  } else if (result.world_from_rig && num_lasting < kFewLandmarks) {
    is_on_temporary_ = true;
    tracker_.continue_in(*snapshot_.map, TrackingPurpose::kMapping);
  }
}

TrackingResult Localizer::Impl::locate(const FrameImages& images,
                                       const std::optional<PosePrior>& hint) {
  TrackingResult result;
  const Frame frame = frames_.build(images, result);
  StageTimer timer(result.stages, Stage::kRecover);
  if (frame.features->num_primary == 0) {
    result.reason = FrameReason::kNoFeatures;
    return result;
  }
  const std::optional<LocatedFrame> located = search(frame, hint);
  static_cast<FrameStatus&>(result) = relocalizer_.diagnosis();
  if (!located) return result;
  set_located(*located, result);
  result.submap = submap_of(*snapshot_.map, located->landmarks);
  // Bent by a rolling shutter, and straightened by no motion, an image tells nothing.
  if (frames_.rig()->cameras[0].readout_s == 0.0 &&
      calibration_.add(frame, located->rig_from_world, located->landmarks)) {
    set_calibration(calibration_.known().rig);
  }
  return result;
}

std::optional<LocatedFrame> Localizer::Impl::search(const Frame& frame,
                                                    const std::optional<PosePrior>& hint) {
  if (hint) {
    const std::vector<KeyframeId> near = keyframes_near(
        *snapshot_.map, hint->submap, *frames_.rig(), hint->world_from_rig.inverse(), kMaxNearHint);
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
TrackingResult Localizer::locate(const FrameImages& images, const std::optional<PosePrior>& hint) {
  return impl_->locate(images, hint);
}

}  // namespace waymark

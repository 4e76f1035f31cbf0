// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/simulate/testing/town_map.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/base/rng.h"
#include "waymark/camera/registry.h"
#include "waymark/mapping/appearance.h"

namespace waymark {
namespace {

/// So many keyframes later what was out of sight is seen again rather than still.
constexpr std::uint32_t kMemoryKeyframes = 30;
/// Landmarks that make a revisit, and keyframes from one to the next.
constexpr std::size_t kMinOfRevisit = 20;
constexpr std::uint32_t kMinBetweenRevisits = 20;
/// Errors of what was adjusted.
constexpr double kAdjustedSigmaM = 0.01;
constexpr double kAdjustedSigmaRad = 0.0005;
constexpr double kLandmarkSigmaM = 0.03;
constexpr std::int64_t kFramePeriodNs = 100'000'000;

Rigid3 random_motion(double sigma_m, double sigma_rad, Rng& rng) {
  Vector6d tangent;
  for (int i = 0; i < 6; ++i) tangent[i] = (i < 3 ? sigma_m : sigma_rad) * rng.normal();
  return Rigid3::exp(tangent);
}

/// Puts keyframes and landmarks into lists, of which Map::restore() makes a map: covisibility is
/// then counted once.
class TownMapMaker {
 public:
  TownMapMaker(const TownMapSettings& settings, TownMap& result)
      : settings_(settings), result_(result), rng_(settings.seed, 0) {
    // Two for each point: it looks different from the two ends of its street.
    known_.resize(2 * std::size_t{result.town->num_points()});
    parts_.keyframes.reserve(settings.num_keyframes);
  }

  void add(const TownRecording& recording) {
    if (!settings_.is_closed || parts_.submaps.empty()) {
      parts_.submaps.push_back({settings_.is_metric, KeyframeId{num_keyframes()}, {}});
      map_from_rig_ = Rigid3();
    } else {
      is_new_recording_ = true;
    }
    first_ = num_keyframes();
    for (std::uint32_t i = 0; i < recording.num_frames(); ++i) add(recording.frame(i));
  }

  std::shared_ptr<const Map> finish() {
    drop_lonely_landmarks();
    parts_.end_keyframe = KeyframeId{num_keyframes()};
    parts_.end_landmark = LandmarkId{static_cast<std::uint32_t>(num_observers_.size())};
    if (settings_.is_closed && !result_.revisits.empty()) {
      parts_.loop_edges.assign(result_.revisits.begin(), result_.revisits.end() - 1);
    }
    Map map = Map::restore(std::move(parts_));
    for (LandmarkId id{0}; id < map.landmarks().end_id(); ++id.value) {
      if (map.landmarks().contains(id)) map.set_appearance(id, describe_landmark(map, id));
    }
    return map.freeze();
  }

 private:
  /// What is known of a point seen from one end of its street.
  struct KnownPoint {
    LandmarkId landmark;
    std::uint32_t last_keyframe = 0;
    bool is_known = false;
  };

  std::uint32_t num_keyframes() const {
    return static_cast<std::uint32_t>(parts_.keyframes.size());
  }

  void add(const TownFrame& frame) {
    const KeyframeId id{num_keyframes()};
    Keyframe keyframe;
    keyframe.frame = FrameId{id.value};
    keyframe.timestamp_ns = kFramePeriodNs * id.value;
    keyframe.submap = SubmapId{static_cast<std::uint32_t>(parts_.submaps.size() - 1)};
    keyframe.features = frame.features;
    keyframe.rig_from_world = estimate(frame.world_from_rig, id).inverse();
    result_.world_from_rig.push_back(frame.world_from_rig);
    if (id.value > first_) keyframe.parent = KeyframeId{id.value - 1};
    keyframe.landmarks.resize(frame.features->size());
    votes_.clear();
    const Rigid3 map_from_world =
        keyframe.rig_from_world.inverse() * frame.world_from_rig.inverse();
    for (std::size_t i = 0; i < frame.features->size(); ++i) {
      keyframe.landmarks[i] = associate(frame, i, id, map_from_world, keyframe.submap);
    }
    if (std::exchange(is_new_recording_, false)) keyframe.parent = most_voted(id).first;
    parts_.keyframes.push_back({id, std::move(keyframe)});
    note_revisit(id);
  }

  /// world_from_rig of the map.
  Rigid3 estimate(const Rigid3& world_from_rig, KeyframeId id) {
    if (settings_.is_closed) {
      return world_from_rig * random_motion(kAdjustedSigmaM, kAdjustedSigmaRad, rng_);
    }
    if (id.value == first_) return map_from_rig_ = world_from_rig;
    const Rigid3 step = result_.world_from_rig.back().inverse() * world_from_rig;
    const double sigma_m = settings_.drift_of_way * step.translation.norm();
    map_from_rig_ = map_from_rig_ * step * random_motion(sigma_m, settings_.turn_of_step_rad, rng_);
    return map_from_rig_;
  }

  LandmarkId associate(const TownFrame& frame,
                       std::size_t feature,
                       KeyframeId id,
                       const Rigid3& map_from_world,
                       SubmapId submap) {
    const std::uint32_t number = frame.point_of_feature[feature];
    if (Rng(settings_.seed, number).uniform() >= settings_.landmark_share) return {};
    const Town::Point point = result_.town->point(number);
    const Eigen::Vector3d ray = frame.world_from_rig.translation - point.position;
    KnownPoint& known = known_[2 * std::size_t{number} + (ray.dot(point.along) > 0.0)];
    const std::uint32_t age = id.value - known.last_keyframe;
    const bool is_of_before =
        known.is_known && (known.last_keyframe < first_ || age > kMemoryKeyframes);
    if (is_of_before) votes_.push_back(KeyframeId{known.last_keyframe});
    if (!known.is_known || (is_of_before && !settings_.is_closed)) {
      known.landmark = LandmarkId{static_cast<std::uint32_t>(num_observers_.size())};
      num_observers_.push_back(0);
      Landmark landmark;
      landmark.submap = submap;
      landmark.position_in_world = map_from_world * point.position;
      for (int k = 0; k < 3; ++k) landmark.position_in_world[k] += kLandmarkSigmaM * rng_.normal();
      landmark.reference = id;
      landmark.num_visible = landmark.num_found = 1;
      parts_.landmarks.push_back({known.landmark, std::move(landmark)});
    }
    ++num_observers_[known.landmark.value];
    known.last_keyframe = id.value;
    known.is_known = true;
    return known.landmark;
  }

  /// The keyframe that was the last to see most of what is seen again, and how much that is.
  std::pair<KeyframeId, std::size_t> most_voted(KeyframeId id) {
    std::pair<KeyframeId, std::size_t> best{KeyframeId{id.value - 1}, 0};
    std::sort(votes_.begin(), votes_.end());
    for (auto begin = votes_.begin(); begin != votes_.end();) {
      const auto end = std::upper_bound(begin, votes_.end(), *begin);
      const auto count = static_cast<std::size_t>(end - begin);
      if (count > best.second) best = {*begin, count};
      begin = end;
    }
    return best;
  }

  void note_revisit(KeyframeId id) {
    if (votes_.size() < kMinOfRevisit || id.value < next_revisit_) return;
    const KeyframeId match = most_voted(id).first;
    const Rigid3 id_from_match =
        result_.world_from_rig[id.value].inverse() * result_.world_from_rig[match.value];
    result_.revisits.push_back({match, id, Sim3(id_from_match)});
    next_revisit_ = id.value + kMinBetweenRevisits;
  }

  /// What one keyframe alone sees is no landmark.
  void drop_lonely_landmarks() {
    std::erase_if(parts_.landmarks, [&](const MapParts::StoredLandmark& stored) {
      return num_observers_[stored.id.value] < 2;
    });
    for (MapParts::StoredKeyframe& stored : parts_.keyframes) {
      for (LandmarkId& id : stored.keyframe.landmarks) {
        if (id.is_valid() && num_observers_[id.value] < 2) id = {};
      }
    }
  }

  const TownMapSettings& settings_;
  TownMap& result_;
  Rng rng_;
  MapParts parts_;
  std::vector<KnownPoint> known_;
  std::vector<std::uint32_t> num_observers_;  ///< Per landmark.
  std::vector<KeyframeId> votes_;  ///< Of the current keyframe's landmarks: who saw them before.
  Rigid3 map_from_rig_;
  std::uint32_t first_ = 0;  ///< Keyframe of the recording.
  std::uint32_t next_revisit_ = 0;
  bool is_new_recording_ = false;
};

}  // namespace

std::shared_ptr<const Rig> make_town_rig(int num_cameras) {
  CameraDescription description;
  description.camera_model = "pinhole";
  description.intrinsics = {420.0, 420.0, 319.5, 239.5};
  description.width_px = 640;
  description.height_px = 480;
  const auto camera = CameraRegistry::with_builtin_models().make_camera(description);
  Rig rig;
  for (int i = 0; i < num_cameras; ++i) {
    const Rigid3 beside(Eigen::Quaterniond::Identity(), {-0.4 * i, 0.0, 0.0});
    rig.cameras.push_back({camera, beside, description});
  }
  return std::make_shared<const Rig>(std::move(rig));
}

std::shared_ptr<const Town> make_town_for(const TownMapSettings& settings) {
  TownSettings town;
  town.seed = settings.seed;
  town.repeated_share = settings.repeated_share;
  const double way_m = settings.step_m * static_cast<double>(settings.num_keyframes);
  const double num_streets = way_m / (settings.num_passes * town.block_m);
  // A square of n x n crossings has 2 n (n - 1) streets.
  const double side = 0.5 * (1.0 + std::sqrt(1.0 + 2.0 * num_streets));
  town.num_columns = town.num_rows = std::max(2, static_cast<int>(std::lround(side)));
  return std::make_shared<const Town>(town);
}

TownRecording make_town_recording(std::shared_ptr<const Town> town,
                                  std::shared_ptr<const Rig> rig,
                                  const TownMapSettings& settings,
                                  std::size_t recording) {
  WAYMARK_CHECK(recording < settings.num_recordings);
  TownRecordingSettings each;
  each.seed = settings.seed + 1 + recording;
  each.num_frames = static_cast<std::uint32_t>(settings.num_keyframes / settings.num_recordings);
  each.step_m = settings.step_m;
  each.max_features = settings.max_features;
  if (settings.is_metric && rig->cameras.size() == 1) each.inverse_range_sigma = 0.002;
  return {std::move(town), std::move(rig), each};
}

TownMap make_town_map(const TownMapSettings& settings) {
  TownMap result;
  result.town = make_town_for(settings);
  result.rig = make_town_rig(1);
  TownMapMaker maker(settings, result);
  for (std::size_t i = 0; i < settings.num_recordings; ++i) {
    maker.add(make_town_recording(result.town, result.rig, settings, i));
  }
  result.map = maker.finish();
  return result;
}

}  // namespace waymark

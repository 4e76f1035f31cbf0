// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/atlas/atlas_localizer.h"

#include <algorithm>
#include <array>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "waymark/atlas/atlas_places.h"
#include "waymark/atlas/open_tiles.h"
#include "waymark/base/median.h"
#include "waymark/place/map_snapshot.h"
#include "waymark/system/query_frames.h"
#include "waymark/track/keyframes_near.h"
#include "waymark/track/local_map.h"
#include "waymark/track/place_confidence.h"
#include "waymark/track/relocalizer.h"
#include "waymark/track/tracker.h"

namespace waymark {
namespace {

/// As many as in a map.
constexpr std::size_t kMaxPlaces = 10;
/// With this no other tile needs to be opened.
constexpr double kCertainConfidence = 0.5;
constexpr std::size_t kMaxNearGuess = 5;
/// A guess may lie at a border.
constexpr std::size_t kMaxTilesNearGuess = 3;
/// A stream that sees fewer landmarks of its tile is looked for in others, every few frames.
constexpr int kFewSeen = 80;
constexpr std::uint32_t kFramesBetweenLooks = 5;

bool is_all_metric(const AtlasContents& contents) {
  return std::ranges::all_of(contents.tiles, &AtlasTile::is_metric);
}

double middling_pixel_angle(const AtlasContents& contents) {
  std::vector<double> angles;
  for (const AtlasTile& tile : contents.tiles) angles.push_back(tile.pixel_angle_rad);
  return angles.empty() ? 0.0 : median(angles);
}

/// A frame that was found, in the frame of a tile.
struct FoundInTile {
  std::uint32_t tile = 0;
  LocatedFrame located;
};

/// Candidates of one tile, in their order.
struct TileCandidates {
  std::uint32_t tile = 0;
  std::vector<KeyframeId> keyframes;
};

std::vector<TileCandidates> by_tile(const std::vector<AtlasCandidate>& candidates) {
  std::vector<TileCandidates> tiles;
  for (const AtlasCandidate& candidate : candidates) {
    auto at = std::ranges::find(tiles, candidate.tile, &TileCandidates::tile);
    if (at == tiles.end()) at = tiles.insert(tiles.end(), {candidate.tile, {}});
    at->keyframes.push_back(candidate.keyframe);
  }
  return tiles;
}

/// Puts a result in the frame of a tile into that of its part of the atlas.
void put_into_atlas(const AtlasTile& tile, TrackingResult& result) {
  result.submap = {};
  if (!result.world_from_rig) return;
  result.submap = SubmapId{tile.frame};
  const Sim3 pose = tile.atlas_from_tile * Sim3(*result.world_from_rig);
  result.world_from_rig = Rigid3{pose.rotation, pose.translation};
  Vector6d units;
  units << Eigen::Vector3d::Constant(tile.atlas_from_tile.scale), Eigen::Vector3d::Ones();
  result.covariance = units.asDiagonal() * result.covariance * units.asDiagonal();
}

}  // namespace

class AtlasLocalizer::Impl {
 public:
  Impl(Rig rig, const Settings& settings, Atlas atlas, std::size_t max_open_tiles)
      : settings_(settings),
        atlas_(std::move(atlas)),
        uses_range_(is_all_metric(atlas_.contents())),
        frames_(std::move(rig), settings, middling_pixel_angle(atlas_.contents()), uses_range_),
        places_(atlas_),
        tiles_(atlas_, std::max<std::size_t>(max_open_tiles, 1)),
        relocalizer_(settings.tracking, seed()) {}

  const Atlas& atlas() const { return atlas_; }
  std::size_t num_opened() const { return tiles_.num_opened(); }
  std::size_t num_tiles_seen() const { return tiles_.num_tiles_seen(); }
  TrackingResult track(const FrameImages& images);
  TrackingResult locate(const FrameImages& images, const std::optional<PosePrior>& hint);

 private:
  std::uint64_t seed() const { return static_cast<std::uint64_t>(settings_.seed); }
  const AtlasTile& row(std::uint32_t tile) const { return atlas_.contents().tiles[tile]; }

  std::optional<FoundInTile> search(const Frame& frame);
  double confidence_in(const Frame& frame,
                       const Map& tile,
                       const LocatedFrame& located,
                       KeyframeId candidate);
  std::optional<FoundInTile> search_near(const Frame& frame, const PosePrior& hint);
  std::vector<std::uint32_t> tiles_near(const PosePrior& hint) const;
  void note(const FrameStatus& diagnosis);
  bool should_look(const TrackingResult& result);
  /// The stream goes on in another tile, where this frame was found.
  void enter(std::uint32_t tile);
  void fill_in(const FoundInTile& found, TrackingResult& result) const;

  const Settings settings_;
  const Atlas atlas_;
  const bool uses_range_;
  QueryFrames frames_;
  const AtlasPlaces places_;
  OpenTiles tiles_;
  Relocalizer relocalizer_;
  LocalMap local_;
  FrameStatus diagnosis_;                ///< Of the last search.
  std::optional<Tracker> tracker_;       ///< Of the stream, in one tile.
  std::uint32_t tile_ = 0;               ///< Which.
  std::optional<MapSnapshot> snapshot_;  ///< Of that.
  std::uint32_t num_since_look_ = 0;
};

/// Of the tiles that were compared the one that came closest.
void AtlasLocalizer::Impl::note(const FrameStatus& diagnosis) {
  const int num_candidates = diagnosis_.num_candidates + diagnosis.num_candidates;
  const auto rank = [](const FrameStatus& status) {
    return std::tuple(status.reason == FrameReason::kNone, status.num_inliers, status.num_matches);
  };
  if (rank(diagnosis) >= rank(diagnosis_)) diagnosis_ = diagnosis;
  diagnosis_.num_candidates = num_candidates;
}

/// What speaks for a place, as in a map.
double AtlasLocalizer::Impl::confidence_in(const Frame& frame,
                                           const Map& tile,
                                           const LocatedFrame& located,
                                           KeyframeId candidate) {
  gather_local_map(tile, primary_landmarks(*frame.features, located.landmarks), candidate, local_);
  return place_confidence(
      *frame.features, located.landmarks, tile, local_.reference, located.rig_from_world);
}

std::optional<FoundInTile> AtlasLocalizer::Impl::search(const Frame& frame) {
  diagnosis_ = {.reason = FrameReason::kNoCandidate};
  std::optional<FoundInTile> best;
  double confidence = 0.0;
  const auto found = places_.find(frame.features->corner_descriptors(), kMaxPlaces);
  for (const TileCandidates& candidates : by_tile(found)) {
    const std::shared_ptr<const Map> tile = tiles_.get(candidates.tile);
    auto located = relocalizer_.locate_among(frame, *tile, candidates.keyframes);
    note(relocalizer_.diagnosis());
    if (!located) continue;
    const double of_this = confidence_in(frame, *tile, *located, candidates.keyframes.front());
    if (best && of_this <= confidence) continue;
    confidence = of_this;
    best = FoundInTile{candidates.tile, *std::move(located)};
    if (confidence >= kCertainConfidence) break;
  }
  return best;
}

std::vector<std::uint32_t> AtlasLocalizer::Impl::tiles_near(const PosePrior& hint) const {
  std::vector<std::pair<double, std::uint32_t>> near;
  const std::vector<AtlasTile>& tiles = atlas_.contents().tiles;
  for (std::uint32_t i = 0; i < tiles.size(); ++i) {
    if (tiles[i].frame != hint.submap.value) continue;
    const Sim3& anchor = tiles[i].atlas_from_tile;
    const double away = (anchor * tiles[i].centre - hint.world_from_rig.translation).norm();
    near.push_back({away - anchor.scale * tiles[i].radius, i});
  }
  std::ranges::sort(near);
  std::vector<std::uint32_t> chosen;
  for (const auto& [away, tile] : near) {
    if (chosen.size() < kMaxTilesNearGuess) chosen.push_back(tile);
  }
  return chosen;
}

std::optional<FoundInTile> AtlasLocalizer::Impl::search_near(const Frame& frame,
                                                             const PosePrior& hint) {
  for (const std::uint32_t index : tiles_near(hint)) {
    const std::shared_ptr<const Map> tile = tiles_.get(index);
    const Sim3 pose = row(index).atlas_from_tile.inverse() * Sim3(hint.world_from_rig);
    const Rigid3 rig_from_tile = Rigid3{pose.rotation, pose.translation}.inverse();
    const std::vector<KeyframeId> near =
        keyframes_near(*tile, SubmapId{0}, *frames_.rig(), rig_from_tile, kMaxNearGuess);
    if (auto located = relocalizer_.locate_among(frame, *tile, near)) {
      diagnosis_ = relocalizer_.diagnosis();
      return FoundInTile{index, *std::move(located)};
    }
  }
  return std::nullopt;
}

void AtlasLocalizer::Impl::fill_in(const FoundInTile& found, TrackingResult& result) const {
  set_located(found.located, result);
  put_into_atlas(row(found.tile), result);
}

TrackingResult AtlasLocalizer::Impl::locate(const FrameImages& images,
                                            const std::optional<PosePrior>& hint) {
  TrackingResult result;
  const Frame frame = frames_.build(images, result);
  StageTimer timer(result.stages, Stage::kRecover);
  if (frame.features->num_primary == 0) {
    result.reason = FrameReason::kNoFeatures;
    return result;
  }
  std::optional<FoundInTile> found;
  if (hint) found = search_near(frame, *hint);
  if (!found) found = search(frame);
  static_cast<FrameStatus&>(result) = diagnosis_;
  if (found) fill_in(*found, result);
  return result;
}

void AtlasLocalizer::Impl::enter(std::uint32_t tile) {
  tile_ = tile;
  snapshot_ = index_map(tiles_.get(tile));
  tracker_.emplace(uses_range_, settings_.tracking, seed());
  tracker_->begin_in(*snapshot_->map, TrackingPurpose::kLocalizing);
}

/// Whether another tile may show more than the one in which the stream is followed: it shows little
/// of what is seen, or another one is nearer. At its border a tile holds a pose by one side only.
bool AtlasLocalizer::Impl::should_look(const TrackingResult& result) {
  if (++num_since_look_ < kFramesBetweenLooks) return false;
  if (result.num_inliers < kFewSeen) return true;
  return tiles_near({*result.world_from_rig, result.submap}).front() != tile_;
}

TrackingResult AtlasLocalizer::Impl::track(const FrameImages& images) {
  TrackingResult result;
  const bool needs_motion = tracker_ && frames_.needs_motion(images);
  const Frame frame =
      frames_.build_next(images, needs_motion ? tracker_->predict_motion() : RigMotion{}, result);
  const TrackingResult untracked = result;
  const auto follow = [&] {
    const StageTimes stages = result.stages;
    result = untracked;
    result.stages = stages;
    tracker_->track(frame, *snapshot_, result);
    result.is_relocalized = false;  // But by a search in the atlas.
    put_into_atlas(row(tile_), result);
  };
  if (tracker_) follow();
  if (result.world_from_rig && !should_look(result)) return result;
  if (frame.features->num_primary == 0) {
    result.reason = FrameReason::kNoFeatures;
    return result;
  }
  num_since_look_ = 0;
  const std::optional<FoundInTile> found = search(frame);
  if (!found && !result.world_from_rig) static_cast<FrameStatus&>(result) = diagnosis_;
  const bool has_better =
      result.world_from_rig && found && found->located.num_inliers <= result.num_inliers;
  if (!found || has_better) return result;
  enter(found->tile);
  follow();
  if (!result.world_from_rig) fill_in(*found, result);
  result.is_relocalized = true;
  return result;
}

AtlasLocalizer::AtlasLocalizer(Rig rig,
                               const Settings& settings,
                               Atlas atlas,
                               std::size_t max_open_tiles)
    : impl_(std::make_unique<Impl>(std::move(rig), settings, std::move(atlas), max_open_tiles)) {}
AtlasLocalizer::~AtlasLocalizer() = default;
const Atlas& AtlasLocalizer::atlas() const { return impl_->atlas(); }
TrackingResult AtlasLocalizer::track(const FrameImages& images) { return impl_->track(images); }
TrackingResult AtlasLocalizer::locate(const FrameImages& images,
                                      const std::optional<PosePrior>& hint) {
  return impl_->locate(images, hint);
}
std::size_t AtlasLocalizer::num_opened() const { return impl_->num_opened(); }
std::size_t AtlasLocalizer::num_tiles_seen() const { return impl_->num_tiles_seen(); }

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/loop/global_mapper.h"

#include <algorithm>
#include <utility>

#include "waymark/loop/close.h"
#include "waymark/loop/find.h"
#include "waymark/loop/join_by_markers.h"
#include "waymark/loop/loop_pose_graph.h"
#include "waymark/loop/spatial_neighbours.h"
#include "waymark/map/align.h"
#include "waymark/optimize/outlier_edges.h"

namespace waymark {
namespace {

/// Keyframes five steps away in the graph are known to each other well enough; of views further
/// apart ORB features change too much.
constexpr SpatialNeighbourOptions kSpatialNeighbours = {
    .num_known_steps = 5, .distance = 0.8, .angle_rad = 0.7};

/// In the end so few are looked at: they tell the readout of a rolling shutter.
constexpr std::size_t kFewestInTheEnd = 5;

/// How much less sure odometry is than the map, in standard deviations.
constexpr double kOdometrySigmas = 3.0;

/// Of a loop that needs no weighing against the others, see LoopPoseGraph: what
/// reject_outlier_edges() lets stand, as unsure as odometry is.
double max_chi_squared() {
  const double max_residual = kOdometrySigmas * OutlierEdgeOptions().max_residual;
  return max_residual * max_residual;
}

}  // namespace

GlobalMapper::GlobalMapper(std::shared_ptr<const Rig> rig,
                           const MappingSettings& mapping,
                           const LoopSettings& loop,
                           const CalibrationSettings& calibration,
                           std::uint64_t seed,
                           std::optional<KnownMarkers> markers)
    : settings_(loop),
      mapper_(std::move(rig), mapping, calibration),
      verifier_(seed, loop.options),
      markers_(std::move(markers)) {}

void GlobalMapper::take_over(const MapSnapshot& before) {
  mapper_.take_over(*before.map);
  places_ = *before.places;
}

void GlobalMapper::keep_in(const std::shared_ptr<std::pmr::memory_resource>& memory) {
  mapper_.keep_features_in(memory);
  places_.keep_tables_in(memory);
}

void GlobalMapper::add(const NewSubmap& message) { update_places(mapper_.add(message)); }

void GlobalMapper::add(const NewKeyframe& message) {
  const Mapper::Changes changes = mapper_.add(message);
  update_places(changes);
  if (const auto moved = markers_.look_at(changes.added.back(), mapper_)) {
    // What is being adjusted is of another frame; what comes next has the markers with it.
    schedule_.note_placement(*moved);
  }
  if (!settings_.enabled || close_alike(changes.added.back())) return;
  if (!has_loop_task())
    consolidate_some(static_cast<std::size_t>(settings_.options.num_consolidated));
}

void GlobalMapper::place(const SubmapPlacement& placement) {
  const SubmapId submap = mapper_.map().resolve(placement.submap);
  mapper_.change(
      [&](Map& map, DirtyLandmarks&) { transform_submap(map, submap, placement.new_from_old); });
  schedule_.note_placement(submap);
  placement_ = placement;
}

void GlobalMapper::update_places(const Mapper::Changes& changes) {
  for (const KeyframeId id : changes.added) {
    const Keyframe& keyframe = mapper_.map().keyframes().at(id);
    places_.add(id, keyframe.submap, keyframe.features->corner_descriptors());
  }
  for (const KeyframeId id : changes.erased) places_.erase(id);
}

bool GlobalMapper::close(const LoopCandidate& candidate) {
  return close_moving(candidate).has_value();
}

std::optional<GlobalMapper::Moved> GlobalMapper::close_moving(const LoopCandidate& candidate) {
  history_.note_odometry(mapper_);
  const auto& keyframes = mapper_.map().keyframes();
  const bool is_loop = keyframes.at(candidate.query).submap == keyframes.at(candidate.match).submap;
  std::optional<Moved> moved = is_loop ? close_loop(candidate) : join(candidate);
  if (!moved) return std::nullopt;
  schedule_.note_closure(keyframes.at(candidate.query).submap);
  return moved;
}

GlobalMapper::Moved GlobalMapper::join(const LoopCandidate& candidate) {
  mapper_.change([&](Map& map, DirtyLandmarks& dirty) {
    join_submaps(map, places_, candidate, projection_, dirty);
  });
  ++num_joins_;
  return all_keyframes();
}

std::optional<GlobalMapper::Moved> GlobalMapper::close_loop(const LoopCandidate& candidate) {
  LoopPoseGraph spread = optimize_loop(mapper_.map(), as_loop(candidate));
  if (spread.chi_squared > max_chi_squared()) {
    const std::uint32_t num_placements = schedule_.num_placements();
    if (!is_accepted(as_loop(candidate))) return std::nullopt;
    if (schedule_.num_placements() != num_placements) {
      spread = optimize_loop(mapper_.map(), as_loop(candidate));
    }
  }
  mapper_.change([&](Map& map, DirtyLandmarks& dirty) {
    waymark::close_loop(map, candidate, spread.correction, projection_, dirty);
  });
  history_.note_closed();
  Moved moved;
  for (const auto& move : spread.correction.keyframes) moved.push_back(move.keyframe);
  return moved;
}

/// Whether odometry and the loops so far leave a new one standing.
bool GlobalMapper::is_accepted(const LoopEdge& loop) {
  const LoopHistory::Verdict verdict = history_.weigh(loop, mapper_);
  if (verdict.has_undone) {
    schedule_.note_placement(mapper_.map().keyframes().at(loop.to).submap);
  }
  return verdict.is_accepted;
}

bool GlobalMapper::close_alike(KeyframeId query) {
  const auto candidate = verifier_.verify_alike(mapper_.map(), places_, query);
  if (!candidate) return false;
  const std::optional<Moved> moved = close_moving(*candidate);
  if (!moved) return false;
  unconsolidated_.add(*moved, mapper_.map());
  return true;
}

std::vector<KeyframeId> GlobalMapper::all_keyframes() const {
  std::vector<KeyframeId> ids;
  mapper_.map().keyframes().for_each([&](KeyframeId id, const Keyframe&) { ids.push_back(id); });
  return ids;
}

bool GlobalMapper::close_with_neighbour(KeyframeId query, std::span<const KeyframeId> beside) {
  const auto candidate = verifier_.verify_spatial_neighbours(mapper_.map(), query, beside);
  return candidate && close(*candidate);
}

void GlobalMapper::consolidate_some(std::size_t max_count) {
  for (std::size_t i = 0; i < max_count; ++i) {
    const std::optional<KeyframeId> query = unconsolidated_.take(mapper_.map());
    if (!query) return;
    close_with_neighbour(
        *query, positions_.find_spatial_neighbours(mapper_.map(), *query, kSpatialNeighbours));
  }
}

void GlobalMapper::consolidate_rest() {
  std::optional<KeyframePositions> positions;
  while (const std::optional<KeyframeId> query = unconsolidated_.take(mapper_.map())) {
    if (!positions) positions.emplace(mapper_.map());
    // What was closed moved keyframes.
    if (close_with_neighbour(
            *query,
            positions->find_spatial_neighbours(mapper_.map(), *query, kSpatialNeighbours))) {
      positions.reset();
    }
  }
}

void GlobalMapper::apply(const AdjustmentTask& task, const GlobalAdjustment& adjustment) {
  if (!schedule_.confirm(task, mapper_.map())) return;
  history_.note_odometry(mapper_);
  schedule_.apply(task, adjustment, mapper_);
}

void GlobalMapper::refine_globally(bool with_calibration) {
  history_.note_odometry(mapper_);
  mapper_.refine_globally(with_calibration && mapper_.is_calibrating() &&
                          mapper_.map().keyframes().size() >= kFewestInTheEnd);
}

bool GlobalMapper::join_what_knows_the_same_markers() {
  int num_joined = 0;
  mapper_.change([&](Map& map, DirtyLandmarks&) { num_joined = join_by_markers(map, places_); });
  if (num_joined == 0) return false;
  schedule_.note_joins(static_cast<std::uint32_t>(num_joined));
  num_joins_ += num_joined;
  unconsolidated_.add(all_keyframes(), mapper_.map());
  return true;
}

void GlobalMapper::finish() {
  const std::uint32_t end = mapper_.map().keyframes().end_id().value;
  if (!settings_.enabled || end == 0) {
    refine_globally(true);
    markers_.place_all(mapper_);
    return;
  }
  if (mapper_.map().keyframes().contains(KeyframeId{end - 1})) close_alike(KeyframeId{end - 1});
  if (schedule_.num_closures() == 0) unconsolidated_.add(all_keyframes(), mapper_.map());
  consolidate();
  markers_.place_all(mapper_);
  if (join_what_knows_the_same_markers()) consolidate();
}

void GlobalMapper::consolidate() {
  refine_globally(true);
  consolidate_rest();
  mapper_.change([&](Map& map, DirtyLandmarks& dirty) { fuse_overlaps(map, projection_, dirty); });
  refine_globally(false);
}

MapSnapshot GlobalMapper::snapshot() {
  std::shared_ptr<const Map> map = mapper_.freeze();
  positions_.follow(map);
  return in_use_.add({std::move(map), std::make_shared<const PlaceIndex>(places_)});
}

}  // namespace waymark

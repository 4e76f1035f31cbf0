// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/loop/global_mapper.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "waymark/loop/beside.h"
#include "waymark/loop/close.h"
#include "waymark/loop/find.h"
#include "waymark/loop/join_by_markers.h"
#include "waymark/loop/odometry.h"
#include "waymark/loop/spread_drift.h"
#include "waymark/loop/undo.h"
#include "waymark/map/align.h"
#include "waymark/optimize/switch_edges.h"

namespace waymark {
namespace {

/// So many keyframes of a map are compared with what lies beside them per new keyframe.
constexpr std::size_t kNumConsolidatedPerKeyframe = 2;
/// Keyframes five steps away in the graph are known to each other well enough; of views further
/// apart ORB features change too much.
constexpr BesideOptions kBeside = {.num_known_steps = 5, .distance = 0.8, .angle_rad = 0.7};

/// Keyframes when the calibration is looked at first, then at twice as many and so on.
constexpr std::size_t kFirstCalibration = 30;
/// In the end so few are looked at: they tell the readout of a rolling shutter.
constexpr std::size_t kFewestInTheEnd = 5;

/// Placing and adjusting by turns: markers that were seen since the last survey join in.
constexpr int kMarkerPasses = 2;

/// Keyframes of a sub-map with markers when they are surveyed first, then at a quarter more.
constexpr std::size_t kFirstMarkerSurvey = 5;

/// A loop between keyframes so near to those of another says the same again.
constexpr std::uint32_t kBesideDisbelieved = 3;

/// How much less sure odometry is than the map, in standard deviations.
constexpr double kOdometrySigmas = 3.0;

/// Of a loop that needs no weighing against the others, see SpreadDrift: what switch_edges() lets
/// stand, as unsure as odometry is.
double max_contradiction() {
  const double max_residual = kOdometrySigmas * SwitchOptions().max_residual;
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
      seed_(seed),
      next_calibration_(kFirstCalibration),
      mapper_(rig, mapping, calibration),
      verifier_(rig, seed),
      projection_(rig),
      known_markers_(std::move(markers)),
      next_survey_(kFirstMarkerSurvey) {}

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
  const std::shared_ptr<const Rig> before = mapper_.calibration().rig;
  const Mapper::Changes changes = mapper_.add(message);
  look_with_calibration(before);
  update_places(changes);
  look_at_markers(changes.added.back());
  if (!settings_.enabled || close_alike(changes.added.back())) return;
  if (!has_loop_task()) consolidate_some(kNumConsolidatedPerKeyframe);
}

void GlobalMapper::update_places(const Mapper::Changes& changes) {
  for (const KeyframeId id : changes.added) {
    const Keyframe& keyframe = mapper_.map().keyframes().at(id);
    places_.add(id, keyframe.submap, keyframe.features->corner_descriptors());
  }
  for (const KeyframeId id : changes.erased) places_.erase(id);
}

bool GlobalMapper::close(const Revisit& revisit) { return close_moving(revisit).has_value(); }

std::optional<GlobalMapper::Moved> GlobalMapper::close_moving(const Revisit& revisit) {
  note_odometry();
  const auto& keyframes = mapper_.map().keyframes();
  const bool is_loop = keyframes.at(revisit.query).submap == keyframes.at(revisit.match).submap;
  std::optional<Moved> moved = is_loop ? close_loop(revisit) : join(revisit);
  if (!moved) return std::nullopt;
  ++num_closures_;
  unadjusted_ = keyframes.at(revisit.query).submap;
  return moved;
}

GlobalMapper::Moved GlobalMapper::join(const Revisit& revisit) {
  mapper_.change([&](Map& map, DirtyLandmarks& dirty) {
    join_submaps(map, places_, revisit, projection_, dirty);
  });
  ++num_joins_;
  return all_keyframes();
}

std::optional<GlobalMapper::Moved> GlobalMapper::close_loop(const Revisit& revisit) {
  SpreadDrift spread = spread_drift(mapper_.map(), as_loop(revisit));
  if (spread.contradiction > max_contradiction()) {
    const std::uint32_t num_placements = num_placements_;
    if (!agrees_with_loops(revisit)) return std::nullopt;
    if (num_placements_ != num_placements) spread = spread_drift(mapper_.map(), as_loop(revisit));
  }
  mapper_.change([&](Map& map, DirtyLandmarks& dirty) {
    waymark::close_loop(map, revisit, spread.correction, projection_, dirty);
  });
  ++num_loops_;
  Moved moved;
  for (const auto& move : spread.correction.keyframes) moved.push_back(move.keyframe);
  return moved;
}

/// Whether the loops so far leave a new one standing. If it is them that turn out to be false, they
/// are undone.
bool GlobalMapper::agrees_with_loops(const Revisit& revisit) {
  const Map& map = mapper_.map();
  const SubmapId submap = map.keyframes().at(revisit.query).submap;
  std::vector<LoopEdge> loops = map.measured_loop_edges();
  const std::size_t num_of_map = loops.size();
  loops.insert(loops.end(), disbelieved_.begin(), disbelieved_.end());
  // Nothing but the length of the way, which has been looked at, can contradict the first.
  if (loops.empty()) return true;
  loops.push_back(as_measured(map, as_loop(revisit)));
  const std::vector<std::uint8_t> is_on = choose_loops(map, submap, loops, num_of_map);
  std::vector<LoopEdge> also;
  for (std::size_t i = num_of_map; i < loops.size(); ++i) {
    if (is_on[i]) also.push_back(loops[i]);
  }
  undo(submap, std::span(is_on).first(num_of_map), also);
  if (!is_on.back()) disbelieve(loops.back());
  return is_on.back();
}

/// is_on: 1 or 0 per loop edge of the map. also: further loops that are believed.
void GlobalMapper::undo(SubmapId submap,
                        std::span<const std::uint8_t> is_on,
                        std::span<const LoopEdge> also) {
  const auto num_off = std::ranges::count(is_on, std::uint8_t{0});
  if (num_off == 0) return;
  for (std::size_t i = 0; i < is_on.size(); ++i) {
    if (!is_on[i]) disbelieve(mapper_.map().measured_loop_edges()[i]);
  }
  mapper_.change(
      [&](Map& map, DirtyLandmarks& dirty) { undo_loops(map, submap, is_on, also, dirty); });
  num_loops_ = std::max(num_loops_ - static_cast<int>(num_off), 0);
  // What is being adjusted holds what was undone.
  ++num_placements_;
  adjust_soon(submap);
}

void GlobalMapper::note_odometry() {
  mapper_.change([&](Map& map, DirtyLandmarks&) { waymark::note_odometry(map, end_of_odometry_); });
  end_of_odometry_ = mapper_.map().keyframes().end_id();
}

/// The pose graph does not do for now, however large the map is.
void GlobalMapper::adjust_soon(SubmapId submap) {
  unadjusted_ = submap;
  pace_.hurry();
}

void GlobalMapper::disbelieve(const LoopEdge& loop) {
  const auto is_beside = [](KeyframeId a, KeyframeId b) {
    return std::max(a.value, b.value) - std::min(a.value, b.value) <= kBesideDisbelieved;
  };
  const bool is_known = std::ranges::any_of(disbelieved_, [&](const LoopEdge& old) {
    return is_beside(old.from, loop.from) && is_beside(old.to, loop.to);
  });
  if (!is_known) disbelieved_.push_back(loop);
}

bool GlobalMapper::close_alike(KeyframeId query) {
  const auto revisit = verifier_.verify_alike(mapper_.map(), places_, query);
  if (!revisit) return false;
  const std::optional<Moved> moved = close_moving(*revisit);
  if (!moved) return false;
  consolidate_later(*moved);
  return true;
}

/// And what came since the last time.
void GlobalMapper::consolidate_later(std::span<const KeyframeId> keyframes) {
  unconsolidated_.insert(keyframes.begin(), keyframes.end());
  for (; end_of_noted_ < mapper_.map().keyframes().end_id(); ++end_of_noted_.value) {
    unconsolidated_.insert(unconsolidated_.end(), end_of_noted_);
  }
}

std::vector<KeyframeId> GlobalMapper::all_keyframes() const {
  std::vector<KeyframeId> ids;
  mapper_.map().keyframes().for_each([&](KeyframeId id, const Keyframe&) { ids.push_back(id); });
  return ids;
}

std::optional<KeyframeId> GlobalMapper::next_unconsolidated() {
  while (!unconsolidated_.empty()) {
    const KeyframeId id = unconsolidated_.extract(std::prev(unconsolidated_.end())).value();
    if (mapper_.map().keyframes().contains(id)) return id;
  }
  return std::nullopt;
}

bool GlobalMapper::close_one_beside(KeyframeId query, std::span<const KeyframeId> beside) {
  const auto revisit = verifier_.verify_beside(mapper_.map(), query, beside);
  return revisit && close(*revisit);
}

void GlobalMapper::consolidate_some(std::size_t max_count) {
  for (std::size_t i = 0; i < max_count; ++i) {
    const std::optional<KeyframeId> query = next_unconsolidated();
    if (!query) return;
    close_one_beside(*query, positions_.find_beside(mapper_.map(), *query, kBeside));
  }
}

void GlobalMapper::consolidate_rest() {
  std::optional<KeyframePositions> positions;
  while (const std::optional<KeyframeId> query = next_unconsolidated()) {
    if (!positions) positions.emplace(mapper_.map());
    // What was closed moved keyframes.
    if (close_one_beside(*query, positions->find_beside(mapper_.map(), *query, kBeside))) {
      positions.reset();
    }
  }
}

GlobalAdjustment AdjustmentTask::adjust() const {
  GlobalAdjustment adjustment =
      calibration ? adjust_with_calibration(*map, *calibration) : adjust_globally(*map, submap);
  return is_for_calibration && !adjustment.calibration ? GlobalAdjustment{} : adjustment;
}

std::optional<AdjustmentTask> GlobalMapper::take_task() {
  const std::size_t num_keyframes = mapper_.map().keyframes().size();
  const bool is_calibration_due = mapper_.is_calibrating() && num_keyframes >= next_calibration_ &&
                                  num_keyframes <= kMaxAdjustedAtOnce;
  if (!has_loop_task() && !is_calibration_due) return std::nullopt;
  AdjustmentTask task;
  task.is_for_calibration = !unadjusted_.is_valid();
  task.submap = task.is_for_calibration
                    ? submaps_by_size(mapper_.map()).front()
                    : mapper_.map().resolve(std::exchange(unadjusted_, SubmapId{}));
  if (!task.is_for_calibration) pace_.note(num_keyframes);
  task.num_closures = num_closures_;
  task.num_placements = num_placements_;
  if (mapper_.is_calibrating()) {
    task.calibration = mapper_.calibration();
    if (is_calibration_due) next_calibration_ *= 2;
  }
  task.map = mapper_.freeze();
  return task;
}

void GlobalMapper::apply(const AdjustmentTask& task, const GlobalAdjustment& adjustment) {
  if (task.num_placements != num_placements_) {
    if (!task.is_for_calibration && !unadjusted_.is_valid()) {
      adjust_soon(mapper_.map().resolve(task.submap));
    }
    return;
  }
  const std::shared_ptr<const Rig> before = mapper_.calibration().rig;
  note_odometry();
  if (task.num_closures == num_closures_) {
    mapper_.apply(adjustment);
  } else {
    GlobalAdjustment rebased = adjustment;
    rebase(*task.map, mapper_.map(), rebased);
    mapper_.apply(rebased);
  }
  look_with_calibration(before);
}

void GlobalMapper::look_with_calibration(const std::shared_ptr<const Rig>& before) {
  const std::shared_ptr<const Rig>& rig = mapper_.calibration().rig;
  if (rig != before) verifier_ = RevisitVerifier(rig, seed_);
}

void GlobalMapper::refine_globally(bool with_calibration) {
  const std::shared_ptr<const Rig> before = mapper_.calibration().rig;
  note_odometry();
  mapper_.refine_globally(with_calibration && mapper_.is_calibrating() &&
                          mapper_.map().keyframes().size() >= kFewestInTheEnd);
  look_with_calibration(before);
}

/// Puts the map into the frame of its markers once they tell it, and what is seen of them later
/// to where it belongs in that.
void GlobalMapper::look_at_markers(KeyframeId newest) {
  const Keyframe* keyframe = mapper_.map().keyframes().find(newest);
  if (!known_markers_ || !keyframe || !keyframe->markers) return;
  const SubmapId submap = keyframe->submap;
  const std::size_t count = count_marker_keyframes(mapper_.map(), submap);
  if (count < next_survey_) return;
  next_survey_ = count + std::max<std::size_t>(count / 4, 1);
  marker_survey_ = survey_markers(mapper_.map(), submap, *known_markers_);
  if (!is_firm(marker_survey_)) return;
  const MarkerFrame::Basis basis = marker_survey_.frame->basis;
  const auto placed = placed_.find(submap);
  const bool is_to_move = placed == placed_.end() || placed->second < basis;
  mapper_.change([&](Map& map, DirtyLandmarks&) {
    if (is_to_move) {
      place_by_markers(map, submap, *known_markers_, marker_survey_);
    } else {
      note_markers(map, submap, *known_markers_, marker_survey_, Sim3());
    }
  });
  if (!is_to_move) return;
  placed_[submap] = basis;
  // What is being adjusted is of another frame; what comes next has the markers with it.
  ++num_placements_;
  adjust_soon(submap);
}

/// The end: places all sub-maps, the largest first, whose markers then are known to the others, and
/// adjusts them with their markers. What has a scale by these is in metres.
void GlobalMapper::place_rest_by_markers() {
  if (!known_markers_) return;
  KnownMarkers known = *known_markers_;
  const std::vector<SubmapId> submaps = submaps_by_size(mapper_.map());
  for (const SubmapId submap : submaps) {
    MarkerSurvey survey = survey_markers(mapper_.map(), submap, known);
    for (int pass = 0; survey.frame && pass < kMarkerPasses; ++pass) {
      mapper_.change(
          [&](Map& map, DirtyLandmarks&) { place_by_markers(map, submap, known, survey); });
      mapper_.apply(adjust_globally(mapper_.map(), submap));
      survey = survey_markers(mapper_.map(), submap, known);
    }
    if (survey.frame) {
      mapper_.change([&](Map& map, DirtyLandmarks&) {
        place_by_markers(map, submap, known, survey);
        if (!map.submaps()[submap.value].is_metric) map = declare_metric(map, submap);
      });
      known = with_placed_markers(mapper_.map(), submap, known);
    }
    if (submap == submaps.front()) marker_survey_ = std::move(survey);
  }
}

bool GlobalMapper::join_what_knows_the_same_markers() {
  int num_joined = 0;
  mapper_.change([&](Map& map, DirtyLandmarks&) { num_joined = join_by_markers(map, places_); });
  if (num_joined == 0) return false;
  num_closures_ += static_cast<std::uint32_t>(num_joined);
  num_joins_ += num_joined;
  consolidate_later(all_keyframes());
  return true;
}

void GlobalMapper::finish() {
  const std::uint32_t end = mapper_.map().keyframes().end_id().value;
  if (!settings_.enabled || end == 0) {
    refine_globally(true);
    place_rest_by_markers();
    return;
  }
  if (mapper_.map().keyframes().contains(KeyframeId{end - 1})) close_alike(KeyframeId{end - 1});
  if (num_closures_ == 0) consolidate_later(all_keyframes());
  consolidate();
  place_rest_by_markers();
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

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/loop/global_mapper.h"

#include <utility>

#include "waymark/loop/loop_closing.h"
#include "waymark/loop/overlaps.h"

namespace waymark {
namespace {

/// So many keyframes of a map are compared with what lies beside them per new keyframe.
constexpr std::size_t kNumLinksPerKeyframe = 2;

}  // namespace

GlobalMapper::GlobalMapper(std::shared_ptr<const Rig> rig,
                           const MappingSettings& mapping,
                           const LoopSettings& loop,
                           std::uint64_t seed)
    : settings_(loop),
      mapper_(rig, mapping),
      finder_(rig, seed),
      link_finder_(rig, seed),
      projection_(rig) {}

void GlobalMapper::take_over(const MapSnapshot& before) {
  mapper_.take_over(*before.map);
  places_ = *before.places;
}

void GlobalMapper::add(const NewSubmap& message) { update_places(mapper_.add(message)); }

void GlobalMapper::add(const NewKeyframe& message) {
  const Mapper::Changes changes = mapper_.add(message);
  update_places(changes);
  if (!settings_.enabled || close_loop_at(changes.added.back())) return;
  if (!unadjusted_.is_valid()) look_for_links(kNumLinksPerKeyframe);
}

void GlobalMapper::update_places(const Mapper::Changes& changes) {
  for (const KeyframeId id : changes.added) {
    const Keyframe& keyframe = mapper_.map().keyframes().at(id);
    places_.add(id, keyframe.submap, keyframe.features->descriptors);
  }
  for (const KeyframeId id : changes.erased) places_.erase(id);
}

bool GlobalMapper::close_loop_at(KeyframeId query) {
  const std::optional<Revisit> revisit = finder_.find(mapper_.map(), places_, query);
  if (!revisit) return false;
  bool is_join = false;
  mapper_.change([&](Map& map, DirtyLandmarks& dirty) {
    is_join = close_revisit(map, places_, *revisit, projection_, dirty);
  });
  num_loops_ += !is_join;
  ++num_closures_;
  unadjusted_ = mapper_.map().keyframes().at(query).submap;
  unlinked_.clear();
  mapper_.map().keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    if (keyframe.submap == unadjusted_) unlinked_.push_back(id);
  });
  return true;
}

/// A closure brings parts of the map together that may touch elsewhere, too.
void GlobalMapper::look_for_links(std::size_t max_count) {
  for (std::size_t i = 0; i < max_count && !unlinked_.empty(); ++i) {
    const KeyframeId query = unlinked_.back();
    unlinked_.pop_back();
    if (!mapper_.map().keyframes().contains(query)) continue;
    const std::optional<Revisit> link = link_finder_.find(mapper_.map(), query);
    if (!link) continue;
    mapper_.change(
        [&](Map& map, DirtyLandmarks& dirty) { close_loop(map, *link, projection_, dirty); });
    ++num_loops_;
    ++num_closures_;
    unadjusted_ = mapper_.map().keyframes().at(query).submap;
  }
}

std::optional<AdjustmentTask> GlobalMapper::take_task() {
  if (!unadjusted_.is_valid()) return std::nullopt;
  const SubmapId submap = mapper_.map().resolve(std::exchange(unadjusted_, SubmapId{}));
  return AdjustmentTask{mapper_.freeze(), submap, num_closures_};
}

void GlobalMapper::apply(const AdjustmentTask& task, const GlobalAdjustment& adjustment) {
  if (task.num_closures != num_closures_) return;
  mapper_.change(
      [&](Map& map, DirtyLandmarks& dirty) { apply_adjustment(map, adjustment, dirty); });
}

void GlobalMapper::finish() {
  const std::uint32_t end = mapper_.map().keyframes().end_id().value;
  if (!settings_.enabled || end == 0) {
    mapper_.refine_globally();
    return;
  }
  if (mapper_.map().keyframes().contains(KeyframeId{end - 1})) close_loop_at(KeyframeId{end - 1});
  mapper_.refine_globally();
  if (num_closures_ == 0) {
    mapper_.map().keyframes().for_each(
        [&](KeyframeId id, const Keyframe&) { unlinked_.push_back(id); });
  }
  look_for_links(unlinked_.size());
  mapper_.change([&](Map& map, DirtyLandmarks& dirty) { fuse_overlaps(map, projection_, dirty); });
  mapper_.refine_globally();
}

MapSnapshot GlobalMapper::snapshot() {
  return {mapper_.freeze(), std::make_shared<const PlaceIndex>(places_)};
}

}  // namespace waymark

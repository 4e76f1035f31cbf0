// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <memory_resource>
#include <utility>
#include <vector>

#include "waymark/loop/global_mapper.h"
#include "waymark/system/settings.h"
#include "waymark/system/workers.h"

namespace waymark {

/// The back end of a session: maps what the tracker sends, closes loops, has the whole adjusted
/// beside, and shows what comes of it at fixed frames. All but the maps that it publishes belongs
/// to its own threads, and to the caller's once finish() has ended these.
class BackEnd {
 public:
  /// rig: as it is given.
  BackEnd(std::shared_ptr<const Rig> rig, const Settings& settings, Timing timing);

  /// Goes on with a map made before; before the first message.
  void take_over(const MapSnapshot& before) { mapper_.take_over(before); }

  /// The map keeps in this memory what only searching and joining need; before the first message.
  void keep_map_in(std::shared_ptr<std::pmr::memory_resource> memory);
  /// The one that was given; null: the heap.
  const std::shared_ptr<std::pmr::memory_resource>& map_memory() const { return map_memory_; }

  /// Brings what is visible up to what a frame may see, and has an adjustment taken in that is due.
  void update(FrameId frame, PublishedMap& visible);
  /// Sends what a frame gave.
  void send(FrameId frame, MapperMessage message);
  /// Has a part of the map moved after what was sent before.
  void place(FrameId frame, const SubmapPlacement& placement);
  /// Whether send() waits for what the mapper does with such a message.
  bool waits_for(const MapperMessage& message) const;

  /// Ends the threads once all is done that was sent.
  void end_threads();
  /// After that: how the rig moved at keyframes, then the last loops and adjustments. Gives the
  /// final map.
  PublishedMap finish(const std::vector<std::pair<KeyframeId, RigMotion>>& motions);
  /// After end_threads().
  const Map& map() const { return mapper_.map(); }
  /// After finish().
  const MarkerSurvey& marker_survey() const { return mapper_.marker_survey(); }

 private:
  std::shared_ptr<const PublishedMap> process(const MapTask& task);
  void add(const MapperMessage& message);
  bool is_due(FrameId frame) const;
  void finish_adjustment();
  PublishedMap publish() const;

  const Settings settings_;
  const Timing timing_;

  // The caller's thread.
  FrameId last_due_;  ///< The global adjustment that was asked for last.
  std::shared_ptr<std::pmr::memory_resource> map_memory_;

  // The mapper's thread.
  GlobalMapper mapper_;
  AdjustmentWorker adjuster_;
  FrameId adjustment_due_;
  std::vector<double> mapping_ms_;
  MapSnapshot published_;

  // Between the two; last, so that its thread ends before what it works on.
  MapWorker worker_;
};

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

#include "waymark/loop/adjustment_interval.h"
#include "waymark/mapping/global_adjustment.h"
#include "waymark/mapping/mapper.h"

namespace waymark {

/// The sub-map that is to be adjusted as a whole, as it was when that was decided. Immutable.
struct AdjustmentTask {
  std::shared_ptr<const Map> map;
  SubmapId submap;
  std::uint32_t num_closures = 0;    ///< Loops closed and sub-maps joined before.
  std::uint32_t num_placements = 0;  ///< Sub-maps moved by their markers, loops undone before.
  /// What is to be adjusted along, if anything.
  std::optional<KnownCalibration> calibration = std::nullopt;
  bool is_for_calibration = false;  ///< Without a new calibration nothing is to change.

  /// Does it.
  GlobalAdjustment adjust() const;
};

/// When the whole of a map is to be adjusted, and whether what was found still fits it.
class AdjustmentSchedule {
 public:
  /// A loop was closed or two sub-maps joined, by a pose graph only; submap: what it is in now.
  void note_closure(SubmapId submap) {
    ++num_closures_;
    unadjusted_ = submap;
  }
  /// Sub-maps were joined otherwise, and need no adjustment for that.
  void note_joins(std::uint32_t count) { num_closures_ += count; }
  /// A sub-map was moved by its markers, or a loop undone: what is being adjusted is of no use.
  void note_placement(SubmapId submap) {
    ++num_placements_;
    adjust_soon(submap);
  }

  std::uint32_t num_closures() const { return num_closures_; }
  std::uint32_t num_placements() const { return num_placements_; }

  /// Whether loops made an adjustment necessary.
  bool is_due(const Map& map) const {
    return unadjusted_.is_valid() && pace_.is_due(map.keyframes().size());
  }
  /// The adjustment that is due now: for loops, or where it may tell the calibration.
  std::optional<AdjustmentTask> take(Mapper& mapper);

  /// Takes in what a task gave, carried over where a loop was closed meanwhile; not at all where
  /// something was moved otherwise: then a new task follows.
  void apply(const AdjustmentTask& task, const GlobalAdjustment& adjustment, Mapper& mapper) const;
  /// Whether nothing was moved since but by loops; if not, it is due again.
  bool confirm(const AdjustmentTask& task, const Map& map);

 private:
  /// Keyframes when the calibration is looked at first, then at twice as many and so on.
  static constexpr std::size_t kFirstCalibration = 30;

  /// The pose graph does not do for now, however large the map is.
  void adjust_soon(SubmapId submap) {
    unadjusted_ = submap;
    pace_.hurry();
  }

  AdjustmentInterval pace_;
  SubmapId unadjusted_;  ///< Whose loops are closed by a pose graph only; invalid if none.
  std::size_t next_calibration_ = kFirstCalibration;  ///< Keyframes of the map when it is due.
  std::uint32_t num_closures_ = 0;
  std::uint32_t num_placements_ = 0;
};

}  // namespace waymark

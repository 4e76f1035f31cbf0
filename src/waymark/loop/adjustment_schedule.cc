// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/loop/adjustment_schedule.h"

#include <utility>

namespace waymark {

GlobalAdjustment AdjustmentTask::adjust() const {
  GlobalAdjustment adjustment =
      calibration ? adjust_with_calibration(*map, *calibration) : adjust_globally(*map, submap);
  return is_for_calibration && !adjustment.calibration ? GlobalAdjustment{} : adjustment;
}

std::optional<AdjustmentTask> AdjustmentSchedule::take(Mapper& mapper) {
  const std::size_t num_keyframes = mapper.map().keyframes().size();
  const bool is_calibration_due = mapper.is_calibrating() && num_keyframes >= next_calibration_ &&
                                  num_keyframes <= kMaxAdjustedAtOnce;
  if (!is_due(mapper.map()) && !is_calibration_due) return std::nullopt;
  AdjustmentTask task;
  task.is_for_calibration = !unadjusted_.is_valid();
  task.submap = task.is_for_calibration
                    ? submaps_by_size(mapper.map()).front()
                    : mapper.map().resolve(std::exchange(unadjusted_, SubmapId{}));
  if (!task.is_for_calibration) pace_.note(num_keyframes);
  task.num_closures = num_closures_;
  task.num_placements = num_placements_;
  if (mapper.is_calibrating()) {
    task.calibration = mapper.calibration();
    if (is_calibration_due) next_calibration_ *= 2;
  }
  task.map = mapper.freeze();
  return task;
}

bool AdjustmentSchedule::confirm(const AdjustmentTask& task, const Map& map) {
  if (task.num_placements == num_placements_) return true;
  if (!task.is_for_calibration && !unadjusted_.is_valid()) adjust_soon(map.resolve(task.submap));
  return false;
}

void AdjustmentSchedule::apply(const AdjustmentTask& task,
                               const GlobalAdjustment& adjustment,
                               Mapper& mapper) const {
  if (task.num_closures == num_closures_) {
    mapper.apply(adjustment);
    return;
  }
  GlobalAdjustment rebased = adjustment;
  rebase(*task.map, mapper.map(), rebased);
  mapper.apply(rebased);
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/system/back_end.h"

#include <chrono>
#include <variant>

#include "waymark/marker/known_markers.h"

namespace waymark {

BackEnd::BackEnd(std::shared_ptr<const Rig> rig, const Settings& settings, Timing timing)
    : settings_(settings),
      timing_(timing),
      mapper_(std::move(rig),
              settings.mapping,
              settings.loop,
              settings.calibration,
              static_cast<std::uint64_t>(settings.seed),
              markers_to_look_for(settings.markers)),
      adjuster_(timing),
      worker_(timing, [this](const MapTask& task) { return process(task); }) {}

void BackEnd::keep_map_in(std::shared_ptr<std::pmr::memory_resource> memory) {
  mapper_.keep_in(memory);
  map_memory_ = std::move(memory);
}

void BackEnd::update(FrameId frame, PublishedMap& visible) {
  if (const auto published = worker_.for_frame(frame)) visible = *published;
  const FrameId due = visible.adjustment_due;
  if (!due.is_valid() || due == last_due_) return;
  // In real time it is due once it is there.
  if (timing_ == Timing::kRealtime ? !adjuster_.has_result() : due > frame) return;
  last_due_ = due;
  worker_.send(FrameId{frame.value + 1}, {frame, std::nullopt});
}

bool BackEnd::waits_for(const MapperMessage& message) const {
  // The mapper works in send() in kInline, and what kRealtime has to wait for is a sub-map.
  const bool is_submap = std::holds_alternative<NewSubmap>(message);
  return timing_ == Timing::kInline || (timing_ == Timing::kRealtime && is_submap);
}

void BackEnd::send(FrameId frame, MapperMessage message) {
  // A new sub-map is what the next frame is tracked in; a keyframe shows its effect later.
  const bool is_submap = std::holds_alternative<NewSubmap>(message);
  const auto latency = is_submap ? 1u : static_cast<std::uint32_t>(settings_.map_latency);
  worker_.send(FrameId{frame.value + latency}, {frame, std::move(message)});
  if (is_submap && timing_ == Timing::kRealtime) worker_.wait();
}

void BackEnd::place(FrameId frame, const SubmapPlacement& placement) {
  const auto latency = static_cast<std::uint32_t>(settings_.map_latency);
  worker_.send(FrameId{frame.value + latency}, {frame, std::nullopt, placement});
}

std::shared_ptr<const PublishedMap> BackEnd::process(const MapTask& task) {
  if (task.message) {
    add(*task.message);
    published_ = mapper_.snapshot();
  } else if (task.placement) {
    mapper_.place(*task.placement);
    published_ = mapper_.snapshot();
  } else if (is_due(task.frame)) {
    finish_adjustment();
  }
  // A loop does not wait for an estimate that it makes out of date.
  if (adjuster_.is_busy_with_calibration() && mapper_.has_loop_task()) adjuster_.finish();
  if (!adjuster_.is_busy()) {
    if (auto adjustment = mapper_.take_task()) {
      adjuster_.start(*std::move(adjustment));
      adjustment_due_ =
          FrameId{task.frame.value + static_cast<std::uint32_t>(settings_.global_latency)};
    }
  }
  return std::make_shared<const PublishedMap>(publish());
}

void BackEnd::add(const MapperMessage& message) {
  const auto start = std::chrono::steady_clock::now();
  std::visit([&](const auto& content) { mapper_.add(content); }, message);
  mapping_ms_.push_back(
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
}

/// Not if the adjustment that was asked for has been dropped, and another one begun.
bool BackEnd::is_due(FrameId frame) const {
  return adjuster_.is_busy() && (timing_ == Timing::kRealtime || adjustment_due_ <= frame);
}

void BackEnd::finish_adjustment() {
  const AdjustmentWorker::Result result = adjuster_.finish();
  adjustment_due_ = FrameId{};
  // The tracker goes on with the very map that it has where nothing came of it.
  if (result.task.is_for_calibration && !result.adjustment.calibration) return;
  mapper_.apply(result.task, result.adjustment);
  published_ = mapper_.snapshot();
}

PublishedMap BackEnd::publish() const {
  return {published_,
          mapper_.calibration(),
          adjustment_due_,
          mapper_.num_loops(),
          mapping_ms_,
          mapper_.placement()};
}

void BackEnd::end_threads() {
  try {
    worker_.finish();
  } catch (...) {
    adjuster_.stop();  // What may be short, memory above all, is needed to save what there is.
    throw;
  }
  if (adjuster_.is_busy()) finish_adjustment();
}

PublishedMap BackEnd::finish(const std::vector<std::pair<KeyframeId, RigMotion>>& motions) {
  for (const auto& [id, motion] : motions) mapper_.set_motion(id, motion);
  mapper_.finish();
  published_ = mapper_.snapshot();
  return publish();
}

}  // namespace waymark

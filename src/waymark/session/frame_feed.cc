// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/session/frame_feed.h"

#include <sys/resource.h>

#include <algorithm>
#include <iterator>
#include <map>

namespace waymark {
namespace {

double cpu_seconds(const rusage& usage) {
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

rusage resources() {
  rusage usage = {};
  getrusage(RUSAGE_SELF, &usage);
  return usage;
}

FrameRecord record_of_fault(const InputFrame& frame) {
  FrameRecord record;
  record.index = static_cast<std::uint32_t>(frame.index);
  record.timestamp_ns = frame.timestamp_ns;
  record.has_warning = !frame.warning.empty();
  if (frame.fault == FrameFault::kLate) {
    record.state = FrameState::kDropped;
    record.reason = FrameReason::kLate;
    return record;
  }
  record.state = FrameState::kUnreadable;
  record.reason = frame.fault == FrameFault::kWrongSize ? FrameReason::kWrongSize
                                                        : FrameReason::kUnreadableImage;
  return record;
}

FrameRecord record_of_result(const InputFrame& frame,
                             ImageView image0,
                             const TrackingResult& result) {
  FrameRecord record;
  record.index = static_cast<std::uint32_t>(frame.index);
  record.timestamp_ns = frame.timestamp_ns;
  record.has_warning = !frame.warning.empty();
  static_cast<FrameStatus&>(record) = result;
  record.is_keyframe = result.is_keyframe;
  record.is_relocalized = result.is_relocalized;
  record.num_features =
      static_cast<std::uint16_t>(std::min<std::uint32_t>(result.num_features, UINT16_MAX));
  record.picture = measure_image(image0);
  record.set_stages(result.stages.ms);
  return record;
}

/// Feeds a frame, unless it has a fault, and adds its row.
void add_frame(const InputFrame& frame,
               const FrameImages& images,
               const std::function<TrackingResult(const FrameImages&)>& feed,
               FedFrames& frames) {
  if (frame.fault != FrameFault::kNone) {
    frames.table.frames.push_back(record_of_fault(frame));
    return;
  }
  const TrackingResult result = feed(images);
  if (result.frame == FrameId{0}) forget_session(frames);
  frames.fed.push_back(static_cast<std::uint32_t>(frames.table.frames.size()));
  frames.tracking_ms.push_back(static_cast<float>(result.stages.tracking_ms()));
  frames.table.frames.push_back(record_of_result(frame, images.image0, result));
}

}  // namespace

void forget_session(FedFrames& frames) {
  for (const std::size_t row : frames.fed) frames.table.frames[row].submap = SubmapId{};
  frames.fed.clear();
}

FedFrames feed_all(Input& input,
                   const std::function<TrackingResult(const FrameImages&)>& feed,
                   const std::function<bool()>& should_stop,
                   const FrameObserver& observer,
                   const EarlyStages& stages) {
  FedFrames frames;
  // Rows of all frames that there may be, rather than twice as many now and then.
  constexpr std::size_t kMaxExpected = 1'000'000;
  const std::size_t num_expected = std::min(input.info().num_frames.value_or(0), kMaxExpected);
  frames.table.frames.reserve(num_expected);
  frames.fed.reserve(num_expected);
  frames.tracking_ms.reserve(num_expected);
  frames.table.stages.assign(kStageNames.begin(), kStageNames.end());
  FramePipeline pipeline(input, stages);
  const auto feed_frame = [&](const InputFrame& frame, const FrameImages& images) {
    add_frame(frame, images, feed, frames);
    if (!frame.name.empty()) frames.table.names.push_back(frame.name);
    if (observer) observer(frames.table.frames.back(), frame.warning);
  };
  try {
    while (!should_stop || !should_stop()) {
      if (!pipeline.feed_next(feed_frame)) break;
    }
  } catch (...) {
    if (frames.fed.empty()) throw;
    frames.failure = std::current_exception();
  }
  frames.table.has_times = frames.table.names.empty() || input.info().has_times;
  return frames;
}

std::vector<SubmapTrajectory> split_by_submap(
    const std::vector<std::pair<SubmapId, StampedPose>>& frames) {
  std::map<SubmapId, std::size_t> counts;
  for (const auto& [submap, pose] : frames) ++counts[submap];
  std::map<SubmapId, std::vector<StampedPose>> by_submap;
  for (const auto& [submap, count] : counts) by_submap[submap].reserve(count);
  for (const auto& [submap, pose] : frames) by_submap[submap].push_back(pose);
  std::vector<SubmapTrajectory> parts(std::make_move_iterator(by_submap.begin()),
                                      std::make_move_iterator(by_submap.end()));
  std::stable_sort(parts.begin(), parts.end(), [](const auto& a, const auto& b) {
    return a.second.size() > b.second.size();
  });
  return parts;
}

UsageMeter::UsageMeter()
    : start_(std::chrono::steady_clock::now()), cpu_start_s_(cpu_seconds(resources())) {}

void UsageMeter::write_to(RunSummary& summary) const {
  const rusage usage = resources();
  const auto elapsed = std::chrono::steady_clock::now() - start_;
  summary.wall_s = std::chrono::duration<double>(elapsed).count();
  summary.cpu_s = cpu_seconds(usage) - cpu_start_s_;
  summary.peak_rss_mb = static_cast<double>(usage.ru_maxrss) / 1024.0;  // From kB.
}

}  // namespace waymark

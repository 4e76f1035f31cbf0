// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/session/calibration_monitor.h"

#include "waymark/base/median.h"
#include "waymark/session/calibration_advice.h"

namespace waymark {
namespace {

/// Images are looked at now and then, so that some show more than the first.
constexpr int kPairEvery = 5;
constexpr int kNumPairs = 3;
constexpr int kDepthEvery = 10;
constexpr int kNumDepths = 15;
constexpr std::size_t kNumIntervals = 10;

}  // namespace

CalibrationMonitor::CalibrationMonitor(const PreparedInput& input, Listener listener)
    : listener_(std::move(listener)),
      rig_(input.rig),
      units_per_metre_(input.settings.depth.factor) {
  const InputInfo& info = input.input->info();
  if (info.calibration) {
    for (const std::string& line : advise_on_numbers(*info.calibration)) report(line);
  }
  const Settings& settings = input.settings;
  if (info.setup == Setup::kStereo) {
    pair_.emplace(input.rig,
                  FrameSettings{settings.features, settings.stereo, settings.depth, settings.view});
  }
  if (info.setup == Setup::kRgbd) depth_.emplace();
}

void CalibrationMonitor::compare_with(std::shared_ptr<const Map> map) {
  if (depth_) map_depth_.emplace(std::move(map), rig_);
}

void CalibrationMonitor::report(const std::optional<std::string>& mistake) {
  if (!mistake) return;
  mistakes_.push_back("calibration: " + *mistake);
  if (listener_) listener_(mistakes_.back());
}

void CalibrationMonitor::add_time(std::size_t index, std::int64_t timestamp_ns) {
  if (are_times_known_) return;
  if (last_time_ && index > last_time_->first) {
    intervals_ns_.push_back(static_cast<double>(timestamp_ns - last_time_->second) /
                            static_cast<double>(index - last_time_->first));
  }
  last_time_ = {index, timestamp_ns};
  if (intervals_ns_.size() == kNumIntervals) decide_on_times();
}

void CalibrationMonitor::add(const FrameImages& images,
                             const TrackingResult& result,
                             const System& system) {
  const int at = num_fed_++;
  const Features* features = system.result().features.get();
  if (pair_ && features && !images.image1.is_empty() && at % kPairEvery == 0) {
    pair_->add(images, *features);
    if (pair_->num_images() == kNumPairs) decide_on_pair();
  }
  if (depth_ && !images.depth.is_empty() && at % kDepthEvery == 0) {
    depth_->add(images.image0, images.depth);
    if (depth_->num_images() == kNumDepths) decide_on_depth();
  }
  if (map_depth_) map_depth_->add(images, result);
}

void CalibrationMonitor::finish() {
  decide_on_times();
  decide_on_pair();
  decide_on_depth();
  if (map_depth_) report(map_depth_->advise(units_per_metre_));
}

void CalibrationMonitor::decide_on_times() {
  if (are_times_known_ || intervals_ns_.empty()) return;
  are_times_known_ = true;
  report(advise_on_times(median(intervals_ns_)));
}

void CalibrationMonitor::decide_on_pair() {
  if (!pair_) return;
  report(pair_->advise());
  pair_.reset();
}

void CalibrationMonitor::decide_on_depth() {
  if (!depth_) return;
  report(depth_->advise_on_units(units_per_metre_));
  report(depth_->advise_on_registration());
  depth_.reset();
}

}  // namespace waymark

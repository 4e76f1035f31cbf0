// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/system/feature_prefetch.h"

#include <utility>

namespace waymark {

void FeaturePrefetch::prepare(const FrameImages& images, std::shared_ptr<const void> owner) {
  // How the first images are looked at depends on those before.
  if (builder_.is_learning() || frames_.size() >= capacity()) return;
  if (!frames_.empty() && images.timestamp_ns <= frames_.back().images.timestamp_ns) return;
  begin({images, std::move(owner), builder_.view()});
}

void FeaturePrefetch::begin(Prepared frame) {
  if (!work_) {
    for (unsigned i = 0; i < num_threads_; ++i) finders_.emplace_back(frame.view.rig, settings_);
    work_.emplace(num_threads_, capacity());
  }
  frames_.push_back(std::move(frame));
  work_->give([this, frame = frames_.back()](unsigned thread) {
    return finders_[thread].find(frame.images, frame.view);
  });
}

std::optional<FoundFrame> FeaturePrefetch::take(const FrameImages& images) {
  const auto is_over = [&](const FrameImages& prepared) {
    return prepared.timestamp_ns < images.timestamp_ns ||
           (prepared.timestamp_ns == images.timestamp_ns &&
            prepared.image0.data != images.image0.data);
  };
  while (!frames_.empty() && is_over(frames_.front().images)) {
    frames_.pop_front();
    work_->drop();
  }
  if (frames_.empty() || frames_.front().images.timestamp_ns != images.timestamp_ns) {
    return std::nullopt;
  }
  if (frames_.front().view != builder_.view()) begin_anew();
  frames_.pop_front();
  return work_->take();
}

/// What was found so far is of no use; what has not begun is left out.
void FeaturePrefetch::begin_anew() {
  std::deque<Prepared> frames;
  frames.swap(frames_);
  while (work_->size() > 0) work_->drop();
  for (Prepared& frame : frames) begin({frame.images, std::move(frame.owner), builder_.view()});
}

}  // namespace waymark

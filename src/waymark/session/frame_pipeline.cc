// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/session/frame_pipeline.h"

#include <algorithm>
#include <utility>

namespace waymark {
namespace {

FrameImages borrow(const InputFrame& frame) {
  FrameImages images;
  if (frame.fault != FrameFault::kNone) return images;
  images.timestamp_ns = frame.timestamp_ns;
  images.image0 = frame.images.at(0).view();
  if (frame.images.size() > 1) images.image1 = frame.images[1].view();
  if (frame.depth) images.depth = frame.depth->view();
  images.depth_lag_ns = frame.depth_lag_ns;
  if (frame.mask) images.mask = frame.mask->view();
  return images;
}

}  // namespace

FramePipeline::FramePipeline(Input& input, EarlyStages stages)
    : input_(input), stages_(std::move(stages)) {
  if (stages_.num_prepared == 0 || !input.can_decode_apart()) return;
  const unsigned num_decoders = std::max(stages_.num_decoders, 1u);
  // Two per thread: a frame that takes longer than its neighbours stops nobody.
  decoded_.emplace(num_decoders, 2 * std::size_t{num_decoders});
}

bool FramePipeline::feed_next(const Feed& feed) {
  const std::size_t num_waiting = std::min(stages_.num_prepared, kMaxPrepared);
  while (!has_ended_ && prepared_.size() <= num_waiting) prepare_next();
  if (prepared_.empty()) {
    if (failure_) std::rethrow_exception(failure_);
    return false;
  }
  const std::shared_ptr<const Prepared> next = std::move(prepared_.front());
  prepared_.pop_front();
  feed(next->frame, next->images);
  return true;
}

void FramePipeline::prepare_next() {
  std::optional<InputFrame> frame;
  try {
    frame = decode_next();
  } catch (...) {
    failure_ = std::current_exception();
  }
  has_ended_ = !frame;
  if (!frame) return;
  const auto next = std::make_shared<Prepared>(Prepared{*std::move(frame), {}});
  next->images = borrow(next->frame);
  prepared_.push_back(next);
  const bool is_fed = next->frame.fault == FrameFault::kNone;
  if (is_fed && stages_.num_prepared > 0) stages_.prepare(next->images, next);
}

std::optional<InputFrame> FramePipeline::decode_next() {
  std::optional<InputFrame> frame;
  if (decoded_) {
    while (!is_read_ && !decoded_->is_full()) begin_decoding();
    if (decoded_->size() == 0) return std::nullopt;
    frame = decoded_->take();
    input_.complete(*frame);
  } else {
    frame = input_.next();
  }
  if (frame && stages_.on_decoded) stages_.on_decoded(*frame);
  return frame;
}

void FramePipeline::begin_decoding() {
  std::optional<Input::Decoding> decoding;
  try {
    decoding = input_.next_decoding();
    is_read_ = !decoding;
  } catch (...) {  // Comes out in its turn.
    is_read_ = true;
    decoding = [error = std::current_exception()]() -> InputFrame {
      std::rethrow_exception(error);
    };
  }
  if (decoding) decoded_->give([decode = *std::move(decoding)](unsigned) { return decode(); });
}

}  // namespace waymark

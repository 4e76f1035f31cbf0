// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <exception>
#include <memory>
#include <mutex>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/base/id.h"
#include "waymark/base/timing.h"

namespace waymark {

/// The newest value (a frozen map) that each frame may see. A value that a frame caused becomes
/// visible `latency_frames` frames later; in realtime as soon as it exists. One reader, one writer.
///
/// The reader announces with expect() that it sent off work; the writer answers each announcement
/// with one publish(), in order. In lockstep the reader waits for what is due, hence sees at each
/// frame what it would see without threads.
template <class T>
class Feed {
 public:
  /// `initial` is visible until something else is.
  Feed(Timing timing, std::uint32_t latency_frames, std::shared_ptr<const T> initial = nullptr)
      : timing_(timing), latency_frames_(latency_frames), visible_(std::move(initial)) {}

  /// Reader: a value caused by this frame is on its way. Causes never descend.
  void expect(FrameId cause) {
    std::lock_guard lock(mutex_);
    if (timing_ == Timing::kRealtime) return;
    WAYMARK_CHECK(expected_.empty() || expected_.back() <= cause);
    expected_.push_back(cause);
  }

  /// Writer: the value caused by this frame. Causes never descend.
  void publish(FrameId cause, std::shared_ptr<const T> value) {
    {
      std::lock_guard lock(mutex_);
      WAYMARK_CHECK(cause.is_valid() && (!newest_.is_valid() || newest_ <= cause));
      newest_ = cause;
      ++num_published_;
      if (timing_ == Timing::kRealtime) values_.clear();
      values_.push_back({cause, std::move(value)});
    }
    arrival_.notify_all();
  }

  /// Writer: the work failed; the reader gets this exception from every for_frame() from now on.
  void fail(std::exception_ptr error) {
    {
      std::lock_guard lock(mutex_);
      if (!error_) error_ = std::move(error);
    }
    arrival_.notify_all();
  }

  /// Nothing more will be published; nobody waits from now on.
  void close() {
    {
      std::lock_guard lock(mutex_);
      is_closed_ = true;
    }
    arrival_.notify_all();
  }

  /// Reader: the newest value that this frame may see. Frames ascend.
  std::shared_ptr<const T> for_frame(FrameId frame) {
    std::unique_lock lock(mutex_);
    while (!expected_.empty() && is_due(expected_.front(), frame)) {
      const auto is_here = [&] { return num_published_ > num_received_; };
      if (timing_ == Timing::kInline) WAYMARK_CHECK(is_here() || error_ || is_closed_);
      arrival_.wait(lock, [&] { return is_here() || error_ || is_closed_; });
      expected_.pop_front();
      ++num_received_;
    }
    if (error_) std::rethrow_exception(error_);
    while (!values_.empty() && is_due(values_.front().cause, frame)) {
      visible_ = std::move(values_.front().value);
      values_.pop_front();
    }
    return visible_;
  }

 private:
  struct Entry {
    FrameId cause;
    std::shared_ptr<const T> value;
  };

  bool is_due(FrameId cause, FrameId frame) const {
    return timing_ == Timing::kRealtime ||
           std::uint64_t{cause.value} + latency_frames_ <= frame.value;
  }

  const Timing timing_;
  const std::uint32_t latency_frames_;
  std::mutex mutex_;
  std::condition_variable arrival_;
  std::deque<Entry> values_;
  std::deque<FrameId> expected_;
  FrameId newest_;  // Cause of the last published value.
  std::uint64_t num_published_ = 0;
  std::uint64_t num_received_ = 0;  // Announced, due and waited for.
  std::shared_ptr<const T> visible_;
  std::exception_ptr error_;
  bool is_closed_ = false;
};

}  // namespace waymark

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

/// The newest value (a frozen map) that each frame may see: each value is visible from a frame on,
/// in realtime as soon as it exists. One reader, one writer.
///
/// The reader announces with expect() that it sent off work; the writer answers each announcement
/// with one publish() for the same frame, in order. In lockstep the reader waits for what is due,
/// hence sees at each frame what it would see without threads.
template <class T>
class Feed {
 public:
  /// `initial` is visible until something else is.
  explicit Feed(Timing timing, std::shared_ptr<const T> initial = nullptr)
      : timing_(timing), visible_(std::move(initial)) {}

  /// Reader: a value that is to be visible from this frame on is on its way. Frames never descend.
  void expect(FrameId visible_from) {
    std::lock_guard lock(mutex_);
    if (timing_ == Timing::kRealtime) return;
    WAYMARK_CHECK(expected_.empty() || expected_.back() <= visible_from);
    expected_.push_back(visible_from);
  }

  /// Writer: the value that is visible from this frame on. Frames never descend.
  void publish(FrameId visible_from, std::shared_ptr<const T> value) {
    {
      std::lock_guard lock(mutex_);
      WAYMARK_CHECK(visible_from.is_valid() && (!newest_.is_valid() || newest_ <= visible_from));
      newest_ = visible_from;
      ++num_published_;
      if (timing_ == Timing::kRealtime) values_.clear();
      values_.push_back({visible_from, std::move(value)});
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
    while (!values_.empty() && is_due(values_.front().visible_from, frame)) {
      visible_ = std::move(values_.front().value);
      values_.pop_front();
    }
    return visible_;
  }

 private:
  struct Entry {
    FrameId visible_from;
    std::shared_ptr<const T> value;
  };

  bool is_due(FrameId visible_from, FrameId frame) const {
    return timing_ == Timing::kRealtime || visible_from <= frame;
  }

  const Timing timing_;
  std::mutex mutex_;
  std::condition_variable arrival_;
  std::deque<Entry> values_;
  std::deque<FrameId> expected_;
  FrameId newest_;  // From where on the last published value is visible.
  std::uint64_t num_published_ = 0;
  std::uint64_t num_received_ = 0;  // Announced, due and waited for.
  std::shared_ptr<const T> visible_;
  std::exception_ptr error_;
  bool is_closed_ = false;
};

}  // namespace waymark

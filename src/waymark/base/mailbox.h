// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <mutex>
#include <optional>
#include <utility>

#include "waymark/base/check.h"

namespace waymark {

/// Bounded queue between threads. After close() pushes are refused, and pop() still drains what
/// was accepted before returning nothing, so that shutting down never loses a message.
template <class T>
class Mailbox {
 public:
  /// Room for `capacity` messages, at least one.
  explicit Mailbox(std::size_t capacity) : capacity_(capacity) { WAYMARK_CHECK(capacity > 0); }

  /// Waits for room. Returns false once the mailbox is closed; the message is lost then.
  bool push(T message) {
    std::unique_lock lock(mutex_);
    room_.wait(lock, [&] { return is_closed_ || messages_.size() < capacity_; });
    if (is_closed_) return false;
    messages_.push_back(std::move(message));
    lock.unlock();
    arrival_.notify_one();
    return true;
  }

  /// Never waits: false, and the message stays as it was, if there is no room or the mailbox is
  /// closed.
  bool try_push(T& message) {
    {
      std::lock_guard lock(mutex_);
      if (is_closed_ || messages_.size() >= capacity_) return false;
      messages_.push_back(std::move(message));
    }
    arrival_.notify_one();
    return true;
  }

  /// Never waits: the oldest message, or nothing if none is there.
  std::optional<T> try_pop() {
    std::unique_lock lock(mutex_);
    if (messages_.empty()) return std::nullopt;
    std::optional<T> message(std::move(messages_.front()));
    messages_.pop_front();
    lock.unlock();
    room_.notify_one();
    return message;
  }

  /// Waits for a message. Returns nothing once the mailbox is closed and empty.
  std::optional<T> pop() {
    std::unique_lock lock(mutex_);
    arrival_.wait(lock, [&] { return is_closed_ || !messages_.empty(); });
    if (messages_.empty()) return std::nullopt;
    std::optional<T> message(std::move(messages_.front()));
    messages_.pop_front();
    lock.unlock();
    room_.notify_one();
    return message;
  }

  /// Number of messages waiting; already outdated when it returns.
  std::size_t size() const {
    std::lock_guard lock(mutex_);
    return messages_.size();
  }

  void close() {
    {
      std::lock_guard lock(mutex_);
      is_closed_ = true;
    }
    arrival_.notify_all();
    room_.notify_all();
  }

 private:
  const std::size_t capacity_;
  mutable std::mutex mutex_;
  std::condition_variable arrival_;
  std::condition_variable room_;
  std::deque<T> messages_;
  bool is_closed_ = false;
};

}  // namespace waymark

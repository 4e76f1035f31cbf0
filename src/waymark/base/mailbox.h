// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <cstddef>
#include <mutex>
#include <optional>
#include <type_traits>
#include <utility>
#include <vector>

#include "waymark/base/check.h"

namespace waymark {

/// Bounded queue between threads. After close() pushes are refused, and pop() still drains what
/// was accepted before returning nothing, so that shutting down never loses a message. All memory
/// is taken when it is made: a thread that has none left can still tell another.
template <class T>
class Mailbox {
  static_assert(std::is_nothrow_move_constructible_v<T>);

 public:
  /// Room for `capacity` messages, at least one.
  explicit Mailbox(std::size_t capacity) : slots_(capacity) { WAYMARK_CHECK(capacity > 0); }

  /// Waits for room. Returns false once the mailbox is closed; the message is lost then.
  bool push(T message) {
    std::unique_lock lock(mutex_);
    room_.wait(lock, [&] { return is_closed_ || num_messages_ < slots_.size(); });
    if (is_closed_) return false;
    put(message);
    lock.unlock();
    arrival_.notify_one();
    return true;
  }

  /// Never waits: false, and the message stays as it was, if there is no room or the mailbox is
  /// closed.
  bool try_push(T& message) {
    {
      std::lock_guard lock(mutex_);
      if (is_closed_ || num_messages_ == slots_.size()) return false;
      put(message);
    }
    arrival_.notify_one();
    return true;
  }

  /// Never waits: the oldest message, or nothing if none is there.
  std::optional<T> try_pop() {
    std::unique_lock lock(mutex_);
    if (num_messages_ == 0) return std::nullopt;
    std::optional<T> message = take();
    lock.unlock();
    room_.notify_one();
    return message;
  }

  /// Waits for a message. Returns nothing once the mailbox is closed and empty.
  std::optional<T> pop() {
    std::unique_lock lock(mutex_);
    arrival_.wait(lock, [&] { return is_closed_ || num_messages_ > 0; });
    if (num_messages_ == 0) return std::nullopt;
    std::optional<T> message = take();
    lock.unlock();
    room_.notify_one();
    return message;
  }

  /// Number of messages waiting; already outdated when it returns.
  std::size_t size() const {
    std::lock_guard lock(mutex_);
    return num_messages_;
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
  void put(T& message) {
    slots_[(oldest_ + num_messages_++) % slots_.size()].emplace(std::move(message));
  }

  std::optional<T> take() {
    std::optional<T> message = std::exchange(slots_[oldest_], std::nullopt);
    oldest_ = (oldest_ + 1) % slots_.size();
    --num_messages_;
    return message;
  }

  mutable std::mutex mutex_;
  std::condition_variable arrival_;
  std::condition_variable room_;
  std::vector<std::optional<T>> slots_;  // Used in a circle.
  std::size_t oldest_ = 0;
  std::size_t num_messages_ = 0;
  bool is_closed_ = false;
};

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <memory>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/base/mailbox.h"

namespace waymark {

/// Pieces of work that need nothing of each other, done before their turn by a team of threads:
/// begun in the order in which they are given, as many at once as there are threads, and their
/// results taken in the same order. One thread gives and takes. What waits to be taken is bounded.
template <class Result>
class Prefetch {
 public:
  /// thread: which of the team does it, from 0 on, for what each of them keeps for itself.
  using Work = std::function<Result(unsigned thread)>;

  /// capacity: pieces that may be given before one has to be taken.
  Prefetch(unsigned num_threads, std::size_t capacity) : capacity_(capacity), to_do_(capacity) {
    WAYMARK_CHECK(num_threads > 0);
    try {
      for (unsigned thread = 0; thread < num_threads; ++thread) {
        threads_.emplace_back([this, thread](const std::stop_token& stop) { run(stop, thread); });
      }
    } catch (...) {  // No thread or no memory is left: those that there are would wait for ever.
      to_do_.close();
      throw;
    }
  }

  /// Waits for what has begun; the rest is not done any more.
  ~Prefetch() {
    for (std::jthread& thread : threads_) thread.request_stop();
    to_do_.close();
    threads_.clear();
  }
  Prefetch(const Prefetch&) = delete;
  Prefetch& operator=(const Prefetch&) = delete;

  /// Pieces that were given and neither taken nor dropped.
  std::size_t size() const { return given_.size(); }
  bool is_full() const { return size() >= capacity_; }

  /// There must be room for it.
  void give(Work work) {
    WAYMARK_CHECK(!is_full());
    given_.push_back(std::make_shared<Piece>(std::move(work)));
    to_do_.push(given_.back());
  }

  /// Waits for the result of the oldest piece, of which there must be one. Rethrows what it threw.
  Result take() {
    WAYMARK_CHECK(!given_.empty());
    const std::shared_ptr<Piece> piece = std::move(given_.front());
    given_.pop_front();
    Outcome outcome = *piece->outcome.pop();
    if (outcome.error) std::rethrow_exception(outcome.error);
    return *std::move(outcome.result);
  }

  /// Does without the oldest piece, of which there must be one; it does not begin any more.
  void drop() {
    WAYMARK_CHECK(!given_.empty());
    given_.front()->is_dropped = true;
    given_.pop_front();
  }

 private:
  struct Outcome {
    std::optional<Result> result;
    std::exception_ptr error;
  };

  struct Piece {
    explicit Piece(Work the_work) : work(std::move(the_work)) {}

    Work work;
    std::atomic<bool> is_dropped{false};
    Mailbox<Outcome> outcome{1};
  };

  void run(const std::stop_token& stop, unsigned thread) {
    while (const auto piece = to_do_.pop()) {
      if (stop.stop_requested()) return;
      if ((*piece)->is_dropped) continue;
      Outcome outcome;
      try {
        outcome.result = (*piece)->work(thread);
      } catch (...) {
        outcome.error = std::current_exception();
      }
      (*piece)->work = nullptr;  // What it holds is given back at once.
      (*piece)->outcome.push(std::move(outcome));
    }
  }

  const std::size_t capacity_;
  Mailbox<std::shared_ptr<Piece>> to_do_;
  std::deque<std::shared_ptr<Piece>> given_;
  std::vector<std::jthread> threads_;
};

}  // namespace waymark

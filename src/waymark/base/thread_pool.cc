// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/base/thread_pool.h"

#include <utility>

#include "waymark/base/check.h"

namespace waymark {

ThreadPool::ThreadPool(unsigned num_threads) {
  for (unsigned i = 1; i < num_threads; ++i) {
    workers_.emplace_back([this](const std::stop_token& stop) { work(stop); });
  }
}

ThreadPool::~ThreadPool() {
  for (std::jthread& worker : workers_) worker.request_stop();
}

void ThreadPool::run_task(std::size_t num_chunks, Task task) {
  {
    std::lock_guard lock(mutex_);
    WAYMARK_CHECK(task_.body == nullptr);
    task_ = task;
    num_chunks_ = num_chunks;
    next_chunk_ = 0;
    ++generation_;
    ++num_active_;
  }
  if (num_chunks > 1) wake_.notify_all();
  run_chunks();
  std::exception_ptr error;
  {
    std::unique_lock lock(mutex_);
    --num_active_;
    done_.wait(lock, [&] { return num_active_ == 0; });
    task_ = {};
    error = std::exchange(error_, nullptr);
  }
  if (error) std::rethrow_exception(error);
}

void ThreadPool::run_chunks() {
  for (std::size_t chunk = next_chunk_++; chunk < num_chunks_; chunk = next_chunk_++) {
    try {
      task_.call(task_.body, chunk);
    } catch (...) {
      std::lock_guard lock(mutex_);
      if (!error_ || chunk < error_chunk_) {
        error_ = std::current_exception();
        error_chunk_ = chunk;
      }
    }
  }
}

void ThreadPool::work(const std::stop_token& stop) {
  std::uint64_t seen = 0;
  for (;;) {
    {
      std::unique_lock lock(mutex_);
      if (!wake_.wait(lock, stop, [&] { return generation_ != seen; })) return;
      seen = generation_;
      if (task_.body == nullptr) continue;  // Woke up after the loop had ended.
      ++num_active_;
    }
    run_chunks();
    {
      std::lock_guard lock(mutex_);
      --num_active_;
    }
    done_.notify_all();
  }
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace waymark {

/// A fixed team of threads for loops over arrays. Where chunks begin depends on the size of the
/// range only, never on the number of threads, so that results per chunk combine in a repeatable
/// order. Loops of one pool neither nest nor run at the same time (a CheckError).
class ThreadPool {
 public:
  /// num_threads counts the calling thread, which works too: 1 (or 0) starts no thread.
  explicit ThreadPool(unsigned num_threads);
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  /// The calling thread included, hence at least 1.
  unsigned num_threads() const { return static_cast<unsigned>(workers_.size()) + 1; }

  /// Calls body(begin, end) for consecutive chunks of [0, count), each of chunk_size but the last,
  /// and returns when all are done. If some throw, the exception of the first such chunk comes out.
  template <class Body>
  void for_chunks(std::size_t count, std::size_t chunk_size, Body&& body) {
    const auto run_chunk = [&](std::size_t chunk) {
      body(chunk * chunk_size, std::min(count, (chunk + 1) * chunk_size));
    };
    run(num_chunks(count, chunk_size), run_chunk);
  }

 private:
  /// A loop body without ownership, hence without allocation.
  struct Task {
    const void* body = nullptr;
    void (*call)(const void* body, std::size_t chunk) = nullptr;
  };

  static std::size_t num_chunks(std::size_t count, std::size_t chunk_size) {
    return count == 0 ? 0 : (count - 1) / chunk_size + 1;
  }

  template <class Body>
  void run(std::size_t num_chunks, const Body& body) {
    run_task(num_chunks, {&body, [](const void* erased, std::size_t chunk) {
                            (*static_cast<const Body*>(erased))(chunk);
                          }});
  }
  void run_task(std::size_t num_chunks, Task task);
  void run_chunks();
  void work(const std::stop_token& stop);

  std::mutex mutex_;
  std::condition_variable_any wake_;
  std::condition_variable_any done_;
  // --- guarded by mutex_; task_ and num_chunks_ are constant while a loop runs ---
  Task task_;
  std::size_t num_chunks_ = 0;
  std::size_t num_active_ = 0;
  std::uint64_t generation_ = 0;
  std::exception_ptr error_;
  std::size_t error_chunk_ = 0;
  // --- shared without the mutex ---
  std::atomic<std::size_t> next_chunk_{0};
  std::vector<std::jthread> workers_;
};

}  // namespace waymark

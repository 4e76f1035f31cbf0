// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <cstddef>
#include <filesystem>
#include <map>
#include <memory_resource>
#include <mutex>
#include <thread>
#include <vector>

namespace waymark {

/// Memory for what is kept long and read rarely. It lies in a file without a name, so that the
/// operating system may hold less of it in RAM than there is: when the process has more than
/// max_resident_bytes in RAM, parts of this memory are let go in turns. What is read again comes
/// back by itself, with the same bits. Blocks start at pages (4 kB): allocate much at a time.
///
/// Thread safety: any thread may allocate, free and read at any time.
class DiskMemory : public std::pmr::memory_resource {
 public:
  /// The file is made in folder, and gone with this object, also if the process is killed. Throws
  /// OutputError where that cannot be.
  DiskMemory(std::filesystem::path folder, std::size_t max_resident_bytes);
  ~DiskMemory() override;
  DiskMemory(const DiskMemory&) = delete;
  DiskMemory& operator=(const DiskMemory&) = delete;

  /// Of all blocks, in whole pages.
  std::size_t num_bytes() const;
  /// Takes all of it out of RAM, whatever the limit.
  void let_go();

 private:
  struct Mapping {
    std::byte* begin;
    std::size_t size;
  };

  /// Throws OutputError where the disk is full.
  void* do_allocate(std::size_t num_bytes, std::size_t alignment) override;
  void do_deallocate(void* block, std::size_t num_bytes, std::size_t alignment) override;
  bool do_is_equal(const std::pmr::memory_resource& other) const noexcept override {
    return this == &other;
  }
  std::byte* take_free(std::size_t size);
  void add_mapping(std::size_t min_size);
  void add_free(std::byte* begin, std::size_t size);
  /// Takes mappings out of RAM, one after the other, until the process has no more than this in it
  /// or none is left.
  void let_go_until(std::size_t resident_bytes);
  void watch(const std::stop_token& stop);

  const std::filesystem::path folder_;
  const std::size_t max_resident_bytes_;
  const int file_;
  mutable std::mutex mutex_;
  std::condition_variable_any wake_;
  // --- guarded by mutex_ ---
  std::vector<Mapping> mappings_;
  std::size_t next_ = 0;                    ///< Of the mappings, to be let go.
  std::map<std::byte*, std::size_t> free_;  ///< Sizes of free runs of pages, none beside another.
  std::size_t file_size_ = 0;
  std::size_t num_bytes_ = 0;
  // --- the last, as it uses the others ---
  std::jthread watch_;
};

}  // namespace waymark

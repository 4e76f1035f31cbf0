// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/base/disk_memory.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <iterator>
#include <string>
#include <utility>

#include "waymark/base/check.h"

namespace waymark {
namespace {

constexpr std::size_t kPageSize = 4096;
/// The file grows by as much: more would take disk that is never used, less many mappings.
constexpr std::size_t kGrowth = std::size_t{64} << 20;
/// Between two looks at how much is in RAM: short, as in this time what is read back has no limit.
constexpr std::chrono::milliseconds kWatchPeriod(10);
/// Where all that can be let go is not enough, this part of the limit may come back before more is,
/// or a process that needs more than the limit for other things would do nothing else.
constexpr std::size_t kLimitBySlack = 16;
/// What is let go at once, as a part of that: of much of it some is needed again at once.
constexpr std::size_t kSlackByStep = 4;

std::size_t whole_pages(std::size_t num_bytes) {
  return std::max<std::size_t>((num_bytes + kPageSize - 1) / kPageSize, 1) * kPageSize;
}

int open_nameless_file(const std::filesystem::path& folder) {
  int file = ::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
  if (file < 0) {  // Not every file system can.
    std::string name = (folder / "waymark-memory-XXXXXX").string();
    file = ::mkostemp(name.data(), O_CLOEXEC);
    if (file >= 0) ::unlink(name.c_str());
  }
  if (file < 0) {
    throw OutputError(
        folder.string(),
        std::string("cannot hold a file without a name, for memory: ") + std::strerror(errno));
  }
  return file;
}

/// Of the process; 0 where the system does not tell.
std::size_t resident_bytes() {
  std::FILE* const file = std::fopen("/proc/self/statm", "re");
  if (file == nullptr) return 0;
  std::size_t all = 0;
  std::size_t resident = 0;
  const bool is_read = std::fscanf(file, "%zu %zu", &all, &resident) == 2;
  std::fclose(file);
  return is_read ? resident * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE)) : 0;
}

}  // namespace

DiskMemory::DiskMemory(std::filesystem::path folder, std::size_t max_resident_bytes)
    : folder_(std::move(folder)),
      max_resident_bytes_(max_resident_bytes),
      file_(open_nameless_file(folder_)),
      watch_([this](const std::stop_token& stop) { watch(stop); }) {}

DiskMemory::~DiskMemory() {
  watch_.request_stop();
  watch_.join();
  for (const Mapping& mapping : mappings_) ::munmap(mapping.begin, mapping.size);
  ::close(file_);
}

std::size_t DiskMemory::num_bytes() const {
  const std::scoped_lock lock(mutex_);
  return num_bytes_;
}

void DiskMemory::let_go() {
  const std::scoped_lock lock(mutex_);
  // What was written is in the file, shared mappings lose nothing by this.
  for (const Mapping& mapping : mappings_) ::madvise(mapping.begin, mapping.size, MADV_DONTNEED);
}

void* DiskMemory::do_allocate(std::size_t num_bytes, std::size_t alignment) {
  WAYMARK_CHECK(alignment <= kPageSize);
  const std::size_t size = whole_pages(num_bytes);
  const std::scoped_lock lock(mutex_);
  std::byte* block = take_free(size);
  if (block == nullptr) {
    add_mapping(size);
    block = take_free(size);
  }
  num_bytes_ += size;
  return block;
}

void DiskMemory::do_deallocate(void* block, std::size_t num_bytes, std::size_t /*alignment*/) {
  const std::size_t size = whole_pages(num_bytes);
  const std::scoped_lock lock(mutex_);
  num_bytes_ -= size;
  add_free(static_cast<std::byte*>(block), size);
}

/// The first fit; null where there is none.
std::byte* DiskMemory::take_free(std::size_t size) {
  const auto run =
      std::ranges::find_if(free_, [size](const auto& one) { return one.second >= size; });
  if (run == free_.end()) return nullptr;
  const auto [begin, run_size] = *run;
  free_.erase(run);
  if (run_size > size) free_.emplace(begin + size, run_size - size);
  return begin;
}

void DiskMemory::add_mapping(std::size_t min_size) {
  const std::size_t size = (min_size + kGrowth - 1) / kGrowth * kGrowth;
  const auto offset = static_cast<off_t>(file_size_);
  // Takes the place on the disk now: without it, a full disk would end the process at some write.
  const int error = ::posix_fallocate(file_, offset, static_cast<off_t>(size));
  if (error != 0) {
    throw OutputError(
        folder_.string(),
        std::string("no room for a file that memory lies in: ") + std::strerror(error));
  }
  void* const begin = ::mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_SHARED, file_, offset);
  if (begin == MAP_FAILED) {
    throw OutputError(folder_.string(), std::string("cannot be mapped: ") + std::strerror(errno));
  }
  file_size_ += size;
  mappings_.push_back({static_cast<std::byte*>(begin), size});
  free_.emplace(mappings_.back().begin, size);
}

void DiskMemory::add_free(std::byte* begin, std::size_t size) {
  const auto after = free_.lower_bound(begin);
  // Mappings that happen to be neighbours may join: a block in both is as good as any.
  if (after != free_.begin()) {
    const auto before = std::prev(after);
    if (before->first + before->second == begin) {
      begin = before->first;
      size += before->second;
      free_.erase(before);
    }
  }
  if (after != free_.end() && begin + size == after->first) {
    size += after->second;
    free_.erase(after);
  }
  free_.emplace(begin, size);
}

void DiskMemory::let_go_until(std::size_t bytes) {
  const std::scoped_lock lock(mutex_);
  for (std::size_t i = 0; i < mappings_.size() && resident_bytes() > bytes; ++i) {
    next_ = (next_ + 1) % mappings_.size();
    ::madvise(mappings_[next_].begin, mappings_[next_].size, MADV_DONTNEED);
  }
}

void DiskMemory::watch(const std::stop_token& stop) {
  const std::size_t slack = max_resident_bytes_ / kLimitBySlack;
  std::size_t least_now = 0;
  while (true) {
    {
      std::unique_lock lock(mutex_);
      wake_.wait_for(lock, stop, kWatchPeriod, [] { return false; });
    }
    if (stop.stop_requested()) return;
    const std::size_t resident = resident_bytes();
    least_now = std::min(least_now, resident + slack);
    const std::size_t limit = std::max(max_resident_bytes_, least_now);
    if (resident <= limit) continue;
    const std::size_t enough = limit - slack / kSlackByStep;
    let_go_until(enough);
    const std::size_t left = resident_bytes();
    if (left > enough) least_now = left + slack;
  }
}

}  // namespace waymark

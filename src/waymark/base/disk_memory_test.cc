// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/base/disk_memory.h"

#include <gtest/gtest.h>
#include <sys/mman.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <fstream>
#include <memory_resource>
#include <numeric>
#include <string>
#include <thread>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/base/testing/temporary_folder.h"

namespace waymark {
namespace {

constexpr std::size_t kNoLimit = SIZE_MAX;

/// Of the files that are mapped by this process, in kB.
std::size_t resident_of_files() {
  std::ifstream status("/proc/self/status");
  std::string word;
  std::size_t sum = 0;
  while (status >> word) {
    std::size_t size = 0;
    if ((word == "RssFile:" || word == "RssShmem:") && status >> size) sum += size;
  }
  return sum;
}

std::pmr::vector<std::uint64_t> ascending(std::size_t count, std::pmr::memory_resource& memory) {
  std::pmr::vector<std::uint64_t> numbers(count, &memory);
  std::iota(numbers.begin(), numbers.end(), 7u);
  return numbers;
}

bool is_ascending(const std::pmr::vector<std::uint64_t>& numbers) {
  std::uint64_t next = 7;
  return std::ranges::all_of(numbers, [&](std::uint64_t one) { return one == next++; });
}

constexpr std::size_t kEightMegabytes = (std::size_t{8} << 20) / sizeof(std::uint64_t);

TEST(DiskMemory, WhatWasLetGoComesBackAsItWas) {
  const TemporaryFolder folder;
  DiskMemory memory(folder.path(), kNoLimit);
  const auto numbers = ascending(kEightMegabytes, memory);
  const std::size_t before_kb = resident_of_files();
  memory.let_go();
  EXPECT_LT(resident_of_files() + 7 * 1024, before_kb);
  EXPECT_TRUE(is_ascending(numbers));
}

TEST(DiskMemory, LetsGoByItselfAboveTheLimit) {
  const TemporaryFolder folder;
  DiskMemory memory(folder.path(), 1);
  const std::size_t before_kb = resident_of_files();
  const auto numbers = ascending(kEightMegabytes, memory);
  for (int i = 0; i < 1000 && resident_of_files() > before_kb + 1024; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_LT(resident_of_files(), before_kb + 1024);
  EXPECT_TRUE(is_ascending(numbers));
}

TEST(DiskMemory, FreedBlocksAreUsedAgain) {
  const TemporaryFolder folder;
  DiskMemory memory(folder.path(), kNoLimit);
  constexpr std::size_t kPage = 4096;
  void* const a = memory.allocate(2 * kPage);
  void* const b = memory.allocate(1);
  void* const c = memory.allocate(3 * kPage - 1);
  EXPECT_EQ(memory.num_bytes(), 6 * kPage);
  memory.deallocate(a, 2 * kPage);
  memory.deallocate(c, 3 * kPage - 1);
  EXPECT_EQ(memory.allocate(kPage), a);
  memory.deallocate(b, 1);
  EXPECT_EQ(memory.num_bytes(), kPage);
  // What lay before, between and after is one run by now.
  EXPECT_EQ(memory.allocate(100 * kPage), static_cast<std::byte*>(a) + kPage);
}

TEST(DiskMemory, TakesBlocksLargerThanItGrowsBy) {
  const TemporaryFolder folder;
  DiskMemory memory(folder.path(), kNoLimit);
  constexpr std::size_t kSize = std::size_t{130} << 20;
  auto* const block = static_cast<std::byte*>(memory.allocate(kSize));
  block[0] = block[kSize - 1] = std::byte{5};
  memory.let_go();
  EXPECT_EQ(block[kSize - 1], std::byte{5});
}

TEST(DiskMemory, LeavesNoFile) {
  const TemporaryFolder folder;
  DiskMemory memory(folder.path(), kNoLimit);
  const auto numbers = ascending(10, memory);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(DiskMemory, SaysWhereItCannotBe) {
  const TemporaryFolder folder;
  EXPECT_THROW(DiskMemory(folder.path() / "missing", kNoLimit), OutputError);
}

}  // namespace
}  // namespace waymark

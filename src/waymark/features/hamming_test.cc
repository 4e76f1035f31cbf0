// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/features/hamming.h"

#include <gmock/gmock.h>

#include <bitset>
#include <random>

#include "waymark/base/check.h"

namespace waymark {
namespace {

std::vector<Descriptor> make_descriptors(std::size_t count) {
  std::mt19937_64 random(7);
  std::vector<Descriptor> descriptors(count);
  for (Descriptor& descriptor : descriptors) {
    for (std::uint64_t& word : descriptor) word = random();
  }
  return descriptors;
}

int count_bits_one_by_one(const Descriptor& a, const Descriptor& b) {
  int count = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    count += static_cast<int>(std::bitset<64>(a[i] ^ b[i]).count());
  }
  return count;
}

TEST(Hamming, CountsDifferentBits) {
  Descriptor zeros{};
  Descriptor ones;
  ones.fill(UINT64_MAX);
  EXPECT_EQ(hamming_distance(zeros, zeros), 0);
  EXPECT_EQ(hamming_distance(zeros, ones), kDescriptorBits);
  for (std::size_t bit = 0; bit < kDescriptorBits; ++bit) {
    Descriptor one_bit{};
    one_bit[bit / 64] = std::uint64_t{1} << (bit % 64);
    EXPECT_EQ(hamming_distance(zeros, one_bit), 1);
    EXPECT_EQ(hamming_distance(ones, one_bit), kDescriptorBits - 1);
  }
}

TEST(Hamming, BatchesAgreeWithTheDefinition) {
  const std::vector<Descriptor> all = make_descriptors(131);
  std::vector<std::uint32_t> candidates;
  for (std::uint32_t i = 0; i < 200; ++i) candidates.push_back(i * 37 % 131);

  std::vector<std::uint16_t> to_candidates(candidates.size());
  std::vector<std::uint16_t> to_all(all.size());
  distances(all[5], all, candidates, to_candidates);
  distances(all[5], all, to_all);

  for (std::size_t i = 0; i < all.size(); ++i) {
    EXPECT_EQ(to_all[i], count_bits_one_by_one(all[5], all[i]));
    EXPECT_EQ(to_all[i], hamming_distance(all[5], all[i]));
  }
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    EXPECT_EQ(to_candidates[i], to_all[candidates[i]]);
  }
}

TEST(Hamming, RejectsAnOutputOfAnotherSize) {
  const std::vector<Descriptor> all = make_descriptors(4);
  std::vector<std::uint16_t> out(3);
  EXPECT_THROW(distances(all[0], all, out), CheckError);
}

}  // namespace
}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <bit>

#include "waymark/place/place_segment.h"
#include "waymark/place/testing/places.h"

namespace waymark {
namespace {

TEST(PlaceKeysTest, EachBitOfADescriptorIsInAtMostOneKey) {
  int num_used = 0;
  for (std::size_t bit = 0; bit < 256; ++bit) {
    Descriptor descriptor = {};
    descriptor[bit / 64] = std::uint64_t{1} << (bit % 64);
    int num_set = 0;
    for (const PlaceKey key : place_keys(descriptor)) num_set += std::popcount(key);
    EXPECT_LE(num_set, 1) << "bit " << bit;
    num_used += num_set;
  }
  EXPECT_EQ(num_used, static_cast<int>(kNumPlaceTables) * kPlaceKeyBits);
}

TEST(PlaceKeysTest, KeysDifferWhereTheirBitsOfTheDescriptorsDiffer) {
  Rng rng(5, 0);
  const std::vector<Descriptor> places = random_place(100, rng);
  for (std::size_t i = 1; i < places.size(); ++i) {
    Descriptor different = {};
    for (std::size_t k = 0; k < 4; ++k) different[k] = places[i][k] ^ places[i - 1][k];
    const auto a = place_keys(places[i]);
    const auto b = place_keys(places[i - 1]);
    const auto expected = place_keys(different);
    for (std::size_t k = 0; k < a.size(); ++k) EXPECT_EQ(a[k] ^ b[k], expected[k]);
  }
}

TEST(PlaceKeysTest, KeysOfAllBitsSetAreFull) {
  const Descriptor full = {UINT64_MAX, UINT64_MAX, UINT64_MAX, UINT64_MAX};
  EXPECT_THAT(place_keys(full), ::testing::Each((PlaceKey{1} << kPlaceKeyBits) - 1));
}

}  // namespace
}  // namespace waymark

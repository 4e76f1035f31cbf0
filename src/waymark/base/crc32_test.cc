// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/base/crc32.h"

#include <gtest/gtest.h>

#include <string>

#include "waymark/base/rng.h"

namespace waymark {
namespace {

/// Bit by bit, from the definition: the remainder of the division by the polynomial.
std::uint32_t slow_crc32c(const std::string& bytes) {
  std::uint32_t remainder = ~std::uint32_t{0};
  for (const char byte : bytes) {
    remainder ^= static_cast<unsigned char>(byte);
    for (int bit = 0; bit < 8; ++bit) {
      remainder = (remainder & 1) ? (remainder >> 1) ^ 0x82F63B78u : remainder >> 1;
    }
  }
  return ~remainder;
}

TEST(Crc32c, GivesTheValuesOfTheStandard) {  // RFC 3720, B.4.
  std::string ascending;
  for (char byte = 0; byte < 32; ++byte) ascending.push_back(byte);
  EXPECT_EQ(crc32c(std::string(32, '\0')), 0x8A9136AAu);
  EXPECT_EQ(crc32c(std::string(32, '\xFF')), 0x62A8AB43u);
  EXPECT_EQ(crc32c(ascending), 0x46DD794Eu);
  EXPECT_EQ(crc32c("123456789"), 0xE3069283u);
  EXPECT_EQ(crc32c(""), 0u);
}

TEST(Crc32, GivesTheCheckValueOfTheCatalogues) {
  EXPECT_EQ(crc32("123456789"), 0xCBF43926u);
  EXPECT_EQ(crc32("6789", crc32("12345")), 0xCBF43926u);
  EXPECT_EQ(crc32("IEND"), 0xAE426082u);  // As every PNG file ends.
}

TEST(Crc32c, EqualsItsDefinitionInPartsOfAnySize) {
  Rng rng(3, 0);
  for (std::uint32_t size = 0; size < 70; ++size) {
    std::string bytes;
    for (std::uint32_t i = 0; i < size; ++i) bytes.push_back(static_cast<char>(rng.below(256)));
    EXPECT_EQ(crc32c(bytes), slow_crc32c(bytes));
    const std::size_t cut = rng.below(size + 1);
    EXPECT_EQ(crc32c(bytes.substr(cut), crc32c(bytes.substr(0, cut))), slow_crc32c(bytes));
  }
}

}  // namespace
}  // namespace waymark

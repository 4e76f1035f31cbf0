// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/base/sha256.h"

#include <gtest/gtest.h>

#include "waymark/base/atomic_file.h"
#include "waymark/base/check.h"

namespace waymark {
namespace {

// The examples of NIST for FIPS 180-4.
TEST(Sha256Test, GivesThePublishedDigests) {
  EXPECT_EQ(sha256(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(sha256(std::string(1'000'000, 'a')),
            "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Sha256Test, DoesNotDependOnThePieces) {
  std::string text;
  for (int i = 0; i < 300; ++i) text += static_cast<char>(i * 7);
  for (std::size_t piece = 1; piece < 130; ++piece) {
    Sha256 sum;
    for (std::size_t at = 0; at < text.size(); at += piece) {
      sum.add(std::string_view(text).substr(at, piece));
    }
    EXPECT_EQ(sum.finish(), sha256(text)) << piece;
  }
}

TEST(Sha256Test, ReadsFiles) {
  const std::string path = ::testing::TempDir() + "waymark_sha256";
  const std::string text(3'000'001, 'x');
  write_file_atomically(path, text);
  EXPECT_EQ(sha256_of_file(path), sha256(text));
  EXPECT_THROW(sha256_of_file(path + "_missing"), InputError);
}

TEST(Sha256Test, KnowsAChecksum) {
  EXPECT_TRUE(is_sha256(sha256("")));
  EXPECT_FALSE(is_sha256(""));
  EXPECT_FALSE(is_sha256(std::string(64, 'A')));
  EXPECT_FALSE(is_sha256("../" + std::string(61, '0')));
}

}  // namespace
}  // namespace waymark

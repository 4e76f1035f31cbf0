// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace waymark {

/// The checksum by which files are named: SHA-256 (NIST FIPS 180-4, section 6.2), piece by piece.
class Sha256 {
 public:
  /// Takes in what follows.
  void add(std::string_view bytes);
  /// The digest of all that was added, as 64 digits from 0 to f. Once, at the end.
  std::string finish();

 private:
  void add_block(const unsigned char* block);

  std::array<std::uint32_t, 8> state_ = {0x6a09e667,
                                         0xbb67ae85,
                                         0x3c6ef372,
                                         0xa54ff53a,
                                         0x510e527f,
                                         0x9b05688c,
                                         0x1f83d9ab,
                                         0x5be0cd19};
  std::array<unsigned char, 64> waiting_{};
  std::uint64_t num_bytes_ = 0;
};

/// Of all bytes of a text.
std::string sha256(std::string_view bytes);

/// Of a file. InputError where it cannot be read.
std::string sha256_of_file(const std::filesystem::path& path);

/// Whether a text is such a checksum.
bool is_sha256(std::string_view text);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace waymark {

enum class Compression { kNone, kLz4, kZstd, kBz2 };

/// More is not decompressed of one piece; recorders close a chunk at a few megabytes, or after one
/// message that is larger.
inline constexpr std::uint64_t kMaxChunkBytes = std::uint64_t{512} << 20;

/// Decompresses an LZ4 frame, Zstandard frames or a bzip2 stream whose content is stated to have so
/// many bytes. Memory grows with what comes out, not with what is stated. Nothing when it is
/// damaged, ends early, or gives another number of bytes.
std::optional<std::string> decompress(Compression compression,
                                      std::string_view bytes,
                                      std::uint64_t size);

}  // namespace waymark

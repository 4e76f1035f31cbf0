// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string_view>

namespace waymark {

// Checksums of bytes which follow others whose checksum is `before`, eight bytes a step (Kounavis
// and Berry 2008).

/// CRC-32C (Castagnoli, Braeuer and Herrmann 1993; the parameters of RFC 3720, appendix B.4), of
/// map files.
std::uint32_t crc32c(std::string_view bytes, std::uint32_t before = 0);

/// The CRC-32 of PNG files (ISO/IEC 15948, annex D).
std::uint32_t crc32(std::string_view bytes, std::uint32_t before = 0);

}  // namespace waymark

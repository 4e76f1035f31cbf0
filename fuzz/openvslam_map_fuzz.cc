// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "waymark/base/check.h"
#include "waymark/exchange/openvslam_map.h"

/// Whatever the bytes are: a sound map, or an InputError.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  try {
    const waymark::ImportedMap imported = waymark::import_openvslam_map(bytes, "map.msg");
    WAYMARK_CHECK(imported.map.broken_invariants().empty());
  } catch (const waymark::InputError&) {
  }
  return 0;
}

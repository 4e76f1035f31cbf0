// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// The readers of bags of ROS, and what decodes their messages: whatever the bytes, they give frames
// or an InputError.
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "waymark/base/check.h"
#include "waymark/input/input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace waymark;
  static const std::filesystem::path path =
      std::filesystem::temp_directory_path() / ("waymark_fuzz_bag_" + std::to_string(getpid()));
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
  try {
    const auto input = open_input(path, {.format = "bag"});
    while (const auto frame = input->next()) {
      WAYMARK_CHECK(frame->images.empty() == (frame->fault != FrameFault::kNone));
    }
  } catch (const InputError& error) {
    WAYMARK_CHECK(std::string_view(error.what()).find("\n") == std::string_view::npos);
  }
  return 0;
}

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <array>

#include "waymark/input/datasets.h"

namespace waymark {

std::optional<std::filesystem::path> find_groundtruth(const std::filesystem::path& input) {
  // Absolute, so that "." and a trailing slash have a name and a parent.
  std::filesystem::path folder = std::filesystem::absolute(input).lexically_normal();
  if (!std::filesystem::is_directory(folder) || !folder.has_filename())
    folder = folder.parent_path();
  const std::filesystem::path mav0 = folder.filename() == "mav0" ? folder : folder / "mav0";
  const std::string sequence = folder.filename().string();
  const std::array<std::filesystem::path, 5> candidates = {
      mav0 / "state_groundtruth_estimate0" / "data.csv",
      mav0 / "mocap0" / "data.csv",
      folder / "groundtruth.txt",
      folder / "poses.txt",
      folder.parent_path().parent_path() / "poses" / (sequence + ".txt")};
  for (const std::filesystem::path& candidate : candidates) {
    if (std::filesystem::is_regular_file(candidate)) return candidate;
  }
  return std::nullopt;
}

}  // namespace waymark

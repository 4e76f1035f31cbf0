// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "waymark/base/atomic_file.h"
#include "waymark/exchange/exports.h"
#include "waymark/exchange/little_endian.h"

namespace waymark {

std::string format_ply(const ExportScene& scene) {
  std::string bytes = fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment landmarks of a Waymark map\n"
      "element vertex {}\n"
      "property float x\nproperty float y\nproperty float z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n",
      scene.points.size());
  for (const ExportPoint& point : scene.points) {
    for (const double coordinate : point.position_in_world) {
      append_little_endian(bytes, static_cast<float>(coordinate));
    }
    for (const std::uint8_t channel : point.color) append_little_endian(bytes, channel);
  }
  return bytes;
}

void write_ply(const std::filesystem::path& path, const ExportScene& scene) {
  write_file_atomically(path, format_ply(scene));
}

}  // namespace waymark

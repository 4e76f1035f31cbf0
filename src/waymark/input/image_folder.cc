// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "waymark/base/check.h"
#include "waymark/input/datasets.h"

namespace waymark {
namespace {

constexpr std::int64_t kAssumedRateHz = 30;

std::filesystem::path find_image_times(const std::filesystem::path& images) {
  for (const std::filesystem::path& folder : {images, images / ".."}) {
    const std::filesystem::path candidate = (folder / "times.txt").lexically_normal();
    if (std::filesystem::exists(candidate)) return candidate;
  }
  return {};
}

}  // namespace

Listing list_image_folder(const std::filesystem::path& folder, const InputOptions& options) {
  Listing listing;
  listing.format = "images";
  listing.title = "folder of images";
  listing.setup = choose_setup(folder, {Setup::kMono}, options.setup);

  const bool is_nested = std::filesystem::is_directory(folder / "images");
  const std::filesystem::path images_folder = is_nested ? folder / "images" : folder;
  const std::vector<std::filesystem::path> images = list_images(images_folder);
  const std::filesystem::path times_path = find_image_times(images_folder);
  std::vector<std::int64_t> times_ns;
  if (times_path.empty()) {
    for (std::size_t i = 0; i < images.size(); ++i) {
      times_ns.push_back(static_cast<std::int64_t>(i) * 1'000'000'000 / kAssumedRateHz);
    }
    listing.notes.push_back(
        fmt::format("no times.txt: {} images per second assumed", kAssumedRateHz));
  } else {
    times_ns = read_times(times_path, images.size(), images_folder.string());
    listing.notes.push_back(fmt::format("times from {}", times_path.string()));
  }
  for (std::size_t i = 0; i < images.size(); ++i) {
    listing.frames.push_back({times_ns[i], {images[i]}, {}});
  }
  return listing;
}

}  // namespace waymark

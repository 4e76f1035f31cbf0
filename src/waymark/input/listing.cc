// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/listing.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>

#include "waymark/base/check.h"
#include "waymark/base/text.h"
#include "waymark/input/datasets.h"

namespace waymark {
namespace {

constexpr std::array kImageExtensions = {
    ".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".pgm", ".ppm", ".webp"};
constexpr std::array kVideoExtensions = {
    ".mp4", ".mov", ".avi", ".mkv", ".webm", ".m4v", ".mpg", ".mpeg", ".mts", ".insv", ".360"};

template <class Extensions>
bool has_extension(const std::filesystem::path& path, const Extensions& extensions) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return std::find(extensions.begin(), extensions.end(), extension) != extensions.end();
}

std::string_view take_number(std::string_view& text) {
  std::size_t length = 0;
  while (length < text.size() && is_digit(text[length])) ++length;
  std::string_view number = text.substr(0, length);
  text.remove_prefix(length);
  while (number.size() > 1 && number.front() == '0') number.remove_prefix(1);
  return number;
}

/// Orders img2 before img10; names that differ in leading zeros only keep a fixed order.
bool is_name_before(const std::string& a_name, const std::string& b_name) {
  std::string_view a = a_name;
  std::string_view b = b_name;
  while (!a.empty() && !b.empty()) {
    if (is_digit(a.front()) && is_digit(b.front())) {
      const std::string_view a_number = take_number(a);
      const std::string_view b_number = take_number(b);
      if (a_number.size() != b_number.size()) return a_number.size() < b_number.size();
      if (a_number != b_number) return a_number < b_number;
    } else if (a.front() != b.front()) {
      return static_cast<unsigned char>(a.front()) < static_cast<unsigned char>(b.front());
    } else {
      a.remove_prefix(1);
      b.remove_prefix(1);
    }
  }
  if (a.empty() != b.empty()) return a.empty();
  return a_name < b_name;
}

template <class Extensions>
std::vector<std::filesystem::path> list_files(const std::filesystem::path& folder,
                                              const Extensions& extensions) {
  std::error_code error;
  std::filesystem::directory_iterator entries(folder, error);
  if (error) throw InputError(folder.string(), "missing or unreadable, expected a folder");
  std::vector<std::string> names;
  for (; entries != std::filesystem::directory_iterator(); entries.increment(error)) {
    const std::string name = entries->path().filename().string();
    if (!name.starts_with('.') && has_extension(name, extensions)) names.push_back(name);
    if (error) break;
  }
  std::sort(names.begin(), names.end(), is_name_before);
  std::vector<std::filesystem::path> paths;
  for (const std::string& name : names) paths.push_back(folder / name);
  return paths;
}

constexpr std::int64_t kAssumedRateHz = 30;

std::filesystem::path find_image_times(const std::filesystem::path& images) {
  for (const std::filesystem::path& folder : {images, images / ".."}) {
    const std::filesystem::path candidate = (folder / "times.txt").lexically_normal();
    if (std::filesystem::exists(candidate)) return candidate;
  }
  return {};
}

}  // namespace

std::string_view to_string(Setup setup) {
  switch (setup) {
    case Setup::kMono:
      return "mono";
    case Setup::kStereo:
      return "stereo";
    case Setup::kRgbd:
      return "rgbd";
  }
  fail_check("known Setup", __FILE__, __LINE__);
}

std::size_t num_cameras(Setup setup) { return setup == Setup::kStereo ? 2 : 1; }

Setup choose_setup(const std::filesystem::path& path,
                   const std::vector<Setup>& offered,
                   const std::optional<Setup>& wanted) {
  WAYMARK_CHECK(!offered.empty());
  if (!wanted) return offered.back();
  if (std::find(offered.begin(), offered.end(), *wanted) != offered.end()) return *wanted;
  std::string names;
  for (Setup setup : offered)
    names += fmt::format("{}{}", names.empty() ? "" : " or ", to_string(setup));
  throw InputError(
      path.string(),
      fmt::format("does not offer {}, expected --setup {}", to_string(*wanted), names));
}

std::vector<std::filesystem::path> list_images(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> images = list_files(folder, kImageExtensions);
  if (images.empty())
    throw InputError(folder.string(), "holds no image, expected png, jpg or the like");
  return images;
}

std::vector<std::filesystem::path> list_videos(const std::filesystem::path& folder) {
  return list_files(folder, kVideoExtensions);
}

bool is_video_name(const std::filesystem::path& path) {
  return has_extension(path, kVideoExtensions);
}

std::vector<std::int64_t> read_times(const std::filesystem::path& path,
                                     std::size_t num_images,
                                     std::string_view what) {
  const std::string text = read_text_file(path, "one time in seconds per image");
  std::vector<std::int64_t> times_ns = parse_times(text, path.string());
  if (times_ns.size() != num_images) {
    throw InputError(
        path.string(),
        fmt::format(
            "{} times, expected {}: one per image of {}", times_ns.size(), num_images, what));
  }
  return times_ns;
}

std::string describe_rate(const std::vector<std::int64_t>& times_ns) {
  if (times_ns.size() < 2) return fmt::format("{} frame", times_ns.size());
  const double duration_s = 1e-9 * static_cast<double>(times_ns.back() - times_ns.front());
  const double rate_hz = static_cast<double>(times_ns.size() - 1) / duration_s;
  return fmt::format(
      "{} frames over {:.1f} s, {:.4g} per second", times_ns.size(), duration_s, rate_hz);
}

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

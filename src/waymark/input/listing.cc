// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/listing.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>

#include "waymark/base/check.h"
#include "waymark/base/text.h"
#include "waymark/base/time_column.h"
#include "waymark/input/datasets.h"
#include "waymark/input/image_times.h"
#include "waymark/input/pairing.h"

namespace waymark {
namespace {

constexpr std::array kImageExtensions = {
    ".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".pgm", ".ppm", ".webp"};
constexpr std::array kVideoExtensions = {
    ".mp4",  ".mov", ".avi",  ".mkv", ".webm", ".m4v", ".mpg",  ".mpeg", ".mts",
    ".m2ts", ".ts",  ".insv", ".360", ".h264", ".264", ".h265", ".265",  ".hevc",
    ".y4m",  ".flv", ".asf",  ".wmv", ".ogv",  ".dv",  ".3gp",  ".vob",  ".mjpeg"};

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

constexpr double kAssumedRateHz = 30.0;

std::filesystem::path find_image_times(const std::filesystem::path& images) {
  for (const std::filesystem::path& folder : {images, images / ".."}) {
    const std::filesystem::path candidate = (folder / "times.txt").lexically_normal();
    if (std::filesystem::exists(candidate)) return candidate;
  }
  return {};
}

std::filesystem::path images_folder_of(const std::filesystem::path& folder) {
  return std::filesystem::is_directory(folder / "images") ? folder / "images" : folder;
}

/// From the file, unless that is empty; as --fps says; by the names; or at a usual rate.
std::vector<std::int64_t> image_times(const std::vector<std::filesystem::path>& images,
                                      const std::filesystem::path& times_path,
                                      const InputOptions& options,
                                      Listing& listing) {
  if (!times_path.empty()) {
    listing.notes.push_back(fmt::format("times from {}", times_path.string()));
    return read_times(times_path, images.size(), images.front().parent_path().string());
  }
  if (!options.fps) {
    if (const auto named = times_in_names(images)) {
      listing.notes.push_back("times from the names of the images");
      return *named;
    }
  }
  listing.has_times = false;
  const double rate_hz = options.fps.value_or(kAssumedRateHz);
  listing.notes.push_back(
      options.fps ? fmt::format("no times.txt: {:g} images per second, as --fps says", rate_hz)
                  : fmt::format("no times.txt: {:g} images per second assumed", rate_hz));
  return even_times(images.size(), rate_hz);
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
  if (!images.empty()) return images;
  const std::string suggestion = suggest_command(folder, /*are_videos=*/false);
  throw InputError(
      folder.string(),
      suggestion.empty() ? "holds no image, expected png, jpg or the like" : suggestion);
}

std::size_t count_images(const std::filesystem::path& folder) {
  std::error_code error;
  std::size_t count = 0;
  for (std::filesystem::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    count += !name.starts_with('.') && has_extension(name, kImageExtensions);
  }
  return count;
}

std::vector<std::filesystem::path> list_videos(const std::filesystem::path& folder) {
  return list_files(folder, kVideoExtensions);
}

bool is_image_name(const std::filesystem::path& path) {
  return has_extension(path, kImageExtensions);
}

bool is_video_name(const std::filesystem::path& path) {
  return has_extension(path, kVideoExtensions);
}

std::vector<std::int64_t> read_times(const std::filesystem::path& path,
                                     std::size_t num_images,
                                     std::string_view what) {
  std::vector<std::int64_t> times_ns = read_times(path);
  if (times_ns.size() != num_images) {
    throw InputError(
        path.string(),
        fmt::format(
            "{} times, expected {}: one per image of {}", times_ns.size(), num_images, what));
  }
  return times_ns;
}

std::vector<std::int64_t> read_times(const std::filesystem::path& path) {
  const std::string text = read_text_file(path, "one time in seconds per image");
  std::vector<std::int64_t> times_ns;
  const TimeColumn column(text, ' ');
  RowReader rows(text, path.string(), ' ');
  while (rows.next()) {
    rows.expect_exactly(1, "1: a time in seconds");
    times_ns.push_back(column.read(rows));
  }
  if (times_ns.empty())
    throw InputError(path.string(), "empty, expected one time in seconds per row");
  return times_ns;
}

std::vector<std::int64_t> even_times(std::size_t num_frames, double rate_hz) {
  std::vector<std::int64_t> times_ns;
  for (std::size_t i = 0; i < num_frames; ++i) {
    times_ns.push_back(static_cast<std::int64_t>(static_cast<double>(i) * 1e9 / rate_hz));
  }
  return times_ns;
}

std::string describe_rate(const std::vector<std::int64_t>& times_ns) {
  if (times_ns.size() < 2) return fmt::format("{} frame", times_ns.size());
  const double duration_s = 1e-9 * static_cast<double>(times_ns.back() - times_ns.front());
  const double rate_hz = static_cast<double>(times_ns.size() - 1) / duration_s;
  return fmt::format("{} over {:.1f} s, {:.4g} per second",
                     count_of(times_ns.size(), "frame"),
                     duration_s,
                     rate_hz);
}

namespace {

/// Frames of images, with the partners that the options name.
void add_images(Listing& listing,
                const std::vector<std::filesystem::path>& images,
                const std::vector<std::int64_t>& times_ns,
                const std::string& where,
                const InputOptions& options) {
  std::vector<std::filesystem::path> used;
  for (const std::size_t i : keep_increasing(listing, times_ns, where)) {
    used.push_back(images[i]);
    listing.frames.push_back({times_ns[i], {images[i]}, {}});
  }
  if (listing.setup == Setup::kMono) return;
  const std::filesystem::path& others_folder =
      listing.setup == Setup::kStereo ? options.right : options.depth;
  const std::vector<std::filesystem::path> others = list_images(images_folder_of(others_folder));
  add_partners(listing, partners_by_name(used, others), others, {}, others_folder.string());
}

Listing image_listing(const std::filesystem::path& where,
                      std::string_view title,
                      const InputOptions& options) {
  const Setup richest = !options.right.empty()   ? Setup::kStereo
                        : !options.depth.empty() ? Setup::kRgbd
                                                 : Setup::kMono;
  Listing listing;
  listing.format = "images";
  listing.title = title;
  listing.setup = choose_setup(where, {Setup::kMono, richest}, options.setup);
  return listing;
}

}  // namespace

Listing list_image_folder(const std::filesystem::path& folder, const InputOptions& options) {
  Listing listing = image_listing(folder, "folder of images", options);
  const std::vector<std::filesystem::path> images = list_images(images_folder_of(folder));
  const std::filesystem::path times_path = find_image_times(images.front().parent_path());
  const std::vector<std::int64_t> times_ns = image_times(images, times_path, options, listing);
  add_images(listing, images, times_ns, images.front().parent_path().string(), options);
  return listing;
}

Listing list_named_images(const InputOptions& options, const std::filesystem::path& name) {
  const std::string where = name.string();
  Listing listing = image_listing(where, "list of images", options);
  ImageList list = options.images.empty() ? parse_image_list(options.image_list.value_or(""), where)
                                          : ImageList{options.images, {}};
  if (list.times_ns.empty()) {
    list.times_ns = image_times(list.images, {}, options, listing);
  } else {
    listing.notes.push_back("times from the list");
  }
  add_images(listing, list.images, list.times_ns, where, options);
  return listing;
}

}  // namespace waymark

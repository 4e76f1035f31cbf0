// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/input.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>

#include "waymark/bag/bag.h"
#include "waymark/base/check.h"
#include "waymark/base/text.h"
#include "waymark/input/datasets.h"
#include "waymark/input/decode.h"
#include "waymark/input/listing_input.h"
#include "waymark/input/pairing.h"
#include "waymark/input/resized_input.h"
#include "waymark/input/rotated_input.h"
#include "waymark/input/split_input.h"
#include "waymark/input/video_file.h"

namespace waymark {
namespace {

constexpr const char* kKnownFormats = "euroc, kitti, tum, replica, images, video or bag";

std::string recognize_folder(const std::filesystem::path& folder) {
  if (is_euroc(folder)) return "euroc";
  if (is_kitti(folder) || is_kitti_raw(folder)) return "kitti";
  if (std::filesystem::exists(folder / "rgb.txt")) return "tum";
  if (is_bag_folder(folder)) return "bag";
  if (std::filesystem::is_directory(folder / "images")) return "images";
  if (is_replica(folder)) return "replica";
  const std::size_t num_videos = list_videos(folder).size();
  if (num_videos == 0) return "images";
  if (num_videos == 1 || !find_chapters(folder).empty()) return "video";
  throw InputError(folder.string(), suggest_command(folder, /*are_videos=*/true));
}

std::string recognize(const std::filesystem::path& path) {
  if (std::filesystem::is_directory(path)) return recognize_folder(path);
  if (is_video_name(path)) return "video";
  if (is_bag_file(path)) return "bag";
  if (is_video_file(path)) return "video";
  throw InputError(path.string(),
                   "is neither folder nor video nor bag, expected a data set (EuRoC, KITTI, TUM "
                   "RGB-D), a folder of images, a video or a bag of ROS");
}

std::vector<std::filesystem::path> videos_of(const std::filesystem::path& path) {
  if (!std::filesystem::is_directory(path)) return {path};
  const std::vector<std::filesystem::path> videos = list_videos(path);
  if (videos.size() == 1 && !std::filesystem::is_regular_file(videos.front())) {
    throw InputError(videos.front().string(), "is no regular file, expected a video");
  }
  const std::vector<std::filesystem::path> chapters = find_chapters(path);
  if (!chapters.empty()) return chapters;
  throw InputError(path.string(), fmt::format("holds {} videos, expected one", videos.size()));
}

/// That what comes beside INPUT is of its kind.
void check_companions(const std::string& format, const InputOptions& options) {
  const auto fail = [&](const std::string& where, std::string_view expected) {
    throw InputError(
        where, fmt::format("cannot go with an input of kind {}, expected {}", format, expected));
  };
  const bool is_folder = std::filesystem::is_directory(options.right);
  if (!options.right.empty() && !(format == "images" && is_folder) &&
      !(format == "video" && !is_folder)) {
    fail(options.right.string(), "two folders of images, or two videos");
  }
  if (!options.depth.empty() && (format != "images" || !options.right.empty())) {
    fail("--depth", "one folder of images");
  }
  if (!options.topics.empty() && format != "bag") fail("--topics", "a bag");
  const bool has_imu = !options.imu.empty() && options.imu != "none";
  if (has_imu && format == "camera") fail("--imu", "a recording");
}

Listing list_files(const std::filesystem::path& path,
                   const std::string& format,
                   const InputOptions& options) {
  if (!std::filesystem::is_directory(path)) {
    throw InputError(path.string(),
                     fmt::format("is a file, expected a folder for format {}", format));
  }
  if (format == "euroc") return list_euroc(path, options);
  if (format == "kitti") {
    return is_kitti_raw(path) ? list_kitti_raw(path, options) : list_kitti(path, options);
  }
  if (format == "replica") return list_replica(path, options);
  if (format == "tum") return list_tum_rgbd(path, options);
  if (format == "images") return list_image_folder(path, options);
  throw InputError("--format",
                   fmt::format("is {}, expected {}", quote_for_message(format), kKnownFormats));
}

std::unique_ptr<Input> open_in_full_size(const std::filesystem::path& path,
                                         const InputOptions& options) {
  if (is_camera(path)) {
    check_companions("camera", options);
    return open_camera(path, options);
  }
  if (path == "-" || !options.images.empty()) {
    check_companions("images", options);
    const std::filesystem::path name = path == "-" ? "standard input" : path;
    return std::make_unique<ListingInput>(name, list_named_images(options, name), options);
  }
  if (is_address(path)) {
    check_companions("video", options);
    return open_video({path}, options);
  }
  if (!std::filesystem::exists(path)) {
    throw InputError(path.string(),
                     "does not exist, expected a data set, a folder of images, a video or a bag");
  }
  const std::string format = options.format.empty() ? recognize(path) : options.format;
  check_companions(format, options);
  try {
    if (format == "video") return open_video(videos_of(path), options);
    if (format == "bag") return open_bag(path, options);
    return std::make_unique<ListingInput>(path, list_files(path, format, options), options);
  } catch (const std::filesystem::filesystem_error& error) {
    throw InputError(
        path.string(),
        fmt::format("cannot be read: {}, expected the right to", error.code().message()));
  }
}

/// Whether an input may hold two cameras in each picture: nothing else says where the other is.
bool may_be_split(const InputOptions& options) {
  return !options.split && options.right.empty() && options.depth.empty() &&
         options.topics.size() < 2 && options.setup != Setup::kRgbd;
}

/// The input of the pictures as they are, of one camera that is not calibrated.
std::unique_ptr<Input> open_unsplit(const std::filesystem::path& path, InputOptions options) {
  options.calibration.reset();
  options.setup = Setup::kMono;
  options.has_jpeg = options.has_jpeg || options.has_right_jpeg;
  return open_in_full_size(path, options);
}

/// Where pictures have not the size that the calibration has: those of two cameras in one.
std::unique_ptr<Input> open_split_by_size(const std::filesystem::path& path,
                                          const InputOptions& options) {
  if (!may_be_split(options) || !options.calibration) return nullptr;
  const CameraDescription& camera = options.calibration->cameras.at(0).description;
  std::unique_ptr<Input> input;
  try {
    input = open_unsplit(path, options);
  } catch (const InputError&) {
    return nullptr;  // What is wrong is something else.
  }
  const InputInfo& info = input->info();
  const auto split =
      split_by_size({info.width_px, info.height_px}, {camera.width_px, camera.height_px});
  return split ? split_input(std::move(input), *split, options) : nullptr;
}

/// Without a calibration: whether some of the first pictures show it.
std::optional<Split> find_split(const std::filesystem::path& path,
                                const InputOptions& options,
                                const InputInfo& info) {
  constexpr int kNumLooked = 5;
  constexpr int kNumAlike = 3;
  if (!may_be_split(options) || info.calibration || info.is_live || info.setup != Setup::kMono ||
      !may_hold_two({info.width_px, info.height_px})) {
    return std::nullopt;
  }
  const std::unique_ptr<Input> input = open_unsplit(path, options);
  std::map<Split, int> counts;
  for (int i = 0; i < kNumLooked; ++i) {
    const std::optional<InputFrame> frame = input->next();
    if (!frame || frame->images.empty()) continue;
    const std::optional<Split> split = split_by_content(frame->images.front());
    if (split && ++counts[*split] == kNumAlike) return split;
  }
  return std::nullopt;
}

std::unique_ptr<Input> open_cameras(const std::filesystem::path& path,
                                    const InputOptions& options) {
  const bool is_told = options.split == Split::kSideBySide || options.split == Split::kTopBottom;
  if (is_told) return split_input(open_unsplit(path, options), *options.split, options);
  std::unique_ptr<Input> input;
  try {
    input = open_in_full_size(path, options);
  } catch (const InputError&) {
    input = open_split_by_size(path, options);
    if (!input) throw;
    return input;
  }
  const std::optional<Split> split = find_split(path, options, input->info());
  return split ? split_input(open_unsplit(path, options), *split, options) : std::move(input);
}

}  // namespace

bool is_address(const std::filesystem::path& path) {
  const std::string text = path.string();
  const std::size_t end = text.find("://");
  const auto is_of_scheme = [](char c) { return (c >= 'a' && c <= 'z') || is_digit(c); };
  return end != std::string::npos && end > 1 &&
         std::ranges::all_of(text.substr(0, end), is_of_scheme);
}

bool is_camera(const std::filesystem::path& path) {
  const std::string text = path.string();
  if (text.starts_with("camera:") || text.starts_with("/dev/video")) return true;
  return is_address(path) && !(text.starts_with("http") && is_video_name(path));
}

std::optional<Input::Decoding> Input::as_decoding(std::optional<InputFrame> frame) {
  if (!frame) return std::nullopt;
  const auto decoded = std::make_shared<InputFrame>(*std::move(frame));
  return [decoded] { return std::move(*decoded); };
}

std::unique_ptr<Input> open_input(const std::filesystem::path& path, const InputOptions& options) {
  silence_image_library();
  std::unique_ptr<Input> input = open_cameras(path, options);
  if (options.rotate_deg) input = rotate_input(std::move(input), *options.rotate_deg);
  if (options.resize_px) return resize_input(std::move(input), *options.resize_px);
  return options.enlarges_small ? enlarge_if_small(std::move(input)) : std::move(input);
}

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

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// What readers of data sets are made of: the files of all frames, which an input then reads.
//
//   Listing listing;
//   listing.format = "mine";
//   listing.title = "My data set";
//   const std::vector<std::filesystem::path> files = list_images("images");
//   const std::vector<std::int64_t> times = read_times("times.txt", files.size(), "images");
//   for (std::size_t i = 0; i < files.size(); ++i) listing.frames.push_back({times[i],
//   {files[i]}});

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/input/input.h"

namespace waymark {

/// Files of one moment.
struct ListedFrame {
  std::int64_t timestamp_ns = 0;              ///< As the data set states it.
  std::vector<std::filesystem::path> images;  ///< Of camera 0, and of camera 1 if there is one.
  std::filesystem::path depth;                ///< Empty: none.
  std::int64_t depth_lag_ns = 0;              ///< How much later that was taken.
};

/// A data set of image files, understood but not yet decoded: what each layout comes down to.
struct Listing {
  std::string format;               ///< As in InputOptions.
  std::string title;                ///< For people, for example "KITTI odometry".
  std::vector<ListedFrame> frames;  ///< At least one; times increase.
  Setup setup = Setup::kMono;       ///< That of the frames' images.
  /// Calibration that the data set carries; a resolution of 0 is that of the first image.
  std::optional<CameraChain> calibration;
  /// Units of depth images per metre in this layout, for where no calibration states them.
  std::optional<double> depth_factor = {};
  bool has_times = true;           ///< As in InputInfo.
  InputCounts counts = {};         ///< What is imperfect.
  std::vector<std::string> notes;  ///< What else was understood.
};

/// Cameras whose images a setup uses.
std::size_t num_cameras(Setup setup);

/// The setup to use: the wanted one if it is among those offered, else InputError; without a wish
/// the last (richest) one offered.
Setup choose_setup(const std::filesystem::path& path,
                   const std::vector<Setup>& offered,
                   const std::optional<Setup>& wanted);

/// Image files of a folder, sorted by name with numbers in it compared as numbers. Throws
/// InputError when the folder is missing or holds none; it names the sub-folders that do.
std::vector<std::filesystem::path> list_images(const std::filesystem::path& folder);
/// How many image files a folder holds; 0 where it cannot be read.
std::size_t count_images(const std::filesystem::path& folder);
/// Video files of a folder in the same order; empty if there are none.
std::vector<std::filesystem::path> list_videos(const std::filesystem::path& folder);

/// Whether a path is an address such as http://HOST/PATH, which the video library reads.
bool is_address(const std::filesystem::path& path);

/// Whether the extension is one of a video that may hold frames.
bool is_video_name(const std::filesystem::path& path);

/// times.txt, checked to hold one time per image, in any order. what names the images in errors.
std::vector<std::int64_t> read_times(const std::filesystem::path& path,
                                     std::size_t num_images,
                                     std::string_view what);
/// One time in seconds per row, in any order; nanoseconds come back. Throws InputError.
std::vector<std::int64_t> read_times(const std::filesystem::path& path);
/// Times of so many frames at an even rate.
std::vector<std::int64_t> even_times(std::size_t num_frames, double rate_hz);

/// "T frames over D s, R per second".
std::string describe_rate(const std::vector<std::int64_t>& times_ns);

}  // namespace waymark

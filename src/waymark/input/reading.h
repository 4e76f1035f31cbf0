// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// What kinds of input have in common: calibration, choice of frames, masks, grey images.

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/check.h"
#include "waymark/image/image_header.h"
#include "waymark/input/input.h"
#include "waymark/input/levels.h"

namespace waymark {

/// The calibration to use: the given one, else that of the data set, else nothing; with as many
/// cameras as the setup needs. Throws InputError when it has fewer.
std::optional<CameraChain> choose_calibration(const std::filesystem::path& path,
                                              const std::optional<CameraChain>& given,
                                              const std::optional<CameraChain>& carried,
                                              Setup setup);

/// Compares a camera with the first image of it. A camera without a resolution takes the size of
/// the image, one of that image enlarged (enlarge_if_small()), as results have it, is that of the
/// image then; InputError that names the image when they differ.
void fit_first_image(CameraChain& chain,
                     std::size_t camera,
                     const ImageSize& size,
                     const std::filesystem::path& image);

/// What is wrong with a file of another size, as messages say it.
std::string describe_wrong_size(const std::filesystem::path& image,
                                const ImageSize& size,
                                const ImageSize& expected);

/// In words, for people.
std::string describe_calibration(bool is_given, const std::optional<CameraChain>& chain);

/// Which frames of an input are used: first, first + every, ...
struct FrameSelection {
  std::size_t first = 0;
  std::size_t every = 1;
  std::optional<std::size_t> limit;

  /// Frames selected of so many.
  std::size_t count(std::size_t num_frames) const {
    if (num_frames <= first) return 0;
    const std::size_t available = (num_frames - first - 1) / every + 1;
    return limit ? std::min(*limit, available) : available;
  }
};

/// The selection of the options; InputError when it selects nothing.
inline FrameSelection select_frames(const std::filesystem::path& path,
                                    const InputOptions& options,
                                    std::optional<std::size_t> num_frames) {
  const FrameSelection selection{options.first, options.every, options.frames};
  if (options.every == 0) throw InputError("--every", "is 0, expected 1 or more");
  if (options.frames == std::size_t{0}) throw InputError("--frames", "is 0, expected 1 or more");
  if (num_frames && selection.count(*num_frames) == 0) {
    throw InputError("--first",
                     std::to_string(options.first) + " is beyond the " +
                         std::to_string(*num_frames) + " frames of " + path.string() +
                         ", expected less");
  }
  return selection;
}

/// The longest part of these times that increases (Fredman 1975), most often all.
std::vector<std::size_t> longest_increasing(const std::vector<std::int64_t>& times_ns);

/// Whether so many are most of them: all but a tenth.
bool are_most(std::size_t num_used, std::size_t num_times);

/// Which of these times to use: the longest increasing part. Throws InputError at `where` when more
/// than a tenth has to be left out. what: "images", ...
std::vector<std::size_t> increasing_times(const std::vector<std::int64_t>& times_ns,
                                          const std::string& where,
                                          std::string_view what);

/// "3 images are left out: ...", for a number above 0.
std::string describe_out_of_order(std::size_t count, std::string_view what);

/// The middle one of the steps from time to time; 0 for fewer than two.
std::int64_t median_step_ns(const std::vector<std::int64_t>& times_ns);

/// Takes the images of a frame away that comes before the first pair, or before the first depth:
/// with it a map without scale would begin. partner: what it lacks.
void hold_back(InputFrame& frame, std::string_view partner);

class VideoReader;

/// Masks of camera 0: one image for all frames, or a folder with one image per frame, named as the
/// frame's image but for the extension, or else in the order of the frames; or a video with as many
/// frames as the input, from which they are read in order.
class MaskSource {
 public:
  /// Path empty: no masks. Throws InputError when it is missing or unreadable.
  explicit MaskSource(const std::filesystem::path& path);
  ~MaskSource();

  /// The names of all frames. Throws InputError for a folder of masks of which none has one of
  /// them, unless they are as many: then they belong to the frames in their order.
  void match(const std::vector<std::string>& stems);

  /// Whether they are the frames of a video.
  bool is_video() const { return video_ != nullptr; }

  /// Whether the frame whose image has this name (without extension) has a mask.
  bool has(const std::string& stem) const;

  /// Gives a frame with images its mask, if there is one. One that cannot be read or has not the
  /// size of the image is a fault of the frame and takes its images away. Where the masks are a
  /// video frames come in order, else in any, and from any thread.
  void attach(const std::string& stem, InputFrame& frame) const;

  /// Throws InputError unless the frame, the first good one, got along with its mask.
  void check_first(const std::string& stem, const InputFrame& frame) const;

 private:
  std::filesystem::path path_of(const std::string& stem) const;
  std::optional<Image> read(const std::string& stem, std::size_t index) const;

  std::filesystem::path path_;
  std::optional<Image> fixed_;
  std::unique_ptr<VideoReader> video_;
  std::vector<std::filesystem::path> in_order_;
  std::map<std::string, std::filesystem::path> by_name_;
};

/// Numbers of 16 bits in 8.
cv::Mat in_8_bits(const cv::Mat& wide, const Levels& levels);

/// A frame of a video or a camera in grey; nothing if it has not 8 bits per channel or an odd
/// number of channels.
std::optional<Image> grey_of(const cv::Mat& frame);

/// A frame as a JPEG file.
std::string jpeg_of(const cv::Mat& frame);

/// A JPEG of what is made of the image of a JPEG, which is kept in colour for people and programs
/// that follow; empty where there is none.
std::string change_jpeg(const std::string& jpeg,
                        const std::function<cv::Mat(const cv::Mat&)>& change);

}  // namespace waymark

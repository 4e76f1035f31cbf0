// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/base/text.h"
#include "waymark/camera/rotated_camera.h"
#include "waymark/input/datasets.h"
#include "waymark/input/decode.h"
#include "waymark/input/imu_readers.h"
#include "waymark/input/listing.h"
#include "waymark/input/reading.h"
#include "waymark/input/video_reader.h"

namespace waymark {
namespace {

class VideoInput : public Input {
 public:
  VideoInput(const std::vector<std::filesystem::path>& files, const InputOptions& options)
      : reader_(files), masks_(options.mask), has_jpeg_(options.has_jpeg), fps_(options.fps) {
    info_.format = "video";
    const std::filesystem::path& path = files.front();
    choose_cameras(files, options);
    read_times_beside(path);
    const std::optional<std::size_t> num_frames =
        used_.empty() ? reader_.num_frames() : std::optional(used_.size());
    selection_ = select_frames(path, options, num_frames);
    if (num_frames) {
      info_.num_frames = selection_.count(*num_frames);
      match_masks(*num_frames);
    }
    info_.calibration = choose_calibration(path, options.calibration, std::nullopt, info_.setup);
    start(path);
    describe(files, options, num_frames);
    take_imu(
        options, [&] { return imu_of_videos(files); }, info_);
    turn_imu(info_, turned_deg_ / 90);
  }

  const InputInfo& info() const override { return info_; }

  std::optional<InputFrame> next() override {
    if (first_) return std::exchange(first_, std::nullopt);
    return read();
  }

 private:
  /// One camera; that and one of another video; or those of two tracks of the same size.
  void choose_cameras(const std::vector<std::filesystem::path>& files,
                      const InputOptions& options) {
    const std::vector<VideoTrack>& tracks = reader_.file().tracks();
    const bool has_two = options.right.empty() && tracks.size() > 1 &&
                         tracks[1].width_px == tracks[0].width_px &&
                         tracks[1].height_px == tracks[0].height_px;
    const bool is_split = options.split == Split::kTracks;
    if (is_split && !has_two) {
      throw InputError("--split",
                       fmt::format("is tracks, but {} has no second track of the same size, "
                                   "expected side-by-side, top-bottom or none",
                                   files.front().string()));
    }
    const bool is_calibrated = options.calibration && options.calibration->cameras.size() > 1;
    const bool is_pair = is_split || (has_two && is_calibrated && !options.split);
    const Setup richest = !options.right.empty() || is_pair ? Setup::kStereo : Setup::kMono;
    info_.setup = choose_setup(files.front(), {Setup::kMono, richest}, options.setup);
    if (info_.setup != Setup::kStereo) return;
    right_name_ =
        is_pair ? "the second track of " + files.front().string() : options.right.string();
    if (is_pair) {
      right_.emplace(files, 1);
    } else {
      right_.emplace(std::vector{options.right});
    }
  }

  void read_times_beside(const std::filesystem::path& path) {
    const std::filesystem::path times_path = path.parent_path() / "times.txt";
    if (is_address(path) || !std::filesystem::exists(times_path)) return;
    const std::vector<std::int64_t> times_ns = read_times(times_path);
    used_ = increasing_times(times_ns, times_path.string(), "times");
    for (const std::size_t i : used_) info_.times_ns.push_back(times_ns[i]);
    info_.counts.out_of_order = times_ns.size() - used_.size();
    num_times_ = times_ns.size();
  }

  void match_masks(std::size_t num_frames) {
    std::vector<std::string> stems;
    for (std::size_t i = 0; i < num_frames; ++i) stems.push_back(mask_name(i));
    masks_.match(stems);
  }

  /// The next selected frame of any kind, or nothing at the end of video, times or selection.
  std::optional<InputFrame> read() {
    if (selection_.limit && num_read_ >= *selection_.limit) return std::nullopt;
    const std::size_t place = selection_.first + selection_.every * num_read_;
    if (!used_.empty() && place >= used_.size()) return std::nullopt;
    const std::size_t index = used_.empty() ? place : used_[place];
    while (reader_.num_grabbed() <= index) {
      if (!reader_.grab()) {
        info_.counts.missing_at_end = reader_.num_missing();
        return std::nullopt;
      }
    }
    ++num_read_;
    InputFrame frame;
    frame.index = index;
    frame.timestamp_ns = used_.empty() ? time_of(index) : info_.times_ns[place];
    take_image(frame);
    if (right_) take_right_image(frame);
    return frame;
  }

  std::int64_t time_of(std::size_t index) const {
    if (!fps_) return reader_.timestamp_ns();
    return static_cast<std::int64_t>(static_cast<double>(index) * 1e9 / *fps_);
  }

  /// Steps the video of camera 1 to the frame of this moment, within half a frame; false if it has
  /// none.
  bool grab_right() {
    const auto half_ns = static_cast<std::int64_t>(0.5e9 / reader_.rate_hz());
    const std::int64_t time_ns = reader_.timestamp_ns();
    while (right_->num_grabbed() == 0 || right_->timestamp_ns() < time_ns - half_ns) {
      if (!right_->grab()) return false;
    }
    return right_->timestamp_ns() <= time_ns + half_ns;
  }

  void take_right_image(InputFrame& frame) {
    const bool is_there = grab_right();
    if (frame.fault != FrameFault::kNone) return;
    std::optional<Image> image = is_there ? right_->decode() : std::nullopt;
    const bool is_good = image && (!right_size_ || size_of(*image) == *right_size_);
    if (is_good) {
      right_size_ = size_of(*image);
      frame.images.push_back(*std::move(image));
      return;
    }
    ++info_.counts.without_partner;
    if (is_there) frame.warning = "the frame of camera 1 cannot be used";
  }

  void take_image(InputFrame& frame) {
    std::optional<Image> image = reader_.decode();
    if (!image) {
      frame.fault = FrameFault::kUnreadable;
      return;
    }
    if (info_.width_px > 0 &&
        (image->width_px != info_.width_px || image->height_px != info_.height_px)) {
      frame.fault = FrameFault::kWrongSize;
      return;
    }
    frame.images.push_back(std::move(*image));
    if (has_jpeg_) frame.jpeg = reader_.encode();
    masks_.attach(mask_name(frame.index), frame);
  }

  /// A calibration of the sensor, known by its sizes, is turned as the file says to turn pictures.
  void turn_calibration(const ImageSize& size) {
    const int num_quarters = reader_.num_quarters();
    std::vector<ChainCamera>& cameras = info_.calibration->cameras;
    const CameraDescription& first = cameras.front().description;
    const bool is_of_sensor = num_quarters % 2 == 1 && size.width_px != size.height_px &&
                              ImageSize{first.height_px, first.width_px} == size;
    if (!is_of_sensor || (right_ && right_->num_quarters() != num_quarters)) return;
    for (ChainCamera& camera : cameras) {
      has_lost_readout_ |= camera.readout_s != 0.0;
      camera = rotated(camera, num_quarters).value_or(camera);
    }
    turned_deg_ = 90 * num_quarters;
  }

  void start(const std::filesystem::path& path) {
    first_ = read();
    if (!first_)
      throw InputError(path.string(),
                       "ends before the first frame asked for, expected a longer video");
    masks_.check_first(mask_name(first_->index), *first_);
    if (first_->images.empty()) {
      throw InputError(path.string(),
                       "the first frame cannot be decoded, expected a video of 8 bits per channel");
    }
    if (right_ && first_->images.size() < 2) {
      throw InputError(
          right_name_,
          "has no frame beside the first one asked for, expected two videos that begin "
          "together");
    }
    const ImageSize size{first_->images[0].width_px, first_->images[0].height_px};
    if (info_.calibration) turn_calibration(size);
    if (info_.calibration) fit_first_image(*info_.calibration, 0, size, path);
    if (info_.calibration && right_) {
      fit_first_image(*info_.calibration, 1, *right_size_, right_name_);
    }
    info_.width_px = size.width_px;
    info_.height_px = size.height_px;
  }

  void describe(const std::vector<std::filesystem::path>& files,
                const InputOptions& options,
                std::optional<std::size_t> num_frames) {
    std::vector<std::string>& lines = info_.lines;
    lines.push_back(fmt::format("{}: video ({})", files.front().string(), to_string(info_.setup)));
    for (std::size_t i = 1; i < files.size(); ++i)
      lines.push_back(fmt::format("goes on in {}", files[i].string()));
    lines.push_back(describe_frames(num_frames));
    lines.push_back(fmt::format("images of {}x{} px", info_.width_px, info_.height_px));
    describe_tracks();
    if (right_) lines.push_back(fmt::format("camera 1: {}", right_name_));
    lines.push_back(describe_times());
    if (info_.counts.out_of_order > 0)
      lines.push_back(describe_out_of_order(info_.counts.out_of_order, "times"));
    const std::optional<std::size_t> counted = reader_.num_frames();
    if (!used_.empty() && counted && *counted != num_times_) {
      lines.push_back(fmt::format(
          "note: {} for {}", count_of(num_times_, "time"), count_of(*counted, "frame")));
    }
    lines.push_back(describe_calibration(options.calibration.has_value(), info_.calibration));
    if (turned_deg_ == 0) return;
    lines.push_back(fmt::format(
        "note: the calibration is that of the sensor: turned clockwise by {} degrees, as the video "
        "says of its pictures{}",
        turned_deg_,
        has_lost_readout_ ? "; its readout is not used" : ""));
  }

  void describe_tracks() {
    const VideoFile& file = reader_.file();
    if (file.track().field != Field::kBoth) {
      info_.lines.push_back(
          fmt::format("interlaced, {} field first: of each picture that field is used",
                      file.track().field == Field::kTop ? "top" : "bottom"));
    }
    for (std::size_t i = 1; i < file.tracks().size(); ++i) {
      const VideoTrack& track = file.tracks()[i];
      const bool is_smaller =
          track.width_px != file.track().width_px || track.height_px != file.track().height_px;
      if (right_ && i == 1 && !is_smaller) continue;
      info_.lines.push_back(fmt::format("note: a track of {}x{} px ({}) beside it is not used{}",
                                        track.width_px,
                                        track.height_px,
                                        track.codec,
                                        is_smaller ? ""
                                                   : "; as the other camera of a pair it is with "
                                                     "--split tracks and a calibration of both"));
    }
  }

  std::string describe_times() const {
    if (!used_.empty()) return "times from times.txt";
    if (fps_) return fmt::format("times of {:g} frames per second", *fps_);
    if (reader_.file().has_times()) return "times from the video";
    return fmt::format(
        "note: no times in the video: {:g} frames per second assumed, --fps has others",
        reader_.rate_hz());
  }

  std::string describe_frames(std::optional<std::size_t> num_frames) const {
    if (!used_.empty()) return describe_rate(info_.times_ns);
    const std::string count = num_frames ? count_of(*num_frames, "frame") : "frames not counted";
    return fmt::format("{}, {:.4g} per second", count, fps_.value_or(reader_.rate_hz()));
  }

  /// Masks of a video are named by the index of the frame, six digits.
  static std::string mask_name(std::size_t index) { return fmt::format("{:06}", index); }

  VideoReader reader_;
  MaskSource masks_;
  bool has_jpeg_;
  FrameSelection selection_;
  std::optional<double> fps_;
  std::optional<VideoReader> right_;  ///< Of camera 1.
  std::string right_name_;
  std::optional<ImageSize> right_size_;
  std::vector<std::size_t> used_;  ///< The frames that times.txt has a time for; empty: all.
  std::size_t num_times_ = 0;
  int turned_deg_ = 0;  ///< By how much the calibration was.
  bool has_lost_readout_ = false;
  InputInfo info_;
  std::optional<InputFrame> first_;
  std::size_t num_read_ = 0;
};

}  // namespace

std::unique_ptr<Input> open_video(const std::vector<std::filesystem::path>& files,
                                  const InputOptions& options) {
  silence_image_library();
  return std::make_unique<VideoInput>(files, options);
}

}  // namespace waymark

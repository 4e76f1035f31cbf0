// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

#include "waymark/bag/bag.h"
#include "waymark/base/check.h"
#include "waymark/base/text.h"
#include "waymark/input/bag_calibration.h"
#include "waymark/input/bag_frames.h"
#include "waymark/input/bag_image.h"
#include "waymark/input/bag_topics.h"
#include "waymark/input/bag_video.h"
#include "waymark/input/datasets.h"
#include "waymark/input/imu_readers.h"
#include "waymark/input/listing.h"
#include "waymark/input/reading.h"

namespace waymark {
namespace {

/// As drivers give depth in 16 bits (REP 118).
constexpr double kUnitsPerMetre = 1000.0;
constexpr std::size_t kMaxBadMessagesAtStart = 50;

[[noreturn]] void fail_without_choice(const std::string& path,
                                      const std::vector<ImageTopic>& images,
                                      const BagContent& content) {
  if (!images.empty()) {
    throw InputError(path,
                     fmt::format("names do not tell which images to use, expected --topics A[,B]: "
                                 "those of camera 0 and of camera 1 or the depth, of {}",
                                 describe(images)));
  }
  std::string topics;
  for (const BagTopic& topic : content.topics) {
    topics += fmt::format(
        "{}{} ({})", topics.empty() ? "" : ", ", printable(topic.name), printable(topic.type));
  }
  throw InputError(
      path,
      fmt::format("holds no message of sensor_msgs/Image, CompressedImage or of video, "
                  "expected images; its topics: {}",
                  topics.empty() ? "none" : topics));
}

class BagInput : public Input {
 public:
  BagInput(const std::filesystem::path& path, const InputOptions& options)
      : path_(path), bag_(path), masks_(options.mask), has_jpeg_(options.has_jpeg) {
    info_.format = "bag";
    choose(options);
    list_frames(options);
    find_levels();
    selection_ = select_frames(path, options, frames_.frames.size());
    info_.num_frames = selection_.count(frames_.frames.size());
    info_.calibration = choose_calibration(path, options.calibration, carried_, info_.setup);
    if (info_.calibration && info_.setup == Setup::kRgbd) {
      if (!info_.calibration->depth_factor) info_.calibration->depth_factor = kUnitsPerMetre;
      units_per_m_ = *info_.calibration->depth_factor;
    }
    std::vector<std::string> stems;
    for (std::size_t i = 0; i < frames_.frames.size(); ++i) stems.push_back(mask_name(i));
    masks_.match(stems);
    start();
    describe_all(options);
    const auto time_of = [this](const BagMessage& message) { return frames_.time_of(message); };
    take_imu(
        options, [&] { return imu_of_bag(bag_, time_of); }, info_);
  }

  const InputInfo& info() const override { return info_; }

  std::optional<InputFrame> next() override {
    if (num_read_ == *info_.num_frames) return std::nullopt;
    InputFrame frame = read(selection_.first + selection_.every * num_read_++);
    if (is_whole(frame)) has_begun_ = true;
    if (!has_begun_ && frame.fault == FrameFault::kNone) hold_back(frame, choice_.second->name);
    return frame;
  }

 private:
  void choose(const InputOptions& options) {
    const std::vector<ImageTopic> images = list_image_topics(bag_);
    std::vector<TopicChoice> choices;
    if (options.topics.empty()) {
      choices = find_topics(images);
    } else {
      const TopicChoice named = choose_named_topics(images, options.topics, path_.string());
      choices.push_back({Setup::kMono, named.first, std::nullopt});
      if (named.second) choices.push_back(named);
    }
    if (choices.empty()) fail_without_choice(path_.string(), images, bag_.content());
    drop_uncalibrated_stereo(options, choices);
    std::vector<Setup> offered;
    for (const TopicChoice& choice : choices) offered.push_back(choice.setup);
    info_.setup = choose_setup(path_, offered, options.setup);
    choice_ = *std::ranges::find(choices, info_.setup, &TopicChoice::setup);
    if (!options.calibration) carried_ = calibration_of(bag_, choice_);
  }

  /// A pair that was not asked for is no use without a baseline.
  void drop_uncalibrated_stereo(const InputOptions& options, std::vector<TopicChoice>& choices) {
    if (options.setup || !options.topics.empty()) return;
    std::erase_if(choices, [&](const TopicChoice& choice) {
      if (choice.setup != Setup::kStereo) return false;
      const bool is_calibrated = options.calibration ? options.calibration->cameras.size() > 1
                                                     : calibration_of(bag_, choice).has_value();
      if (is_calibrated) return false;
      notes_.push_back(
          fmt::format("{} is not used: nothing says where its camera is; for stereo "
                      "calibrate both with -c",
                      printable(choice.second->name)));
      return true;
    });
  }

  void list_frames(const InputOptions& options) {
    frames_ = list_bag_frames(bag_, choice_, options.times, path_.string());
    notes_.insert(notes_.end(), frames_.notes.begin(), frames_.notes.end());
    info_.counts.out_of_order = frames_.num_doubles + frames_.num_out_of_order;
    for (const BagFrame& frame : frames_.frames) {
      info_.times_ns.push_back(frames_.time_of(*frame.first));
      info_.counts.without_partner += choice_.second && !frame.second;
    }
  }

  std::string where_of(const ImageTopic& topic, const BagMessage& message) const {
    return fmt::format("{}: {} at {} s",
                       path_.string(),
                       printable(topic.name),
                       format_seconds(frames_.time_of(message)));
  }

  /// The decoder of a topic of video packets; nothing where it is of images.
  BagVideo* video_of(const ImageTopic& topic) {
    const std::string codec = video_codec_of(topic.encoding);
    if (codec.empty()) return nullptr;
    return &videos_.try_emplace(topic.topic, bag_, topic.topic, codec).first->second;
  }

  Image read_image(const ImageTopic& topic, const BagMessage& message) {
    const std::string where = where_of(topic, message);
    if (BagVideo* const video = video_of(topic)) return *grey_of(video->picture(message, where));
    return read_bag_image(bag_.read(message), bag_.content().topics[topic.topic], where, levels_);
  }

  std::string read_jpeg(const ImageTopic& topic, const BagMessage& message) {
    const std::string where = where_of(topic, message);
    if (BagVideo* const video = video_of(topic)) return jpeg_of(video->picture(message, where));
    return read_bag_jpeg(bag_.read(message), bag_.content().topics[topic.topic], where, levels_);
  }

  /// Of images of 16 bits.
  void find_levels() {
    GreyRangeEstimator meter;
    const std::size_t num_looked = std::min(frames_.frames.size(), kNumLevelFrames);
    for (std::size_t i = 0; i < num_looked; ++i) {
      const BagFrame& frame = frames_.frames[i * frames_.frames.size() / num_looked];
      add_levels(choice_.first, *frame.first, meter);
      if (frame.second && info_.setup == Setup::kStereo) {
        add_levels(*choice_.second, *frame.second, meter);
      }
    }
    levels_ = meter.levels();
    if (levels_ != Levels{}) notes_.push_back(levels_.describe());
  }

  void add_levels(const ImageTopic& topic, const BagMessage& message, GreyRangeEstimator& meter) {
    const bool may_be_wide = topic.encoding.find("16") != std::string::npos ||
                             topic.encoding.find("png") != std::string::npos;
    if (!may_be_wide) return;
    try {
      const auto image = read_bag_grey16(
          bag_.read(message), bag_.content().topics[topic.topic], where_of(topic, message));
      if (image) meter.add(*image);
    } catch (const InputError&) {
      // Is told of when it is read.
    }
  }

  bool is_whole(const InputFrame& frame) const {
    return frame.images.size() == num_cameras(info_.setup) &&
           (frame.depth || info_.setup != Setup::kRgbd);
  }

  InputFrame read(std::size_t index) {
    const BagFrame& listed = frames_.frames[index];
    InputFrame frame;
    frame.index = index;
    frame.timestamp_ns = frames_.time_of(*listed.first);
    try {
      take_image(choice_.first, *listed.first, frame);
      if (listed.second && info_.setup == Setup::kStereo) {
        take_image(*choice_.second, *listed.second, frame);
      }
      if (has_jpeg_ && frame.fault == FrameFault::kNone) {
        frame.jpeg = read_jpeg(choice_.first, *listed.first);
      }
    } catch (const InputError& error) {
      frame.fault = FrameFault::kUnreadable;
      frame.warning = error.what();
    }
    if (frame.fault != FrameFault::kNone) {
      frame.images.clear();
      return frame;
    }
    if (listed.second && info_.setup == Setup::kRgbd) take_depth(*listed.second, frame);
    masks_.attach(mask_name(index), frame);
    return frame;
  }

  void take_image(const ImageTopic& topic, const BagMessage& message, InputFrame& frame) {
    Image image = read_image(topic, message);
    const std::size_t camera = frame.images.size();
    if (camera < sizes_.size() && size_of(image) != sizes_[camera]) {
      frame.fault = FrameFault::kWrongSize;
      frame.warning = describe_wrong_size(where_of(topic, message), size_of(image), sizes_[camera]);
    }
    frame.images.push_back(std::move(image));
  }

  /// A bad depth image leaves the frame without depth.
  void take_depth(const BagMessage& message, InputFrame& frame) {
    const std::string where = where_of(*choice_.second, message);
    const ImageSize size = size_of(frame.images.front());
    try {
      frame.depth = read_bag_depth(
          bag_.read(message), bag_.content().topics[message.topic], units_per_m_, where);
      frame.depth_lag_ns = frames_.time_of(message) - frame.timestamp_ns;
      if (size_of(*frame.depth) == size) return;
      frame.warning = describe_wrong_size(where, size_of(*frame.depth), size);
      frame.depth.reset();
    } catch (const InputError& error) {
      frame.warning = error.what();
    }
  }

  /// Learns the sizes of the first frame that is whole, and checks it against the calibration.
  void start() {
    const std::size_t num_tried = std::min(*info_.num_frames, kMaxBadMessagesAtStart);
    std::string first_problem;
    for (std::size_t i = 0; i < num_tried; ++i) {
      const std::size_t index = selection_.first + selection_.every * i;
      const InputFrame frame = read(index);
      const bool is_mask = frame.fault != FrameFault::kNone && masks_.has(mask_name(index));
      if (is_mask) masks_.check_first(mask_name(index), frame);
      if (is_whole(frame)) return learn_sizes(index, frame);
      if (first_problem.empty()) first_problem = frame.warning;
    }
    throw InputError(first_problem.empty() ? path_.string() + ": has no partner" : first_problem,
                     fmt::format("none of {} frames from it on can be read", num_tried));
  }

  void learn_sizes(std::size_t index, const InputFrame& frame) {
    const BagFrame& listed = frames_.frames[index];
    for (std::size_t i = 0; i < frame.images.size(); ++i) {
      const ImageTopic& topic = i == 0 ? choice_.first : *choice_.second;
      sizes_.push_back(size_of(frame.images[i]));
      if (!info_.calibration) continue;
      fit_first_image(*info_.calibration,
                      i,
                      sizes_.back(),
                      where_of(topic, i == 0 ? *listed.first : *listed.second));
    }
    info_.width_px = sizes_.front().width_px;
    info_.height_px = sizes_.front().height_px;
  }

  void describe_all(const InputOptions& options) {
    const BagContent& content = bag_.content();
    std::string used = printable(choice_.first.name);
    if (choice_.second) used += " and " + printable(choice_.second->name);
    for (std::size_t i = 0; i < content.topics.size(); ++i) {
      const BagTopic& topic = content.topics[i];
      const bool is_used =
          i == choice_.first.topic || (choice_.second && i == choice_.second->topic);
      info_.topics.push_back(
          {printable(topic.name), printable(topic.type), topic.num_messages, is_used});
    }
    std::vector<std::string>& lines = info_.lines;
    lines.push_back(
        fmt::format("{}: {} ({})", path_.string(), bag_.title(), to_string(info_.setup)));
    lines.push_back(describe_rate(info_.times_ns));
    lines.push_back(
        fmt::format("images of {}x{} px from {}", info_.width_px, info_.height_px, used));
    lines.insert(lines.end(), notes_.begin(), notes_.end());
    for (const std::string& fault : content.faults) lines.push_back("note: " + fault);
    if (frames_.num_out_of_order > 0)
      lines.push_back(describe_out_of_order(frames_.num_out_of_order, "messages"));
    if (info_.counts.without_partner > 0) {
      lines.push_back(fmt::format("note: {} frames have none of {} and are used without",
                                  info_.counts.without_partner,
                                  printable(choice_.second->name)));
    }
    lines.push_back(describe_calibration(options.calibration.has_value(), info_.calibration));
  }

  /// Masks are named by the index of the frame, as those of a video.
  static std::string mask_name(std::size_t index) { return fmt::format("{:06}", index); }

  std::filesystem::path path_;
  Bag bag_;
  MaskSource masks_;
  bool has_jpeg_;
  TopicChoice choice_;
  std::optional<CameraChain> carried_;
  std::map<std::uint32_t, BagVideo> videos_;  ///< By topic.
  BagFrames frames_;
  Levels levels_;
  FrameSelection selection_;
  double units_per_m_ = kUnitsPerMetre;
  InputInfo info_;
  std::vector<std::string> notes_;
  std::vector<ImageSize> sizes_;
  std::size_t num_read_ = 0;
  bool has_begun_ = false;  ///< A frame that was whole was given.
};

}  // namespace

std::unique_ptr<Input> open_bag(const std::filesystem::path& path, const InputOptions& options) {
  return std::make_unique<BagInput>(path, options);
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/bag_video.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "waymark/bag/ros_messages.h"
#include "waymark/base/check.h"

namespace waymark {

BagVideo::BagVideo(Bag& bag, std::uint32_t topic, std::string codec)
    : bag_(bag), codec_(std::move(codec)) {
  for (const BagMessage& message : bag.content().messages) {
    if (message.topic == topic) packets_.push_back(&message);
  }
  std::ranges::stable_sort(packets_, {}, [](const auto* packet) { return packet->recorded_ns; });
  for (std::size_t i = 0; i < packets_.size(); ++i) places_[packets_[i]] = i;
}

void BagVideo::decode_next() {
  const std::size_t sent = num_sent_++;
  if (sent < packets_.size()) {
    const BagMessage& message = *packets_[sent];
    const BagTopic& topic = bag_.content().topics[message.topic];
    const std::string bytes = bag_.read(message);
    const auto packet = parse_ros_compressed_image(bytes, topic.encoding, topic.type);
    if (packet) decoder_->send(packet->data, static_cast<std::int64_t>(sent));
  } else {
    decoder_->send(nullptr);
  }
  while (decoder_->receive()) {
    const std::int64_t place = decoder_->stamp();
    if (place < static_cast<std::int64_t>(wanted_)) continue;
    if (auto picture = decoder_->picture()) pictures_[place] = *std::move(picture);
  }
}

cv::Mat BagVideo::picture(const BagMessage& message, const std::string& where) {
  constexpr std::size_t kMostReordered = 16;
  const std::size_t place = places_.at(&message);
  try {
    if (!decoder_ || place < wanted_) {
      pictures_.clear();
      decoder_.emplace(codec_);
      num_sent_ = 0;
    }
  } catch (const std::runtime_error&) {
    throw InputError(
        where,
        fmt::format("has video of {}, for which there is no decoder, expected h264", codec_));
  }
  wanted_ = place;
  pictures_.erase(pictures_.begin(), pictures_.lower_bound(place));
  while (!pictures_.contains(place) && num_sent_ <= packets_.size() &&
         num_sent_ <= place + kMostReordered) {
    decode_next();
  }
  const auto found = pictures_.find(place);
  if (found == pictures_.end()) {
    throw InputError(where,
                     fmt::format("a packet of {} that gives no picture, expected one after a key "
                                 "frame",
                                 codec_));
  }
  return found->second;
}

}  // namespace waymark

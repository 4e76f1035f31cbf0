// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "waymark/bag/bag.h"
#include "waymark/input/video_decoder.h"

namespace waymark {

/// A topic of a bag whose messages are packets of a video, each of which needs those before it.
class BagVideo {
 public:
  /// codec: of video_codec_of(). Throws InputError where there is no decoder.
  BagVideo(Bag& bag, std::uint32_t topic, std::string codec);

  /// The picture of a message of the topic. Quick where messages are asked for in their order.
  /// Throws InputError at `where` where it has none.
  cv::Mat picture(const BagMessage& message, const std::string& where);

 private:
  void decode_next();

  Bag& bag_;
  std::string codec_;
  std::vector<const BagMessage*> packets_;  ///< In the order of the recording.
  std::map<const BagMessage*, std::size_t> places_;
  std::map<std::size_t, cv::Mat> pictures_;  ///< By packet, from the one last asked for on.
  std::optional<VideoDecoder> decoder_;
  std::size_t num_sent_ = 0;
  std::size_t wanted_ = 0;
};

}  // namespace waymark

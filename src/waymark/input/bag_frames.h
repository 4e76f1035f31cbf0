// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "waymark/bag/bag.h"
#include "waymark/input/bag_topics.h"
#include "waymark/input/input.h"

namespace waymark {

/// Of the messages of a bag those of a moment.
struct BagFrame {
  const BagMessage* first = nullptr;
  const BagMessage* second = nullptr;  ///< Null: none.
};

/// What of a bag are its frames.
struct BagFrames {
  std::vector<BagFrame> frames;  ///< Their times increase.
  BagTimes times = BagTimes::kHeaders;
  std::size_t num_doubles = 0;       ///< Messages left out that are there twice.
  std::size_t num_out_of_order = 0;  ///< Messages left out as their times do not increase.
  std::vector<std::string> notes;    ///< For people.

  std::int64_t time_of(const BagMessage& message) const {
    return times == BagTimes::kRecording ? message.recorded_ns : message.timestamp_ns;
  }
};

/// Takes the messages of the topics that were chosen, each once, and pairs those of two within half
/// a frame; before the first pair there is no scale to start by. times: nothing for the stamps of
/// the headers or, where their clock was set back, those of the recorder, which go on. Throws
/// InputError for topics that do not belong together, and for times out of order.
BagFrames list_bag_frames(Bag& bag,
                          const TopicChoice& choice,
                          std::optional<BagTimes> times,
                          const std::string& name);

}  // namespace waymark

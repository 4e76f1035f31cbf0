// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/input/bag_frames.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <map>

#include "waymark/base/check.h"
#include "waymark/base/text.h"
#include "waymark/input/datasets.h"
#include "waymark/input/reading.h"

namespace waymark {
namespace {

using Messages = std::vector<const BagMessage*>;

/// The messages of a topic, each once: recordings that were joined have some twice.
Messages messages_of(Bag& bag, const ImageTopic& topic, BagFrames& frames) {
  Messages messages;
  std::map<std::int64_t, const BagMessage*> by_time;
  std::size_t num_doubles = 0;
  for (const BagMessage& message : bag.content().messages) {
    if (message.topic != topic.topic) continue;
    const auto [first, is_new] = by_time.emplace(message.timestamp_ns, &message);
    const bool is_double = !is_new && first->second->place.size == message.place.size &&
                           bag.read(*first->second) == bag.read(message);
    num_doubles += is_double;
    if (!is_double) messages.push_back(&message);
  }
  if (num_doubles > 0) {
    frames.num_doubles += num_doubles;
    frames.notes.push_back(
        fmt::format("note: {} messages of {} are there twice, the second of them "
                    "is left out",
                    num_doubles,
                    printable(topic.name)));
  }
  return messages;
}

std::vector<std::int64_t> times_of(const Messages& messages, const BagFrames& frames) {
  std::vector<std::int64_t> times_ns;
  for (const BagMessage* message : messages) times_ns.push_back(frames.time_of(*message));
  return times_ns;
}

/// Takes the times of the recording where the clock of the headers was set back: more than a few
/// messages are out of order.
void mend_times(const Messages& messages, const ImageTopic& topic, BagFrames& frames) {
  const std::vector<std::int64_t> times_ns = times_of(messages, frames);
  const auto back = std::ranges::adjacent_find(times_ns, std::greater<>());
  if (back == times_ns.end() || are_most(longest_increasing(times_ns).size(), times_ns.size())) {
    return;
  }
  frames.times = BagTimes::kRecording;
  frames.notes.push_back(fmt::format(
      "note: the clock of {} goes back by {:.3f} s after {} messages; the times of the recording "
      "are used, --times headers takes its own",
      printable(topic.name),
      1e-9 * static_cast<double>(*back - *(back + 1)),
      back - times_ns.begin() + 1));
}

/// Those of them whose times increase.
Messages increasing(const Messages& messages, const std::string& where, BagFrames& frames) {
  Messages used;
  for (const std::size_t i : increasing_times(times_of(messages, frames), where, "messages")) {
    used.push_back(messages[i]);
  }
  frames.num_out_of_order += messages.size() - used.size();
  return used;
}

/// Recorders hear of one topic before the other.
void drop_start_without_partner(const TopicChoice& choice,
                                const std::string& name,
                                BagFrames& frames) {
  const auto first =
      std::ranges::find_if(frames.frames, [](const auto& frame) { return frame.second; });
  if (first == frames.frames.end()) {
    throw InputError(name,
                     fmt::format("no message of {} within half a frame of one of {}, expected "
                                 "pairs (or --setup mono)",
                                 printable(choice.second->name),
                                 printable(choice.first.name)));
  }
  if (first != frames.frames.begin()) {
    frames.notes.push_back(
        fmt::format("{} frames at the start are left out, before the first of {}",
                    first - frames.frames.begin(),
                    printable(choice.second->name)));
  }
  frames.frames.erase(frames.frames.begin(), first);
}

}  // namespace

BagFrames list_bag_frames(Bag& bag,
                          const TopicChoice& choice,
                          std::optional<BagTimes> times,
                          const std::string& name) {
  BagFrames frames;
  const Messages first = messages_of(bag, choice.first, frames);
  const Messages second = choice.second ? messages_of(bag, *choice.second, frames) : Messages{};
  if (times == BagTimes::kRecording) {
    frames.times = *times;
    frames.notes.emplace_back("times of the recording");
  } else if (!times) {
    mend_times(first, choice.first, frames);
    if (choice.second) mend_times(second, *choice.second, frames);
  }
  const auto where_of = [&](const ImageTopic& topic) {
    return fmt::format("{}: {}", name, printable(topic.name));
  };
  for (const BagMessage* message : increasing(first, where_of(choice.first), frames))
    frames.frames.push_back({message});
  if (!choice.second) return frames;
  std::vector<std::int64_t> times_ns;
  for (const BagFrame& frame : frames.frames) times_ns.push_back(frames.time_of(*frame.first));
  const Messages used = increasing(second, where_of(*choice.second), frames);
  const auto pairs = pair_depth(times_ns, times_of(used, frames), median_step_ns(times_ns) / 2);
  for (std::size_t i = 0; i < frames.frames.size(); ++i) {
    if (pairs[i]) frames.frames[i].second = used[*pairs[i]];
  }
  drop_start_without_partner(choice, name, frames);
  return frames;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <span>

#include "waymark/view/message.h"

namespace waymark {

/// What waits to be sent to one client. Bounded: a client that reads too slowly loses what it has
/// not got and starts again with a snapshot.
class Outbox {
 public:
  struct Outgoing {
    Message message;
    bool is_text = false;
  };

  explicit Outbox(std::size_t max_bytes = std::size_t{16} << 20) : max_bytes_(max_bytes) {}

  /// Everything anew; however much it is, it does not count as waiting.
  void add_snapshot(std::span<const Message> messages);
  /// A difference.
  void add(const Message& message);
  /// False if too many answers wait: whoever asks and never reads is not served.
  bool add_answer(Message text);
  /// Only the newest is kept.
  void set_status(Message text) { status_ = std::move(text); }
  /// Only the newest is kept.
  void set_frame(Message message) { frame_ = std::move(message); }

  /// What is to be sent next: answers, then the scene, and once that is complete the status and
  /// the frame.
  std::optional<Outgoing> take();

  /// Whether differences were lost; until the next snapshot.
  bool is_behind() const { return is_behind_; }
  bool is_empty() const { return scene_.empty() && answers_.empty() && !status_ && !frame_; }

 private:
  const std::size_t max_bytes_;
  std::deque<Message> answers_;
  std::size_t num_answer_bytes_ = 0;
  std::deque<Message> scene_;
  std::size_t num_snapshot_messages_ = 0;  ///< The first of scene_.
  std::size_t num_difference_bytes_ = 0;   ///< Of the others.
  bool is_behind_ = true;                  ///< Nothing was sent so far.
  Message status_;
  Message frame_;
};

}  // namespace waymark

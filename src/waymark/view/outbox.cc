// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/view/outbox.h"

#include <utility>

namespace waymark {

void Outbox::add_snapshot(std::span<const Message> messages) {
  scene_.assign(messages.begin(), messages.end());
  num_snapshot_messages_ = messages.size();
  num_difference_bytes_ = 0;
  is_behind_ = false;
}

void Outbox::add(const Message& message) {
  if (is_behind_) return;
  scene_.push_back(message);
  num_difference_bytes_ += message->size();
  if (num_difference_bytes_ <= max_bytes_) return;
  scene_.clear();
  num_snapshot_messages_ = 0;
  num_difference_bytes_ = 0;
  is_behind_ = true;
  status_.reset();  // It tells of what will not be sent.
}

bool Outbox::add_answer(Message text) {
  num_answer_bytes_ += text->size();
  answers_.push_back(std::move(text));
  return num_answer_bytes_ <= max_bytes_;
}

std::optional<Outbox::Outgoing> Outbox::take() {
  if (!answers_.empty()) {
    Message answer = std::move(answers_.front());
    answers_.pop_front();
    num_answer_bytes_ -= answer->size();
    return Outgoing{std::move(answer), true};
  }
  if (!scene_.empty()) {
    Message message = std::move(scene_.front());
    scene_.pop_front();
    if (num_snapshot_messages_ > 0) {
      --num_snapshot_messages_;
    } else {
      num_difference_bytes_ -= message->size();
    }
    return Outgoing{std::move(message), false};
  }
  if (status_) return Outgoing{std::exchange(status_, nullptr), true};
  if (frame_) return Outgoing{std::exchange(frame_, nullptr), false};
  return std::nullopt;
}

}  // namespace waymark

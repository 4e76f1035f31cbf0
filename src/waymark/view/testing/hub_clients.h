// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "waymark/view/hub.h"
#include "waymark/view/testing/messages.h"

namespace waymark {

using nlohmann::json;

/// Has everything sent at once.
class Reader : public ViewClient {
 public:
  void send() override {
    while (const auto outgoing = outbox.take()) {
      (outgoing->is_text ? texts : messages).push_back(outgoing->message);
    }
  }
  void close() override { is_closed = true; }

  std::size_t count(MessageKind kind) const {
    std::size_t num_found = 0;
    for (const Message& message : messages)
      num_found += MessageReader(*message).kind == static_cast<std::uint8_t>(kind);
    return num_found;
  }

  /// The texts of a type.
  std::vector<json> of_type(const std::string& type) const {
    std::vector<json> found;
    for (const Message& message : texts) {
      if (json object = json::parse(*message); object["type"] == type) found.push_back(object);
    }
    return found;
  }

  std::vector<Message> messages;
  std::vector<Message> texts;
  bool is_closed = false;
};

/// Never takes anything.
class Sleeper : public ViewClient {
 public:
  void send() override {}
  void close() override { is_closed = true; }
  bool is_closed = false;
};

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "waymark/view/update.h"

namespace waymark {

/// The text messages of the viewer's protocol, see docs/viewer-protocol.md.

std::string format_hello(const SessionInfo& info);
std::string format_status(const SessionStatus& status, const Map& map, std::size_t num_clients);
std::string format_reply(const ViewReply& reply);
/// number: of the request; nothing where it could not be read. error: empty if all went well.
std::string format_reply(std::optional<std::uint64_t> number, std::string_view error);
/// Data of an element, or a reply that it does not exist.
std::string format_keyframe(const Map& map, KeyframeId id, std::uint64_t number);
std::string format_landmark(const Map& map, LandmarkId id, std::uint64_t number);

struct ShowKeyframe {
  KeyframeId id;
};
struct ShowLandmark {
  LandmarkId id;
};
struct SetRate {
  double hz = 0.0;
};

/// What a client wants.
struct ClientRequest {
  std::optional<std::uint64_t> number;  ///< Nothing where it could not be read.
  /// The string says what is wrong.
  std::variant<std::string, ViewRequest::Kind, ShowKeyframe, ShowLandmark, SetRate> content;
};

/// Reads what a client sent, whatever it is.
ClientRequest parse_request(std::string_view text);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The page in the browser; ViewPublisher tells it of a session.
//
//   Viewer page(ViewerOptions{"127.0.0.1", 0}, SessionInfo());
//   std::cout << "open " << page.url() << "\n";

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "waymark/view/update.h"

namespace waymark {

struct ViewChannel;

/// Where the server listens.
struct ViewerOptions {
  std::string host = "127.0.0.1";  ///< Address to listen at; "0.0.0.0" for all of the machine.
  std::uint16_t port = 8080;       ///< 0: one that is free.
};

/// Reads [HOST:]PORT, where an IPv6 address stands in brackets. Throws InputError, which names
/// `where`.
ViewerOptions parse_viewer_address(const std::string& text, const std::string& where);

/// Shows a session in browsers: a web server in a thread of its own, see docs/viewer-protocol.md.
/// None of the functions ever waits for it. For one thread.
class Viewer {
 public:
  /// Throws InputError where it cannot listen.
  Viewer(const ViewerOptions& options, SessionInfo info);
  /// Gives clients up to a second to take in the last updates.
  ~Viewer();
  Viewer(const Viewer&) = delete;
  Viewer& operator=(const Viewer&) = delete;

  /// For browsers; with the token where one is needed.
  std::string url() const;
  /// What the session's thread shares with that of the server, as long as this lives.
  ViewChannel& channel();
  /// False, and the update stays as it was, if the server has not taken in those before.
  bool try_push(ViewUpdate& update);
  /// What a client asked for, oldest first.
  std::optional<ViewRequest> next_request();
  /// What went wrong in the server, which goes on; only the first is told.
  std::optional<std::string> next_problem();
  /// Tells a client how its request ended.
  void reply(ViewReply reply);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace waymark

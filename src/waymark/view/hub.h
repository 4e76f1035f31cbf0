// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "waymark/base/mailbox.h"
#include "waymark/image/image.h"
#include "waymark/view/message.h"
#include "waymark/view/scene.h"
#include "waymark/view/update.h"

namespace waymark {

/// All that the session's thread and the viewer's share. Neither ever waits for the other.
struct ViewChannel {
  Mailbox<ViewUpdate> updates{64};
  Mailbox<ViewRequest> requests{64};
  Mailbox<ViewReply> replies{64};
  /// What went wrong in the viewer's thread.
  Mailbox<std::string> problems{1};
  /// Set by the viewer when it could take one, cleared by the session.
  std::atomic<bool> wants_image{false};
};

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
  bool add_answer(Message text) { return add_answer(Outgoing{std::move(text), true}); }
  bool add_answer(Outgoing answer);
  /// Whether an answer of so many bytes may wait, too.
  bool has_room_for(std::size_t num_bytes) const {
    return num_answer_bytes_ + num_bytes <= max_bytes_;
  }
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
  std::size_t max_bytes_;
  std::deque<Outgoing> answers_;
  std::size_t num_answer_bytes_ = 0;
  std::deque<Message> scene_;
  std::size_t num_snapshot_messages_ = 0;  ///< The first of scene_.
  std::size_t num_difference_bytes_ = 0;   ///< Of the others.
  bool is_behind_ = true;                  ///< Nothing was sent so far.
  Message status_;
  Message frame_;
};

/// A client as the hub sees it: an outbox that somebody empties.
class ViewClient {
 public:
  virtual ~ViewClient() = default;
  /// Begins to send what waits in the outbox, unless that goes on already.
  virtual void send() = 0;
  virtual void close() = 0;

  Outbox outbox;
  double max_rate_hz = 10.0;  ///< Of frames.

 private:
  friend class ViewHub;
  std::chrono::steady_clock::time_point last_frame_;
  std::chrono::steady_clock::time_point request_window_;
  int num_requests_ = 0;
};

/// Between the session and its viewers: takes in updates, tells all clients, takes their requests.
/// Lives in the viewer's thread.
class ViewHub {
 public:
  using Clock = std::chrono::steady_clock;

  ViewHub(ViewChannel& channel, SessionInfo info)
      : channel_(channel), info_(std::move(info)), hello_(text(format_hello(info_))) {}

  /// Takes in and tells what is new; to be called some ten times per second.
  void tick(Clock::time_point now);
  /// Gives the client a number.
  std::uint64_t add(std::shared_ptr<ViewClient> client);
  void remove(std::uint64_t number) { clients_.erase(number); }
  /// Answers what a client sent; closes it if it asks too much.
  void receive(std::uint64_t number, std::string_view message, Clock::time_point now);

  std::string status() const { return format_status(status_, scene_.map(), clients_.size()); }
  /// Whether all has been sent to all clients.
  bool is_idle() const;
  void close_clients();
  void forget_clients() { clients_.clear(); }

 private:
  static Message text(std::string content) {
    return std::make_shared<const std::string>(std::move(content));
  }
  /// True if something came.
  bool take_updates();
  /// Tells all clients who it is that they look at.
  void greet(SessionInfo info);
  void take_replies();
  void send_snapshots();
  void send_frames(Clock::time_point now);
  /// The message of image_.
  Message last_frame();
  void answer(std::uint64_t number, Outbox::Outgoing message);
  Message answer_to(std::uint64_t number, const ClientRequest& request);
  Message pass_on(ViewRequest request);
  Message get_image(ViewRequest request);
  /// Answers with an image; null: there is none.
  void send_image(const ViewRequest& request, const SharedJpeg& jpeg);

  ViewChannel& channel_;
  SessionInfo info_;
  Message hello_;
  Scene scene_;
  SessionStatus status_;
  std::map<std::uint64_t, std::shared_ptr<ViewClient>> clients_;
  std::uint64_t next_client_ = 1;
  std::vector<Message> snapshot_;            ///< Of now, once somebody needed it.
  std::shared_ptr<const DrawnFrame> image_;  ///< The newest; null if none.
  KeyframeImages keyframe_images_;           ///< Of a saved map.
  bool is_frame_new_ = false;                ///< Whether clients have to be told of it.
  Message last_frame_;                       ///< Of it, once somebody needed it.
  Clock::time_point last_status_;
};

/// A grey JPEG file of an image, scaled down to at most 640 px width; empty for an empty image.
std::string encode_preview(const Image& image);

/// The `frame` message.
Message encode_frame(const DrawnFrame& frame, std::int64_t start_ns);

}  // namespace waymark

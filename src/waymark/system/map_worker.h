// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <thread>

#include "waymark/base/feed.h"
#include "waymark/base/mailbox.h"
#include "waymark/base/timing.h"
#include "waymark/map/map.h"
#include "waymark/track/messages.h"

namespace waymark {

/// Takes the tracker's messages to the mapper, in a thread of its own unless the timing is kInline,
/// and shows the maps that come of them at fixed frames. What the work throws reaches the caller:
/// at once from send() in kInline, else from the next for_frame() that has to wait or from
/// finish().
class MapWorker {
 public:
  /// The map after a message; called for one message after the other, in order.
  using Work = std::function<std::shared_ptr<const Map>(const MapperMessage&)>;

  MapWorker(Timing timing, Work work);
  ~MapWorker();
  MapWorker(const MapWorker&) = delete;
  MapWorker& operator=(const MapWorker&) = delete;

  /// The effect of the message shows from this frame on; frames ascend.
  void send(FrameId visible_from, MapperMessage message);
  /// The newest map that a frame may see, null before the first; frames ascend.
  std::shared_ptr<const Map> for_frame(FrameId frame);
  /// Waits until all messages are done and ends the thread. No send() afterwards.
  void finish();

 private:
  struct Delivery {
    FrameId visible_from;
    MapperMessage message;
  };

  void process(const Delivery& delivery);
  void run();
  void stop();

  const Timing timing_;
  const Work work_;
  Feed<Map> feed_;
  Mailbox<Delivery> inbox_;
  std::jthread thread_;
};

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>

#include "waymark/base/mailbox.h"
#include "waymark/view/update.h"

namespace waymark {

/// All that the session's thread and the viewer's share. Neither ever waits for the other.
struct ViewChannel {
  Mailbox<ViewUpdate> updates{64};
  Mailbox<ViewRequest> requests{64};
  Mailbox<ViewReply> replies{64};
  /// Set by the viewer when it could take one, cleared by the session.
  std::atomic<bool> wants_image{false};
};

}  // namespace waymark

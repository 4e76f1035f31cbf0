// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "waymark/image/image.h"
#include "waymark/view/message.h"
#include "waymark/view/update.h"

namespace waymark {

/// A grey JPEG file of an image, scaled down to at most 640 px width; empty for an empty image.
std::string encode_preview(const Image& image);

/// The `frame` message.
Message encode_frame(const DrawnFrame& frame, std::int64_t start_ns);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <string>

#include "waymark/base/id.h"

namespace waymark {

/// A JPEG file; shared, for there are many of them and they are large. Never null.
using SharedJpeg = std::shared_ptr<const std::string>;

/// Images of camera 0 of keyframes, as map files hold them.
using KeyframeImages = std::map<KeyframeId, SharedJpeg>;

}  // namespace waymark

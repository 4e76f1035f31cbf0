// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core.hpp>
#include <optional>

#include "waymark/image/image.h"

namespace waymark {

/// A frame of a video or a camera in grey; nothing if it has not 8 bits per channel or an odd
/// number of channels.
std::optional<Image> grey_of(const cv::Mat& frame);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <string_view>

namespace waymark {

/// The grey values of what recordings mostly consist of: PNG files of 8 or 16 bits of grey or 8
/// bits each of red, green and blue, not interlaced. The same values as cv::imdecode() gives, two
/// to four times as fast. Nothing for others and damaged ones, which are left to cv::imdecode().
/// \param bytes  of a file that pixels_of_png() gave.
std::optional<cv::Mat> decode_plain_png(std::string_view bytes);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// In place of video_compression.cc where FFmpeg's libraries are left out.
#include "waymark/base/check.h"
#include "waymark/simulate/video_compression.h"

namespace waymark {

class VideoCompression::Impl {};

VideoCompression::VideoCompression(double, double) {
  throw InputError("--compressed",
                   "needs FFmpeg's libraries, and this program was built without "
                   "(WAYMARK_VIDEO=OFF), expected none");
}
VideoCompression::~VideoCompression() = default;
VideoCompression::VideoCompression(VideoCompression&&) noexcept = default;

Image VideoCompression::compress(const Image& image) { return image; }

}  // namespace waymark

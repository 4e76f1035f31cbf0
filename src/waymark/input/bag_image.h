// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "waymark/bag/bag_content.h"
#include "waymark/image/image.h"
#include "waymark/input/levels.h"

namespace waymark {

// The images in messages of a topic of sensor_msgs/Image or one of compressed images. Each
// throws InputError at `where` for what is damaged or of another kind.

/// What can be said of such a message without decoding its image.
struct BagImageHeader {
  std::string frame_id;  ///< The coordinate frame it is taken in.
  /// "mono8", "bgr8", ...; of a compressed one its format.
  std::string encoding;
  /// Distances rather than brightness.
  bool is_depth = false;
};

/// FFmpeg's name of the codec where messages of that format are packets of a video ("h264" of
/// "libx264", ...), which BagVideo decodes; empty: they are images.
std::string video_codec_of(std::string_view format);

BagImageHeader read_bag_image_header(std::string_view bytes,
                                     const BagTopic& topic,
                                     const std::string& where);

/// The image in grey: 8 bits as they are, 16 bits scaled down, colour as its luma, a Bayer pattern
/// or 4:2:2 as OpenCV has it.
Image read_bag_image(std::string_view bytes,
                     const BagTopic& topic,
                     const std::string& where,
                     const Levels& levels = {});

/// The same of an image of 16 bits, as they are; nothing for one of 8.
std::optional<BasicImage<std::uint16_t>> read_bag_grey16(std::string_view bytes,
                                                         const BagTopic& topic,
                                                         const std::string& where);

/// A depth image. Millimetres, or what the topic counts in, of 16 bits stay as they are; metres in
/// 32 bits become units_per_m of a metre.
DepthImage read_bag_depth(std::string_view bytes,
                          const BagTopic& topic,
                          double units_per_m,
                          const std::string& where);

/// The image as a JPEG file, the one in the message if there is one; in colour if it is.
std::string read_bag_jpeg(std::string_view bytes,
                          const BagTopic& topic,
                          const std::string& where,
                          const Levels& levels = {});

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Images in files or memory.
//
//   if (const std::optional<Image> image = read_grey_image("0001.png")) {
//     std::cout << image->width_px << " x " << image->height_px << "\n";
//   } else {
//     std::cerr << describe_bad_image("0001.png") << "\n";
//   }

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "waymark/image/convert.h"
#include "waymark/image/image.h"
#include "waymark/input/levels.h"

namespace waymark {

/// Decodes an image file to 8-bit grey: colour is converted, 16 bit scaled down, transparency
/// dropped, orientation tags ignored. Nothing when the file is missing, truncated, too
/// large or no image.
std::optional<Image> read_grey_image(const std::filesystem::path& path, const Levels& levels = {});

/// The same of the bytes of such a file.
std::optional<Image> decode_grey_image(std::string_view bytes, const Levels& levels = {});

/// The same of an image of 16 bits, as they are; nothing for one of 8.
std::optional<BasicImage<std::uint16_t>> read_grey16_image(const std::filesystem::path& path);
/// The same of the bytes of such a file.
std::optional<BasicImage<std::uint16_t>> decode_grey16_image(std::string_view bytes);

/// Decodes a single-channel 16-bit image, otherwise nothing.
std::optional<DepthImage> read_depth_image(const std::filesystem::path& path);
/// The same of the bytes of such a file.
std::optional<DepthImage> decode_depth_image(std::string_view bytes);

/// Why an image file could not be read, as messages go on after its name: "is 60000x60000 px,
/// expected at most ...". `expected`: what it should have been.
std::string describe_bad_image(const std::filesystem::path& path,
                               std::string_view expected = "an image");

/// Decodes the bytes of an image file to colour, grey ones too; orientation tags ignored. Nothing
/// when they are truncated, too large or no image.
std::optional<ColorImage> decode_color_image(std::string_view bytes);

/// The image of a file as a JPEG: the file itself if it is one. Nothing when it is no image.
std::optional<std::string> read_as_jpeg(const std::filesystem::path& path,
                                        const Levels& levels = {});
/// The same of the bytes of such a file.
std::optional<std::string> as_jpeg(std::string_view bytes, const Levels& levels = {});

/// The bytes of an image file.
std::string encode_jpeg(const ColorImage& image);
/// The bytes of an image file, lossless.
std::string encode_png(const Image& image);

/// Keeps OpenCV and its video library from printing to standard error; errors reach the user as
/// faults of frames. For the whole process, done once.
void silence_image_library();

}  // namespace waymark

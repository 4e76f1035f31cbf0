// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>

#include "waymark/image/image.h"
#include "waymark/image/image_header.h"
#include "waymark/input/input.h"

namespace waymark {

/// The halves that a picture of this size has where a calibration of cameras of the other size is
/// given; nothing where the sizes do not fit so.
std::optional<Split> split_by_size(const ImageSize& picture, const ImageSize& camera);

/// Whether pictures of this size, so wide or so high, may be of two cameras: few are of one.
bool may_hold_two(const ImageSize& picture);

/// Whether the halves of a picture show the same from two places next to each other: most of the
/// patches of one have their like in the same row (column) of the other. Nothing: they do not, or
/// pictures of this size may not hold two.
std::optional<Split> split_by_content(const Image& picture);

/// An input whose pictures hold two cameras side by side or one above the other: the left or upper
/// half is camera 0, the other camera 1 where the setup is stereo. input: of the pictures as they
/// are, mono, without a calibration. Throws InputError where the halves contradict the calibration
/// of the options.
std::unique_ptr<Input> split_input(std::unique_ptr<Input> input,
                                   Split split,
                                   const InputOptions& options);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <limits>
#include <string>

#include "arguments.h"
#include "arrays.h"
#include "waymark/image/convert.h"

namespace waymark::python {
namespace {

constexpr const char* kExpectedImage =
    "a numpy array of uint8 and shape (height, width), or (height, width, 3) in the order red, "
    "green, blue";
constexpr const char* kExpectedMask =
    "a numpy array of uint8 or bool and shape (height, width), 0 where the image is not used";
constexpr const char* kExpectedDepth =
    "a numpy array of shape (height, width), of uint16 in units of the sensor or of float32 in "
    "metres";
constexpr py::ssize_t kMaxSide = 1 << 15;

void check_flat(const char* name, const py::array& array, const char* expected) {
  bool is_good = array.ndim() == 2 && array.size() > 0;
  for (py::ssize_t i = 0; i < array.ndim(); ++i) is_good &= array.shape(i) <= kMaxSide;
  if (!is_good) fail_value(name, array, expected);
}

bool is_color(const py::array& array) {
  return array.ndim() == 3 && array.shape(2) == 3 && array.size() > 0 &&
         array.shape(0) <= kMaxSide && array.shape(1) <= kMaxSide;
}

/// Pixels of three bytes without gaps between rows.
ColorView borrow_color(py::array& array) {
  array = py::array_t<std::uint8_t, py::array::c_style | py::array::forcecast>(array);
  const int width = static_cast<int>(array.shape(1));
  return {static_cast<const Rgb*>(array.data()), width, static_cast<int>(array.shape(0)), width};
}

void check_setup(const ImageArguments& images, std::optional<Setup> setup) {
  const std::string name = setup ? std::string(to_string(*setup)) : "with one camera";
  if (setup == Setup::kStereo) {
    if (images.image1.is_none()) fail_value("image1", images.image1, "the image of camera 1");
  } else if (!images.image1.is_none()) {
    fail_value("image1", images.image1, "None in setup " + name);
  }
  if (!images.depth.is_none() && (setup == Setup::kMono || setup == Setup::kStereo)) {
    fail_value("depth", images.depth, "None in setup " + name);
  }
}

}  // namespace

ColorImage color_argument(const char* name, py::handle argument) {
  py::array array = array_argument(name, argument, kExpectedImage);
  if (!holds<std::uint8_t>(array)) fail_type(name, array, kExpectedImage);
  if (!is_color(array)) {
    check_flat(name, array, kExpectedImage);
    array = py::module_::import("numpy").attr("repeat")(
        array.attr("reshape")(array.shape(0), array.shape(1), 1), 3, 2);
  }
  const ColorView view = borrow_color(array);
  ColorImage image(view.width_px, view.height_px);
  image.values.assign(view.data, view.data + image.values.size());
  return image;
}

FrameArguments::FrameArguments(const ImageArguments& images,
                               std::optional<Setup> setup,
                               const DepthSettings& depth_settings) {
  static_assert(sizeof(Rgb) == 3);
  check_setup(images, setup);
  borrowed_.reserve(4);
  grey_.reserve(2);
  input_.image0 = add_image("image0", images.image0);
  if (!images.image1.is_none()) input_.image1 = add_image("image1", images.image1);
  if (!images.depth.is_none()) input_.depth = add_depth(images.depth, depth_settings);
  if (!images.mask.is_none()) input_.mask = add_mask(images.mask);
}

FrameImages FrameArguments::input(std::int64_t timestamp_ns) const {
  FrameImages input = input_;
  input.timestamp_ns = timestamp_ns;
  return input;
}

ImageView FrameArguments::add_image(const char* name, py::handle argument) {
  py::array& array = borrowed_.emplace_back(array_argument(name, argument, kExpectedImage));
  if (!holds<std::uint8_t>(array)) fail_type(name, array, kExpectedImage);
  if (is_color(array)) {
    return grey_.emplace_back(to_grey(borrow_color(array))).view();
  }
  check_flat(name, array, kExpectedImage);
  return borrow_image<std::uint8_t>(array);
}

ImageView FrameArguments::add_mask(py::handle argument) {
  py::array& array = borrowed_.emplace_back(array_argument("mask", argument, kExpectedMask));
  if (holds<bool>(array)) {
    array = py::array(array.attr("view")("uint8"));
  } else if (!holds<std::uint8_t>(array)) {
    fail_type("mask", array, kExpectedMask);
  }
  check_flat("mask", array, kExpectedMask);
  return borrow_image<std::uint8_t>(array);
}

DepthView FrameArguments::add_depth(py::handle argument, const DepthSettings& settings) {
  py::array& array = borrowed_.emplace_back(array_argument("depth", argument, kExpectedDepth));
  const bool is_metric = holds<float>(array);
  if (!is_metric && !holds<std::uint16_t>(array)) fail_type("depth", array, kExpectedDepth);
  check_flat("depth", array, kExpectedDepth);
  if (!is_metric) return borrow_image<std::uint16_t>(array);
  depth_ = depth_in_units(borrow_image<float>(array), settings);
  return depth_.view();
}

}  // namespace waymark::python

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// Images from files, and recorded sequences in the layouts that the program reads.
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "arguments.h"
#include "arrays.h"
#include "bindings.h"
#include "texts.h"
#include "waymark/base/check.h"
#include "waymark/input/decode.h"
#include "waymark/input/input.h"

namespace waymark::python {
namespace {

template <class T>
py::array image_array(BasicImage<T> image) {
  const py::ssize_t height = image.height_px, width = image.width_px;
  return array_of(std::move(image.values), {height, width});
}

/// An image file as `Read` reads it, or InputError.
template <auto Read>
py::array read_image(const py::object& path) {
  const std::filesystem::path file = path_argument("path", path);
  decltype(Read(file)) image;
  {
    const ReleasedGil released;
    image = Read(file);
  }
  if (!image) throw InputError(file.string(), "cannot be read, expected an image file");
  return image_array(*std::move(image));
}

std::optional<Image> read_grey(const std::filesystem::path& path) { return read_grey_image(path); }

/// A frame of an input with arrays; image0 is None where there is a fault.
struct PythonFrame {
  std::size_t index;
  std::int64_t timestamp_ns;
  std::optional<py::array> image0, image1, depth, mask;
};

PythonFrame frame_of(InputFrame input) {
  PythonFrame frame{input.index, input.timestamp_ns, {}, {}, {}, {}};
  if (input.fault != FrameFault::kNone) return frame;
  if (!input.images.empty()) frame.image0 = image_array(std::move(input.images[0]));
  if (input.images.size() > 1) frame.image1 = image_array(std::move(input.images[1]));
  if (input.depth) frame.depth = image_array(*std::move(input.depth));
  if (input.mask) frame.mask = image_array(*std::move(input.mask));
  return frame;
}

/// An Input, read by iterating.
class PythonInput {
 public:
  explicit PythonInput(std::unique_ptr<Input> input) : input_(std::move(input)) {}

  const InputInfo& info() const { return input_->info(); }

  PythonFrame next() {
    const Turn turn(is_taken_, "Input");
    std::optional<InputFrame> frame;
    {
      const ReleasedGil released;
      frame = input_->next();
    }
    if (!frame) throw py::stop_iteration();
    return frame_of(*std::move(frame));
  }

 private:
  std::unique_ptr<Input> input_;
  bool is_taken_ = false;
};

OfOneProcess<PythonInput> open(const py::object& path,
                               const py::object& cameras,
                               const py::object& setup) {
  InputOptions options;
  options.setup = setup_argument(setup);
  options.enlarges_small = true;
  if (!cameras.is_none()) options.calibration = read_cameras(cameras);
  return make_of_one_process<PythonInput>(open_input(path_argument("path", path), options));
}

void bind_frame(py::module_& module) {
  Class<PythonFrame>(module, "InputFrame", "The images of one moment, as System.feed() takes them.")
      .get("index", "int: in the input, from 0 on.", &PythonFrame::index)
      .get("timestamp_ns", "int: nanoseconds.", &PythonFrame::timestamp_ns)
      .get("image0",
           "uint8 array (H, W) or None: None where an image cannot be read or has the wrong size; "
           "such frames are not fed.",
           &PythonFrame::image0)
      .get("image1", "uint8 array (H, W) or None: of camera 1.", &PythonFrame::image1)
      .get("depth", "uint16 array (H, W) or None: in units of the sensor.", &PythonFrame::depth)
      .get("mask", "uint8 array (H, W) or None.", &PythonFrame::mask);
}

void bind_input(py::module_& module) {
  ThreadedClass<PythonInput>(
      module, "Input", R"(A recorded sequence, read frame by frame: iterate over it.)")
      .def("__iter__", [](const py::object& self) { return self; })
      .def("__next__", &PythonInput::next)
      .get("format",
           "str: 'euroc', 'kitti', 'tum', 'images' or 'video'.",
           [](auto& self) { return self.info().format; })
      .get("setup",
           "str: 'mono', 'stereo' or 'rgbd'.",
           [](auto& self) { return to_string(self.info().setup); })
      .get("num_frames",
           "int or None: in all; None when a video does not say.",
           [](auto& self) { return self.info().num_frames; })
      .get("calibration",
           "Calibration or None: that given, else that of the data set, else None.",
           [](auto& self) { return self.info().calibration; });
}

}  // namespace

void bind_images(py::module_& module) {
  bind_frame(module);
  bind_input(module);
  module.def("open_input",
             &open,
             py::arg("path"),
             py::arg("cameras") = py::none(),
             py::arg("setup") = py::none(),
             R"(open_input(path, cameras=None, setup=None)
--

Opens what `waymark run` reads and returns an Input: a folder in the layout of EuRoC / TUM-VI, KITTI
odometry or TUM RGB-D, a folder of images, a video file, or a bag of ROS.

cameras: path of a camchain, dict or Calibration; takes the place of what the data set carries.
setup: 'mono', 'stereo' or 'rgbd'. None: all that the input offers.

Images of less than 320x240 px come enlarged, and calibration is theirs then.

InputError, which names the file (and line), for what is missing or malformed.)");
  module.def("read_grey_image",
             &read_image<&read_grey>,
             py::arg("path"),
             R"(read_grey_image(path)
--

An image file as a uint8 array (H, W); colour is converted. InputError where it is none.)");
  module.def("read_depth_image",
             &read_image<&read_depth_image>,
             py::arg("path"),
             R"(read_depth_image(path)
--

A depth image file as a uint16 array (H, W). InputError where it is none.)");
}

}  // namespace waymark::python

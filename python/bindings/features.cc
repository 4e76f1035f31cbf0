// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <span>

#include "arrays.h"
#include "bindings.h"
#include "waymark/system/system.h"

namespace waymark::python {
namespace {

static_assert(sizeof(LandmarkId) == sizeof(std::uint32_t));
static_assert(sizeof(Eigen::Vector3f) == 3 * sizeof(float));
static_assert(offsetof(Keypoint, y_px) == offsetof(Keypoint, x_px) + sizeof(float));

py::ssize_t count(std::span<const Keypoint> keypoints) {
  return static_cast<py::ssize_t>(keypoints.size());
}

py::array pixels(const PythonFeatures& self) {
  const auto& keypoints = self.features->keypoints;
  const float* first = keypoints.empty() ? nullptr : &keypoints.front().x_px;
  return view_of(first, {count(keypoints), 2}, {sizeof(Keypoint), sizeof(float)}, self.features);
}

/// A member of every keypoint.
template <class T>
auto keypoint_column(T Keypoint::*member) {
  return [member](const PythonFeatures& self) {
    const auto& keypoints = self.features->keypoints;
    const T* first = keypoints.empty() ? nullptr : &(keypoints.front().*member);
    return view_of(first, {count(keypoints)}, {sizeof(Keypoint)}, self.features);
  };
}

/// An array of the features.
template <class T>
auto feature_column(FeatureArray<T> Features::*member) {
  return [member](const PythonFeatures& self) {
    const FeatureArray<T>& values = (*self.features).*member;
    return view_of(values.data(), {static_cast<py::ssize_t>(values.size())}, self.features);
  };
}

py::array descriptors(const PythonFeatures& self) {
  const auto& values = self.features->descriptors;
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(values.data());
  return view_of(
      bytes,
      {static_cast<py::ssize_t>(values.size()), static_cast<py::ssize_t>(sizeof(Descriptor))},
      self.features);
}

py::array bearings(const PythonFeatures& self) {
  const auto& values = self.features->bearings;
  const float* first = values.empty() ? nullptr : values.front().data();
  return view_of(first, {static_cast<py::ssize_t>(values.size()), 3}, self.features);
}

py::array landmark_ids(const PythonFeatures& self) {
  const auto& ids = *self.landmarks;
  const std::uint32_t* first = ids.empty() ? nullptr : &ids.front().value;
  return view_of(first, {static_cast<py::ssize_t>(ids.size())}, self.owner);
}

void bind_frame_details(py::module_& module) {
  Class<FrameDetails>(module, "FrameDetails", "More of the newest frame, for those who show it.")
      .get("frame",
           "int or None: as keyframes of the map have it, which goes on from those of a map made "
           "before.",
           [](auto& self) { return optional_id(self.frame); })
      .get("features",
           "Features or None: with the landmarks they show.",
           [](auto& self) -> std::optional<PythonFeatures> {
             if (!self.features) return std::nullopt;
             const auto ids = std::make_shared<const std::vector<LandmarkId>>(self.landmarks);
             return PythonFeatures{self.features, ids, ids.get()};
           });
}

}  // namespace

void bind_features(py::module_& module) {
  Class<PythonFeatures>(module, "Features", R"(The features of a frame, as read-only arrays.

All arrays look at the engine's own memory, without a copy, and keep it alive. They run in parallel:
first the num_primary features of camera 0, which have descriptors, then those that stereo search
found in camera 1, which have none and belong to one of camera 0. len() gives their number N.)")
      .def("__len__", [](const PythonFeatures& self) { return self.features->size(); })
      .get(
          "num_primary", "int: of camera 0.", [](auto& self) { return self.features->num_primary; })
      .get("pixels",
           "float32 array (N, 2): x, y in the full image; (0, 0) is the centre of the top-left "
           "pixel.",
           &pixels)
      .get("angles",
           "float32 array (N,): orientation in radians, clockwise.",
           keypoint_column(&Keypoint::angle_rad))
      .get("responses", "float32 array (N,): corner score.", keypoint_column(&Keypoint::response))
      .get("levels", "uint8 array (N,): pyramid level.", keypoint_column(&Keypoint::level))
      .get("cameras", "uint8 array (N,): index in the rig.", keypoint_column(&Keypoint::camera))
      .get("descriptors", "uint8 array (num_primary, 32): 256 bits of rotated BRIEF.", &descriptors)
      .get("bearings", "float32 array (N, 3): unit vectors in the feature's camera.", &bearings)
      .get("partners",
           "uint32 array (N,): the feature of the other camera that belongs to it, or NO_ID.",
           feature_column(&Features::partner))
      .get("ranges",
           "float32 array (num_primary,): distance along the bearing in metres, 0 where unknown; "
           "negative where a stereo pair sees the feature beyond infinity, as noise makes it do "
           "with what is far away.",
           feature_column(&Features::range_m))
      .get("landmarks",
           "uint32 array (N,): id of the landmark that it shows, or NO_ID; of a frame's details "
           "empty where it recognised none.",
           &landmark_ids);
  bind_frame_details(module);
}

}  // namespace waymark::python

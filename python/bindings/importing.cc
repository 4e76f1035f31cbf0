// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// What waymark.importing puts maps and calibrations of other programs together with. Not for users:
// arguments are sound.
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "arguments.h"
#include "bindings.h"
#include "texts.h"
#include "waymark/base/atomic_file.h"
#include "waymark/base/check.h"
#include "waymark/base/config.h"
#include "waymark/base/regular_file.h"
#include "waymark/camera/camchain.h"
#include "waymark/features/feature_geometry.h"
#include "waymark/input/foreign_calibration.h"
#include "waymark/mapping/appearance.h"

namespace waymark::python {
namespace {

/// Standard deviation in 1/m of the inverse of a depth of which nothing else is known: that of
/// structured light (Khoshelham and Elberink 2012, section 5).
constexpr double kInverseDepthSigma = 1.43e-3;
/// Closer to a camera a landmark has no direction.
constexpr double kMinDistance = 1e-9;

template <class T>
using Array = py::array_t<T, py::array::c_style | py::array::forcecast>;
using Point = std::array<double, 3>;

void append_keypoints(Features& features, std::uint8_t camera, const Array<float>& pixels) {
  for (py::ssize_t i = 0; i < pixels.shape(0); ++i) {
    Keypoint& keypoint = features.keypoints.emplace_back();
    keypoint.x_px = pixels.at(i, 0);
    keypoint.y_px = pixels.at(i, 1);
    keypoint.camera = camera;
  }
}

/// Ranges along the bearings from depths along z; 0 or less: none.
void set_ranges(const Array<float>& depths_m, Features& features) {
  for (std::size_t i = 0; i < static_cast<std::size_t>(depths_m.size()); ++i) {
    const float depth_m = depths_m.data()[i];
    const float z = features.bearings[i].z();
    if (!(depth_m > 0.0f && z > 0.0f)) continue;
    features.range_m[i] = depth_m / z;
    features.inverse_range_sigma[i] = static_cast<float>(z * kInverseDepthSigma);
  }
}

/// A map that grows by keyframes and landmarks.
class MapBuilder {
 public:
  std::size_t add_rig(const CameraChain& chain) {
    rigs_.push_back(std::make_shared<const Rig>(make_rig(chain)));
    return rigs_.size() - 1;
  }
  std::uint32_t add_submap(bool is_metric) { return map_.add_submap(is_metric).value; }

  /// Which of the pixels of a camera have a bearing.
  std::vector<bool> have_bearings(std::size_t rig,
                                  std::uint8_t camera,
                                  const Array<float>& pixels) const {
    Features features;
    append_keypoints(features, camera, pixels);
    const std::vector<std::uint8_t> is_valid = derive_geometry(*rigs_.at(rig), features);
    return {is_valid.begin(), is_valid.end()};
  }

  /// features: pixels, angles_rad, levels, descriptors and depths_m of camera 0, pixels1 of camera
  /// 1 and which of the former each belongs to. All pixels have a bearing.
  std::uint32_t add_keyframe(std::size_t rig,
                             std::uint32_t submap,
                             std::uint32_t parent,
                             std::int64_t timestamp_ns,
                             const std::array<double, 7>& rig_from_world,
                             const py::dict& features) {
    Keyframe keyframe;
    keyframe.frame = FrameId{static_cast<std::uint32_t>(map_.keyframes().size())};
    keyframe.timestamp_ns = timestamp_ns;
    keyframe.submap = SubmapId{submap};
    keyframe.parent = KeyframeId{parent};
    keyframe.rig_from_world = {
        Eigen::Quaterniond(Eigen::Map<const Eigen::Vector4d>(rig_from_world.data())).normalized(),
        Eigen::Map<const Eigen::Vector3d>(&rig_from_world[4])};
    keyframe.features = make_features(rigs_.at(rig), features);
    return map_.add_keyframe(std::move(keyframe)).value;
  }

  /// False for one that is inside a camera that sees it. observations: keyframes and features, in
  /// ascending order; counts: of frames that should have seen it, and did.
  bool add_landmark(const Point& point,
                    std::uint32_t reference,
                    const std::vector<std::pair<std::uint32_t, std::uint32_t>>& observations,
                    const std::array<std::uint32_t, 2>& counts) {
    const Eigen::Vector3d position(point.data());
    for (const auto& [keyframe, feature] : observations) {
      const Rigid3& pose = map_.keyframes().at(KeyframeId{keyframe}).rig_from_world;
      if (!((pose.origin_in_source() - position).norm() > kMinDistance)) return false;
    }
    const SubmapId submap = map_.keyframes().at(KeyframeId{reference}).submap;
    const LandmarkId id = map_.add_landmark(submap, position, KeyframeId{reference});
    for (const bool is_by_reference : {true, false}) {
      for (const auto& [keyframe, feature] : observations) {
        if ((keyframe == reference) == is_by_reference) {
          map_.observe(KeyframeId{keyframe}, feature, id);
        }
      }
    }
    map_.count_visibility(id, counts[0], counts[1]);
    map_.set_appearance(id, describe_landmark(map_, id));
    return true;
  }

  /// As they lie to each other now, which is after the loop was closed.
  void add_loop_edge(std::uint32_t from, std::uint32_t to) {
    const Rigid3& pose = map_.keyframes().at(KeyframeId{from}).rig_from_world;
    const Rigid3& other = map_.keyframes().at(KeyframeId{to}).rig_from_world;
    map_.add_loop_edge({KeyframeId{from}, KeyframeId{to}, Sim3(other * pose.inverse())});
  }

  std::shared_ptr<PythonMap> finish() {
    auto finished = std::make_shared<PythonMap>();
    finished->stored.map = map_.freeze();
    return finished;
  }

 private:
  static std::shared_ptr<const Features> make_features(std::shared_ptr<const Rig> rig,
                                                       const py::dict& given) {
    const auto pixels = given["pixels"].cast<Array<float>>();
    const auto angles = given["angles_rad"].cast<Array<float>>();
    const auto levels = given["levels"].cast<Array<std::uint8_t>>();
    const auto descriptors = given["descriptors"].cast<Array<std::uint8_t>>();
    const auto owners = given["owners"].cast<std::vector<std::uint32_t>>();
    Features features;
    append_keypoints(features, 0, pixels);
    const std::size_t count = features.size();
    for (std::size_t i = 0; i < count; ++i) {
      features.keypoints[i].angle_rad = angles.at(static_cast<py::ssize_t>(i));
      features.keypoints[i].level = levels.at(static_cast<py::ssize_t>(i));
    }
    features.num_primary = count;
    features.descriptors.resize(count);
    WAYMARK_CHECK(static_cast<std::size_t>(descriptors.nbytes()) == count * sizeof(Descriptor));
    if (count > 0) {
      std::memcpy(features.descriptors.data(), descriptors.data(), count * sizeof(Descriptor));
    }
    append_keypoints(features, 1, given["pixels1"].cast<Array<float>>());
    features.partner.assign(count, kNoFeature);
    for (const std::uint32_t owner : owners) {
      Keypoint& keypoint = features.keypoints[features.partner.size()];
      keypoint.angle_rad = features.keypoints[owner].angle_rad;
      keypoint.level = features.keypoints[owner].level;
      features.partner[owner] = static_cast<std::uint32_t>(features.partner.size());
      features.partner.push_back(owner);
    }
    features.range_m.assign(count, 0.0f);
    features.inverse_range_sigma.assign(count, 0.0f);
    derive_geometry(*rig, features);
    set_ranges(given["depths_m"].cast<Array<float>>(), features);
    if (rig->cameras.size() == 2) measure_stereo_ranges(*rig, features);
    features.rig = std::move(rig);
    return std::make_shared<const Features>(std::move(features));
  }

  Map map_;
  std::vector<std::shared_ptr<const Rig>> rigs_;
};

/// Where it stands and its content: None, a str, a list or a dict of such pairs.
py::tuple pair_of(const ConfigNode& node) {
  py::object content = py::none();
  py::list items;
  for (const ConfigNode& item : node.items) items.append(pair_of(item));
  if (node.kind == ConfigNode::Kind::kScalar) content = text_of(node.scalar);
  if (node.kind == ConfigNode::Kind::kList) content = items;
  if (node.kind == ConfigNode::Kind::kMap) {
    py::dict section;
    for (std::size_t i = 0; i < node.keys.size(); ++i) section[text_of(node.keys[i])] = items[i];
    content = section;
  }
  return py::make_tuple(text_of(node.where()), content);
}

/// The calibration in a camchain, a dict; messages call each camera what wheres says.
CameraChain make_calibration(const py::dict& camchain,
                             const std::vector<std::string>& wheres,
                             std::vector<std::string> notes) {
  CameraChain chain = read_cameras(camchain);
  for (std::size_t i = 0; i < wheres.size(); ++i) chain.cameras[i].description.where = wheres[i];
  make_rig(chain);  // Refuses what no model accepts.
  chain.notes = std::move(notes);
  return chain;
}

}  // namespace

void bind_importing(py::module_& module) {
  py::class_<MapBuilder>(module, "_MapBuilder")
      .def(py::init<>())
      .def("add_rig", &MapBuilder::add_rig)
      .def("add_submap", &MapBuilder::add_submap)
      .def("have_bearings", &MapBuilder::have_bearings)
      .def("add_keyframe", &MapBuilder::add_keyframe)
      .def("add_landmark", &MapBuilder::add_landmark)
      .def("add_loop_edge", &MapBuilder::add_loop_edge)
      .def("finish", &MapBuilder::finish);
  module.def("_calibration", &make_calibration);
  module.def("_camchain", [](const CameraChain& chain) { return text_of(format_camchain(chain)); });
  // Seven numbers: quaternion x y z w and translation.
  module.def(
      "_rigid",
      [](const std::array<double, 16>& rows, const std::string& where, const std::string& name) {
        const Eigen::Matrix4d matrix =
            Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(rows.data());
        const Rigid3 rigid = rigid_from_matrix(matrix, where, name);
        std::array<double, 7> numbers{};
        std::ranges::copy(rigid.rotation.coeffs(), numbers.begin());
        std::ranges::copy(rigid.translation, numbers.begin() + 4);
        return numbers;
      });
  module.def("_config_text", [](const py::object& path) {
    return py::bytes(ConfigSource::from_file(path_argument("path", path)).text);
  });
  module.def("_parse_config", [](const std::string& name, const py::bytes& text) {
    return pair_of(parse_config(without_opencv_header({name, text})));
  });
  module.def("_expect_file", [](const py::object& path, const std::string& expected) {
    open_regular_file(path_argument("path", path), expected);
  });
  module.def("_write_file", [](const py::object& path, const std::string& text) {
    write_file_atomically(path_argument("path", path), text);
  });
}

}  // namespace waymark::python

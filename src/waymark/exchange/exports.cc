// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/exchange/exports.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <bit>
#include <iterator>
#include <type_traits>
#include <vector>

#include "waymark/base/atomic_file.h"
#include "waymark/base/check.h"
#include "waymark/base/text.h"

namespace waymark {
namespace {

/// Appends the bytes of a number, the lowest first, whatever the order of the machine.
template <class T>
void append_little_endian(std::string& bytes, T value) {
  static_assert(std::is_arithmetic_v<T>);
  if constexpr (std::is_same_v<T, double>) {
    append_little_endian(bytes, std::bit_cast<std::uint64_t>(value));
  } else if constexpr (std::is_same_v<T, float>) {
    append_little_endian(bytes, std::bit_cast<std::uint32_t>(value));
  } else {
    const auto bits = static_cast<std::make_unsigned_t<T>>(value);
    for (std::size_t i = 0; i < sizeof(T); ++i) {
      bytes += static_cast<char>(static_cast<std::uint64_t>(bits) >> (8 * i) & 0xff);
    }
  }
}

std::string format_cameras_text(const ExportScene& scene, ColmapIds numbers) {
  std::string text =
      "# Camera list with one line of data per camera:\n"
      "#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n";
  for (std::size_t i = 0; i < scene.cameras.size(); ++i) {
    const ColmapCamera camera = colmap_camera(scene.cameras[i]);
    text += fmt::format("{} {} {} {} {}\n",
                        numbers.first_camera + i,
                        camera.model,
                        scene.cameras[i].width_px,
                        scene.cameras[i].height_px,
                        fmt::join(camera.params, " "));
  }
  return text;
}

std::string format_cameras_binary(const ExportScene& scene, ColmapIds numbers) {
  std::string bytes;
  append_little_endian(bytes, std::uint64_t{scene.cameras.size()});
  for (std::size_t i = 0; i < scene.cameras.size(); ++i) {
    const ColmapCamera camera = colmap_camera(scene.cameras[i]);
    append_little_endian(bytes, numbers.first_camera + static_cast<std::uint32_t>(i));
    append_little_endian(bytes, camera.model_id);
    append_little_endian(bytes, static_cast<std::uint64_t>(scene.cameras[i].width_px));
    append_little_endian(bytes, static_cast<std::uint64_t>(scene.cameras[i].height_px));
    for (const double param : camera.params) append_little_endian(bytes, param);
  }
  return bytes;
}

/// Number of a point in the files; -1 for none.
std::int64_t point_number(const ExportScene& scene, std::uint32_t point) {
  return point == kNoPoint ? -1 : std::int64_t{scene.points[point].landmark.value} + 1;
}

std::string format_images_text(const ExportScene& scene, ColmapIds numbers) {
  std::string text =
      "# Image list with two lines of data per image:\n"
      "#   IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n"
      "#   POINTS2D[] as (X, Y, POINT3D_ID)\n";
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    const ExportView& view = scene.views[i];
    const Eigen::Quaterniond& q = view.cam_from_world.rotation;
    const Eigen::Vector3d& t = view.cam_from_world.translation;
    fmt::format_to(std::back_inserter(text),
                   "{} {} {} {} {} {} {} {} {} {}\n",
                   numbers.first_image + i,
                   unsigned_zero(q.w()),
                   unsigned_zero(q.x()),
                   unsigned_zero(q.y()),
                   unsigned_zero(q.z()),
                   unsigned_zero(t.x()),
                   unsigned_zero(t.y()),
                   unsigned_zero(t.z()),
                   numbers.first_camera + view.camera,
                   view.name);
    for (std::size_t k = 0; k < view.pixels.size(); ++k) {
      fmt::format_to(std::back_inserter(text),
                     "{}{} {} {}",
                     k > 0 ? " " : "",
                     view.pixels[k].x() + 0.5,
                     view.pixels[k].y() + 0.5,
                     point_number(scene, view.points[k]));
    }
    text += '\n';
  }
  return text;
}

std::string format_images_binary(const ExportScene& scene, ColmapIds numbers) {
  std::string bytes;
  append_little_endian(bytes, std::uint64_t{scene.views.size()});
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    const ExportView& view = scene.views[i];
    const Eigen::Quaterniond& q = view.cam_from_world.rotation;
    append_little_endian(bytes, numbers.first_image + static_cast<std::uint32_t>(i));
    for (const double value : {q.w(), q.x(), q.y(), q.z()}) append_little_endian(bytes, value);
    for (const double value : view.cam_from_world.translation) append_little_endian(bytes, value);
    append_little_endian(bytes, numbers.first_camera + static_cast<std::uint32_t>(view.camera));
    bytes += view.name;
    bytes += '\0';
    append_little_endian(bytes, std::uint64_t{view.pixels.size()});
    for (std::size_t k = 0; k < view.pixels.size(); ++k) {
      append_little_endian(bytes, view.pixels[k].x() + 0.5);
      append_little_endian(bytes, view.pixels[k].y() + 0.5);
      append_little_endian(bytes, point_number(scene, view.points[k]));
    }
  }
  return bytes;
}

std::string format_points_text(const ExportScene& scene, ColmapIds numbers) {
  std::string text =
      "# 3D point list with one line of data per point:\n"
      "#   POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)\n";
  for (const ExportPoint& point : scene.points) {
    const Eigen::Vector3d& x = point.position_in_world;
    fmt::format_to(std::back_inserter(text),
                   "{} {} {} {} {} {} {} {}",
                   std::int64_t{point.landmark.value} + 1,
                   unsigned_zero(x.x()),
                   unsigned_zero(x.y()),
                   unsigned_zero(x.z()),
                   point.color[0],
                   point.color[1],
                   point.color[2],
                   point.error_px);
    for (const ExportObservation& observation : point.observations) {
      fmt::format_to(std::back_inserter(text),
                     " {} {}",
                     numbers.first_image + observation.view,
                     observation.feature);
    }
    text += '\n';
  }
  return text;
}

std::string format_points_binary(const ExportScene& scene, ColmapIds numbers) {
  std::string bytes;
  append_little_endian(bytes, std::uint64_t{scene.points.size()});
  for (const ExportPoint& point : scene.points) {
    append_little_endian(bytes, std::uint64_t{point.landmark.value} + 1);
    for (const double value : point.position_in_world) append_little_endian(bytes, value);
    for (const std::uint8_t channel : point.color) append_little_endian(bytes, channel);
    append_little_endian(bytes, point.error_px);
    append_little_endian(bytes, std::uint64_t{point.observations.size()});
    for (const ExportObservation& observation : point.observations) {
      append_little_endian(bytes, numbers.first_image + observation.view);
      append_little_endian(bytes, observation.feature);
    }
  }
  return bytes;
}

}  // namespace

ColmapCamera colmap_camera(const CameraDescription& camera) {
  const std::vector<double>& k = camera.distortion_coeffs;
  if (camera.camera_model != "pinhole") {
    throw InputError("export",
                     fmt::format("COLMAP has no camera model {}, expected pinhole (see "
                                 "--split-views)",
                                 camera.camera_model));
  }
  ColmapCamera result;
  result.params = camera.intrinsics;
  result.params[2] += 0.5;
  result.params[3] += 0.5;
  result.params.insert(result.params.end(), k.begin(), k.end());
  if (camera.distortion_model == "equidistant") {
    result.model_id = 5;
    result.model = "OPENCV_FISHEYE";
  } else if (k.empty()) {
    result.model_id = 1;
    result.model = "PINHOLE";
  } else if (k.size() == 4) {
    result.model_id = 4;
    result.model = "OPENCV";
  } else {
    result.model_id = 6;
    result.model = "FULL_OPENCV";
    result.params.resize(12, 0.0);
  }
  return result;
}

ColmapModel format_colmap(const ExportScene& scene, ColmapFormat form, ColmapIds numbers) {
  if (form == ColmapFormat::kText) {
    return {format_cameras_text(scene, numbers),
            format_images_text(scene, numbers),
            format_points_text(scene, numbers)};
  }
  return {format_cameras_binary(scene, numbers),
          format_images_binary(scene, numbers),
          format_points_binary(scene, numbers)};
}

void write_colmap(const std::filesystem::path& folder,
                  const ExportScene& scene,
                  ColmapFormat form,
                  ColmapIds numbers) {
  const ColmapModel model = format_colmap(scene, form, numbers);
  const std::string suffix = form == ColmapFormat::kText ? ".txt" : ".bin";
  make_output_folder(folder);
  write_file_atomically(folder / ("cameras" + suffix), model.cameras);
  write_file_atomically(folder / ("images" + suffix), model.images);
  write_file_atomically(folder / ("points3D" + suffix), model.points);
}

std::string format_ply(const ExportScene& scene) {
  std::string bytes = fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment landmarks of a Waymark map\n"
      "element vertex {}\n"
      "property float x\nproperty float y\nproperty float z\n"
      "property float nx\nproperty float ny\nproperty float nz\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n",
      scene.points.size());
  for (const ExportPoint& point : scene.points) {
    for (const double coordinate : point.position_in_world) {
      append_little_endian(bytes, static_cast<float>(coordinate));
    }
    for (const double coordinate : point.normal) {
      append_little_endian(bytes, static_cast<float>(coordinate));
    }
    for (const std::uint8_t channel : point.color) append_little_endian(bytes, channel);
  }
  return bytes;
}

void write_ply(const std::filesystem::path& path, const ExportScene& scene) {
  write_file_atomically(path, format_ply(scene));
}

}  // namespace waymark

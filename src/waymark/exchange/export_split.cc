// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/exchange/export_split.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "waymark/base/atomic_file.h"
#include "waymark/base/check.h"
#include "waymark/input/decode.h"

namespace waymark {
namespace {

CameraDescription describe(const SplitPart& part) {
  const Eigen::Vector2d &focal_px = part.pinhole.focal_px(), &center_px = part.pinhole.center_px();
  CameraDescription description;
  description.camera_model = "pinhole";
  description.intrinsics = {focal_px.x(), focal_px.y(), center_px.x(), center_px.y()};
  description.width_px = part.width_px;
  description.height_px = part.height_px;
  return description;
}

bool is_perspective(const CameraDescription& camera) {
  return camera.camera_model == "pinhole" && camera.distortion_model != "equidistant";
}

class Splitter {
 public:
  /// parts_of: none for a camera that is left as it is.
  using PartsOf = std::function<std::vector<SplitPart>(const CameraDescription&)>;

  Splitter(const ExportScene& scene, const PartsOf& parts_of) : scene_(scene) {
    for (const CameraDescription& camera : scene.cameras) {
      std::vector<SplitPart> parts = parts_of(camera);
      first_camera_.push_back(result_.scene.cameras.size());
      result_.scene.cameras.push_back(parts.empty() ? camera : describe(parts.front()));
      result_.scene.cam_from_rig.push_back(scene.cam_from_rig[parts_.size()]);
      parts_.push_back(std::move(parts));
    }
  }

  SplitScene split() {
    for (const ExportView& view : scene_.views) {
      const std::vector<SplitPart>& parts = parts_[view.camera];
      if (parts.empty()) {
        keep(view);
        continue;
      }
      std::vector<Eigen::Vector3d> bearings(view.pixels.size());
      std::vector<std::uint8_t> has_bearing(view.pixels.size());
      parts.front().camera->unproject(view.pixels, bearings, has_bearing);
      for (std::size_t i = 0; i < parts.size(); ++i) add_part(view, bearings, has_bearing, i);
    }
    finish_points();
    return std::move(result_);
  }

 private:
  void keep(const ExportView& view) {
    result_.scene.views.push_back(view);
    result_.scene.views.back().camera = first_camera_[view.camera];
    result_.parts.emplace_back();
  }

  void add_part(const ExportView& view,
                const std::vector<Eigen::Vector3d>& bearings,
                const std::vector<std::uint8_t>& has_bearing,
                std::size_t part) {
    const SplitPart& split = parts_[view.camera][part];
    ExportView added;
    added.name = split.is_only_one
                     ? view.name
                     : fmt::format("{}_{}.jpg", view.name.substr(0, view.name.rfind('.')), part);
    if (!split.sees_all) added.mask_name = added.name + ".png";
    added.keyframe = view.keyframe;
    added.timestamp_ns = view.timestamp_ns;
    added.rig_camera = view.rig_camera;
    added.camera = first_camera_[view.camera];
    added.cam_from_world =
        Rigid3(split.part_from_camera, Eigen::Vector3d::Zero()) * view.cam_from_world;
    const Eigen::AlignedBox2d image(Eigen::Vector2d::Constant(-0.5),
                                    Eigen::Vector2d(split.width_px, split.height_px).array() - 0.5);
    for (std::size_t i = 0; i < bearings.size(); ++i) {
      if (!has_bearing[i]) continue;
      const std::optional<Eigen::Vector2d> pixel =
          split.pinhole.project(split.part_from_camera * bearings[i]);
      if (!pixel || !image.contains(*pixel)) continue;
      added.pixels.push_back(*pixel);
      added.points.push_back(view.points[i]);
    }
    result_.scene.views.push_back(std::move(added));
    result_.parts.emplace_back(split);
  }

  /// Points with the observations of the parts; those that no part sees twice go.
  void finish_points() {
    ExportScene& scene = result_.scene;
    std::vector<ExportPoint> points = scene_.points;
    for (ExportPoint& point : points) point.observations.clear();
    for (std::uint32_t v = 0; v < scene.views.size(); ++v) {
      for (std::uint32_t i = 0; i < scene.views[v].points.size(); ++i) {
        const std::uint32_t point = scene.views[v].points[i];
        if (point != kNoPoint) points[point].observations.push_back({v, i});
      }
    }
    std::vector<std::uint32_t> new_index(points.size(), kNoPoint);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const bool is_lost =
          points[i].observations.size() < 2 && scene_.points[i].observations.size() >= 2;
      if (is_lost) continue;
      new_index[i] = static_cast<std::uint32_t>(scene.points.size());
      scene.points.push_back(std::move(points[i]));
    }
    for (ExportView& view : scene.views) {
      for (std::uint32_t& point : view.points) {
        if (point != kNoPoint) point = new_index[point];
      }
    }
  }

  const ExportScene& scene_;
  std::vector<std::vector<SplitPart>> parts_;  // Per camera; none where it is perspective.
  std::vector<std::size_t> first_camera_;
  SplitScene result_;
};

/// Between the four pixels around; columns go on at the other side where they repeat.
Rgb sample(const ColorImage& image, const Eigen::Vector2d& pixel, bool wraps) {
  const double left = std::floor(pixel.x()), top = std::floor(pixel.y());
  const double right_part = pixel.x() - left, lower_part = pixel.y() - top;
  const auto column = [&](int x) {
    if (wraps) return (x + image.width_px) % image.width_px;
    return std::clamp(x, 0, image.width_px - 1);
  };
  const auto row = [&](int y) { return image.row(std::clamp(y, 0, image.height_px - 1)); };
  const int x0 = column(static_cast<int>(left)), x1 = column(static_cast<int>(left) + 1);
  const Rgb* upper = row(static_cast<int>(top));
  const Rgb* lower = row(static_cast<int>(top) + 1);
  Rgb result;
  for (std::size_t c = 0; c < 3; ++c) {
    const double above = upper[x0][c] + right_part * (upper[x1][c] - upper[x0][c]);
    const double below = lower[x0][c] + right_part * (lower[x1][c] - lower[x0][c]);
    result[c] = static_cast<std::uint8_t>(std::lround(above + lower_part * (below - above)));
  }
  return result;
}

ColorImage render(const SplitPart& part, const SplitLookup& lookup, const ColorImage& image) {
  ColorImage rendered(part.width_px, part.height_px);
  const bool wraps = part.camera->wrap_width_px() > 0.0;
  for (std::size_t i = 0; i < lookup.pixels.size(); ++i) {
    if (lookup.is_visible[i]) rendered.values[i] = sample(image, lookup.pixels[i], wraps);
  }
  return rendered;
}

bool is_same_part(const SplitPart& a, const SplitPart& b) {
  return a.camera == b.camera && a.part_from_camera.coeffs() == b.part_from_camera.coeffs();
}

}  // namespace

SplitScene split_scene(const ExportScene& scene, int num_views, const CameraRegistry& registry) {
  WAYMARK_CHECK(num_views >= kMinSplitViews && num_views <= kMaxSplitViews);
  return Splitter(scene,
                  [&](const CameraDescription& camera) {
                    if (is_perspective(camera)) return std::vector<SplitPart>();
                    return split_parts(registry.make_camera(camera), num_views);
                  })
      .split();
}

SplitScene undistort_scene(const ExportScene& scene, const CameraRegistry& registry) {
  ExportScene stated = scene;
  for (CameraDescription& camera : stated.cameras) {
    if (camera.distortion_coeffs != std::vector<double>(camera.distortion_coeffs.size(), 0.0) ||
        !is_perspective(camera)) {
      continue;
    }
    camera.distortion_model = "none";
    camera.distortion_coeffs.clear();
  }
  return Splitter(stated,
                  [&](const CameraDescription& camera) {
                    std::vector<SplitPart> parts;
                    if (!is_perspective(camera) || !camera.distortion_coeffs.empty()) {
                      parts.push_back(undistorted_part(registry.make_camera(camera)));
                    }
                    return parts;
                  })
      .split();
}

/// Writes the views that are one part of one camera.
class SplitImageWriter::PartWriter {
 public:
  explicit PartWriter(const SplitPart& part) : part_(part), lookup_(make_lookup(part)) {
    if (!part.sees_all) mask_ = encode_png(split_mask(part, lookup_));
  }

  const SplitPart& part() const { return part_; }
  /// As a PNG file; empty if all is seen.
  const std::string& mask() const { return mask_; }

  /// The part of a wide image as a JPEG file; empty if that is no image of the camera.
  std::string cut(const std::string& jpeg) const {
    const std::optional<ColorImage> image = decode_color_image(jpeg);
    if (!image || image->width_px != part_.camera->width_px() ||
        image->height_px != part_.camera->height_px()) {
      return "";
    }
    return encode_jpeg(render(part_, lookup_, *image));
  }

 private:
  SplitPart part_;
  SplitLookup lookup_;
  std::string mask_;
};

SplitImageWriter::SplitImageWriter(std::filesystem::path images_folder,
                                   std::filesystem::path masks_folder)
    : images_folder_(std::move(images_folder)), masks_folder_(std::move(masks_folder)) {
  make_output_folder(images_folder_);
}

SplitImageWriter::~SplitImageWriter() = default;

void SplitImageWriter::write(const SplitScene& split, std::size_t view, const std::string& jpeg) {
  const ExportView& named = split.scene.views[view];
  const auto write_below = [](const std::filesystem::path& path, const std::string& bytes) {
    make_output_folder(path.parent_path());
    write_file_atomically(path, bytes);
  };
  if (!split.parts[view]) return write_below(images_folder_ / named.name, jpeg);
  auto writer = std::ranges::find_if(
      writers_, [&](const auto& other) { return is_same_part(other->part(), *split.parts[view]); });
  if (writer == writers_.end()) {
    writers_.push_back(std::make_unique<PartWriter>(*split.parts[view]));
    writer = writers_.end() - 1;
  }
  const std::string cut = (*writer)->cut(jpeg);
  if (cut.empty()) return;
  write_below(images_folder_ / named.name, cut);
  if (!(*writer)->mask().empty()) {
    write_below(masks_folder_ / named.mask_name, (*writer)->mask());
  }
}

std::size_t write_split_images(const std::filesystem::path& images_folder,
                               const std::filesystem::path& masks_folder,
                               const SplitScene& split,
                               const KeyframeImages& images) {
  std::size_t num_written = 0;
  SplitImageWriter writer(images_folder, masks_folder);
  for (std::size_t v = 0; v < split.scene.views.size(); ++v) {
    const ExportView& view = split.scene.views[v];
    const auto found = images.find(view.keyframe);
    if (found == images.end() || view.rig_camera > 0) continue;
    writer.write(split, v, *found->second);
    ++num_written;
  }
  return num_written;
}

}  // namespace waymark

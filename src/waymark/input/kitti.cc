// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <Eigen/Core>
#include <cmath>

#include "waymark/base/check.h"
#include "waymark/base/text.h"
#include "waymark/input/datasets.h"
#include "waymark/input/pairing.h"

namespace waymark {
namespace {

using Matrix34d = Eigen::Matrix<double, 3, 4>;

ChainCamera camera_from_projection(const RowReader& rows) {
  rows.expect_exactly(13, "13: a name and the 3x4 matrix row by row");
  Matrix34d projection;
  for (int i = 0; i < 12; ++i)
    projection(i / 4, i % 4) = rows.number(static_cast<std::size_t>(i + 1));
  const double fu = projection(0, 0);
  const double fv = projection(1, 1);
  const bool is_rectified = projection(0, 1) == 0.0 && projection(1, 0) == 0.0 &&
                            projection.row(2).head<3>() == Eigen::RowVector3d(0, 0, 1);
  if (!(fu > 0.0 && fv > 0.0) || !is_rectified) {
    throw InputError(rows.where(),
                     "no projection of a rectified camera, expected f 0 c t / 0 f c t / 0 0 1 t");
  }
  ChainCamera camera;
  camera.description.camera_model = "pinhole";
  camera.description.intrinsics = {fu, fv, projection(0, 2), projection(1, 2)};
  camera.description.where = rows.where();
  // The last column is K * (cam_from_rig translation).
  const double z = projection(2, 3);
  camera.cam_from_rig.translation = {(projection(0, 3) - projection(0, 2) * z) / fu,
                                     (projection(1, 3) - projection(1, 2) * z) / fv,
                                     z};
  return camera;
}

/// The sequences have 10 images per second.
constexpr double kKittiRateHz = 10.0;

std::vector<std::int64_t> frame_times(const std::filesystem::path& folder,
                                      std::size_t num_images,
                                      const InputOptions& options,
                                      Listing& listing) {
  const std::filesystem::path path = folder / "times.txt";
  if (std::filesystem::exists(path)) return read_times(path, num_images, "image_0");
  listing.has_times = false;
  const double rate_hz = options.fps.value_or(kKittiRateHz);
  listing.notes.push_back(fmt::format("no times.txt: {:g} images per second assumed", rate_hz));
  return even_times(num_images, rate_hz);
}

std::optional<CameraChain> read_calibration(const std::filesystem::path& folder, Setup setup) {
  const std::filesystem::path path = folder / "calib.txt";
  if (!std::filesystem::exists(path)) return std::nullopt;
  return parse_kitti_calibration(
      read_text_file(path, "calibration of KITTI odometry"), path.string(), num_cameras(setup));
}

}  // namespace

CameraChain parse_kitti_calibration(std::string_view text,
                                    const std::string& name,
                                    std::size_t num_cameras) {
  CameraChain chain;
  RowReader rows(text, name, ' ');
  while (chain.cameras.size() < num_cameras && rows.next()) {
    if (rows.fields()[0] != fmt::format("P{}:", chain.cameras.size())) continue;
    chain.cameras.push_back(camera_from_projection(rows));
  }
  if (chain.cameras.size() < num_cameras) {
    throw InputError(
        name,
        fmt::format("has no row P{}:, expected one per camera in order", chain.cameras.size()));
  }
  // Camera 0 is the origin, also where the file has another.
  const Eigen::Vector3d origin = chain.cameras.front().cam_from_rig.translation;
  for (ChainCamera& camera : chain.cameras) camera.cam_from_rig.translation -= origin;
  return chain;
}

bool is_kitti(const std::filesystem::path& folder) {
  return std::filesystem::is_directory(folder / "image_0") &&
         (std::filesystem::exists(folder / "times.txt") ||
          std::filesystem::exists(folder / "calib.txt"));
}

Listing list_kitti(const std::filesystem::path& folder, const InputOptions& options) {
  std::vector<Setup> offered = {Setup::kMono};
  if (std::filesystem::is_directory(folder / "image_1")) offered.push_back(Setup::kStereo);

  Listing listing;
  listing.format = "kitti";
  listing.title = "KITTI odometry";
  listing.setup = choose_setup(folder, offered, options.setup);
  const std::vector<std::filesystem::path> left = list_images(folder / "image_0");
  const std::vector<std::int64_t> times_ns = frame_times(folder, left.size(), options, listing);
  std::vector<std::filesystem::path> used;
  for (const std::size_t i : keep_increasing(listing, times_ns, (folder / "times.txt").string())) {
    used.push_back(left[i]);
    listing.frames.push_back({times_ns[i], {left[i]}, {}});
  }
  if (listing.setup == Setup::kStereo) {
    const std::filesystem::path right = folder / "image_1";
    const std::vector<std::filesystem::path> others = list_images(right);
    add_partners(listing, partners_by_name(used, others), others, {}, right.string());
  }
  if (!options.calibration) listing.calibration = read_calibration(folder, listing.setup);
  return listing;
}

}  // namespace waymark

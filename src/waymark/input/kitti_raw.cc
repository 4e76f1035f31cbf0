// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <Eigen/Core>
#include <array>
#include <charconv>
#include <chrono>
#include <map>

#include "waymark/base/check.h"
#include "waymark/base/text.h"
#include "waymark/image/image_header.h"
#include "waymark/input/datasets.h"
#include "waymark/input/pairing.h"

namespace waymark {
namespace {

std::filesystem::path camera_folder(const std::filesystem::path& folder, int camera) {
  return folder / fmt::format("image_{:02}", camera);
}

/// data/ of KITTI raw, data_rect/ of KITTI-360; empty if there is neither.
std::filesystem::path data_folder(const std::filesystem::path& folder, int camera) {
  for (const char* name : {"data", "data_rect"}) {
    std::filesystem::path candidate = camera_folder(folder, camera) / name;
    if (std::filesystem::is_directory(candidate)) return candidate;
  }
  return {};
}

/// The grey cameras are 0 and 1, the colour cameras of KITTI raw 2 and 3.
int first_camera(const std::filesystem::path& folder) {
  return data_folder(folder, 0).empty() && !data_folder(folder, 2).empty() ? 2 : 0;
}

/// Whole numbers of a text such as "2011-09-26", as many as there have to be.
std::optional<std::array<int, 3>> three_numbers(std::string_view text, char separator) {
  std::array<int, 3> numbers{};
  const char* at = text.data();
  const char* const end = at + text.size();
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (i > 0 && (at == end || *at++ != separator)) return std::nullopt;
    const auto [next, error] = std::from_chars(at, end, numbers[i]);
    if (error != std::errc() || next - at > 4) return std::nullopt;
    at = next;
  }
  if (at != end) return std::nullopt;
  return numbers;
}

/// "2011-09-26 13:02:25.594360375" in nanoseconds since 1970.
std::optional<std::int64_t> parse_date_and_time(std::string_view date, std::string_view time) {
  using namespace std::chrono;
  const std::size_t point = time.find('.');
  const auto day = three_numbers(date, '-');
  const auto clock = three_numbers(time.substr(0, point), ':');
  if (!day || !clock) return std::nullopt;
  const year_month_day civil(year((*day)[0]),
                             month(static_cast<unsigned>((*day)[1])),
                             std::chrono::day(static_cast<unsigned>((*day)[2])));
  if (!civil.ok() || (*day)[0] < 1970 || (*day)[0] > 2200) return std::nullopt;
  std::string fraction(point == std::string_view::npos ? "" : time.substr(point + 1));
  if (fraction.size() > 9) fraction.resize(9);
  fraction.resize(9, '0');
  std::int64_t nanoseconds = 0;
  const auto [end, error] =
      std::from_chars(fraction.data(), fraction.data() + fraction.size(), nanoseconds);
  if (error != std::errc() || end != fraction.data() + fraction.size()) return std::nullopt;
  const std::int64_t days = sys_days(civil).time_since_epoch().count();
  const std::int64_t seconds = ((days * 24 + (*clock)[0]) * 60 + (*clock)[1]) * 60 + (*clock)[2];
  return seconds * 1'000'000'000 + nanoseconds;
}

/// Rows of timestamps.txt, one per image.
std::vector<std::int64_t> read_dates(const std::filesystem::path& path) {
  const std::string text = read_text_file(path, "a date and time per image");
  std::vector<std::int64_t> times_ns;
  RowReader rows(text, path.string(), ' ');
  while (rows.next()) {
    rows.expect_exactly(2, "2: a date and a time, 2011-09-26 13:02:25.594360375");
    const auto time_ns = parse_date_and_time(rows.fields()[0], rows.fields()[1]);
    if (!time_ns) {
      throw InputError(
          rows.where(),
          fmt::format("{} is no time, expected one as 2011-09-26 13:02:25.594360375",
                      quote_for_message(fmt::format("{} {}", rows.fields()[0], rows.fields()[1]))));
    }
    times_ns.push_back(*time_ns);
  }
  return times_ns;
}

/// The images have the number of their row as a name: some drives lack images.
std::vector<std::int64_t> times_of(const std::vector<std::filesystem::path>& images,
                                   const std::filesystem::path& path) {
  const std::vector<std::int64_t> rows = read_dates(path);
  std::vector<std::int64_t> times_ns;
  for (const std::filesystem::path& image : images) {
    const std::string name = image.stem().string();
    std::size_t row = 0;
    const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), row);
    if (error != std::errc() || end != name.data() + name.size() || row >= rows.size()) {
      throw InputError(image.string(),
                       fmt::format("is not named by one of the {} rows of {}, expected 0000000000 "
                                   "and so on",
                                   rows.size(),
                                   path.string()));
    }
    times_ns.push_back(rows[row]);
  }
  return times_ns;
}

/// Rows "NAME: numbers" of calib_cam_to_cam.txt of KITTI raw or perspective.txt of KITTI-360.
class KittiRows {
 public:
  explicit KittiRows(const std::filesystem::path& path) : name_(path.string()) {
    const std::string text = read_text_file(path, "calibration of KITTI");
    RowReader rows(text, name_, ' ');
    while (rows.next()) {
      std::vector<double>& numbers = rows_[std::string(rows.fields()[0])];
      const std::string_view key = rows.fields()[0];
      if (!key.ends_with(':') || key == "calib_time:" || key == "corner_dist:") continue;
      numbers.clear();
      for (std::size_t i = 1; i < rows.fields().size(); ++i) numbers.push_back(rows.number(i));
    }
  }

  bool has(const std::string& key, int camera) const { return rows_.contains(label(key, camera)); }
  const std::vector<double>& numbers(const std::string& key, int camera, std::size_t size) const {
    const auto found = rows_.find(label(key, camera));
    if (found == rows_.end()) {
      throw InputError(name_, fmt::format("has no row {}, which is needed", label(key, camera)));
    }
    if (found->second.size() == size) return found->second;
    throw InputError(
        name_,
        fmt::format("{} {} numbers, expected {}", label(key, camera), found->second.size(), size));
  }
  const std::string& name() const { return name_; }

 private:
  static std::string label(const std::string& key, int camera) {
    return fmt::format("{}_{:02}:", key, camera);
  }

  std::string name_;
  std::map<std::string, std::vector<double>> rows_;
};

/// Images of drives that are "sync" are rectified, of those that are "extract" they are not.
ChainCamera rectified_camera(const KittiRows& rows, int camera) {
  const std::vector<double>& p = rows.numbers("P_rect", camera, 12);
  ChainCamera result;
  result.description.where = rows.name();
  result.description.camera_model = "pinhole";
  result.description.intrinsics = {p[0], p[5], p[2], p[6]};
  // The last column is K * (cam_from_rig translation).
  result.cam_from_rig.translation = {
      (p[3] - p[2] * p[11]) / p[0], (p[7] - p[6] * p[11]) / p[5], p[11]};
  return result;
}

ChainCamera unrectified_camera(const KittiRows& rows, int camera) {
  const std::vector<double>& k = rows.numbers("K", camera, 9);
  const std::vector<double>& r = rows.numbers("R", camera, 9);
  const std::vector<double>& t = rows.numbers("T", camera, 3);
  ChainCamera result;
  result.description.where = rows.name();
  result.description.camera_model = "pinhole";
  result.description.intrinsics = {k[0], k[4], k[2], k[5]};
  result.description.distortion_model = "radtan";
  result.description.distortion_coeffs = rows.numbers("D", camera, 5);
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  matrix.topLeftCorner<3, 3>() =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(r.data());
  matrix.topRightCorner<3, 1>() << t[0], t[1], t[2];
  result.cam_from_rig = rigid_from_matrix(matrix, rows.name(), fmt::format("R_{:02}", camera));
  return result;
}

/// Beside the drive, or where KITTI-360 has it; empty if it is not there.
std::filesystem::path find_calibration(const std::filesystem::path& folder) {
  const std::filesystem::path base = std::filesystem::absolute(folder / ".").lexically_normal();
  for (const char* place : {"calib_cam_to_cam.txt",
                            "../calib_cam_to_cam.txt",
                            "../../calib_cam_to_cam.txt",
                            "../../calibration/perspective.txt",
                            "../calibration/perspective.txt",
                            "perspective.txt"}) {
    const std::filesystem::path candidate = (base / place).lexically_normal();
    if (std::filesystem::exists(candidate)) return candidate;
  }
  return {};
}

std::optional<CameraChain> read_kitti_raw_calibration(const std::filesystem::path& folder,
                                                      int first,
                                                      const std::filesystem::path& image,
                                                      std::size_t num_cameras) {
  const std::filesystem::path path = find_calibration(folder);
  if (path.empty()) return std::nullopt;
  const KittiRows rows(path);
  const std::optional<ImageSize> size =
      size_in_header(read_text_file(image, "an image", std::size_t{1} << 30));
  CameraChain chain;
  for (int camera = first; camera < first + static_cast<int>(num_cameras); ++camera) {
    bool is_raw = false;
    if (size && rows.has("S", first) && rows.has("S_rect", first) && rows.has("K", first)) {
      const std::vector<double>& raw = rows.numbers("S", first, 2);
      const std::vector<double>& rectified = rows.numbers("S_rect", first, 2);
      is_raw = raw != rectified && raw[0] == size->width_px && raw[1] == size->height_px;
    }
    chain.cameras.push_back(is_raw ? unrectified_camera(rows, camera)
                                   : rectified_camera(rows, camera));
  }
  // Camera 0 is the origin, also where the file has another.
  const Rigid3 rig_from_first = chain.cameras[0].cam_from_rig.inverse();
  for (ChainCamera& camera : chain.cameras) {
    camera.cam_from_rig = camera.cam_from_rig * rig_from_first;
  }
  return chain;
}

}  // namespace

bool is_kitti_raw(const std::filesystem::path& folder) {
  const int camera = first_camera(folder);
  return !data_folder(folder, camera).empty() &&
         std::filesystem::exists(camera_folder(folder, camera) / "timestamps.txt");
}

Listing list_kitti_raw(const std::filesystem::path& folder, const InputOptions& options) {
  std::vector<Setup> offered = {Setup::kMono};
  const int camera = first_camera(folder);
  if (!data_folder(folder, camera + 1).empty()) offered.push_back(Setup::kStereo);

  Listing listing;
  listing.format = "kitti";
  const std::filesystem::path left = data_folder(folder, camera);
  listing.title = left.filename() == "data" ? "KITTI raw" : "KITTI-360";
  listing.setup = choose_setup(folder, offered, options.setup);
  const std::vector<std::filesystem::path> images = list_images(left);
  const std::filesystem::path times_path = camera_folder(folder, camera) / "timestamps.txt";
  const std::vector<std::int64_t> times_ns = times_of(images, times_path);
  std::vector<std::filesystem::path> used;
  for (const std::size_t i : keep_increasing(listing, times_ns, times_path.string())) {
    used.push_back(images[i]);
    listing.frames.push_back({times_ns[i], {images[i]}, {}});
  }
  if (listing.setup == Setup::kStereo) {
    const std::filesystem::path right = data_folder(folder, camera + 1);
    const std::vector<std::filesystem::path> others = list_images(right);
    add_partners(listing, partners_by_name(used, others), others, {}, right.string());
  }
  if (!options.calibration) {
    listing.calibration =
        read_kitti_raw_calibration(folder, camera, used.front(), num_cameras(listing.setup));
  }
  return listing;
}

}  // namespace waymark

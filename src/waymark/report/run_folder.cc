// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/report/run_folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <optional>

#include "waymark/base/check.h"
#include "waymark/base/text.h"
#include "waymark/report/documentation.h"

namespace waymark {
namespace {

/// More parts of a map than anybody looks at.
constexpr std::size_t kMaxParts = 1000;
/// No camera goes further; squares of it are still numbers.
constexpr double kMaxPosition = 1e9;

constexpr std::string_view kFrameColumns = "the columns of a run's frames.csv";

/// Where the columns of a table are.
class FrameColumns {
 public:
  FrameColumns(const RowReader& head, FrameTable& table) {
    const auto& names = head.fields();
    for (std::size_t i = 0; i < names.size(); ++i) {
      const std::string_view name = names[i];
      names_.emplace_back(name);
      if (!name.ends_with("_ms")) continue;
      if (stages_.size() == FrameRecord::kMaxStages) {
        throw InputError(head.where(),
                         fmt::format("has too many columns of times, expected {}", kFrameColumns));
      }
      stages_.push_back(i);
      table.stages.emplace_back(name.substr(0, name.size() - 3));
    }
    for (const char* needed : {"index", "timestamp_ns", "state", "reason", "matches", "inliers"}) {
      if (!find(needed)) {
        throw InputError(head.where(),
                         fmt::format("has no column '{}', expected {}", needed, kFrameColumns));
      }
    }
  }

  std::size_t size() const { return names_.size(); }
  const std::vector<std::size_t>& stages() const { return stages_; }
  std::optional<std::size_t> find(std::string_view name) const {
    const auto found = std::ranges::find(names_, name);
    if (found == names_.end()) return std::nullopt;
    return static_cast<std::size_t>(found - names_.begin());
  }

 private:
  std::vector<std::string> names_;
  std::vector<std::size_t> stages_;
};

/// A whole number from 0 to max of the current row; nothing where the field is empty or missing.
std::optional<std::uint32_t> whole(const RowReader& row,
                                   const FrameColumns& columns,
                                   std::string_view name,
                                   double max) {
  const auto at = columns.find(name);
  if (!at || row.fields()[*at].empty()) return std::nullopt;
  const auto value = parse_number(row.fields()[*at]);
  if (!value || *value < 0.0 || *value > max || *value != std::floor(*value)) {
    throw InputError(row.where(),
                     fmt::format("'{}' is {}, expected a whole number from 0 to {:.0f}",
                                 name,
                                 quote_for_message(row.fields()[*at]),
                                 max));
  }
  return static_cast<std::uint32_t>(*value);
}

/// The value of an enum whose name, as written to result files, is in a field.
template <class Enum>
Enum named(const RowReader& row, std::size_t at, Enum last) {
  const std::string_view text = row.fields()[at];
  for (int i = 0; i <= static_cast<int>(last); ++i) {
    if (to_string(static_cast<Enum>(i)) == text) return static_cast<Enum>(i);
  }
  throw InputError(row.where(),
                   fmt::format("{} is no state or reason, expected one of {}",
                               quote_for_message(text),
                               documentation("docs/results.md")));
}

ImageStatistics parse_picture(const RowReader& row, const FrameColumns& columns) {
  ImageStatistics picture;
  const auto brightness = whole(row, columns, "brightness", 255.0);
  const auto contrast = whole(row, columns, "contrast", 255.0);
  const auto blur = whole(row, columns, "blur", 100.0);
  if (!brightness || !contrast || !blur) return picture;
  return {static_cast<std::uint8_t>(*brightness),
          static_cast<std::uint8_t>(*contrast),
          static_cast<std::uint8_t>(*blur),
          true};
}

/// Of images that have no times, as if there were one per second.
std::int64_t in_place_of_time(std::size_t index) {
  return static_cast<std::int64_t>(index) * 1'000'000'000;
}

FrameRecord parse_record(const RowReader& row, const FrameColumns& columns) {
  constexpr double kMax = std::numeric_limits<std::int32_t>::max();
  FrameRecord frame;
  frame.index = whole(row, columns, "index", std::numeric_limits<std::uint32_t>::max()).value_or(0);
  const std::size_t time = *columns.find("timestamp_ns");
  frame.timestamp_ns =
      row.fields()[time].empty() ? in_place_of_time(frame.index) : row.nanoseconds(time);
  frame.state = named(row, *columns.find("state"), FrameState::kDropped);
  frame.reason = named(row, *columns.find("reason"), FrameReason::kLate);
  frame.num_matches = static_cast<int>(whole(row, columns, "matches", kMax).value_or(0));
  frame.num_inliers = static_cast<int>(whole(row, columns, "inliers", kMax).value_or(0));
  frame.is_keyframe = whole(row, columns, "is_keyframe", 1.0).value_or(0) == 1;
  frame.is_relocalized = whole(row, columns, "is_relocalized", 1.0).value_or(0) == 1;
  if (const auto submap = whole(row, columns, "submap", kMax)) frame.submap = SubmapId{*submap};
  if (const auto features = whole(row, columns, "features", 65535.0)) {
    frame.num_features = static_cast<std::uint16_t>(*features);
  }
  frame.picture = parse_picture(row, columns);
  std::vector<double> times_ms;
  for (const std::size_t at : columns.stages()) {
    times_ms.push_back(std::clamp(row.number(at), 0.0, 6e4));  // What fits into half precision.
  }
  frame.set_stages(times_ms);
  return frame;
}

/// A trajectory that may be empty, by time.
std::vector<StampedPose> read_part(const std::filesystem::path& path) {
  const std::string name = path.string();
  std::vector<StampedPose> poses = parse_tum_trajectory(read_text_file(path, "a trajectory"), name);
  for (const StampedPose& pose : poses) {
    if (!(pose.world_from_camera.translation.cwiseAbs().maxCoeff() <= kMaxPosition)) {
      throw InputError(
          name, fmt::format("has a position beyond {:g}, expected a trajectory", kMaxPosition));
    }
  }
  std::ranges::stable_sort(poses, {}, &StampedPose::timestamp_ns);
  return poses;
}

/// Of poses.csv, whose names may hold commas: the other fields are counted from the end.
std::vector<std::vector<StampedPose>> read_named_poses(const std::filesystem::path& path) {
  constexpr std::size_t kNumAfterName = 8;
  std::map<std::size_t, std::vector<StampedPose>> parts;
  const std::string text = read_text_file(path, "poses of images");
  RowReader row(text, path.string(), ',');
  row.next();
  for (std::size_t i = 0; row.next(); ++i) {
    row.expect_at_least(kNumAfterName + 1, "name,submap,tx,ty,tz,qx,qy,qz,qw");
    std::array<double, kNumAfterName> v;
    const std::size_t first = row.fields().size() - kNumAfterName;
    for (std::size_t k = 0; k < kNumAfterName; ++k) v[k] = row.number(first + k);
    const Eigen::Quaterniond rotation(v[7], v[4], v[5], v[6]);
    const Eigen::Vector3d position(v[1], v[2], v[3]);
    if (!(v[0] >= 0.0 && v[0] <= kMaxParts) || !(std::abs(rotation.norm() - 1.0) < 1e-3) ||
        !(position.cwiseAbs().maxCoeff() <= kMaxPosition)) {
      throw InputError(row.where(), "is no pose, expected one of waymark localize");
    }
    parts[static_cast<std::size_t>(v[0])].push_back(
        {in_place_of_time(i), Rigid3(rotation.normalized(), position)});
  }
  std::vector<std::vector<StampedPose>> sorted;
  for (auto& [submap, poses] : parts) sorted.push_back(std::move(poses));
  std::ranges::stable_sort(sorted, std::ranges::greater(), &std::vector<StampedPose>::size);
  if (sorted.empty()) sorted.emplace_back();
  return sorted;
}

std::vector<std::vector<StampedPose>> read_parts(const std::filesystem::path& folder) {
  const bool has_names = std::filesystem::exists(folder / "poses.csv");
  if (has_names && !std::filesystem::exists(folder / "trajectory.txt")) {
    return read_named_poses(folder / "poses.csv");
  }
  std::vector<std::vector<StampedPose>> parts = {read_part(folder / "trajectory.txt")};
  for (std::size_t i = 1; i < kMaxParts; ++i) {
    const auto path = folder / fmt::format("trajectory_{}.txt", i);
    if (!std::filesystem::exists(path)) break;
    parts.push_back(read_part(path));
  }
  return parts;
}

/// "walk" of "results/walk/" as well; of "." that of the folder itself.
std::string name_of(const std::filesystem::path& folder) {
  std::error_code error;
  const std::filesystem::path whole_path = std::filesystem::weakly_canonical(folder, error);
  const std::string name = (error ? folder : whole_path).filename().string();
  return printable(name.empty() ? folder.string() : name);
}

/// How many points the head of a PLY file announces.
std::optional<std::size_t> stated_points(std::string_view head) {
  constexpr std::string_view kElement = "\nelement vertex ";
  const std::size_t at = head.find(kElement);
  if (at == std::string_view::npos) return std::nullopt;
  const std::string_view rest = head.substr(at + kElement.size());
  const auto number = parse_number(rest.substr(0, rest.find('\n')));
  if (!number || !(*number >= 0.0 && *number <= 1e9)) return std::nullopt;
  return static_cast<std::size_t>(*number);
}

}  // namespace

FrameTable parse_frames_csv(std::string_view text, const std::string& name) {
  FrameTable table;
  RowReader rows(text, name, ',');
  if (!rows.next()) throw InputError(name, fmt::format("is empty, expected {}", kFrameColumns));
  const FrameColumns columns(rows, table);
  while (rows.next()) {
    if (columns.find("name")) {  // Which may hold commas, and is the last.
      rows.expect_at_least(columns.size(), "a field per column");
    } else {
      rows.expect_exactly(columns.size(), "a field per column");
    }
    table.frames.push_back(parse_record(rows, columns));
  }
  return table;
}

std::vector<Eigen::Vector3f> parse_points_ply(std::string_view text, const std::string& name) {
  constexpr std::string_view kHeadEnd = "end_header\n";
  const std::size_t end = text.find(kHeadEnd);
  if (!text.starts_with("ply\nformat ascii 1.0\n") || end == std::string_view::npos) {
    throw InputError(name, "has no head of a PLY file in ASCII, expected points of a run");
  }
  const std::size_t num_points = stated_points(text.substr(0, end)).value_or(0);
  std::size_t num_rows = 0;
  std::vector<Eigen::Vector3f> points;
  RowReader rows(text.substr(end + kHeadEnd.size()), name, ' ');
  while (rows.next()) {
    ++num_rows;
    rows.expect_exactly(3, "x y z");
    const Eigen::Vector3d point(rows.number(0), rows.number(1), rows.number(2));
    // Points that are far away are seen by nobody.
    if (point.cwiseAbs().maxCoeff() <= kMaxPosition) points.push_back(point.cast<float>());
  }
  if (num_rows != num_points) {
    throw InputError(name,
                     fmt::format("has {} points, expected {} as it says", num_rows, num_points));
  }
  return points;
}

std::vector<NavigationState> parse_inertial_csv(std::string_view text, const std::string& name) {
  constexpr std::size_t kNumColumns = 13;
  constexpr double kMaxValue = 1e6;
  RowReader rows(text, name, ',');
  rows.next();
  std::vector<NavigationState> states;
  while (rows.next()) {
    rows.expect_exactly(kNumColumns, "the columns of a run's inertial.csv");
    const auto vector = [&](std::size_t first) {
      return Eigen::Vector3d(rows.number(first), rows.number(first + 1), rows.number(first + 2));
    };
    NavigationState state;
    state.timestamp_ns = rows.nanoseconds(0);
    state.velocity = vector(1);
    state.biases = {vector(7), vector(10)};
    const double largest = std::max({state.velocity.cwiseAbs().maxCoeff(),
                                     state.biases.gyroscope.cwiseAbs().maxCoeff(),
                                     state.biases.accelerometer.cwiseAbs().maxCoeff()});
    const bool is_later = states.empty() || state.timestamp_ns > states.back().timestamp_ns;
    if (!(largest <= kMaxValue) || !is_later) {
      throw InputError(rows.where(), "is no state after the one before, expected a run's");
    }
    states.push_back(state);
  }
  return states;
}

RunFolder read_run_folder(const std::filesystem::path& folder) {
  constexpr std::string_view kExpected = "a folder that waymark run wrote";
  if (!std::filesystem::is_directory(folder)) {
    throw InputError(folder.string(), fmt::format("is no folder, expected {}", kExpected));
  }
  RunFolder run;
  run.name = name_of(folder);
  const auto read = [&](const char* name) { return read_text_file(folder / name, kExpected); };
  const auto path = [&](const char* name) { return (folder / name).string(); };
  run.summary = parse_summary_json(read("summary.json"), path("summary.json"));
  run.table = parse_frames_csv(read("frames.csv"), path("frames.csv"));
  run.trajectories = read_parts(folder);
  if (std::filesystem::exists(folder / "points.ply")) {
    run.points = parse_points_ply(read("points.ply"), path("points.ply"));
  }
  if (std::filesystem::exists(folder / "inertial.csv")) {
    run.inertial = parse_inertial_csv(read("inertial.csv"), path("inertial.csv"));
  }
  run.summary.counts = count_frames(run.table.frames);
  run.summary.num_trajectory_lines = run.trajectories.front().size();
  return run;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// Views of one kind of camera in the map of another: perspective ones in the map of a 360 degree
// camera, and the other way round. Needs WAYMARK_DATA.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "recorded_run.h"
#include "waymark/base/median.h"
#include "waymark/base/rng.h"
#include "waymark/camera/camchain.h"
#include "waymark/geometry/alignment.h"
#include "waymark/results/trajectory.h"
#include "waymark/session/session_options.h"
#include "waymark/simulate/sequence.h"
#include "waymark/system/localizer.h"

namespace waymark {
namespace {

constexpr std::size_t kNumFrames = 784;
constexpr std::size_t kEndOfMap = kNumFrames * 6 / 10;
/// A later frame revisits the mapped part if it is within this of a mapped frame.
constexpr double kRevisitM = 1.0;
/// A perspective view shows a tenth of a 360 degree image: a map for them has to hold more.
constexpr int kNumFeaturesOf360 = 2000;
constexpr double kMaxRollRad = 20.0 / 180.0 * std::numbers::pi;

Rig perspective_rig() {
  CameraDescription camera;
  camera.camera_model = "pinhole";
  const double focal_px = 320.0 / std::tan(35.0 / 180.0 * std::numbers::pi);
  camera.intrinsics = {focal_px, focal_px, 319.5, 239.5};
  camera.width_px = 640;
  camera.height_px = 480;
  return make_rig(mono_chain(camera));
}

std::uint8_t interpolate(const Image& image, const Eigen::Vector2d& pixel) {
  const int u = static_cast<int>(std::floor(pixel.x()));
  const int v = static_cast<int>(std::floor(pixel.y()));
  const double du = pixel.x() - u, dv = pixel.y() - v;
  const auto at = [&](int x, int y) {
    const int column = (x + image.width_px) % image.width_px;
    return double(image.row(std::clamp(y, 0, image.height_px - 1))[column]);
  };
  const double above = (1.0 - du) * at(u, v) + du * at(u + 1, v);
  const double below = (1.0 - du) * at(u, v + 1) + du * at(u + 1, v + 1);
  return static_cast<std::uint8_t>(std::lround((1.0 - dv) * above + dv * below));
}

/// What a camera sees that stands where a 360 degree camera does, turned.
Image cut_view(const Image& sphere,
               const Camera& of_sphere,
               const Camera& of_view,
               const Eigen::Matrix3d& sphere_from_view) {
  Image view(of_view.width_px(), of_view.height_px());
  const auto width = static_cast<std::size_t>(view.width_px);
  std::vector<Eigen::Vector2d> pixels(width);
  std::vector<Eigen::Vector3d> bearings(width, Eigen::Vector3d::UnitZ());
  std::vector<std::uint8_t> is_valid(width);
  for (int v = 0; v < view.height_px; ++v) {
    for (std::size_t u = 0; u < width; ++u) pixels[u] = {double(u), double(v)};
    of_view.unproject(pixels, bearings, is_valid);
    for (Eigen::Vector3d& bearing : bearings) bearing = sphere_from_view * bearing;
    of_sphere.project(bearings, pixels, is_valid);
    for (std::size_t u = 0; u < width; ++u) view.row(v)[u] = interpolate(sphere, pixels[u]);
  }
  return view;
}

struct AtriumFrame {
  std::int64_t timestamp_ns = 0;
  Image image;
};

struct Atrium {
  Rig rig;
  std::vector<AtriumFrame> mapped;
  std::vector<AtriumFrame> revisits;
  std::vector<StampedPose> truth;

  const StampedPose& truth_at(std::int64_t timestamp_ns) const {
    return *std::min_element(truth.begin(), truth.end(), [&](const auto& a, const auto& b) {
      return std::abs(a.timestamp_ns - timestamp_ns) < std::abs(b.timestamp_ns - timestamp_ns);
    });
  }

  const Eigen::Vector3d& position_at(std::int64_t timestamp_ns) const {
    return truth_at(timestamp_ns).world_from_camera.translation;
  }

  bool is_revisit(std::int64_t timestamp_ns) const {
    return std::any_of(mapped.begin(), mapped.end(), [&](const AtriumFrame& frame) {
      return (position_at(frame.timestamp_ns) - position_at(timestamp_ns)).norm() < kRevisitM;
    });
  }
};

Atrium read_atrium(const std::filesystem::path& folder) {
  SessionOptions options;
  options.input = folder;
  options.configs = {folder / "camchain.yaml"};
  PreparedInput prepared = prepare_input(options);
  Atrium atrium;
  atrium.rig = prepared.rig;
  atrium.truth = read_trajectory(folder / "groundtruth.txt");
  while (auto frame = prepared.input->next()) {
    if (frame->images.empty()) continue;
    if (frame->index < kEndOfMap) {
      atrium.mapped.push_back({frame->timestamp_ns, std::move(frame->images[0])});
    } else if (atrium.is_revisit(frame->timestamp_ns)) {
      atrium.revisits.push_back({frame->timestamp_ns, std::move(frame->images[0])});
    }
  }
  return atrium;
}

std::shared_ptr<const Map> map_frames(const Rig& rig,
                                      const Settings& settings,
                                      const std::vector<AtriumFrame>& frames) {
  System system(rig, settings, Timing::kLockstep);
  for (const AtriumFrame& frame : frames) {
    FrameImages input;
    input.timestamp_ns = frame.timestamp_ns;
    input.image0 = frame.image.view();
    system.feed(input);
  }
  system.finish();
  return system.map();
}

/// What became of the images looked for. A pose is held against the keyframe that truly was
/// nearest, so that the drift of the map, which is another test's, does not count.
class Score {
 public:
  Score(const Map& map, const Atrium& atrium) {
    std::vector<Eigen::Vector3d> estimated, true_positions;
    map.keyframes().for_each([&](KeyframeId, const Keyframe& keyframe) {
      const Rigid3& truth = atrium.truth_at(keyframe.timestamp_ns).world_from_camera;
      keyframes_.push_back({keyframe.rig_from_world, truth});
      estimated.push_back(keyframe.rig_from_world.origin_in_source());
      true_positions.push_back(truth.translation);
    });
    m_per_unit_ = align_similarity(estimated, true_positions).value().scale;
  }

  void add(const TrackingResult& result, const Rigid3& truth) {
    ++num_images_;
    if (!result.world_from_rig) return;
    const SeenKeyframe& nearest = *std::ranges::min_element(keyframes_, {}, [&](const auto& seen) {
      return (seen.truth.translation - truth.translation).squaredNorm();
    });
    const Rigid3 estimated = nearest.rig_from_world * *result.world_from_rig;
    const Rigid3 expected = nearest.truth.inverse() * truth;
    errors_m_.push_back((m_per_unit_ * estimated.translation - expected.translation).norm());
    errors_deg_.push_back(estimated.rotation.angularDistance(expected.rotation) * 180.0 /
                          std::numbers::pi);
  }

  /// The atrium repeats itself to the pixel every 3.2 m, so that some views are of two places; what
  /// is found elsewhere counts against the median.
  void expect_good(double min_share) const {
    const double share = static_cast<double>(errors_m_.size()) / static_cast<double>(num_images_);
    ASSERT_FALSE(errors_m_.empty());
    const auto num_elsewhere = std::count_if(
        errors_m_.begin(), errors_m_.end(), [](double error_m) { return error_m > 0.5; });
    ::testing::Test::RecordProperty("share", std::to_string(share));
    ::testing::Test::RecordProperty("median_m",
                                    std::to_string(median(std::vector<double>(errors_m_))));
    ::testing::Test::RecordProperty("median_deg",
                                    std::to_string(median(std::vector<double>(errors_deg_))));
    ::testing::Test::RecordProperty("elsewhere", static_cast<int>(num_elsewhere));
    EXPECT_GE(share, min_share);
    EXPECT_LE(median(std::vector<double>(errors_m_)), 0.04);
    EXPECT_LE(median(std::vector<double>(errors_deg_)), 0.3);
  }

 private:
  struct SeenKeyframe {
    Rigid3 rig_from_world;  ///< As it is in the map.
    Rigid3 truth;           ///< True world from the camera.
  };

  std::vector<SeenKeyframe> keyframes_;
  double m_per_unit_ = 1.0;
  int num_images_ = 0;
  std::vector<double> errors_m_;
  std::vector<double> errors_deg_;
};

FrameImages input_of(const AtriumFrame& frame, const Image& image) {
  FrameImages input;
  input.timestamp_ns = frame.timestamp_ns;
  input.image0 = image.view();
  return input;
}

TEST(OtherLens, PerspectiveViewsInAMapOf360Degrees) {
  const auto folder = recorded_sequence("sim_atrium_360");
  if (!folder) GTEST_SKIP() << "WAYMARK_DATA has no sim_atrium_360";
  const Atrium atrium = read_atrium(*folder);
  ASSERT_GE(atrium.revisits.size(), 50u);
  Settings settings;
  settings.features.count = kNumFeaturesOf360;
  const auto map = map_frames(atrium.rig, settings, atrium.mapped);
  const Rig rig = perspective_rig();
  Localizer localizer(rig, Settings(), map);
  Rng rng(1, 0);
  Score score(*map, atrium);
  for (const AtriumFrame& frame : atrium.revisits) {
    const double yaw = rng.uniform(-std::numbers::pi, std::numbers::pi);
    const double roll = rng.uniform(-kMaxRollRad, kMaxRollRad);
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY()) *
                                  Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitZ()));
    const Image view = cut_view(frame.image,
                                *atrium.rig.cameras[0].camera,
                                *rig.cameras[0].camera,
                                turn.toRotationMatrix());
    const Rigid3& sphere = atrium.truth_at(frame.timestamp_ns).world_from_camera;
    score.add(localizer.locate(input_of(frame, view)), sphere * Rigid3(turn, {0.0, 0.0, 0.0}));
  }
  score.expect_good(0.8);
}

/// The other direction: the map is of what is ahead, the only part of the spheres that it shows.
TEST(OtherLens, WholeSpheresInAMapOfAPerspectiveCamera) {
  const auto folder = recorded_sequence("sim_atrium_360");
  if (!folder) GTEST_SKIP() << "WAYMARK_DATA has no sim_atrium_360";
  const Atrium atrium = read_atrium(*folder);
  const Rig rig = perspective_rig();
  std::vector<AtriumFrame> views;
  for (const AtriumFrame& frame : atrium.mapped) {
    views.push_back({frame.timestamp_ns,
                     cut_view(frame.image,
                              *atrium.rig.cameras[0].camera,
                              *rig.cameras[0].camera,
                              Eigen::Matrix3d::Identity())});
  }
  const auto map = map_frames(rig, Settings(), views);
  Localizer localizer(atrium.rig, Settings(), map);
  Score score(*map, atrium);
  for (const AtriumFrame& frame : atrium.revisits) {
    score.add(localizer.locate(input_of(frame, frame.image)),
              atrium.truth_at(frame.timestamp_ns).world_from_camera);
  }
  score.expect_good(0.45);
}

}  // namespace
}  // namespace waymark

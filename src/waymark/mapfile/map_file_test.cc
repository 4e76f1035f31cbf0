// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapfile/map_file.h"

#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <map>
#include <sstream>

#include "waymark/base/testing/errors.h"
#include "waymark/base/testing/temporary_folder.h"
#include "waymark/base/text.h"
#include "waymark/camera/model_camera.h"
#include "waymark/camera/perspective.h"
#include "waymark/map/parts.h"
#include "waymark/map/testing/random_map.h"
#include "waymark/mapfile/map_layout.h"

namespace waymark {
namespace {

using ::testing::HasSubstr;
using testing::input_error_of;
using ::testing::IsEmpty;
using testing::RandomMap;
using testing::TemporaryFolder;

StoredMap stored_map(std::uint64_t seed) {
  StoredMap stored;
  stored.map = RandomMap(seed).map().freeze();
  stored.settings = "features: {count: 800}\n";
  stored.images[stored.map->submaps()[0].root] =
      std::make_shared<const std::string>("\xFF\xD8\0jpeg", 7);
  return stored;
}

/// Of everything but the tables that follow from others.
void expect_same(const Keyframe& a, const Keyframe& b) {
  EXPECT_EQ(a.frame, b.frame);
  EXPECT_EQ(a.timestamp_ns, b.timestamp_ns);
  EXPECT_EQ(a.submap, b.submap);
  EXPECT_EQ(a.parent, b.parent);
  EXPECT_EQ(a.rig_from_world.matrix(), b.rig_from_world.matrix());
  EXPECT_EQ(a.applied_scale, b.applied_scale);
  EXPECT_EQ(a.landmarks, b.landmarks);
  ASSERT_EQ(a.rig().cameras.size(), b.rig().cameras.size());
  for (std::size_t i = 0; i < a.rig().cameras.size(); ++i) {
    EXPECT_TRUE(a.rig().cameras[i].description->is_same(*b.rig().cameras[i].description));
    EXPECT_EQ(a.rig().cameras[i].cam_from_rig.matrix(), b.rig().cameras[i].cam_from_rig.matrix());
    EXPECT_EQ(a.rig().cameras[i].camera->model(), b.rig().cameras[i].camera->model());
  }
}

void expect_same(const Features& a, const Features& b) {
  ASSERT_EQ(a.size(), b.size());
  EXPECT_EQ(a.num_primary, b.num_primary);
  EXPECT_EQ(a.num_edges, b.num_edges);
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Keypoint& p = a.keypoints[i];
    const Keypoint& q = b.keypoints[i];
    EXPECT_EQ(std::tie(p.x_px, p.y_px, p.angle_rad, p.response, p.level, p.camera),
              std::tie(q.x_px, q.y_px, q.angle_rad, q.response, q.level, q.camera));
  }
  EXPECT_EQ(a.descriptors, b.descriptors);
  EXPECT_EQ(a.bearings, b.bearings);
  EXPECT_EQ(a.level_pixel_from_bearing, b.level_pixel_from_bearing);
  EXPECT_EQ(a.size_rad, b.size_rad);
  EXPECT_EQ(a.partner, b.partner);
  EXPECT_EQ(a.range_m, b.range_m);
  EXPECT_EQ(a.inverse_range_sigma, b.inverse_range_sigma);
  std::vector<std::uint32_t> near_a, near_b;
  a.grid.visit_near(100.0, 80.0, 30.0, [&](std::uint32_t i) { near_a.push_back(i); });
  b.grid.visit_near(100.0, 80.0, 30.0, [&](std::uint32_t i) { near_b.push_back(i); });
  EXPECT_EQ(near_a, near_b);
}

TEST(MapFile, HoldsEverything) {
  const TemporaryFolder folder;
  const StoredMap saved = stored_map(1);
  save_map(folder / "a.wmap", saved);
  const StoredMap loaded = load_map(folder / "a.wmap");
  EXPECT_EQ(loaded.settings, saved.settings);
  ASSERT_EQ(loaded.images.size(), 1u);
  EXPECT_EQ(loaded.images.begin()->first, saved.images.begin()->first);
  EXPECT_EQ(*loaded.images.begin()->second, *saved.images.begin()->second);
  EXPECT_THAT(loaded.producer, HasSubstr("waymark "));
  EXPECT_THAT(find_map_faults(folder / "a.wmap"), IsEmpty());
  ASSERT_EQ(loaded.map->keyframes().size(), saved.map->keyframes().size());
  saved.map->keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    expect_same(keyframe, loaded.map->keyframes().at(id));
    expect_same(*keyframe.features, *loaded.map->keyframes().at(id).features);
  });
  ASSERT_EQ(loaded.map->landmarks().size(), saved.map->landmarks().size());
  saved.map->landmarks().for_each([&](LandmarkId id, const Landmark& a) {
    const Landmark& b = loaded.map->landmarks().at(id);
    EXPECT_EQ(std::tie(a.submap, a.position_in_world, a.reference, a.observations),
              std::tie(b.submap, b.position_in_world, b.reference, b.observations));
    EXPECT_EQ(std::tie(a.num_visible, a.num_found, a.appearance.descriptor, a.appearance.size_m),
              std::tie(b.num_visible, b.num_found, b.appearance.descriptor, b.appearance.size_m));
    EXPECT_EQ(a.appearance.direction, b.appearance.direction);
    EXPECT_EQ(a.appearance.across, b.appearance.across);
  });
  EXPECT_GT(saved.map->odometry().size(), 100u);
  ASSERT_EQ(loaded.map->odometry().size(), saved.map->odometry().size());
  saved.map->odometry().for_each([&](KeyframeId id, const OdometryNode& a) {
    const OdometryNode& b = loaded.map->odometry().at(id);
    EXPECT_EQ(std::tie(a.parent, a.depth, a.rig_from_parent.scale, a.rig_from_parent.translation),
              std::tie(b.parent, b.depth, b.rig_from_parent.scale, b.rig_from_parent.translation));
    EXPECT_EQ(a.rig_from_parent.rotation.coeffs(), b.rig_from_parent.rotation.coeffs());
  });
}

TEST(MapFile, SavingWhatWasLoadedGivesTheSameBytes) {
  const TemporaryFolder folder;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    save_map(folder / "a.wmap", stored_map(seed));
    save_map(folder / "b.wmap", load_map(folder / "a.wmap"));
    const std::string bytes = read_text_file(folder / "a.wmap", "a map");
    ASSERT_EQ(bytes, read_text_file(folder / "b.wmap", "a map")) << "seed " << seed;
    std::istringstream stream(bytes);
    EXPECT_EQ(read_map(stream, "stream").map->broken_invariants(), "");
  }
}

/// A map whose keyframes see markers that are known in it.
StoredMap map_with_markers() {
  StoredMap stored = stored_map(1);
  MapParts parts = take_apart(*stored.map);
  for (auto& [id, keyframe] : parts.keyframes) {
    if (id.value % 3 != 0) continue;
    auto observations = std::make_shared<MarkerObservations>(2);
    for (std::size_t i = 0; i < 2; ++i) {
      MarkerObservation& observation = (*observations)[i];
      observation.id = static_cast<int>(i) + 7;
      for (std::size_t corner = 0; corner < 4; ++corner) {
        observation.pixels[corner] = {10.0f * static_cast<float>(corner), 0.25f};
        observation.bearings[corner] = keyframe.features->bearings[corner];
        observation.pixel_from_bearing[corner] =
            keyframe.features->level_pixel_from_bearing[corner];
      }
    }
    keyframe.markers = observations;
  }
  const Rigid3 pose = Rigid3::exp((Vector6d() << 1, 2, 3, 0.1, 0.2, 0.3).finished());
  parts.markers.push_back({7, 0.16, parts.keyframes[3].id, 1.5, pose});
  parts.markers.push_back({8, 0.2, parts.erased_keyframes[0].id, 1.0, pose.inverse(), pose});
  stored.map = Map::restore(std::move(parts)).freeze();
  return stored;
}

TEST(MapFile, HoldsTheImu) {
  const TemporaryFolder folder;
  StoredMap saved = map_with_markers();
  InertialReport& imu = saved.imu.emplace();
  imu.imu_from_rig = Rigid3::exp((Vector6d() << 0.1, 0.2, 0.3, 0.4, 0.5, 0.6).finished());
  imu.is_used = true;
  imu.rotation_sigma_rad = 0.001;
  imu.lever_arm_sigma_m = 0.002;
  imu.time_shift_s = -0.01;
  imu.time_shift_sigma_s = 1e-4;
  imu.biases = {{0.01, 0.02, 0.03}, {0.1, 0.2, 0.3}};
  imu.gravity_in_world = {0.0, 0.0, -kStandardGravity};
  save_map(folder / "a.wmap", saved);
  const StoredMap loaded = load_map(folder / "a.wmap");
  ASSERT_TRUE(loaded.imu && loaded.imu->is_used);
  EXPECT_EQ(loaded.imu->biases.accelerometer, imu.biases.accelerometer);
  EXPECT_EQ(loaded.imu->gravity_in_world, imu.gravity_in_world);
  const ImuCalibration told = loaded.imu->calibration();
  EXPECT_EQ(told.imu_from_rig->matrix(), imu.imu_from_rig.matrix());
  EXPECT_EQ(told.time_shift_s, imu.time_shift_s);
  save_map(folder / "b.wmap", loaded);
  EXPECT_EQ(read_text_file(folder / "a.wmap", "a map"), read_text_file(folder / "b.wmap", "a map"));
  saved.imu->time_shift_s = 1e9;
  EXPECT_THROW(save_map(folder / "c.wmap", saved), OutputError);
}

TEST(MapFile, HoldsMarkers) {
  const TemporaryFolder folder;
  const StoredMap saved = map_with_markers();
  save_map(folder / "a.wmap", saved);
  const StoredMap loaded = load_map(folder / "a.wmap");
  ASSERT_EQ(loaded.map->markers().size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    const MapMarker& a = saved.map->markers()[i];
    const MapMarker& b = loaded.map->markers()[i];
    EXPECT_EQ(std::tie(a.id, a.side_m, a.reference, a.reference_scale),
              std::tie(b.id, b.side_m, b.reference, b.reference_scale));
    EXPECT_EQ(a.marker_from_reference.matrix(), b.marker_from_reference.matrix());
    EXPECT_EQ(a.surveyed_world_from_marker.has_value(), b.surveyed_world_from_marker.has_value());
    EXPECT_EQ(saved.map->world_from_marker(a).matrix(), loaded.map->world_from_marker(b).matrix());
  }
  std::size_t num_seen = 0;
  saved.map->keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    const auto& markers = loaded.map->keyframes().at(id).markers;
    ASSERT_EQ(keyframe.markers != nullptr, markers != nullptr);
    if (!markers) return;
    ++num_seen;
    ASSERT_EQ(markers->size(), 2u);
    EXPECT_EQ((*markers)[1].id, 8);
    EXPECT_EQ((*markers)[1].bearings, (*keyframe.markers)[1].bearings);
    EXPECT_EQ((*markers)[1].pixel_from_bearing, (*keyframe.markers)[1].pixel_from_bearing);
    EXPECT_EQ((*markers)[1].pixels, (*keyframe.markers)[1].pixels);
  });
  EXPECT_GT(num_seen, 3u);
  save_map(folder / "b.wmap", loaded);
  EXPECT_EQ(read_text_file(folder / "a.wmap", "a map"), read_text_file(folder / "b.wmap", "a map"));
}

/// Its ranges from stereo had no precision, and features of camera 1 showed landmarks.
TEST(MapFile, ReadsEarlierMaps) {
  const TemporaryFolder folder;
  StoredMap stored = stored_map(1);
  MapParts parts = take_apart(*stored.map);
  std::map<KeyframeId, std::vector<LandmarkId>> expected;
  for (auto& [id, keyframe] : parts.keyframes) {
    expected[id] = keyframe.landmarks;
    auto features = std::make_shared<Features>(*keyframe.features);
    features->inverse_range_sigma.assign(features->num_primary, 0.0f);
    for (std::size_t i = features->num_primary; i < features->size(); ++i) {
      keyframe.landmarks[i] = keyframe.landmarks[features->partner[i]];
    }
    keyframe.features = std::move(features);
  }
  stored.map = Map::restore(std::move(parts)).freeze();
  save_map(folder / "old.wmap", stored);
  const StoredMap loaded = load_map(folder / "old.wmap");
  EXPECT_EQ(loaded.map->broken_invariants(), "");
  int num_pairs = 0;
  loaded.map->keyframes().for_each([&](KeyframeId id, const Keyframe& keyframe) {
    EXPECT_EQ(keyframe.landmarks, expected.at(id));
    const Features& features = *keyframe.features;
    for (std::size_t i = 0; i < features.num_primary; ++i) {
      if (features.partner[i] == kNoFeature) continue;
      ++num_pairs;
      EXPECT_EQ(features.range_m[i] != 0.0f, features.inverse_range_sigma[i] > 0.0f);
    }
  });
  EXPECT_GT(num_pairs, 0);
}

TEST(MapFile, KeepsEmptyMaps) {
  const TemporaryFolder folder;
  StoredMap empty;
  empty.map = Map().freeze();
  save_map(folder / "empty.wmap", empty);
  EXPECT_TRUE(load_map(folder / "empty.wmap").map->keyframes().is_empty());
}

TEST(MapFile, KeepsCamerasOfRegisteredModels) {
  CameraRegistry registry = CameraRegistry::with_builtin_models();
  registry.add("mine", [](const CameraDescription& description) {
    const PerspectiveModel model(
        {description.intrinsics.at(0), description.intrinsics.at(0)}, {50.0, 50.0}, {});
    return std::make_shared<const ModelCamera<PerspectiveModel>>(
        model, description.width_px, description.height_px);
  });
  CameraChain chain;
  chain.cameras.push_back({{"mine", {123.0}, "none", {}, 100, 100, "test"}, Rigid3()});
  Map map;
  Keyframe keyframe;
  keyframe.submap = map.add_submap(false);
  auto features = std::make_shared<Features>();
  features->rig = std::make_shared<const Rig>(make_rig(chain, registry));
  keyframe.features = features;
  map.add_keyframe(keyframe);
  StoredMap stored;
  stored.map = map.freeze();
  const TemporaryFolder folder;
  save_map(folder / "mine.wmap", stored);
  const StoredMap loaded = load_map(folder / "mine.wmap", registry);
  EXPECT_EQ(loaded.map->keyframes().at(KeyframeId{0}).rig().cameras[0].description->intrinsics,
            std::vector<double>{123.0});
  // Without the model the map is kept as it is.
  const StoredMap kept = load_map(folder / "mine.wmap");
  const Camera& camera = *kept.map->keyframes().at(KeyframeId{0}).rig().cameras[0].camera;
  EXPECT_FALSE(camera.can_project());
  EXPECT_THAT(input_error_of([&] { camera.unproject({}, {}, {}); }),
              HasSubstr("mine.wmap: camera 0: camera_model is mine, expected one of"));
  EXPECT_THAT(find_map_faults(folder / "mine.wmap"), IsEmpty());
  save_map(folder / "kept.wmap", kept);
  EXPECT_EQ(read_text_file(folder / "kept.wmap", "a map"),
            read_text_file(folder / "mine.wmap", "a map"));
}

TEST(MapFile, RefusesCamerasWithoutDescription) {
  Map map;
  Keyframe keyframe;
  keyframe.submap = map.add_submap(false);
  auto rig = std::make_shared<Rig>();
  rig->cameras.push_back({nullptr, Rigid3()});
  auto features = std::make_shared<Features>();
  features->rig = rig;
  keyframe.features = features;
  map.add_keyframe(keyframe);
  StoredMap stored;
  stored.map = map.freeze();
  const TemporaryFolder folder;
  EXPECT_THAT(input_error_of([&] { save_map(folder / "a.wmap", stored); }),
              HasSubstr("expected rigs made by make_rig()"));
  EXPECT_FALSE(std::filesystem::exists(folder / "a.wmap"));
}

TEST(MapFile, RefusesToWriteWhatCouldNotBeRead) {
  const TemporaryFolder folder;
  const StoredMap good = stored_map(1);
  save_map(folder / "a.wmap", good);
  const std::string before = read_text_file(folder / "a.wmap", "a map");
  const auto error = [&](const std::function<void(MapParts&)>& harm) {
    MapParts parts = take_apart(*good.map);
    harm(parts);
    StoredMap harmed = good;
    harmed.map = Map::restore(std::move(parts)).freeze();
    try {
      save_map(folder / "a.wmap", harmed);
    } catch (const OutputError& refusal) {
      EXPECT_EQ(read_text_file(folder / "a.wmap", "a map"), before);
      return std::string(refusal.what());
    }
    return std::string("no error");
  };
  EXPECT_THAT(error([](MapParts& p) { p.landmarks[0].landmark.position_in_world.y() = INFINITY; }),
              HasSubstr("a.wmap: landmarks 0: position_in_world would hold inf, expected"));
  EXPECT_THAT(error([](MapParts& p) { p.landmarks[0].landmark.position_in_world.x() = -2e15; }),
              HasSubstr("position_in_world would hold -2e+15"));
  EXPECT_THAT(error([](MapParts& p) { p.landmarks[0].landmark.appearance.size_m = NAN; }),
              HasSubstr("size_m would hold nan"));
  EXPECT_THAT(
      error([](MapParts& p) { p.keyframes[0].keyframe.rig_from_world.translation.z() = INFINITY; }),
      HasSubstr("rig_from_world would hold inf"));
  EXPECT_THAT(
      error([](MapParts& p) { p.keyframes[0].keyframe.rig_from_world.rotation.coeffs()[0] = NAN; }),
      HasSubstr("rig_from_world would hold nan"));
  EXPECT_THAT(error([](MapParts& p) { p.keyframes[0].keyframe.applied_scale = 1e13; }),
              HasSubstr("applied_scale would hold 1e+13"));
  EXPECT_THAT(error([](MapParts& p) { p.end_landmark = LandmarkId{kMaxIds + 1}; }),
              HasSubstr("would have ids of landmarks up to 268435457, expected at most"));
  StoredMap with_image = good;
  with_image.images.begin()->second =
      std::make_shared<const std::string>("\xFF\xD8\xFF\xC0\0\x11\x08\xEA\x60\xEA\x60\3\0\0\0", 16);
  EXPECT_THROW(save_map(folder / "a.wmap", with_image), OutputError);
  EXPECT_EQ(read_text_file(folder / "a.wmap", "a map"), before);
}

TEST(MapFile, LeavesOutImagesOfErasedKeyframes) {
  StoredMap stored = stored_map(1);
  const std::size_t num_kept = stored.images.size();
  KeyframeId erased{0};
  while (stored.map->keyframes().contains(erased)) ++erased.value;
  stored.images[erased] = std::make_shared<const std::string>("gone");
  const TemporaryFolder folder;
  save_map(folder / "a.wmap", stored);
  EXPECT_EQ(load_map(folder / "a.wmap").images.size(), num_kept);
}

TEST(MapFile, SaysWhatItCannotOpen) {
  const TemporaryFolder folder;
  EXPECT_THAT(input_error_of([&] { load_map(folder / "none.wmap"); }),
              HasSubstr("none.wmap: missing, expected a map file"));
  EXPECT_THAT(input_error_of([&] { load_map(folder.path()); }), HasSubstr("is no regular file"));
}

}  // namespace
}  // namespace waymark

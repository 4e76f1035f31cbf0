// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/exchange/openvslam_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <memory>
#include <set>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/base/text.h"
#include "waymark/exchange/openvslam_records.h"
#include "waymark/mapping/appearance.h"

namespace waymark {
namespace {

/// How far from a rotation a quaternion may be.
constexpr double kOpenvslamRotationTolerance = 0.02;
/// Closer to a camera a landmark has no direction.
constexpr double kMinDistance = 1e-9;
/// Memory that the search grids of all keyframes may take, in pixels of all images together: as
/// many as 100 000 images of 2 megapixels have.
constexpr double kMaxPixels = 2e11;
constexpr std::size_t kMaxMapBytes = std::size_t{4} << 30;

/// How every data base of SQLite begins.
bool is_sqlite_file(const std::filesystem::path& path) {
  constexpr std::string_view kMagic("SQLite format 3\0", 16);
  std::string start(kMagic.size(), '\0');
  std::ifstream stream(path, std::ios::binary);
  stream.read(start.data(), static_cast<std::streamsize>(start.size()));
  return stream && start == kMagic && std::filesystem::is_regular_file(path);
}

class Importer {
 public:
  Importer(const OpenvslamRecords& records, const std::string& name)
      : records_(records), name_(name) {}

  ImportedMap import();

 private:
  struct Camera {
    Setup setup;
    std::shared_ptr<const Rig> rig;
    std::vector<double> undistorted_intrinsics;
  };
  struct Placed {
    KeyframeId id;
    std::vector<std::uint32_t> feature_of_keypoint;
  };

  void make_cameras();
  const Camera& camera_of(std::int64_t id, const OpenvslamKeyframe& keyframe) const;
  OpenvslamPyramid pyramid_of(std::int64_t id, const OpenvslamKeyframe& keyframe) const;
  std::string where(std::int64_t id) const { return fmt::format("{}: keyframes.{}", name_, id); }
  void add_keyframes();
  void add_keyframe(std::int64_t id, const OpenvslamKeyframe& keyframe);
  void collect_observations();
  void add_landmarks();
  void add_landmark(const OpenvslamLandmark& landmark, std::vector<Observation>& observations);
  bool is_apart_from_cameras(const Eigen::Vector3d& position,
                             const std::vector<Observation>& observations) const;
  void add_loop_edges();
  void note(std::size_t count, const char* what);

  const OpenvslamRecords& records_;
  const std::string& name_;
  Map map_;
  std::vector<std::string> notes_;
  std::map<std::string, Camera> cameras_;
  std::map<std::int64_t, Placed> placed_;
  std::map<std::int64_t, std::vector<Observation>> observations_;  // By landmark of the file.
};

ImportedMap Importer::import() {
  if (records_.keyframes.empty()) throw InputError(name_, "has no keyframes, expected a map");
  make_cameras();
  add_keyframes();
  collect_observations();
  add_landmarks();
  add_loop_edges();
  return {std::move(map_), std::move(notes_)};
}

void Importer::note(std::size_t count, const char* what) {
  if (count > 0) notes_.push_back(fmt::format("{}: {} {}", name_, count, what));
}

void Importer::make_cameras() {
  for (const auto& [name, camera] : records_.cameras) {
    const CameraChain chain = openvslam_camchain(camera);
    cameras_[name] = {openvslam_setup(camera),
                      std::make_shared<const Rig>(make_rig(chain)),
                      chain.cameras[0].description.intrinsics};
  }
}

const Importer::Camera& Importer::camera_of(std::int64_t id,
                                            const OpenvslamKeyframe& keyframe) const {
  const auto found = cameras_.find(keyframe.camera);
  if (found != cameras_.end()) return found->second;
  throw InputError(
      where(id),
      fmt::format("cam is {}, expected one of cameras", quote_for_message(keyframe.camera)));
}

OpenvslamPyramid Importer::pyramid_of(std::int64_t id, const OpenvslamKeyframe& keyframe) const {
  if (!keyframe.orb_params) return keyframe.pyramid;
  const auto found = records_.pyramids.find(*keyframe.orb_params);
  if (found != records_.pyramids.end()) return found->second;
  throw InputError(where(id),
                   fmt::format("orb_params is {}, expected one of orb_params",
                               quote_for_message(*keyframe.orb_params)));
}

/// In the order of their ids as far as parents come before their children.
void Importer::add_keyframes() {
  std::map<std::int64_t, std::vector<std::int64_t>> children;
  std::set<std::int64_t> ready;
  double num_pixels = 0.0;
  for (const auto& [id, keyframe] : records_.keyframes) {
    const waymark::Camera& camera = *camera_of(id, keyframe).rig->cameras[0].camera;
    num_pixels += static_cast<double>(camera.width_px()) * camera.height_px();
    if (keyframe.parent < 0) {
      ready.insert(id);
    } else if (records_.keyframes.contains(keyframe.parent)) {
      children[keyframe.parent].push_back(id);
    } else {
      throw InputError(where(id),
                       fmt::format("span_parent is {}, expected a keyframe", keyframe.parent));
    }
  }
  if (num_pixels > kMaxPixels) {
    throw InputError(name_,
                     fmt::format("has {:.3g} pixels in {} keyframes, expected at most {:.3g}",
                                 num_pixels,
                                 records_.keyframes.size(),
                                 kMaxPixels));
  }
  while (!ready.empty()) {
    const std::int64_t id = ready.extract(ready.begin()).value();
    add_keyframe(id, records_.keyframes.at(id));
    ready.insert(children[id].begin(), children[id].end());
  }
  for (const auto& [id, keyframe] : records_.keyframes) {
    if (placed_.contains(id)) continue;
    throw InputError(where(id), "span_parent leads round in a circle, expected a tree");
  }
}

void Importer::add_keyframe(std::int64_t id, const OpenvslamKeyframe& keyframe) {
  const double norm = keyframe.rotation_cw.norm();
  if (!(std::abs(norm - 1.0) <= kOpenvslamRotationTolerance)) {
    throw InputError(where(id),
                     fmt::format("rot_cw is a quaternion of length {:.4g}, expected 1", norm));
  }
  const Camera& camera = camera_of(id, keyframe);
  OpenvslamFeatures features = convert_openvslam_features(keyframe,
                                                          {pyramid_of(id, keyframe),
                                                           camera.setup,
                                                           camera.rig,
                                                           camera.undistorted_intrinsics,
                                                           where(id)});
  Keyframe added;
  added.frame = FrameId{static_cast<std::uint32_t>(placed_.size())};
  added.timestamp_ns = std::llround(keyframe.timestamp_s * 1e9);
  if (keyframe.parent >= 0) {
    added.parent = placed_.at(keyframe.parent).id;
    added.submap = map_.keyframes().at(added.parent).submap;
  } else {
    added.submap = map_.add_submap(camera.setup != Setup::kMono);
  }
  added.rig_from_world = {keyframe.rotation_cw.normalized(), keyframe.translation_cw};
  added.rig = camera.rig;
  added.features = std::move(features.features);
  placed_[id] = {map_.add_keyframe(std::move(added)), std::move(features.feature_of_keypoint)};
}

void Importer::collect_observations() {
  std::size_t num_keypoints = 0, num_dropped = 0, num_dangling = 0, num_again = 0;
  for (const auto& [id, keyframe] : records_.keyframes) {
    const Placed& placed = placed_.at(id);
    for (std::size_t i = 0; i < keyframe.landmarks.size(); ++i) {
      const std::uint32_t feature = placed.feature_of_keypoint[i];
      num_dropped += feature == kNoFeature;
      ++num_keypoints;
      const std::int64_t landmark = keyframe.landmarks[i];
      if (feature == kNoFeature || landmark < 0) continue;
      if (!records_.landmarks.contains(landmark)) {
        ++num_dangling;
        continue;
      }
      std::vector<Observation>& observations = observations_[landmark];
      if (!observations.empty() && observations.back().keyframe == placed.id) {
        ++num_again;
      } else {
        observations.push_back({placed.id, feature});
      }
    }
  }
  note(num_dropped, "key points that the camera cannot have seen are left out");
  note(num_dangling, "observations of landmarks that are not in the file are left out");
  note(num_again, "observations of landmarks that the keyframe sees already are left out");
  if (num_keypoints > 0 && 2 * num_dropped > num_keypoints) {
    throw InputError(name_,
                     fmt::format("{} of {} key points are outside the images, expected a camera "
                                 "that fits them",
                                 num_dropped,
                                 num_keypoints));
  }
}

bool Importer::is_apart_from_cameras(const Eigen::Vector3d& position,
                                     const std::vector<Observation>& observations) const {
  return std::all_of(observations.begin(), observations.end(), [&](const Observation& observation) {
    const Keyframe& keyframe = map_.keyframes().at(observation.keyframe);
    return (keyframe.rig_from_world.origin_in_source() - position).norm() > kMinDistance;
  });
}

void Importer::add_landmarks() {
  std::size_t num_unseen = 0, num_at_camera = 0, num_elsewhere = 0;
  for (const auto& [id, landmark] : records_.landmarks) {
    const auto found = observations_.find(id);
    if (found == observations_.end()) {
      ++num_unseen;
      continue;
    }
    std::vector<Observation>& observations = found->second;
    std::sort(observations.begin(), observations.end());
    const auto submap_of = [&](const Observation& observation) {
      return map_.keyframes().at(observation.keyframe).submap;
    };
    const SubmapId submap = submap_of(observations.front());
    num_elsewhere += std::erase_if(observations, [&](const Observation& observation) {
      return submap_of(observation) != submap;
    });
    if (!is_apart_from_cameras(landmark.position_in_world, observations)) {
      ++num_at_camera;
      continue;
    }
    add_landmark(landmark, observations);
  }
  note(num_unseen, "landmarks that no keyframe sees are left out");
  note(num_at_camera, "landmarks inside a camera that sees them are left out");
  note(num_elsewhere, "observations across sub-maps are left out");
}

void Importer::add_landmark(const OpenvslamLandmark& landmark,
                            std::vector<Observation>& observations) {
  KeyframeId reference = observations.front().keyframe;
  const auto placed = placed_.find(landmark.reference);
  for (const Observation& observation : observations) {
    if (placed != placed_.end() && observation.keyframe == placed->second.id) {
      reference = observation.keyframe;
    }
  }
  const SubmapId submap = map_.keyframes().at(reference).submap;
  const LandmarkId id = map_.add_landmark(submap, landmark.position_in_world, reference);
  for (const Observation& observation : observations) {
    map_.observe(observation.keyframe, observation.feature, id);
  }
  const std::int64_t num_visible = std::max(landmark.num_visible, landmark.num_found);
  map_.count_sightings(
      id, static_cast<std::uint32_t>(num_visible), static_cast<std::uint32_t>(landmark.num_found));
  map_.set_appearance(id, describe_landmark(map_, id));
}

/// As they lie to each other now, which is after the loop was closed.
void Importer::add_loop_edges() {
  std::set<std::pair<KeyframeId, KeyframeId>> added;
  std::size_t num_dangling = 0;
  for (const auto& [id, keyframe] : records_.keyframes) {
    for (const std::int64_t other : keyframe.loop_edges) {
      const auto found = placed_.find(other);
      const KeyframeId from = placed_.at(id).id;
      const KeyframeId to = found == placed_.end() ? from : found->second.id;
      const Keyframe& a = map_.keyframes().at(from);
      const Keyframe& b = map_.keyframes().at(to);
      if (from == to || a.submap != b.submap) {
        ++num_dangling;
      } else if (added.insert(std::minmax(from, to)).second) {
        const Rigid3 to_from_from = b.rig_from_world * a.rig_from_world.inverse();
        map_.add_loop_edge({from, to, Sim3(to_from_from)});
      }
    }
  }
  note(num_dangling, "loop edges that lead nowhere are left out");
}

}  // namespace

ImportedMap import_openvslam_map(std::string_view bytes, const std::string& name) {
  const OpenvslamRecords records = read_openvslam_records(bytes, name);
  return Importer(records, name).import();
}

ImportedMap import_openvslam_file(const std::filesystem::path& path,
                                  const std::optional<ConfigSource>& settings) {
  if (!is_sqlite_file(path)) {
    const std::string bytes = read_text_file(path, "a map (.msg or .db)", kMaxMapBytes);
    return import_openvslam_map(bytes, path.string());
  }
  const OpenvslamPyramid pyramid =
      settings ? read_openvslam_pyramid(*settings) : OpenvslamPyramid();
  const OpenvslamRecords records = read_openvslam_database(path, pyramid);
  const std::string name = path.string();
  ImportedMap imported = Importer(records, name).import();
  imported.notes.push_back(
      fmt::format("{}: the image pyramid, which it does not store, is {} levels of {:g}{}",
                  name,
                  pyramid.num_levels,
                  pyramid.scale_factor,
                  settings ? "" : "; --settings FILE may say otherwise"));
  return imported;
}

}  // namespace waymark

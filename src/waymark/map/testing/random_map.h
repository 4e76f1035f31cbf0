// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "waymark/base/rng.h"
#include "waymark/camera/camchain.h"
#include "waymark/features/pyramid.h"
#include "waymark/map/map.h"

namespace waymark::testing {

/// A map made by random edits of every kind: sound, but of nothing that could be seen.
class RandomMap {
 public:
  explicit RandomMap(std::uint64_t seed, int num_steps = 600, std::uint32_t num_primary = 30)
      : num_primary_(num_primary), rng_(seed, 0) {
    rigs_ = {
        make_rig_of(1, "pinhole"), make_rig_of(2, "pinhole"), make_rig_of(1, "equirectangular")};
    start_submap();
    start_submap();
    for (int step = 0; step < num_steps; ++step) edit();
    for (int i = 0; i < 5; ++i) add_loop_edge();
    join();
    start_submap();
    for (int step = 0; step < num_steps / 2; ++step) edit();
    note_odometry();
    erase_and_merge();
    describe_landmarks();
  }

  Map& map() { return map_; }

  /// More edits of every kind.
  void go_on(int num_steps) {
    for (int step = 0; step < num_steps; ++step) edit();
    note_odometry();
    erase_and_merge();
    describe_landmarks();
  }

 private:
  static std::shared_ptr<const Rig> make_rig_of(int num_cameras, const std::string& model) {
    CameraChain chain;
    for (int i = 0; i < num_cameras; ++i) {
      CameraDescription camera;
      camera.camera_model = model;
      if (model == "pinhole") camera.intrinsics = {300.0, 301.0, 160.0, 80.0};
      if (i == 1) camera.distortion_model = "radtan";
      if (i == 1) camera.distortion_coeffs = {-0.1, 0.01, 0.0, 1e-4};
      camera.width_px = 320;
      camera.height_px = 160;
      camera.where = "test";
      chain.cameras.push_back({camera, Rigid3({1.0, 0.0, 0.0, 0.0}, {-0.1 * i, 0.0, 0.0})});
    }
    return std::make_shared<const Rig>(make_rig(chain));
  }

  float real(double low, double high) { return static_cast<float>(rng_.uniform(low, high)); }

  Rigid3 random_pose() {
    const Eigen::Vector4d q(rng_.normal(), rng_.normal(), rng_.normal(), rng_.normal());
    return {Eigen::Quaterniond(q.normalized()), {rng_.normal(), rng_.normal(), -0.0}};
  }

  Descriptor random_descriptor() { return {rng_.next(), rng_.next(), rng_.next(), rng_.next()}; }

  void append_feature(Features& features, std::uint8_t camera) {
    features.keypoints.push_back({real(0, 319),
                                  real(0, 159),
                                  real(-3, 3),
                                  real(0, 90),
                                  static_cast<std::uint8_t>(rng_.below(Pyramid::kNumLevels)),
                                  camera});
    features.bearings.push_back(
        Eigen::Vector3f(real(-1, 1), real(-1, 1), real(0.1, 1)).normalized());
    Matrix23f slope;
    for (int i = 0; i < 6; ++i) slope(i) = real(-400, 400);
    features.level_pixel_from_bearing.push_back(slope);
    features.size_rad.push_back(real(1e-3, 1e-2));
    features.partner.push_back(kNoFeature);
  }

  std::shared_ptr<const Features> random_features(std::shared_ptr<const Rig> rig) {
    auto features = std::make_shared<Features>();
    features->rig = rig;
    features->num_primary = num_primary_;
    features->num_edges = num_primary_ / 5;
    for (std::uint32_t i = 0; i < num_primary_; ++i) {
      append_feature(*features, 0);
      features->descriptors.push_back(random_descriptor());
      features->range_m.push_back(rng_.below(2) ? real(-9, 9) : 0.0f);
      features->inverse_range_sigma.push_back(features->range_m.back() != 0.0f ? 0.01f : 0.0f);
    }
    for (std::uint32_t i = 0; rig->cameras.size() > 1 && i < num_primary_; i += 3) {
      append_feature(*features, 1);
      features->partner[i] = static_cast<std::uint32_t>(features->size() - 1);
      features->partner.back() = i;
    }
    features->grid = FeatureGrid(320, 160, 0.0, num_primary_, [&](std::size_t i) {
      return std::pair(features->keypoints[i].x_px, features->keypoints[i].y_px);
    });
    return features;
  }

  KeyframeId add_keyframe(SubmapId submap, KeyframeId parent) {
    Keyframe keyframe;
    keyframe.frame = FrameId{3 * map_.keyframes().end_id().value};
    keyframe.timestamp_ns = static_cast<std::int64_t>(rng_.next() >> 1) - (std::int64_t{1} << 62);
    keyframe.submap = submap;
    keyframe.parent = parent;
    keyframe.rig_from_world = random_pose();
    keyframe.features =
        random_features(rigs_[rng_.below(static_cast<std::uint32_t>(rigs_.size()))]);
    return map_.add_keyframe(std::move(keyframe));
  }

  void start_submap() { add_keyframe(map_.add_submap(false), {}); }

  KeyframeId pick_keyframe() {
    std::vector<KeyframeId> ids;
    map_.keyframes().for_each([&](KeyframeId id, const Keyframe&) { ids.push_back(id); });
    return ids[rng_.below(static_cast<std::uint32_t>(ids.size()))];
  }

  /// A landmark of a sub-map, or none.
  LandmarkId pick_landmark(SubmapId submap) {
    std::vector<LandmarkId> ids;
    map_.landmarks().for_each([&](LandmarkId id, const Landmark& landmark) {
      if (landmark.submap == submap) ids.push_back(id);
    });
    if (ids.empty()) return {};
    return ids[rng_.below(static_cast<std::uint32_t>(ids.size()))];
  }

  void edit() {
    const KeyframeId id = pick_keyframe();
    const Keyframe& keyframe = map_.keyframes().at(id);
    const SubmapId submap = keyframe.submap;
    const std::uint32_t feature = rng_.below(num_primary_);
    const bool is_free = !keyframe.landmarks[feature].is_valid();
    switch (rng_.below(8)) {
      case 0:
        add_keyframe(submap, id);
        break;
      case 1:
        map_.rescale_keyframe(id, rng_.uniform(0.9, 1.2));
        map_.move_keyframe(id, random_pose());
        break;
      case 2:
        if (!is_free) forget(id, feature);
        break;
      case 3:
        if (is_free) {
          const Eigen::Vector3d position(rng_.normal(), -0.0, rng_.normal());
          map_.observe(id, feature, map_.add_landmark(submap, position, id));
        }
        break;
      default:
        observe_known(id, feature);
    }
  }

  void observe_known(KeyframeId id, std::uint32_t feature) {
    const Keyframe& keyframe = map_.keyframes().at(id);
    const LandmarkId landmark = pick_landmark(keyframe.submap);
    if (!landmark.is_valid() || keyframe.landmarks[feature].is_valid()) return;
    map_.observe(id, feature, landmark);
    map_.count_visibility(landmark, 2, 1);
  }

  void forget(KeyframeId id, std::uint32_t feature) {
    const LandmarkId landmark = map_.keyframes().at(id).landmarks[feature];
    map_.forget(id, feature);
    if (map_.landmarks().at(landmark).observations.empty()) map_.erase_landmark(landmark);
  }

  void add_loop_edge() {
    const KeyframeId from = pick_keyframe();
    const KeyframeId to = pick_keyframe();
    if (from == to || map_.keyframes().at(from).submap != map_.keyframes().at(to).submap) return;
    const Rigid3 rigid = random_pose();
    map_.add_loop_edge({from, to, {rigid.rotation, rigid.translation, rng_.uniform(0.5, 2.0)}});
  }

  /// Of the keyframes that are new.
  void note_odometry() {
    for (KeyframeId id = map_.odometry().end_id(); id < map_.keyframes().end_id(); ++id.value) {
      const Keyframe* keyframe = map_.keyframes().find(id);
      if (!keyframe) continue;
      const double scale = 1.0 + 0.01 * (id.value % 50);
      const Sim3 rig_from_parent{
          keyframe->rig_from_world.rotation, {1.0, -0.0, 0.1 * id.value}, scale};
      map_.note_odometry(id, {keyframe->parent, rig_from_parent, 2.0 * scale});
    }
  }

  void join() {
    for (int attempt = 0; attempt < 100; ++attempt) {
      const KeyframeId child = pick_keyframe();
      const KeyframeId parent = pick_keyframe();
      if (map_.keyframes().at(child).submap <= map_.keyframes().at(parent).submap) continue;
      map_.join_submaps(child, parent);
      return;
    }
  }

  void erase_and_merge() {
    for (int i = 0; i < 12; ++i) {
      const KeyframeId id = pick_keyframe();
      const Keyframe& keyframe = map_.keyframes().at(id);
      const SubmapId submap = keyframe.submap;
      if (keyframe.parent.is_valid() && !map_.has_loop_edge(id)) map_.erase_keyframe(id);
      const LandmarkId survivor = pick_landmark(submap);
      const LandmarkId absorbed = pick_landmark(submap);
      if (survivor.is_valid() && survivor != absorbed) map_.merge_landmarks(survivor, absorbed);
      const LandmarkId erased = pick_landmark(submap);
      if (erased.is_valid() && i % 3 == 0) map_.erase_landmark(erased);
    }
  }

  void describe_landmarks() {
    std::vector<LandmarkId> ids;
    map_.landmarks().for_each([&](LandmarkId id, const Landmark&) { ids.push_back(id); });
    for (const LandmarkId id : ids) {
      const Eigen::Vector3d direction(rng_.normal(), rng_.normal(), rng_.normal());
      const bool is_edge = id.value % 2 != 0;
      map_.set_appearance(
          id,
          {random_descriptor(),
           direction.normalized(),
           rng_.uniform(1e-3, 1.0),
           is_edge ? Eigen::Vector3d(direction.unitOrthogonal()) : Eigen::Vector3d::Zero()});
    }
  }

  const std::uint32_t num_primary_;
  Map map_;
  Rng rng_;
  std::vector<std::shared_ptr<const Rig>> rigs_;
};

}  // namespace waymark::testing

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "waymark/base/rng.h"
#include "waymark/camera/rig.h"
#include "waymark/exchange/openvslam_map.h"

namespace waymark::testing {

using Document = nlohmann::json;

/// What a small map (.msg) of stella_vslam shows: points 4 to 8 m ahead of keyframes that move to
/// the right, each with all points it sees and one key point more that shows none.
struct SmallMap {
  std::vector<Eigen::Vector3d> points;
  std::vector<Rigid3> cam_from_world;
  Document document;

  std::string bytes() const { return packed(document); }
  Document& keyframe(int id) { return document["keyframes"][std::to_string(id)]; }

  static std::string packed(const Document& document) {
    const std::vector<std::uint8_t> bytes = Document::to_msgpack(document);
    return {bytes.begin(), bytes.end()};
  }
};

inline Document perspective_document() {
  return {{"model_type", "Perspective"},
          {"setup_type", "Monocular"},
          {"color_order", "Gray"},
          {"cols", 640},
          {"rows", 480},
          {"fps", 30.0},
          {"focal_x_baseline", 0.0},
          {"fx", 400.0},
          {"fy", 405.0},
          {"cx", 318.0},
          {"cy", 241.0},
          {"k1", -0.2},
          {"k2", 0.03},
          {"p1", 1e-4},
          {"p2", -2e-4},
          {"k3", 0.0}};
}

inline Rigid3 small_map_pose(int id) {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.03 * id, Eigen::Vector3d::UnitY()));
  return Rigid3(turn, {0.2 * id, 0.0, 0.05 * id}).inverse();
}

/// Key points lie where a camera without distortion shows the points, as is in the files; for an
/// equirectangular camera where the camera itself shows them.
inline Eigen::Vector2d undistorted_pixel(const Document& camera, const Eigen::Vector3d& point) {
  if (camera["model_type"] != "Equirectangular") {
    return {camera["fx"].get<double>() * point.x() / point.z() + camera["cx"].get<double>(),
            camera["fy"].get<double>() * point.y() / point.z() + camera["cy"].get<double>()};
  }
  const Eigen::Vector3d bearing = point.normalized();
  const double width = camera["cols"], height = camera["rows"];
  return {(std::atan2(bearing.x(), bearing.z()) / (2.0 * M_PI) + 0.5) * width - 0.5,
          (std::asin(bearing.y()) / M_PI + 0.5) * height - 0.5};
}

inline Document keypoint_document(const Eigen::Vector2d& pixel, int level) {
  return {{"pt", {pixel.x(), pixel.y()}}, {"ang", 270.0}, {"oct", level}};
}

/// The keyframe of an id. Its parent is the one before; keyframes 0 and 2 close a loop.
inline Document keyframe_document(const SmallMap& map, const Document& camera, int id, Rng& rng) {
  const Rigid3& pose = map.cam_from_world[static_cast<std::size_t>(id)];
  Document keypoints = Document::array(), descriptors = Document::array();
  Document landmarks = Document::array();
  const auto add = [&](const Eigen::Vector3d& point, int landmark) {
    keypoints.push_back(keypoint_document(undistorted_pixel(camera, pose * point), landmark % 8));
    Document words = Document::array();
    for (int word = 0; word < 8; ++word) words.push_back(rng.next() & 0xffffffffu);
    descriptors.push_back(words);
    landmarks.push_back(landmark);
  };
  for (std::size_t i = 0; i < map.points.size(); ++i) add(map.points[i], static_cast<int>(i));
  add({0.0, 0.0, 6.0}, 0);
  landmarks.back() = -1;
  const auto& q = pose.rotation;
  const auto& t = pose.translation;
  return {{"ts", 100.5 + id},
          {"cam", "cam"},
          {"orb_params", "orb"},
          {"rot_cw", {q.x(), q.y(), q.z(), q.w()}},
          {"trans_cw", {t.x(), t.y(), t.z()}},
          {"n_keypts", keypoints.size()},
          {"undist_keypts", keypoints},
          {"x_rights", Document::array()},
          {"depths", Document::array()},
          {"descs", descriptors},
          {"lm_ids", landmarks},
          {"span_parent", id == 0 ? Document(4294967295u) : Document(id - 1)},
          {"span_children", Document::array()},
          {"loop_edges", id == 1 ? Document::array() : Document::array({2 - id})}};
}

inline SmallMap make_small_map(const Document& camera = perspective_document()) {
  SmallMap map;
  Rng rng(3, 0);
  for (int i = 0; i < 30; ++i) {
    map.points.emplace_back(
        4.0 * rng.uniform() - 2.0, 2.0 * rng.uniform() - 1.0, 4.0 + 4.0 * rng.uniform());
  }
  for (int id = 0; id < 3; ++id) map.cam_from_world.push_back(small_map_pose(id));
  Document& document = map.document;
  document["cameras"]["cam"] = camera;
  document["orb_params"]["orb"] = {{"name", "orb"},
                                   {"scale_factor", 1.2f},
                                   {"num_levels", 8},
                                   {"ini_fast_threshold", 20},
                                   {"min_fast_threshold", 7}};
  for (int id = 0; id < 3; ++id) {
    document["keyframes"][std::to_string(id)] = keyframe_document(map, camera, id, rng);
  }
  for (std::size_t i = 0; i < map.points.size(); ++i) {
    const Eigen::Vector3d& point = map.points[i];
    document["landmarks"][std::to_string(i)] = {{"1st_keyfrm", 0},
                                                {"ref_keyfrm", 1},
                                                {"pos_w", {point.x(), point.y(), point.z()}},
                                                {"n_vis", 9},
                                                {"n_fnd", 5}};
  }
  document["keyframe_next_id"] = 3;
  document["landmark_next_id"] = 30;
  return map;
}

/// As a map, seen by a camera that is plain, distorted or fisheye.
inline Map small_map(const std::string& kind) {
  Document camera = perspective_document();
  if (kind == "plain") {
    for (const char* key : {"k1", "k2", "p1", "p2"}) camera[key] = 0.0;
  }
  if (kind == "fisheye") camera["model_type"] = "Fisheye";
  return import_openvslam_map(make_small_map(camera).bytes(), "map.msg").map;
}

}  // namespace waymark::testing

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <set>

#include "waymark/base/text.h"
#include "waymark/exchange/exports.h"

namespace waymark {

std::string format_colmap_rig(const ExportScene& scene, ColmapIds numbers) {
  std::set<std::pair<std::size_t, std::size_t>> used;  // Camera of the rig, camera of the scene.
  for (const ExportView& view : scene.views) used.emplace(view.rig_camera, view.camera);
  if (used.size() != 2 || used.rbegin()->first != 1) return "";
  nlohmann::ordered_json cameras = nlohmann::ordered_json::array();
  for (const auto& [rig_camera, camera] : used) {
    const Eigen::Quaterniond& q = scene.cam_from_rig[camera].rotation;
    const Eigen::Vector3d& t = scene.cam_from_rig[camera].translation;
    cameras.push_back({{"camera_id", numbers.first_camera + camera},
                       {"image_prefix", fmt::format("cam{}/", rig_camera)},
                       {"rel_qvec", {q.w(), q.x(), q.y(), q.z()}},
                       {"rel_tvec", {t.x(), t.y(), t.z()}}});
  }
  const auto reference = numbers.first_camera + used.begin()->second;
  const nlohmann::ordered_json rig = {{"ref_camera_id", reference}, {"cameras", cameras}};
  return nlohmann::ordered_json::array({rig}).dump(1) + "\n";
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "atlas.h"
#include "texts.h"

namespace waymark::python {
namespace {

Sim3 transform_of(const py::handle& numbers) {
  const auto n = numbers.cast<std::array<double, 8>>();
  return {Eigen::Quaterniond(n[3], n[0], n[1], n[2]), {n[4], n[5], n[6]}, n[7]};
}

py::dict describe(const AtlasTile& tile) {
  py::dict described;
  described["origin"] = tile.origin;
  described["checksum"] = tile.checksum;
  described["places"] = tile.places;
  described["recording"] = tile.recording;
  described["submap"] = tile.submap;
  described["num_keyframes"] = tile.num_keyframes;
  described["num_landmarks"] = tile.num_landmarks;
  described["is_metric"] = tile.is_metric;
  described["pixel_angle_rad"] = tile.pixel_angle_rad;
  described["centre"] = std::array{tile.centre.x(), tile.centre.y(), tile.centre.z()};
  described["radius"] = tile.radius;
  described["anchor"] = numbers_of(tile.atlas_from_tile);
  described["frame"] = tile.frame;
  return described;
}

AtlasTile read_tile(const py::handle& described) {
  AtlasTile tile;
  tile.origin = described["origin"].cast<std::string>();
  tile.checksum = described["checksum"].cast<std::string>();
  tile.places = described["places"].cast<std::string>();
  tile.recording = described["recording"].cast<std::uint32_t>();
  tile.submap = described["submap"].cast<std::uint32_t>();
  tile.num_keyframes = described["num_keyframes"].cast<std::uint32_t>();
  tile.num_landmarks = described["num_landmarks"].cast<std::uint32_t>();
  tile.is_metric = described["is_metric"].cast<bool>();
  tile.pixel_angle_rad = described["pixel_angle_rad"].cast<double>();
  const auto centre = described["centre"].cast<std::array<double, 3>>();
  tile.centre = {centre[0], centre[1], centre[2]};
  tile.radius = described["radius"].cast<double>();
  tile.atlas_from_tile = transform_of(described["anchor"]);
  tile.frame = described["frame"].cast<std::uint32_t>();
  return tile;
}

AtlasLink read_link(const py::handle& described) {
  AtlasLink link;
  link.a = described["a"].cast<std::uint32_t>();
  link.b = described["b"].cast<std::uint32_t>();
  link.is_border = described["is_border"].cast<bool>();
  link.num_shared = described["num_shared"].cast<std::uint32_t>();
  link.b_from_a = transform_of(described["b_from_a"]);
  return link;
}

}  // namespace

std::array<double, 8> numbers_of(const Sim3& transform) {
  const Eigen::Vector4d& q = transform.rotation.coeffs();
  const Eigen::Vector3d& t = transform.translation;
  return {q.x(), q.y(), q.z(), q.w(), t.x(), t.y(), t.z(), transform.scale};
}

py::dict describe_link(const AtlasLink& link) {
  py::dict described;
  described["a"] = link.a;
  described["b"] = link.b;
  described["is_border"] = link.is_border;
  described["num_shared"] = link.num_shared;
  described["b_from_a"] = numbers_of(link.b_from_a);
  return described;
}

py::list describe_landmarks(const SharedLandmarks& landmarks) {
  py::list flat;
  for (const auto& [a, b] : landmarks) {
    flat.append(a.value);
    flat.append(b.value);
  }
  return flat;
}

SharedLandmarks read_landmarks(const py::handle& flat) {
  const auto ids = flat.cast<std::vector<std::uint32_t>>();
  SharedLandmarks landmarks;
  for (std::size_t i = 0; i + 1 < ids.size(); i += 2) {
    landmarks.push_back({LandmarkId{ids[i]}, LandmarkId{ids[i + 1]}});
  }
  return landmarks;
}

py::dict describe_contents(const AtlasContents& contents) {
  py::list recordings, tiles, links;
  for (const AtlasRecording& one : contents.recordings) {
    py::dict recording;
    recording["checksum"] = one.checksum;
    recording["name"] = text_of(one.name);
    recording["since"] = one.since;
    recordings.append(recording);
  }
  for (const AtlasTile& tile : contents.tiles) tiles.append(describe(tile));
  for (const AtlasLink& link : contents.links) links.append(describe_link(link));
  py::dict described;
  described["recordings"] = recordings;
  described["tiles"] = tiles;
  described["links"] = links;
  return described;
}

AtlasContents read_contents(const py::dict& described) {
  AtlasContents contents;
  for (const py::handle one : described["recordings"]) {
    contents.recordings.push_back({one["checksum"].cast<std::string>(),
                                   text_argument("name", one["name"]),
                                   one["since"].cast<std::uint32_t>()});
  }
  for (const py::handle one : described["tiles"]) contents.tiles.push_back(read_tile(one));
  for (const py::handle one : described["links"]) contents.links.push_back(read_link(one));
  for (const AtlasTile& tile : contents.tiles) {
    if (tile.recording >= contents.recordings.size()) throw py::value_error("recording: not there");
  }
  for (const AtlasLink& link : contents.links) {
    if (std::max(link.a, link.b) >= contents.tiles.size()) throw py::value_error("link: no tile");
  }
  return contents;
}

}  // namespace waymark::python

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <utility>

#include "waymark/features/feature_geometry.h"
#include "waymark/features/pyramid.h"
#include "waymark/mapfile/map_layout.h"
#include "waymark/mapfile/map_reader.h"

namespace waymark {
namespace {

constexpr double kMaxUnitError = 1e-3;  // Of bearings, which are single floats.
constexpr double kMaxOutsidePx = 2.0;   // Noise and rounding may leave the image a little.

template <class T>
FeatureArray<T> array_of(MapRecord& record,
                         std::string_view key,
                         std::optional<std::size_t> count,
                         const NumberRange& range = {}) {
  return record.array<T, FeatureArray<T>>(key, count, range);
}

FeatureArray<Keypoint> read_keypoints(MapRecord& record) {
  const auto pixels = record.array<Eigen::Vector2f>("pixel", std::nullopt);
  const std::size_t count = pixels.size();
  const auto angles = record.array<float>("angle_rad", count, kAngleRange);
  const auto responses = record.array<float>("response", count);
  const auto levels = record.array<std::uint8_t>("level", count);
  const auto cameras = record.array<std::uint8_t>("camera", count);
  FeatureArray<Keypoint> keypoints(count);
  for (std::size_t i = 0; i < count; ++i) {
    keypoints[i] = {pixels[i].x(), pixels[i].y(), angles[i], responses[i], levels[i], cameras[i]};
  }
  return keypoints;
}

void check_keypoint(const MapRecord& record,
                    const Rig& rig,
                    const Features& features,
                    std::size_t i) {
  const Keypoint& keypoint = features.keypoints[i];
  const bool is_primary = i < features.num_primary;
  if (keypoint.camera != (is_primary ? 0 : 1) || keypoint.camera >= rig.cameras.size()) {
    record.fail(fmt::format("camera of feature {} is {}, expected {} of {} cameras",
                            i,
                            keypoint.camera,
                            is_primary ? 0 : 1,
                            rig.cameras.size()));
  }
  if (keypoint.level >= Pyramid::kNumLevels) {
    record.fail(fmt::format("level of feature {} is {}, expected less than {}",
                            i,
                            keypoint.level,
                            Pyramid::kNumLevels));
  }
  const Camera& camera = *rig.cameras[keypoint.camera].camera;
  const double least = -0.5 - kMaxOutsidePx;
  if (!(keypoint.x_px >= least && keypoint.x_px <= camera.width_px() - 1 - least) ||
      !(keypoint.y_px >= least && keypoint.y_px <= camera.height_px() - 1 - least)) {
    record.fail(fmt::format("pixel of feature {} is ({}, {}), expected one within {} x {} px",
                            i,
                            keypoint.x_px,
                            keypoint.y_px,
                            camera.width_px(),
                            camera.height_px()));
  }
  const double length = features.bearings[i].cast<double>().norm();
  if (!(std::abs(length - 1.0) <= kMaxUnitError)) {
    record.fail(fmt::format("bearing of feature {} has the length {}, expected 1", i, length));
  }
}

void check_range(const MapRecord& record, const Features& features, std::size_t i) {
  if (features.range_m[i] != 0.0f || features.inverse_range_sigma[i] == 0.0f) return;
  record.fail(fmt::format("inverse_range_sigma of feature {} is {} without a range, expected 0",
                          i,
                          features.inverse_range_sigma[i]));
}

/// Whether ranges from stereo come without their precision, as in earlier maps.
bool lacks_precision(const Features& features) {
  for (std::size_t i = 0; i < features.num_primary; ++i) {
    const bool has_range = features.partner[i] != kNoFeature && features.range_m[i] != 0.0f;
    if (has_range && features.inverse_range_sigma[i] == 0.0f) return true;
  }
  return false;
}

void check_partner(const MapRecord& record, const Features& features, std::size_t i) {
  const bool is_primary = i < features.num_primary;
  const std::uint32_t partner = features.partner[i];
  if (is_primary && partner == kNoFeature) return;
  const bool is_there = partner < features.size();
  const bool is_mutual = is_there && features.partner[partner] == i;
  if (!is_mutual || (partner < features.num_primary) == is_primary) {
    record.fail(fmt::format(
        "partner of feature {} is {}, expected one of the other camera that names it, too",
        i,
        partner));
  }
}

}  // namespace

std::shared_ptr<const Features> read_features(MapRecord& record, std::shared_ptr<const Rig> rig) {
  auto features = std::make_shared<Features>();
  features->rig = std::move(rig);
  features->keypoints = read_keypoints(record);
  const std::size_t count = features->size();
  features->descriptors = array_of<Descriptor>(record, "descriptor", std::nullopt);
  const std::size_t num_primary = features->descriptors.size();
  features->num_primary = num_primary;
  if (num_primary > count) {
    record.fail(fmt::format(
        "has {} descriptors, expected at most {}, one per feature", num_primary, count));
  }
  if (record.has("num_edges")) features->num_edges = record.whole("num_edges", num_primary);
  features->bearings = array_of<Eigen::Vector3f>(record, "bearing", count);
  features->level_pixel_from_bearing =
      array_of<Matrix23f>(record, "level_pixel_from_bearing", count, kSlopeRange);
  features->size_rad = array_of<float>(record, "size_rad", count, kFeatureSizeRange);
  features->partner = array_of<std::uint32_t>(record, "partner", count);
  features->range_m = array_of<float>(record, "range_m", num_primary, kLengthRange);
  features->inverse_range_sigma =
      array_of<float>(record, "inverse_range_sigma", num_primary, kNotNegative);
  for (std::size_t i = 0; i < count; ++i) {
    check_keypoint(record, *features->rig, *features, i);
    check_partner(record, *features, i);
    if (i < num_primary) check_range(record, *features, i);
  }
  if (lacks_precision(*features) && features->rig->cameras.size() == 2) {
    measure_stereo_ranges(*features->rig, *features);
  }
  const Camera& camera = *features->rig->cameras[0].camera;
  features->grid =
      FeatureGrid(camera.width_px(),
                  camera.height_px(),
                  camera.wrap_width_px(),
                  num_primary,
                  [&](std::size_t i) {
                    return std::pair(features->keypoints[i].x_px, features->keypoints[i].y_px);
                  });
  return features;
}

std::shared_ptr<const MarkerObservations> read_markers(MapRecord& record, const Rig& rig) {
  if (!record.has("marker")) return nullptr;
  const auto numbers = record.array<std::uint32_t>("marker", std::nullopt);
  const std::size_t count = numbers.size();
  if (count == 0 || count > kMaxMarkersPerKeyframe) {
    record.fail(fmt::format("has {} markers, expected 1 to {}", count, kMaxMarkersPerKeyframe));
  }
  const auto cameras = record.array<std::uint8_t>("marker_camera", count);
  const auto pixels = record.array<Eigen::Vector2f>("marker_pixel", 4 * count);
  const auto bearings = record.array<Eigen::Vector3f>("marker_bearing", 4 * count);
  const auto slopes = record.array<Matrix23f>("marker_pixel_from_bearing", 4 * count, kSlopeRange);
  auto observations = std::make_shared<MarkerObservations>(count);
  for (std::size_t i = 0; i < count; ++i) {
    MarkerObservation& observation = (*observations)[i];
    if (numbers[i] > kMaxMarkerNumber || cameras[i] >= rig.cameras.size()) {
      record.fail(fmt::format("has marker {} of camera {}, expected one up to {} of {} cameras",
                              numbers[i],
                              cameras[i],
                              kMaxMarkerNumber,
                              rig.cameras.size()));
    }
    observation.id = static_cast<int>(numbers[i]);
    observation.camera = cameras[i];
    for (std::size_t corner = 0; corner < 4; ++corner) {
      observation.pixels[corner] = pixels[4 * i + corner];
      observation.bearings[corner] = bearings[4 * i + corner];
      observation.pixel_from_bearing[corner] = slopes[4 * i + corner];
      const double length = observation.bearings[corner].cast<double>().norm();
      if (!(std::abs(length - 1.0) <= kMaxUnitError)) {
        record.fail(fmt::format(
            "marker_bearing of marker {} has the length {}, expected 1", observation.id, length));
      }
    }
  }
  return observations;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/mapping/fuse.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace waymark {
namespace {

/// Covisible keyframes in which a keyframe's landmarks are looked for: those that share most, which
/// give three quarters or more of what twice as many would (docs/decisions.md).
constexpr std::size_t kMaxTargets = 20;

/// At this distance pairs that show the same are still five times as frequent as those that do not
/// (docs/decisions.md). Of the features in reach the most alike is tested, whatever the second.
constexpr AppearanceOptions kAppearance{.max_distance = 64, .max_ratio = 1.0};

/// Of 1000 features of an image of 0.4 megapixels one lies this near to a place in one case of
/// five, whatever it shows: farther off more landmarks are fused wrongly than rightly
/// (docs/decisions.md).
constexpr double kMaxRadiusPx = 5.0;

/// A landmark to look for.
struct Sought {
  LandmarkId id;
  Eigen::Matrix3d covariance;  ///< Of its position, as far as its observations tell.
};

std::vector<Sought> seen_by(const Map& map, std::span<const KeyframeId> keyframes) {
  std::vector<LandmarkId> ids;
  for (KeyframeId keyframe : keyframes) {
    const auto& landmarks = map.keyframes().at(keyframe).landmarks;
    ids.insert(ids.end(), landmarks.begin(), landmarks.end());
  }
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  std::vector<Sought> sought;
  for (LandmarkId id : ids) {
    if (!id.is_valid()) continue;
    const Landmark& landmark = map.landmarks().at(id);
    if (landmark.appearance.size_m <= 0.0) continue;
    sought.push_back({id, position_information(map, landmark).inverse()});
  }
  return sought;
}

/// Radius in pixels of the landmark's expected level in which its feature lies with a probability
/// of 95 %: the landmark's uncertainty across the line of sight, and one pixel of the feature's
/// own.
double search_radius_px(const Eigen::Vector3d& to_camera,
                        const Eigen::Matrix3d& covariance,
                        double size_m) {
  const Eigen::Vector3d along = to_camera.normalized();
  const double across = covariance.trace() - along.dot(covariance * along);
  return std::min(kMaxRadiusPx,
                  std::sqrt(kMaxSquaredResidual * (1.0 + across / (size_m * size_m))));
}

/// The sought landmarks that a keyframe does not see, and what it takes to find them there.
struct Search {
  LandmarkSet landmarks;
  std::vector<Eigen::Matrix3d> covariances;
  std::vector<double> radii_px;
};

Search prepare(const Map& map, std::span<const Sought> sought, const Keyframe& target) {
  std::vector<LandmarkId> known = target.landmarks;
  std::sort(known.begin(), known.end());
  const Eigen::Vector3d eye =
      (target.rig->cameras[0].cam_from_rig * target.rig_from_world).origin_in_source();
  Search search;
  for (const auto& [id_then, covariance] : sought) {
    const LandmarkId id = map.resolve(id_then);
    if (!id.is_valid() || std::binary_search(known.begin(), known.end(), id)) continue;
    const Landmark& landmark = map.landmarks().at(id);
    search.landmarks.add(id, landmark);
    search.covariances.push_back(covariance);
    search.radii_px.push_back(
        search_radius_px(eye - landmark.position_in_world, covariance, landmark.appearance.size_m));
  }
  return search;
}

void fuse(Map& map,
          std::span<const Sought> sought,
          KeyframeId target,
          ProjectionMatcher& matcher,
          DirtyLandmarks& dirty) {
  const Keyframe& view = map.keyframes().at(target);
  const std::shared_ptr<const Features> features = view.features;
  const Search search = prepare(map, sought, view);
  matcher.look_with(view.rig);
  const ProjectionMatches& matches =
      matcher.match(search.landmarks,
                    *features,
                    {},
                    view.rig_from_world,
                    {.radii_px = search.radii_px, .appearance = kAppearance});
  for (std::size_t i = 0; i < search.landmarks.size(); ++i) {
    const std::uint32_t feature = matches.features[i];
    const LandmarkId id = search.landmarks.ids[i];
    if (feature == kNoFeature || !map.landmarks().contains(id)) continue;
    const Keyframe& keyframe = map.keyframes().at(target);
    const Eigen::Vector3d& position = map.landmarks().at(id).position_in_world;
    if (!agrees(keyframe, feature, position, search.covariances[i])) continue;
    const LandmarkId present = keyframe.landmarks[feature];
    if (!present.is_valid()) {
      observe_with_partner(map, target, feature, id);
      dirty.insert(id);
      continue;
    }
    merge(map, present, id, dirty);
  }
}

}  // namespace

void merge(Map& map, LandmarkId a, LandmarkId b, DirtyLandmarks& dirty) {
  const auto information = [&](LandmarkId id) {
    return position_information(map, map.landmarks().at(id)).determinant();
  };
  const bool keeps_a = information(a) >= information(b);
  const LandmarkId survivor = keeps_a ? a : b;
  const LandmarkId absorbed = keeps_a ? b : a;
  map.merge_landmarks(survivor, absorbed);
  dirty.erase(absorbed);
  dirty.insert(survivor);
}

void fuse_into(Map& map,
               std::span<const KeyframeId> sources,
               KeyframeId target,
               ProjectionMatcher& matcher,
               DirtyLandmarks& dirty) {
  fuse(map, seen_by(map, sources), target, matcher, dirty);
}

void fuse_with_neighbours(Map& map,
                          KeyframeId keyframe,
                          ProjectionMatcher& matcher,
                          DirtyLandmarks& dirty) {
  const std::vector<Sought> sought = seen_by(map, std::span(&keyframe, 1));
  for (KeyframeId target : strongest_neighbours(map, keyframe, kMaxTargets)) {
    fuse(map, sought, target, matcher, dirty);
  }
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/loop/candidate_score.h"

#include <algorithm>

#include "waymark/base/adaptive_threshold.h"
#include "waymark/loop/find.h"

namespace waymark {
namespace {

Rigid3 cam_from_world(const Keyframe& keyframe) {
  return keyframe.rig().cameras[0].cam_from_rig * keyframe.rig_from_world;
}

void add_view(const Map& map,
              const Keyframe& keyframe,
              std::uint32_t feature,
              LandmarkMatches::Side& side) {
  const Landmark& landmark = map.landmarks().at(keyframe.landmarks[feature]);
  side.add(cam_from_world(keyframe) * landmark.position_in_world,
           keyframe.features->measurement(feature));
}

Sim3 rig_from_cam(const Keyframe& keyframe) {
  return Sim3(keyframe.rig().cameras[0].cam_from_rig.inverse());
}

}  // namespace

Rigid3 pose_in_other_world(const Sim3& rig_from_other, const Rigid3& other_from_world) {
  return Rigid3(rig_from_other.rotation, rig_from_other.translation / rig_from_other.scale) *
         other_from_world;
}

std::optional<ScoredCandidate> CandidateScorer::score(const Map& map,
                                                      KeyframeId query,
                                                      KeyframeId match,
                                                      std::size_t min_inliers) {
  ScoredCandidate scored;
  scored.candidate.query = query;
  scored.candidate.match = match;
  if (!estimate(map, scored.candidate)) return std::nullopt;
  if (scored.candidate.num_inliers < min_inliers) return std::nullopt;
  count_visibility(map, scored);
  return scored;
}

LandmarkMatches CandidateScorer::match_by_appearance(const Map& map,
                                                     KeyframeId query,
                                                     KeyframeId match) {
  const Keyframe& in_query = map.keyframes().at(query);
  const Keyframe& in_match = map.keyframes().at(match);
  std::vector<std::uint32_t> known;
  for (std::uint32_t i = 0; i < in_query.features->num_corners(); ++i) {
    if (in_query.landmarks[i].is_valid()) known.push_back(i);
  }
  LandmarkMatches matches;
  for (const FeatureMatch& pair : appearance_.match_all(
           *in_query.features,
           known,
           *in_match.features,
           {.max_distance = options_.max_distance, .max_ratio = options_.max_ratio})) {
    if (!in_match.landmarks[pair.b].is_valid()) continue;
    add_view(map, in_match, pair.b, matches.a);
    add_view(map, in_query, pair.a, matches.b);
  }
  return matches;
}

std::optional<SimilarityEstimate> CandidateScorer::estimate(const Map& map,
                                                            LoopCandidate& candidate) {
  const Keyframe& in_query = map.keyframes().at(candidate.query);
  const Keyframe& in_match = map.keyframes().at(candidate.match);
  const auto set_similarity = [&](const Sim3& query_cam_from_match_cam) {
    candidate.query_from_match =
        rig_from_cam(in_query) * query_cam_from_match_cam * rig_from_cam(in_match).inverse();
  };
  LandmarkMatches matches = match_by_appearance(map, candidate.query, candidate.match);
  if (matches.size() < static_cast<std::size_t>(options_.min_matches)) return std::nullopt;
  const bool is_metric =
      has_metric_submap(map, candidate.query) && has_metric_submap(map, candidate.match);
  const SimilarityOptions options{.is_scale_free = !is_metric, .noise_px = options_.noise_px};
  std::optional<SimilarityEstimate> found = find_similarity(
      matches, options, {.seed = seed_, .stream = candidate.query.value, .min_inlier_ratio = 0.2});
  constexpr int kRounds = 2;
  for (int round = 0; round < kRounds && found &&
                      found->num_inliers >= static_cast<std::size_t>(options_.min_inliers);
       ++round) {
    set_similarity(found->b_from_a);
    matches = match_by_projection(map, candidate);
    found = refine_similarity(matches, found->b_from_a, options);
  }
  if (!found || found->num_inliers < static_cast<std::size_t>(options_.min_inliers))
    return std::nullopt;
  set_similarity(found->b_from_a);
  candidate.num_inliers = found->num_inliers;
  std::vector<LoopCandidate::Pair> inliers;
  for (std::size_t i = 0; i < candidate.pairs.size(); ++i) {
    if (found->is_inlier[i]) inliers.push_back(candidate.pairs[i]);
  }
  candidate.pairs = std::move(inliers);
  return found;
}

LandmarkMatches CandidateScorer::match_by_projection(const Map& map, LoopCandidate& candidate) {
  const Keyframe& in_query = map.keyframes().at(candidate.query);
  const Keyframe& in_match = map.keyframes().at(candidate.match);
  std::vector<std::uint32_t> features_of_match;
  landmarks_.clear();
  for (std::uint32_t i = 0; i < in_match.features->num_corners(); ++i) {
    const LandmarkId id = in_match.landmarks[i];
    if (!id.is_valid() || !(map.landmarks().at(id).appearance.size_m > 0.0)) continue;
    landmarks_.add(id, map.landmarks().at(id));
    features_of_match.push_back(i);
  }
  const ProjectionMatches& found =
      projection_.match(in_query.rig(),
                        landmarks_,
                        *in_query.features,
                        {},
                        pose_in_other_world(candidate.query_from_match, in_match.rig_from_world),
                        {.radius_px = options_.guided_radius_px});
  LandmarkMatches matches;
  candidate.pairs.clear();
  for (std::size_t i = 0; i < landmarks_.size(); ++i) {
    const std::uint32_t feature = found.features[i];
    if (feature == kNoFeature || !in_query.landmarks[feature].is_valid()) continue;
    add_view(map, in_match, features_of_match[i], matches.a);
    add_view(map, in_query, feature, matches.b);
    candidate.pairs.push_back({in_query.landmarks[feature], landmarks_.ids[i]});
  }
  return matches;
}

VisibleShare CandidateScorer::look_for(const Map& map,
                                       std::span<const KeyframeId> sources,
                                       KeyframeId target,
                                       const Rigid3& target_from_world) {
  std::vector<LandmarkId> ids;
  for (KeyframeId source : sources) {
    const auto& seen = map.keyframes().at(source).landmarks;
    ids.insert(ids.end(), seen.begin(), seen.end());
  }
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  landmarks_.clear();
  // Where lengths are metric and there are fewer keyframes, those that all of them saw.
  auto enough = static_cast<std::size_t>(options_.min_observers);
  if (has_metric_submap(map, target)) enough = std::min(enough, sources.size());
  for (LandmarkId id : ids) {
    if (!id.is_valid()) continue;
    const Landmark& landmark = map.landmarks().at(id);
    if (landmark.appearance.size_m > 0.0 && num_observers(landmark) >= enough) {
      landmarks_.add(id, landmark);
    }
  }
  landmarks_.keep_corners();
  const Keyframe& keyframe = map.keyframes().at(target);
  const ProjectionMatches& found = projection_.match(keyframe.rig(),
                                                     landmarks_,
                                                     *keyframe.features,
                                                     {},
                                                     target_from_world,
                                                     {.radius_px = options_.observation_radius_px});
  const auto num_visible =
      std::count(found.is_visible.begin(), found.is_visible.end(), std::uint8_t{1});
  return {found.num_matches, static_cast<std::size_t>(num_visible)};
}

void CandidateScorer::count_visibility(const Map& map, ScoredCandidate& scored) {
  const LoopCandidate& candidate = scored.candidate;
  const Rigid3 query_from_world = map.keyframes().at(candidate.query).rig_from_world;
  const Rigid3 match_from_world = map.keyframes().at(candidate.match).rig_from_world;
  const std::vector<KeyframeId> around_match =
      with_neighbours(map, candidate.match, static_cast<std::size_t>(options_.num_surroundings));
  scored.in_query = look_for(map,
                             around_match,
                             candidate.query,
                             pose_in_other_world(candidate.query_from_match, match_from_world));
  scored.in_match = look_for(
      map,
      with_neighbours(map, candidate.query, static_cast<std::size_t>(options_.num_surroundings)),
      candidate.match,
      pose_in_other_world(candidate.query_from_match.inverse(), query_from_world));
  for (KeyframeId id : strongest_neighbours(
           map, candidate.query, static_cast<std::size_t>(options_.max_confirming))) {
    const Features& features = *map.keyframes().at(id).features;
    const Rigid3 id_from_query = map.keyframes().at(id).rig_from_world * query_from_world.inverse();
    const Sim3 id_from_match = Sim3(id_from_query) * candidate.query_from_match;
    const VisibleShare observations =
        look_for(map, around_match, id, pose_in_other_world(id_from_match, match_from_world));
    scored.is_confirmed =
        static_cast<int>(observations.num_found) >=
            adaptive_threshold(options_.min_found_to_confirm, features.num_corners()) &&
        observations.share() >= options_.min_share_to_confirm;
    if (scored.is_confirmed) break;
  }
}

}  // namespace waymark

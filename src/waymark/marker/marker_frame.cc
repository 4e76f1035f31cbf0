// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "waymark/geometry/alignment.h"
#include "waymark/marker/survey.h"

namespace waymark {
namespace {

/// Sizes agree to within this part of them, beside what their views leave open: maps of one camera
/// drift in scale, too.
constexpr double kSizeTolerance = 0.06;
/// What tells less of the scale is no witness.
constexpr double kMaxSideSigma = 0.03;
/// Prints and measures are no better than this.
constexpr double kLeastSideSigma = 0.002;
/// A surveyed marker is misplaced where it is off by so many times what the others are, and by as
/// much of the extent of all of them, and more than it is large.
constexpr double kMisplacedTimes = 4.0;
constexpr double kMisplacedShare = 0.02;

struct Witness {
  SurveyedMarker* marker;
  double log_scale;  ///< Of metres per unit of the map.
  double sigma;
};

std::vector<Witness> list_witnesses(const KnownMarkers& known, std::span<SurveyedMarker> markers) {
  std::vector<Witness> witnesses;
  for (SurveyedMarker& marker : markers) {
    if (marker.verdict != MarkerStatus::kSound) continue;
    marker.expected = known.size_of(marker.id);
    if (!(marker.expected > 0.0)) marker.verdict = MarkerStatus::kNoSize;
    if (marker.side_sigma > kMaxSideSigma) marker.verdict = MarkerStatus::kFewViews;
    if (marker.verdict != MarkerStatus::kSound) continue;
    witnesses.push_back({&marker,
                         std::log(marker.expected / marker.map_from_marker.scale),
                         std::hypot(marker.side_sigma, kLeastSideSigma)});
  }
  return witnesses;
}

bool agree(double a, double b, double sigma) {
  return std::abs(a - b) <= kSizeTolerance + 3.0 * sigma;
}

struct AgreedScale {
  double log_scale = 0.0;
  double sigma = 0.0;
};

AgreedScale mean_of(const std::vector<Witness>& witnesses, double middle) {
  double sum = 0.0;
  double weights = 0.0;
  for (const Witness& witness : witnesses) {
    if (!agree(witness.log_scale, middle, witness.sigma)) continue;
    const double weight = 1.0 / (witness.sigma * witness.sigma);
    sum += weight * witness.log_scale;
    weights += weight;
  }
  return {sum / weights, 1.0 / std::sqrt(weights)};
}

/// What most say; of a map in metres the map is one of them.
std::optional<AgreedScale> agree_on_scale(const std::vector<Witness>& witnesses, bool is_metric) {
  std::size_t most = 0;
  double middle = 0.0;
  double best_sigma = 0.0;
  const auto count_around = [&](double log_scale, double sigma) {
    std::size_t count = is_metric && agree(0.0, log_scale, sigma);
    for (const Witness& witness : witnesses) {
      count += agree(witness.log_scale, log_scale, witness.sigma);
    }
    if (count < most || (count == most && sigma >= best_sigma)) return;
    most = count;
    middle = log_scale;
    best_sigma = sigma;
  };
  for (const Witness& witness : witnesses) count_around(witness.log_scale, witness.sigma);
  const std::size_t num_voices = witnesses.size() + is_metric;
  if (is_metric && (witnesses.empty() || 2 * most <= num_voices)) return AgreedScale{};
  if (witnesses.empty() || 2 * most <= num_voices) return std::nullopt;
  return mean_of(witnesses, middle);
}

struct SurveyFit {
  Sim3 world_from_map;
  std::vector<double> off_m;  ///< Per marker.
  double rms_m = 0.0;
  double extent_m = 0.0;
};

std::optional<SurveyFit> fit_survey(const KnownMarkers& known,
                                    const std::vector<SurveyedMarker*>& markers,
                                    double scale,
                                    bool is_scale_free) {
  std::vector<Eigen::Vector3d> in_map;
  std::vector<Eigen::Vector3d> in_world;
  for (const SurveyedMarker* marker : markers) {
    for (std::size_t i = 0; i < 4; ++i) {
      in_map.push_back(scale * (marker->map_from_marker * marker_corner(i, 1.0)));
      in_world.push_back(*known.pose_of(marker->id) * marker_corner(i, known.size_of(marker->id)));
    }
  }
  SurveyFit fit;
  Sim3 world_from_scaled;
  if (is_scale_free && markers.size() > 1) {
    const auto similarity = align_similarity(in_map, in_world);
    if (!similarity) return std::nullopt;
    world_from_scaled = *similarity;
  } else {
    const auto rigid = align_rigid(in_map, in_world);
    if (!rigid) return std::nullopt;
    world_from_scaled = Sim3(*rigid);
  }
  fit.world_from_map =
      world_from_scaled * Sim3(Eigen::Quaterniond::Identity(), Eigen::Vector3d::Zero(), scale);
  double sum = 0.0;
  for (std::size_t m = 0; m < markers.size(); ++m) {
    double off = 0.0;
    for (std::size_t i = 4 * m; i < 4 * m + 4; ++i) {
      off += 0.25 * (world_from_scaled * in_map[i] - in_world[i]).norm();
      sum += (world_from_scaled * in_map[i] - in_world[i]).squaredNorm();
      fit.extent_m = std::max(fit.extent_m, (in_world[i] - in_world[0]).norm());
    }
    fit.off_m.push_back(off);
  }
  fit.rms_m = std::sqrt(sum / static_cast<double>(in_map.size()));
  return fit;
}

/// The fit of those that agree: as long as leaving one out makes the others agree far better, it is
/// left out. Of three markers or fewer nobody can say which one is wrong.
std::optional<SurveyFit> fit_sound_survey(const KnownMarkers& known,
                                          std::vector<SurveyedMarker*> markers,
                                          double scale,
                                          bool is_scale_free) {
  std::optional<SurveyFit> fit = fit_survey(known, markers, scale, is_scale_free);
  while (fit && markers.size() > 3) {
    std::optional<SurveyFit> best;
    std::size_t left_out = 0;
    for (std::size_t m = 0; m < markers.size(); ++m) {
      std::vector<SurveyedMarker*> rest = markers;
      rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(m));
      const auto without = fit_survey(known, rest, scale, is_scale_free);
      if (!without || (best && without->rms_m >= best->rms_m)) continue;
      best = without;
      left_out = m;
    }
    const double limit = std::max(kMisplacedShare * fit->extent_m, kMisplacedTimes * best->rms_m);
    if (!best || fit->rms_m * std::sqrt(static_cast<double>(markers.size())) <= limit) break;
    SurveyedMarker& wrong = *markers[left_out];
    const Eigen::Vector3d there = best->world_from_map * wrong.map_from_marker.translation;
    wrong.found = (there - known.pose_of(wrong.id)->translation).norm();
    wrong.verdict = MarkerStatus::kMisplaced;
    markers.erase(markers.begin() + static_cast<std::ptrdiff_t>(left_out));
    fit = best;
  }
  return fit;
}

}  // namespace

std::optional<MarkerFrame> fit_marker_frame(const KnownMarkers& known,
                                            bool is_metric,
                                            std::span<SurveyedMarker> markers) {
  const std::vector<Witness> witnesses = list_witnesses(known, markers);
  const std::optional<AgreedScale> agreed = agree_on_scale(witnesses, is_metric);
  std::vector<SurveyedMarker*> surveyed;
  const SurveyedMarker* marker0 = nullptr;
  for (const Witness& witness : witnesses) {
    SurveyedMarker& marker = *witness.marker;
    if (!agreed || !agree(witness.log_scale, agreed->log_scale, witness.sigma)) {
      marker.verdict = MarkerStatus::kWrongSize;
      marker.found = agreed ? std::exp(agreed->log_scale) * marker.map_from_marker.scale : 0.0;
      continue;
    }
    if (known.pose_of(marker.id)) surveyed.push_back(&marker);
    if (marker.id == 0) marker0 = &marker;
  }
  if (!agreed || witnesses.empty()) return std::nullopt;
  const double scale = is_metric ? 1.0 : std::exp(agreed->log_scale);
  MarkerFrame frame;
  frame.scale_sigma = is_metric ? 0.0 : agreed->sigma;
  frame.world_from_map.scale = scale;
  const auto fit =
      surveyed.empty() ? std::nullopt : fit_sound_survey(known, surveyed, scale, !is_metric);
  if (fit) {
    frame.basis = MarkerFrame::Basis::kSurvey;
    frame.world_from_map = fit->world_from_map;
    frame.rms_m = fit->rms_m;
  } else if (marker0) {
    frame.basis = MarkerFrame::Basis::kMarker0;
    Sim3 map_from_marker = marker0->map_from_marker;
    map_from_marker.scale = 1.0 / scale;
    frame.world_from_map = map_from_marker.inverse();
  }
  return frame;
}

std::string to_string(MarkerStatus verdict) {
  switch (verdict) {
    case MarkerStatus::kSound:
      return "used";
    case MarkerStatus::kFewViews:
      return "few views";
    case MarkerStatus::kMoved:
      return "moved";
    case MarkerStatus::kTwice:
      return "twice";
    case MarkerStatus::kWrongSize:
      return "wrong size";
    case MarkerStatus::kMisplaced:
      return "misplaced";
    case MarkerStatus::kNoSize:
      return "no size";
  }
  return "unknown";
}

std::string to_string(MarkerFrame::Basis basis) {
  switch (basis) {
    case MarkerFrame::Basis::kScale:
      return "scale";
    case MarkerFrame::Basis::kMarker0:
      return "marker 0";
    case MarkerFrame::Basis::kSurvey:
      return "surveyed";
  }
  return "unknown";
}

std::string describe_fault(const SurveyedMarker& marker) {
  const std::string name = fmt::format("marker {}", marker.id);
  switch (marker.verdict) {
    case MarkerStatus::kSound:
      return "";
    case MarkerStatus::kFewViews:
      return fmt::format("{}: seen in {} keyframes, too few or too much alike to tell where it is",
                         name,
                         marker.num_views);
    case MarkerStatus::kMoved:
      return fmt::format("{}: was moved, it is elsewhere from {:.3f} s on; left out",
                         name,
                         1e-9 * static_cast<double>(marker.changed_ns));
    case MarkerStatus::kTwice:
      return name + ": is there twice; left out";
    case MarkerStatus::kWrongSize:
      if (!(marker.found > 0.0)) return name + ": the sizes of markers contradict each other";
      return fmt::format("{}: its side is {:.4f} m by the others, {:.4f} m was said; left out",
                         name,
                         marker.found,
                         marker.expected);
    case MarkerStatus::kMisplaced:
      return fmt::format(
          "{}: is {:.3f} m away from its surveyed place; left out", name, marker.found);
    case MarkerStatus::kNoSize:
      return name + ": nothing says how large it is; left out";
  }
  return "";
}

}  // namespace waymark

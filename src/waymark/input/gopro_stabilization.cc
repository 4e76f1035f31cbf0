// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "waymark/geometry/rigid3.h"
#include "waymark/input/imu_readers.h"

namespace waymark {
namespace {

/// Clocks of images and samples are that far apart at most, and are compared in such steps.
constexpr std::int64_t kMaxOffsetNs = 100'000'000;
constexpr std::int64_t kOffsetStepNs = 1'000'000;
/// Orientations whose turns differ by more than this part of the gyroscope's are not of its axes.
constexpr double kMaxDisagreement = 0.3;

/// How far the IMU has turned up to a time by the sum of its rates, rad.
class SummedTurns {
 public:
  explicit SummedTurns(const std::vector<ImuSample>& samples) : samples_(samples) {
    sums_.emplace_back(Eigen::Vector3d::Zero());
    for (std::size_t i = 1; i < samples.size(); ++i) {
      const auto step = static_cast<double>(samples[i].timestamp_ns - samples[i - 1].timestamp_ns);
      sums_.push_back(sums_.back() +
                      0.5e-9 * step *
                          (samples[i].angular_velocity + samples[i - 1].angular_velocity));
    }
  }

  /// Nothing before the first sample and after the last.
  std::optional<Eigen::Vector3d> at(std::int64_t time_ns) const {
    const auto after = std::ranges::upper_bound(samples_, time_ns, {}, &ImuSample::timestamp_ns);
    if (after == samples_.begin() || after == samples_.end()) return std::nullopt;
    const auto i = static_cast<std::size_t>(after - samples_.begin());
    const auto before_ns = samples_[i - 1].timestamp_ns;
    const double part = static_cast<double>(time_ns - before_ns) /
                        static_cast<double>(after->timestamp_ns - before_ns);
    return (1.0 - part) * sums_[i - 1] + part * sums_[i];
  }

 private:
  const std::vector<ImuSample>& samples_;
  std::vector<Eigen::Vector3d> sums_;
};

/// Mean squared difference of the turns between orientations and those that were summed up, and of
/// the latter themselves, rad^2.
struct TurnAgreement {
  double difference = std::numeric_limits<double>::infinity();
  double whole = 0.0;
};

TurnAgreement compare_turns(const std::vector<StampedRotation>& camera_from_start,
                            const SummedTurns& turns,
                            std::int64_t offset_ns) {
  double difference = 0.0, whole = 0.0;
  int count = 0;
  for (std::size_t i = 1; i < camera_from_start.size(); ++i) {
    const StampedRotation& from = camera_from_start[i - 1];
    const StampedRotation& to = camera_from_start[i];
    const auto begin = turns.at(from.timestamp_ns + offset_ns);
    const auto end = turns.at(to.timestamp_ns + offset_ns);
    if (!begin || !end) continue;
    const Eigen::Vector3d turn = *end - *begin;
    difference += (so3_log(from.rotation * to.rotation.conjugate()) - turn).squaredNorm();
    whole += turn.squaredNorm();
    ++count;
  }
  if (count == 0) return {};
  return {difference / count, whole / count};
}

/// By how much the clock of the samples is ahead of that of the images; nothing where orientations
/// turn otherwise.
std::optional<std::int64_t> clock_offset(const std::vector<StampedRotation>& camera_from_start,
                                         const std::vector<ImuSample>& samples) {
  const SummedTurns turns(samples);
  TurnAgreement best;
  std::int64_t best_ns = 0;
  for (std::int64_t offset = -kMaxOffsetNs; offset <= kMaxOffsetNs; offset += kOffsetStepNs) {
    const TurnAgreement agreement = compare_turns(camera_from_start, turns, offset);
    if (agreement.difference >= best.difference) continue;
    best = agreement;
    best_ns = offset;
  }
  if (!(best.difference < kMaxDisagreement * kMaxDisagreement * best.whole)) return std::nullopt;
  return best_ns;
}

/// What was measured in axes of the camera, in those of an image that is turned against it.
ImuSample seen_from_image(const ImuSample& sample,
                          const StampedRotation& before,
                          const StampedRotation& after) {
  const double period_s = 1e-9 * static_cast<double>(after.timestamp_ns - before.timestamp_ns);
  const double part =
      1e-9 * static_cast<double>(sample.timestamp_ns - before.timestamp_ns) / period_s;
  const Eigen::Vector3d turn = so3_log(after.rotation * before.rotation.conjugate());
  const Eigen::Quaterniond image_from_camera = so3_exp(part * turn) * before.rotation;
  return {sample.timestamp_ns,
          image_from_camera * sample.angular_velocity - turn / period_s,
          image_from_camera * sample.acceleration};
}

}  // namespace

bool turn_with_images(const std::vector<StampedRotation>& camera_from_start,
                      const std::vector<StampedRotation>& image_from_camera,
                      std::vector<ImuSample>& samples) {
  const auto offset_ns = clock_offset(camera_from_start, samples);
  if (!offset_ns || image_from_camera.size() < 2) return false;
  std::vector<ImuSample> turned;
  for (ImuSample sample : samples) {
    sample.timestamp_ns -= *offset_ns;
    const auto after = std::ranges::upper_bound(
        image_from_camera, sample.timestamp_ns, {}, &StampedRotation::timestamp_ns);
    if (after == image_from_camera.begin() || after == image_from_camera.end()) continue;
    turned.push_back(seen_from_image(sample, *(after - 1), *after));
  }
  samples = std::move(turned);
  return true;
}

}  // namespace waymark

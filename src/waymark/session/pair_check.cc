// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/session/pair_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "waymark/features/range_precision.h"

namespace waymark {
namespace {

/// Shares of the features of camera 0. With the right calibration 60 to 95 % get a distance; with a
/// mistake up to 13 %, of a fisheye lens that is turned by a degree up to 20 %.
constexpr double kFewShare = 0.25;
constexpr double kManyShare = 0.4;
/// A distance is one whose standard deviation is less than itself: a mistake leaves disparities of
/// a part of a pixel, of either sign.
constexpr double kToldFromInfinity = 1.0;
/// A mistake explains the images where it is that much better than others.
constexpr double kClearly = 1.2;
/// Images with fewer features show nothing.
constexpr std::size_t kMinFeatures = 100;

Rig with_cam1(Rig rig, const Rigid3& cam1_from_rig) {
  rig.cameras[1].cam_from_rig = cam1_from_rig;
  return rig;
}

/// Where camera 1 is, seen from camera 0.
const char* direction_of(const Rigid3& cam1_from_cam0) {
  const Eigen::Vector3d place = cam1_from_cam0.inverse().translation;
  int axis = 0;
  place.cwiseAbs().maxCoeff(&axis);
  constexpr std::array kBefore = {"to the left of", "above", "behind"};
  constexpr std::array kAfter = {"to the right of", "below", "in front of"};
  const auto at = static_cast<std::size_t>(axis);
  return place[axis] < 0.0 ? kBefore[at] : kAfter[at];
}

}  // namespace

void PairCheck::Counts::add(const Features& found) {
  features += found.num_primary;
  for (std::size_t i = 0; i < found.num_primary; ++i) {
    partners += found.partner[i] != kNoFeature;
    const auto relative_sigma = relative_range_sigma(found, static_cast<std::uint32_t>(i));
    ranges += relative_sigma && *relative_sigma < kToldFromInfinity;
  }
}

double PairCheck::Counts::partners_share() const {
  return static_cast<double>(partners) / static_cast<double>(std::max<std::size_t>(features, 1));
}

double PairCheck::Counts::ranges_share() const {
  return static_cast<double>(ranges) / static_cast<double>(std::max<std::size_t>(features, 1));
}

PairCheck::PairCheck(Rig rig, FrameSettings settings)
    : rig_(std::move(rig)),
      settings_(std::move(settings)),
      swapped_{rig_, true},
      inverse_{with_cam1(rig_, rig_.cameras[1].cam_from_rig.inverse()), false},
      negated_{with_cam1(rig_,
                         {rig_.cameras[1].cam_from_rig.rotation,
                          -rig_.cameras[1].cam_from_rig.translation}),
               false} {}

void PairCheck::add(const FrameImages& images, const Features& features) {
  if (features.num_primary < kMinFeatures) return;
  ++num_images_;
  given_.add(features);
  if (given_.ranges_share() >= kFewShare) return;
  FrameImages exchanged = images;
  std::swap(exchanged.image0, exchanged.image1);
  exchanged.mask = {};
  const bool can_swap = images.image0.width_px == images.image1.width_px &&
                        images.image0.height_px == images.image1.height_px;
  for (Trial* trial : {&swapped_, &inverse_, &negated_}) {
    if (trial->swaps_images && !can_swap) continue;
    FrameBuilder builder(trial->rig, settings_);
    trial->counts.add(*builder.build(trial->swaps_images ? exchanged : images));
  }
}

std::optional<std::string> PairCheck::advise() const {
  if (num_images_ == 0 || given_.ranges_share() >= kFewShare) return std::nullopt;
  const double swapped = swapped_.counts.ranges_share();
  const double inverse = inverse_.counts.ranges_share();
  const double negated = negated_.counts.ranges_share();
  const double best = std::max({swapped, inverse, negated});
  if (best >= kManyShare && best > 2.0 * given_.ranges_share()) {
    std::string cures;
    const auto add = [&](double share, const char* cure) {
      if (kClearly * share > best) cures += fmt::format("{}{}", cures.empty() ? "" : ", or ", cure);
    };
    add(swapped, "left and right images are swapped");
    add(inverse, "T_cn_cnm1 is the transform from camera 1 to camera 0, expected its inverse");
    if (cures.empty()) add(negated, "the translation of T_cn_cnm1 has the wrong sign");
    return fmt::format(
        "by the images camera 1 is not {} camera 0, where the calibration puts it: {}?",
        direction_of(rig_.cameras[1].cam_from_rig),
        cures);
  }
  if (given_.partners_share() >= kFewShare) return std::nullopt;
  return fmt::format(
      "camera 1 shows only {:.0f} % of what camera 0 shows where the calibration says: is the "
      "rotation of T_cn_cnm1 right, are the intrinsics of both cameras, and are the images of a "
      "pair taken at the same time?",
      100.0 * given_.partners_share());
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/solver/pose_kernel.h"

#include "waymark/solver/residual.h"

// The sums are arrays of vectors, which vectors without a compile-time size cannot form.
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "waymark/solver/pose_kernel.cc"
#include <hwy/foreach_target.h>
// After foreach_target.h.
#include <hwy/highway.h>

#include "waymark/solver/vector3-inl.h"

HWY_BEFORE_NAMESPACE();
namespace waymark {
namespace HWY_NAMESPACE {
namespace {

using Tag = hn::CappedTag<double, kPoseLanes>;
using Vec = hn::Vec<Tag>;
using Mask = hn::Mask<Tag>;
using Vec3 = Vec3Of<Vec>;

HWY_INLINE Vec load(const PoseWorkspace::Arrays& arrays, PoseField field, std::size_t index) {
  return hn::LoadU(Tag(), arrays.fields[field].data() + index);
}

HWY_INLINE Vec3 load3(const PoseWorkspace::Arrays& arrays, PoseField first, std::size_t index) {
  return {load(arrays, first, index),
          load(arrays, static_cast<PoseField>(first + 1), index),
          load(arrays, static_cast<PoseField>(first + 2), index)};
}

/// The pose, broadcast to all lanes.
struct Transform {
  Vec3 row0, row1, row2;
  Vec3 translation;
};

HWY_INLINE Vec3 broadcast(const Eigen::Vector3d& v) {
  const Tag tag;
  return {hn::Set(tag, v.x()), hn::Set(tag, v.y()), hn::Set(tag, v.z())};
}

HWY_INLINE Transform broadcast(const Rigid3& pose) {
  const Eigen::Matrix3d rotation = pose.rotation_matrix();
  return {broadcast(rotation.row(0).transpose()),
          broadcast(rotation.row(1).transpose()),
          broadcast(rotation.row(2).transpose()),
          broadcast(pose.translation)};
}

/// As in residual.h.
struct Seen {
  Vec3 direction;
  Vec inverse_range;
  Vec3 w0, w1;
  Vec residual0, residual1;
  Vec squared_residual;
  Mask is_ahead;
};

HWY_INLINE Seen see(const PoseWorkspace::Arrays& arrays, std::size_t i, const Transform& pose) {
  const Tag tag;
  const Vec3 world = load3(arrays, kPointX, i);
  const Vec3 point = {hn::Add(dot(pose.row0, world), pose.translation.x),
                      hn::Add(dot(pose.row1, world), pose.translation.y),
                      hn::Add(dot(pose.row2, world), pose.translation.z)};
  const Vec squared_range = hn::Max(dot(point, point), hn::Set(tag, 1e-24));
  Seen seen;
  seen.inverse_range = hn::Div(hn::Set(tag, 1.0), hn::Sqrt(squared_range));
  seen.direction = scale(point, seen.inverse_range);
  const Vec3 bearing = load3(arrays, kBearingX, i);
  seen.is_ahead = hn::Gt(dot(seen.direction, bearing), hn::Zero(tag));
  const Vec3 difference = subtract(seen.direction, bearing);
  seen.w0 = load3(arrays, kW00, i);
  seen.w1 = load3(arrays, kW10, i);
  seen.residual0 = dot(seen.w0, difference);
  seen.residual1 = dot(seen.w1, difference);
  const Vec squared =
      hn::Add(hn::Mul(seen.residual0, seen.residual0), hn::Mul(seen.residual1, seen.residual1));
  const Vec gross = hn::Set(tag, kGrossSquaredResidual);
  seen.squared_residual = hn::IfThenElse(seen.is_ahead, hn::Min(squared, gross), gross);
  return seen;
}

struct LossAndWeight {
  Vec loss, weight;
};

HWY_INLINE LossAndWeight geman_mcclure_of(Vec squared, Vec squared_scale) {
  const Vec share = hn::Div(squared_scale, hn::Add(squared_scale, squared));
  return {hn::Mul(share, squared), hn::Mul(share, share)};
}

HWY_INLINE LossAndWeight huber_of(Vec squared, Vec squared_scale, Vec huber_scale) {
  const Tag tag;
  const Vec residual = hn::Sqrt(hn::Max(squared, squared_scale));
  const Vec linear = hn::Sub(hn::Mul(hn::Add(huber_scale, huber_scale), residual), squared_scale);
  const Mask is_linear = hn::Gt(squared, squared_scale);
  return {hn::IfThenElse(is_linear, linear, squared),
          hn::IfThenElse(is_linear, hn::Div(huber_scale, residual), hn::Set(tag, 1.0))};
}

struct Sums {
  Vec value[kNumPoseSums];
};

HWY_INLINE void add(Vec& sum, Vec term) { sum = hn::Add(sum, term); }

/// Adds weight * (rows^T * rows, rows^T * residuals) of the two rows (g, h), g by translation and
/// h by rotation.
HWY_INLINE void add_bearing(const Seen& seen, Vec weight, Sums& sums) {
  const Vec along0 = dot(seen.w0, seen.direction);
  const Vec along1 = dot(seen.w1, seen.direction);
  const Vec3 g0 = scale(subtract(seen.w0, scale(seen.direction, along0)), seen.inverse_range);
  const Vec3 g1 = scale(subtract(seen.w1, scale(seen.direction, along1)), seen.inverse_range);
  const Vec3 h0 = cross(seen.direction, seen.w0);
  const Vec3 h1 = cross(seen.direction, seen.w1);
  const Vec row0[6] = {g0.x, g0.y, g0.z, h0.x, h0.y, h0.z};
  const Vec row1[6] = {g1.x, g1.y, g1.z, h1.x, h1.y, h1.z};
  std::size_t k = 0;
  for (std::size_t a = 0; a < 6; ++a) {
    const Vec weighted0 = hn::Mul(weight, row0[a]);
    const Vec weighted1 = hn::Mul(weight, row1[a]);
    for (std::size_t b = a; b < 6; ++b) {
      add(sums.value[k++], hn::Add(hn::Mul(weighted0, row0[b]), hn::Mul(weighted1, row1[b])));
    }
    add(sums.value[21 + a],
        hn::Add(hn::Mul(weighted0, seen.residual0), hn::Mul(weighted1, seen.residual1)));
  }
}

/// The same for the range, which a rotation does not change. Upper triangle: rows begin at 0, 6
/// and 11.
HWY_INLINE void add_range(const Seen& seen, Vec weight, Vec residual, Vec scale_by, Sums& sums) {
  const Vec slope = hn::Neg(hn::Mul(hn::Mul(seen.inverse_range, seen.inverse_range), scale_by));
  const Vec3 g = scale(seen.direction, slope);
  const Vec3 weighted = scale(g, weight);
  add(sums.value[0], hn::Mul(weighted.x, g.x));
  add(sums.value[1], hn::Mul(weighted.x, g.y));
  add(sums.value[2], hn::Mul(weighted.x, g.z));
  add(sums.value[6], hn::Mul(weighted.y, g.y));
  add(sums.value[7], hn::Mul(weighted.y, g.z));
  add(sums.value[11], hn::Mul(weighted.z, g.z));
  add(sums.value[21], hn::Mul(weighted.x, residual));
  add(sums.value[22], hn::Mul(weighted.y, residual));
  add(sums.value[23], hn::Mul(weighted.z, residual));
}

template <bool kIsHuber, bool kHasRanges>
HWY_INLINE void add_observations(const PoseWorkspace::Arrays& arrays,
                                 std::size_t i,
                                 const Transform& pose,
                                 double scale_px,
                                 Sums& sums) {
  const Tag tag;
  const Vec squared_scale = hn::Set(tag, scale_px * scale_px);
  const Seen seen = see(arrays, i, pose);
  const Vec given = load(arrays, kWeight, i);
  LossAndWeight bearing;
  if (kIsHuber) {
    bearing = huber_of(seen.squared_residual, squared_scale, hn::Set(tag, scale_px));
  } else {
    bearing = geman_mcclure_of(seen.squared_residual, squared_scale);
  }
  add_bearing(seen, hn::IfThenElseZero(seen.is_ahead, hn::Mul(given, bearing.weight)), sums);
  add(sums.value[27], hn::Mul(given, bearing.loss));

  if (!kHasRanges) return;
  const Vec range_scale = load(arrays, kInverseRangeScale, i);
  const Vec residual =
      hn::Mul(hn::Sub(seen.inverse_range, load(arrays, kInverseRange, i)), range_scale);
  const LossAndWeight range = geman_mcclure_of(hn::Mul(residual, residual), squared_scale);
  const Vec weight = hn::IfThenElseZero(seen.is_ahead, hn::Mul(given, range.weight));
  add_range(seen, weight, residual, range_scale, sums);
  add(sums.value[27], hn::Mul(given, range.loss));
}

template <bool kIsHuber, bool kHasRanges>
void sum_segment(const PoseWorkspace::Arrays& arrays,
                 const PoseSegment& segment,
                 const Rigid3& cam_from_world,
                 double scale_px,
                 double* lanes) {
  const Tag tag;
  const Transform pose = broadcast(cam_from_world);
  for (std::size_t lane = 0; lane < kPoseLanes; lane += hn::Lanes(tag)) {
    Sums sums;
    for (Vec& sum : sums.value) sum = hn::Zero(tag);
    for (std::size_t i = segment.begin; i < segment.end; i += kPoseLanes) {
      add_observations<kIsHuber, kHasRanges>(arrays, i + lane, pose, scale_px, sums);
    }
    for (std::size_t k = 0; k < kNumPoseSums; ++k) {
      hn::StoreU(sums.value[k], tag, lanes + k * kPoseLanes + lane);
    }
  }
}

/// kPoseLanes partial sums for each of the kNumPoseSums.
void sum_lanes(const PoseWorkspace::Arrays& arrays,
               const PoseSegment& segment,
               const Rigid3& cam_from_world,
               const PoseRobust& robust,
               double* lanes) {
  const bool is_huber = robust.loss == PoseLoss::kHuber;
  const auto sum = is_huber
                       ? (segment.has_ranges ? sum_segment<true, true> : sum_segment<true, false>)
                   : segment.has_ranges ? sum_segment<false, true>
                                        : sum_segment<false, false>;
  sum(arrays, segment, cam_from_world, robust.scale_px, lanes);
}

void square_residuals(PoseWorkspace::Arrays& arrays,
                      const PoseSegment& segment,
                      const Rigid3& cam_from_world) {
  const Tag tag;
  const Transform pose = broadcast(cam_from_world);
  for (std::size_t i = segment.begin; i < segment.end; i += hn::Lanes(tag)) {
    hn::StoreU(see(arrays, i, pose).squared_residual, tag, arrays.squared_residual.data() + i);
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace waymark
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace waymark {

HWY_EXPORT(sum_lanes);
HWY_EXPORT(square_residuals);

PoseSums sum_normal_equations(const PoseWorkspace::Arrays& arrays,
                              const PoseSegment& segment,
                              const Rigid3& cam_from_world,
                              const PoseRobust& robust) {
  std::array<double, kNumPoseSums * kPoseLanes> lanes;
  HWY_DYNAMIC_DISPATCH(sum_lanes)(arrays, segment, cam_from_world, robust, lanes.data());
  PoseSums sums;
  for (std::size_t k = 0; k < kNumPoseSums; ++k) {
    sums[k] = 0.0;
    for (std::size_t lane = 0; lane < kPoseLanes; ++lane) sums[k] += lanes[k * kPoseLanes + lane];
  }
  return sums;
}

void compute_squared_residuals(PoseWorkspace::Arrays& arrays,
                               const PoseSegment& segment,
                               const Rigid3& cam_from_world) {
  HWY_DYNAMIC_DISPATCH(square_residuals)(arrays, segment, cam_from_world);
}

}  // namespace waymark
#endif  // HWY_ONCE

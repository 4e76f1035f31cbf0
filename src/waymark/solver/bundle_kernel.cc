// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/solver/bundle_kernel.h"

#include <algorithm>
#include <cmath>

// The sums are arrays of vectors, which vectors without a compile-time size cannot form.
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "waymark/solver/bundle_kernel.cc"
#include <hwy/foreach_target.h>
// After foreach_target.h.
#include <hwy/highway.h>

#include "waymark/solver/bundle_kernel-inl.h"

HWY_BEFORE_NAMESPACE();
namespace waymark {
namespace HWY_NAMESPACE {
namespace {

double sum_losses(const BundleArrays& arrays,
                  const BundlePlaces& places,
                  const BundleLoss& loss,
                  std::size_t begin,
                  std::size_t end) {
  const BundleTag tag;
  alignas(64) double lanes[kBundleLanes] = {};
  for (std::size_t lane = 0; lane < kBundleLanes; lane += hn::Lanes(tag)) {
    BundleVec sum = hn::Zero(tag);
    for (std::size_t block = begin; block < end; block += kBundleLanes) {
      const std::size_t i = block + lane;
      if (i >= end) break;
      const SeenPoint seen = see_point(arrays, places, i);
      const BundleVec gross = hn::Set(tag, kGrossSquaredResidual);
      BundleVec part =
          huber_loss(hn::IfThenElse(seen.is_ahead, seen.squared, gross), loss.huber_px);
      if (arrays.has_ranges) {
        const BundleVec off = range_off(arrays, seen, i);
        const BundleVec of_range = huber_loss(hn::Mul(off, off), loss.range_huber);
        part = hn::Add(part, hn::IfThenElseZero(seen.is_ahead, of_range));
      }
      sum = hn::Add(sum, hn::IfThenElseZero(hn::FirstN(tag, end - i), part));
    }
    hn::StoreU(sum, tag, lanes + lane);
  }
  double total = 0.0;
  for (const double value : lanes) total += value;
  return total;
}

/// RowBlock of residuals of a block of observations with their derivatives, lane by lane in groups
/// of four numbers: by the turn of the pose come behind those by its shift.
struct RowBlock {
  static constexpr std::size_t kGroup = 4 * kBundleLanes;
  alignas(64) double shift[3][kGroup];  // Fourth: residual.
  alignas(64) double turn[3][kGroup];   // 3 numbers, and 0.
  alignas(64) double point[3][kGroup];  // 3 numbers, and 0.
};

HWY_INLINE void store_group(const BundleVec3& a, BundleVec last, double* group) {
  hn::StoreInterleaved4(a.x, a.y, a.z, last, BundleTag(), group);
}

/// by_cam: derivative by the point in the camera.
HWY_INLINE void store_row(const SeenPoint& seen,
                          const BundleVec3& by_cam,
                          BundleVec residual,
                          std::size_t row,
                          std::size_t lane,
                          RowBlock& rows) {
  const BundleVec zero = hn::Zero(BundleTag());
  const BundleVec3 by_rig = times(by_cam, seen.cam_from_rig);
  store_group(by_rig, residual, rows.shift[row] + 4 * lane);
  store_group(cross(seen.in_rig, by_rig), zero, rows.turn[row] + 4 * lane);
  store_group(times(by_rig, seen.rig_from_world), zero, rows.point[row] + 4 * lane);
}

/// The root of the share that counts of the curvature along a residual: see kLinearCurvature.
HWY_INLINE BundleVec bend_of(BundleVec squared, double scale) {
  const BundleTag tag;
  const BundleMask is_linear = hn::Gt(squared, hn::Set(tag, scale * scale));
  const BundleVec root = hn::Set(tag, std::sqrt(kLinearCurvature));
  return hn::IfThenElse(is_linear, root, hn::Set(tag, 1.0));
}

/// The two residuals of a bearing and what they are made with; where the loss is linear, turned to
/// one along the residual, with less curvature and the same gradient, and one across.
struct TurnedResidual {
  BundleVec3 w0, w1;
  BundleVec residual0, residual1;
};

HWY_INLINE BundleVec3 combine(BundleVec a, const BundleVec3& x, BundleVec b, const BundleVec3& y) {
  return {hn::Add(hn::Mul(a, x.x), hn::Mul(b, y.x)),
          hn::Add(hn::Mul(a, x.y), hn::Mul(b, y.y)),
          hn::Add(hn::Mul(a, x.z), hn::Mul(b, y.z))};
}

HWY_INLINE TurnedResidual turn_linear(const SeenPoint& seen, const BundleLoss& loss) {
  const BundleTag tag;
  const BundleVec one = hn::Set(tag, 1.0);
  const BundleMask is_linear = hn::Gt(seen.squared, hn::Set(tag, loss.huber_px * loss.huber_px));
  const BundleVec length = hn::Sqrt(hn::IfThenElse(is_linear, seen.squared, one));
  const BundleVec cosine = hn::IfThenElse(is_linear, hn::Div(seen.residual0, length), one);
  const BundleVec sine = hn::IfThenElseZero(is_linear, hn::Div(seen.residual1, length));
  const BundleVec bend = bend_of(seen.squared, loss.huber_px);
  return {combine(hn::Mul(bend, cosine), seen.w0, hn::Mul(bend, sine), seen.w1),
          combine(hn::Neg(sine), seen.w0, cosine, seen.w1),
          hn::IfThenElse(is_linear, hn::Div(length, bend), seen.residual0),
          hn::IfThenElseZero(hn::Not(is_linear), seen.residual1)};
}

HWY_INLINE void compute_rows(const BundleArrays& arrays,
                             const BundlePlaces& places,
                             const BundleLoss& loss,
                             std::size_t block,
                             RowBlock& rows) {
  const BundleTag tag;
  for (std::size_t lane = 0; lane < kBundleLanes; lane += hn::Lanes(tag)) {
    const std::size_t i = block + lane;
    const SeenPoint seen = see_point(arrays, places, i);
    const BundleVec root =
        hn::IfThenElseZero(seen.is_ahead, huber_root(seen.squared, loss.huber_px));
    const BundleVec weight = hn::Mul(root, seen.inverse_range);
    const auto by_cam = [&](const BundleVec3& w) {
      return scale(subtract(w, scale(seen.direction, dot(w, seen.direction))), weight);
    };
    const TurnedResidual turned = turn_linear(seen, loss);
    store_row(seen, by_cam(turned.w0), hn::Mul(root, turned.residual0), 0, lane, rows);
    store_row(seen, by_cam(turned.w1), hn::Mul(root, turned.residual1), 1, lane, rows);
    if (!arrays.has_ranges) continue;
    const BundleVec off = range_off(arrays, seen, i);
    const BundleVec range_root =
        hn::IfThenElseZero(seen.is_ahead, huber_root(hn::Mul(off, off), loss.range_huber));
    const BundleVec slope =
        hn::Mul(hn::Mul(hn::Mul(seen.inverse_range, seen.inverse_range), range_root),
                hn::LoadU(tag, arrays.fields[kSeenInverseSigma].data() + i));
    const BundleVec bend = bend_of(hn::Mul(off, off), loss.range_huber);
    const BundleVec3 by_range = scale(seen.direction, hn::Neg(hn::Mul(slope, bend)));
    store_row(seen, by_range, hn::Div(hn::Mul(off, range_root), bend), 2, lane, rows);
  }
}

using FourTag = hn::CappedTag<double, 4>;
using FourVec = hn::Vec<FourTag>;
constexpr std::size_t kFourLanes = hn::MaxLanes(FourTag());
constexpr std::size_t kFourVecs = 4 / kFourLanes;

/// Four numbers.
struct Four {
  FourVec v[kFourVecs];
};

HWY_INLINE Four load_four(const double* from) {
  Four four;
  for (std::size_t i = 0; i < kFourVecs; ++i) {
    four.v[i] = hn::LoadU(FourTag(), from + i * kFourLanes);
  }
  return four;
}

HWY_INLINE void store_four(const Four& four, double* to) {
  for (std::size_t i = 0; i < kFourVecs; ++i) hn::StoreU(four.v[i], FourTag(), to + i * kFourLanes);
}

HWY_INLINE void store_three(const Four& four, double* to) {
  const FourTag tag;
  for (std::size_t i = 0; i < kFourVecs; ++i) {
    hn::BlendedStore(four.v[i], hn::FirstN(tag, 3 - i * kFourLanes), tag, to + i * kFourLanes);
  }
}

HWY_INLINE Four plus(const Four& a, const Four& b) {
  Four sum;
  for (std::size_t i = 0; i < kFourVecs; ++i) sum.v[i] = hn::Add(a.v[i], b.v[i]);
  return sum;
}

HWY_INLINE Four zero_four() {
  Four four;
  for (FourVec& v : four.v) v = hn::Zero(FourTag());
  return four;
}

HWY_INLINE void add_product(Four& sum, const Four& a, double b) {
  const FourVec factor = hn::Set(FourTag(), b);
  for (std::size_t i = 0; i < kFourVecs; ++i) {
    sum.v[i] = hn::Add(sum.v[i], hn::Mul(a.v[i], factor));
  }
}

/// 3 x 3 and what belongs to the residual.
struct PointSums {
  Four columns[3];
  Four gradient;
};

/// Pose by point: three columns of shift and turn.
struct LinkSums {
  Four shift[3];
  Four turn[3];
};

template <int kRows>
HWY_INLINE void add_to_point(const RowBlock& rows, std::size_t lane, PointSums& sums) {
  for (int row = 0; row < kRows; ++row) {
    const double* const by = rows.point[row] + 4 * lane;
    const Four by_point = load_four(by);
    for (std::size_t j = 0; j < 3; ++j) add_product(sums.columns[j], by_point, by[j]);
    add_product(sums.gradient, by_point, rows.shift[row][4 * lane + 3]);
  }
}

template <int kRows>
HWY_INLINE void add_to_link(const RowBlock& rows, std::size_t lane, LinkSums& sums) {
  for (int row = 0; row < kRows; ++row) {
    const Four shift = load_four(rows.shift[row] + 4 * lane);
    const Four turn = load_four(rows.turn[row] + 4 * lane);
    for (std::size_t j = 0; j < 3; ++j) {
      const double by_point = rows.point[row][4 * lane + j];
      add_product(sums.shift[j], shift, by_point);
      add_product(sums.turn[j], turn, by_point);
    }
  }
}

/// Columns of the pose: shift, junk, turn, 0. See kPaddedPoseRows.
template <int kRows>
HWY_INLINE void add_to_pose(const RowBlock& rows, std::size_t lane, double* pose) {
  Four shift[kRows], turn[kRows];
  for (int row = 0; row < kRows; ++row) {
    shift[row] = load_four(rows.shift[row] + 4 * lane);
    turn[row] = load_four(rows.turn[row] + 4 * lane);
  }
  for (std::size_t j = 0; j < 7; ++j) {
    double* const column = pose + j * kPaddedPoseRows;
    Four upper = load_four(column);
    Four lower = load_four(column + 4);
    for (int row = 0; row < kRows; ++row) {
      const double by = j < 3   ? rows.shift[row][4 * lane + j]
                        : j < 6 ? rows.turn[row][4 * lane + j - 3]
                                : rows.shift[row][4 * lane + 3];
      add_product(upper, shift[row], by);
      add_product(lower, turn[row], by);
    }
    store_four(upper, column);
    store_four(lower, column + 4);
  }
}

HWY_INLINE void add_to(double* link, const LinkSums& sums) {
  for (std::size_t j = 0; j < 3; ++j) {
    store_three(plus(load_four(link + 6 * j), sums.shift[j]), link + 6 * j);
    store_three(plus(load_four(link + 6 * j + 3), sums.turn[j]), link + 6 * j + 3);
  }
}

HWY_INLINE LinkSums zero_link() {
  LinkSums sums;
  for (Four& four : sums.shift) four = zero_four();
  for (Four& four : sums.turn) four = zero_four();
  return sums;
}

template <int kRows>
HWY_INLINE void sum_equations_of(const BundleArrays& arrays,
                                 const BundlePlaces& places,
                                 const BundleLoss& loss,
                                 const BundleLinks& links,
                                 const BundleSums& sums) {
  RowBlock rows;
  for (std::size_t point = 0; point + 1 < links.first_observation.size(); ++point) {
    PointSums of_point{{zero_four(), zero_four(), zero_four()}, zero_four()};
    LinkSums of_link = zero_link();
    const std::size_t end = links.first_observation[point + 1];
    for (std::size_t k = links.first_observation[point]; k < end; ++k) {
      const std::size_t lane = k % kBundleLanes;
      if (lane == 0) compute_rows(arrays, places, loss, k, rows);
      add_to_point<kRows>(rows, lane, of_point);
      const std::uint32_t link = links.link_of_observation[k];
      if (link == UINT32_MAX) continue;
      add_to_pose<kRows>(rows, lane, sums.poses + kPaddedPoseSize * links.slot_of_link[link]);
      add_to_link<kRows>(rows, lane, of_link);
      // Cameras of one pose follow each other, mostly.
      if (k + 1 < end && links.link_of_observation[k + 1] == link) continue;
      add_to(sums.links + 18 * std::size_t{link}, of_link);
      of_link = zero_link();
    }
    for (std::size_t j = 0; j < 3; ++j) {
      store_three(of_point.columns[j], sums.points + 9 * point + 3 * j);
    }
    store_three(of_point.gradient, sums.point_gradients + 3 * point);
  }
}

void sum_equations(const BundleArrays& arrays,
                   const BundlePlaces& places,
                   const BundleLoss& loss,
                   const BundleLinks& links,
                   const BundleSums& sums) {
  const auto sum = arrays.has_ranges ? &sum_equations_of<3> : &sum_equations_of<2>;
  sum(arrays, places, loss, links, sums);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace waymark
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace waymark {

HWY_EXPORT(sum_losses);
HWY_EXPORT(sum_equations);

double sum_bundle_losses(const BundleArrays& arrays,
                         const BundlePlaces& places,
                         const BundleLoss& loss,
                         std::size_t begin,
                         std::size_t end) {
  return HWY_DYNAMIC_DISPATCH(sum_losses)(arrays, places, loss, begin, end);
}

void sum_bundle_equations(const BundleArrays& arrays,
                          const BundlePlaces& places,
                          const BundleLoss& loss,
                          const BundleLinks& links,
                          const BundleSums& sums) {
  HWY_DYNAMIC_DISPATCH(sum_equations)(arrays, places, loss, links, sums);
}

}  // namespace waymark
#endif  // HWY_ONCE

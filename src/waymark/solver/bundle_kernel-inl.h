// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// What poses see of points, for each target that bundle_kernel.cc is compiled for.
#if defined(WAYMARK_OPTIMIZE_BUNDLE_KERNEL_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef WAYMARK_OPTIMIZE_BUNDLE_KERNEL_INL_H_
#undef WAYMARK_OPTIMIZE_BUNDLE_KERNEL_INL_H_
#else
#define WAYMARK_OPTIMIZE_BUNDLE_KERNEL_INL_H_
#endif

#include <hwy/highway.h>

#include "waymark/solver/bundle_kernel.h"
#include "waymark/solver/residual.h"
#include "waymark/solver/vector3-inl.h"

HWY_BEFORE_NAMESPACE();
namespace waymark {
namespace HWY_NAMESPACE {
namespace {

using BundleTag = hn::CappedTag<double, kBundleLanes>;
using IndexTag = hn::RebindToSigned<BundleTag>;
using BundleVec = hn::Vec<BundleTag>;
using IndexVec = hn::Vec<IndexTag>;
using BundleMask = hn::Mask<BundleTag>;
using BundleVec3 = Vec3Of<BundleVec>;

HWY_INLINE BundleVec3 load_vec3(const BundleArrays& arrays, BundleField first, std::size_t i) {
  const BundleTag tag;
  return {hn::LoadU(tag, arrays.fields[first].data() + i),
          hn::LoadU(tag, arrays.fields[first + 1].data() + i),
          hn::LoadU(tag, arrays.fields[first + 2].data() + i)};
}

HWY_INLINE BundleVec3 gather_vec3(const double* table, IndexVec at, std::int64_t offset) {
  const BundleTag tag;
  return {hn::GatherIndex(tag, table + offset, at),
          hn::GatherIndex(tag, table + offset + 1, at),
          hn::GatherIndex(tag, table + offset + 2, at)};
}

/// A transform of each lane.
struct Transforms {
  BundleVec3 column0, column1, column2, translation;
};

HWY_INLINE Transforms gather_transforms(const double* table, IndexVec at) {
  return {gather_vec3(table, at, 0),
          gather_vec3(table, at, 3),
          gather_vec3(table, at, 6),
          gather_vec3(table, at, 9)};
}

HWY_INLINE BundleVec
move_one(BundleVec a, BundleVec b, BundleVec c, BundleVec d, const BundleVec3& p) {
  return hn::Add(hn::Add(hn::Add(hn::Mul(a, p.x), hn::Mul(b, p.y)), hn::Mul(c, p.z)), d);
}

HWY_INLINE BundleVec3 move(const Transforms& t, const BundleVec3& p) {
  return {move_one(t.column0.x, t.column1.x, t.column2.x, t.translation.x, p),
          move_one(t.column0.y, t.column1.y, t.column2.y, t.translation.y, p),
          move_one(t.column0.z, t.column1.z, t.column2.z, t.translation.z, p)};
}

/// A row vector times the rotation.
HWY_INLINE BundleVec3 times(const BundleVec3& row, const Transforms& t) {
  return {dot(row, t.column0), dot(row, t.column1), dot(row, t.column2)};
}

/// As in residual.h.
struct SeenPoint {
  Transforms rig_from_world, cam_from_rig;
  BundleVec3 in_rig, direction, w0, w1;
  BundleVec inverse_range, residual0, residual1, squared;
  BundleMask is_ahead;
};

HWY_INLINE SeenPoint see_point(const BundleArrays& arrays,
                               const BundlePlaces& places,
                               std::size_t i) {
  const BundleTag tag;
  const IndexTag index_tag;
  const auto place = [&](std::size_t kind) {
    return hn::LoadU(index_tag, arrays.places[kind].data() + i);
  };
  SeenPoint seen;
  seen.rig_from_world = gather_transforms(places.rig_from_world, place(0));
  seen.cam_from_rig = gather_transforms(places.cam_from_rig, place(1));
  seen.in_rig = move(seen.rig_from_world, gather_vec3(places.points, place(2), 0));
  const BundleVec3 in_cam = move(seen.cam_from_rig, seen.in_rig);
  const BundleVec squared_range = hn::Max(dot(in_cam, in_cam), hn::Set(tag, 1e-24));
  seen.inverse_range = hn::Div(hn::Set(tag, 1.0), hn::Sqrt(squared_range));
  seen.direction = scale(in_cam, seen.inverse_range);
  const BundleVec3 bearing = load_vec3(arrays, kSeenBearingX, i);
  seen.is_ahead = hn::Gt(dot(seen.direction, bearing), hn::Zero(tag));
  const BundleVec3 off = subtract(seen.direction, bearing);
  seen.w0 = load_vec3(arrays, kSeenW00, i);
  seen.w1 = load_vec3(arrays, kSeenW10, i);
  seen.residual0 = dot(seen.w0, off);
  seen.residual1 = dot(seen.w1, off);
  seen.squared =
      hn::Add(hn::Mul(seen.residual0, seen.residual0), hn::Mul(seen.residual1, seen.residual1));
  return seen;
}

HWY_INLINE BundleVec range_off(const BundleArrays& arrays, const SeenPoint& seen, std::size_t i) {
  const BundleTag tag;
  const BundleVec measured = hn::LoadU(tag, arrays.fields[kSeenInverseRange].data() + i);
  const BundleVec scale = hn::LoadU(tag, arrays.fields[kSeenInverseSigma].data() + i);
  return hn::Mul(hn::Sub(seen.inverse_range, measured), scale);
}

HWY_INLINE BundleVec huber_loss(BundleVec squared, double scale) {
  const BundleTag tag;
  const BundleVec square = hn::Set(tag, scale * scale);
  const BundleVec residual = hn::Sqrt(hn::Max(squared, square));
  const BundleVec linear = hn::Sub(hn::Mul(hn::Set(tag, 2.0 * scale), residual), square);
  return hn::IfThenElse(hn::Gt(squared, square), linear, squared);
}

/// The root of the weight.
HWY_INLINE BundleVec huber_root(BundleVec squared, double scale) {
  const BundleTag tag;
  const BundleVec square = hn::Set(tag, scale * scale);
  return hn::Sqrt(hn::Div(hn::Set(tag, scale), hn::Sqrt(hn::Max(squared, square))));
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace waymark
HWY_AFTER_NAMESPACE();

#endif  // Per target.

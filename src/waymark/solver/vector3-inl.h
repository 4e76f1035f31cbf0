// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// Three numbers per lane, for each target that a kernel is compiled for.
#if defined(WAYMARK_OPTIMIZE_VEC3_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef WAYMARK_OPTIMIZE_VEC3_INL_H_
#undef WAYMARK_OPTIMIZE_VEC3_INL_H_
#else
#define WAYMARK_OPTIMIZE_VEC3_INL_H_
#endif

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace waymark {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

template <class V>
struct Vec3Of {
  V x, y, z;
};

template <class V>
HWY_INLINE V dot(const Vec3Of<V>& a, const Vec3Of<V>& b) {
  return hn::Add(hn::Add(hn::Mul(a.x, b.x), hn::Mul(a.y, b.y)), hn::Mul(a.z, b.z));
}

template <class V>
HWY_INLINE Vec3Of<V> scale(const Vec3Of<V>& a, V factor) {
  return {hn::Mul(a.x, factor), hn::Mul(a.y, factor), hn::Mul(a.z, factor)};
}

template <class V>
HWY_INLINE Vec3Of<V> subtract(const Vec3Of<V>& a, const Vec3Of<V>& b) {
  return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
}

template <class V>
HWY_INLINE Vec3Of<V> cross(const Vec3Of<V>& a, const Vec3Of<V>& b) {
  return {hn::Sub(hn::Mul(a.y, b.z), hn::Mul(a.z, b.y)),
          hn::Sub(hn::Mul(a.z, b.x), hn::Mul(a.x, b.z)),
          hn::Sub(hn::Mul(a.x, b.y), hn::Mul(a.y, b.x))};
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace waymark
HWY_AFTER_NAMESPACE();

#endif  // Per target.

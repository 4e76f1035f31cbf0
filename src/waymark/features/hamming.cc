// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/features/hamming.h"

#include <bit>

#include "waymark/base/check.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "waymark/features/hamming.cc"
#include <hwy/foreach_target.h>
// After foreach_target.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace waymark {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

// Four words in registers beat a vector: a candidate is only 256 bits. What dispatch brings is the
// population count instruction, which the baseline of x86-64 lacks.
HWY_INLINE std::uint16_t count_different(const Descriptor& a, const Descriptor& b) {
#if HWY_ARCH_X86
  int count = 0;
  for (std::size_t i = 0; i < a.size(); ++i) count += std::popcount(a[i] ^ b[i]);
  return static_cast<std::uint16_t>(count);
#else
  const hn::CappedTag<std::uint64_t, 4> d;
  auto count = hn::Zero(d);
  for (std::size_t i = 0; i < a.size(); i += hn::Lanes(d)) {
    const auto different = hn::Xor(hn::LoadU(d, a.data() + i), hn::LoadU(d, b.data() + i));
    count = hn::Add(count, hn::PopulationCount(different));
  }
  return static_cast<std::uint16_t>(hn::GetLane(hn::SumOfLanes(d, count)));
#endif
}

void distances_to_candidates(const Descriptor& query,
                             const Descriptor* all,
                             std::span<const std::uint32_t> candidates,
                             std::uint16_t* out) {
  const Descriptor local = query;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    out[i] = count_different(local, all[candidates[i]]);
  }
}

void distances_to_all(const Descriptor& query,
                      std::span<const Descriptor> all,
                      std::uint16_t* out) {
  const Descriptor local = query;
  for (std::size_t i = 0; i < all.size(); ++i) out[i] = count_different(local, all[i]);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace waymark
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace waymark {

HWY_EXPORT(distances_to_candidates);
HWY_EXPORT(distances_to_all);

void distances(const Descriptor& query,
               std::span<const Descriptor> all,
               std::span<const std::uint32_t> candidates,
               std::span<std::uint16_t> out) {
  WAYMARK_CHECK(out.size() == candidates.size());
  HWY_DYNAMIC_DISPATCH(distances_to_candidates)(query, all.data(), candidates, out.data());
}

void distances(const Descriptor& query,
               std::span<const Descriptor> all,
               std::span<std::uint16_t> out) {
  WAYMARK_CHECK(out.size() == all.size());
  HWY_DYNAMIC_DISPATCH(distances_to_all)(query, all, out.data());
}

}  // namespace waymark
#endif

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/solver/panel_kernel.h"

// The sums are arrays of vectors, which vectors without a compile-time size cannot form.
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "waymark/solver/panel_kernel.cc"
#include <hwy/foreach_target.h>
// After foreach_target.h.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace waymark {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using PanelTag = hn::CappedTag<double, 8>;
using PanelVec = hn::Vec<PanelTag>;
constexpr std::size_t kPanelLanes = hn::MaxLanes(PanelTag());
/// Sums that stay in registers: six columns of so many vectors.
constexpr std::size_t kVectorsAtOnce = kPanelLanes == 8 ? 3 : 2;
static_assert(kStripRows % (kVectorsAtOnce * kPanelLanes) == 0);

HWY_INLINE PanelVec subtract_product(PanelVec sum, PanelVec a, PanelVec b) {
  return hn::Sub(sum, hn::Mul(a, b));  // Not fused, see the header.
}

void strip_product(const double* HWY_RESTRICT strip,
                   const double* HWY_RESTRICT rows,
                   std::size_t num_columns,
                   double* HWY_RESTRICT target) {
  const PanelTag tag;
  for (std::size_t first = 0; first < kStripRows; first += kVectorsAtOnce * kPanelLanes) {
    PanelVec sums[kBlockRows][kVectorsAtOnce];
    for (std::size_t j = 0; j < kBlockRows; ++j) {
      for (std::size_t v = 0; v < kVectorsAtOnce; ++v) {
        sums[j][v] = hn::LoadU(tag, target + j * kStripRows + first + v * kPanelLanes);
      }
    }
    for (std::size_t column = 0; column < num_columns; ++column) {
      PanelVec a[kVectorsAtOnce];
      for (std::size_t v = 0; v < kVectorsAtOnce; ++v) {
        a[v] = hn::LoadU(tag, strip + column * kStripRows + first + v * kPanelLanes);
      }
      for (std::size_t j = 0; j < kBlockRows; ++j) {
        const PanelVec b = hn::Set(tag, rows[column * kStripRows + j]);
        for (std::size_t v = 0; v < kVectorsAtOnce; ++v) {
          sums[j][v] = subtract_product(sums[j][v], a[v], b);
        }
      }
    }
    for (std::size_t j = 0; j < kBlockRows; ++j) {
      for (std::size_t v = 0; v < kVectorsAtOnce; ++v) {
        hn::StoreU(sums[j][v], tag, target + j * kStripRows + first + v * kPanelLanes);
      }
    }
  }
}

void solve_columns(const double* HWY_RESTRICT lower, double* HWY_RESTRICT strip) {
  const PanelTag tag;
  for (std::size_t first = 0; first < kStripRows; first += kPanelLanes) {
    PanelVec x[kBlockRows];
    for (std::size_t j = 0; j < kBlockRows; ++j) {
      x[j] = hn::LoadU(tag, strip + j * kStripRows + first);
      for (std::size_t i = 0; i < j; ++i) {
        x[j] = subtract_product(x[j], x[i], hn::Set(tag, lower[i * kBlockRows + j]));
      }
      x[j] = hn::Div(x[j], hn::Set(tag, lower[j * kBlockRows + j]));
      hn::StoreU(x[j], tag, strip + j * kStripRows + first);
    }
  }
}

void point_products(const double* HWY_RESTRICT blocks,
                    std::span<const std::uint32_t> at,
                    double* HWY_RESTRICT sums) {
  const PanelTag tag;
  constexpr std::size_t kVectors = (kBlockRows + kPanelLanes - 1) / kPanelLanes;
  constexpr std::size_t kBlockSize = 3 * kBlockRows;
  for (std::size_t i = 0; i < at.size(); ++i) {
    PanelVec a[3][kVectors];
    for (std::size_t k = 0; k < 3; ++k) {
      for (std::size_t v = 0; v < kVectors; ++v) {
        a[k][v] = hn::LoadU(tag, blocks + i * kBlockSize + k * kBlockRows + v * kPanelLanes);
      }
    }
    double* const block = sums + kBlockRows * kPaddedBlockRows * at[i];
    for (std::size_t j = 0; j < kBlockRows; ++j) {
      for (std::size_t v = 0; v < kVectors; ++v) {
        double* const entry = block + j * kPaddedBlockRows + v * kPanelLanes;
        PanelVec sum = hn::LoadU(tag, entry);
        for (std::size_t k = 0; k < 3; ++k) {
          sum = subtract_product(sum, a[k][v], hn::Set(tag, blocks[k * kBlockRows + j]));
        }
        hn::StoreU(sum, tag, entry);
      }
    }
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace waymark
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace waymark {

HWY_EXPORT(strip_product);
HWY_EXPORT(solve_columns);
HWY_EXPORT(point_products);

void subtract_strip_product(const double* strip,
                            const double* rows,
                            std::size_t num_columns,
                            double* target) {
  HWY_DYNAMIC_DISPATCH(strip_product)(strip, rows, num_columns, target);
}

void solve_strip(const double* lower, double* strip) {
  HWY_DYNAMIC_DISPATCH(solve_columns)(lower, strip);
}

void subtract_point_products(const double* blocks,
                             std::span<const std::uint32_t> at,
                             double* sums) {
  HWY_DYNAMIC_DISPATCH(point_products)(blocks, at, sums);
}

}  // namespace waymark
#endif  // HWY_ONCE

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace waymark {

/// Rows of a panel of a block Cholesky factor lie in strips of four blocks, each column by column:
/// entry (row, column) of a strip is at column * kStripRows + row. Four blocks are whole vectors of
/// 2, 4 and 8 lanes.
inline constexpr std::size_t kBlockRows = 6;
inline constexpr std::size_t kStripBlocks = 4;
inline constexpr std::size_t kStripRows = kStripBlocks * kBlockRows;

/// target -= strip * rows^T, where `strip` has num_columns columns, `rows` are 6 rows within a
/// strip of as many, and `target` is 6 columns of a strip. Each entry is one sum by ascending
/// column, without fused operations: the same bits with any vectors.
void subtract_strip_product(const double* strip,
                            const double* rows,
                            std::size_t num_columns,
                            double* target);

/// Solves x * lower^T = strip for 6 columns of a strip, in place. lower: 6 x 6, by columns, of
/// which the lower triangle is read.
void solve_strip(const double* lower, double* strip);

/// Rows of what PointProducts sums up.
inline constexpr std::size_t kPaddedBlockRows = 8;

/// Subtracts from 6 x 6 blocks, each kept in 8 rows of which the last two are junk, the products of
/// the 6 x 3 blocks of a point with the first of these, transposed: sums[6 * 8 * at[i]] -=
/// blocks[i]
/// * blocks[0]^T. blocks: one behind the other by columns; two entries behind the last are read.
void subtract_point_products(const double* blocks, std::span<const std::uint32_t> at, double* sums);

}  // namespace waymark

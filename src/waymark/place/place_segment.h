// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <memory_resource>
#include <span>
#include <vector>

#include "waymark/base/id.h"
#include "waymark/features/features.h"

namespace waymark {

/// Each descriptor is filed in so many tables, each by other bits of it.
inline constexpr std::size_t kNumPlaceTables = 4;
inline constexpr int kPlaceKeyBits = 48;

/// A sample of the bits of a descriptor in a random order. Descriptors that differ little are
/// likely to agree in a long prefix of it (Indyk and Motwani 1998; Bawa, Condie and Ganesan 2005),
/// and the number of its bits that differ tells how near they are.
using PlaceKey = std::uint64_t;

/// One key per table; no two share a bit of the descriptor. The choice of bits is fixed.
std::array<PlaceKey, kNumPlaceTables> place_keys(const Descriptor& descriptor);

/// A keyframe as the place index knows it.
struct PlaceRow {
  KeyframeId keyframe;
  SubmapId submap;
};

/// An entry of a table against a key: the bits that differ in the upper kPlaceKeyBits, below them
/// the row of the entry in its segment. The longer the common prefix, the less it is as a number.
using PlaceDifference = std::uint64_t;
inline constexpr int kPlaceRowBits = 64 - kPlaceKeyBits;
inline constexpr PlaceDifference kPlaceRowMask = (PlaceDifference{1} << kPlaceRowBits) - 1;

/// The descriptors of consecutive keyframes, sorted by their keys. Never changes once made: two
/// segments are merged to a new one, in time linear in their size.
///
/// A table is an array of entries in ascending order, the key of a descriptor in the upper bits of
/// each, the row of its keyframe in the lower. It is a prefix tree without nodes (Bawa, Condie and
/// Ganesan 2005, LSH forest): what surrounds the place of a key is what shares the longest prefixes
/// with it, however many descriptors there are.
class PlaceSegment {
 public:
  /// Bounds the pause of a merge, to 1.1 s at 1000 features. Queries take longer the more segments
  /// there are.
  static constexpr std::size_t kMaxRows = 16384;
  /// More descriptors of a keyframe are thinned evenly, which bounds memory and time.
  static constexpr std::size_t kMaxDescriptors = 2048;
  static constexpr std::size_t kMaxWindow = 32;

  using Window = std::array<PlaceDifference, kMaxWindow>;

  /// Of no keyframe.
  PlaceSegment() : tables_(kNumPlaceTables) {}

  PlaceSegment(const PlaceRow& row, std::span<const Descriptor> descriptors);

  /// The rows of a, then those of b, which are younger, without those that are gone. The tables lie
  /// in memory; null: on the heap.
  PlaceSegment(const PlaceSegment& a,
               const PlaceSegment& b,
               const std::function<bool(KeyframeId)>& is_gone,
               std::shared_ptr<std::pmr::memory_resource> memory = nullptr);

  /// Ascending by keyframe.
  std::span<const PlaceRow> rows() const { return rows_; }

  /// Writes the entries around the place of a key, in the order of the table, at most window of
  /// them; gives their number.
  std::size_t look_around(std::size_t table,
                          PlaceKey key,
                          std::size_t window,
                          Window& differences) const;

  /// Has the processor fetch what look_around() will read, in two steps some time ahead of it: the
  /// tables are large and read all over, so that a look is mostly waiting for memory.
  void fetch_directory(std::size_t table, PlaceKey key) const { tables_[table].fetch_place(key); }
  void fetch_entries(std::size_t table, PlaceKey key, std::size_t window) const {
    tables_[table].fetch_around(key, window);
  }

  std::size_t num_bytes() const;

 private:
  struct Table {
    Table() = default;
    /// The directory lies where the entries do.
    explicit Table(std::pmr::vector<std::uint64_t> ascending);

    std::pmr::vector<std::uint64_t> entries;
    /// Where the entries of each prefix of directory_bits begin, and where the last one's end.
    std::pmr::vector<std::uint32_t> directory = {0, 0};
    int directory_bits = 0;

    void index();
    std::size_t prefix_of(std::uint64_t entry) const {
      return directory_bits == 0 ? 0 : entry >> (64 - directory_bits);
    }
    std::size_t lower_bound(std::uint64_t entry) const;
    void fetch_place(PlaceKey key) const;
    void fetch_around(PlaceKey key, std::size_t window) const;
  };

  std::shared_ptr<std::pmr::memory_resource> memory_;  ///< Of the tables; null: the heap.
  std::vector<PlaceRow> rows_;
  std::vector<Table> tables_;  ///< kNumPlaceTables.
};

/// Every k-th descriptor where there are more than a segment takes.
std::vector<Descriptor> thin_descriptors(std::span<const Descriptor> descriptors);

/// How much of a query each row of the segments shows, 0 to 1, one value per row in order.
///
/// Each descriptor looks in each table at some 32 descriptors of all segments that share the
/// longest prefixes with its key, as in the synchronous descent of Bawa, Condie and Ganesan (2005):
/// which they are does not depend on how the rows are distributed over segments. Those whose keys
/// differ little from its own are votes for their rows, one per descriptor and row. A vote weighs
/// more the fewer rows share it, as in the inverse document frequency of text retrieval (Sparck
/// Jones 1972); 1 means that every descriptor voted for this row alone.
std::vector<double> vote_for_places(std::span<const std::shared_ptr<const PlaceSegment>> segments,
                                    std::span<const Descriptor> descriptors);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "waymark/base/check.h"

namespace waymark {

/// Ordered table from Id to T whose copies are cheap: a table and its frozen copies share pages,
/// and the writer clones a page the first time it edits it after freezing.
///
/// Invariant: a page with the stamp of a table belongs to that table alone.
/// Thread safety: a frozen table is for any number of readers; a live table has one writer.
template <class Key, class T, std::size_t kPageSize = 64>
class CowTable {
 public:
  CowTable() = default;
  /// Takes the pages over; what is left of the other may only be assigned to or destroyed.
  CowTable(CowTable&&) noexcept = default;
  CowTable& operator=(CowTable&&) noexcept = default;  ///< As the constructor.

  /// Copy that shares every page with this table and never changes. O(pages).
  CowTable freeze() {
    ++stamp_;  // From now on no page belongs to this table or to the copy, so that edits clone.
    has_own_pages_ = false;
    return CowTable(*this);
  }

  /// Editable table that starts as a frozen one, which stays valid and unchanged.
  static CowTable thaw(const CowTable& frozen) {
    WAYMARK_CHECK(!frozen.has_own_pages_);
    return CowTable(frozen);
  }

  /// Number of elements.
  std::size_t size() const { return size_; }
  /// Whether there is no element.
  bool is_empty() const { return size_ == 0; }

  /// One past the largest id ever given; every id of the table is below.
  Key end_id() const { return Key{next_}; }

  /// Whether there is an element with this id.
  bool contains(Key id) const { return find(id) != nullptr; }

  /// The element, or nullptr. Valid until the table is edited or destroyed.
  const T* find(Key id) const {
    const std::size_t page = id.value / kPageSize;
    if (page >= pages_.size() || !pages_[page]) return nullptr;
    const std::optional<T>& slot = pages_[page]->slots[id.value % kPageSize];
    return slot ? &*slot : nullptr;
  }

  /// The element, which must exist.
  const T& at(Key id) const {
    const T* value = find(id);
    WAYMARK_CHECK(value != nullptr);
    return *value;
  }

  /// Mutable access to an element, which must exist. The reference is valid until the next
  /// freeze(), or until the element is erased.
  T& edit(Key id) {
    WAYMARK_CHECK(contains(id));
    return *own(id.value / kPageSize).slots[id.value % kPageSize];
  }

  /// Adds an element under a new id. Ids ascend and are never used again, so that the id of an
  /// erased element finds nothing rather than something else.
  Key insert(T value) {
    WAYMARK_CHECK(next_ != UINT32_MAX);
    const Key id{next_};
    own(id.value / kPageSize).slots[id.value % kPageSize].emplace(std::move(value));
    ++next_;
    ++size_;
    return id;
  }

  /// Makes `id`, which is not below end_id(), the next one that insert() gives: ids in between were
  /// used by elements that are gone. For readers of files.
  void skip_to(Key id) {
    WAYMARK_CHECK(id.value >= next_);
    next_ = id.value;
  }

  /// Removes an element; false if there is none.
  bool erase(Key id) {
    if (!contains(id)) return false;
    own(id.value / kPageSize).slots[id.value % kPageSize].reset();
    --size_;
    return true;
  }

  /// Calls visit(id, element) in ascending order of ids, which makes every algorithm on top
  /// repeatable. The table must not be edited meanwhile.
  template <class Visitor>
  void for_each(Visitor&& visit) const {
    for (std::size_t page = 0; page < pages_.size(); ++page) {
      if (!pages_[page]) continue;
      for (std::size_t i = 0; i < kPageSize; ++i) {
        if (const std::optional<T>& slot = pages_[page]->slots[i]) {
          visit(Key{static_cast<std::uint32_t>(page * kPageSize + i)}, *slot);
        }
      }
    }
  }

  /// Calls visit(id, before, now) in ascending order for the ids in all pages that this table does
  /// not share with an earlier state of itself: whatever changed since is among them. Pointers are
  /// null where there was or is no element.
  template <class Visitor>
  void for_each_difference(const CowTable& earlier, Visitor&& visit) const {
    for (std::size_t page = 0; page < std::max(pages_.size(), earlier.pages_.size()); ++page) {
      const Page* now = page < pages_.size() ? pages_[page].get() : nullptr;
      const Page* before = page < earlier.pages_.size() ? earlier.pages_[page].get() : nullptr;
      if (now == before) continue;
      for (std::size_t i = 0; i < kPageSize; ++i) {
        const T* old = before && before->slots[i] ? &*before->slots[i] : nullptr;
        const T* current = now && now->slots[i] ? &*now->slots[i] : nullptr;
        if (old || current) {
          visit(Key{static_cast<std::uint32_t>(page * kPageSize + i)}, old, current);
        }
      }
    }
  }

 private:
  struct Page {
    std::uint64_t stamp = 0;
    std::array<std::optional<T>, kPageSize> slots;
  };

  CowTable(const CowTable&) = default;

  Page& own(std::size_t index) {
    if (index >= pages_.size()) pages_.resize(index + 1);
    std::shared_ptr<Page>& page = pages_[index];
    if (page && page->stamp == stamp_) return *page;
    page = page ? std::make_shared<Page>(*page) : std::make_shared<Page>();
    page->stamp = stamp_;
    has_own_pages_ = true;
    return *page;
  }

  std::vector<std::shared_ptr<Page>> pages_;
  std::uint64_t stamp_ = 0;
  std::uint32_t next_ = 0;
  std::size_t size_ = 0;
  bool has_own_pages_ = false;
};

}  // namespace waymark

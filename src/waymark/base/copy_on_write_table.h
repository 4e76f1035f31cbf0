// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "waymark/base/check.h"

namespace waymark {

/// Ordered table from Id to T whose copies are cheap: a table and its frozen copies share pages,
/// and the writer clones a page the first time it edits it after freezing. Pages stand on shelves
/// that are shared and cloned in the same way, so that a copy is a pointer for each few thousand
/// ids. Its memory follows what it holds: a page has room for what lives, and none is left where
/// nothing does, nor are shelves.
///
/// Invariant: a page, or shelf, with the stamp of a table belongs to that table alone.
/// Thread safety: a frozen table is for any number of readers; a live table has one writer.
template <class Key, class T, std::size_t kPageSize = 64, std::size_t kShelfSize = 64>
class CopyOnWriteTable {
 public:
  CopyOnWriteTable() = default;
  /// Takes the pages over; what is left of the other may only be assigned to or destroyed.
  CopyOnWriteTable(CopyOnWriteTable&&) noexcept = default;
  CopyOnWriteTable& operator=(CopyOnWriteTable&&) noexcept = default;  ///< As the constructor.

  /// Copy that shares every page with this table and never changes. O(shelves).
  CopyOnWriteTable freeze() {
    for (const std::size_t index : own_pages_) {
      if (Page* const page = page_at(index)) page->tighten();
    }
    own_pages_.clear();
    ++stamp_;  // From now on no page belongs to this table or to the copy, so that edits clone.
    return CopyOnWriteTable(*this);
  }

  /// Editable table that starts as a frozen one, which stays valid and unchanged.
  static CopyOnWriteTable thaw(const CopyOnWriteTable& frozen) {
    WAYMARK_CHECK(frozen.own_pages_.empty());
    return CopyOnWriteTable(frozen);
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
    const Page* const page = page_at(id.value / kPageSize);
    return page ? page->find(id.value % kPageSize) : nullptr;
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
    return *own(id.value / kPageSize).find(id.value % kPageSize);
  }

  /// Adds an element under a new id. Ids ascend and are never used again, so that the id of an
  /// erased element finds nothing rather than something else.
  Key insert(T value) {
    WAYMARK_CHECK(next_ != UINT32_MAX);
    const Key id{next_};
    own(id.value / kPageSize).add(id.value % kPageSize, std::move(value));
    ++next_;
    ++size_;
    return id;
  }

  /// Adds an element under an id that has none. References to others of its page may end.
  void put(Key id, T value) {
    WAYMARK_CHECK(id.value != UINT32_MAX && !contains(id));
    own(id.value / kPageSize).add(id.value % kPageSize, std::move(value));
    next_ = std::max(next_, id.value + 1);
    ++size_;
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
    const std::size_t page = id.value / kPageSize;
    if (page_at(page)->num_living > 1) {
      own(page).erase(id.value % kPageSize);
    } else {
      drop_page(page);
    }
    --size_;
    return true;
  }

  /// Calls visit(id, element) in ascending order of ids, which makes every algorithm on top
  /// repeatable. The table must not be edited meanwhile.
  template <class Visitor>
  void for_each(Visitor&& visit) const {
    for (std::size_t shelf = 0; shelf < shelves_.size(); ++shelf) {
      if (!shelves_[shelf]) continue;
      for (std::size_t i = 0; i < kShelfSize; ++i) {
        const Page* const page = shelves_[shelf]->pages[i].get();
        if (!page) continue;
        const std::size_t first = (shelf * kShelfSize + i) * kPageSize;
        for (std::size_t k = 0; k < kPageSize; ++k) {
          const T* const element = page->find(k);
          if (element) visit(Key{static_cast<std::uint32_t>(first + k)}, *element);
        }
      }
    }
  }

  /// Calls visit(id, before, now) in ascending order for the ids in all pages that this table does
  /// not share with an earlier state of itself: whatever changed since is among them. Pointers are
  /// null where there was or is no element.
  template <class Visitor>
  void for_each_difference(const CopyOnWriteTable& earlier, Visitor&& visit) const {
    const std::size_t num_shelves = std::max(shelves_.size(), earlier.shelves_.size());
    for (std::size_t shelf = 0; shelf < num_shelves; ++shelf) {
      if (shelf_at(shelf) == earlier.shelf_at(shelf)) continue;
      for (std::size_t i = 0; i < kShelfSize; ++i) {
        const std::size_t page = shelf * kShelfSize + i;
        visit_difference(page, earlier.page_at(page), page_at(page), visit);
      }
    }
  }

 private:
  static_assert(kPageSize < UINT8_MAX);
  static constexpr std::uint8_t kNone = UINT8_MAX;

  /// Elements in the order in which they came; those erased keep their place until the page is
  /// copied, so that references to the others last.
  struct Page {
    Page() { places.fill(kNone); }

    const T* find(std::size_t slot) const {
      return places[slot] == kNone ? nullptr : elements.data() + places[slot];
    }
    T* find(std::size_t slot) {
      return places[slot] == kNone ? nullptr : elements.data() + places[slot];
    }
    void add(std::size_t slot, T value) {
      if (elements.size() == kPageSize) tighten();
      places[slot] = static_cast<std::uint8_t>(elements.size());
      elements.push_back(std::move(value));
      ++num_living;
    }
    void erase(std::size_t slot) {
      places[slot] = kNone;
      --num_living;
    }
    /// Leaves room for what lives only.
    void tighten() {
      if (elements.capacity() == num_living) return;
      std::vector<T> living;
      living.reserve(num_living);
      for (std::uint8_t& place : places) {
        if (place == kNone) continue;
        living.push_back(std::move(elements[place]));
        place = static_cast<std::uint8_t>(living.size() - 1);
      }
      elements = std::move(living);
    }

    std::uint64_t stamp = 0;
    std::size_t num_living = 0;
    std::array<std::uint8_t, kPageSize> places;  ///< Of a slot's element, kNone where none lives.
    std::vector<T> elements;
  };

  struct Shelf {
    std::uint64_t stamp = 0;
    std::size_t num_pages = 0;
    std::array<std::shared_ptr<Page>, kShelfSize> pages;
  };

  CopyOnWriteTable(const CopyOnWriteTable&) = default;

  const Shelf* shelf_at(std::size_t shelf) const {
    return shelf < shelves_.size() ? shelves_[shelf].get() : nullptr;
  }
  Page* page_at(std::size_t index) const {
    const Shelf* const shelf = shelf_at(index / kShelfSize);
    return shelf ? shelf->pages[index % kShelfSize].get() : nullptr;
  }

  template <class Visitor>
  static void visit_difference(std::size_t index,
                               const Page* before,
                               const Page* now,
                               Visitor&& visit) {
    if (now == before) return;
    for (std::size_t i = 0; i < kPageSize; ++i) {
      const T* const old = before ? before->find(i) : nullptr;
      const T* const current = now ? now->find(i) : nullptr;
      if (old || current) {
        visit(Key{static_cast<std::uint32_t>(index * kPageSize + i)}, old, current);
      }
    }
  }

  Shelf& own_shelf(std::size_t index) {
    if (index >= shelves_.size()) shelves_.resize(index + 1);
    std::shared_ptr<Shelf>& shelf = shelves_[index];
    if (shelf && shelf->stamp == stamp_) return *shelf;
    shelf = shelf ? std::make_shared<Shelf>(*shelf) : std::make_shared<Shelf>();
    shelf->stamp = stamp_;
    return *shelf;
  }

  void drop_page(std::size_t index) {
    Shelf& shelf = own_shelf(index / kShelfSize);
    shelf.pages[index % kShelfSize].reset();
    if (--shelf.num_pages == 0) shelves_[index / kShelfSize].reset();
  }

  Page& own(std::size_t index) {
    Shelf& shelf = own_shelf(index / kShelfSize);
    std::shared_ptr<Page>& page = shelf.pages[index % kShelfSize];
    if (page && page->stamp == stamp_) return *page;
    if (!page) ++shelf.num_pages;
    const std::shared_ptr<const Page> shared = std::exchange(page, std::make_shared<Page>());
    page->stamp = stamp_;
    // What insert() adds must not move what is there, to which there may be references.
    const bool grows = index == next_ / kPageSize;
    page->elements.reserve(grows ? kPageSize : shared ? shared->num_living : 1);
    for (std::size_t slot = 0; shared && slot < kPageSize; ++slot) {
      if (const T* element = std::as_const(*shared).find(slot)) page->add(slot, *element);
    }
    own_pages_.push_back(index);
    return *page;
  }

  std::vector<std::shared_ptr<Shelf>> shelves_;
  std::vector<std::size_t> own_pages_;  ///< With the stamp of now.
  std::uint64_t stamp_ = 0;
  std::uint32_t next_ = 0;
  std::size_t size_ = 0;
};

}  // namespace waymark

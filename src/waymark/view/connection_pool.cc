// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/view/connection_pool.h"

#include <algorithm>
#include <utility>

#include "waymark/base/check.h"

namespace waymark {

ConnectionPool::ConnectionPool(std::size_t capacity) : capacity_(capacity) {
  WAYMARK_CHECK(capacity > 0);
}

std::uint64_t ConnectionPool::add(const Address& peer, std::function<void()> close) {
  if (entries_.size() >= capacity_) {
    const auto leaving = entries_.extract(most_dispensable());
    leaving.mapped().close();
  }
  const std::uint64_t number = ++counter_;
  entries_.emplace(number, Entry{peer, std::move(close), number});
  return number;
}

void ConnectionPool::renew(std::uint64_t number) {
  const auto found = entries_.find(number);
  if (found != entries_.end()) found->second.last_asked = ++counter_;
}

void ConnectionPool::remove(std::uint64_t number) { entries_.erase(number); }

ConnectionPool::Entries::iterator ConnectionPool::most_dispensable() {
  std::map<Address, std::size_t> num_held;
  for (const auto& [number, entry] : entries_) ++num_held[entry.peer];
  return std::ranges::min_element(entries_, [&](const auto& a, const auto& b) {
    const std::size_t held_a = num_held.at(a.second.peer), held_b = num_held.at(b.second.peer);
    return held_a != held_b ? held_a > held_b : a.second.last_asked < b.second.last_asked;
  });
}

}  // namespace waymark

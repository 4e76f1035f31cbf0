// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <boost/asio/ip/address.hpp>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>

namespace waymark {

/// The connections that are no viewer's, or not yet. Bounded, and still open to whoever comes:
/// nobody keeps others out by holding connections.
class ConnectionPool {
 public:
  using Address = boost::asio::ip::address;

  /// Room for so many connections, at least one.
  explicit ConnectionPool(std::size_t capacity);

  /// Takes in a connection from a peer; its number. For one too many, that of the address with most
  /// of them goes which has asked for nothing for the longest time: its `close` is called.
  std::uint64_t add(const Address& peer, std::function<void()> close);
  /// It has asked for something.
  void renew(std::uint64_t number);
  /// It is gone, or a viewer's now; nothing if it was closed before.
  void remove(std::uint64_t number);

 private:
  struct Entry {
    Address peer;
    std::function<void()> close;
    std::uint64_t last_asked = 0;  ///< Counts up with each addition and renewal.
  };
  using Entries = std::map<std::uint64_t, Entry>;

  Entries::iterator most_dispensable();

  const std::size_t capacity_;
  Entries entries_;
  std::uint64_t counter_ = 0;
};

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <cstdint>
#include <memory>
#include <string>

#include "waymark/view/hub.h"

namespace waymark {

/// A viewer's connection. Lives as long as an operation on it is under way.
class WebSocketClient : public ViewClient, public std::enable_shared_from_this<WebSocketClient> {
 public:
  using Request = boost::beast::http::request<boost::beast::http::empty_body>;

  /// on_end: called once, when the client is gone.
  WebSocketClient(boost::beast::tcp_stream stream, ViewHub& hub, std::function<void()> on_end);
  ~WebSocketClient() override;

  void accept(const Request& request);
  void send() override;
  void close() override;

 private:
  void read();
  void receive(std::size_t num_bytes);
  void finish_write(const boost::beast::error_code& error);
  void leave();

  boost::beast::websocket::stream<boost::beast::tcp_stream> stream_;
  ViewHub& hub_;
  const std::function<void()> on_end_;
  boost::beast::flat_buffer incoming_;
  Outbox::Outgoing outgoing_;  ///< Under way.
  std::uint64_t number_ = 0;   ///< Given by the hub; 0: not there.
  bool is_open_ = false;
  bool is_sending_ = false;
  bool is_closing_ = false;
};

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <cstdint>
#include <memory>
#include <optional>

#include "waymark/view/access.h"
#include "waymark/view/connection_pool.h"
#include "waymark/view/hub.h"

namespace waymark {

using HttpRequest = boost::beast::http::request<boost::beast::http::empty_body>;

/// What connections share; lives in the viewer's thread.
struct ServerState {
  AccessRules rules;
  ViewHub& hub;
  ConnectionPool connections;  ///< Those that are no viewers'.
  int num_viewers = 0;         ///< WebSockets.
};

/// A viewer's connection. Lives as long as an operation on it is under way.
class WebSocketClient : public ViewClient, public std::enable_shared_from_this<WebSocketClient> {
 public:
  /// Counts among the viewers of the state.
  WebSocketClient(boost::beast::tcp_stream stream, ServerState& state);
  ~WebSocketClient() override;
  WebSocketClient(const WebSocketClient&) = delete;
  WebSocketClient& operator=(const WebSocketClient&) = delete;

  void accept(const HttpRequest& request);
  void send() override;
  void close() override;

 private:
  void read();
  void finish_write(const boost::beast::error_code& error);
  void leave();

  boost::beast::websocket::stream<boost::beast::tcp_stream> stream_;
  ServerState& state_;
  boost::beast::flat_buffer incoming_;
  Outbox::Outgoing outgoing_;  ///< Under way.
  std::uint64_t number_ = 0;   ///< Given by the hub; 0: not there.
  bool is_open_ = false;
  bool is_sending_ = false;
  bool is_closing_ = false;
};

/// Serves the page to one browser's connection, until that becomes a WebSocket. Lives as long as an
/// operation on it is under way.
class HttpConnection : public std::enable_shared_from_this<HttpConnection> {
 public:
  /// One of the connections of the state, until it becomes a WebSocket.
  HttpConnection(boost::beast::tcp_stream stream, ServerState& state);
  ~HttpConnection();
  HttpConnection(const HttpConnection&) = delete;
  HttpConnection& operator=(const HttpConnection&) = delete;

  void read();

 private:
  using Response = boost::beast::http::response<boost::beast::http::string_body>;

  void answer(const HttpRequest& request);
  Response respond_to(const HttpRequest& request) const;
  void write(Response response);
  void end();

  boost::beast::tcp_stream stream_;
  ServerState& state_;
  const std::uint64_t number_;  ///< Of the connection.
  bool has_asked_ = false;      ///< At least once.
  boost::beast::flat_buffer buffer_;
  std::optional<boost::beast::http::request_parser<boost::beast::http::empty_body>> parser_;
  Response response_;
};

}  // namespace waymark

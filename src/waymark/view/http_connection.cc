// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/view/http_connection.h"

#include <array>
#include <chrono>
#include <utility>

#include "waymark/view/assets.h"

namespace waymark {
namespace {

namespace beast = boost::beast;
namespace http = boost::beast::http;
namespace websocket = boost::beast::websocket;
using namespace std::chrono_literals;

constexpr std::size_t kMaxIncoming = 65536;
constexpr auto kTimeout = 10s;
/// For the first request, which browsers send at once; a connection that never sends one whole
/// holds a place no longer.
constexpr auto kFirstRequestTimeout = 3s;
constexpr int kMaxViewers = 32;
constexpr std::uint32_t kMaxHeader = 8192;
constexpr std::size_t kMaxBuffer = 16384;

std::string_view as_view(beast::string_view text) { return {text.data(), text.size()}; }

std::string_view path_of(const HttpRequest& request) {
  const std::string_view target = as_view(request.target());
  return target.substr(0, target.find('?'));
}

bool may_see_session(const AccessRules& rules, const HttpRequest& request) {
  return is_session_allowed(rules,
                            as_view(request.target()),
                            as_view(request[http::field::host]),
                            as_view(request[http::field::origin]));
}

/// Of nobody where the peer has gone already.
ConnectionPool::Address peer_of(const beast::tcp_stream& stream) {
  beast::error_code error;
  return stream.socket().remote_endpoint(error).address();
}

/// Whatever the answer: pages of other sites must neither frame it, where a click would be led to
/// the controls of the session, nor embed it, nor learn a URL that has the token.
void add_security_fields(http::fields& fields) {
  fields.set("Content-Security-Policy",
             "default-src 'self'; object-src 'none'; base-uri 'none'; form-action 'none'; "
             "frame-ancestors 'none'");
  fields.set("X-Frame-Options", "DENY");
  fields.set("Cross-Origin-Resource-Policy", "same-origin");
  fields.set("Referrer-Policy", "no-referrer");
  fields.set("X-Content-Type-Options", "nosniff");
}

/// By the suffix of a path.
beast::string_view content_type_of(std::string_view path) {
  using Entry = std::pair<std::string_view, std::string_view>;
  constexpr std::array<Entry, 12> kTypes = {{
      {".html", "text/html; charset=utf-8"},
      {".js", "text/javascript; charset=utf-8"},
      {".css", "text/css; charset=utf-8"},
      {".json", "application/json"},
      {".map", "application/json"},
      {".svg", "image/svg+xml"},
      {".png", "image/png"},
      {".ico", "image/x-icon"},
      {".woff2", "font/woff2"},
      {".wasm", "application/wasm"},
      {".txt", "text/plain; charset=utf-8"},
      {".webmanifest", "application/manifest+json"},
  }};
  for (const auto& [suffix, type] : kTypes) {
    if (path.ends_with(suffix)) return {type.data(), type.size()};
  }
  return "application/octet-stream";
}

}  // namespace

WebSocketClient::WebSocketClient(beast::tcp_stream stream, ServerState& state)
    : stream_(std::move(stream)), state_(state) {
  ++state_.num_viewers;
  stream_.set_option(websocket::stream_base::decorator(
      [](websocket::response_type& response) { add_security_fields(response); }));
  stream_.set_option(websocket::stream_base::timeout{10s, 60s, true});
  stream_.read_message_max(kMaxIncoming);
  stream_.write_buffer_bytes(65536);
  stream_.auto_fragment(false);
}

WebSocketClient::~WebSocketClient() { --state_.num_viewers; }

void WebSocketClient::accept(const HttpRequest& request) {
  stream_.async_accept(request, [self = shared_from_this()](const beast::error_code& error) {
    if (error) return;
    self->is_open_ = true;
    self->number_ = self->state_.hub.add(self);
    self->read();
  });
}

void WebSocketClient::read() {
  stream_.async_read(
      incoming_,
      [self = shared_from_this()](const beast::error_code& error, std::size_t num_bytes) {
        if (error) {
          self->leave();
          return;
        }
        const auto* data = static_cast<const char*>(self->incoming_.data().data());
        self->state_.hub.receive(self->number_, {data, num_bytes}, ViewHub::Clock::now());
        self->incoming_.consume(self->incoming_.size());
        self->read();
      });
}

void WebSocketClient::send() {
  if (!is_open_ || is_sending_ || is_closing_) return;
  std::optional<Outbox::Outgoing> next = outbox.take();
  if (!next) return;
  outgoing_ = *std::move(next);
  is_sending_ = true;
  stream_.text(outgoing_.is_text);
  stream_.async_write(boost::asio::buffer(*outgoing_.message),
                      [self = shared_from_this()](const beast::error_code& error, std::size_t) {
                        self->finish_write(error);
                      });
}

void WebSocketClient::finish_write(const beast::error_code& error) {
  is_sending_ = false;
  outgoing_.message.reset();
  if (error) {
    leave();
  } else if (is_closing_) {
    is_closing_ = false;
    close();
  } else {
    send();
  }
}

void WebSocketClient::close() {
  const auto self = shared_from_this();
  leave();
  if (!is_open_ || is_closing_) return;
  is_closing_ = true;
  if (is_sending_) return;  // Goes on when that is done.
  stream_.async_close(websocket::close_code::going_away, [self](const beast::error_code&) {});
}

void WebSocketClient::leave() {
  if (number_ == 0) return;
  state_.hub.remove(std::exchange(number_, 0));
}

HttpConnection::HttpConnection(beast::tcp_stream stream, ServerState& state)
    : stream_(std::move(stream)),
      state_(state),
      number_(state.connections.add(peer_of(stream_), [this] { stream_.close(); })),
      buffer_(kMaxBuffer) {}

HttpConnection::~HttpConnection() { state_.connections.remove(number_); }

void HttpConnection::read() {
  parser_.emplace();
  parser_->header_limit(kMaxHeader);
  parser_->body_limit(0);
  stream_.expires_after(has_asked_ ? kTimeout : kFirstRequestTimeout);
  http::async_read(stream_,
                   buffer_,
                   *parser_,
                   [self = shared_from_this()](const beast::error_code& error, std::size_t) {
                     if (error) {
                       self->end();
                     } else {
                       self->answer(self->parser_->release());
                     }
                   });
}

void HttpConnection::answer(const HttpRequest& request) {
  has_asked_ = true;
  state_.connections.renew(number_);
  if (path_of(request) == "/ws" && may_see_session(state_.rules, request) &&
      websocket::is_upgrade(request) && state_.num_viewers < kMaxViewers) {
    state_.connections.remove(number_);
    stream_.expires_never();
    std::make_shared<WebSocketClient>(std::move(stream_), state_)->accept(request);
  } else {
    write(respond_to(request));
  }
}

HttpConnection::Response HttpConnection::respond_to(const HttpRequest& request) const {
  const std::string_view path = path_of(request);
  Response response{http::status::ok, request.version()};
  response.keep_alive(request.keep_alive());
  response.set(http::field::server, "waymark");
  response.set(http::field::cache_control, "no-cache");
  add_security_fields(response);
  response.set(http::field::content_type, "text/plain; charset=utf-8");
  const bool is_session = path == "/ws" || path == "/status";
  if (request.method() != http::verb::get && request.method() != http::verb::head) {
    response.result(http::status::method_not_allowed);
    response.body() = "only GET and HEAD are known\n";
  } else if (!is_host_allowed(state_.rules, as_view(request[http::field::host])) ||
             (is_session && !may_see_session(state_.rules, request))) {
    response.result(http::status::forbidden);
    response.body() = "not allowed: use the URL that waymark printed\n";
  } else if (path == "/ws" && websocket::is_upgrade(request)) {
    response.result(http::status::service_unavailable);
    response.body() = "too many viewers\n";
  } else if (path == "/ws") {
    response.result(http::status::upgrade_required);
    response.body() = "expected a WebSocket\n";
  } else if (path == "/status") {
    response.set(http::field::content_type, "application/json");
    response.body() = state_.hub.status();
  } else if (const Asset* asset = find_asset(path == "/" ? "/index.html" : path)) {
    response.set(http::field::content_type, content_type_of(asset->path));
    response.body() = std::string(asset->bytes);
  } else {
    response.result(http::status::not_found);
    response.body() = "no such page\n";
  }
  response.prepare_payload();
  if (request.method() == http::verb::head) response.body().clear();
  return response;
}

void HttpConnection::write(Response response) {
  response_ = std::move(response);
  stream_.expires_after(kTimeout);
  http::async_write(
      stream_, response_, [self = shared_from_this()](const beast::error_code& error, std::size_t) {
        if (error || self->response_.need_eof()) {
          self->end();
        } else {
          self->read();
        }
      });
}

void HttpConnection::end() {
  beast::error_code ignored;
  stream_.socket().shutdown(boost::asio::ip::tcp::socket::shutdown_send, ignored);
}

}  // namespace waymark

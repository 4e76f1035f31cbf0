// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/view/web_socket.h"

#include <chrono>
#include <utility>

namespace waymark {
namespace {

namespace beast = boost::beast;
namespace websocket = boost::beast::websocket;
using namespace std::chrono_literals;

constexpr std::size_t kMaxIncoming = 65536;

}  // namespace

WebSocketClient::WebSocketClient(beast::tcp_stream stream,
                                 ViewHub& hub,
                                 std::function<void()> on_end)
    : stream_(std::move(stream)), hub_(hub), on_end_(std::move(on_end)) {
  stream_.set_option(websocket::stream_base::timeout{10s, 60s, true});
  stream_.read_message_max(kMaxIncoming);
  stream_.write_buffer_bytes(65536);
  stream_.auto_fragment(false);
}

WebSocketClient::~WebSocketClient() { on_end_(); }

void WebSocketClient::accept(const Request& request) {
  stream_.async_accept(request, [self = shared_from_this()](const beast::error_code& error) {
    if (error) return;
    self->is_open_ = true;
    self->number_ = self->hub_.add(self);
    self->read();
  });
}

void WebSocketClient::read() {
  stream_.async_read(
      incoming_,
      [self = shared_from_this()](const beast::error_code& error, std::size_t num_bytes) {
        if (error) {
          self->leave();
        } else {
          self->receive(num_bytes);
        }
      });
}

void WebSocketClient::receive(std::size_t num_bytes) {
  const auto* data = static_cast<const char*>(incoming_.data().data());
  hub_.receive(number_, {data, num_bytes}, ViewHub::Clock::now());
  incoming_.consume(incoming_.size());
  read();
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
  hub_.remove(std::exchange(number_, 0));
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/view/viewer.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/host_name.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <charconv>
#include <exception>
#include <thread>
#include <utility>

#include "waymark/base/check.h"
#include "waymark/view/http_connection.h"
#include "waymark/view/hub.h"

namespace waymark {
namespace {

namespace asio = boost::asio;
using Tcp = asio::ip::tcp;
using ErrorCode = boost::system::error_code;
using namespace std::chrono_literals;

constexpr auto kTick = 100ms;
constexpr auto kFarewell = 1s;
/// That are no viewers'.
constexpr std::size_t kMaxConnections = 32;
/// The tracker and the mapper go first where there are not enough cores for all.
constexpr int kNiceness = 10;

Tcp::endpoint endpoint_of(const ViewerOptions& options) {
  ErrorCode error;
  const std::string name = options.host == "localhost" ? "127.0.0.1" : options.host;
  const asio::ip::address address = asio::ip::make_address(name, error);
  if (error) {
    throw InputError("viewer", options.host + " is no address, expected one such as 127.0.0.1");
  }
  return {address, options.port};
}

}  // namespace

ViewerOptions parse_viewer_address(const std::string& text, const std::string& where) {
  ViewerOptions options;
  const std::size_t colon = text.rfind(':');
  std::string port = text;
  if (colon != std::string::npos) {
    options.host = text.substr(0, colon);
    port = text.substr(colon + 1);
    if (options.host.starts_with('[') && options.host.ends_with(']')) {
      options.host = options.host.substr(1, options.host.size() - 2);
    }
  }
  const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), options.port);
  if (error != std::errc() || end != port.data() + port.size() || options.host.empty()) {
    throw InputError(where, fmt::format("{} is no address, expected [HOST:]PORT", text));
  }
  endpoint_of(options);
  return options;
}

class Viewer::Impl {
 public:
  Impl(const ViewerOptions& options, SessionInfo info)
      : hub_(channel_, std::move(info)),
        state_{{}, hub_, ConnectionPool(kMaxConnections)},
        acceptor_(context_),
        timer_(context_) {
    listen(endpoint_of(options));
    thread_ = std::jthread([this] { run(); });
  }

  ~Impl() {
    channel_.updates.close();
    asio::post(context_, [this] { begin_farewell(); });
    thread_.join();
    hub_.forget_clients();  // Their sockets must go before the context.
  }

  const std::string& url() const { return url_; }
  ViewChannel& channel() { return channel_; }

 private:
  void listen(const Tcp::endpoint& endpoint) {
    try {
      acceptor_.open(endpoint.protocol());
      acceptor_.set_option(Tcp::acceptor::reuse_address(true));
      acceptor_.bind(endpoint);
      acceptor_.listen();
    } catch (const boost::system::system_error& error) {
      throw InputError("viewer",
                       fmt::format("cannot listen at port {} ({}), expected one that is free",
                                   endpoint.port(),
                                   error.code().message()));
    }
    const Tcp::endpoint bound = acceptor_.local_endpoint();
    state_.rules.is_loopback = bound.address().is_loopback();
    if (!state_.rules.is_loopback) state_.rules.token = make_token();
    const std::string address = bound.address().to_string();
    const std::string host = bound.address().is_v6() ? "[" + address + "]" : address;
    url_ = fmt::format("http://{}:{}/{}",
                       bound.address().is_unspecified() ? asio::ip::host_name() : host,
                       bound.port(),
                       state_.rules.is_loopback ? "" : "?token=" + state_.rules.token);
  }

  void run() {
    setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), kNiceness);
    accept();
    tick();
    for (;;) {
      try {
        context_.run();
        return;
      } catch (const std::exception& error) {
        // One connection's or one update's trouble; the others go on.
        tell(error.what());
      }
    }
  }

  /// Once: what fails may fail at every tick.
  void tell(std::string problem) {
    if (!std::exchange(has_told_, true)) channel_.problems.try_push(problem);
  }

  void accept() {
    is_accepting_ = true;
    acceptor_.async_accept([this](const ErrorCode& error, Tcp::socket socket) {
      is_accepting_ = false;
      if (error) return;  // No descriptor is left, say: the next try at once would fail, too.
      accept();
      welcome(std::move(socket));
    });
  }

  void welcome(Tcp::socket socket) {
    ErrorCode ignored;
    socket.set_option(Tcp::no_delay(true), ignored);
    std::make_shared<HttpConnection>(boost::beast::tcp_stream(std::move(socket)), state_)->read();
  }

  void tick() {
    timer_.expires_after(kTick);
    timer_.async_wait([this](const ErrorCode& error) {
      if (error) return;
      tick();
      if (!leave_at_ && !is_accepting_) accept();
      hub_.tick(ViewHub::Clock::now());
      if (!leave_at_) return;
      if (ViewHub::Clock::now() >= *leave_at_) context_.stop();
      if (!hub_.is_idle()) return;
      hub_.close_clients();
      if (state_.num_viewers == 0) context_.stop();
    });
  }

  void begin_farewell() {
    leave_at_ = ViewHub::Clock::now() + kFarewell;
    ErrorCode ignored;
    acceptor_.close(ignored);
    hub_.tick(ViewHub::Clock::now());
    if (state_.num_viewers == 0) context_.stop();
  }

  ViewChannel channel_;
  std::string url_;

  // The server's thread, once it runs. What operations under way use is made before the context,
  // which takes them with it.
  ViewHub hub_;
  ServerState state_;
  asio::io_context context_{1};
  Tcp::acceptor acceptor_;
  bool is_accepting_ = false;
  bool has_told_ = false;
  asio::steady_timer timer_;
  std::optional<ViewHub::Clock::time_point> leave_at_;
  std::jthread thread_;
};

Viewer::Viewer(const ViewerOptions& options, SessionInfo info)
    : impl_(std::make_unique<Impl>(options, std::move(info))) {}
Viewer::~Viewer() = default;
std::string Viewer::url() const { return impl_->url(); }
ViewChannel& Viewer::channel() { return impl_->channel(); }
bool Viewer::try_push(ViewUpdate& update) { return impl_->channel().updates.try_push(update); }
std::optional<ViewRequest> Viewer::next_request() { return impl_->channel().requests.try_pop(); }
std::optional<std::string> Viewer::next_problem() { return impl_->channel().problems.try_pop(); }
void Viewer::reply(ViewReply reply) { impl_->channel().replies.try_push(reply); }

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <dlfcn.h>
#include <gmock/gmock.h>

#include <atomic>
#include <cerrno>
#include <memory>
#include <vector>

#include "waymark/view/testing/client.h"
#include "waymark/view/viewer.h"

// The server where more come than it has places for.
namespace {

/// While set, accept() fails as it does where no file descriptor is left.
std::atomic<bool> is_out_of_descriptors{false};
std::atomic<int> num_failed_accepts{0};

}  // namespace

/// In place of that of the C library.
extern "C" int accept(int socket, sockaddr* address, socklen_t* size) {
  if (is_out_of_descriptors) {
    ++num_failed_accepts;
    errno = EMFILE;
    return -1;
  }
  static const auto real = reinterpret_cast<decltype(&accept)>(dlsym(RTLD_NEXT, "accept"));
  return real(socket, address, size);
}

namespace waymark {
namespace {

using ::testing::HasSubstr;
using Connections = std::vector<std::unique_ptr<Connection>>;

constexpr std::uint32_t kOtherAddress = INADDR_LOOPBACK + 1;

std::string server_of(const Viewer& viewer) {
  return viewer.url().substr(0, viewer.url().size() - 1);
}

/// Connections that send nothing, or the beginning of a request that never ends.
Connections idle_connections(const std::string& url, int count, std::uint32_t from) {
  Connections connections;
  for (int i = 0; i < count; ++i) {
    connections.push_back(std::make_unique<Connection>(url, from));
    if (i % 2 == 1) connections.back()->send("G");
  }
  return connections;
}

TEST(Crowd, IdleConnectionsKeepNobodyOut) {
  Viewer viewer({"127.0.0.1", 0}, {});
  const std::string url = server_of(viewer);
  const WebSocket before(viewer.url());
  const Connections idle = idle_connections(url, 70, INADDR_LOOPBACK);
  EXPECT_THAT(get(url, "/status"), HasSubstr("200 OK"));
  const WebSocket after(viewer.url());
  EXPECT_THAT(after.answer, HasSubstr("101"));
  EXPECT_EQ(idle.front()->receive_all(), "");  // Closed, else this would wait.
  before.send_text(R"({"request": 1, "do": "pause"})");
  EXPECT_THAT(before.receive_text("reply"), HasSubstr("\"ok\":true"));
}

TEST(Crowd, AnAddressWithManyConnectionsCostsOthersNone) {
  Viewer viewer({"127.0.0.1", 0}, {});
  const std::string url = server_of(viewer);
  const Connection other(url, kOtherAddress);
  const Connections idle = idle_connections(url, 70, INADDR_LOOPBACK);
  EXPECT_THAT(get(url, "/status"), HasSubstr("200 OK"));
  other.send("GET /status HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n");
  EXPECT_THAT(other.receive_all(), HasSubstr("200 OK"));
}

TEST(Crowd, ViewersAreBoundedToo) {
  Viewer viewer({"127.0.0.1", 0}, {});
  std::vector<std::unique_ptr<WebSocket>> sockets;
  for (int i = 0; i < 32; ++i) {
    sockets.push_back(std::make_unique<WebSocket>(viewer.url()));
    EXPECT_THAT(sockets.back()->answer, HasSubstr("101"));
  }
  EXPECT_THAT(WebSocket(viewer.url()).answer, HasSubstr("503"));
  EXPECT_THAT(get(server_of(viewer), "/status"), HasSubstr("\"clients\":32"));
}

/// Requests on an open connection are the clock here: without a pause the server tries many times
/// within each of them.
TEST(Crowd, TriesSeldomWithoutFileDescriptorsAndServesAfterwards) {
  Viewer viewer({"127.0.0.1", 0}, {});
  const std::string url = server_of(viewer);
  const Connection open(url);
  const auto ask = [](const Connection& connection) {
    connection.send("HEAD / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n");
    std::string answer;
    while (!answer.ends_with("\r\n\r\n")) {
      const std::string byte = connection.receive(1);
      if (byte.empty()) break;
      answer += byte;
    }
    return answer;
  };
  EXPECT_THAT(ask(open), HasSubstr("200 OK"));
  constexpr int kNumRequests = 200;
  num_failed_accepts = 0;
  is_out_of_descriptors = true;
  const Connection waiting(url);
  while (num_failed_accepts == 0) EXPECT_THAT(ask(open), HasSubstr("200 OK"));
  for (int i = 0; i < kNumRequests; ++i) EXPECT_THAT(ask(open), HasSubstr("200 OK"));
  EXPECT_LT(num_failed_accepts, kNumRequests);
  is_out_of_descriptors = false;
  EXPECT_THAT(ask(waiting), HasSubstr("200 OK"));
}

}  // namespace
}  // namespace waymark

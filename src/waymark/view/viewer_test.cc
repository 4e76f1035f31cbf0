// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/view/viewer.h"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "waymark/base/check.h"
#include "waymark/base/rng.h"
#include "waymark/view/assets.h"

namespace waymark {
namespace {

using ::testing::HasSubstr;

/// A client of plain sockets.
class Connection {
 public:
  explicit Connection(const std::string& url) : socket_(socket(AF_INET, SOCK_STREAM, 0)) {
    const std::size_t colon = url.rfind(':');
    sockaddr_in address = {};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(std::stoi(url.substr(colon + 1))));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const timeval timeout = {5, 0};
    setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof(timeout));
    EXPECT_EQ(connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
  }
  ~Connection() { close(socket_); }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  void send(const std::string& bytes) const {
    EXPECT_GE(::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL), -1);
  }
  /// Until the server closes.
  std::string receive_all() const {
    std::string received;
    char buffer[4096];
    for (;;) {
      const ssize_t size = recv(socket_, buffer, sizeof(buffer), 0);
      if (size <= 0) return received;
      received.append(buffer, static_cast<std::size_t>(size));
    }
  }

 private:
  int socket_;
};

std::string get(const std::string& url, const std::string& path, const std::string& fields = "") {
  const Connection connection(url);
  connection.send("GET " + path + " HTTP/1.1\r\nConnection: close\r\n" +
                  (fields.empty() ? "Host: 127.0.0.1\r\n" : fields) + "\r\n");
  return connection.receive_all();
}

TEST(Viewer, ReadsAddresses) {
  EXPECT_EQ(parse_viewer_address("9000", "--viewer").port, 9000);
  EXPECT_EQ(parse_viewer_address("9000", "--viewer").host, "127.0.0.1");
  EXPECT_EQ(parse_viewer_address("0.0.0.0:80", "--viewer").host, "0.0.0.0");
  EXPECT_EQ(parse_viewer_address("[::1]:80", "--viewer").host, "::1");
  for (const char* bad : {"", "x", "70000", "-1", "1.2.3:80", ":80", "80x", "nowhere.example:80"}) {
    EXPECT_THROW(parse_viewer_address(bad, "--viewer"), InputError) << bad;
  }
}

TEST(Viewer, ServesThePageAndTheStatus) {
  Viewer viewer({"127.0.0.1", 0}, {});
  const std::string url = viewer.url().substr(0, viewer.url().size() - 1);
  EXPECT_THAT(viewer.url(), HasSubstr("http://127.0.0.1:"));
  const std::string page = get(url, "/");
  EXPECT_THAT(page, HasSubstr("200 OK"));
  EXPECT_THAT(page, HasSubstr("Content-Type: text/html"));
  EXPECT_THAT(page, HasSubstr(std::string(find_asset("/index.html")->bytes)));
  EXPECT_THAT(get(url, "/status"), HasSubstr("\"phase\":\"starting\""));
  EXPECT_THAT(get(url, "/../../etc/passwd"), HasSubstr("404"));
  EXPECT_THAT(get(url, "/", "Host: evil.example\r\n"), HasSubstr("403"));
  EXPECT_THAT(get(url, "/status", "Host: 127.0.0.1\r\nOrigin: http://evil.example\r\n"),
              HasSubstr("403"));
}

TEST(Viewer, ATakenPortIsAnError) {
  Viewer viewer({"127.0.0.1", 0}, {});
  const std::string url = viewer.url();
  const std::string port = url.substr(url.rfind(':') + 1);
  EXPECT_THROW(Viewer({"127.0.0.1", static_cast<std::uint16_t>(std::stoi(port))}, {}), InputError);
}

TEST(Viewer, OthersNeedTheToken) {
  Viewer viewer({"0.0.0.0", 0}, {});
  const std::string url = viewer.url();
  const std::size_t slash = url.rfind('/');
  const std::string server = url.substr(0, slash);
  EXPECT_THAT(get(server, "/status"), HasSubstr("403"));
  EXPECT_THAT(get(server, "/status" + url.substr(slash + 1)), HasSubstr("200 OK"));
}

TEST(Viewer, GarbageEndsOnlyItsOwnConnection) {
  Viewer viewer({"127.0.0.1", 0}, {});
  const std::string url = viewer.url().substr(0, viewer.url().size() - 1);
  Rng rng(1, 0);
  for (int i = 0; i < 20; ++i) {
    std::string garbage(1 + rng.below(20000), '\0');
    for (char& byte : garbage) byte = static_cast<char>(rng.next());
    const Connection connection(url);
    connection.send(garbage + "\r\n\r\n");
    connection.receive_all();
  }
  EXPECT_THAT(get(url, "/status"), HasSubstr("200 OK"));
}

TEST(Viewer, UpdatesNeverWait) {
  Viewer viewer({"127.0.0.1", 0}, {});
  int num_taken = 0;
  for (int i = 0; i < 100000; ++i) {
    ViewUpdate update;
    num_taken += viewer.try_push(update);
  }
  EXPECT_GT(num_taken, 0);
  EXPECT_FALSE(viewer.next_request().has_value());
}

}  // namespace
}  // namespace waymark

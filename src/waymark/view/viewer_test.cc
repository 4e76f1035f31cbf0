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

using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::Not;

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

  /// Whether all of it was taken; not where the server closes meanwhile.
  bool send(const std::string& bytes) const {
    const ssize_t size = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    return size == static_cast<ssize_t>(bytes.size());
  }
  /// So many bytes, or fewer where the server closes.
  std::string receive(std::size_t num_bytes) const {
    std::string received(num_bytes, '\0');
    std::size_t size = 0;
    while (size < num_bytes) {
      const ssize_t got = recv(socket_, received.data() + size, num_bytes - size, 0);
      if (got <= 0) break;
      size += static_cast<std::size_t>(got);
    }
    received.resize(size);
    return received;
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
  EXPECT_TRUE(connection.send("GET " + path + " HTTP/1.1\r\nConnection: close\r\n" +
                              (fields.empty() ? "Host: 127.0.0.1\r\n" : fields) + "\r\n"));
  return connection.receive_all();
}

/// A WebSocket (RFC 6455) over plain sockets, as far as the server needs one.
class WebSocket {
 public:
  explicit WebSocket(const std::string& url, const std::string& target = "/ws")
      : connection_(url.substr(0, url.find('/', 7))) {
    connection_.send("GET " + target +
                     " HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\n"
                     "Connection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
                     "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n");
    while (!answer.ends_with("\r\n\r\n")) {
      const std::string byte = connection_.receive(1);
      if (byte.empty()) return;
      answer += byte;
    }
  }

  void send_text(const std::string& text) const { send_frame(0x81, text); }
  /// Masked, as a client must.
  void send_frame(int first_byte, const std::string& content) const {
    const std::string mask = "abcd";
    std::string frame(1, static_cast<char>(first_byte));
    if (content.size() < 126) {
      frame.push_back(static_cast<char>(0x80 | content.size()));
    } else {
      frame.push_back(static_cast<char>(0x80 | 127));
      for (int shift = 56; shift >= 0; shift -= 8) {
        frame.push_back(static_cast<char>((content.size() >> shift) & 255));
      }
    }
    frame += mask;
    for (std::size_t i = 0; i < content.size(); ++i) {
      frame.push_back(static_cast<char>(content[i] ^ mask[i % 4]));
    }
    connection_.send(frame);
  }

  /// Content of the next message; kind 1: text, 2: binary, 8: the end, 0: closed.
  std::pair<int, std::string> receive() const {
    const std::string header = connection_.receive(2);
    if (header.size() < 2) return {0, ""};
    std::size_t size = static_cast<unsigned char>(header[1]);
    if (size > 125) {
      const std::string longer = connection_.receive(size == 126 ? 2 : 8);
      size = 0;
      for (const char byte : longer) size = 256 * size + static_cast<unsigned char>(byte);
    }
    return {header[0] & 15, connection_.receive(size)};
  }
  /// The next text with these words.
  std::string receive_text(const std::string& words) const {
    for (int i = 0; i < 1000; ++i) {
      const auto [kind, content] = receive();
      if (kind == 0) break;
      if (kind == 1 && content.find(words) != std::string::npos) return content;
    }
    return "nothing";
  }

  std::string answer;  ///< Of the handshake.

 private:
  Connection connection_;
};

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
    EXPECT_THAT(connection.receive_all(), Not(HasSubstr("200 OK")));
  }
  EXPECT_THAT(get(url, "/status"), HasSubstr("200 OK"));
}

TEST(Viewer, SpeaksWithAWebSocket) {
  SessionInfo info;
  info.program = "waymark 1";
  Viewer viewer({"127.0.0.1", 0}, info);
  const WebSocket socket(viewer.url());
  EXPECT_THAT(socket.answer, HasSubstr("101 Switching Protocols"));
  // The answer to that key, from the RFC.
  EXPECT_THAT(socket.answer, HasSubstr("s3pPLMBiTxaQ9kYGzzhZRbK+xOo="));
  const auto [kind, hello] = socket.receive();
  EXPECT_EQ(kind, 1);
  EXPECT_THAT(hello, HasSubstr("waymark 1"));
  EXPECT_THAT(socket.receive_text("status"), HasSubstr("starting"));
  ViewUpdate update;
  update.status.phase = SessionPhase::kRunning;
  ASSERT_TRUE(viewer.try_push(update));
  EXPECT_THAT(socket.receive_text("running"), HasSubstr("\"clients\":1"));
}

TEST(Viewer, TakesRequestsAndAnswersThem) {
  SessionInfo info;
  info.can_save = true;
  Viewer viewer({"127.0.0.1", 0}, info);
  const WebSocket socket(viewer.url());
  socket.send_text(R"({"request": 3, "do": "mapping", "on": false})");
  EXPECT_THAT(socket.receive_text("reply"), HasSubstr("\"ok\":true"));
  const std::optional<ViewRequest> request = viewer.next_request();
  ASSERT_TRUE(request);
  EXPECT_EQ(request->kind, ViewRequest::Kind::kMappingOff);
  EXPECT_EQ(request->number, 3u);
  socket.send_text("no JSON");
  EXPECT_THAT(socket.receive_text("reply"), HasSubstr("expected a JSON object"));
  // Saving takes time; the session answers.
  socket.send_text(R"({"request": 4, "do": "save"})");
  socket.send_text(R"({"request": 5, "do": "pause"})");
  EXPECT_THAT(socket.receive_text("reply"), HasSubstr("\"request\":5"));
  const std::optional<ViewRequest> save = viewer.next_request();
  ASSERT_TRUE(save);
  viewer.reply({*save, "room.wmap", ""});
  EXPECT_THAT(socket.receive_text("reply"), HasSubstr("room.wmap"));
}

TEST(Viewer, EndsWhatIsTooLongAndGoesOnWithTheOthers) {
  Viewer viewer({"127.0.0.1", 0}, {});
  const WebSocket other(viewer.url());
  {
    const WebSocket socket(viewer.url());
    socket.send_text(std::string(100'000, 'x'));
    EXPECT_EQ(socket.receive_text("reply"), "nothing");
  }
  other.send_text(R"({"request": 1, "do": "pause"})");
  EXPECT_THAT(other.receive_text("reply"), HasSubstr("\"ok\":true"));
}

TEST(Viewer, ClosesItsClientsAtTheEnd) {
  auto viewer = std::make_unique<Viewer>(ViewerOptions{"127.0.0.1", 0}, SessionInfo{});
  const WebSocket socket(viewer->url());
  EXPECT_THAT(socket.receive_text("hello"), HasSubstr("protocol"));
  viewer.reset();
  int last_kind = -1;
  for (int i = 0; i < 100 && last_kind != 0 && last_kind != 8; ++i)
    last_kind = socket.receive().first;
  EXPECT_TRUE(last_kind == 0 || last_kind == 8) << last_kind;
}

TEST(Viewer, TheWebSocketOfOthersNeedsTheToken) {
  Viewer viewer({"0.0.0.0", 0}, {});
  const std::string url = viewer.url();
  const std::string target = "/ws" + url.substr(url.rfind('/') + 1);
  EXPECT_THAT(WebSocket(url, "/ws").answer, HasSubstr("403"));
  EXPECT_THAT(WebSocket(url, target).answer, HasSubstr("101"));
  EXPECT_THAT(get(url.substr(0, url.rfind('/')), target), HasSubstr("426"));
}

TEST(Viewer, KnowsGetAndHeadOnly) {
  Viewer viewer({"127.0.0.1", 0}, {});
  const auto ask = [&](const std::string& request) {
    const Connection connection(viewer.url().substr(0, viewer.url().size() - 1));
    EXPECT_TRUE(connection.send(request + "Host: 127.0.0.1\r\nConnection: close\r\n\r\n"));
    return connection.receive_all();
  };
  const std::string page = ask("GET / HTTP/1.1\r\n"), head = ask("HEAD / HTTP/1.1\r\n");
  EXPECT_THAT(page, HasSubstr("</html>"));
  EXPECT_THAT(head, HasSubstr("200 OK"));
  EXPECT_THAT(head, Not(HasSubstr("</html>")));
  EXPECT_EQ(page.substr(0, page.find("\r\n\r\n")), head.substr(0, head.find("\r\n\r\n")));
  EXPECT_THAT(ask("POST / HTTP/1.1\r\n"), HasSubstr("405"));
  EXPECT_THAT(ask("GET /nowhere HTTP/1.1\r\n"), HasSubstr("404"));
}

TEST(Viewer, NoAnswerMayBeFramedOrEmbedded) {
  Viewer viewer({"127.0.0.1", 0}, {});
  const std::string url = viewer.url().substr(0, viewer.url().size() - 1);
  for (const std::string& answer : {get(url, "/"),
                                    get(url, "/status"),
                                    get(url, "/waymark.js"),
                                    get(url, "/nowhere"),
                                    get(url, "/", "Host: evil.example\r\n"),
                                    WebSocket(viewer.url()).answer}) {
    EXPECT_THAT(answer,
                ContainsRegex("Content-Security-Policy: default-src 'self';.*"
                              "frame-ancestors 'none'\r"));
    EXPECT_THAT(answer, HasSubstr("X-Frame-Options: DENY\r"));
    EXPECT_THAT(answer, HasSubstr("Cross-Origin-Resource-Policy: same-origin\r"));
    EXPECT_THAT(answer, HasSubstr("Referrer-Policy: no-referrer\r"));
    EXPECT_THAT(answer, HasSubstr("X-Content-Type-Options: nosniff\r"));
  }
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

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/view/viewer.h"

#include <gmock/gmock.h>

#include <chrono>
#include <thread>

#include "waymark/base/check.h"
#include "waymark/base/rng.h"
#include "waymark/view/assets.h"
#include "waymark/view/testing/client.h"

namespace waymark {
namespace {

using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::Not;

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
    const std::string fields = answer.substr(0, answer.find("\r\n\r\n")) + "\r\n";
    EXPECT_THAT(fields,
                ContainsRegex("Content-Security-Policy: default-src 'self';.*"
                              "frame-ancestors 'none'\r"));
    EXPECT_THAT(fields, HasSubstr("X-Frame-Options: DENY\r"));
    EXPECT_THAT(fields, HasSubstr("Cross-Origin-Resource-Policy: same-origin\r"));
    EXPECT_THAT(fields, HasSubstr("Referrer-Policy: no-referrer\r"));
    EXPECT_THAT(fields, HasSubstr("X-Content-Type-Options: nosniff\r"));
  }
}

TEST(Viewer, TellsOnceWhatWentWrongAndGoesOn) {
  Viewer viewer({"127.0.0.1", 0}, {});
  const WebSocket socket(viewer.url());
  EXPECT_THAT(socket.receive_text("status"), HasSubstr("starting"));
  EXPECT_FALSE(viewer.next_problem());
  ViewUpdate update;
  update.status.phase = static_cast<SessionPhase>(99);  // Has no name to be sent.
  ASSERT_TRUE(viewer.try_push(update));
  std::optional<std::string> problem;
  for (int i = 0; i < 500 && !problem; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    problem = viewer.next_problem();
  }
  EXPECT_THAT(problem.value_or("nothing"), HasSubstr("99"));
  EXPECT_EQ(get(viewer.url().substr(0, viewer.url().size() - 1), "/status"),
            "");  // The same again.
  update.status.phase = SessionPhase::kRunning;
  ASSERT_TRUE(viewer.try_push(update));
  EXPECT_THAT(socket.receive_text("running"), HasSubstr("\"clients\":1"));
  EXPECT_FALSE(viewer.next_problem());
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

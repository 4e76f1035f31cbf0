// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdint>
#include <string>
#include <utility>

namespace waymark {

/// A client of plain sockets, for tests.
class Connection {
 public:
  /// from: the address of this end, of those of this machine.
  explicit Connection(const std::string& url, std::uint32_t from = INADDR_LOOPBACK)
      : socket_(socket(AF_INET, SOCK_STREAM, 0)) {
    const std::size_t colon = url.rfind(':');
    sockaddr_in address = {};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(from);
    EXPECT_EQ(bind(socket_, reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
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

inline std::string get(const std::string& url,
                       const std::string& path,
                       const std::string& fields = "") {
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

}  // namespace waymark

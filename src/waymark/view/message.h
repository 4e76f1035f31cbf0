// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>

#include "waymark/geometry/rigid3.h"
#include "waymark/view/update.h"

namespace waymark {

/// Binary messages of the viewer's protocol, see docs/viewer-protocol.md.
enum class MessageKind : std::uint8_t {
  kBegin = 1,
  kEnd = 2,
  kLandmarks = 3,
  kLandmarkPositions = 4,
  kLandmarksErased = 5,
  kCameras = 6,
  kKeyframes = 7,
  kKeyframePoses = 8,
  kKeyframesErased = 9,
  kCovisibility = 10,
  kLoops = 11,
  kTrajectory = 12,
  kFrame = 13,
  kSubmaps = 14,
  kMarkers = 15,
  kEdgePoints = 16,
  kKeyframeImage = 17,
};

inline constexpr std::uint8_t kProtocolVersion = 1;
/// Elements of a message at most.
inline constexpr std::size_t kMaxChunk = 65536;

/// A finished message, shared by all that it is sent to.
using Message = std::shared_ptr<const std::string>;

/// Arrays of a message, one behind the other, little-endian.
class MessageWriter {
 public:
  MessageWriter(MessageKind kind, std::size_t num_elements);

  void add(std::uint32_t value) { append(&value, sizeof(value)); }
  void add(float value) { append(&value, sizeof(value)); }
  void add(std::uint16_t value) { append(&value, sizeof(value)); }
  void add(std::uint8_t value) { append(&value, sizeof(value)); }
  /// Three float32.
  void add(const Eigen::Vector3d& vector);
  /// Four float32: x y z w.
  void add(const Eigen::Quaterniond& rotation);
  void add_bytes(std::string_view bytes) { append(bytes.data(), bytes.size()); }
  /// Zeros up to a multiple of so many bytes.
  void pad_to(std::size_t multiple);

  Message finish() { return std::make_shared<const std::string>(std::move(bytes_)); }

 private:
  static_assert(std::endian::native == std::endian::little, "else swap the bytes here");

  void append(const void* data, std::size_t num_bytes) {
    bytes_.append(static_cast<const char*>(data), num_bytes);
  }

  std::string bytes_;
};

inline float seconds_between(std::int64_t start_ns, std::int64_t end_ns) {
  return static_cast<float>(1e-9 * static_cast<double>(end_ns - start_ns));
}

/// 65535 for everything above.
std::uint16_t saturate16(std::size_t value);

/// A message of ids alone.
Message encode_ids(MessageKind kind, std::span<const std::uint32_t> ids);

/// Appends encode(part) for consecutive parts of at most kMaxChunk elements.
template <class T, class Encode>
void add_chunks(const std::vector<T>& elements, std::vector<Message>& messages, Encode&& encode) {
  const std::span<const T> all = elements;
  for (std::size_t begin = 0; begin < all.size(); begin += kMaxChunk) {
    messages.push_back(encode(all.subspan(begin, std::min(kMaxChunk, all.size() - begin))));
  }
}

// The text messages of the protocol.

std::string format_hello(const SessionInfo& info);
std::string format_status(const SessionStatus& status, const Map& map, std::size_t num_clients);
/// number: of the request; nothing where it could not be read. error: empty if all went well. path:
/// of what was saved, if anything was.
std::string format_reply(std::optional<std::uint64_t> number,
                         std::string_view error,
                         std::string_view path = "");
/// Data of an element, or a reply that it does not exist.
std::string format_keyframe(const Map& map, KeyframeId id, std::uint64_t number);
std::string format_landmark(const Map& map, LandmarkId id, std::uint64_t number);

/// The `keyframe image` message, an answer to a request: the JPEG file with the keyframe's features
/// in camera 0.
Message encode_keyframe_image(const Keyframe& keyframe,
                              KeyframeId id,
                              std::uint64_t number,
                              std::string_view jpeg);

struct SetRate {
  double hz = 0.0;
};

struct GetImage {
  KeyframeId keyframe;
};

/// What a client wants.
struct ClientRequest {
  std::optional<std::uint64_t> number;  ///< Nothing where it could not be read.
  /// The string says what is wrong, an id whose data are wanted.
  std::variant<std::string,
               ViewRequest::Kind,
               KeyframeId,
               LandmarkId,
               SetRate,
               GetImage,
               KnownDistance>
      content;
};

/// Reads what a client sent, whatever it is.
ClientRequest parse_request(std::string_view text);

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/view/message.h"

#include <algorithm>

namespace waymark {

MessageWriter::MessageWriter(MessageKind kind, std::size_t num_elements) {
  add(static_cast<std::uint8_t>(kind));
  add(kProtocolVersion);
  add(std::uint16_t{0});
  add(static_cast<std::uint32_t>(num_elements));
}

void MessageWriter::add(const Eigen::Vector3d& vector) {
  for (int i = 0; i < 3; ++i) add(static_cast<float>(vector[i]));
}

void MessageWriter::add(const Eigen::Quaterniond& rotation) {
  for (int i = 0; i < 4; ++i) add(static_cast<float>(rotation.coeffs()[i]));
}

void MessageWriter::pad_to(std::size_t multiple) {
  bytes_.append((multiple - bytes_.size() % multiple) % multiple, '\0');
}

std::uint16_t saturate16(std::size_t value) {
  return static_cast<std::uint16_t>(std::min<std::size_t>(value, UINT16_MAX));
}

Message encode_ids(MessageKind kind, std::span<const std::uint32_t> ids) {
  MessageWriter writer(kind, ids.size());
  for (const std::uint32_t id : ids) writer.add(id);
  return writer.finish();
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/view/scene.h"

#include <utility>

namespace waymark {

void Scene::reset() {
  map_ = std::make_shared<const Map>();
  landmarks_.reset();
  keyframes_.reset();
  trajectory_.reset();
}

std::vector<Message> Scene::advance(ViewUpdate& update, bool is_watched) {
  if (update.is_reset) reset();
  const std::shared_ptr<const Map> before = map_;
  if (update.map) map_ = update.map;
  for (FeatureColors& colors : update.colors) landmarks_.add_colors(std::move(colors));
  landmarks_.color_landmarks(*before, *map_);
  std::vector<Message> messages;
  // First, since it knows when the session began.
  trajectory_.advance(update.frames, *before, *map_, messages);
  if (!is_watched) return {};
  if (update.is_reset) return snapshot();
  if (map_ == before) return messages;
  keyframes_.differences(*before, *map_, start_ns(), messages);
  landmarks_.differences(*before, *map_, messages);
  return messages;
}

std::vector<Message> Scene::snapshot() {
  ++generation_;
  std::vector<Message> messages;
  MessageWriter begin(MessageKind::kBegin, 0);
  begin.add(generation_);
  begin.add(static_cast<std::uint32_t>(map_->landmarks().size()));
  begin.add(static_cast<std::uint32_t>(map_->keyframes().size()));
  begin.add(static_cast<std::uint32_t>(trajectory_.size()));
  messages.push_back(begin.finish());
  keyframes_.snapshot(*map_, start_ns(), messages);
  trajectory_.snapshot(*map_, messages);
  landmarks_.snapshot(*map_, messages);
  MessageWriter end(MessageKind::kEnd, 0);
  end.add(generation_);
  messages.push_back(end.finish());
  return messages;
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "autosave.h"

#include <utility>

#include "waymark/base/check.h"

namespace waymark {

Autosave::Autosave(std::filesystem::path path,
                   double interval_s,
                   std::string settings,
                   const ImageKeeper& images)
    : path_(std::move(path)),
      interval_(
          std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(interval_s))),
      settings_(std::move(settings)),
      images_(images) {}

std::optional<std::string> Autosave::update(const std::shared_ptr<const Map>& map) {
  using namespace std::chrono_literals;
  if (under_way_.valid()) {
    if (under_way_.wait_for(0s) != std::future_status::ready) return std::nullopt;
    try {
      under_way_.get();
    } catch (const OutputError& error) {
      return error.what();
    }
  }
  const Clock::time_point now = Clock::now();
  const bool is_off = interval_ == Clock::duration::zero();
  if (is_off || now - last_start_ < interval_ || map->keyframes().is_empty()) return std::nullopt;
  last_start_ = now;
  // The map never changes, the rest is fixed: nothing is shared that anyone writes.
  under_way_ =
      std::async(std::launch::async, [this, stored = prepare(map)] { save_map(path_, stored); });
  return std::nullopt;
}

void Autosave::save(const std::shared_ptr<const Map>& map) {
  if (under_way_.valid()) under_way_.wait();
  save_map(path_, prepare(map));
}

StoredMap Autosave::prepare(const std::shared_ptr<const Map>& map) const {
  StoredMap stored;
  stored.map = map;
  stored.settings = settings_;
  stored.images = images_.images_of(*map);
  return stored;
}

}  // namespace waymark

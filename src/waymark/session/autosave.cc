// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/session/autosave.h"

#include <exception>
#include <utility>

#include "waymark/base/failure.h"

namespace waymark {

Autosave::Autosave(std::filesystem::path path,
                   double interval_s,
                   std::string settings,
                   const KeyframeImageCache& images)
    : path_(std::move(path)),
      interval_(
          std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(interval_s))),
      settings_(std::move(settings)),
      images_(images),
      journal_(path_) {}

std::optional<std::string> Autosave::update(const std::shared_ptr<const Map>& map,
                                            const std::optional<InertialReport>& imu) {
  using namespace std::chrono_literals;
  if (under_way_.valid()) {
    if (under_way_.wait_for(0s) != std::future_status::ready) return std::nullopt;
    const std::string failure = finish_save();
    if (!failure.empty()) return failure;
  }
  const Clock::time_point now = Clock::now();
  const bool is_due = interval_ > Clock::duration::zero() && now - last_start_ >= interval_ &&
                      !map->keyframes().is_empty();
  if (!is_due && wanted_.empty()) return std::nullopt;
  last_start_ = now;
  served_ = std::exchange(wanted_, {});
  try {
    // The map never changes, the rest is fixed: nothing is shared that anyone writes.
    const bool is_wanted = !served_.empty();
    under_way_ = std::async(std::launch::async, [this, is_wanted, stored = prepare(map, imu)] {
      is_wanted ? journal_.save_whole(stored) : journal_.save(stored);
    });
  } catch (const std::exception&) {
    return describe_failure(std::current_exception());  // No memory or no thread is left, now.
  }
  return std::nullopt;
}

void Autosave::save_soon(std::function<void(const std::string& error)> on_done) {
  wanted_.push_back(std::move(on_done));
}

std::string Autosave::finish_save() {
  std::string failure;
  try {
    under_way_.get();
  } catch (const std::exception&) {  // Memory may run out, too.
    failure = describe_failure(std::current_exception());
  }
  for (const auto& on_done : std::exchange(served_, {})) on_done(failure);
  return failure;
}

void Autosave::save(const std::shared_ptr<const Map>& map,
                    const std::optional<InertialReport>& imu) {
  if (under_way_.valid()) finish_save();
  journal_.save_whole(prepare(map, imu));
  for (const auto& on_done : std::exchange(wanted_, {})) on_done("");
}

StoredMap Autosave::prepare(const std::shared_ptr<const Map>& map,
                            const std::optional<InertialReport>& imu) const {
  StoredMap stored;
  stored.map = map;
  stored.settings = settings_;
  stored.images = images_.images_of(*map);
  stored.imu = imu;
  return stored;
}

}  // namespace waymark

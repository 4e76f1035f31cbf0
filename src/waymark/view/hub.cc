// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/view/hub.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

#include "waymark/image/opencv_image.h"

namespace waymark {
namespace {

using namespace std::chrono_literals;

constexpr auto kStatusInterval = 1s;
constexpr int kMaxRequestsPerSecond = 50;

/// Makes one update of two.
void merge(ViewUpdate later, ViewUpdate& update) {
  if (!later.info) later.info = std::move(update.info);
  if (later.is_reset) {
    update = std::move(later);
    return;
  }
  update.info = std::move(later.info);
  if (later.map) update.map = std::move(later.map);
  std::move(later.frames.begin(), later.frames.end(), std::back_inserter(update.frames));
  std::move(later.colors.begin(), later.colors.end(), std::back_inserter(update.colors));
  if (later.image) update.image = std::move(later.image);
  update.status = later.status;
  if (!later.keyframe_images.empty()) update.keyframe_images = std::move(later.keyframe_images);
}

constexpr int kMaxWidth = 640;
constexpr int kQuality = 70;

}  // namespace

void Outbox::add_snapshot(std::span<const Message> messages) {
  scene_.assign(messages.begin(), messages.end());
  num_snapshot_messages_ = messages.size();
  num_difference_bytes_ = 0;
  is_behind_ = false;
}

void Outbox::add(const Message& message) {
  if (is_behind_) return;
  scene_.push_back(message);
  num_difference_bytes_ += message->size();
  if (num_difference_bytes_ <= max_bytes_) return;
  scene_.clear();
  num_snapshot_messages_ = 0;
  num_difference_bytes_ = 0;
  is_behind_ = true;
  status_.reset();  // It tells of what will not be sent.
}

bool Outbox::add_answer(Outgoing answer) {
  num_answer_bytes_ += answer.message->size();
  answers_.push_back(std::move(answer));
  return num_answer_bytes_ <= max_bytes_;
}

std::optional<Outbox::Outgoing> Outbox::take() {
  if (!answers_.empty()) {
    Outgoing answer = std::move(answers_.front());
    answers_.pop_front();
    num_answer_bytes_ -= answer.message->size();
    return answer;
  }
  if (!scene_.empty()) {
    Message message = std::move(scene_.front());
    scene_.pop_front();
    if (num_snapshot_messages_ > 0) {
      --num_snapshot_messages_;
    } else {
      num_difference_bytes_ -= message->size();
    }
    return Outgoing{std::move(message), false};
  }
  if (status_) return Outgoing{std::exchange(status_, nullptr), true};
  if (frame_) return Outgoing{std::exchange(frame_, nullptr), false};
  return std::nullopt;
}

void ViewHub::tick(Clock::time_point now) {
  const bool is_news = take_updates();
  take_replies();
  send_snapshots();
  if (is_news || now - last_status_ >= kStatusInterval) {
    last_status_ = now;
    if (!clients_.empty()) {
      const Message message = text(status());
      for (const auto& [number, client] : clients_) {
        if (!client->outbox.is_behind()) client->outbox.set_status(message);
      }
    }
  }
  send_frames(now);
  for (const auto& [number, client] : clients_) client->send();
  // Also while nobody watches: who comes when the session is paused sees where it stands.
  channel_.wants_image.store(true, std::memory_order_relaxed);
}

bool ViewHub::take_updates() {
  std::optional<ViewUpdate> update = channel_.updates.try_pop();
  if (!update) return false;
  while (std::optional<ViewUpdate> later = channel_.updates.try_pop()) {
    merge(*std::move(later), *update);
  }
  if (update->info) greet(*std::move(update->info));
  status_ = update->status;
  const std::vector<Message> messages = scene_.advance(*update, !clients_.empty());
  if (status_.imu) status_.imu->velocity_m_s = scene_.velocity(status_.imu->metric_submap);
  snapshot_.clear();
  for (const auto& [number, client] : clients_) {
    if (update->is_reset) {
      client->outbox.add_snapshot(messages);
    } else {
      for (const Message& message : messages) client->outbox.add(message);
    }
  }
  if (update->is_reset) image_.reset();
  if (!update->keyframe_images.empty()) keyframe_images_ = std::move(update->keyframe_images);
  if (update->image) {
    image_ = std::move(update->image);
    last_frame_.reset();
    is_frame_new_ = true;
  }
  return true;
}

void ViewHub::greet(SessionInfo info) {
  info_ = std::move(info);
  hello_ = text(format_hello(info_));
  for (const auto& [number, client] : clients_) client->outbox.add_answer(hello_);
}

void ViewHub::take_replies() {
  while (const std::optional<ViewReply> reply = channel_.replies.try_pop()) {
    const ViewRequest& request = reply->request;
    if (request.kind == ViewRequest::Kind::kImage) {
      send_image(request, reply->jpeg);
    } else {
      answer(request.client, {text(format_reply(request.number, reply->error, reply->path)), true});
    }
  }
}

void ViewHub::send_snapshots() {
  for (const auto& [number, client] : clients_) {
    if (!client->outbox.is_behind() || !client->outbox.is_empty()) continue;
    if (snapshot_.empty()) snapshot_ = scene_.snapshot();
    client->outbox.add_snapshot(snapshot_);
    client->outbox.set_status(text(status()));
    if (image_ && client->max_rate_hz > 0.0) client->outbox.set_frame(last_frame());
  }
}

void ViewHub::send_frames(Clock::time_point now) {
  if (!std::exchange(is_frame_new_, false)) return;
  for (const auto& [number, client] : clients_) {
    // A little early is right: ticks do not fall on the beat of the client.
    const std::chrono::duration<double> since = now - client->last_frame_;
    if (since.count() * client->max_rate_hz < 0.9) continue;
    client->last_frame_ = now;
    client->outbox.set_frame(last_frame());
  }
}

Message ViewHub::last_frame() {
  if (!last_frame_) last_frame_ = encode_frame(*image_, scene_.start_ns());
  return last_frame_;
}

std::uint64_t ViewHub::add(std::shared_ptr<ViewClient> client) {
  client->outbox.add_answer(hello_);
  client->outbox.add_answer(text(status()));
  client->send();
  clients_.emplace(next_client_, std::move(client));
  return next_client_++;
}

void ViewHub::receive(std::uint64_t number, std::string_view message, Clock::time_point now) {
  const auto found = clients_.find(number);
  if (found == clients_.end()) return;
  ViewClient& client = *found->second;
  if (now - client.request_window_ >= 1s) {
    client.request_window_ = now;
    client.num_requests_ = 0;
  }
  if (++client.num_requests_ > kMaxRequestsPerSecond) {
    client.close();
    return;
  }
  const ClientRequest request = parse_request(message);
  if (const auto* rate = std::get_if<SetRate>(&request.content)) client.max_rate_hz = rate->hz;
  if (Message reply = answer_to(number, request)) answer(number, {std::move(reply), true});
}

void ViewHub::answer(std::uint64_t number, Outbox::Outgoing message) {
  const auto found = clients_.find(number);
  if (found == clients_.end()) return;
  const std::shared_ptr<ViewClient> client = found->second;
  if (!client->outbox.add_answer(std::move(message))) {
    client->close();
    return;
  }
  client->send();
}

Message ViewHub::answer_to(std::uint64_t number, const ClientRequest& request) {
  if (const auto* error = std::get_if<std::string>(&request.content)) {
    return text(format_reply(request.number, *error));
  }
  if (const auto* id = std::get_if<KeyframeId>(&request.content)) {
    return text(format_keyframe(scene_.map(), *id, *request.number));
  }
  if (const auto* id = std::get_if<LandmarkId>(&request.content)) {
    return text(format_landmark(scene_.map(), *id, *request.number));
  }
  if (const auto* kind = std::get_if<ViewRequest::Kind>(&request.content)) {
    return pass_on({*kind, number, *request.number});
  }
  if (const auto* image = std::get_if<GetImage>(&request.content)) {
    return get_image({ViewRequest::Kind::kImage, number, *request.number, image->keyframe});
  }
  if (const auto* distance = std::get_if<KnownDistance>(&request.content)) {
    return pass_on({ViewRequest::Kind::kScale, number, *request.number, {}, *distance});
  }
  return text(format_reply(request.number, ""));
}

Message ViewHub::get_image(ViewRequest request) {
  if (!info_.keeps_images) {
    return text(format_reply(request.number, "images are not kept, expected --keep-images"));
  }
  if (info_.is_live) return pass_on(std::move(request));
  const auto found = keyframe_images_.find(request.keyframe);
  send_image(request, found == keyframe_images_.end() ? nullptr : found->second);
  return nullptr;
}

void ViewHub::send_image(const ViewRequest& request, const SharedJpeg& jpeg) {
  const auto client = clients_.find(request.client);
  if (client == clients_.end()) return;
  const Keyframe* keyframe = scene_.map().keyframes().find(request.keyframe);
  if (!keyframe || !jpeg) {
    const char* error = keyframe ? "its image was not kept" : "no such keyframe";
    answer(request.client, {text(format_reply(request.number, error)), true});
  } else if (!client->second->outbox.has_room_for(jpeg->size())) {
    answer(request.client, {text(format_reply(request.number, "too many images wait")), true});
  } else {
    answer(request.client,
           {encode_keyframe_image(*keyframe, request.keyframe, request.number, *jpeg), false});
  }
}

Message ViewHub::pass_on(ViewRequest request) {
  const bool is_save = request.kind == ViewRequest::Kind::kSave;
  const bool is_scale = request.kind == ViewRequest::Kind::kScale;
  if (is_scale && !info_.can_scale) {
    return text(format_reply(request.number, "no file was named, expected waymark view MAP -o"));
  }
  if (!info_.is_live && !is_scale) return text(format_reply(request.number, "this is a saved map"));
  if (!status_.doing.empty() && request.kind != ViewRequest::Kind::kStop) {
    return text(format_reply(request.number, "there is no session yet: " + status_.doing));
  }
  if (is_save && !info_.can_save) {
    return text(format_reply(request.number, "no file was named, expected --map-out"));
  }
  if (!channel_.requests.try_push(request)) {
    return text(format_reply(request.number, "too many requests wait"));
  }
  const bool is_answered_later = is_save || is_scale || request.kind == ViewRequest::Kind::kImage;
  return is_answered_later ? nullptr : text(format_reply(request.number, ""));
}

bool ViewHub::is_idle() const {
  return std::ranges::all_of(clients_,
                             [](const auto& entry) { return entry.second->outbox.is_empty(); });
}

void ViewHub::close_clients() {
  const auto clients = clients_;
  for (const auto& [number, client] : clients) client->close();
}

std::string encode_preview(const Image& image) {
  if (image.view().is_empty()) return {};
  const cv::Mat whole = mat_of(image.view());
  cv::Mat small = whole;
  if (image.width_px > kMaxWidth) {
    const double scale = static_cast<double>(kMaxWidth) / image.width_px;
    const int height = std::max(1, static_cast<int>(std::lround(scale * image.height_px)));
    cv::resize(whole, small, {kMaxWidth, height}, 0, 0, cv::INTER_AREA);
  }
  std::vector<std::uint8_t> bytes;
  cv::imencode(".jpg", small, bytes, {cv::IMWRITE_JPEG_QUALITY, kQuality});
  return {bytes.begin(), bytes.end()};
}

Message encode_frame(const DrawnFrame& frame, std::int64_t start_ns) {
  const std::string jpeg = encode_preview(frame.image);
  const std::size_t num_features = frame.features ? frame.features->num_primary : 0;
  MessageWriter writer(MessageKind::kFrame, num_features);
  writer.add(frame.frame.value);
  writer.add(seconds_between(start_ns, frame.timestamp_ns));
  writer.add(static_cast<std::uint32_t>(frame.width_px));
  writer.add(static_cast<std::uint32_t>(frame.height_px));
  writer.add(static_cast<std::uint32_t>(jpeg.size()));
  for (std::size_t i = 0; i < num_features; ++i) {
    writer.add(frame.features->keypoints[i].x_px);
    writer.add(frame.features->keypoints[i].y_px);
  }
  for (std::size_t i = 0; i < num_features; ++i) {
    const bool sees = i < frame.landmarks.size() && frame.landmarks[i].is_valid();
    writer.add(static_cast<std::uint8_t>(sees));
  }
  writer.pad_to(4);
  writer.add_bytes(jpeg);
  return writer.finish();
}

}  // namespace waymark

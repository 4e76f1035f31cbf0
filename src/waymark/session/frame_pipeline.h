// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <memory>
#include <optional>
#include <thread>

#include "waymark/base/prefetch.h"
#include "waymark/input/input.h"

namespace waymark {

/// So many frames may be prepared before their turn. More cores than half of that have nothing to
/// do.
inline constexpr std::size_t kMaxPrepared = 32;

/// What becomes of frames before their turn.
struct EarlyStages {
  std::size_t num_prepared = 0;  ///< Frames that wait for their turn, kMaxPrepared at most.
  /// Threads that decode, at least one; none where no frame waits, or the input lets no other
  /// thread decode.
  unsigned num_decoders = std::thread::hardware_concurrency();
  std::function<void(InputFrame&)> on_decoded;  ///< May take what is not fed; empty: nothing.
  /// Of frames without a fault where frames wait. The images last as long as the owner.
  std::function<void(const FrameImages&, std::shared_ptr<const void> owner)> prepare;
};

/// Frames of an input on their way, in order:
///
///     input -> decode -> prepare -> feed
///
/// decode: a team makes images of files, a few frames at once. prepare: who is to be fed may look
/// at the images meanwhile. feed: it is the frame's turn. All but decoding is done by the thread
/// that asks.
class FramePipeline {
 public:
  /// images: those of the frame; none with a fault.
  using Feed = std::function<void(const InputFrame& frame, const FrameImages& images)>;

  /// The input is borrowed.
  FramePipeline(Input& input, EarlyStages stages);

  /// Feeds the next frame; false at the end. Throws what the input threw, after the frames before.
  bool feed_next(const Feed& feed);

 private:
  struct Prepared {
    InputFrame frame;
    FrameImages images;  ///< Borrowed of the frame.
  };

  void prepare_next();
  std::optional<InputFrame> decode_next();
  void begin_decoding();

  Input& input_;
  const EarlyStages stages_;
  std::deque<std::shared_ptr<const Prepared>> prepared_;
  std::exception_ptr failure_;                   ///< Of the input, once the frames before were fed.
  bool has_ended_ = false;                       ///< There is nothing more to prepare,
  bool is_read_ = false;                         ///< nor to begin to decode.
  std::optional<Prefetch<InputFrame>> decoded_;  ///< Last, so that it ends first.
};

}  // namespace waymark

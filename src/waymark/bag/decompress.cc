// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "waymark/bag/decompress.h"

#include <bzlib.h>
#include <lz4frame.h>
#include <zstd.h>

#include <algorithm>
#include <memory>

namespace waymark {
namespace {

constexpr std::size_t kStep = std::size_t{1} << 20;

/// What a step of a library did.
struct Step {
  std::size_t consumed = 0;
  std::size_t produced = 0;
  bool is_good = true;
  bool is_end = false;
};

/// Lets a library work until the content is complete. step(input, output, room) decompresses what
/// it can.
template <class Stepper>
std::optional<std::string> decompress_by(Stepper&& step, std::string_view bytes, std::size_t size) {
  std::string content;
  std::size_t num_bytes = 0;
  while (true) {
    if (num_bytes == content.size()) {
      // One byte more than stated shows content that is too long.
      content.resize(std::min(size + 1, std::max(2 * num_bytes, kStep)));
    }
    const Step done = step(bytes, content.data() + num_bytes, content.size() - num_bytes);
    bytes.remove_prefix(done.consumed);
    num_bytes += done.produced;
    if (!done.is_good || num_bytes > size) return std::nullopt;
    if (done.is_end && (bytes.empty() || num_bytes == size)) break;
    if (done.consumed == 0 && done.produced == 0 && !done.is_end) return std::nullopt;
  }
  if (num_bytes != size) return std::nullopt;
  content.resize(size);
  return content;
}

std::optional<std::string> decompress_lz4(std::string_view bytes, std::size_t size) {
  LZ4F_dctx* created = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&created, LZ4F_VERSION))) return std::nullopt;
  const std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)> context(
      created, LZ4F_freeDecompressionContext);
  const auto step = [&](std::string_view input, char* output, std::size_t room) {
    Step done{input.size(), room, true, false};
    const std::size_t hint = LZ4F_decompress(
        context.get(), output, &done.produced, input.data(), &done.consumed, nullptr);
    done.is_good = !LZ4F_isError(hint);
    done.is_end = hint == 0;
    return done;
  };
  return decompress_by(step, bytes, size);
}

std::optional<std::string> decompress_zstd(std::string_view bytes, std::size_t size) {
  const std::unique_ptr<ZSTD_DStream, decltype(&ZSTD_freeDStream)> stream(ZSTD_createDStream(),
                                                                          ZSTD_freeDStream);
  if (!stream) return std::nullopt;
  const auto step = [&](std::string_view input, char* output, std::size_t room) {
    ZSTD_inBuffer in{input.data(), input.size(), 0};
    ZSTD_outBuffer out{output, room, 0};
    const std::size_t hint = ZSTD_decompressStream(stream.get(), &out, &in);
    return Step{in.pos, out.pos, !ZSTD_isError(hint), hint == 0};
  };
  return decompress_by(step, bytes, size);
}

std::optional<std::string> decompress_bz2(std::string_view bytes, std::size_t size) {
  bz_stream stream = {};
  if (BZ2_bzDecompressInit(&stream, 0, 0) != BZ_OK) return std::nullopt;
  const std::unique_ptr<bz_stream, decltype(&BZ2_bzDecompressEnd)> guard(&stream,
                                                                         BZ2_bzDecompressEnd);
  const auto step = [&](std::string_view input, char* output, std::size_t room) {
    stream.next_in = const_cast<char*>(input.data());  // Is only read.
    stream.avail_in = static_cast<unsigned>(std::min(input.size(), kStep));
    stream.next_out = output;
    stream.avail_out = static_cast<unsigned>(std::min(room, kStep));
    const unsigned offered = stream.avail_in;
    const unsigned room_offered = stream.avail_out;
    const int status = BZ2_bzDecompress(&stream);
    return Step{offered - stream.avail_in,
                room_offered - stream.avail_out,
                status == BZ_OK || status == BZ_STREAM_END,
                status == BZ_STREAM_END};
  };
  return decompress_by(step, bytes, size);
}

}  // namespace

std::optional<std::string> decompress(Compression compression,
                                      std::string_view bytes,
                                      std::uint64_t size) {
  if (size > kMaxChunkBytes) return std::nullopt;
  switch (compression) {
    case Compression::kLz4:
      return decompress_lz4(bytes, static_cast<std::size_t>(size));
    case Compression::kZstd:
      return decompress_zstd(bytes, static_cast<std::size_t>(size));
    case Compression::kBz2:
      return decompress_bz2(bytes, static_cast<std::size_t>(size));
    case Compression::kNone:
      break;
  }
  if (bytes.size() != size) return std::nullopt;
  return std::string(bytes);
}

}  // namespace waymark

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// How well and how fast places are found again:
//   waymark_place_benchmark DATA_DIR recall|growth
// DATA_DIR holds the looped sequences below, each with camchain.yaml and groundtruth.txt.
//
// recall: part of the queries that have a keyframe within 1 m and 30 degrees, at least 30 keyframes
// away in time, of which such a one is the first, among the first 5, among the first 10 candidates.
// "alone": the index holds the sequence only; "all": it holds all sequences.
//
// growth: time of a query (median and 95 % quantile, thread time) and recall within 10 of the
// bookstore's queries, also of poor ones (400 features, 1/16 of the bits flipped), while the map
// grows by the same sequences again, each bit flipped with a chance of 1/16
// ("revisited"), or with the bits of all descriptors in another order, which makes them other
// places with like statistics ("elsewhere").

#include <time.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <memory>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "waymark/base/config.h"
#include "waymark/base/rng.h"
#include "waymark/evaluate/association.h"
#include "waymark/features/features.h"
#include "waymark/features/frame_builder.h"
#include "waymark/geometry/rigid3.h"
#include "waymark/input/input.h"
#include "waymark/place/place_index.h"
#include "waymark/results/trajectory.h"

namespace {

using namespace waymark;

/// What a keyframe looked like, and where its camera truly was.
struct RecordedPlace {
  FeatureArray<Descriptor> descriptors;
  Rigid3 world_from_camera;
};

using Places = std::vector<RecordedPlace>;

constexpr std::size_t kNumCandidates = 10;
constexpr std::size_t kMinKeyframesAway = 30;

struct Sequence {
  std::string name;
  std::size_t every = 5;
};

// The track is driven at 1 m per frame, so that there each frame is needed.
const std::array<Sequence, 5> kLooped = {{{"sim_bookstore_mono"},
                                          {"sim_house_rgbd"},
                                          {"sim_track_stereo", 1},
                                          {"sim_atrium_360"},
                                          {"sim_warehouse_fisheye_stereo"}}};
const char* const kQueries = "sim_bookstore_query_mono";

/// Every n-th frame of a sequence that has a true pose (camera 0, 1000 features). The folder holds
/// an input, camchain.yaml and groundtruth.txt. Throws InputError.
Places read_places(const std::filesystem::path& folder, std::size_t every) {
  InputOptions options;
  options.setup = Setup::kMono;
  options.every = every;
  options.calibration =
      read_camchain(parse_config(ConfigSource::from_file(folder / "camchain.yaml")));
  const std::vector<StampedPose> truth = read_trajectory(folder / "groundtruth.txt");
  const std::unique_ptr<Input> input = open_input(folder, options);
  Rig rig = make_rig(input->info().calibration.value());
  rig.cameras.resize(1);
  FrameBuilder builder(rig, FrameSettings{});

  Places places;
  while (const std::optional<InputFrame> frame = input->next()) {
    if (frame->fault != FrameFault::kNone) continue;
    const std::array<StampedPose, 1> stamp = {StampedPose{frame->timestamp_ns, Rigid3()}};
    const std::vector<TimeMatch> match = match_by_time(stamp, truth, 20'000'000);
    if (match.empty()) continue;
    FrameImages images;
    images.image0 = frame->images.at(0).view();
    if (frame->mask) images.mask = frame->mask->view();
    places.push_back(
        {builder.build(images)->descriptors, truth[match.front().groundtruth].world_from_camera});
  }
  return places;
}

double thread_time_ms() {
  timespec time;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) * 1e3 + static_cast<double>(time.tv_nsec) * 1e-6;
}

double quantile(std::vector<double> values, double part) {
  std::sort(values.begin(), values.end());
  return values.at(static_cast<std::size_t>(part * static_cast<double>(values.size() - 1)));
}

bool is_same_place(const RecordedPlace& a, const RecordedPlace& b) {
  const double angle = a.world_from_camera.rotation.angularDistance(b.world_from_camera.rotation);
  const double distance =
      (a.world_from_camera.translation - b.world_from_camera.translation).norm();
  return distance <= 1.0 && angle <= 30.0 * std::numbers::pi / 180.0;
}

/// Where the candidates of queries first were right.
struct Recall {
  std::size_t num_queries = 0;
  std::array<std::size_t, kNumCandidates> first_at = {};
  std::vector<double> times_ms;

  double within(std::size_t count) const {
    std::size_t sum = 0;
    for (std::size_t i = 0; i < count; ++i) sum += first_at[i];
    return static_cast<double>(sum) / static_cast<double>(std::max<std::size_t>(num_queries, 1));
  }
};

/// One sequence among all that an index holds.
struct Held {
  const Places* places = nullptr;
  std::size_t begin = 0;  ///< Number of its first keyframe in the index.
};

/// Keyframes are numbered in the order they are added.
void add(PlaceIndex& index, std::span<const Descriptor> descriptors) {
  index.add({static_cast<std::uint32_t>(index.size())}, SubmapId{0}, descriptors);
}

void add_all(PlaceIndex& index, const Places& places) {
  for (const RecordedPlace& place : places) add(index, place.descriptors);
}

void ask(const PlaceIndex& index,
         const Held& held,
         const RecordedPlace& query,
         std::size_t hidden_begin,
         std::size_t hidden_end,
         Recall& recall) {
  const Places& places = *held.places;
  bool has_answer = false;
  for (std::size_t i = 0; i < places.size() && !has_answer; ++i) {
    const bool is_hidden = held.begin + i >= hidden_begin && held.begin + i < hidden_end;
    has_answer = !is_hidden && is_same_place(query, places[i]);
  }
  if (!has_answer) return;
  ++recall.num_queries;
  const auto is_hidden = [&](const PlaceRow& row) {
    return row.keyframe.value >= hidden_begin && row.keyframe.value < hidden_end;
  };
  const double start = thread_time_ms();
  const std::vector<PlaceCandidate> found =
      index.find(query.descriptors, {.max_candidates = kNumCandidates, .is_excluded = is_hidden});
  recall.times_ms.push_back(thread_time_ms() - start);
  for (std::size_t i = 0; i < found.size(); ++i) {
    const std::size_t row = found[i].keyframe.value;
    const bool is_held = row >= held.begin && row < held.begin + places.size();
    if (!is_held || !is_same_place(query, places[row - held.begin])) continue;
    ++recall.first_at[i];
    return;
  }
}

Recall ask_itself(const PlaceIndex& index, const Held& held) {
  Recall recall;
  for (std::size_t i = 0; i < held.places->size(); ++i) {
    const std::size_t row = held.begin + i;
    const std::size_t hidden_begin = row - std::min(row, kMinKeyframesAway - 1);
    ask(index, held, (*held.places)[i], hidden_begin, row + kMinKeyframesAway, recall);
  }
  return recall;
}

Recall ask_all(const PlaceIndex& index, const Held& held, const Places& queries) {
  Recall recall;
  for (const RecordedPlace& query : queries) ask(index, held, query, 0, 0, recall);
  return recall;
}

void print_recall(const std::string& name, const char* held, const Recall& recall) {
  std::printf("  %-32s %-6s %4zu queries  first %.3f  5 %.3f  10 %.3f  %8.2f ms\n",
              name.c_str(),
              held,
              recall.num_queries,
              recall.within(1),
              recall.within(5),
              recall.within(10),
              quantile(recall.times_ms, 0.5));
  std::fflush(stdout);
}

void measure_recall(const std::vector<Places>& sequences, const Places& queries) {
  PlaceIndex all;
  for (const Places& places : sequences) add_all(all, places);
  std::size_t begin = 0;
  for (std::size_t i = 0; i < sequences.size(); ++i) {
    PlaceIndex alone;
    add_all(alone, sequences[i]);
    print_recall(kLooped[i].name, "alone", ask_itself(alone, {&sequences[i], 0}));
    print_recall(kLooped[i].name, "all", ask_itself(all, {&sequences[i], begin}));
    if (i == 0) {
      print_recall(kQueries, "alone", ask_all(alone, {&sequences[i], 0}, queries));
      print_recall(kQueries, "all", ask_all(all, {&sequences[i], 0}, queries));
    }
    begin += sequences[i].size();
  }
}

void flip_bits(FeatureArray<Descriptor>& descriptors, Rng& rng) {
  for (Descriptor& descriptor : descriptors) {
    for (std::uint64_t& word : descriptor) {
      word ^= rng.next() & rng.next() & rng.next() & rng.next();
    }
  }
}

void reorder_bits(FeatureArray<Descriptor>& descriptors,
                  const std::array<std::size_t, 256>& order) {
  for (Descriptor& descriptor : descriptors) {
    Descriptor reordered = {};
    for (std::size_t bit = 0; bit < order.size(); ++bit) {
      const std::uint64_t value = descriptor[order[bit] / 64] >> (order[bit] % 64) & 1;
      reordered[bit / 64] |= value << (bit % 64);
    }
    descriptor = reordered;
  }
}

std::array<std::size_t, 256> random_order(Rng& rng) {
  std::array<std::size_t, 256> order;
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  for (std::uint32_t i = 255; i > 0; --i) std::swap(order[i], order[rng.below(i + 1)]);
  return order;
}

/// Prints what the index costs besides its answers.
PlaceIndex build(const std::vector<FeatureArray<Descriptor>>& keyframes) {
  PlaceIndex index;
  std::vector<double> times_ms;
  for (const FeatureArray<Descriptor>& descriptors : keyframes) {
    const double start = thread_time_ms();
    add(index, descriptors);
    times_ms.push_back(thread_time_ms() - start);
  }
  const double start = thread_time_ms();
  const PlaceIndex copy = index;
  const double copy_us = (thread_time_ms() - start) * 1e3;
  std::printf(
      "  %5zu keyframes, %2zu segments, %.1f kB each, add %.2f ms, at most %.1f, copy %.1f us",
      copy.size(),
      copy.num_segments(),
      static_cast<double>(copy.num_bytes()) / 1e3 / static_cast<double>(copy.size()),
      quantile(times_ms, 0.5),
      quantile(times_ms, 1.0),
      copy_us);
  return index;
}

/// The sequences once, then again and again, changed each time.
std::vector<FeatureArray<Descriptor>> grow(const std::vector<Places>& sequences,
                                           std::size_t count,
                                           bool is_elsewhere) {
  std::vector<FeatureArray<Descriptor>> keyframes;
  for (std::uint64_t round = 0; keyframes.size() < count; ++round) {
    Rng rng(round, 0);
    const std::array<std::size_t, 256> order = random_order(rng);
    for (const Places& places : sequences) {
      for (const RecordedPlace& place : places) {
        keyframes.push_back(place.descriptors);
        if (round > 0 && is_elsewhere) reorder_bits(keyframes.back(), order);
        if (round > 0 && !is_elsewhere) flip_bits(keyframes.back(), rng);
      }
    }
  }
  keyframes.resize(count);
  return keyframes;
}

/// Places as true as the first of them, for the keyframes that grow() made of them.
Places repeat(const std::vector<Places>& sequences, std::size_t count) {
  Places truth;
  while (truth.size() < count) {
    for (std::size_t i = 0; i < sequences.size(); ++i) {
      for (RecordedPlace place : sequences[i]) {
        place.descriptors.clear();
        if (i > 0) place.world_from_camera.translation.setConstant(1e6);
        truth.push_back(place);
      }
    }
  }
  truth.resize(count);
  return truth;
}

/// What is left of queries in bad light: 400 features, of which 1/16 of the bits are wrong.
Places impoverish(const Places& queries) {
  Places poor = queries;
  Rng rng(1, 1);
  for (RecordedPlace& query : poor) {
    for (std::uint32_t i = 0; i < 400 && i < query.descriptors.size(); ++i) {
      const auto rest = static_cast<std::uint32_t>(query.descriptors.size()) - i;
      std::swap(query.descriptors[i], query.descriptors[i + rng.below(rest)]);
    }
    query.descriptors.resize(std::min<std::size_t>(400, query.descriptors.size()));
    flip_bits(query.descriptors, rng);
  }
  return poor;
}

void measure_growth(const std::vector<Places>& sequences, const Places& queries) {
  const Places poor = impoverish(queries);
  for (const bool is_elsewhere : {false, true}) {
    std::printf("%s\n", is_elsewhere ? "elsewhere" : "revisited");
    for (const std::size_t count : {500, 1000, 2000, 3000, 4000, 5000, 8000}) {
      const PlaceIndex index = build(grow(sequences, count, is_elsewhere));
      const Places truth =
          is_elsewhere ? repeat({sequences[0]}, sequences[0].size()) : repeat(sequences, count);
      const Recall recall = ask_all(index, {&truth, 0}, queries);
      std::printf("  query %.2f ms, p95 %.2f  recall %.3f, poor %.3f\n",
                  quantile(recall.times_ms, 0.5),
                  quantile(recall.times_ms, 0.95),
                  recall.within(10),
                  ask_all(index, {&truth, 0}, poor).within(10));
      std::fflush(stdout);
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  const std::string task = argc > 2 ? argv[2] : "";
  if (task != "recall" && task != "growth") {
    std::fprintf(stderr, "usage: waymark_place_benchmark DATA_DIR recall|growth\n");
    return 2;
  }
  try {
    const std::filesystem::path data = argv[1];
    std::vector<Places> sequences;
    for (const Sequence& sequence : kLooped) {
      sequences.push_back(read_places(data / sequence.name, sequence.every));
    }
    const Places queries = read_places(data / kQueries, 1);
    (task == "recall" ? measure_recall : measure_growth)(sequences, queries);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "waymark_place_benchmark: %s\n", error.what());
    return 1;
  }
  return 0;
}

// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
//
// A map of a town that grows and is saved after every hundred keyframes, until it is killed:
//   waymark_town_autosave NUM_KEYFRAMES FILE
// Goes on with the file where there is one. A line for each state that is safe: its keyframes, what
// saving it took of the processor and by the clock in seconds, and the bytes of file and journal.
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <filesystem>

#include "repeated_map.h"
#include "waymark/mapfile/map_file.h"
#include "waymark/mapfile/map_journal.h"
#include "waymark/simulate/testing/town_map.h"

namespace waymark {
namespace {

namespace fs = std::filesystem;

constexpr std::uint32_t kNumNew = 100;

std::uintmax_t bytes_of(const fs::path& file) {
  std::error_code is_missing;
  const std::uintmax_t bytes = fs::file_size(file, is_missing);
  return is_missing ? 0 : bytes;
}

void print_state(const Map& map, const fs::path& file, double cpu_s, double clock_s) {
  fs::path journal = file;
  journal += ".journal";
  std::printf("%zu keyframes, %.3f s, %.3f s, %ju and %ju bytes\n",
              map.keyframes().size(),
              cpu_s,
              clock_s,
              bytes_of(file),
              bytes_of(journal));
  std::fflush(stdout);
}

void go_on_saving(std::size_t num_keyframes, const fs::path& file) {
  if (!fs::exists(file)) {
    const TownMap town = make_town_map({.num_keyframes = num_keyframes});
    save_map(file, {.map = town.map, .settings = {}, .images = {}});
  }
  StoredMap stored = load_map(file);
  print_state(*stored.map, file, 0.0, 0.0);
  MapJournal journal(file);
  while (true) {
    Map map = Map::thaw(*stored.map);
    repeat_last_keyframes(map, kNumNew);
    stored.map = map.freeze();
    const std::clock_t cpu = std::clock();
    const auto clock = std::chrono::steady_clock::now();
    journal.save(stored);
    const double clock_s =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - clock).count();
    print_state(
        *stored.map, file, static_cast<double>(std::clock() - cpu) / CLOCKS_PER_SEC, clock_s);
  }
}

}  // namespace
}  // namespace waymark

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: %s NUM_KEYFRAMES FILE\n", argv[0]);
    return 2;
  }
  try {
    waymark::go_on_saving(std::strtoul(argv[1], nullptr, 10), argv[2]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return 1;
  }
}

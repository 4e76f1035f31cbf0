// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "place_designs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <map>

#include "waymark/base/rng.h"
#include "waymark/image/hamming.h"
#include "waymark/place/place_index.h"

namespace waymark {
namespace {

std::vector<std::size_t> best_of(const std::vector<double>& scores,
                                 std::size_t count,
                                 std::size_t begin,
                                 std::size_t end) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < scores.size(); ++i) {
    if (scores[i] > 0.0 && (i < begin || i >= end)) order.push_back(i);
  }
  const auto middle = order.begin() + static_cast<std::ptrdiff_t>(std::min(count, order.size()));
  std::partial_sort(order.begin(), middle, order.end(), [&](std::size_t a, std::size_t b) {
    return scores[a] != scores[b] ? scores[a] > scores[b] : a < b;
  });
  order.erase(middle, order.end());
  return order;
}

class IndexDesign : public PlaceDesign {
 public:
  void add(std::span<const Descriptor> descriptors) override {
    index_.add({static_cast<std::uint32_t>(index_.size())}, SubmapId{0}, descriptors);
  }

  std::vector<std::size_t> find(std::span<const Descriptor> descriptors,
                                std::size_t count,
                                std::size_t begin,
                                std::size_t end) const override {
    PlaceQuery query;
    query.max_candidates = count;
    query.is_excluded = [&](const PlaceRow& row) {
      return row.keyframe.value >= begin && row.keyframe.value < end;
    };
    std::vector<std::size_t> found;
    for (const PlaceCandidate& candidate : index_.find(descriptors, query)) {
      found.push_back(candidate.keyframe.value);
    }
    return found;
  }

 private:
  PlaceIndex index_;
};

class VocabularyTree : public PlaceDesign {
 public:
  explicit VocabularyTree(std::size_t num_training) : num_training_(num_training) {}

  void add(std::span<const Descriptor> descriptors) override {
    keyframes_.emplace_back(descriptors.begin(), descriptors.end());
  }

  void finish() override {
    std::vector<Descriptor> sample;
    for (std::size_t i = 0; i < std::min(num_training_, keyframes_.size()); ++i) {
      sample.insert(sample.end(), keyframes_[i].begin(), keyframes_[i].end());
    }
    Rng rng(1, 0);
    for (std::size_t i = 0; sample.size() > kMaxSample && i < kMaxSample; ++i) {
      std::swap(sample[i], sample[i + rng.below(static_cast<std::uint32_t>(sample.size() - i))]);
    }
    sample.resize(std::min(sample.size(), kMaxSample));
    nodes_.push_back({});
    split(0, sample, 1, rng);
    fill_inverted_file();
  }

  std::vector<std::size_t> find(std::span<const Descriptor> descriptors,
                                std::size_t count,
                                std::size_t begin,
                                std::size_t end) const override {
    std::vector<double> scores(keyframes_.size(), 0.0);
    for (const auto& [word, weight] : weigh(descriptors)) {
      for (const Posting& posting : postings_[word]) {
        scores[posting.keyframe] +=
            std::abs(weight) + std::abs(posting.weight) - std::abs(weight - posting.weight);
      }
    }
    return best_of(scores, count, begin, end);
  }

 private:
  static constexpr std::size_t kBranches = 10;
  static constexpr int kLevels = 5;
  static constexpr std::size_t kMaxSample = 500'000;
  static constexpr int kRounds = 5;

  struct Node {
    std::vector<Descriptor> centres;
    std::vector<std::size_t> children;
    std::size_t word = 0;
  };
  struct Posting {
    std::size_t keyframe;
    double weight;
  };

  static std::size_t nearest(const Descriptor& descriptor, std::span<const Descriptor> centres) {
    std::array<std::uint16_t, kBranches> distance = {};
    const std::span<std::uint16_t> used(distance.data(), centres.size());
    distances(descriptor, centres, used);
    return static_cast<std::size_t>(std::min_element(used.begin(), used.end()) - used.begin());
  }

  static Descriptor majority(std::span<const Descriptor> descriptors) {
    std::array<std::size_t, kDescriptorBits> counts = {};
    for (const Descriptor& descriptor : descriptors) {
      for (std::size_t bit = 0; bit < counts.size(); ++bit) {
        counts[bit] += descriptor[bit / 64] >> (bit % 64) & 1;
      }
    }
    Descriptor result = {};
    for (std::size_t bit = 0; bit < counts.size(); ++bit) {
      if (2 * counts[bit] > descriptors.size()) result[bit / 64] |= std::uint64_t{1} << (bit % 64);
    }
    return result;
  }

  using Groups = std::array<std::vector<Descriptor>, kBranches>;

  static Groups group(std::span<const Descriptor> descriptors, std::vector<Descriptor>& centres) {
    Groups groups;
    for (int round = 0; round < kRounds; ++round) {
      for (auto& members : groups) members.clear();
      for (const Descriptor& descriptor : descriptors) {
        groups[nearest(descriptor, centres)].push_back(descriptor);
      }
      for (std::size_t i = 0; i < centres.size() && round + 1 < kRounds; ++i) {
        if (!groups[i].empty()) centres[i] = majority(groups[i]);
      }
    }
    return groups;
  }

  void split(std::size_t node, std::span<const Descriptor> descriptors, int level, Rng& rng) {
    if (level > kLevels || descriptors.size() <= kBranches) {
      nodes_[node].word = num_words_++;
      return;
    }
    std::vector<Descriptor> centres;
    for (std::size_t i = 0; i < kBranches; ++i) {
      centres.push_back(descriptors[rng.below(static_cast<std::uint32_t>(descriptors.size()))]);
    }
    const Groups groups = group(descriptors, centres);
    nodes_[node].centres = centres;
    for (const auto& members : groups) {
      const std::size_t child = nodes_.size();
      nodes_.push_back({});
      nodes_[node].children.push_back(child);
      split(child, members, level + 1, rng);
    }
  }

  std::size_t word_of(const Descriptor& descriptor) const {
    std::size_t node = 0;
    while (!nodes_[node].children.empty()) {
      node = nodes_[node].children[nearest(descriptor, nodes_[node].centres)];
    }
    return nodes_[node].word;
  }

  std::map<std::size_t, double> weigh(std::span<const Descriptor> descriptors) const {
    std::map<std::size_t, double> weights;
    for (const Descriptor& descriptor : descriptors) weights[word_of(descriptor)] += 1.0;
    double sum = 0.0;
    for (auto& [word, weight] : weights) sum += (weight *= idf_[word]);
    for (auto& [word, weight] : weights) weight /= std::max(sum, 1e-12);
    return weights;
  }

  void fill_inverted_file() {
    std::vector<std::vector<std::size_t>> words(keyframes_.size());
    std::vector<std::size_t> num_keyframes(num_words_, 0);
    for (std::size_t i = 0; i < keyframes_.size(); ++i) {
      for (const Descriptor& descriptor : keyframes_[i]) words[i].push_back(word_of(descriptor));
      std::sort(words[i].begin(), words[i].end());
      words[i].erase(std::unique(words[i].begin(), words[i].end()), words[i].end());
      for (const std::size_t word : words[i]) ++num_keyframes[word];
    }
    for (const std::size_t count : num_keyframes) {
      idf_.push_back(std::log(static_cast<double>(keyframes_.size()) /
                              static_cast<double>(std::max<std::size_t>(count, 1))));
    }
    postings_.resize(num_words_);
    for (std::size_t i = 0; i < keyframes_.size(); ++i) {
      for (const auto& [word, weight] : weigh(keyframes_[i]))
        postings_[word].push_back({i, weight});
    }
  }

  std::size_t num_training_;
  std::vector<std::vector<Descriptor>> keyframes_;
  std::vector<Node> nodes_;
  std::size_t num_words_ = 0;
  std::vector<double> idf_;
  std::vector<std::vector<Posting>> postings_;
};

class ExhaustiveSearch : public PlaceDesign {
 public:
  void add(std::span<const Descriptor> descriptors) override {
    keyframes_.emplace_back(descriptors.begin(), descriptors.end());
  }

  std::vector<std::size_t> find(std::span<const Descriptor> descriptors,
                                std::size_t count,
                                std::size_t begin,
                                std::size_t end) const override {
    std::vector<double> scores(keyframes_.size(), 0.0);
    std::vector<std::uint16_t> distance;
    std::vector<std::size_t> voted;
    for (const Descriptor& descriptor : descriptors) {
      voted.clear();
      for (std::size_t i = 0; i < keyframes_.size(); ++i) {
        distance.resize(keyframes_[i].size());
        distances(descriptor, keyframes_[i], distance);
        const auto least = std::min_element(distance.begin(), distance.end());
        if (least != distance.end() && *least <= kMaxDistance) voted.push_back(i);
      }
      const auto share = static_cast<double>(keyframes_.size()) /
                         static_cast<double>(std::max<std::size_t>(voted.size(), 1));
      for (const std::size_t i : voted) scores[i] += std::log1p(share);
    }
    return best_of(scores, count, begin, end);
  }

 private:
  static constexpr int kMaxDistance = 50;

  std::vector<std::vector<Descriptor>> keyframes_;
};

}  // namespace

std::unique_ptr<PlaceDesign> make_place_index() { return std::make_unique<IndexDesign>(); }

std::unique_ptr<PlaceDesign> make_vocabulary_tree(std::size_t num_training) {
  return std::make_unique<VocabularyTree>(num_training);
}

std::unique_ptr<PlaceDesign> make_exhaustive_search() {
  return std::make_unique<ExhaustiveSearch>();
}

}  // namespace waymark

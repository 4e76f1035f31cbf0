// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "waymark/evaluate/evaluation.h"
#include "waymark/results/results.h"

namespace waymark {

/// How well something went, in words.
enum class Grade { kGood, kCheck, kBad };

/// "good", "check", "bad".
std::string_view to_string(Grade grade);

/// One thing that was judged.
struct Judgement {
  std::string name;  ///< Of what, for example "Coverage".
  Grade grade = Grade::kGood;
  std::string value;  ///< With its unit.
  std::string why;    ///< What the value means, and from where on it is another grade.
};

/// A run as a whole is as good as the worst of what was judged.
struct Assessment {
  Grade grade = Grade::kGood;
  std::vector<Judgement> judgements;  ///< In the order of reading.

  /// The names of what has this grade, "coverage, losses".
  std::string names_of(Grade wanted) const;
};

/// Judges a run by its figures. truth: the comparison with the ground truth; null without one.
Assessment judge(const FrameTable& table, const RunSummary& summary, const Evaluation* truth);

}  // namespace waymark

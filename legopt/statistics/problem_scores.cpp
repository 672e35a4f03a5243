#include "legopt/statistics/problem_scores.h"

#include <limits>

#include "legopt/statistics/checks.h"

namespace legopt::statistics {

double ProblemScore::Share() const { return finished() == 0 ? kNaN : static_cast<double>(solved) / finished(); }

double ProblemScore::MeanSolvedValue() const {
  if (finished() == 0) return kNaN;
  return solved == 0 ? std::numeric_limits<double>::infinity() : solved_sum / solved;
}

double ProblemScore::Charged(double charge) const {
  RequireNumbers("Charged", "charge", {&charge, 1}, {.lowest = 0.0, .infinity = true});
  if (finished() == 0) return kNaN;
  return (solved_sum + (failed == 0 ? 0.0 : failed * charge)) / finished();
}

double ProblemScore::Spent() const { return finished() == 0 ? kNaN : (solved_sum + failed_sum) / finished(); }

double MeanCharged(std::span<const ProblemScore> problems, double charge) {
  double sum = 0.0;
  int counted = 0;
  for (const ProblemScore& problem : problems) {
    if (problem.finished() == 0) continue;
    sum += problem.Charged(charge);
    ++counted;
  }
  return counted == 0 ? kNaN : sum / counted;
}

ProblemScore ScoreOf(std::span<const Repetition> repetitions) {
  ProblemScore score;
  for (const Repetition& run : repetitions) {
    if (run.end == RunOutcome::kMissing) {
      ++score.missing;
      continue;
    }
    RequireNumbers("ScoreOf", "value", {&run.value, 1}, {.lowest = 0.0});
    const bool solved = run.end == RunOutcome::kSolved;
    ++(solved ? score.solved : score.failed);
    (solved ? score.solved_sum : score.failed_sum) += run.value;
  }
  return score;
}

PairCounts CountPairs(std::span<const ProblemScore> first, std::span<const ProblemScore> second) {
  RequireEqualLengths("CountPairs", "first", first.size(), second.size());
  PairCounts counts;
  for (std::size_t i = 0; i < first.size(); ++i) {
    if (first[i].finished() == 0 || second[i].finished() == 0) {
      ++counts.missing;
      continue;
    }
    // Compares shares over a common denominator, so that 1/3 equals 2/6.
    const auto a = static_cast<long long>(first[i].solved) * second[i].finished();
    const auto b = static_cast<long long>(second[i].solved) * first[i].finished();
    if (a != b) {
      ++(a > b ? counts.only_first : counts.only_second);
    } else {
      ++(a > 0 ? counts.both : counts.neither);
    }
  }
  return counts;
}

std::vector<int> CommonlySolved(std::span<const ProblemScore> first, std::span<const ProblemScore> second) {
  RequireEqualLengths("CommonlySolved", "first", first.size(), second.size());
  std::vector<int> common;
  for (std::size_t i = 0; i < first.size(); ++i) {
    if (first[i].solved > 0 && second[i].solved > 0) common.push_back(static_cast<int>(i));
  }
  return common;
}

}  // namespace legopt::statistics

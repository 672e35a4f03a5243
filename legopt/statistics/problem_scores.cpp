#include "legopt/statistics/problem_scores.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "legopt/statistics/internal/checks.h"

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

namespace {

double QuantileOfSorted(const std::vector<double>& sorted, double share) {
  const double place = static_cast<double>(sorted.size() - 1) * share;
  const auto below = static_cast<std::size_t>(std::floor(place));
  const double weight = place - std::floor(place);
  const double lower = sorted[below];
  if (weight == 0.0) return lower;
  const double upper = sorted[below + 1];
  if (std::isinf(upper)) return upper;
  return lower + weight * (upper - lower);
}

}  // namespace

double PenalisedAverage(std::span<const double> times_ms, double limit_ms, double factor) {
  constexpr char kName[] = "PenalisedAverage";
  RequireNumbers(kName, "times_ms", times_ms, {.lowest = 0.0, .infinity = true});
  RequireNumbers(kName, "limit_ms", {&limit_ms, 1}, {.lowest = 0.0, .above_lowest = true});
  RequireNumbers(kName, "factor", {&factor, 1}, {.lowest = 1.0});
  if (times_ms.empty()) return kNaN;
  double sum = 0.0;
  for (const double time : times_ms) sum += std::isinf(time) ? factor * limit_ms : time;
  return sum / static_cast<double>(times_ms.size());
}

ExpectedTime ExpectedRunningTime(std::span<const double> spent_ms, std::span<const double> shares) {
  constexpr char kName[] = "ExpectedRunningTime";
  RequireEqualLengths(kName, "spent_ms", spent_ms.size(), shares.size());
  RequireNumbers(kName, "spent_ms", spent_ms, {.lowest = 0.0});
  RequireNumbers(kName, "shares", shares, {.lowest = 0.0});
  for (const double share : shares) {
    if (share > 1.0) Refuse(kName, "shares", "must not be above 1", share);
  }
  ExpectedTime expected{.spent_ms = std::accumulate(spent_ms.begin(), spent_ms.end(), 0.0),
                        .successes = std::accumulate(shares.begin(), shares.end(), 0.0)};
  expected.time_ms = spent_ms.empty()            ? kNaN
                     : expected.successes == 0.0 ? std::numeric_limits<double>::infinity()
                                                 : expected.spent_ms / expected.successes;
  return expected;
}

double ShiftedGeometricMean(std::span<const double> times_ms, double shift_ms) {
  constexpr char kName[] = "ShiftedGeometricMean";
  RequireNumbers(kName, "times_ms", times_ms, {.lowest = 0.0, .infinity = true});
  RequireNumbers(kName, "shift_ms", {&shift_ms, 1}, {.lowest = 0.0});
  if (times_ms.empty()) return kNaN;
  double sum = 0.0;
  for (const double time : times_ms) sum += std::log(std::max(1.0, time + shift_ms));
  return std::exp(sum / static_cast<double>(times_ms.size())) - shift_ms;
}

double GeometricMean(std::span<const double> ratios) {
  RequireNumbers("GeometricMean", "ratios", ratios, {.lowest = 0.0, .above_lowest = true});
  if (ratios.empty()) return kNaN;
  double sum = 0.0;
  for (const double ratio : ratios) sum += std::log(ratio);
  return std::exp(sum / static_cast<double>(ratios.size()));
}

std::vector<double> Quantiles(std::span<const double> values, std::span<const double> shares) {
  RequireNumbers("Quantiles", "values", values, {.infinity = true});
  RequireNumbers("Quantiles", "shares", shares, {.lowest = 0.0});
  std::vector<double> sorted(values.begin(), values.end());
  std::sort(sorted.begin(), sorted.end());
  std::vector<double> quantiles;
  quantiles.reserve(shares.size());
  for (const double share : shares) {
    if (share > 1.0) Refuse("Quantiles", "shares", "must not be above 1", share);
    quantiles.push_back(sorted.empty() ? kNaN : QuantileOfSorted(sorted, share));
  }
  return quantiles;
}

}  // namespace legopt::statistics

#include "client/compare/comparison.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <numeric>

#include "client/client_error.h"
#include "legopt/statistics/bootstrap.h"
#include "legopt/statistics/hypothesis_tests.h"
#include "legopt/statistics/internal/checks.h"
#include "legopt/statistics/problem_scores.h"
#include "legopt/types/number_text.h"

namespace legopt::client {
namespace {

using statistics::ProblemScore;
using statistics::RunOutcome;
using Indices = std::span<const int>;

// Applies a smaller limit: returns the outcomes under it.
SolveCell Truncated(const SolveCell& cell, double limit_ms) {
  SolveCell shorter = cell;
  if (limit_ms >= cell.limit_ms) return shorter;
  for (Solve& solve : shorter.solves) {
    if (solve.time_ms <= limit_ms) continue;
    solve.time_ms = limit_ms;
    if (solve.end == RunOutcome::kSolved) solve.end = RunOutcome::kFailed;
  }
  return shorter;
}

std::vector<ProblemPair> PairsOf(const SolveCell& a, const SolveCell& b, CellComparison* comparison) {
  std::map<int, ProblemRuns> others;
  for (ProblemRuns& problem : ProblemsOf(b)) others.emplace(problem.problem, std::move(problem));
  std::vector<ProblemPair> pairs;
  for (ProblemRuns& problem : ProblemsOf(a)) {
    const auto other = others.find(problem.problem);
    if (other == others.end()) {
      ++comparison->only_in_a;
      continue;
    }
    pairs.push_back({std::move(problem), std::move(other->second)});
    others.erase(other);
  }
  comparison->only_in_b = static_cast<int>(others.size());
  return pairs;
}

// For many problems, fewer resamples and plain percentiles suffice, because means are nearly normal; 100,000 jobs then
// take seconds. BCa alone computes the statistic once for each problem left out.
statistics::BootstrapOptions BootstrapOf(std::size_t problems, const ComparisonOptions& options) {
  constexpr double kMaxDraws = 2e7;
  constexpr std::size_t kMaxCorrected = 5'000;
  constexpr int kUsualMost = 10'000;
  const int affordable_most = problems > kMaxCorrected ? kUsualMost : 50'000;
  const int fewest = std::min(1'000 * options.family, affordable_most);  // the tails of higher levels need more
  const int most = std::max(kUsualMost, fewest);
  const double affordable = kMaxDraws / static_cast<double>(std::max<std::size_t>(problems, 1));
  return {.resamples = static_cast<int>(std::clamp<double>(affordable, fewest, most)),
          .level = options.level(),
          .seed = options.seed,
          .kind = problems > kMaxCorrected ? statistics::BootstrapKind::kPercentile : statistics::BootstrapKind::kBca};
}

double MeanOver(const std::vector<double>& values, Indices problems) {
  double sum = 0.0;
  for (const int problem : problems) sum += values[static_cast<std::size_t>(problem)];
  return sum / static_cast<double>(problems.size());
}

template <class Statistic>
statistics::BootstrapEstimate Estimate(std::size_t problems, const ComparisonOptions& options,
                                       const Statistic& statistic) {
  return statistics::Bootstrap(static_cast<int>(problems), statistic, BootstrapOf(problems, options));
}

// Returns the differences of shares, B - A, in units of a common denominator; rounded to 1e-4 if it would be larger.
std::vector<int> ShareDifferences(const std::vector<ProblemScore>& a, const std::vector<ProblemScore>& b) {
  constexpr int kMost = 10'000;
  int common = 1;
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (const int runs : {a[i].finished(), b[i].finished()}) {
      if (runs > 0) common = std::min(kMost, std::lcm(common, std::min(runs, kMost)));
    }
  }
  std::vector<int> differences;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (a[i].finished() == 0 || b[i].finished() == 0) continue;
    differences.push_back(static_cast<int>(std::lround(common * (b[i].Share() - a[i].Share()))));
  }
  return differences;
}

SuccessComparison CompareSuccess(const std::vector<ProblemScore>& a, const std::vector<ProblemScore>& b, bool repeated,
                                 const ComparisonOptions& options) {
  SuccessComparison success;
  success.counts = statistics::CountPairs(a, b);
  std::vector<double> differences;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (a[i].finished() == 0 || b[i].finished() == 0) continue;
    success.share_a += a[i].Share();
    success.share_b += b[i].Share();
    differences.push_back(b[i].Share() - a[i].Share());
  }
  success.share_a /= static_cast<double>(differences.size());
  success.share_b /= static_cast<double>(differences.size());
  success.test = statistics::McNemar(success.counts.only_first, success.counts.only_second);
  if (!repeated) {
    success.difference = statistics::PairedShareDifference(statistics::CountPairs(b, a), options.level());
    return success;
  }
  const auto estimate =
      Estimate(differences.size(), options, [&](Indices problems) { return MeanOver(differences, problems); });
  success.difference = {estimate.value, estimate.interval};
  success.repeated = statistics::SignFlip(ShareDifferences(a, b));
  return success;
}

// Returns the difference, or 0 if it is below the accuracy of the costs, so that equal costs are ties.
double TrustedDifference(double b, double a) {
  constexpr double kNoise = 1e-9;
  const double difference = b - a;
  if (std::abs(difference) <= kNoise * std::max(std::abs(a), std::abs(b))) return 0.0;
  constexpr int kTrustedDigits = 9;
  return *ParseNumber(FormatGeneral(difference, kTrustedDigits));
}

// Computes the Hodges-Lehmann estimate; none for many problems, because the cost is quadratic.
void Locate(const std::vector<double>& logarithms, double level, RatioComparison* ratios) {
  constexpr std::size_t kMost = 3'000;
  if (logarithms.empty() || logarithms.size() > kMost) return;
  const statistics::Location location = statistics::HodgesLehmann(logarithms, level);
  ratios->typical = TypicalRatio{std::exp(location.estimate),
                                 {std::exp(location.interval.lower), std::exp(location.interval.upper)},
                                 location.coverage};
}

RatioComparison CompareRatios(const std::vector<double>& logarithms, const std::vector<double>& differences,
                              const ComparisonOptions& options) {
  RatioComparison ratios;
  ratios.n = static_cast<int>(logarithms.size());
  const auto estimate =
      Estimate(logarithms.size(), options, [&](Indices problems) { return std::exp(MeanOver(logarithms, problems)); });
  ratios.mean = estimate.value;
  ratios.interval = {std::max(estimate.interval.lower, 0.0), estimate.interval.upper};
  ratios.test = statistics::SignedRank(differences);
  Locate(logarithms, options.level(), &ratios);
  ratios.lower =
      static_cast<int>(std::count_if(differences.begin(), differences.end(), [](double d) { return d < 0; }));
  return ratios;
}

void CompareTimes(const std::vector<ProblemPair>& pairs, const std::vector<int>& common,
                  const ComparisonOptions& options, CellComparison* comparison) {
  constexpr std::size_t kShown = 3;
  std::vector<double> logarithms;
  std::vector<ProblemRatio> ratios;
  for (const int i : common) {
    const ProblemPair& pair = pairs[static_cast<std::size_t>(i)];
    const double a = std::max(pair.a.time.MeanSolvedValue(), kShortest_ms);
    const double b = std::max(pair.b.time.MeanSolvedValue(), kShortest_ms);
    logarithms.push_back(std::log(b / a));
    ratios.push_back({pair.a.problem, pair.a.job_id, pair.b.job_id, b / a});
  }
  comparison->time = CompareRatios(logarithms, logarithms, options);
  std::stable_sort(ratios.begin(), ratios.end(), [](const auto& x, const auto& y) { return x.ratio < y.ratio; });
  for (std::size_t i = 0; i < std::min(kShown, ratios.size()); ++i) {
    if (ratios[i].ratio < 1.0) comparison->fastest.push_back(ratios[i]);
    const ProblemRatio& last = ratios[ratios.size() - 1 - i];
    if (last.ratio > 1.0) comparison->slowest.push_back(last);
  }
}

// Leaves the comparison empty unless the work of all these solves was counted.
void CompareWork(const std::vector<ProblemPair>& pairs, const std::vector<int>& common,
                 const ComparisonOptions& options, CellComparison* comparison) {
  std::vector<double> logarithms;
  for (const int i : common) {
    const ProblemPair& pair = pairs[static_cast<std::size_t>(i)];
    if (!pair.a.work_counted || !pair.b.work_counted) return;
    logarithms.push_back(std::log(pair.b.work.MeanSolvedValue() / pair.a.work.MeanSolvedValue()));
  }
  comparison->work = CompareRatios(logarithms, logarithms, options);
}

void CompareCosts(const std::vector<ProblemPair>& pairs, const std::vector<int>& common,
                  const ComparisonOptions& options, CellComparison* comparison) {
  std::vector<double> logarithms, differences;
  for (const int i : common) {
    const ProblemPair& pair = pairs[static_cast<std::size_t>(i)];
    const double a = pair.a.cost.MeanSolvedValue(), b = pair.b.cost.MeanSolvedValue();
    if (!(a > 0.0 && b > 0.0)) continue;  // no ratio
    logarithms.push_back(std::log(b / a));
    differences.push_back(TrustedDifference(b, a));
  }
  comparison->cost = CompareRatios(logarithms, differences, options);
}

void ComparePenalised(const std::vector<ProblemPair>& pairs, const ComparisonOptions& options,
                      CellComparison* comparison) {
  const Charge& charge = comparison->charge;
  std::vector<double> a, b;
  for (const ProblemPair& pair : pairs) {
    if (pair.a.time.finished() == 0 || pair.b.time.finished() == 0) continue;
    a.push_back(std::max(charge.Apply(pair.a), kShortest_ms));
    b.push_back(std::max(charge.Apply(pair.b), kShortest_ms));
  }
  const auto estimate =
      Estimate(a.size(), options, [&](Indices problems) { return MeanOver(b, problems) / MeanOver(a, problems); });
  std::vector<int> all(a.size());
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<int>(i);
  comparison->par10_a_ms = MeanOver(a, all);
  comparison->par10_b_ms = MeanOver(b, all);
  comparison->par10_ratio = {std::max(estimate.interval.lower, 0.0), estimate.interval.upper};
}

void CompareDistributions(const std::vector<ProblemPair>& pairs, CellComparison* comparison) {
  std::vector<std::vector<statistics::Repetition>> a, b;
  for (const ProblemPair& pair : pairs) {
    if (pair.a.time.finished() == 0 || pair.b.time.finished() == 0) continue;
    a.push_back(pair.a.runs);
    b.push_back(pair.b.runs);
  }
  const auto first = statistics::RuntimeDistribution(a), second = statistics::RuntimeDistribution(b);
  comparison->dominance = statistics::Compare(first, second);
  const double crossing = statistics::FirstCrossing(first, second);
  if (std::isfinite(crossing)) comparison->crossing_ms = crossing;
}

double ContendedShare(const SolveCell& a, const SolveCell& b) {
  int contended = 0, reported = 0;
  for (const SolveCell* cell : {&a, &b}) {
    for (const Solve& solve : cell->solves) {
      contended += solve.contended ? 1 : 0;
      reported += solve.reported ? 1 : 0;
    }
  }
  return reported == 0 ? 0.0 : static_cast<double>(contended) / reported;
}

std::vector<PairedTimes> TimesOf(const std::vector<ProblemPair>& pairs) {
  const auto time_ms = [](const ProblemScore& score) {
    return score.solved > 0 ? std::max(score.MeanSolvedValue(), kShortest_ms) : statistics::kInfinity;
  };
  std::vector<PairedTimes> times;
  for (const ProblemPair& pair : pairs) {
    if (pair.a.time.finished() == 0 || pair.b.time.finished() == 0) continue;
    times.push_back({pair.a.problem, time_ms(pair.a.time), time_ms(pair.b.time)});
  }
  return times;
}

// Adjusts one p-value of each cell jointly. Comparisons of the family that are shown elsewhere count as p = 1: then the
// probability of any wrong rejection in the whole family keeps its level, although each part of it is adjusted alone.
template <class Get>
void Adjust(int family, std::vector<CellComparison>* cells, const Get& test) {
  std::vector<double> p;
  for (CellComparison& cell : *cells) p.push_back(test(cell).first);
  const std::size_t shown = p.size();
  p.resize(std::max(shown, static_cast<std::size_t>(family)), 1.0);
  const std::vector<double> adjusted = statistics::HolmAdjusted(p);
  for (std::size_t i = 0; i < shown; ++i) *test((*cells)[i]).second = adjusted[i];
}

ComparisonResult ChangeOf(const RatioComparison& ratios, double margin) {
  if (ratios.n == 0 || ratios.adjusted_p >= kSignificance) return ComparisonResult::kNone;
  if (ratios.interval.upper < 1.0 / (1.0 + margin)) return ComparisonResult::kBetter;
  return ratios.interval.lower > 1.0 + margin ? ComparisonResult::kWorse : ComparisonResult::kNone;
}

ComparisonResult ChangeOf(const SuccessComparison& success) {
  if (success.adjusted_p >= kSignificance) return ComparisonResult::kNone;
  const bool more =
      success.repeated ? success.share_b > success.share_a : success.counts.only_second > success.counts.only_first;
  return more ? ComparisonResult::kBetter : ComparisonResult::kWorse;
}

// Combines changes of equal rank.
ComparisonResult Together(std::initializer_list<ComparisonResult> changes) {
  const auto any = [&](ComparisonResult change) {
    return std::find(changes.begin(), changes.end(), change) != changes.end();
  };
  const bool better = any(ComparisonResult::kBetter) || any(ComparisonResult::kMixed),
             worse = any(ComparisonResult::kWorse) || any(ComparisonResult::kMixed);
  if (better && worse) return ComparisonResult::kMixed;
  if (better) return ComparisonResult::kBetter;
  return worse ? ComparisonResult::kWorse : ComparisonResult::kNone;
}

}  // namespace

int NumCommonProblems(const SolveCell& a, const SolveCell& b) {
  CellComparison unused;
  std::vector<ProblemScore> times_a, times_b;
  for (const ProblemPair& pair : PairsOf(a, b, &unused)) {
    times_a.push_back(pair.a.time);
    times_b.push_back(pair.b.time);
  }
  return statistics::CountPairs(times_a, times_b).pairs();
}

CellComparison CompareCells(const SolveCell& a, const SolveCell& b, const Charge& charge,
                            const ComparisonOptions& options) {
  CellComparison comparison;
  comparison.a = a.method;
  comparison.b = b.method;
  comparison.column = a.column;
  comparison.limit_ms = std::min(a.limit_ms, b.limit_ms);
  comparison.charge = charge;
  comparison.time_margin = options.margin;
  comparison.contended_share = ContendedShare(a, b);
  const auto pairs = PairsOf(Truncated(a, comparison.limit_ms), Truncated(b, comparison.limit_ms), &comparison);
  std::vector<ProblemScore> times_a, times_b;
  bool repeated = false;
  for (const ProblemPair& pair : pairs) {
    times_a.push_back(pair.a.time);
    times_b.push_back(pair.b.time);
    repeated = repeated || pair.a.runs.size() > 1 || pair.b.runs.size() > 1;
  }
  if (statistics::CountPairs(times_a, times_b).pairs() == 0) return comparison;
  comparison.times = TimesOf(pairs);
  comparison.success = CompareSuccess(times_a, times_b, repeated, options);
  const std::vector<int> common = statistics::CommonlySolved(times_a, times_b);
  CompareWork(pairs, common, options, &comparison);
  CompareTimes(pairs, common, options, &comparison);
  CompareCosts(pairs, common, options, &comparison);
  ComparePenalised(pairs, options, &comparison);
  CompareDistributions(pairs, &comparison);
  return comparison;
}

void Decide(const ComparisonOptions& options, std::vector<CellComparison>* cells) {
  const int n = options.family;
  Adjust(n, cells, [](CellComparison& cell) { return std::pair(cell.success.p(), &cell.success.adjusted_p); });
  Adjust(n, cells, [](CellComparison& cell) { return std::pair(cell.work.test.two_sided_p, &cell.work.adjusted_p); });
  Adjust(n, cells, [](CellComparison& cell) { return std::pair(cell.time.test.two_sided_p, &cell.time.adjusted_p); });
  Adjust(n, cells, [](CellComparison& cell) { return std::pair(cell.cost.test.two_sided_p, &cell.cost.adjusted_p); });
  for (CellComparison& cell : *cells) {
    cell.success.change = ChangeOf(cell.success);
    cell.work.change = ChangeOf(cell.work, options.margin);
    cell.time.change = cell.work.n > 0 ? ComparisonResult::kNone : ChangeOf(cell.time, cell.time_margin);
    cell.cost.change = ChangeOf(cell.cost, options.margin);
    cell.change = cell.success.change == ComparisonResult::kNone
                      ? Together({cell.work.change, cell.time.change, cell.cost.change})
                      : cell.success.change;
  }
}

ComparisonResult OverallChange(const std::vector<CellComparison>& cells) {
  ComparisonResult change = ComparisonResult::kNone;
  for (const CellComparison& cell : cells) change = Together({change, cell.change});
  return change;
}

int MinDiscordantPairs() {
  int discordant = 1;
  while (statistics::McNemar(0, discordant).mid_p >= kSignificance) ++discordant;
  return discordant;
}

}  // namespace legopt::client

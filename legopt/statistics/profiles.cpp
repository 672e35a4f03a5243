#include "legopt/statistics/profiles.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "legopt/statistics/internal/checks.h"

namespace legopt::statistics {
namespace {

// Step curve of (value, weight) pairs as shares of the total weight; infinite values have weight, but no step.
StepCurve WeightedCurve(std::vector<std::pair<double, double>> values, double total) {
  std::sort(values.begin(), values.end());
  StepCurve curve;
  double arrived = 0.0;
  for (std::size_t i = 0; i < values.size() && std::isfinite(values[i].first); ++i) {
    arrived += values[i].second;
    if (i + 1 < values.size() && values[i + 1].first == values[i].first) continue;
    curve.at.push_back(values[i].first);
    curve.share.push_back(std::min(arrived / total, 1.0));  // sums of thirds may exceed 1 by rounding
  }
  return curve;
}

// All x at which either curve steps.
std::vector<double> StepsOf(const StepCurve& first, const StepCurve& second) {
  std::vector<double> places;
  std::merge(first.at.begin(), first.at.end(), second.at.begin(), second.at.end(), std::back_inserter(places));
  return places;
}

}  // namespace

double StepCurve::At(double x) const {
  if (std::isnan(x)) Refuse("At", "x", "must be a number", x);
  const auto steps = std::upper_bound(at.begin(), at.end(), x) - at.begin();
  return steps == 0 ? 0.0 : share[static_cast<std::size_t>(steps - 1)];
}

double StepCurve::FirstReaching(double reached) const {
  if (!(reached > 0.0 && reached <= 1.0)) Refuse("FirstReaching", "reached", "must lie in (0, 1]", reached);
  const auto step = std::lower_bound(share.begin(), share.end(), reached) - share.begin();
  return step == std::ssize(share) ? std::numeric_limits<double>::infinity() : at[static_cast<std::size_t>(step)];
}

StepCurve Distribution(std::span<const double> values) {
  RequireNumbers("Distribution", "values", values, {.infinity = true});
  std::vector<std::pair<double, double>> weighted;
  weighted.reserve(values.size());
  for (const double value : values) weighted.emplace_back(value, 1.0);
  return WeightedCurve(std::move(weighted), static_cast<double>(values.size()));
}

StepCurve RuntimeDistribution(std::span<const std::vector<Repetition>> problems) {
  std::vector<std::pair<double, double>> weighted;
  double count = 0.0;
  for (const std::vector<Repetition>& runs : problems) {
    const int finished = ScoreOf(runs).finished();
    if (finished == 0) continue;
    count += 1.0;
    for (const Repetition& run : runs) {
      if (run.end == RunOutcome::kSolved) weighted.emplace_back(run.value, 1.0 / finished);
    }
  }
  return WeightedCurve(std::move(weighted), count);
}

PerformanceProfile ProfileOf(std::span<const std::vector<double>> rows) {
  RequireTable("ProfileOf", rows, {.lowest = 0.0, .above_lowest = true, .infinity = true});
  PerformanceProfile profile;
  profile.problems = static_cast<int>(rows.size());
  if (rows.empty()) return profile;
  std::vector<std::vector<double>> ratios(rows[0].size());
  for (const std::vector<double>& row : rows) {
    double best = std::numeric_limits<double>::infinity();
    for (const double value : row) best = std::min(best, value);
    const bool solved = std::isfinite(best);
    if (!solved) ++profile.unsolved;
    for (std::size_t j = 0; j < row.size(); ++j) ratios[j].push_back(solved ? row[j] / best : row[j]);
  }
  for (const std::vector<double>& of_method : ratios) profile.curves.push_back(Distribution(of_method));
  return profile;
}

Dominance Compare(const StepCurve& first, const StepCurve& second) {
  const std::vector<double> places = StepsOf(first, second);
  bool first_above = false;
  bool second_above = false;
  for (const double place : places) {
    const double difference = first.At(place) - second.At(place);
    first_above = first_above || difference > 0.0;
    second_above = second_above || difference < 0.0;
  }
  if (first_above && second_above) return Dominance::kNone;
  if (first_above) return Dominance::kFirst;
  return second_above ? Dominance::kSecond : Dominance::kEqual;
}

double FirstCrossing(const StepCurve& first, const StepCurve& second) {
  double lead = 0.0;
  for (const double place : StepsOf(first, second)) {
    const double difference = first.At(place) - second.At(place);
    if (lead == 0.0) lead = difference;
    if (lead * difference < 0.0) return place;
  }
  return kInfinity;
}

}  // namespace legopt::statistics

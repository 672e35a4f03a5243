// Policy: every case of scipy_cases.json, made by make_scipy_cases.py, agrees to rounding. That script documents
// differences in definitions and the quantities compared.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>
#include <string>
#include <vector>

#include "legopt/statistics/bootstrap.h"
#include "legopt/statistics/hypothesis_tests.h"
#include "legopt/statistics/problem_scores.h"
#include "legopt/statistics/profiles.h"
#include "tests/folders.h"

namespace legopt::statistics {
namespace {

using nlohmann::json;

double NumberIn(const json& value) {
  return value.is_null() ? std::numeric_limits<double>::infinity() : value.get<double>();
}

std::vector<double> NumbersOf(const json& values) {
  std::vector<double> numbers;
  for (const json& value : values) numbers.push_back(NumberIn(value));
  return numbers;
}

std::vector<std::vector<double>> RowsOf(const json& values) {
  std::vector<std::vector<double>> rows;
  for (const json& row : values) rows.push_back(NumbersOf(row));
  return rows;
}

json SharesAt(const StepCurve& curve, const json& places) {
  json shares = json::array();
  for (const json& place : places) shares.push_back(curve.At(place.get<double>()));
  return shares;
}

json JsonOf(const Interval& interval) { return {interval.lower, interval.upper}; }

json PValues(const SignedRankTest& test, bool exact) {
  EXPECT_EQ(test.exact, exact);
  return {{"greater", test.greater_p}, {"less", test.less_p}, {"two_sided", test.two_sided_p}};
}

json ExactSignedRank(const json& given) { return PValues(SignedRank(NumbersOf(given["differences"])), true); }

json NormalSignedRank(const json& given) {
  const ZeroRule zeros = given["zeros"] == "pratt" ? ZeroRule::kPratt : ZeroRule::kDrop;
  return PValues(SignedRank(NumbersOf(given["differences"]), {.zeros = zeros, .max_exact_pairs = 0}), false);
}

json BootstrapOf(const json& given) {
  const std::vector<double> first = NumbersOf(given["first"]);
  const std::vector<double> second = NumbersOf(given["second"]);
  const auto drawn = [](const std::vector<double>& values, std::span<const int> problems) {
    std::vector<double> of_drawn;
    for (const int problem : problems) of_drawn.push_back(values[static_cast<std::size_t>(problem)]);
    return of_drawn;
  };
  const auto mean = [](const std::vector<double>& x) {
    return std::accumulate(x.begin(), x.end(), 0.0) / static_cast<double>(x.size());
  };
  const std::map<std::string, std::function<double(const std::vector<double>&, const std::vector<double>&)>> statistics{
      {"mean of first", [&](const auto& x, const auto&) { return mean(x); }},
      {"ratio of means", [&](const auto& x, const auto& y) { return mean(x) / mean(y); }},
      {"ratio of geometric means", [](const auto& x, const auto& y) { return GeometricMean(x) / GeometricMean(y); }},
      {"variance of first", [&](const auto& x, const auto&) {
         double squares = 0.0;
         for (const double value : x) squares += (value - mean(x)) * (value - mean(x));
         return squares / static_cast<double>(x.size());
       }}};
  const auto& statistic = statistics.at(given["statistic"].get<std::string>());
  const BootstrapEstimate estimate = Bootstrap(
      static_cast<int>(first.size()),
      [&](std::span<const int> problems) { return statistic(drawn(first, problems), drawn(second, problems)); },
      {.resamples = given["resamples"].get<int>(),
       .level = given["level"].get<double>(),
       .seed = given["seed"].get<std::uint64_t>(),
       .kind = given["kind"] == "BCa" ? BootstrapKind::kBca : BootstrapKind::kPercentile});
  return {{"interval", JsonOf(estimate.interval)}, {"standard_error", estimate.standard_error}};
}

json FriedmanOf(const json& given) {
  const FriedmanTest test = Friedman(RowsOf(given["rows"]));
  return {{"chi_square", test.chi_square},
          {"p", test.p},
          {"mean_ranks", test.mean_ranks},
          {"f", test.iman_davenport.f},
          {"f_p", test.iman_davenport.p}};
}

json ProfileSharesOf(const json& given) {
  json shares = json::array();
  for (const StepCurve& curve : ProfileOf(RowsOf(given["rows"])).curves) shares.push_back(SharesAt(curve, given["at"]));
  return {{"share", shares}};
}

json CochranOf(const json& given) {
  const CochranTest test = CochranQ(given["rows"].get<std::vector<std::vector<int>>>());
  return {{"q", test.q}, {"p", test.p}};
}

json McNemarOf(const json& given) {
  const McNemarTest test = McNemar(given["only_first"].get<int>(), given["only_second"].get<int>());
  return {{"exact", test.exact_p}, {"mid", test.mid_p}};
}

/// The module's results, by the function's name in the table.
const std::map<std::string, std::function<json(const json& given)>> kOurs{
    {"iman_davenport",
     [](const json& g) {
       return json{
           {"p", ImanDavenport(g["chi_square"].get<double>(), g["problems"].get<int>(), g["methods"].get<int>()).p}};
     }},
    {"wilson",
     [](const json& g) {
       return json{{"interval", JsonOf(WilsonInterval(g["successes"].get<int>(), g["problems"].get<int>(),
                                                      g["level"].get<double>()))}};
     }},
    {"mcnemar", McNemarOf},
    {"signed_rank_exact", ExactSignedRank},
    {"signed_rank_tied", ExactSignedRank},
    {"signed_rank_normal", NormalSignedRank},
    {"holm",
     [](const json& g) {
       return json{{"adjusted", HolmAdjusted(NumbersOf(g["p"]))}};
     }},
    {"cochran", CochranOf},
    {"friedman", FriedmanOf},
    {"distribution",
     [](const json& g) {
       return json{{"share", SharesAt(Distribution(NumbersOf(g["values"])), g["at"])}};
     }},
    {"profile", ProfileSharesOf},
    {"penalised_average",
     [](const json& g) {
       return json{
           {"mean", PenalisedAverage(NumbersOf(g["times"]), g["limit"].get<double>(), g["factor"].get<double>())}};
     }},
    {"expected_running_time",
     [](const json& g) {
       return json{{"time", ExpectedRunningTime(NumbersOf(g["spent"]), NumbersOf(g["shares"])).time_ms}};
     }},
    {"shifted_geometric_mean",
     [](const json& g) {
       return json{{"mean", ShiftedGeometricMean(NumbersOf(g["times"]), g["shift"].get<double>())}};
     }},
    {"geometric_mean",
     [](const json& g) {
       return json{{"mean", GeometricMean(NumbersOf(g["ratios"]))}};
     }},
    {"quantiles",
     [](const json& g) {
       return json{{"quantiles", Quantiles(NumbersOf(g["values"]), NumbersOf(g["shares"]))}};
     }},
    {"hodges_lehmann",
     [](const json& g) {
       return json{{"estimate", HodgesLehmann(NumbersOf(g["differences"])).estimate}};
     }},
    {"bootstrap", BootstrapOf},
};

/// Compares every number of `ours` with that of the table.
void ExpectEqual(const json& ours, const json& expected, const std::string& where) {
  ASSERT_EQ(ours.size(), expected.size()) << where;
  const json flat_ours = ours.flatten();
  const json flat_expected = expected.flatten();
  for (const auto& [path, value] : flat_expected.items()) {
    ASSERT_TRUE(flat_ours.contains(path)) << where << path;
    const double number = value.get<double>();
    // Relative, so that small p-values count; absolute if an end is 0.
    EXPECT_NEAR(flat_ours[path].get<double>(), number, 1e-11 * std::abs(number) + 1e-14) << where << path;
  }
}

TEST(ScipyCases, AllAgree) {
  std::ifstream file(SourceFolder() + "/tests/statistics/scipy_cases.json");
  const json cases = json::parse(file).at("cases");
  ASSERT_EQ(cases.size(), 183U);
  std::map<std::string, int> seen;
  for (const json& example : cases) {
    const std::string function = example["function"];
    const int number = ++seen[function];
    ExpectEqual(kOurs.at(function)(example["given"]), example["expected"],
                function + " " + std::to_string(number) + " ");
  }
  EXPECT_EQ(seen.size(), kOurs.size());  // every function has a case
}

}  // namespace
}  // namespace legopt::statistics

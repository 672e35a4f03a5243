#include "client/page/page_curves.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "legopt/statistics/profiles.h"

namespace legopt::client {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr double kShortestTime_ms = 1e-6;

Json FiniteJson(double value) { return std::isfinite(value) ? Json(value) : Json(); }

Json CurveJson(const statistics::StepCurve& curve) { return {{"x", curve.at}, {"y", curve.share}}; }

std::vector<ProblemMap> ByProblem(const std::vector<const SolveCell*>& cells) {
  std::vector<ProblemMap> methods;
  for (const SolveCell* cell : cells) methods.push_back(cell == nullptr ? ProblemMap() : ProblemMapOf(*cell));
  return methods;
}

// Returns the mean of solved repetitions; infinite if there is none.
double ValueOf(const ProblemMap& method, int problem, statistics::ProblemScore ProblemRuns::*score) {
  const auto found = method.find(problem);
  if (found == method.end() || (found->second.*score).solved == 0) return kNever;
  return (found->second.*score).MeanSolvedValue();
}

// Returns a row for each complete problem, with a value for each shown method.
std::vector<std::vector<double>> CompleteRows(const std::vector<ProblemMap>& methods, const CompleteProblems& complete,
                                              statistics::ProblemScore ProblemRuns::*score, double least) {
  std::vector<std::vector<double>> rows;
  for (const int problem : complete.problems) {
    auto& row = rows.emplace_back();
    for (std::size_t i = 0; i < methods.size(); ++i) {
      if (complete.shown[i]) row.push_back(std::max(ValueOf(methods[i], problem, score), least));
    }
  }
  return rows;
}

// Returns a curve for each shown method, null for the others. Returns null without problems, or if a value is not
// positive.
Json ProfileJson(const CompleteProblems& complete, const std::vector<std::vector<double>>& rows) {
  const bool positive = std::all_of(rows.begin(), rows.end(), [](const auto& row) {
    return std::all_of(row.begin(), row.end(), [](double value) { return value > 0.0; });
  });
  if (rows.empty() || !positive) return Json();
  const statistics::PerformanceProfile profile = statistics::ProfileOf(rows);
  Json curves = Json::array();
  std::size_t next = 0;
  for (const bool shown : complete.shown) curves.push_back(shown ? CurveJson(profile.curves.at(next++)) : Json());
  return {{"curves", curves}, {"problems", profile.problems}, {"unsolved", profile.unsolved}};
}

Json RuntimesJson(const std::vector<ProblemMap>& methods, const CompleteProblems& complete) {
  Json curves = Json::array();
  for (std::size_t i = 0; i < methods.size(); ++i) {
    std::vector<std::vector<statistics::Repetition>> runs;
    for (const int problem : complete.problems) {
      if (complete.shown[i]) runs.push_back(methods[i].at(problem).runs);
    }
    curves.push_back(runs.empty() ? Json() : CurveJson(statistics::RuntimeDistribution(runs)));
  }
  return curves;
}

// Returns the smallest finite value of each problem over all methods; infinite if no method solved it.
std::map<int, double> BestOf(const std::vector<ProblemMap>& methods, const std::set<int>& problems,
                             statistics::ProblemScore ProblemRuns::*score) {
  std::map<int, double> best;
  for (const int problem : problems) {
    double& smallest = best.emplace(problem, kNever).first->second;
    for (const ProblemMap& method : methods) smallest = std::min(smallest, ValueOf(method, problem, score));
  }
  return best;
}

Json CostsJson(const std::vector<ProblemMap>& methods, const CompleteProblems& complete,
               const std::map<int, double>& best) {
  Json curves = Json::array();
  for (std::size_t i = 0; i < methods.size(); ++i) {
    std::vector<double> ratios;
    for (const int problem : complete.problems) {
      if (!complete.shown[i]) continue;
      const double value = ValueOf(methods[i], problem, &ProblemRuns::cost);
      ratios.push_back(std::isfinite(value) && best.at(problem) > 0.0 ? value / best.at(problem) : kNever);
    }
    curves.push_back(ratios.empty() ? Json() : CurveJson(statistics::Distribution(ratios)));
  }
  return curves;
}

// Ratios are given for complete problems only: for others the best value is not known yet.
Json MethodJson(const ProblemMap& method, const CompleteProblems& complete, const std::map<int, double>& best_time,
                const std::map<int, double>& best_cost) {
  Json time = Json::array(), cost = Json::array(), time_ratio = Json::array(), cost_ratio = Json::array();
  Json share = Json::array(), job = Json::array();
  for (const auto& [problem, fastest] : best_time) {
    const double time_ms = ValueOf(method, problem, &ProblemRuns::time);
    const double own_cost = ValueOf(method, problem, &ProblemRuns::cost), cheapest = best_cost.at(problem);
    time.push_back(FiniteJson(time_ms));
    cost.push_back(FiniteJson(own_cost));
    const bool known = std::ranges::binary_search(complete.problems, problem);
    time_ratio.push_back(known && fastest > 0.0 ? FiniteJson(time_ms / fastest) : Json());
    cost_ratio.push_back(known && cheapest > 0.0 ? FiniteJson(own_cost / cheapest) : Json());
    const auto found = method.find(problem);
    share.push_back(found == method.end() ? Json() : FiniteJson(found->second.time.Share()));
    job.push_back(found == method.end() ? Json() : Json(found->second.job_id));
  }
  return {{"time_ms", time},          {"cost", cost},   {"time_ratio", time_ratio},
          {"cost_ratio", cost_ratio}, {"share", share}, {"job", job}};
}

}  // namespace

Json DescribeColumn(const std::vector<const SolveCell*>& cells) {
  const std::vector<ProblemMap> methods = ByProblem(cells);
  std::set<int> problems;
  for (const ProblemMap& method : methods) {
    for (const auto& [number, runs] : method) problems.insert(number);
  }
  const auto best_time = BestOf(methods, problems, &ProblemRuns::time);
  const auto best_cost = BestOf(methods, problems, &ProblemRuns::cost);
  const CompleteProblems complete = FindCompleteProblems(methods);
  Json values = Json::array();
  for (const ProblemMap& method : methods) values.push_back(MethodJson(method, complete, best_time, best_cost));
  double limit_ms = 0.0;
  for (const SolveCell* cell : cells) {
    if (cell != nullptr) limit_ms = limit_ms == 0.0 ? cell->limit_ms : std::min(limit_ms, cell->limit_ms);
  }
  return {{"limit_ms", limit_ms},
          {"problems", problems},
          {"complete", complete.problems.size()},
          {"methods", values},
          {"profiles",
           {{"time", ProfileJson(complete, CompleteRows(methods, complete, &ProblemRuns::time, kShortestTime_ms))},
            {"cost", ProfileJson(complete, CompleteRows(methods, complete, &ProblemRuns::cost, 0.0))}}},
          {"runtimes", RuntimesJson(methods, complete)},
          {"costs", CostsJson(methods, complete, best_cost)}};
}

}  // namespace legopt::client

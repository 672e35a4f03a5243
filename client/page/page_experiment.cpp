#include "client/page/page_experiment.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "client/compare/comparison_report.h"
#include "client/compare/statistics_table.h"
#include "client/report/certificate_report.h"
#include "client/report/method_choice.h"
#include "client/report/reading.h"
#include "db/named_queries.h"
#include "legopt/input/json.h"
#include "legopt/statistics/profiles.h"
#include "legopt/types/job.h"

namespace legopt::client {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr double kLeastEffort_ms = 1e-6;

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

// A measure of effort, smaller is better.
struct Effort {
  const char* name;  // value of "effort" in docs/reference/page-data.md
  bool is_work;
  statistics::ProblemScore ProblemRuns::*score;
  std::vector<statistics::Repetition> ProblemRuns::*runs;
};

// Returns work, or time unless the work of all complete problems was counted, like the ranks of `legopt table`.
Effort EffortOf(const std::vector<ProblemMap>& methods, const CompleteProblems& complete) {
  bool counted = true;
  for (std::size_t i = 0; i < methods.size(); ++i) {
    for (const int problem : complete.problems) {
      counted = counted && (!complete.shown[i] || methods[i].at(problem).work_counted);
    }
  }
  if (counted) return {"work", true, &ProblemRuns::work, &ProblemRuns::work_runs};
  return {"time", false, &ProblemRuns::time, &ProblemRuns::runs};
}

Json EffortsJson(const std::vector<ProblemMap>& methods, const CompleteProblems& complete, const Effort& effort) {
  Json curves = Json::array();
  for (std::size_t i = 0; i < methods.size(); ++i) {
    std::vector<std::vector<statistics::Repetition>> runs;
    for (const int problem : complete.problems) {
      if (complete.shown[i]) runs.push_back(methods[i].at(problem).*effort.runs);
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
Json MethodJson(const ProblemMap& method, const CompleteProblems& complete, const Effort& effort,
                const std::map<int, double>& best_effort, const std::map<int, double>& best_cost) {
  Json values = Json::array(), cost = Json::array(), effort_ratio = Json::array(), cost_ratio = Json::array();
  Json share = Json::array(), job = Json::array();
  for (const auto& [problem, least] : best_effort) {
    const auto found = method.find(problem);
    const bool uncounted = effort.is_work && found != method.end() && !found->second.work_counted;
    const double own = uncounted ? kNever : ValueOf(method, problem, effort.score);
    const double own_cost = ValueOf(method, problem, &ProblemRuns::cost), cheapest = best_cost.at(problem);
    values.push_back(FiniteJson(own));
    cost.push_back(FiniteJson(own_cost));
    const bool known = std::ranges::binary_search(complete.problems, problem);
    effort_ratio.push_back(known && least > 0.0 ? FiniteJson(own / least) : Json());
    cost_ratio.push_back(known && cheapest > 0.0 ? FiniteJson(own_cost / cheapest) : Json());
    share.push_back(found == method.end() ? Json() : FiniteJson(found->second.time.Share()));
    job.push_back(found == method.end() ? Json() : Json(found->second.job_id));
  }
  return {{"effort_ms", values},      {"cost", cost},   {"effort_ratio", effort_ratio},
          {"cost_ratio", cost_ratio}, {"share", share}, {"job", job}};
}

}  // namespace

Json DescribeColumn(const std::vector<const SolveCell*>& cells) {
  const std::vector<ProblemMap> methods = ByProblem(cells);
  std::set<int> problems;
  for (const ProblemMap& method : methods) {
    for (const auto& [number, runs] : method) problems.insert(number);
  }
  const CompleteProblems complete = FindCompleteProblems(methods);
  const Effort effort = EffortOf(methods, complete);
  const auto best_effort = BestOf(methods, problems, effort.score);
  const auto best_cost = BestOf(methods, problems, &ProblemRuns::cost);
  Json values = Json::array();
  for (const ProblemMap& method : methods)
    values.push_back(MethodJson(method, complete, effort, best_effort, best_cost));
  double limit_ms = 0.0;
  for (const SolveCell* cell : cells) {
    if (cell != nullptr) limit_ms = limit_ms == 0.0 ? cell->limit_ms : std::min(limit_ms, cell->limit_ms);
  }
  const auto efforts = CompleteRows(methods, complete, effort.score, kLeastEffort_ms);
  return {{"limit_ms", limit_ms},
          {"effort", effort.name},
          {"problems", problems},
          {"complete", complete.problems.size()},
          {"methods", values},
          {"profiles",
           {{"effort", ProfileJson(complete, efforts)},
            {"cost", ProfileJson(complete, CompleteRows(methods, complete, &ProblemRuns::cost, 0.0))}}},
          {"efforts", EffortsJson(methods, complete, effort)},
          {"costs", CostsJson(methods, complete, best_cost)}};
}

namespace {

std::vector<BenchmarkColumn> ColumnsOf(const SolvedExperiment& experiment) {
  std::vector<BenchmarkColumn> columns;
  for (const BenchmarkColumn& column : kTableColumns) {
    const bool has = std::ranges::any_of(experiment.cells, [&](const SolveCell& c) { return c.column == column; });
    if (has) columns.push_back(column);
  }
  return columns;
}

std::vector<const SolveCell*> CellsOf(const SolvedExperiment& experiment, const std::vector<MethodIdentity>& methods,
                                      const BenchmarkColumn& column) {
  std::vector<const SolveCell*> cells;
  for (const MethodIdentity& method : methods) {
    const auto found = std::ranges::find_if(experiment.cells, [&](const SolveCell& cell) {
      return cell.method.method_id == method.method_id && cell.column == column;
    });
    cells.push_back(found == experiment.cells.end() ? nullptr : &*found);
  }
  return cells;
}

Json MethodsJson(ResultSource& source, const std::vector<MethodIdentity>& methods, const StatisticsTable& table) {
  Json list = Json::array();
  for (std::size_t i = 0; i < methods.size(); ++i) {
    const MethodIdentity& method = methods[i];
    const Listing row = source.Query(db::Sql(db::Query::kMethodOptions, {{"method_id", method.method_id}}));
    const auto options = TryParseJson(row.Text(0, "options_json"));
    list.push_back({{"id", method.method_id},
                    {"name", method.name},
                    {"title", i < table.rows.size() ? table.rows[i].title : method.name},
                    {"choice", ChoiceOf(method, methods)},
                    {"multi_starts", method.multi_starts},
                    {"sample_size", method.sample_size},
                    {"incremental", method.incremental},
                    {"collision", ToString(method.collision)},
                    {"hash", method.hash},
                    {"options", options ? Json(*options) : Json()}});
  }
  return list;
}

// Counts the jobs that ended without a solution by cause: the judge's verdict, or the state of jobs without a result.
// Queued, running and cancelled jobs are not failures.
Json CausesJson(ResultSource& source, const SolveCell& cell, Rule rule) {
  const Listing rows = source.Query(db::Sql(db::Query::kFailureCauses, {{"cell_id", cell.cell_id}, {"rule", rule}}));
  Json causes = Json::object();
  for (std::size_t i = 0; i < rows.rows.size(); ++i) {
    const auto& verdict = rows.At(i, "verdict");
    const bool done = rows.Text(i, "state") == ToString(JobState::kDone) && !verdict.is_null();
    const std::string cause = done ? verdict.get<std::string>() : rows.Text(i, "state");
    if (cause == ToString(Verdict::kSuccess)) continue;
    causes[cause] = causes.value(cause, std::int64_t{0}) + rows.At(i, "n").get<std::int64_t>();
  }
  return causes;
}

// Returns the jobs as columns, which keeps 100,000 of them small.
Json JobsJson(ResultSource& source, const SolvedExperiment& experiment, const KeptCells& kept,
              const std::vector<BenchmarkColumn>& columns) {
  const std::vector<MethodIdentity> methods = experiment.Methods();
  constexpr double kNoLimit_s = ResultSource::kDefaultLimit_s;
  const Listing rows =
      source.Query(db::Sql(db::Query::kPageJobs, {{"experiment_id", experiment.info.id}, {"cell_ids", kept.ids()}}),
                   ResultSource::kAllRows, kNoLimit_s);
  Json jobs = Json::object();
  for (const char* column : {"job",        "method",   "column",           "problem",         "repetition",
                             "state",      "status",   "literal",          "strict",          "solid",
                             "physical",   "cost",     "wall_us",          "cpu_us",          "contended",
                             "iterations", "restarts", "term_evaluations", "failed_waypoint", "detail"}) {
    jobs[column] = Json::array();
  }
  for (std::size_t i = 0; i < rows.rows.size(); ++i) {
    const auto method_id = rows.At(i, "method").get<std::int64_t>();
    const auto method = std::ranges::find(methods, method_id, &MethodIdentity::method_id);
    const BenchmarkColumn column{rows.EnumAt<Task>(i, "task"), rows.EnumAt<Initialization>(i, "initialization")};
    jobs["method"].push_back(method - methods.begin());
    jobs["column"].push_back(std::ranges::find(columns, column) - columns.begin());
    for (const char* same :
         {"job", "problem", "repetition", "state", "status", "literal", "strict", "solid", "physical", "cost",
          "wall_us", "cpu_us", "iterations", "restarts", "term_evaluations", "failed_waypoint", "detail"}) {
      jobs[same].push_back(Json(rows.At(i, same)));
    }
    const auto& switches = rows.At(i, "switches");
    jobs["contended"].push_back(!switches.is_null() &&
                                Contended(rows.At(i, "wall_us").get<std::int64_t>(),
                                          rows.At(i, "cpu_us").get<std::int64_t>(), switches.get<std::int64_t>()));
  }
  return jobs;
}

Json ColumnsJson(ResultSource& source, const SolvedExperiment& experiment, const std::vector<MethodIdentity>& methods,
                 const std::vector<BenchmarkColumn>& columns, Rule rule) {
  Json list = Json::array();
  for (const BenchmarkColumn& column : columns) {
    const auto cells = CellsOf(experiment, methods, column);
    Json json = {{"task", ToString(column.task)},
                 {"initialization", ToString(column.initialization)},
                 {"title", ColumnTitle(column)}};
    json.update(DescribeColumn(cells));
    json["causes"] = Json::array();
    for (const SolveCell* cell : cells) {
      json["causes"].push_back(cell == nullptr ? Json() : CausesJson(source, *cell, rule));
    }
    list.push_back(std::move(json));
  }
  return list;
}

// Compares all pairs of methods of one experiment.
Json PairsJson(const SourceOptions& options, const SolvedExperiment& experiment,
               const std::vector<MethodIdentity>& methods, const PageSelection& selection) {
  Json list = Json::array();
  for (std::size_t a = 0; a < methods.size(); ++a) {
    for (std::size_t b = a + 1; b < methods.size(); ++b) {
      if (methods.size() > kMaxCompared && a > 0) continue;
      ComparisonRequest request;
      request.a = ChoiceOf(methods[a], methods);
      request.b = ChoiceOf(methods[b], methods);
      request.experiment = experiment.info.id;
      request.rule = selection.rule;
      request.filter.tasks = selection.filter.tasks;
      request.filter.initializations = selection.filter.initializations;
      request.source = options;
      request.source.announce = nullptr;  // said once, for all methods
      try {
        Json pair = {{"a", a}, {"b", b}};
        pair.update(DescribeComparison(ReadComparison(request), experiment, experiment));
        for (Json& cell : pair["cells"]) {  // the page uses these members of `columns`
          cell.erase("problems");
          cell.erase("methods");
        }
        list.push_back(std::move(pair));
      } catch (const ClientError& error) {  // no jobs that both have finished
        list.push_back({{"a", a}, {"b", b}, {"refused", error.what()}});
      }
    }
  }
  return list;
}

// Reads the table with certificates, like `legopt table`.
BenchmarkTable ReadCertifiedTable(ResultSource& source, const ExperimentInfo& experiment, const PageSelection& page) {
  const TableSelection selection{experiment.id, page.rule, page.filter};
  BenchmarkTable table = ReadBenchmarkTable(source, selection);
  if (const auto certificate = FindEmbeddedCertificate(experiment)) {
    AddCertifiedCounts(source, *certificate, &table);
  }
  return table;
}

}  // namespace

Json DescribeComparison(const Comparison& comparison, const SolvedExperiment& a, const SolvedExperiment& b) {
  Json curves = Json::array();
  const auto cell_of = [](const SolvedExperiment& experiment, const MethodIdentity& method,
                          const BenchmarkColumn& column) -> const SolveCell* {
    const auto found = std::ranges::find_if(experiment.cells, [&](const SolveCell& cell) {
      return cell.method.method_id == method.method_id && cell.column == column;
    });
    return found == experiment.cells.end() ? nullptr : &*found;
  };
  for (const CellComparison& cell : comparison.cells) {
    curves.push_back(DescribeColumn({cell_of(a, cell.a, cell.column), cell_of(b, cell.b, cell.column)}));
  }
  return {{"report", ComparisonJson(comparison)}, {"cells", curves}};
}

PageExperiment DescribeExperiment(ResultSource& source, const SourceOptions& source_options, const std::string& place,
                                  std::optional<std::int64_t> id, const PageSelection& selection) {
  PageExperiment page;
  const Rule rule = selection.rule;
  SolvedExperiment& experiment = page.experiment;
  experiment = ReadCells(source, id);
  const KeptCells kept(source, experiment.info.id, selection.filter);
  KeepCells(kept, &experiment);
  ReadSolves(source, rule, &experiment);
  const BenchmarkTable table = ReadCertifiedTable(source, experiment.info, selection);
  const StatisticsTable statistics = ComputeStatistics(experiment, rule);
  const auto methods = experiment.Methods();
  const auto columns = ColumnsOf(experiment);
  const Listing times = source.Query(db::Sql(db::Query::kExperimentTimes, {{"experiment_id", experiment.info.id}}));
  page.json = {{"place", place},
               {"id", experiment.info.id},
               {"name", experiment.info.name},
               {"state", ToString(experiment.info.state)},
               {"unfinished", table.Sum().n - table.Sum().finished},
               {"dataset",
                {{"name", experiment.info.dataset_name},
                 {"hash", experiment.info.dataset_hash},
                 {"split", ToString(experiment.info.split)}}},
               {"rule", ToString(rule)},
               {"seed", experiment.seed},
               {"repetitions", experiment.repetitions},
               {"submitted_utc", times.At(0, "submitted")},
               {"newest_result_utc", times.At(0, "newest")},
               {"origin", DescribeOrigins(experiment.origins)},
               {"build_ids", BuildIds(experiment.origins)},
               {"table", BenchmarkTableJson(table)},
               {"statistics", StatisticsTableJson(statistics)},
               {"methods", MethodsJson(source, methods, statistics)},
               {"columns", ColumnsJson(source, experiment, methods, columns, rule)},
               {"pairs", PairsJson(source_options, experiment, methods, selection)},
               {"jobs", JobsJson(source, experiment, kept, columns)}};
  return page;
}

}  // namespace legopt::client

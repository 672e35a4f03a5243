#include "client/page/page_experiment.h"

#include <algorithm>
#include <map>

#include "client/compare/comparison_report.h"
#include "client/compare/statistics_table.h"
#include "client/page/page_curves.h"
#include "client/report/certified_counts.h"
#include "client/report/method_choice.h"
#include "client/report/reading.h"
#include "db/named_queries.h"
#include "legopt/input/json.h"
#include "legopt/types/job.h"

namespace legopt::client {
namespace {

using Json = nlohmann::ordered_json;

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
  for (const char* column :
       {"job", "method", "column", "problem", "repetition", "state", "status", "literal", "strict", "solid", "cost",
        "wall_us", "cpu_us", "contended", "iterations", "restarts", "term_evaluations", "failed_waypoint", "detail"}) {
    jobs[column] = Json::array();
  }
  for (std::size_t i = 0; i < rows.rows.size(); ++i) {
    const auto method_id = rows.At(i, "method").get<std::int64_t>();
    const auto method = std::ranges::find(methods, method_id, &MethodIdentity::method_id);
    const BenchmarkColumn column{rows.EnumAt<Task>(i, "task"), rows.EnumAt<Initialization>(i, "initialization")};
    jobs["method"].push_back(method - methods.begin());
    jobs["column"].push_back(std::ranges::find(columns, column) - columns.begin());
    for (const char* same :
         {"job", "problem", "repetition", "state", "status", "literal", "strict", "solid", "cost", "wall_us", "cpu_us",
          "iterations", "restarts", "term_evaluations", "failed_waypoint", "detail"}) {
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
      try {
        Json pair = {{"a", a}, {"b", b}};
        pair.update(DescribeComparison(ReadComparison(request), experiment, experiment));
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
    AddCertifiedCounts(source, selection, *certificate, &table);
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

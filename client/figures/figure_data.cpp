#include "client/figures/figure_data.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "client/client_error.h"
#include "client/report/benchmark_table.h"
#include "legopt/statistics/internal/checks.h"

namespace legopt::client {
namespace {

std::vector<ProblemRuns> RunsOfProblems(const ProblemMap& problems, const std::vector<int>& kept) {
  std::vector<ProblemRuns> runs;
  for (const int problem : kept) runs.push_back(problems.at(problem));
  return runs;
}

// Returns the title of the first method with a problem that is not `known`; empty if there is none.
std::string TitleWithout(bool ProblemRuns::*known, const FigureData& data) {
  for (const FigureColumn& column : data.columns) {
    for (std::size_t i = 0; i < column.runs.size(); ++i) {
      if (!std::ranges::all_of(column.runs[i], known)) return data.table.rows[column.entries[i]].title;
    }
  }
  return {};
}

FigureColumn MakeColumn(const BenchmarkColumn& column, const std::vector<const SolveCell*>& cells,
                        const StatisticsTable& table) {
  FigureColumn made{column, {}, {}, {}};
  std::vector<ProblemMap> problems;
  for (const SolveCell* cell : cells) problems.push_back(ProblemMapOf(*cell));
  const CompleteProblems complete = FindCompleteProblems(problems);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const auto row = std::ranges::find_if(table.rows, [&](const StatisticsRow& candidate) {
      return candidate.method.method_id == cells[i]->method.method_id;
    });
    if (!complete.shown[i]) {
      made.left_out.push_back(row->title);
      continue;
    }
    made.entries.push_back(static_cast<std::size_t>(row - table.rows.begin()));
    made.runs.push_back(RunsOfProblems(problems[i], complete.problems));
  }
  return made;
}

}  // namespace

FigureData ReadFigureData(ResultSource& source, const TableSelection& selection,
                          const std::vector<std::string>& columns) {
  const SolvedExperiment experiment = ReadSelectedSolves(source, selection);
  FigureData data{ComputeStatistics(experiment, selection.rule), {}};
  std::map<BenchmarkColumn, std::vector<const SolveCell*>> cells;
  for (const SolveCell& cell : experiment.cells) cells[cell.column].push_back(&cell);
  for (const auto& [column, of_column] : cells) data.columns.push_back(MakeColumn(column, of_column, data.table));
  KeepRows(columns, &data.columns);
  return data;
}

Measure UsualMeasure(const FigureData& data) {
  return TitleWithout(&ProblemRuns::work_counted, data).empty() ? Measure::kWork : Measure::kTime;
}

void RequireMeasure(const FigureData& data, Measure measure) {
  if (measure == Measure::kTolerance) {
    const std::string title = TitleWithout(&ProblemRuns::tolerance_known, data);
    if (title.empty()) return;
    throw ClientError(ExitCode::kUsage, "the violations of the solutions of " + title +
                                            " were not stored (results of an old release); give another --measure");
  }
  if (measure != Measure::kWork) return;
  const std::string title = TitleWithout(&ProblemRuns::work_counted, data);
  if (title.empty()) return;
  throw ClientError(ExitCode::kUsage, "the work of " + title +
                                          " was not counted (external solver, or results before schema 16); give "
                                          "--measure time");
}

namespace {

const statistics::ProblemScore& ScoreOf(const ProblemRuns& runs, Measure measure) {
  switch (measure) {
    case Measure::kWork:
      return runs.work;
    case Measure::kTime:
      return runs.time;
    case Measure::kTolerance:
      return runs.tolerance;
    case Measure::kCost:
      break;
  }
  return runs.cost;
}

}  // namespace

double ValueOf(const ProblemRuns& runs, Measure measure) { return ScoreOf(runs, measure).MeanSolvedValue(); }

double ValueOfAll(const ProblemRuns& runs, Measure measure) {
  return ScoreOf(runs, measure).Charged(statistics::kInfinity);
}

const std::vector<statistics::Repetition>& RunsOf(const ProblemRuns& runs, Measure measure) {
  switch (measure) {
    case Measure::kWork:
      return runs.work_runs;
    case Measure::kTime:
      return runs.runs;
    case Measure::kTolerance:
      return runs.tolerance_runs;
    case Measure::kCost:
      break;
  }
  return runs.cost_runs;
}

std::string TitleOf(Measure measure) {
  switch (measure) {
    case Measure::kWork:
      return "work (ms)";
    case Measure::kTime:
      return "CPU time (ms)";
    case Measure::kTolerance:
      return "largest violation (m or rad; 1e-8: none)";
    case Measure::kCost:
      break;
  }
  return "cost per waypoint";
}

}  // namespace legopt::client

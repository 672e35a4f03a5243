#include "client/figures/figure_data.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "app/printable.h"
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

// Returns the title of the first method with a solved run whose work was not counted; empty if there is none.
std::string TitleWithoutWork(const FigureData& data) {
  for (const FigureColumn& column : data.columns) {
    for (std::size_t i = 0; i < column.runs.size(); ++i) {
      const bool counted = std::ranges::all_of(column.runs[i], &ProblemRuns::work_counted);
      if (!counted) return data.table.rows[column.entries[i]].title;
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
  return TitleWithoutWork(data).empty() ? Measure::kWork : Measure::kTime;
}

void RequireMeasure(const FigureData& data, Measure measure) {
  if (measure != Measure::kWork) return;
  const std::string title = TitleWithoutWork(data);
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
    case Measure::kCost:
      break;
  }
  return "cost per waypoint";
}

PlotAxis AxisFor(const std::string& title, const std::vector<double>& values) {
  constexpr double kTen = 10.0, kRoom = 1.05, kSmallest = 1e-100, kLargest = 1e100;
  double least = INFINITY, most = -INFINITY;
  for (const double value : values) {
    if (!std::isfinite(value) || std::abs(value) > kLargest) continue;
    least = std::min(least, value);
    most = std::max(most, value);
  }
  PlotAxis axis;
  axis.title = title;
  if (least > kSmallest && std::isfinite(least)) {
    axis.logarithmic = true;
    axis.from = std::pow(kTen, std::floor(std::log10(least)));
    axis.to = std::max(std::pow(kTen, std::ceil(std::log10(most))), kTen * axis.from);
  } else if (std::isfinite(least)) {
    axis.from = std::min(least, 0.0);
    axis.to = most > axis.from ? axis.from + kRoom * (most - axis.from) : axis.from + 1.0;
  }
  return axis;
}

PlotPanel PanelOf(const FigureColumn& column, PlotKind kind) {
  PlotPanel panel;
  panel.kind = kind;
  panel.title = ColumnTitle(column.column) + ": " + std::to_string(column.problems()) +
                (column.problems() == 1 ? " problem" : " problems");
  std::string left_out;
  for (const std::string& title : column.left_out) left_out += (left_out.empty() ? "" : ", ") + title;
  if (!left_out.empty())
    panel.notes.push_back(app::Printable("Left out, without a completed problem: " + left_out + "."));
  if (column.problems() == 0) panel.notes.emplace_back("No problem has been completed by every method.");
  return panel;
}

}  // namespace legopt::client

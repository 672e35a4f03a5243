#include "client/compare/target_table.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "client/report/benchmark_table.h"
#include "legopt/statistics/problem_scores.h"
#include "legopt/types/number_text.h"

namespace legopt::client {
namespace {

using statistics::RunOutcome;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Lowest costs of solved runs, by task and problem.
using BestCosts = EnumArray<Task, std::map<int, double>>;

BestCosts BestCostsOf(const SolvedExperiment& experiment) {
  BestCosts best;
  for (const SolveCell& cell : experiment.cells) {
    for (const Solve& solve : cell.solves) {
      if (solve.end != RunOutcome::kSolved) continue;
      const auto [place, fresh] = best[cell.column.task].emplace(solve.problem, solve.cost);
      if (!fresh) place->second = std::min(place->second, solve.cost);
    }
  }
  return best;
}

bool WorkIsCounted(const SolvedExperiment& experiment, const BenchmarkColumn& column) {
  return std::ranges::all_of(experiment.cells, [&](const SolveCell& cell) {
    return cell.column != column || std::ranges::all_of(cell.solves, [](const Solve& solve) {
             return solve.end == RunOutcome::kMissing || solve.work_ms > 0.0;
           });
  });
}

// The finished runs of each problem.
std::map<int, std::vector<const Solve*>> RunsByProblem(const SolveCell& cell) {
  std::map<int, std::vector<const Solve*>> runs;
  for (const Solve& solve : cell.solves) {
    if (solve.end != RunOutcome::kMissing) runs[solve.problem].push_back(&solve);
  }
  return runs;
}

TargetFigures FiguresOf(const std::map<int, std::vector<const Solve*>>& problems, const std::map<int, double>& best,
                        double ratio, bool by_work) {
  std::vector<double> spent_ms, shares;
  for (const auto& [problem, runs] : problems) {
    const auto known = best.find(problem);
    double spent = 0.0, reached = 0.0;
    for (const Solve* run : runs) {
      spent += by_work ? run->work_ms : run->time_ms;
      const bool reaches = run->end == RunOutcome::kSolved && run->cost <= ratio * known->second;
      reached += reaches ? 1.0 : 0.0;
    }
    const auto count = static_cast<double>(runs.size());
    spent_ms.push_back(spent / count);
    shares.push_back(reached / count);
  }
  const statistics::ExpectedTime expected = statistics::ExpectedRunningTime(spent_ms, shares);
  return {expected.successes, expected.successes > 0.0 ? std::optional(expected.time_ms) : std::nullopt};
}

double GapOf(const std::vector<const Solve*>& runs, const std::map<int, double>& best) {
  double cost = 0.0;
  int solved = 0;
  for (const Solve* run : runs) {
    if (run->end != RunOutcome::kSolved) continue;
    cost += run->cost;
    ++solved;
  }
  if (solved == 0) return kInfinity;
  const double least = best.at(runs.front()->problem);
  const double mean = cost / solved;
  if (mean == least) return 0.0;
  return least > 0.0 ? mean / least - 1.0 : kInfinity;
}

TargetCell CellOf(const SolveCell& cell, const std::map<int, double>& best, const std::vector<double>& ratios,
                  bool by_work) {
  constexpr std::array kShares = {0.5, 0.95};
  TargetCell figures;
  const auto problems = RunsByProblem(cell);
  figures.n = static_cast<int>(problems.size());
  for (const double ratio : ratios) figures.targets.push_back(FiguresOf(problems, best, ratio, by_work));
  std::vector<double> gaps;
  for (const auto& [problem, runs] : problems) gaps.push_back(GapOf(runs, best));
  if (gaps.empty()) return figures;
  const std::vector<double> quantiles = statistics::Quantiles(gaps, kShares);
  figures.gap_median = quantiles[0];
  figures.gap_q95 = quantiles[1];
  return figures;
}

std::string RatioText(double ratio) { return FormatGeneral(ratio, 4); }

std::vector<TableColumn> Columns(const TargetTable& table, bool exact) {
  std::vector<TableColumn> columns = {
      {"method", "Method", "", Alignment::kLeft}, {"multi_starts", "Multi-starts"}, {"sample_size", "Sample size"}};
  if (exact) {
    columns.insert(columns.end(), {{"task", "Task", "", Alignment::kLeft},
                                   {"initialization", "Initial guess", "", Alignment::kLeft},
                                   {"measure", "Measure", "", Alignment::kLeft}});
  }
  columns.insert(columns.end(), {{"problems", "Problems"}, {"gap_median", "Gap", "%"}, {"gap_q95", "Gap 95 %", "%"}});
  for (const double ratio : table.ratios) {
    const std::string group = "cost at most " + RatioText(ratio) + " x best";
    columns.push_back({"reached_" + RatioText(ratio), "Reached", "", Alignment::kRight, group});
    columns.push_back({"ert_ms_" + RatioText(ratio), "ERT", "ms", Alignment::kRight, group});
  }
  return columns;
}

TableCell PercentOf(double gap) {
  constexpr double kPerUnit = 100.0;
  if (!std::isfinite(gap)) return {nullptr, "inf"};
  return FigureCell(gap, FormatGeneral(kPerUnit * gap, 3));
}

std::string EffortText(double effort_ms) {
  constexpr double kWhole = 100.0;
  constexpr int kDigits = 3;
  return effort_ms >= kWhole ? FormatFixed(effort_ms, 0) : FormatGeneral(effort_ms, kDigits);
}

TableRow RowOf(const TargetTable& table, std::size_t index, const BenchmarkColumn& column, const TargetCell& cell,
               bool exact) {
  const StatisticsRow& row = table.statistics.rows[index];
  TableRow line;
  line.cells = {TextCell(exact ? row.method.name : row.title), CountCell(row.method.multi_starts),
                CountCell(row.method.sample_size)};
  if (exact) {
    line.cells.insert(line.cells.end(), {TextCell(std::string(ToString(column.task))),
                                         TextCell(std::string(ToString(column.initialization))),
                                         TextCell(table.by_work.at(column) ? "work" : "time")});
  }
  line.cells.insert(line.cells.end(), {CountCell(cell.n), PercentOf(cell.gap_median), PercentOf(cell.gap_q95)});
  for (const TargetFigures& target : cell.targets) {
    line.cells.push_back(FigureCell(target.reached, FormatGeneral(target.reached, 4)));
    line.cells.push_back(target.ert_ms ? FigureCell(*target.ert_ms, EffortText(*target.ert_ms)) : MissingCell());
  }
  if (!exact) {
    line.group = ColumnTitle(column) + (table.by_work.at(column) ? ", effort: work" : ", effort: CPU time");
  }
  return line;
}

}  // namespace

TargetTable ComputeTargets(const SolvedExperiment& experiment, Rule rule, const std::vector<double>& ratios) {
  TargetTable table;
  table.statistics = ComputeStatistics(experiment, rule);
  table.ratios = ratios;
  const BestCosts best = BestCostsOf(experiment);
  table.cells.resize(table.statistics.rows.size());
  for (const SolveCell& cell : experiment.cells) {
    const auto row = std::ranges::find(table.statistics.rows, cell.method.method_id,
                                       [](const StatisticsRow& one) { return one.method.method_id; });
    if (row == table.statistics.rows.end()) continue;
    const bool by_work = table.by_work.try_emplace(cell.column, WorkIsCounted(experiment, cell.column)).first->second;
    table.cells[static_cast<std::size_t>(row - table.statistics.rows.begin())][cell.column] =
        CellOf(cell, best[cell.column.task], ratios, by_work);
  }
  return table;
}

std::string RenderTargetTable(const TargetTable& table, TableFormat format, const TableStyle& style) {
  const bool exact = IsExact(format);
  Table shown;
  shown.title = {CaptionOf("Fixed targets", table.statistics)};
  shown.columns = Columns(table, exact);
  for (const auto& [column, by_work] : table.by_work) {
    for (std::size_t row = 0; row < table.cells.size(); ++row) {
      const auto cell = table.cells[row].find(column);
      if (cell != table.cells[row].end()) shown.rows.push_back(RowOf(table, row, column, cell->second, exact));
    }
  }
  shown.notes = {
      {"Best: lowest cost of a problem over all runs of these rows. Gap: cost above the best, median and 95 % "
       "quantile over all problems, an unsolved one infinite. Reached: problems solved at a cost within the "
       "target. ERT: effort of all runs over the number of runs that reach the target."}};
  return RenderTable(KeepColumns(shown, style.columns), format, style.layout);
}

}  // namespace legopt::client

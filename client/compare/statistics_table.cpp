#include "client/compare/statistics_table.h"

#include <algorithm>
#include <cmath>
#include <ranges>
#include <tuple>
#include <utility>

#include "client/client_error.h"
#include "legopt/statistics/hypothesis_tests.h"
#include "legopt/statistics/internal/checks.h"
#include "legopt/statistics/problem_scores.h"

namespace legopt::client {
namespace {

using statistics::ProblemScore;

constexpr double kHalf = 0.5, kAlmostAll = 0.95;

std::optional<double> UnlessNan(double value) { return std::isnan(value) ? std::nullopt : std::optional(value); }

// A cell and the location of its statistics.
struct ScoredCell {
  const SolveCell* cell = nullptr;
  CellStatistics* figures = nullptr;
  const std::string* title = nullptr;  // title of its row
};

// The cells of a task and initialization, and their problems.
struct ScoredColumn {
  std::vector<ScoredCell> cells;
  std::vector<ProblemMap> problems;  // parallel to `cells`
  CompleteProblems complete;
};

std::vector<ProblemScore> Scores(const ProblemMap& cell, const std::vector<int>& problems,
                                 ProblemScore ProblemRuns::*score) {
  std::vector<ProblemScore> scores;
  for (const int problem : problems) scores.push_back(cell.at(problem).*score);
  return scores;
}

// Returns the means of the solved runs, infinite for problems without solved runs.
std::vector<double> SolvedValues(const std::vector<ProblemScore>& scores) {
  std::vector<double> values;
  for (const ProblemScore& score : scores) values.push_back(score.MeanSolvedValue());
  return values;
}

std::pair<std::optional<double>, std::optional<double>> MedianAndTail(const std::vector<ProblemScore>& scores) {
  const double shares[] = {kHalf, kAlmostAll};
  const auto quantiles = statistics::Quantiles(SolvedValues(scores), shares);
  return {UnlessNan(quantiles[0]), UnlessNan(quantiles[1])};
}

bool WorkCounted(const ProblemMap& runs, const std::vector<int>& problems) {
  return std::ranges::all_of(problems, [&](int problem) { return runs.at(problem).work_counted; });
}

void CountRuns(const SolveCell& cell, const std::vector<int>& problems, CellStatistics* figures) {
  for (const Solve& solve : cell.solves) {
    if (!std::ranges::binary_search(problems, solve.problem)) continue;
    ++figures->runs;
    if (!solve.reported) continue;
    ++figures->reported;
    figures->contended += solve.contended ? 1 : 0;
    figures->stopped += solve.stopped ? 1 : 0;
    figures->cpu_ms += solve.cpu_ms;
  }
}

// Solves of a problem are in the order of their repetitions.
void ComputeSpread(const SolveCell& cell, const std::vector<int>& problems, std::int64_t repetitions,
                   CellStatistics* figures) {
  if (repetitions < 2 || figures->runs != repetitions * std::ssize(problems)) return;
  std::vector<int> solved(static_cast<std::size_t>(repetitions), 0);
  std::size_t next = 0;
  for (const Solve& solve : cell.solves) {
    if (!std::ranges::binary_search(problems, solve.problem)) continue;
    solved[next++ % solved.size()] += solve.end == statistics::RunOutcome::kSolved ? 1 : 0;
  }
  const auto [least, most] = std::ranges::minmax(solved);
  figures->solved_least = least;
  figures->solved_most = most;
}

void ComputeToleranceAndStarts(const SolveCell& cell, const std::vector<int>& problems, CellStatistics* figures) {
  std::vector<double> used;
  std::int64_t solved = 0, counted = 0, sum = 0, largest = 0;
  for (const Solve& solve : cell.solves) {
    if (!solve.reported || !std::ranges::binary_search(problems, solve.problem)) continue;
    solved += solve.end == statistics::RunOutcome::kSolved ? 1 : 0;
    if (solve.tolerance_used) used.push_back(*solve.tolerance_used);
    if (!solve.further_starts) continue;
    ++counted;
    sum += *solve.further_starts;
    largest = std::max(largest, *solve.further_starts);
  }
  if (!used.empty() && std::ssize(used) == solved) {
    const double shares[] = {kHalf, 1.0};
    const auto quantiles = statistics::Quantiles(used, shares);
    figures->tolerance_median = quantiles[0];
    figures->tolerance_largest = quantiles[1];
  }
  if (counted > 0 && counted == figures->reported) {
    figures->further_starts_mean = static_cast<double>(sum) / static_cast<double>(counted);
    figures->further_starts_largest = largest;
  }
}

// Computes the figures that do not depend on other methods.
void ComputeOwn(const ScoredCell& scored, const ProblemMap& runs, const std::vector<int>& problems,
                std::int64_t repetitions, const Charge& charge) {
  CellStatistics& figures = *scored.figures;
  figures.n = static_cast<int>(problems.size());
  if (problems.empty()) return;
  CountRuns(*scored.cell, problems, &figures);
  ComputeSpread(*scored.cell, problems, repetitions, &figures);
  ComputeToleranceAndStarts(*scored.cell, problems, &figures);
  const std::vector<ProblemScore> times = Scores(runs, problems, &ProblemRuns::time);
  std::vector<double> spent, shares;
  double charged_ms = 0.0;
  for (std::size_t i = 0; i < problems.size(); ++i) {
    figures.solved += times[i].Share();
    spent.push_back(times[i].Spent());
    shares.push_back(times[i].Share());
    charged_ms += charge.Apply(runs.at(problems[i]));
  }
  figures.share = statistics::WilsonInterval(std::min(figures.solved, static_cast<double>(figures.n)), figures.n);
  std::tie(figures.time_median_ms, figures.time_q95_ms) = MedianAndTail(times);
  if (WorkCounted(runs, problems)) {
    figures.work_median_ms = MedianAndTail(Scores(runs, problems, &ProblemRuns::work)).first;
  }
  std::tie(figures.cost_median, figures.cost_q95) = MedianAndTail(Scores(runs, problems, &ProblemRuns::cost));
  figures.par10_ms = charged_ms / figures.n;
  figures.ert_ms = UnlessNan(statistics::ExpectedRunningTime(spent, shares).time_ms);
}

// Returns the indices of the shown cells of a column.
std::vector<std::size_t> ShownCells(const ScoredColumn& column) {
  std::vector<std::size_t> shown;
  for (std::size_t i = 0; i < column.cells.size(); ++i) {
    if (column.complete.shown[i]) shown.push_back(i);
  }
  return shown;
}

bool Solved(const ScoredColumn& column, std::size_t cell, int problem) {
  return column.problems[cell].at(problem).time.solved > 0;
}

void ComputeCommon(const ScoredColumn& scored, ColumnStatistics* column) {
  const auto shown = ShownCells(scored);
  std::vector<int> common;
  for (const int problem : scored.complete.problems) {
    if (std::ranges::all_of(shown, [&](std::size_t i) { return Solved(scored, i, problem); })) {
      common.push_back(problem);
    }
  }
  column->common = static_cast<int>(common.size());
  for (const std::size_t i : shown) {
    CellStatistics& figures = *scored.cells[i].figures;
    const auto times = SolvedValues(Scores(scored.problems[i], common, &ProblemRuns::time));
    const auto costs = SolvedValues(Scores(scored.problems[i], common, &ProblemRuns::cost));
    figures.common_time_ms = UnlessNan(statistics::ShiftedGeometricMean(times, kShift_ms));
    const bool positive = std::ranges::all_of(costs, [](double cost) { return cost > 0.0; });
    if (positive) figures.common_cost = UnlessNan(statistics::GeometricMean(costs));
  }
}

// Compares a row with the reference on the problems that both solved, so that weak rows do not affect other rows.
void ComparePaired(const ScoredColumn& scored, std::size_t reference, std::size_t row) {
  std::vector<double> work, times, costs;
  bool counted = true;
  CellStatistics& figures = *scored.cells[row].figures;
  for (const int problem : scored.complete.problems) {
    if (!Solved(scored, row, problem) || !Solved(scored, reference, problem)) continue;
    ++figures.paired;
    const ProblemRuns &own = scored.problems[row].at(problem), &other = scored.problems[reference].at(problem);
    times.push_back(std::max(own.time.MeanSolvedValue(), kShortest_ms) /
                    std::max(other.time.MeanSolvedValue(), kShortest_ms));
    counted = counted && own.work_counted && other.work_counted;
    work.push_back(own.work.MeanSolvedValue() / other.work.MeanSolvedValue());
    const double own_cost = own.cost.MeanSolvedValue(), other_cost = other.cost.MeanSolvedValue();
    if (own_cost > 0.0 && other_cost > 0.0) costs.push_back(own_cost / other_cost);
  }
  if (counted) figures.work_ratio = UnlessNan(statistics::GeometricMean(work));
  figures.time_ratio = UnlessNan(statistics::GeometricMean(times));
  figures.cost_ratio = UnlessNan(statistics::GeometricMean(costs));
}

void ComputePaired(const ScoredColumn& scored, ColumnStatistics* column) {
  const auto shown = ShownCells(scored);
  if (scored.complete.problems.empty()) return;
  const std::size_t reference =
      *std::ranges::max_element(shown, {}, [&](std::size_t i) { return scored.cells[i].figures->solved; });
  column->reference = *scored.cells[reference].title;
  for (const std::size_t i : shown) ComparePaired(scored, reference, i);
}

void ComputeRanks(const ScoredColumn& scored, std::int64_t repetitions, ColumnStatistics* column) {
  const auto shown = ShownCells(scored);
  column->by_work = std::ranges::all_of(
      shown, [&](std::size_t i) { return WorkCounted(scored.problems[i], scored.complete.problems); });
  std::vector<std::vector<double>> times;
  std::vector<std::vector<int>> solved;
  for (const int problem : scored.complete.problems) {
    auto& line = times.emplace_back();
    auto& success = solved.emplace_back();
    for (const std::size_t i : shown) {
      const ProblemRuns& runs = scored.problems[i].at(problem);
      line.push_back((column->by_work ? runs.work : runs.time).Charged(statistics::kInfinity));
      success.push_back(Solved(scored, i, problem) ? 1 : 0);
    }
  }
  const statistics::FriedmanTest ranked = statistics::Friedman(times);
  for (std::size_t i = 0; i < ranked.mean_ranks.size(); ++i) {
    scored.cells[shown[i]].figures->mean_rank = ranked.mean_ranks[i];
  }
  constexpr std::size_t kFewest = 3;  // two are compared by McNemar's and Wilcoxon's tests
  if (shown.size() >= kFewest && !times.empty()) {
    if (repetitions == 1) column->success = statistics::CochranQ(solved);
    column->ranks = ranked;
  }
  for (std::vector<double>& line : times) {
    for (double& time_ms : line) time_ms = std::max(time_ms, kShortest_ms);  // avoids ratios of zero times
  }
  column->profile = statistics::ProfileOf(times);
}

void ComputeColumn(ScoredColumn* scored, std::int64_t repetitions, ColumnStatistics* column) {
  for (const ScoredCell& cell : scored->cells) scored->problems.push_back(ProblemMapOf(*cell.cell));
  scored->complete = FindCompleteProblems(scored->problems);
  column->complete = static_cast<int>(scored->complete.problems.size());
  for (std::size_t i = 0; i < scored->cells.size(); ++i) {
    const ScoredCell& cell = scored->cells[i];
    const ProblemMap& problems = scored->problems[i];
    cell.figures->missing = static_cast<int>(
        std::ranges::count_if(problems, [](const auto& problem) { return !problem.second.complete(); }));
    if (scored->complete.shown[i]) {
      ComputeOwn(cell, problems, scored->complete.problems, repetitions, column->charge);
    } else {
      column->left_out.push_back(*cell.title);
    }
  }
  ComputeCommon(*scored, column);
  ComputePaired(*scored, column);
  ComputeRanks(*scored, repetitions, column);
}

// Sets the row names of the benchmark table.
void NameRows(std::vector<StatisticsRow>* rows) {
  struct Named {
    std::string method;
    std::int64_t multi_starts, sample_size;
    SceneRepresentation collision;
  };
  std::vector<Named> named;
  std::vector<std::int64_t> method_ids;
  for (const StatisticsRow& row : *rows) {
    named.push_back({row.method.name, row.method.multi_starts, row.method.sample_size, row.method.collision});
    method_ids.push_back(row.method.method_id);
  }
  DisambiguateRows(method_ids, &named);
  for (std::size_t i = 0; i < rows->size(); ++i) (*rows)[i].title = named[i].method;
}

// Removes the cells that are not selected. Statistics that depend on several methods are over the remaining ones.
void KeepSelected(ResultSource& source, const TableSelection& selection, SolvedExperiment* experiment) {
  const KeptCells kept(source, experiment->info.id, selection.filter);
  KeepCells(kept, experiment);
  std::vector<MethodIdentity> methods = experiment->Methods();
  KeepRows(selection.rows, &methods);
  std::erase_if(experiment->cells, [&](const SolveCell& cell) {
    return std::ranges::find(methods, cell.method.method_id, &MethodIdentity::method_id) == methods.end();
  });
}

}  // namespace

StatisticsTable ComputeStatistics(const SolvedExperiment& experiment, Rule rule, std::optional<double> charge_ms) {
  StatisticsTable table;
  table.experiment = experiment.info;
  table.seed = experiment.seed;
  table.repetitions = experiment.repetitions;
  table.rule = rule;
  table.origins = experiment.origins;
  table.clock_stopped = experiment.clock_stopped;
  table.taken_over = experiment.taken_over;
  for (const MethodIdentity& method : experiment.Methods()) table.rows.push_back({method, {}, {}});
  NameRows(&table.rows);
  const EnumArray<Task, Charge> charges = ChargesOf(experiment.cells, charge_ms);
  std::map<BenchmarkColumn, ScoredColumn> columns;
  for (const SolveCell& cell : experiment.cells) {
    const auto row = std::ranges::find_if(table.rows, [&](const StatisticsRow& candidate) {
      return candidate.method.method_id == cell.method.method_id;
    });
    columns[cell.column].cells.push_back({&cell, &row->cells[cell.column], &row->title});
    table.jobs += std::ssize(cell.solves);
    table.finished += std::ranges::count_if(
        cell.solves, [](const Solve& solve) { return solve.end != statistics::RunOutcome::kMissing; });
  }
  for (auto& [column, scored] : columns) {
    table.columns[column].charge = charges[column.task];
    ComputeColumn(&scored, experiment.repetitions, &table.columns[column]);
  }
  return table;
}

SolvedExperiment ReadSelectedSolves(ResultSource& source, const TableSelection& selection) {
  SolvedExperiment experiment = ReadCells(source, selection.experiment);
  KeepSelected(source, selection, &experiment);
  ReadSolves(source, selection.rule, &experiment);
  return experiment;
}

StatisticsTable ReadStatisticsTable(ResultSource& source, const TableSelection& selection,
                                    std::optional<double> charge_ms) {
  return ComputeStatistics(ReadSelectedSolves(source, selection), selection.rule, charge_ms);
}

}  // namespace legopt::client

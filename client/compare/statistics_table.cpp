#include "client/compare/statistics_table.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <tuple>
#include <utility>

#include "client/client_error.h"
#include "legopt/statistics/charged_times.h"
#include "legopt/statistics/checks.h"
#include "legopt/statistics/proportions.h"

namespace legopt::client {
namespace {

using statistics::ProblemScore;

constexpr double kHalf = 0.5, kAlmostAll = 0.95;

std::optional<double> NumberOf(double value) { return std::isnan(value) ? std::nullopt : std::optional(value); }

// A cell's problems by their number, with the place of its figures.
struct ScoredCell {
  CellStatistics* figures;
  std::map<int, ProblemRuns> problems;
};

std::vector<ProblemScore> Scores(const ScoredCell& cell, ProblemScore ProblemRuns::*score) {
  std::vector<ProblemScore> scores;
  for (const auto& [number, problem] : cell.problems) scores.push_back(problem.*score);
  return scores;
}

// Mean values of the solved runs, infinite for problems without; missing problems are left out.
std::vector<double> SolvedValues(const std::vector<ProblemScore>& scores) {
  std::vector<double> values;
  for (const ProblemScore& score : scores) {
    if (score.finished() > 0) values.push_back(score.MeanOfSolved());
  }
  return values;
}

std::pair<std::optional<double>, std::optional<double>> MedianAndTail(const std::vector<ProblemScore>& scores) {
  const double shares[] = {kHalf, kAlmostAll};
  const auto quantiles = statistics::Quantiles(SolvedValues(scores), shares);
  return {NumberOf(quantiles[0]), NumberOf(quantiles[1])};
}

void CountRuns(const SolveCell& cell, CellStatistics* figures) {
  for (const Solve& solve : cell.solves) {
    figures->runs += solve.end == statistics::RunEnd::kMissing ? 0 : 1;
    if (!solve.reported) continue;
    ++figures->reported;
    figures->contended += solve.contended ? 1 : 0;
    figures->stopped += solve.stopped ? 1 : 0;
    figures->cpu_ms += solve.cpu_ms;
  }
}

// All that needs no other method.
void ComputeOwn(const SolveCell& cell, const ScoredCell& scored, const Charge& charge) {
  CellStatistics& figures = *scored.figures;
  CountRuns(cell, &figures);
  const std::vector<ProblemScore> times = Scores(scored, &ProblemRuns::time);
  std::vector<double> spent, shares;
  for (const ProblemScore& score : times) {
    if (score.finished() == 0) {
      ++figures.missing;
      continue;
    }
    ++figures.n;
    figures.solved += score.Share();
    spent.push_back(score.Spent());
    shares.push_back(score.Share());
  }
  figures.share = statistics::WilsonInterval(std::min(figures.solved, static_cast<double>(figures.n)), figures.n);
  std::tie(figures.time_median_ms, figures.time_q95_ms) = MedianAndTail(times);
  std::tie(figures.cost_median, figures.cost_q95) = MedianAndTail(Scores(scored, &ProblemRuns::cost));
  figures.par10_ms = NumberOf(statistics::MeanCharged(times, charge.ms));
  figures.ert_ms = NumberOf(statistics::ExpectedRunningTime(spent, shares).time_ms);
}

// The problems for which `holds` is true in every cell.
template <class Condition>
std::vector<int> ProblemsWhereAll(const std::vector<ScoredCell>& cells, const Condition& holds) {
  std::vector<int> found;
  for (const auto& [number, first] : cells.front().problems) {
    const bool all = std::all_of(cells.begin(), cells.end(), [&, problem = number](const ScoredCell& cell) {
      const auto at = cell.problems.find(problem);
      return at != cell.problems.end() && holds(at->second.time);
    });
    if (all) found.push_back(number);
  }
  return found;
}

void ComputeCommon(const std::vector<ScoredCell>& cells, ColumnStatistics* column) {
  const auto common = ProblemsWhereAll(cells, [](const ProblemScore& time) { return time.solved > 0; });
  column->common = static_cast<int>(common.size());
  for (const ScoredCell& cell : cells) {
    std::vector<double> times, costs;
    for (const int problem : common) {
      times.push_back(cell.problems.at(problem).time.MeanOfSolved());
      costs.push_back(cell.problems.at(problem).cost.MeanOfSolved());
    }
    cell.figures->common_time_ms = NumberOf(statistics::ShiftedGeometricMean(times, kShift_ms));
    const bool positive = std::all_of(costs.begin(), costs.end(), [](double cost) { return cost > 0.0; });
    if (positive) cell.figures->common_cost = NumberOf(statistics::GeometricMean(costs));
  }
}

void ComputeRanks(const std::vector<ScoredCell>& cells, std::int64_t repetitions, ColumnStatistics* column) {
  const auto complete = ProblemsWhereAll(cells, [](const ProblemScore& time) { return time.finished() > 0; });
  column->complete = static_cast<int>(complete.size());
  std::vector<std::vector<double>> times;
  std::vector<std::vector<int>> solved;
  for (const int problem : complete) {
    auto& line = times.emplace_back();
    auto& success = solved.emplace_back();
    for (const ScoredCell& cell : cells) {
      const ProblemScore& time = cell.problems.at(problem).time;
      line.push_back(time.Charged(statistics::kInfinity));
      success.push_back(time.solved > 0 ? 1 : 0);
    }
  }
  const statistics::FriedmanTest ranked = statistics::Friedman(times);
  for (std::size_t i = 0; i < ranked.mean_ranks.size(); ++i) cells[i].figures->mean_rank = ranked.mean_ranks[i];
  constexpr std::size_t kFewest = 3;  // two are compared by McNemar's test and Wilcoxon's
  if (cells.size() >= kFewest && repetitions == 1) column->success = statistics::CochranQ(solved);
  if (cells.size() >= kFewest) column->ranks = ranked;
  for (std::vector<double>& line : times) {
    for (double& time_ms : line) time_ms = std::max(time_ms, kShortest_ms);  // ratios of nothing are none
  }
  column->profile = statistics::ProfileOf(times);
}

// The names of the benchmark table.
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
  TellRowsApart(method_ids, &named);
  for (std::size_t i = 0; i < rows->size(); ++i) (*rows)[i].title = named[i].method;
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
  const Per<Task, Charge> charges = ChargesOf(experiment.cells, charge_ms);
  std::map<BenchmarkColumn, std::vector<ScoredCell>> columns;
  for (const SolveCell& cell : experiment.cells) {
    const auto row = std::find_if(table.rows.begin(), table.rows.end(), [&](const StatisticsRow& candidate) {
      return candidate.method.method_id == cell.method.method_id;
    });
    ScoredCell& scored = columns[cell.column].emplace_back(ScoredCell{&row->cells[cell.column], {}});
    for (ProblemRuns& problem : ProblemsOf(cell)) scored.problems.emplace(problem.problem, std::move(problem));
    ComputeOwn(cell, scored, charges[cell.column.task]);
  }
  for (const auto& [column, cells] : columns) {
    table.columns[column].charge = charges[column.task];
    ComputeCommon(cells, &table.columns[column]);
    ComputeRanks(cells, experiment.repetitions, &table.columns[column]);
  }
  return table;
}

StatisticsTable ReadStatisticsTable(ResultSource& source, const TableSelection& selection,
                                    std::optional<double> charge_ms) {
  SolvedExperiment experiment = ReadCells(source, selection.experiment);
  if (selection.collision) {
    std::erase_if(experiment.cells,
                  [&](const SolveCell& cell) { return cell.method.collision != *selection.collision; });
    if (experiment.cells.empty()) throw NoSuchCollision(experiment.info.id, *selection.collision);
  }
  ReadSolves(source, selection.rule, &experiment);
  return ComputeStatistics(experiment, selection.rule, charge_ms);
}

}  // namespace legopt::client

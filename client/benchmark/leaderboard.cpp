#include "client/benchmark/leaderboard.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>

#include "client/archive/archive_database.h"
#include "legopt/statistics/problem_scores.h"

namespace legopt::client {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNanosecondsPerMillisecond = 1e6, kMicrosecondsPerMillisecond = 1e3;

// The results of a problem.
using Results = std::vector<std::size_t>;  // indices into Archive::results, by repetition

BoardProblem ProblemOf(const Entry& entry, const Results& results, Rule rule) {
  BoardProblem problem;
  double cost = 0.0, work_ms = 0.0, cpu_ms = 0.0;
  int solved = 0;
  bool counted = true, timed = true;
  for (const std::size_t i : results) {
    const ArchivedResult& result = entry.archive.results[i];
    const JudgedResult& judged = entry.judged.results[i];
    if (result.repetition == 0) problem.verdict = judged.verdicts[rule];
    if (judged.verdicts[rule] != Verdict::kSuccess) continue;
    ++solved;
    cost += judged.cost.value_or(0.0);
    work_ms += static_cast<double>(result.work_ns) / kNanosecondsPerMillisecond;
    cpu_ms += static_cast<double>(result.cpu_us) / kMicrosecondsPerMillisecond;
    counted = counted && result.work_ns > 0;
    timed = timed && result.cpu_us > 0;
  }
  problem.share = static_cast<double>(solved) / entry.archive.repetitions;
  if (solved == 0) return problem;
  problem.cost = cost / solved;
  if (counted) problem.work_ms = work_ms / solved;
  if (timed) problem.cpu_ms = cpu_ms / solved;
  return problem;
}

double MedianOf(const std::vector<double>& values) {
  constexpr std::array kHalf = {0.5};
  return statistics::Quantiles(values, kHalf).front();
}

// The median over all problems, unsolved ones at infinity; nullopt if a solved problem has no value.
std::optional<double> MedianOver(const std::vector<BoardProblem>& problems,
                                 std::optional<double> BoardProblem::*member) {
  std::vector<double> values;
  for (const BoardProblem& problem : problems) {
    if (problem.share > 0.0 && !(problem.*member)) return std::nullopt;
    values.push_back((problem.*member).value_or(kInfinity));
  }
  return MedianOf(values);
}

BoardCell CellOf(std::vector<BoardProblem> problems) {
  BoardCell cell;
  for (const BoardProblem& problem : problems) {
    cell.solved += problem.share;
    cell.given += problem.job_id > 0 ? 1 : 0;
  }
  cell.share = statistics::WilsonInterval(cell.solved, static_cast<int>(problems.size()));
  cell.cost_median = MedianOver(problems, &BoardProblem::cost).value_or(kInfinity);
  cell.work_median_ms = MedianOver(problems, &BoardProblem::work_ms);
  cell.cpu_median_ms = MedianOver(problems, &BoardProblem::cpu_ms);
  cell.problems = std::move(problems);
  return cell;
}

// The results of an entry on one task, by method, initialization and problem.
using ResultsByJob = std::map<std::tuple<std::size_t, Initialization, int>, Results>;

ResultsByJob SortResults(const Entry& entry, Task task) {
  ResultsByJob sorted;
  for (std::size_t i = 0; i < entry.archive.results.size(); ++i) {
    const ArchivedResult& result = entry.archive.results[i];
    if (result.task == task) sorted[{result.method, result.initialization, result.problem}].push_back(i);
  }
  return sorted;
}

void AddRows(std::span<const Entry> entries, std::size_t index, Rule rule, Board* board) {
  const Entry& entry = entries[index];
  const ResultsByJob results = SortResults(entry, board->task);
  const std::map<JobKey, std::int64_t> jobs = JobIds(entry.archive);
  for (std::size_t method = 0; method < entry.archive.methods.size(); ++method) {
    BoardRow row{index, method, {}};
    for (const auto& [initialization, word] : kEnumNames<Initialization>) {
      const bool has =
          std::ranges::find(entry.archive.initializations, initialization) != entry.archive.initializations.end();
      std::vector<BoardProblem> problems;
      for (const int id : board->problems) {
        const auto found = results.find({method, initialization, id});
        problems.push_back(found == results.end() ? BoardProblem{} : ProblemOf(entry, found->second, rule));
        const auto job = jobs.find({method, board->task, initialization, id, 0});
        if (job != jobs.end()) problems.back().job_id = job->second;
      }
      row.cells.push_back(has ? std::optional(CellOf(std::move(problems))) : std::nullopt);
    }
    board->rows.push_back(std::move(row));
  }
}

// Share of solved problems and median cost, averaged over the initializations that the archive has. Claims of the
// archive have no influence.
std::pair<double, double> PlaceOf(const BoardRow& row, bool infeasible) {
  double solved = 0.0, cost = 0.0;
  int count = 0;
  for (const auto& cell : row.cells) {
    if (!cell) continue;
    solved += cell->solved / static_cast<double>(cell->problems.size());
    cost += cell->cost_median;
    ++count;
  }
  if (count == 0) return {0.0, kInfinity};
  return {(infeasible ? solved : -solved) / count, cost / count};
}

Board BoardOf(const Benchmark& benchmark, std::size_t tier, const BenchmarkSet& set, Task task,
              std::span<const Entry> entries) {
  Board board;
  board.tier = tier;
  board.set = set;
  board.task = task;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const Archive& archive = entries[i].archive;
    const bool has = std::ranges::find(archive.tasks, task, &ArchivedTask::task) != archive.tasks.end();
    if (archive.dataset_hash != set.hash || !has) continue;
    if (board.problems.empty()) {
      for (const ProblemDefinition& problem : entries[i].dataset->problems(task)) board.problems.push_back(problem.id);
      std::ranges::sort(board.problems);
    }
    AddRows(entries, i, benchmark.tiers[tier].rule, &board);
  }
  const bool infeasible = benchmark.tiers[tier].infeasible;
  std::ranges::stable_sort(board.rows, {}, [&](const BoardRow& row) { return PlaceOf(row, infeasible); });
  return board;
}

Json FiniteJson(double value) { return std::isfinite(value) ? Json(value) : Json(); }
Json FiniteJson(const std::optional<double>& value) { return value ? FiniteJson(*value) : Json(); }

// Columns, which keeps 10,000 problems small.
Json ProblemsJson(const std::vector<BoardProblem>& problems) {
  Json json = {{"share", Json::array()},  {"cost", Json::array()},    {"work_ms", Json::array()},
               {"cpu_ms", Json::array()}, {"verdict", Json::array()}, {"job", Json::array()}};
  for (const BoardProblem& problem : problems) {
    json["share"].push_back(problem.share);
    json["cost"].push_back(FiniteJson(problem.cost));
    json["work_ms"].push_back(FiniteJson(problem.work_ms));
    json["cpu_ms"].push_back(FiniteJson(problem.cpu_ms));
    json["verdict"].push_back(problem.verdict ? Json(ToString(*problem.verdict)) : Json());
    json["job"].push_back(problem.job_id > 0 ? Json(problem.job_id) : Json());
  }
  return json;
}

// Index of a column on the page of an archive: its tasks and initializations in the order of their enumerators.
std::size_t ColumnOf(const Archive& archive, Task task, Initialization initialization) {
  std::size_t before = 0;
  for (const ArchivedTask& other : archive.tasks) before += other.task < task ? archive.initializations.size() : 0;
  for (const Initialization other : archive.initializations) before += other < initialization ? 1 : 0;
  return before;
}

Json CellJson(const Entry& entry, const Board& board, Initialization initialization, const BoardCell& cell) {
  return {{"solved", cell.solved},
          {"given", cell.given},
          {"lower", cell.share.lower},
          {"upper", cell.share.upper},
          {"cost_median", FiniteJson(cell.cost_median)},
          {"work_median_ms", FiniteJson(cell.work_median_ms)},
          {"cpu_median_ms", FiniteJson(cell.cpu_median_ms)},
          {"column", ColumnOf(entry.archive, board.task, initialization)},
          {"problems", ProblemsJson(cell.problems)}};
}

}  // namespace

std::vector<Board> MakeBoards(const Benchmark& benchmark, std::span<const Entry> entries) {
  std::vector<Board> boards;
  for (std::size_t tier = 0; tier < benchmark.tiers.size(); ++tier) {
    for (const BenchmarkSet& set : benchmark.tiers[tier].sets) {
      for (const Task task : set.tasks) boards.push_back(BoardOf(benchmark, tier, set, task, entries));
    }
  }
  return boards;
}

Json BoardsJson(const Benchmark& benchmark, std::span<const Entry> entries, std::span<const Board> boards) {
  Json list = Json::array();
  for (const Board& board : boards) {
    Json rows = Json::array();
    for (const BoardRow& row : board.rows) {
      const Entry& entry = entries[row.entry];
      const ArchivedMethod& method = entry.archive.methods[row.method];
      Json json = {{"entry", row.entry},
                   {"method", row.method},
                   {"name", method.name},
                   {"multi_starts", method.multi_starts},
                   {"sample_size", method.sample_size},
                   {"cells", Json::object()}};
      for (const auto& [initialization, word] : kEnumNames<Initialization>) {
        const auto& cell = row.cells[EnumNumber(initialization)];
        json["cells"][std::string(word)] = cell ? CellJson(entry, board, initialization, *cell) : Json();
      }
      rows.push_back(std::move(json));
    }
    list.push_back({{"tier", board.tier},
                    {"rule", ToString(benchmark.tiers[board.tier].rule)},
                    {"dataset", board.set.dataset},
                    {"hash", board.set.hash},
                    {"task", ToString(board.task)},
                    {"problems", board.problems},
                    {"rows", std::move(rows)}});
  }
  return list;
}

Table BoardsTable(const Benchmark& benchmark, std::span<const Entry> entries, std::span<const Board> boards) {
  Table table;
  table.columns = {{"tier", "Tier", "", Alignment::kLeft},
                   {"dataset", "Dataset", "", Alignment::kLeft},
                   {"task", "Task", "", Alignment::kLeft},
                   {"initialization", "Initial guess", "", Alignment::kLeft},
                   {"archive", "Archive", "", Alignment::kLeft},
                   {"method", "Method", "", Alignment::kLeft},
                   {"multi_starts", "Multi-starts"},
                   {"sample_size", "Sample size", "%"},
                   {"problems", "Problems"},
                   {"solved", "Solved"},
                   {"lower", "From"},
                   {"upper", "To"},
                   {"cost_median", "Cost, median"},
                   {"claimed_work_median_ms", "Work, median, claimed", "ms"},
                   {"claimed_cpu_median_ms", "CPU time, median, claimed", "ms"}};
  constexpr int kDecimals = 6;
  const auto number = [](const std::optional<double>& value) { return RealCell(value, kDecimals); };
  for (const Board& board : boards) {
    for (const BoardRow& row : board.rows) {
      const Entry& entry = entries[row.entry];
      const ArchivedMethod& method = entry.archive.methods[row.method];
      for (const auto& [initialization, word] : kEnumNames<Initialization>) {
        const auto& cell = row.cells[EnumNumber(initialization)];
        if (!cell) continue;
        TableRow line;
        line.cells = {TextCell(benchmark.tiers[board.tier].id),
                      TextCell(board.set.dataset),
                      TextCell(std::string(ToString(board.task))),
                      TextCell(std::string(word)),
                      TextCell(entry.name),
                      TextCell(method.name),
                      CountCell(method.multi_starts),
                      CountCell(method.sample_size),
                      CountCell(static_cast<std::int64_t>(board.problems.size())),
                      number(cell->solved),
                      number(cell->share.lower),
                      number(cell->share.upper),
                      number(cell->cost_median),
                      number(cell->work_median_ms),
                      number(cell->cpu_median_ms)};
        table.rows.push_back(std::move(line));
      }
    }
  }
  return table;
}

}  // namespace legopt::client

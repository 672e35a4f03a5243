#pragma once

#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client/archive/archive.h"
#include "client/archive/archive_judge.h"
#include "client/benchmark/benchmark_file.h"
#include "client/report/table.h"
#include "legopt/dataset/dataset.h"
#include "legopt/statistics/hypothesis_tests.h"

namespace legopt::client {

/// An archive of a leaderboard.
struct Entry {
  std::string name;  ///< file name without folder and extension
  Archive archive;
  JudgedArchive judged;
  std::shared_ptr<const Dataset> dataset;
};

/// One problem, with all repetitions.
struct BoardProblem {
  double share = 0.0;                     ///< share of the repetitions that solved it; missing ones did not
  std::optional<double> cost;             ///< mean of the solved repetitions, judged here
  std::optional<double> work_ms, cpu_ms;  ///< means of the solved repetitions, as claimed; nullopt: unknown
  std::optional<Verdict> verdict;         ///< verdict on the first repetition; nullopt: no result
  std::int64_t job_id = 0;                ///< job of the first repetition; 0: the archive does not have the problem
};

/// All problems of a board from one initialization. Medians are over all problems, unsolved ones at infinity.
struct BoardCell {
  double solved = 0.0;         ///< sum of the shares
  int given = 0;               ///< number of problems that the archive has
  statistics::Interval share;  ///< Wilson's 95 % interval of solved / number of problems
  double cost_median = 0.0;
  std::optional<double> work_median_ms, cpu_median_ms;  ///< nullopt: not known of all solved problems
  std::vector<BoardProblem> problems;                   ///< parallel to Board::problems
};

/// A method of an archive.
struct BoardRow {
  std::size_t entry = 0, method = 0;            ///< indices
  std::vector<std::optional<BoardCell>> cells;  ///< one per Initialization; nullopt: the archive does not have it
};

/// All methods on the problems of one dataset and task. The best row comes first: largest share of solved
/// problems, averaged over the initializations that the archive has, then lowest median cost; in an infeasible tier the
/// smallest share.
struct Board {
  std::size_t tier = 0;  ///< index
  BenchmarkSet set;      ///< with one task
  Task task{};
  std::vector<int> problems;  ///< ids, ascending; empty: no entry has the dataset
  std::vector<BoardRow> rows;
};

/// Returns the boards of all tiers, in their order. Successes are verdicts by the tier's rule, judged here. The unit is
/// the problem: n is the number of problems of the dataset, and those that an archive lacks are not solved.
std::vector<Board> MakeBoards(const Benchmark& benchmark, std::span<const Entry> entries);

/// Returns the boards as a member "boards" of docs/reference/page-data.md#sites.
nlohmann::ordered_json BoardsJson(const Benchmark& benchmark, std::span<const Entry> entries,
                                  std::span<const Board> boards);

/// Returns one row for each row and initialization of the boards, for other programs.
Table BoardsTable(const Benchmark& benchmark, std::span<const Entry> entries, std::span<const Board> boards);

}  // namespace legopt::client

#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "legopt/types/check.h"
#include "legopt/types/collision.h"
#include "legopt/types/enum_names.h"
#include "legopt/types/result.h"
#include "legopt/types/task.h"

/// Archives of experiments (docs/reference/archives.md): one file with the results of an experiment, from which others
/// can judge its solutions again. Times and verdicts in an
/// archive are claims; they are only reported.
namespace legopt::client {

/// Authors and origin of an archive. All texts may be empty.
struct ArchiveAbout {
  std::string title, paper, licence, code, notes;
  std::vector<std::string> authors;
};

struct ArchivedMethod {
  std::string name;
  std::string hash;     ///< BLAKE2b-256 of the options, 64 hex digits
  std::string options;  ///< canonical JSON
  int multi_starts = 0;
  int sample_size = 100;  ///< percent
};

/// Program and kind of machine that made results.
struct ArchivedBuild {
  std::string id;    ///< equal ids imply equal bits
  std::string text;  ///< release, commit, compiler
  std::string processor;
};

/// The problems of a task.
struct ArchivedTask {
  Task task{};
  std::vector<int> problems;  ///< ids, ascending
};

/// One result. A job without a result has none.
struct ArchivedResult {
  std::size_t method = 0;  ///< index in Archive::methods
  Task task{};
  Initialization initialization{};
  int problem = 0;
  int repetition = 0;
  std::size_t build = 0;  ///< index in Archive::builds
  SolveStatus status = SolveStatus::kNotRun;
  std::int64_t cpu_us = 1;   ///< CPU time of the solve, >= 1; wall time of results without it
  std::int64_t work_ns = 0;  ///< weighted term evaluations; 0: not counted
  std::int64_t evaluations = 0;
  std::int64_t starts = 0;  ///< initial guesses that were optimized; 0: not counted
  std::int64_t collision_queries = 0;
  std::int64_t iterations = 0, restarts = 0;
  std::int64_t windows = 0, windows_solved = 0;  ///< windows of a motion; 0: not solved by windows
  std::optional<Verdict> window_verdict;         ///< verdict on the best point of an unsolved window; nullopt: none
  std::optional<double> solver_cost, solver_violation;  ///< figures reported by the solver; nullopt: not finite
  double margin_relaxed = 0.0;  ///< largest share of the terms' margins that was relaxed for the solution, 0 .. 1
  EnumArray<Rule, std::optional<Verdict>> verdicts;  ///< stored verdicts; nullopt: not judged by that rule
  std::optional<double> cost;                        ///< stored cost per waypoint; nullopt: none
  std::vector<Eigen::VectorXd> waypoints;            ///< n + 7 numbers each; empty: no solution
};

/// A job of an archive: index of the method, task, initialization, problem, repetition.
using JobKey = std::tuple<std::size_t, Task, Initialization, int, int>;

/// An experiment with its results.
struct Archive {
  ArchiveAbout about;
  std::string experiment;  ///< name
  std::string dataset, dataset_hash;
  std::int64_t seed = 0;
  int repetitions = 1;
  Rule rule = Rule::kSolid;
  std::vector<ArchivedTask> tasks;
  std::vector<Initialization> initializations;
  std::vector<ArchivedMethod> methods;
  std::vector<ArchivedBuild> builds;
  std::vector<ArchivedResult> results;
  std::string hash;  ///< BLAKE2b-256 of the file after its first line, 64 hex digits; set by DecodeArchive

  /// Number of jobs of the experiment: results, and jobs that ended or stay without one.
  std::int64_t num_jobs() const;
};

}  // namespace legopt::client

#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "legopt/solvers/methods/method.h"
#include "legopt/types/check.h"
#include "legopt/types/experiment.h"
#include "legopt/types/job.h"
#include "legopt/types/task.h"

namespace legopt::client {

/// A task of a suite and the problems to solve; nullopt: all problems that the dataset has for it.
struct TaskSelection {
  Task task{};
  std::optional<std::vector<int>> problems;  ///< sorted, without duplicates
};

/// Returns a default limit of each task, read from its description.
template <class Value>
constexpr EnumArray<Task, Value> DefaultLimits(Value TaskDescription::*member) {
  EnumArray<Task, Value> limits;
  for (const TaskDescription& task : kTasks) limits[task.task] = task.*member;
  return limits;
}

/// An experiment file (YAML). The keys use the paper's terms:
///
///     name: quick                      # text; default: the file's name
///     dataset: ../garage-easier        # folder, relative to the file; default: the embedded dataset
///     seed: 1                          # 0 .. 2^63-1; determines all random numbers
///     repetitions: 1                   # number of runs of each job, with different random numbers
///     tasks: [posture, motion]         # or maps: {task: posture, problems: [0, "3-9"]}
///     problems: [0, 1, "4-9"]          # ids and ranges for all tasks without their own; default: all
///     max_stances: 80                  # omits longer motion problems; default: none
///     initializations: [good, in_collision]   # default: both
///     collision: [solid, surface]      # runs all methods with each model; default: the method's model
///     methods:
///       - name: SQP                    # shown in tables; default: the paper's name of the solver
///         solver: sqp                  # required
///         multi_starts: [0, 10]        # a list creates one method per value
///         sample_size: 100             # percent, or a list
///         incremental: false
///         collision: solid             # collision model of obstacles, or a list; not with the suite's key
///         options: {}                  # solver options, see legopt/solvers/methods/method.h
///     limits: {effort_limit: 1000000, memory_mb: 1024}   # per job; or effort_limit: {posture: 1000000, ...}
///     max_attempts: 3                  # number of attempts before a job is dead
///     rule: solid                      # rule that counts successes in tables (default), or physical, strict, literal
///     pairs: all                       # link pairs that the methods compare (default), or reference; can be
///                                      # overridden by a method's options
///     constraint_tolerance: 1e-4       # largest violation in m or rad at which solvers end; can be overridden as
///     well;
///                                      # default: each solver's own
///     split: test                      # tuning: problems with an even id, test: with an odd one; default: all
///     builds: one                      # one: only the build that begins it may finish it; any: all builds may
struct Suite {
  std::string name;
  std::string file;                              ///< file name as given, shown in error messages
  std::optional<std::filesystem::path> dataset;  ///< resolved against the suite's folder
  std::int64_t seed = 1;
  int repetitions = 1;
  std::vector<TaskSelection> tasks;
  std::vector<Initialization> initializations = {Initialization::kGood, Initialization::kInCollision};
  std::optional<int> max_stances;  ///< longer problems are omitted
  std::vector<Method> methods;     ///< one per combination of the lists' values, complete with defaults
  /// Effort limit of a job in term evaluations.
  EnumArray<Task, std::int64_t> effort_limit = DefaultLimits(&TaskDescription::default_effort_limit);
  /// Wall-time limit of a job, a safety net.
  EnumArray<Task, double> wall_time_s = DefaultLimits(&TaskDescription::default_wall_limit_s);
  int memory_mb = 1024;
  int max_attempts = 3;
  Split split = Split::kAll;  ///< other problems are omitted
  Rule rule = Rule::kSolid;   ///< default rule of its tables, figures and pages
  BuildPolicy builds = BuildPolicy::kOne;
};

/// Command-line filters and overrides as typed by the user. ApplyFilter resolves words, numbers and ranges against the
/// suite, ignoring case. Empty lists change nothing.
struct SuiteFilter {
  std::vector<std::string> methods;  ///< names to keep
  std::vector<std::string> tasks;
  std::vector<std::string> problems;  ///< ids and ranges to keep, e.g. "0-4"
  std::vector<std::string> initializations;
  std::optional<std::int64_t> seed;
  std::optional<int> max_stances;              ///< overrides the suite
  std::vector<std::string> collision = {};     ///< collision models to keep
  std::vector<std::string> multi_starts = {};  ///< numbers of random restarts to keep
  std::vector<std::string> sample_sizes = {};  ///< percentages to keep
  std::optional<Split> split = {};             ///< overrides the suite
};

/// Reads an experiment file whose methods use solvers of the registry. Throws `InputError` with FILE:LINE, the key and
/// the remedy.
Suite ReadSuite(const std::filesystem::path& file, const SolverRegistry& registry = {});

/// Parses an experiment file from text; `file` is used in errors, and relative `dataset` paths refer to its folder.
Suite ParseSuite(const std::string& text, const std::string& file, const SolverRegistry& registry = {});

/// Applies the command line's filters. Throws `InputError` if a name, number or problem does not occur in the suite, or
/// if a task is left without problems.
void ApplyFilter(const SuiteFilter& filter, Suite* suite);

/// Adds a copy of the first method with the name "NAME (copy)", a null row: its solves are those of the first method,
/// so that only times differ. Throws `InputError` if a method has that name. The suite must have a method.
void AddNullRow(Suite* suite);

/// Parses items such as "3" and "0-4" to ids; sorted, without duplicates. Throws `InputError` with `place` and `field`.
std::vector<int> ParseProblemIds(const std::vector<std::string>& items, const std::string& place,
                                 const std::string& field);

}  // namespace legopt::client

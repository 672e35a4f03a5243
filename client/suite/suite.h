#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "legopt/methods/method.h"
#include "legopt/methods/registry.h"
#include "words/job.h"
#include "words/result.h"
#include "words/split.h"
#include "words/task.h"

namespace legopt::client {

/// One task of a suite and the problems to solve. Without a value: all problems that the dataset has for it.
struct TaskSelection {
  Task task{};
  std::optional<std::vector<int>> problems;  ///< sorted, without repetition
};

/// A limit of one job, by task, as the tasks' descriptions have it.
template <class Value>
constexpr Per<Task, Value> DefaultLimits(Value TaskDescription::*member) {
  Per<Task, Value> limits;
  for (const TaskDescription& task : kTasks) limits[task.task] = task.*member;
  return limits;
}

/// An experiment file (YAML). Keys, all in the paper's words:
///
///     name: quick                      # text; default: the file's name
///     dataset: ../garage-easier         # folder, relative to the file; default: the embedded dataset
///     seed: 1                          # 0 .. 2^63-1; every random draw depends on it
///     repetitions: 1                   # each job so many times, with different random draws
///     tasks: [posture, motion]         # or maps: {task: posture, problems: [0, "3-9"]}
///     problems: [0, 1, "4-9"]          # ids and ranges for all tasks that do not name their own; default: all
///     max_stances: 80                  # leaves longer motion problems out; default: none
///     initializations: [good, in_collision]   # default: both
///     collision: [solid, surface]      # all methods once with each; default: as each method says
///     methods:
///       - name: SQP                    # what tables show; default: the paper's name of the solver
///         solver: sqp                  # required
///         multi_starts: [0, 10]        # a list makes one method per value
///         sample_size: 100             # percent; a list likewise
///         incremental: false
///         collision: solid             # obstacles; a list likewise; not beside the suite's key
///         options: {}                  # of the solver, see legopt/methods/method.h
///     limits: {effort_limit: 1000000, memory_mb: 1024}   # per job; or effort_limit: {posture: 1000000, ...}
///     max_attempts: 3                  # how often a job is started before it counts as dead
///     rule: solid                      # whose success tables count (default), strict or literal
///     pairs: all                       # link pairs that the methods compare (default), or reference; a method's
///                                      # options may say otherwise
///     split: test                      # tuning: problems with an even id, test: with an odd one; default: all
///     builds: one                      # one: the build that begins it finishes it; any: workers of all builds may
struct Suite {
  std::string name;
  std::string file;                              ///< as given, for errors
  std::optional<std::filesystem::path> dataset;  ///< resolved against the suite's folder
  std::int64_t seed = 1;
  int repetitions = 1;
  std::vector<TaskSelection> tasks;
  std::vector<Initialization> initializations = {Initialization::kGood, Initialization::kInCollision};
  std::optional<int> max_stances;  ///< longer problems are left out
  std::vector<Method> methods;     ///< one per combination of the lists' values, complete with defaults
  /// Of one job, in term evaluations.
  Per<Task, std::int64_t> effort_limit = DefaultLimits(&TaskDescription::default_effort_limit);
  /// Of one job, a safety net.
  Per<Task, double> wall_time_s = DefaultLimits(&TaskDescription::default_wall_limit_s);
  int memory_mb = 1024;
  int max_attempts = 3;
  Split split = Split::kAll;  ///< other problems are left out
  Rule rule = Rule::kSolid;   ///< default rule of its tables, figures and pages
  BuildRule builds = BuildRule::kOne;
};

/// What the command line may narrow or change, as it is typed there: ApplyFilter knows what the suite has, in which
/// words and numbers are to be found, letter case ignored. Empty lists change nothing.
struct SuiteFilter {
  std::vector<std::string> methods;          ///< names to keep
  std::vector<std::string> tasks;            ///< to keep
  std::vector<std::string> problems;         ///< ids and ranges to keep, e.g. "0-4"
  std::vector<std::string> initializations;  ///< to keep
  std::optional<std::int64_t> seed;
  std::optional<int> max_stances;              ///< instead of the suite's
  std::vector<std::string> collision = {};     ///< collision models to keep
  std::vector<std::string> multi_starts = {};  ///< numbers of restarts to keep
  std::vector<std::string> sample_sizes = {};  ///< percentages to keep
  std::optional<Split> split = {};             ///< instead of the suite's
};

/// Reads an experiment file, whose methods use solvers of the registry. Throws `InputError` with FILE:LINE, the key and
/// the fix.
Suite ReadSuite(const std::filesystem::path& file, const SolverRegistry& registry = {});

/// The same from text; `file` names it in errors and its folder is where `dataset` is relative to.
Suite ParseSuite(const std::string& text, const std::string& file, const SolverRegistry& registry = {});

/// Applies the command line's filters. Throws `InputError` when a name, number or problem does not occur in the suite,
/// or when a task is left without problems.
void ApplyFilter(const SuiteFilter& filter, Suite* suite);

/// "3" and "0-4" as ids; sorted, without repetition. Throws `InputError` with `place` and `field`.
std::vector<int> ParseProblemIds(const std::vector<std::string>& items, const std::string& place,
                                 const std::string& field);

}  // namespace legopt::client

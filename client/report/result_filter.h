#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "app/command_line.h"
#include "client/report/benchmark_table.h"
#include "client/report/method_choice.h"
#include "client/report/result_source.h"
#include "legopt/types/collision.h"

namespace legopt::client {

/// Filter of all commands that read results. An empty member keeps everything.
struct ResultFilter {
  /// Values of --methods, separated by commas: a name selects all methods of that name, "SQP:multi_starts=10" those
  /// with the property (method_choice.h).
  std::vector<std::string> methods = {};
  std::vector<std::string> tasks = {};            ///< names of tasks
  std::vector<std::string> initializations = {};  ///< names of initializations
  std::optional<std::int64_t> multi_starts = {};
  std::optional<std::int64_t> sample_size = {};  ///< percent
  std::optional<SceneRepresentation> collision = {};

  bool empty() const;
};

/// Adds --methods, --tasks and --initializations, also under their former names --method, --task and --initialization.
/// `filter` must outlive parsing.
void AddNameFilterOptions(const app::Command& command, ResultFilter* filter);

/// Adds the options of AddNameFilterOptions, and --multi-starts, --sample-size and --collision.
void AddResultFilterOptions(const app::Command& command, ResultFilter* filter);

/// Returns the options with their values, "--methods SQP --tasks motion".
std::string Describe(const ResultFilter& filter);

/// Element that a filter keeps or omits: a cell of an experiment, or a solution of a file.
struct FilteredItem {
  MethodIdentity method;
  std::string task;
  std::string initialization;  ///< empty if unknown
};

/// Returns the positions of the kept items. Throws ClientError (kUsage) for a value that no item has, with the most
/// similar or the known values. `owner` names the source of the items in the error, e.g. "experiment 3".
std::vector<std::size_t> KeptItems(const std::vector<FilteredItem>& items, const ResultFilter& filter,
                                   const std::string& owner);

/// The cells of an experiment that a filter keeps.
class KeptCells {
 public:
  /// Throws the errors of KeptItems.
  KeptCells(ResultSource& source, std::int64_t experiment_id, const ResultFilter& filter);

  bool Keeps(std::int64_t method_id, const BenchmarkColumn& column) const {
    return all_ || cells_.contains({method_id, column});
  }
  /// Ids of the cells, for the parameter :cell_ids of queries; empty if the filter is empty.
  const std::vector<std::int64_t>& ids() const { return ids_; }
  /// Number of jobs of the cells; nullopt if the filter is empty.
  std::optional<std::int64_t> num_jobs() const { return all_ ? std::nullopt : std::optional(num_jobs_); }

 private:
  bool all_;
  std::int64_t num_jobs_ = 0;
  std::vector<std::int64_t> ids_;
  std::set<std::pair<std::int64_t, BenchmarkColumn>> cells_;
};

/// Returns those of the columns multi_starts, sample_size, incremental and collision in which methods of the same name
/// differ.
std::vector<std::string> DistinguishingColumns(ResultSource& source, std::int64_t experiment_id);

/// Choice of one job of an experiment by its method, task, initialization and problem instead of its number.
struct JobChoice {
  std::optional<std::int64_t> experiment;  ///< default: the newest
  ResultFilter filter;
  std::optional<int> problem;
};

/// Adds --experiment and the options of AddResultFilterOptions. `choice` must outlive parsing.
void AddJobChoiceOptions(const app::Command& command, JobChoice* choice);

/// Returns the job. Throws the errors of FindExperiment and KeptCells, and ClientError (kUsage) unless the choice is
/// one job; the error names the jobs if there are several.
std::int64_t ChooseJob(ResultSource& source, const JobChoice& choice);

}  // namespace legopt::client

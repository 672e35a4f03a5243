#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/report/method_filter.h"
#include "client/report/result_source.h"
#include "legopt/dataset/dataset.h"
#include "legopt/evaluate/solution_file.h"
#include "words/collision.h"
#include "words/task.h"

namespace legopt::client {

/// Which results of an experiment to export.
struct ExportFilter {
  MethodFilter methods;
  std::optional<Initialization> initialization;
  std::optional<Task> task;
};

/// What tells the accepted results of an experiment apart, beside task and problem.
struct ResultKey {
  std::int64_t method_id = 0;
  std::string method;
  std::int64_t multi_starts = 0;
  std::int64_t sample_size = 100;
  Initialization initialization{};
  std::int64_t repetition = 0;
  SceneRepresentation collision = SceneRepresentation::kSolid;

  bool operator==(const ResultKey&) const = default;
};

/// The method strings of a solution file, one per key: the method's name, followed by only what is needed to make the
/// strings of different keys different, e.g. "SQP", "SQP, 10 multi-starts, in_collision", "SQP, repetition 2".
std::vector<std::string> MethodStrings(const std::vector<ResultKey>& keys);

struct ExportedSolutions {
  std::vector<SolutionFile> files;  ///< one per task, in the order of the tasks
  std::int64_t num_solutions = 0;
  std::int64_t num_missing = 0;  ///< selected jobs without a result: they cannot be exported
};

/// Reads the accepted results of an experiment as LegOpt solution files; problem definitions come from `dataset`, which
/// must be the one of the experiment, and so do the names of the joints. `success` is the literal verdict, `timeSec`
/// the wall time of the whole solve. Throws InputError when a problem is not in the dataset, ClientError (kInternal)
/// for a damaged row.
ExportedSolutions ReadSolutionsOf(ResultSource& source, std::int64_t experiment_id, const Dataset& dataset,
                                  const ExportFilter& filter);

}  // namespace legopt::client

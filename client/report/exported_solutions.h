#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "client/report/result_filter.h"
#include "client/report/result_source.h"
#include "legopt/dataset/dataset.h"
#include "legopt/judge/solution_file.h"
#include "legopt/types/collision.h"
#include "legopt/types/task.h"

namespace legopt::client {

/// Properties that distinguish accepted results of an experiment, in addition to task and problem.
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

/// Returns the method strings of a solution file, one per key: the method's name, followed only by the properties that
/// distinguish the keys, e.g. "SQP", "SQP, 10 multi-starts, in_collision", "SQP, repetition 2".
std::vector<std::string> MethodStrings(const std::vector<ResultKey>& keys);

struct ExportedSolutions {
  std::vector<SolutionFile> files;  ///< one per task, in the order of the tasks
  std::int64_t num_solutions = 0;
  std::int64_t num_missing = 0;  ///< number of selected jobs without a result, which cannot be exported
};

/// Reads the accepted results of an experiment as LegOpt solution files. Problem definitions and joint names are taken
/// from `dataset`, which must be the experiment's. `success` is the verdict by the original evaluator's rule, `timeSec`
/// the CPU time of the whole solve. Throws InputError if a problem is not in the dataset, ClientError (kInternal) for
/// a damaged row; and the errors of KeptCells.
ExportedSolutions ReadSolutionsOf(ResultSource& source, std::int64_t experiment_id, const Dataset& dataset,
                                  const ResultFilter& filter);

}  // namespace legopt::client

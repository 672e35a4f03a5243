#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "client/client_error.h"
#include "client/report/benchmark_table.h"
#include "client/report/interpolation_table.h"
#include "client/report/result_source.h"

namespace legopt::client {

/// Which table to read.
struct TableSelection {
  std::optional<std::int64_t> experiment;  ///< default: the newest
  Rule rule = Rule::kSolid;
  std::optional<SceneRepresentation> collision;  ///< only methods with this collision model
};

/// Releases before the solid rule left no verdict by it: that is missing, not a failure. Throws ClientError (kUsage)
/// where the experiment has such results.
void RequireVerdicts(ResultSource& source, const ExperimentInfo& experiment, Rule rule);

/// That an experiment has no method with the collision model, as the functions below say it.
ClientError NoSuchCollision(std::int64_t experiment_id, SceneRepresentation collision);

/// The benchmark table of an experiment. Errors as of FindExperiment, and ClientError (kUsage) when no method has the
/// collision model, or a result has no verdict by the rule.
BenchmarkTable ReadBenchmarkTable(ResultSource& source, const TableSelection& selection);

/// The interpolation of its solutions; the same errors, and one when it has none of the task.
InterpolationTable ReadInterpolationTable(ResultSource& source, const TableSelection& selection);

}  // namespace legopt::client

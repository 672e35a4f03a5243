#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "client/client_error.h"
#include "client/report/benchmark_table.h"
#include "client/report/interpolation_table.h"
#include "client/report/result_source.h"

namespace legopt::client {

/// Selection of a table.
struct TableSelection {
  std::optional<std::int64_t> experiment;  ///< default: the newest
  Rule rule = Rule::kSolid;
  std::optional<SceneRepresentation> collision;  ///< keep only methods with this collision model
};

/// Throws ClientError (kUsage) if results of the experiment have no verdict by the rule. Results of releases before the
/// physical rule have no verdict by it, which is not a failure.
void RequireVerdicts(ResultSource& source, const ExperimentInfo& experiment, Rule rule);

/// Returns the error for an experiment that has no method with the collision model.
ClientError NoSuchCollision(std::int64_t experiment_id, SceneRepresentation collision);

/// Reads the benchmark table of an experiment. Throws the errors of FindExperiment, and ClientError (kUsage) if no
/// method has the collision model, or a result has no verdict by the rule.
BenchmarkTable ReadBenchmarkTable(ResultSource& source, const TableSelection& selection);

/// Reads the interpolation table of an experiment. Throws the errors of ReadBenchmarkTable, and ClientError (kUsage)
/// without solutions of the task.
InterpolationTable ReadInterpolationTable(ResultSource& source, const TableSelection& selection);

}  // namespace legopt::client

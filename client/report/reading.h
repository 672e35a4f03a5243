#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/client_error.h"
#include "client/report/benchmark_table.h"
#include "client/report/interpolation_table.h"
#include "client/report/result_filter.h"
#include "client/report/result_source.h"

namespace legopt::client {

/// Selection of a table.
struct TableSelection {
  std::optional<std::int64_t> experiment;  ///< default: the newest
  Rule rule = Rule::kSolid;
  ResultFilter filter = {};            ///< cells to keep
  std::vector<std::string> rows = {};  ///< values of --rows: methods to keep, by position in the filtered table
};

/// Throws ClientError (kUsage) if results of the experiment have no verdict by the rule. Results of releases before the
/// rules have no verdict by them, which is not a failure.
void RequireVerdicts(ResultSource& source, const ExperimentInfo& experiment, Rule rule);

/// Reads the benchmark table of an experiment. Throws the errors of FindExperiment, KeptCells and KeepRows,
/// and ClientError (kUsage) if a result has no verdict by the rule.
BenchmarkTable ReadBenchmarkTable(ResultSource& source, const TableSelection& selection);

/// Reads the interpolation table of an experiment. Throws the errors of ReadBenchmarkTable, and ClientError (kUsage)
/// without solutions of the task.
InterpolationTable ReadInterpolationTable(ResultSource& source, const TableSelection& selection);

/// Reads how many postures of the accepted solutions contacts and joints can hold (view holding_cells), by cell. Throws
/// the errors of FindExperiment, KeptCells and RequireVerdicts.
Listing ReadHolding(ResultSource& source, const TableSelection& selection);

}  // namespace legopt::client

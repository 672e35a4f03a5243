#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/compare/comparison.h"
#include "client/report/result_source.h"

namespace legopt::client {

/// Arguments of `legopt compare A B`. A and B are both database files, experiments (number or name), or methods of one
/// experiment (see method_choice.h).
struct ComparisonRequest {
  std::string a, b;
  std::optional<std::int64_t> experiment;  ///< experiment of the methods, or in each file; default: the newest
  std::optional<std::string> method;       ///< compare only this method (experiments and files)
  std::optional<Task> task;
  std::optional<Initialization> initialization;
  std::optional<Rule> rule;         ///< default: the weaker of the rules of A and B
  std::optional<double> charge_ms;  ///< charge of a failed run, see ChargesOf
  SourceOptions source;
  ComparisonOptions options;
};

/// Description of one of the two sides.
struct ComparedSide {
  std::string title;  ///< e.g. "LegOpt-best of experiment 3 'quick'"
  std::int64_t experiment_id = 0;
  std::vector<ResultProvenance> origins;
  std::int64_t taken_over = 0;  ///< number of results reused from other experiments
};

/// Result of a comparison.
struct Comparison {
  ComparedSide a, b;
  std::string dataset;
  Rule rule = Rule::kSolid;
  ComparisonOptions options;
  std::vector<CellComparison> cells;                  ///< ordered as in A's table
  std::vector<std::string> notes;                     ///< caveats for the reader: other builds, machines, seeds
  ComparisonResult change = ComparisonResult::kNone;  ///< overall change of all cells
};

/// Reads both sides and compares them. Throws ClientError: kUsage for sides that do not exist, have nothing in common
/// or are identical; kDatasetMismatch for experiments on different datasets.
Comparison ReadComparison(const ComparisonRequest& request);

}  // namespace legopt::client

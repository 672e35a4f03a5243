#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/compare/comparison.h"
#include "client/report/result_source.h"

namespace legopt::client {

/// What `legopt compare A B` is asked for. A and B are both database files, experiments (number or name), or methods
/// of one experiment (see method_choice.h).
struct ComparisonRequest {
  std::string a, b;
  std::optional<std::int64_t> experiment;  ///< of methods, or in each file; default: the newest
  std::optional<std::string> method;       ///< of experiments and files: only this one
  std::optional<Task> task;
  std::optional<Initialization> initialization;
  std::optional<Rule> rule;         ///< default: the stronger of the rules of A and B
  std::optional<double> charge_ms;  ///< of a failed run, as of ChargesOf
  SourceOptions source;
  ComparisonOptions options;
};

/// One of the two, as people are told of it.
struct ComparedSide {
  std::string title;  ///< "LegOpt-best of experiment 3 'quick'"
  std::int64_t experiment_id = 0;
  std::vector<ResultOrigin> origins;
  std::int64_t taken_over = 0;  ///< results of the experiment that others made
};

/// What came of it.
struct Comparison {
  ComparedSide a, b;
  std::string dataset;  ///< name
  Rule rule = Rule::kSolid;
  ComparisonOptions options;
  std::vector<CellComparison> cells;  ///< in the order of A's table
  std::vector<std::string> notes;     ///< what a reader must know to believe it: other builds, machines, seeds
  Change change = Change::kNone;      ///< of all cells together
};

/// Reads and compares. Throws ClientError: kUsage for what does not exist or has nothing in common, and for a thing
/// beside itself; kDatasetMismatch for experiments on different datasets, whose problems are not the same.
Comparison ReadComparison(const ComparisonRequest& request);

}  // namespace legopt::client

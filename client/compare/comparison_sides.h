#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/compare/comparison.h"
#include "client/compare/identical_work.h"
#include "client/report/result_filter.h"
#include "client/report/result_source.h"

namespace legopt::client {

/// Arguments of `legopt compare A B`. A and B are both database files, experiments (number or name), or methods of one
/// experiment (see method_choice.h). With `control`, A is that method and B is in turn each other method of its
/// experiment.
struct ComparisonRequest {
  std::string a, b;
  std::string control;                     ///< method; empty: A and B are compared
  std::optional<std::int64_t> experiment;  ///< experiment of the methods, or in each file; default: the newest
  ResultFilter filter;                     ///< cells of A to compare
  std::vector<std::string> rows;           ///< values of --rows: comparisons to keep, by position
  std::optional<Rule> rule;                ///< default: the weaker of the rules of A and B
  std::optional<double> charge_ms;         ///< charge of a failed run, see ChargesOf
  SourceOptions source;
  ComparisonOptions options;  ///< family: at least the number of comparisons of this request
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
  std::vector<IdenticalWork> identical_work;          ///< pairs of equal methods in both experiments
  std::vector<std::string> notes;                     ///< caveats for the reader: other builds, machines, seeds
  ComparisonResult change = ComparisonResult::kNone;  ///< overall change of all cells
};

/// Reads both sides and compares them. Throws the errors of KeptCells and KeepRows, and ClientError: kUsage for sides
/// that do not exist, have nothing in common or are identical, and for a filter of methods if A and B are methods;
/// kDatasetMismatch for experiments on different datasets.
Comparison ReadComparison(const ComparisonRequest& request);

}  // namespace legopt::client

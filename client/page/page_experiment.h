#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "client/compare/comparison_sides.h"
#include "client/compare/solves.h"
#include "client/report/result_source.h"
#include "words/result.h"

namespace legopt::client {

/// An experiment as a page tells of it.
struct PageExperiment {
  SolvedExperiment experiment;  ///< with its solves
  nlohmann::ordered_json json;  ///< "experiments" of docs/page-data.md, without solutions
};

/// Reads and computes all figures of an experiment by one rule: table, statistics, causes of failures, profiles,
/// distributions, ratios by problem, its jobs, and its methods by pairs where there are at most kMostCompared. `place`
/// names its database for people, `source_options` opens it again. Errors as of ReadBenchmarkTable.
PageExperiment DescribeExperiment(ResultSource& source, const SourceOptions& source_options, const std::string& place,
                                  std::optional<std::int64_t> id, Rule rule);

/// So many methods are compared by pairs; of more only the first with each other one.
inline constexpr std::size_t kMostCompared = 12;

/// One comparison: the figures of `legopt compare` and the curves of the two alone, which say other things than those
/// of a larger pool. `a`, `b`: the same cells as in `comparison`.
nlohmann::ordered_json DescribeComparison(const Comparison& comparison, const SolvedExperiment& a,
                                          const SolvedExperiment& b);

}  // namespace legopt::client

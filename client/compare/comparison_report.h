#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "client/compare/comparison_sides.h"
#include "client/report/benchmark_table.h"
#include "client/report/text_layout.h"

namespace legopt::client {

/// Returns e.g. "50: both 40, only A 2, only B 5, neither 3".
std::string DescribePairs(const statistics::PairCounts& counts);

/// Returns the title of a comparison with its verdict: "Motion generation, init in collision: B is better (faster)",
/// with the method if there are several.
std::string TitleOf(const Comparison& comparison, const CellComparison& cell);

/// Returns dataset, rule, builds and machines of both sides as sentences.
std::string DescribeComparison(const Comparison& comparison);

/// Returns the comparisons as a table with a group of rows for each, with times in `unit`.
Table TableOf(const Comparison& comparison, const TimeUnit& unit);

/// Renders a comparison. CSV and JSON have all figures unrounded, times in ms, null for infinite or undefined values;
/// CSV has one row per comparison, and so has every format with style.columns, which are those of CSV.
std::string RenderComparison(const Comparison& comparison, TableFormat format, const TableStyle& style = {});

/// Returns the JSON as an object, to be inserted into a larger one.
nlohmann::ordered_json ComparisonJson(const Comparison& comparison);

}  // namespace legopt::client

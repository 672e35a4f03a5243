#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "client/compare/comparison_sides.h"
#include "client/report/benchmark_table.h"
#include "client/report/text_layout.h"

namespace legopt::client {

enum class ComparisonFormat : std::uint8_t { kText, kMarkdown, kJson };

/// Returns e.g. "50: both 40, only A 2, only B 5, neither 3".
std::string DescribePairs(const statistics::PairCounts& counts);

/// Returns the title of a comparison with its verdict: "Motion generation, init in collision: B is better (faster)",
/// with the method if there are several.
std::string TitleOf(const Comparison& comparison, const CellComparison& cell);

/// Returns dataset, rule, builds and machines of both sides as sentences.
std::string DescribeComparison(const Comparison& comparison);

/// Renders a comparison as text or JSON. JSON has all figures unrounded, times in ms, null for infinite or undefined
/// values.
std::string RenderComparison(const Comparison& comparison, ComparisonFormat format, const TableStyle& style = {});

/// Returns the JSON as an object, to be inserted into a larger one.
nlohmann::ordered_json ComparisonJson(const Comparison& comparison);

}  // namespace legopt::client

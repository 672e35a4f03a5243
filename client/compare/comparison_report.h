#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "client/compare/comparison_sides.h"
#include "client/report/benchmark_table.h"
#include "client/report/text_layout.h"

namespace legopt::client {

enum class ComparisonFormat : std::uint8_t { kText, kMarkdown, kJson };

/// "50: both 40, only A 2, only B 5, neither 3".
std::string DescribePairs(const statistics::PairCounts& counts);

/// One of the comparisons with its verdict: "Motion generation, init in collision: B is better (faster)", with the
/// method where there are several.
std::string TitleOf(const Comparison& comparison, const CellComparison& cell);

/// Dataset, rule, builds and machines of both, as sentences.
std::string DescribeComparison(const Comparison& comparison);

/// A comparison for people, or as JSON: all figures unrounded, times in ms; what is infinite or undefined is null.
std::string RenderComparison(const Comparison& comparison, ComparisonFormat format, const TableStyle& style = {});

/// The JSON of that, for who puts it into a larger one.
nlohmann::ordered_json ComparisonJson(const Comparison& comparison);

}  // namespace legopt::client

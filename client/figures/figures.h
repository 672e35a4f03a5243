#pragma once

#include <string>
#include <vector>

#include "client/compare/comparison_sides.h"
#include "client/compare/statistics_table.h"
#include "client/plot/plot.h"
#include "client/report/benchmark_table.h"

namespace legopt::client {

/// Returns the names of the rows for legends: "SQP, 10 restarts, sample 80 %", with the properties in which rows
/// differ.
std::vector<std::string> EntryNamesOf(const StatisticsTable& table);

/// Performance profiles by work, or by time where work was not counted; one panel per task and initialization: the
/// percentage of problems (without missing runs) on which a method took at most x times the best value in the table.
/// The figures are those of the table.
Plot ProfilePlot(const StatisticsTable& table);

/// Times of B over times of A, one panel per comparison and one point per problem that either solved; problems not
/// solved by one of them are on its rim.
Plot ScatterPlot(const Comparison& comparison, const TimeUnit& unit);

}  // namespace legopt::client

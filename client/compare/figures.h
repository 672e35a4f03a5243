#pragma once

#include "client/compare/comparison_sides.h"
#include "client/compare/statistics_table.h"
#include "client/plot/plot.h"
#include "client/report/benchmark_table.h"

namespace legopt::client {

/// Performance profiles by time, a panel for each task and start: on which percentage of the problems that no method
/// misses a method took at most x times what the best of the table took. The figures are the table's own.
Plot ProfilePlot(const StatisticsTable& table);

/// Times of B over times of A, a panel for each comparison and a point for each problem that either solved; what one of
/// the two did not solve lies on its rim.
Plot ScatterPlot(const Comparison& comparison, const TimeUnit& unit);

}  // namespace legopt::client

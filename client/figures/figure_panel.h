#pragma once

#include <string>
#include <vector>

#include "client/plot/plot.h"
#include "client/report/benchmark_table.h"

namespace legopt::client {

/// Returns an axis for the finite values: whole decades if all are positive, otherwise from 0 or the smallest value.
PlotAxis AxisFor(const std::string& title, const std::vector<double>& values);

/// Returns a panel with the title "Posture generation, good init: 50 problems". Its notes name the methods that are
/// left out because they have no completed problem.
PlotPanel PanelOf(const BenchmarkColumn& column, std::size_t problems, const std::vector<std::string>& left_out,
                  PlotKind kind);

}  // namespace legopt::client

#pragma once

#include "client/figures/figure_data.h"

namespace legopt::client {

/// Convergence: the best cost so far of points that satisfy all constraints within 1e-3, over the best known cost of
/// the problem, against term evaluations. Per method the median over the problems, with a band from the first to the
/// third quartile; first repetitions only. The best known cost of a problem is the lowest in the traces of all shown
/// methods. A problem is at infinity until a point satisfies the constraints. Tasks that
/// are solved window by window have no cost of the whole until the end and are left out. Throws ClientError (kUsage) if
/// no other task is selected, and the errors of TraceRecords.
Plot ConvergencePlot(ResultSource& source, const FigureData& data);

}  // namespace legopt::client

#pragma once

#include "client/figures/figure_data.h"

/// Figures of the solves of an experiment. All throw ClientError (kUsage) if work is asked for and was not counted. One
/// panel for each task and initialization. Problems count once: repetitions are averaged.
namespace legopt::client {

/// Empirical distribution functions: the share of problems solved within a value of the measure. With repetitions, the
/// mean of the problems' own functions.
Plot EcdfPlot(const FigureData& data, Measure measure);

/// Cactus plots: the values of the solved problems in ascending order, over their number.
Plot CactusPlot(const FigureData& data, Measure measure);

/// Box plots: median, quartiles, and whiskers at 5 and 95 %. Unsolved problems are infinite, on the rim.
Plot BoxPlot(const FigureData& data, Measure measure);

/// Values of the second method over those of the first one, a point for each problem that either solved. Throws
/// ClientError (kUsage) unless exactly two methods are shown.
Plot ScatterPlot(const FigureData& data, Measure measure);

/// Critical-difference diagrams (Demsar 2006, J. Mach. Learn. Res. 7:1): mean ranks by the measure, failures last. A
/// bar joins methods of which no two differ: Wilcoxon's signed rank tests of all pairs, adjusted by Holm (Benavoli,
/// Corani, Mangili 2016, J. Mach. Learn. Res. 17:1). A problem that only one of two methods solved counts as the
/// largest difference. Throws ClientError (kUsage) with fewer than two methods.
Plot RankPlot(const FigureData& data, Measure measure);

}  // namespace legopt::client

#include "client/figures/solve_figures.h"

#include <algorithm>
#include <cmath>

#include "app/printable.h"
#include "client/client_error.h"
#include "client/figures/figure_panel.h"
#include "client/figures/figures.h"
#include "legopt/statistics/internal/checks.h"
#include "legopt/statistics/profiles.h"

namespace legopt::client {
namespace {

constexpr double kAllPercent = 100.0;

// Returns the values of all shown methods on the problems of a column.
std::vector<double> AllValues(const FigureColumn& column, Measure measure) {
  std::vector<double> values;
  for (const auto& runs : column.runs) {
    for (const ProblemRuns& problem : runs) values.push_back(ValueOf(problem, measure));
  }
  return values;
}

Plot EmptyPlot(const FigureData& data, const std::string& what) {
  Plot plot;
  plot.entries = EntryNamesOf(data.table);
  plot.caption = app::Printable(CaptionOf(what, data.table));
  return plot;
}

// Returns the values of all solved runs.
std::vector<double> SolvedValuesOf(const FigureColumn& column, Measure measure) {
  std::vector<double> values;
  for (const auto& runs : column.runs) {
    for (const ProblemRuns& problem : runs) {
      for (const statistics::Repetition& run : RunsOf(problem, measure)) {
        if (run.end == statistics::RunOutcome::kSolved) values.push_back(run.value);
      }
    }
  }
  return values;
}

// Makes one panel for each column by `draw`.
template <class Draw>
Plot PlotOf(const FigureData& data, Measure measure, const std::string& what, PlotKind kind, const Draw& draw) {
  RequireMeasure(data, measure);
  Plot plot = EmptyPlot(data, what + " of " + std::string(ToString(measure)));
  for (const FigureColumn& column : data.columns)
    draw(column, &plot.panels.emplace_back(PanelOf(column.column, column.problems(), column.left_out, kind)));
  return plot;
}

}  // namespace

Plot EcdfPlot(const FigureData& data, Measure measure) {
  return PlotOf(data, measure, "Empirical distributions", PlotKind::kSteps,
                [&](const FigureColumn& column, PlotPanel* panel) {
                  panel->x = AxisFor(TitleOf(measure), SolvedValuesOf(column, measure));
                  panel->y = {"problems solved (%)", false, 0.0, kAllPercent};
                  for (std::size_t i = 0; i < column.runs.size(); ++i) {
                    std::vector<std::vector<statistics::Repetition>> runs;
                    for (const ProblemRuns& problem : column.runs[i]) runs.push_back(RunsOf(problem, measure));
                    const statistics::StepCurve curve = statistics::RuntimeDistribution(runs);
                    PlotSeries& series = panel->series.emplace_back(PlotSeries{column.entries[i], {}, {}});
                    for (std::size_t step = 0; step < curve.at.size(); ++step) {
                      series.points.push_back({curve.at[step], kAllPercent * curve.share[step]});
                    }
                  }
                });
}

Plot CactusPlot(const FigureData& data, Measure measure) {
  return PlotOf(data, measure, "Cactus plots", PlotKind::kLines, [&](const FigureColumn& column, PlotPanel* panel) {
    panel->x = {"problems solved", false, 0.0, std::max(static_cast<double>(column.problems()), 1.0)};
    panel->y = AxisFor(TitleOf(measure), AllValues(column, measure));
    for (std::size_t i = 0; i < column.runs.size(); ++i) {
      std::vector<double> values;
      for (const ProblemRuns& problem : column.runs[i]) {
        if (problem.time.solved > 0) values.push_back(ValueOf(problem, measure));
      }
      std::sort(values.begin(), values.end());
      PlotSeries& series = panel->series.emplace_back(PlotSeries{column.entries[i], {}, {}});
      for (std::size_t n = 0; n < values.size(); ++n) series.points.push_back({static_cast<double>(n + 1), values[n]});
    }
  });
}

Plot BoxPlot(const FigureData& data, Measure measure) {
  return PlotOf(data, measure, "Boxes (quartiles and median) with whiskers (5 and 95 %)", PlotKind::kBoxes,
                [&](const FigureColumn& column, PlotPanel* panel) {
                  constexpr double kHalf = 0.5;
                  constexpr double kShares[] = {0.05, 0.25, 0.5, 0.75, 0.95};
                  panel->x = {"", false, kHalf, static_cast<double>(column.runs.size()) + kHalf};
                  panel->x.labelled = false;
                  panel->y = AxisFor(TitleOf(measure), AllValues(column, measure));
                  panel->y.rim = true;
                  for (std::size_t i = 0; i < column.runs.size() && column.problems() > 0; ++i) {
                    std::vector<double> values;
                    for (const ProblemRuns& problem : column.runs[i]) values.push_back(ValueOf(problem, measure));
                    const std::vector<double> at = statistics::Quantiles(values, kShares);
                    const double place = static_cast<double>(panel->series.size()) + 1.0;
                    panel->series.push_back(
                        {column.entries[i], {{place, at[2]}}, {}, {}, PlotBox{{at[0], at[4]}, {at[1], at[3]}, at[2]}});
                  }
                });
}

Plot ScatterPlot(const FigureData& data, Measure measure) {
  if (data.table.rows.size() != 2) {
    throw ClientError(ExitCode::kUsage, "a scatter plot shows two methods, not " +
                                            std::to_string(data.table.rows.size()) +
                                            "; choose them by --methods or --rows");
  }
  const std::vector<std::string> names = EntryNamesOf(data.table);
  Plot plot =
      PlotOf(data, measure, names[1] + " over " + names[0] + ", a point for each problem,", PlotKind::kPoints,
             [&](const FigureColumn& column, PlotPanel* panel) {
               panel->x = panel->y = AxisFor("", AllValues(column, measure));
               panel->x.title = names[0] + ": " + TitleOf(measure);
               panel->y.title = names[1] + ": " + TitleOf(measure);
               panel->x.rim = panel->y.rim = true;
               if (column.runs.size() != 2) return;
               PlotSeries& series = panel->series.emplace_back();
               for (std::size_t i = 0; i < column.problems(); ++i) {
                 const PlotPoint point{ValueOf(column.runs[0][i], measure), ValueOf(column.runs[1][i], measure)};
                 if (std::isfinite(point.x) || std::isfinite(point.y)) series.points.push_back(point);
               }
             });
  plot.entries.clear();  // one kind of mark needs no legend
  return plot;
}

}  // namespace legopt::client

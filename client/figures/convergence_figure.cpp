#include "client/figures/convergence_figure.h"

#include <algorithm>
#include <cmath>

#include "app/printable.h"
#include "client/client_error.h"
#include "client/figures/figure_panel.h"
#include "client/figures/figures.h"
#include "client/replay/stored_job.h"
#include "db/named_queries.h"
#include "legopt/statistics/problem_scores.h"

namespace legopt::client {
namespace {

// The best cost so far after a number of evaluations.
struct Improvement {
  double evaluations = 0.0, cost = 0.0;
};
using Course = std::vector<Improvement>;  // ascending evaluations, descending cost

Course CourseOf(const std::vector<IterationRecord>& records) {
  constexpr double kFeasible = 1e-3;
  Course course;
  for (const IterationRecord& record : records) {
    const bool better = course.empty() || record.cost < course.back().cost;
    const bool feasible = record.violation <= kFeasible && std::isfinite(record.cost);  // not for NaN
    if (!feasible || !better) continue;
    course.push_back({std::max(static_cast<double>(record.evaluations), 1.0), record.cost});
  }
  return course;
}

double CostAt(const Course& course, double evaluations) {
  double cost = INFINITY;
  for (const Improvement& step : course) {
    if (step.evaluations > evaluations) break;
    cost = step.cost;
  }
  return cost;
}

using Courses = std::vector<std::vector<Course>>;  // courses by shown method and problem

Courses ReadCourses(ResultSource& source, const FigureColumn& column) {
  Courses courses;
  for (const auto& runs : column.runs) {
    auto& of_method = courses.emplace_back();
    for (const ProblemRuns& problem : runs) {
      const Listing row = source.Query(db::Sql(db::Query::kTraceOfResult, {{"job_id", problem.job_id}}));
      of_method.push_back(row.rows.empty() ? Course{} : CourseOf(TraceRecords(row, problem.job_id)));
    }
  }
  return courses;
}

// Returns the lowest cost of each problem; infinite if no method found a feasible point.
std::vector<double> BestKnown(const Courses& courses, std::size_t problems) {
  std::vector<double> best(problems, INFINITY);
  for (const auto& of_method : courses) {
    for (std::size_t i = 0; i < problems; ++i) {
      if (!of_method[i].empty()) best[i] = std::min(best[i], of_method[i].back().cost);
    }
  }
  return best;
}

double MostEvaluations(const Courses& courses) {
  double most = 1.0;
  for (const auto& of_method : courses) {
    for (const Course& course : of_method) {
      if (!course.empty()) most = std::max(most, course.back().evaluations);
    }
  }
  return most;
}

// Returns the curve of a method; its first point is where half of the problems have a feasible point.
PlotSeries MedianCurve(std::size_t entry, const std::vector<Course>& courses, const std::vector<double>& best,
                       double most) {
  constexpr int kSamples = 120;
  constexpr double kShares[] = {0.25, 0.5, 0.75};
  PlotSeries series{entry, {}, {}};
  for (int sample = 0; sample <= kSamples; ++sample) {
    const double evaluations = std::pow(most, static_cast<double>(sample) / kSamples);
    std::vector<double> gaps;
    for (std::size_t i = 0; i < courses.size(); ++i) {
      if (best[i] > 0.0) gaps.push_back(std::isinf(best[i]) ? INFINITY : CostAt(courses[i], evaluations) / best[i]);
    }
    if (gaps.empty()) break;
    const std::vector<double> quartiles = statistics::Quantiles(gaps, kShares);
    if (!std::isfinite(quartiles[1])) continue;
    series.points.push_back({evaluations, quartiles[1]});
    series.band.push_back({quartiles[0], quartiles[2]});
  }
  return series;
}

void DrawCourses(ResultSource& source, const FigureColumn& column, PlotPanel* panel) {
  panel->x = {"term evaluations", true, 1.0, 10.0};
  panel->y = {"cost over best known", true, 1.0, 2.0};
  const Courses courses = ReadCourses(source, column);
  const std::vector<double> best = BestKnown(courses, column.problems());
  panel->x.to = std::max(MostEvaluations(courses), panel->x.to);
  const auto without_ratio = std::ranges::count_if(best, [](double cost) { return cost <= 0.0; });
  if (without_ratio > 0) {
    panel->notes.push_back(std::to_string(without_ratio) +
                           " problems are left out: their best known cost is not positive.");
  }
  for (std::size_t i = 0; i < courses.size(); ++i) {
    const PlotSeries& series =
        panel->series.emplace_back(MedianCurve(column.entries[i], courses[i], best, panel->x.to));
    for (std::size_t k = 0; k < series.points.size(); ++k) {
      panel->y.to = std::max(panel->y.to, series.points[k].y);
      if (std::isfinite(series.band[k].high)) panel->y.to = std::max(panel->y.to, series.band[k].high);
    }
  }
}

}  // namespace

Plot ConvergencePlot(ResultSource& source, const FigureData& data) {
  Plot plot;
  plot.entries = EntryNamesOf(data.table);
  bool windowed = false;
  for (const FigureColumn& column : data.columns) {
    windowed = windowed || DescriptionOf(column.column.task).windowed;
    if (DescriptionOf(column.column.task).windowed) continue;
    DrawCourses(
        source, column,
        &plot.panels.emplace_back(PanelOf(column.column, column.problems(), column.left_out, PlotKind::kLines)));
  }
  plot.caption = app::Printable(CaptionOf("Convergence (median and quartiles)", data.table));
  if (windowed)
    plot.caption +=
        " Tasks that are solved window by window are left out: they have no cost of the whole before the end.";
  if (plot.panels.empty()) {
    throw ClientError(
        ExitCode::kUsage,
        "the selected tasks are solved window by window, so that there is no cost of the whole before the "
        "end; select postures by --tasks posture");
  }
  return plot;
}

}  // namespace legopt::client

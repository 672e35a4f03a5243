#pragma once

#include <string>
#include <vector>

#include "client/compare/statistics_table.h"
#include "client/plot/plot.h"
#include "client/report/reading.h"
#include "legopt/types/enum_names.h"

namespace legopt {
namespace client {

/// Figure of a solve that a plot shows.
enum class Measure {
  kWork,      ///< term evaluations, weighted by kind, in ms
  kTime,      ///< CPU time, in ms
  kCost,      ///< per waypoint, by the judge
  kTolerance  ///< Solve::tolerance_used
};

}  // namespace client

template <>
inline constexpr auto kEnumNames<client::Measure> = MakeEnumNames<client::Measure>({{client::Measure::kWork, "work"},
                                                                                    {client::Measure::kTime, "time"},
                                                                                    {client::Measure::kCost, "cost"},
                                                                                    {client::Measure::kTolerance,
                                                                                     "tolerance"}});

}  // namespace legopt

namespace legopt::client {

/// Problems of one task and initialization that all shown methods have completed.
struct FigureColumn {
  BenchmarkColumn column;
  std::vector<std::size_t> entries;            ///< row of each shown method in StatisticsTable::rows
  std::vector<std::vector<ProblemRuns>> runs;  ///< complete problems by shown method, in equal order
  std::vector<std::string> left_out;           ///< methods without a complete problem

  std::size_t problems() const { return runs.empty() ? 0 : runs.front().size(); }
};

/// An experiment as plots need it.
struct FigureData {
  StatisticsTable table;  ///< names, caption
  std::vector<FigureColumn> columns;
};

/// Reads the selected part of an experiment. `columns` (values of --columns) keeps columns by position. Throws the
/// errors of ReadBenchmarkTable and KeepRows.
FigureData ReadFigureData(ResultSource& source, const TableSelection& selection,
                          const std::vector<std::string>& columns = {});

/// Returns work, or time if the work of a solved run was not counted.
Measure UsualMeasure(const FigureData& data);

/// Throws ClientError (kUsage) if `measure` is not known of a solved run.
void RequireMeasure(const FigureData& data, Measure measure);

/// Returns the mean of the solved runs of a problem; infinite if there is none.
double ValueOf(const ProblemRuns& runs, Measure measure);
/// Returns the mean of all runs of a problem; infinite if one failed, as for ranks in tables.
double ValueOfAll(const ProblemRuns& runs, Measure measure);
/// Returns the runs of a problem with their values.
const std::vector<statistics::Repetition>& RunsOf(const ProblemRuns& runs, Measure measure);

/// Returns e.g. "work (ms)".
std::string TitleOf(Measure measure);

}  // namespace legopt::client

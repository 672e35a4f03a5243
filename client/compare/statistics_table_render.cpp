#include <algorithm>
#include <cmath>

#include "client/compare/statistics_table.h"
#include "client/report/benchmark_table.h"
#include "client/report/escaped_text.h"
#include "client/report/listing.h"
#include "legopt/types/number_text.h"

namespace legopt::client {
namespace {

constexpr double kMsPerSecond = 1e3, kHundred = 100.0, kThousandths = 1e3;

std::string Decimal(double value, int decimals) { return FormatFixed(value, decimals); }

// Returns a time, "inf" if too many problems were not solved, a dash without problems.
TableCell ShownTime(const std::optional<double>& time_ms, const TimeUnit& unit) {
  if (!time_ms) return MissingCell();
  return FigureCell(time_ms, std::isinf(*time_ms) ? "inf" : FormatTime(*time_ms / kMsPerSecond, unit));
}

TableCell ShownCost(const std::optional<double>& cost) {
  return FigureCell(cost, cost && std::isinf(*cost) ? "inf" : FormatCost(cost));
}

// Returns e.g. "49/50", "48.7/50" for several repetitions, "40/45 (5 missing)", "- (5 missing)".
TableCell ShownSuccess(const CellStatistics& cell) {
  const bool whole = cell.solved == std::floor(cell.solved);
  const std::string solved = cell.n == 0 ? "-" : Decimal(cell.solved, whole ? 0 : 1) + "/" + std::to_string(cell.n);
  return TextCell(solved + (cell.missing > 0 ? " (" + std::to_string(cell.missing) + " missing)" : ""));
}

TableCell ShownShare(int count, int of) {
  return PercentCell(of == 0 ? std::nullopt : std::optional(static_cast<double>(count) / of), 0);
}

// Returns a used tolerance in thousandths of m or rad.
TableCell ShownTolerance(const std::optional<double>& used) {
  constexpr int kDigits = 3;
  return FigureCell(used, used ? Decimal(kThousandths * *used, kDigits) : "");
}

// Returns e.g. "47 - 50": solved problems of the worst and of the best seed.
TableCell ShownSpread(const CellStatistics& cell) {
  if (!cell.solved_least) return MissingCell();
  return TextCell(std::to_string(*cell.solved_least) + " - " + std::to_string(*cell.solved_most));
}

std::vector<TableCell> ShownCell(const CellStatistics& cell, bool repeated, const TimeUnit& unit) {
  constexpr int kDigits = 2;
  const std::string share =
      "[" + Decimal(kHundred * cell.share.lower, 1) + ", " + Decimal(kHundred * cell.share.upper, 1) + "]";
  std::vector<TableCell> cells = {ShownSuccess(cell), cell.n == 0 ? MissingCell() : TextCell(share)};
  if (repeated) cells.push_back(ShownSpread(cell));
  cells.insert(
      cells.end(),
      {ShownTime(cell.work_median_ms, unit), RealCell(cell.work_ratio, kDigits), ShownTime(cell.time_median_ms, unit),
       ShownTime(cell.time_q95_ms, unit), ShownTime(cell.common_time_ms, unit), RealCell(cell.time_ratio, kDigits),
       ShownTime(cell.par10_ms, unit), RealCell(cell.mean_rank, kDigits), ShownCost(cell.cost_median),
       ShownCost(cell.cost_q95), ShownCost(cell.common_cost), RealCell(cell.cost_ratio, kDigits),
       ShownTolerance(cell.tolerance_median), ShownTolerance(cell.tolerance_largest),
       RealCell(cell.further_starts_mean, kDigits),
       cell.further_starts_largest ? CountCell(*cell.further_starts_largest) : MissingCell(),
       ShownTime(cell.n == 0 ? std::nullopt : std::optional(cell.cpu_ms), kSeconds),
       ShownShare(cell.contended, cell.reported), cell.n == 0 ? MissingCell() : CountCell(cell.stopped)});
  return cells;
}

bool Differ(const std::vector<StatisticsRow>& rows, auto MethodIdentity::*figure) {
  return std::any_of(rows.begin(), rows.end(),
                     [&](const StatisticsRow& row) { return row.method.*figure != rows.front().method.*figure; });
}

// The columns that identify a row.
struct Keys {
  bool incremental, collision;

  explicit Keys(const StatisticsTable& table)
      : incremental(Differ(table.rows, &MethodIdentity::incremental)),
        collision(Differ(table.rows, &MethodIdentity::collision)) {}

  std::vector<TableColumn> Columns() const {
    std::vector<TableColumn> columns = MethodColumns();
    if (incremental) columns.push_back({"incremental", "Incremental"});
    if (collision) columns.push_back({"collision", "Collision"});
    return columns;
  }

  std::vector<TableCell> Of(const StatisticsRow& row) const {
    std::vector<TableCell> cells = {TextCell(row.title), CountCell(row.method.multi_starts),
                                    CountCell(row.method.sample_size)};
    if (incremental) cells.push_back({row.method.incremental, row.method.incremental ? "yes" : "no"});
    if (collision) cells.push_back(TextCell(std::string(ToString(row.method.collision))));
    return cells;
  }
};

std::string Note(const TimeUnit& unit) {
  return "The unit is the problem. Every figure is over the n problems that all rows have completed. Solved: of n, "
         "with Wilson's 95 % interval in percent; jobs that died or could not run are failures, queued, running and "
         "cancelled ones are missing. Seeds, with repetitions: problems solved by the worst and by the best one. "
         "Times, in " +
         std::string(unit.name) +
         ", are CPU times of whole solves. Work: term evaluations, each with the typical time of its kind of term; it "
         "does not depend on the load. Median and 95 % quantile of work, time and cost count "
         "an unsolved problem as infinite. Common: geometric mean over the problems that all methods solved (times "
         "shifted by 1 ms). Ratio: to the row that is named, geometric mean over the problems that both solved. PAR10, "
         "Charged: mean time, a failure at the charge given here. Rank: mean rank by work, by time where work was not "
         "counted, failures last. Tolerance: largest violation of a constraint in each solution, 1e-3 m or rad; the "
         "judge accepts 1. Further starts: initial points of a run beyond the first one of each window. CPU: seconds "
         "of "
         "all runs. Contended: percent of runs that others disturbed. Stopped: "
         "runs whose solver a limit "
         "ended.";
}

std::string ShownP(double p) { return "p = " + FormatGeneral(p, 2); }

std::string SuccessNote(const ColumnStatistics& column) {
  if (!column.success) return {};
  if (column.success->informative == 0) return " All methods solved the same ones.";
  return " Do methods differ in success? Cochran's Q " + Decimal(column.success->q, 2) + ", " +
         std::to_string(column.success->degrees) + " degrees of freedom, " + ShownP(column.success->p) + ".";
}

std::string RanksNote(const ColumnStatistics& column) {
  if (!column.ranks || !column.ranks->defined) return {};
  const statistics::ImanDavenportTest& f = column.ranks->iman_davenport;
  std::string text = " In ranks by " + std::string(column.by_work ? "work" : "time") + "? Friedman's chi-square " +
                     Decimal(column.ranks->chi_square, 2) + ", " + std::to_string(column.ranks->degrees) +
                     " degrees of freedom, " + ShownP(column.ranks->p);
  if (f.denominator == 0) return text + ".";
  return text + "; Iman and Davenport's F " + (std::isinf(f.f) ? "inf" : Decimal(f.f, 2)) + ", " +
         std::to_string(f.numerator) + " and " + std::to_string(f.denominator) + " degrees of freedom, " + ShownP(f.p) +
         ".";
}

std::string Counted(int problems) { return std::to_string(problems) + (problems == 1 ? " problem" : " problems"); }

std::string LeftOutNote(const ColumnStatistics& column) {
  if (column.left_out.empty()) return {};
  std::string titles;
  for (const std::string& title : column.left_out) titles += (titles.empty() ? "" : ", ") + title;
  return " Left out, without a completed problem: " + titles + ".";
}

// Returns the note on a task and initialization below its rows.
std::string ColumnNote(const ColumnStatistics& column) {
  std::string text = "n: " + Counted(column.complete) + " that all rows have completed." + LeftOutNote(column);
  if (column.complete == 0) return text;
  return text + " Common: " + Counted(column.common) + ". Ratios: to " + column.reference + "." + SuccessNote(column) +
         RanksNote(column);
}

// Returns the columns of the figures of a task and initialization.
std::vector<TableColumn> FigureColumns(const BenchmarkColumn& column, bool repeated, const Charge& charge) {
  const std::string group = ColumnTitle(column);
  std::vector<TableColumn> columns;
  const auto add = [&](const std::string& name, const std::string& heading, const std::string& unit = {}) {
    columns.push_back({name, heading, unit, Alignment::kRight, group});
  };
  add("solved", "Solved");
  add("interval", "95 %");
  if (repeated) add("seeds", "Seeds");
  add("work_median", "Work median");
  add("work_ratio", "Work ratio");
  add("time_median", "Time median");
  add("time_q95", "Time 95 %");
  add("time_common", "Time common");
  add("time_ratio", "Time ratio");
  add("par10", TitleOfChargedMean(charge.rule));
  add("rank", "Rank");
  add("cost_median", "Cost median");
  add("cost_q95", "Cost 95 %");
  add("cost_common", "Cost common");
  add("cost_ratio", "Cost ratio");
  add("tolerance_median", "Tolerance median");
  add("tolerance_largest", "Tolerance largest");
  add("further_starts_mean", "Further starts mean");
  add("further_starts_largest", "Further starts largest");
  add("cpu", "CPU", "s");
  add("contended", "Contended");
  add("stopped", "Stopped");
  return columns;
}

nlohmann::ordered_json FiniteOrNull(const std::optional<double>& value) {
  return value && std::isfinite(*value) ? nlohmann::ordered_json(*value) : nlohmann::ordered_json();
}

nlohmann::ordered_json CellJson(const CellStatistics& cell, const ColumnStatistics& column) {
  const auto some = [&](double value) {
    return cell.n == 0 ? nlohmann::ordered_json() : nlohmann::ordered_json(value);
  };
  return {{"n", cell.n},
          {"missing", cell.missing},
          {"runs", cell.runs},
          {"solved", some(cell.solved)},
          {"share_lower", some(cell.share.lower)},
          {"share_upper", some(cell.share.upper)},
          {"solved_least", cell.solved_least ? nlohmann::ordered_json(*cell.solved_least) : nlohmann::ordered_json()},
          {"solved_most", cell.solved_most ? nlohmann::ordered_json(*cell.solved_most) : nlohmann::ordered_json()},
          {"work_median_ms", FiniteOrNull(cell.work_median_ms)},
          {"time_median_ms", FiniteOrNull(cell.time_median_ms)},
          {"time_q95_ms", FiniteOrNull(cell.time_q95_ms)},
          {"charge_ms", column.charge.ms},
          {"par10_ms", FiniteOrNull(cell.par10_ms)},
          {"ert_ms", FiniteOrNull(cell.ert_ms)},
          {"mean_rank", FiniteOrNull(cell.mean_rank)},
          {"cost_median", FiniteOrNull(cell.cost_median)},
          {"cost_q95", FiniteOrNull(cell.cost_q95)},
          {"tolerance_median", FiniteOrNull(cell.tolerance_median)},
          {"tolerance_largest", FiniteOrNull(cell.tolerance_largest)},
          {"further_starts_mean", FiniteOrNull(cell.further_starts_mean)},
          {"further_starts_largest", FiniteOrNull(cell.further_starts_largest)},
          {"common", column.common},
          {"common_time_ms", FiniteOrNull(cell.common_time_ms)},
          {"common_cost", FiniteOrNull(cell.common_cost)},
          {"paired", cell.paired},
          {"work_ratio", FiniteOrNull(cell.work_ratio)},
          {"time_ratio", FiniteOrNull(cell.time_ratio)},
          {"cost_ratio", FiniteOrNull(cell.cost_ratio)},
          {"cpu_ms", some(cell.cpu_ms)},
          {"reported", cell.reported},
          {"contended", cell.contended},
          {"stopped", cell.stopped}};
}

// Returns the rank test of three or more methods; null if there is nothing to test.
nlohmann::ordered_json RanksJson(const ColumnStatistics& column) {
  const auto& test = column.ranks;
  const bool told = test && test->defined, more = told && test->iman_davenport.denominator > 0;
  const auto number = [](bool is_told, double value) {
    return is_told ? FiniteOrNull(value) : nlohmann::ordered_json();
  };
  return {{"friedman_chi_square", number(told, told ? test->chi_square : 0.0)},
          {"friedman_p", number(told, told ? test->p : 0.0)},
          {"iman_davenport_f", number(more, more ? test->iman_davenport.f : 0.0)},
          {"iman_davenport_p", number(more, more ? test->iman_davenport.p : 0.0)}};
}

// Returns the members that identify a row among all methods, tasks and initializations.
nlohmann::ordered_json KeyJson(const StatisticsTable& table, const StatisticsRow& row, const BenchmarkColumn& column) {
  return {{"experiment_id", table.experiment.id},
          {"method_id", row.method.method_id},
          {"method", row.title},
          {"multi_starts", row.method.multi_starts},
          {"inner_starts", row.method.inner_starts},
          {"sample_size", row.method.sample_size},
          {"incremental", row.method.incremental},
          {"collision", ToString(row.method.collision)},
          {"task", ToString(column.task)},
          {"initialization", ToString(column.initialization)}};
}

nlohmann::ordered_json RowsJson(const StatisticsTable& table) {
  auto rows = nlohmann::ordered_json::array();
  for (const StatisticsRow& row : table.rows) {
    for (const auto& [column, cell] : row.cells) {
      nlohmann::ordered_json line = KeyJson(table, row, column);
      line.update(CellJson(cell, table.columns.at(column)));
      rows.push_back(std::move(line));
    }
  }
  return rows;
}

// Converts objects with equal keys to rows.
Listing ListingOf(const nlohmann::ordered_json& rows) {
  Listing listing;
  for (const auto& row : rows) {
    auto& line = listing.rows.emplace_back();
    for (const auto& [key, value] : row.items()) {
      if (listing.rows.size() == 1) listing.columns.push_back(key);
      line.emplace_back(value);
    }
  }
  return listing;
}

// Adds the steps of a method's curve.
void AddSteps(const nlohmann::ordered_json& key, bool by_work, int problems, const statistics::StepCurve& curve,
              nlohmann::ordered_json* rows) {
  const auto add = [&](double ratio, double share) {
    nlohmann::ordered_json row = key;
    row.update({{"measure", by_work ? "work" : "time"}, {"problems", problems}, {"ratio", ratio}, {"share", share}});
    rows->push_back(std::move(row));
  };
  if (curve.at.empty() || curve.at.front() > 1.0) add(1.0, 0.0);
  for (std::size_t i = 0; i < curve.at.size(); ++i) add(curve.at[i], curve.share[i]);
}

nlohmann::ordered_json ProfileRows(const StatisticsTable& table) {
  auto rows = nlohmann::ordered_json::array();
  for (const auto& [column, common] : table.columns) {
    auto curve = common.profile.curves.begin();
    for (const StatisticsRow& row : table.rows) {
      const auto cell = row.cells.find(column);
      if (cell == row.cells.end() || cell->second.n == 0 || curve == common.profile.curves.end()) continue;
      AddSteps(KeyJson(table, row, column), common.by_work, common.profile.problems, *curve++, &rows);
    }
  }
  return rows;
}

}  // namespace

std::string CaptionOf(const std::string& what, const StatisticsTable& table) {
  std::string text = what + " of experiment " + std::to_string(table.experiment.id) + " '" + table.experiment.name +
                     "', dataset " + table.experiment.dataset_name + std::string(SplitCaption(table.experiment.split)) +
                     ", " + std::string(ToString(table.rule)) + " rule, seed " + std::to_string(table.seed);
  text += table.repetitions == 1 ? ", one run per problem"
                                 : ", " + std::to_string(table.repetitions) + " repetitions averaged per problem";
  if (table.finished < table.jobs) {
    text += ", " + std::to_string(table.finished) + "/" + std::to_string(table.jobs) + " jobs finished";
  }
  return text + (table.origins.empty() ? "." : ". " + DescribeOrigins(table.origins)) +
         ReusedResultsSentence(table.taken_over);
}

nlohmann::ordered_json StatisticsTableJson(const StatisticsTable& table) {
  nlohmann::ordered_json json = {{"experiment_id", table.experiment.id},
                                 {"experiment", table.experiment.name},
                                 {"dataset", table.experiment.dataset_name},
                                 {"split", ToString(table.experiment.split)},
                                 {"dataset_hash", table.experiment.dataset_hash},
                                 {"rule", ToString(table.rule)},
                                 {"seed", table.seed},
                                 {"repetitions", table.repetitions},
                                 {"jobs", table.jobs},
                                 {"finished", table.finished},
                                 {"clock_stopped", table.clock_stopped},
                                 {"taken_over", table.taken_over},
                                 {"origins", OriginsJson(table.origins)}};
  json["columns"] = nlohmann::ordered_json::array();
  for (const auto& [column, common] : table.columns) {
    const auto& test = common.success;
    json["columns"].push_back(
        {{"task", ToString(column.task)},
         {"initialization", ToString(column.initialization)},
         {"common", common.common},
         {"complete", common.complete},
         {"left_out", common.left_out},
         {"reference", common.reference.empty() ? nlohmann::ordered_json() : nlohmann::ordered_json(common.reference)},
         {"informative", test ? nlohmann::ordered_json(test->informative) : nullptr},
         {"cochran_q", test ? nlohmann::ordered_json(test->q) : nullptr},
         {"cochran_p", test ? nlohmann::ordered_json(test->p) : nullptr},
         {"charge_ms", common.charge.ms},
         {"charge_rule", EnumNameOf(common.charge.rule)}});
    json["columns"].back().update(RanksJson(common));
  }
  json["rows"] = RowsJson(table);
  return json;
}

std::vector<Table> TablesOf(const StatisticsTable& table, const TimeUnit& unit) {
  const Keys keys(table);
  std::vector<Table> tables;
  for (const auto& [column, common] : table.columns) {
    Table& shown = tables.emplace_back();
    shown.columns = keys.Columns();
    const auto figures = FigureColumns(column, table.repetitions > 1, common.charge);
    shown.columns.insert(shown.columns.end(), figures.begin(), figures.end());
    for (const StatisticsRow& row : table.rows) {
      const auto found = row.cells.find(column);
      if (found == row.cells.end()) continue;
      auto& cells = shown.rows.emplace_back().cells;
      cells = keys.Of(row);
      const auto values = ShownCell(found->second, table.repetitions > 1, unit);
      cells.insert(cells.end(), values.begin(), values.end());
    }
    shown.notes.push_back({ColumnNote(common) + " A failure is charged " + DescribeCharge(common.charge, unit) + "."});
  }
  if (tables.empty()) return tables;
  tables.front().title = {CaptionOf("Statistics", table)};
  tables.back().notes.front().text += " " + Note(unit);
  const std::string warning = ClockWarning(table.clock_stopped, table.experiment.id);
  if (!warning.empty()) tables.back().notes.push_back({warning, Emphasis::kBad});
  return tables;
}

std::string RenderStatisticsTable(const StatisticsTable& table, TableFormat format, const TableStyle& style) {
  if (format == TableFormat::kJson && style.columns.empty()) return JsonText(StatisticsTableJson(table)) + "\n";
  if (IsExact(format)) {
    return RenderTable(KeepColumns(TableOf(ListingOf(RowsJson(table))), style.columns), format, style.layout);
  }
  std::vector<Table> tables = TablesOf(table, style.time_unit);
  for (Table& shown : tables) shown = KeepColumns(shown, style.columns);
  return RenderTables(tables, format, style.layout);
}

std::string RenderProfiles(const StatisticsTable& table, TableFormat format, const TableStyle& style) {
  return RenderTable(KeepColumns(TableOf(ListingOf(ProfileRows(table))), style.columns), format, style.layout);
}

}  // namespace legopt::client

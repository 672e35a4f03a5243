#include <algorithm>
#include <cmath>
#include <cstdio>

#include "client/compare/statistics_table.h"
#include "client/report/grouped_table.h"
#include "client/report/json_text.h"
#include "client/report/listing.h"

namespace legopt::client {
namespace {

constexpr double kMsPerSecond = 1e3, kHundred = 100.0;

std::string Decimal(double value, int decimals) {
  char text[48];
  std::snprintf(text, sizeof(text), "%.*f", decimals, value);
  return text;
}

std::string ShownTime(const std::optional<double>& time_ms, const TimeUnit& unit) {
  if (!time_ms) return "-";
  return std::isinf(*time_ms) ? "inf" : FormatTime(*time_ms / kMsPerSecond, unit);
}

std::string ShownCost(const std::optional<double>& cost) {
  return cost && std::isinf(*cost) ? "inf" : FormatCost(cost);
}

// "49/50", "48.7/50" of several repetitions, "40/45 (5 missing)".
std::string ShownSuccess(const CellStatistics& cell) {
  const bool whole = cell.solved == std::floor(cell.solved);
  return Decimal(cell.solved, whole ? 0 : 1) + "/" + std::to_string(cell.n) +
         (cell.missing > 0 ? " (" + std::to_string(cell.missing) + " missing)" : "");
}

std::string ShownShare(int count, int of) { return of == 0 ? "-" : Decimal(kHundred * count / of, 0); }

std::vector<TableText> ShownCell(const CellStatistics& cell, const TimeUnit& unit) {
  const std::string share =
      "[" + Decimal(kHundred * cell.share.lower, 1) + ", " + Decimal(kHundred * cell.share.upper, 1) + "]";
  return {{ShownSuccess(cell)},
          {cell.n == 0 ? "-" : share},
          {ShownTime(cell.time_median_ms, unit)},
          {ShownTime(cell.time_q95_ms, unit)},
          {ShownTime(cell.common_time_ms, unit)},
          {ShownTime(cell.par10_ms, unit)},
          {cell.mean_rank ? Decimal(*cell.mean_rank, 2) : "-"},
          {ShownCost(cell.cost_median)},
          {ShownCost(cell.cost_q95)},
          {ShownCost(cell.common_cost)},
          {ShownTime(cell.cpu_ms, kSeconds)},
          {ShownShare(cell.contended, cell.reported)},
          {std::to_string(cell.stopped)}};
}

bool Differ(const std::vector<StatisticsRow>& rows, auto MethodIdentity::*figure) {
  return std::any_of(rows.begin(), rows.end(),
                     [&](const StatisticsRow& row) { return row.method.*figure != rows.front().method.*figure; });
}

// The columns that name a row.
struct Keys {
  bool incremental, collision;

  explicit Keys(const StatisticsTable& table)
      : incremental(Differ(table.rows, &MethodIdentity::incremental)),
        collision(Differ(table.rows, &MethodIdentity::collision)) {}

  std::vector<TableText> Titles() const {
    std::vector<TableText> titles = {{"Method"}, {"Multi-starts", "Starts"}, {"Sample size", "Sample"}};
    if (incremental) titles.push_back({"Incremental", "Incr."});
    if (collision) titles.push_back({"Collision"});
    return titles;
  }

  std::vector<TableText> Of(const StatisticsRow& row) const {
    std::vector<TableText> cells = {
        {row.title}, {std::to_string(row.method.multi_starts)}, {std::to_string(row.method.sample_size)}};
    if (incremental) cells.push_back({row.method.incremental ? "yes" : "no"});
    if (collision) cells.push_back({std::string(ToString(row.method.collision))});
    return cells;
  }
};

std::string Caption(const StatisticsTable& table) {
  std::string text = "Statistics of experiment " + std::to_string(table.experiment.id) + " '" + table.experiment.name +
                     "', dataset " + table.experiment.dataset_name + std::string(Mention(table.experiment.split)) +
                     ", " + std::string(ToString(table.rule)) + " rule, seed " + std::to_string(table.seed);
  text += table.repetitions == 1 ? ", one run per problem"
                                 : ", " + std::to_string(table.repetitions) + " repetitions averaged per problem";
  return text + (table.origins.empty() ? "." : ". " + DescribeOrigins(table.origins));
}

std::string Note(const TimeUnit& unit) {
  return "The unit is the problem. Solved: of n problems with a finished run, with Wilson's 95 % interval in percent; "
         "jobs that died or could not run are failures, queued and cancelled ones are missing. Times, in " +
         std::string(unit.name) +
         ", are of a whole solve: wall time, CPU time where contended. Median and 95 % quantile of time and cost count "
         "an unsolved problem as infinite. Common: geometric mean over the problems that all methods solved (times "
         "shifted by 1 ms). PAR10: mean time, a failure at ten limits. Rank: mean rank by time, failures last. CPU: "
         "seconds of all runs. Contended: percent of runs that others disturbed. Stopped: runs whose solver a limit "
         "ended.";
}

// What is said of a task and start besides its rows.
std::string ColumnNote(const ColumnStatistics& column) {
  std::string text = "Common: " + std::to_string(column.common) + (column.common == 1 ? " problem." : " problems.");
  if (!column.success) return text;
  if (column.success->informative == 0) return text + " All methods solved the same ones.";
  char p[32];
  std::snprintf(p, sizeof(p), "%.2g", column.success->p);
  return text + " Do methods differ in success? Cochran's Q " + Decimal(column.success->q, 2) + ", " +
         std::to_string(column.success->degrees) + " degrees of freedom, p = " + p + ".";
}

// The table of one task and start; the first has the caption, the last the note.
GroupedTable Group(const StatisticsTable& table, const BenchmarkColumn& column, const TimeUnit& unit) {
  const Keys keys(table);
  GroupedTable grouped;
  grouped.key_titles = keys.Titles();
  grouped.column_titles = {{"Solved"},  {"95 %"},      {"Time median"}, {"Time 95 %"}, {"Time common"},
                           {"PAR10"},   {"Rank"},      {"Cost median"}, {"Cost 95 %"}, {"Cost common"},
                           {"CPU (s)"}, {"Contended"}, {"Stopped"}};
  grouped.groups = {GroupOf(column.task, column.initialization)};
  for (const StatisticsRow& row : table.rows) {
    const auto found = row.cells.find(column);
    if (found == row.cells.end()) continue;
    auto line = keys.Of(row);
    const auto figures = ShownCell(found->second, unit);
    line.insert(line.end(), figures.begin(), figures.end());
    grouped.rows.push_back(std::move(line));
  }
  grouped.note = ColumnNote(table.columns.at(column));
  const bool first = column == table.columns.begin()->first, last = column == table.columns.rbegin()->first;
  if (first) grouped.caption = Caption(table);
  if (last) grouped.note += " " + Note(unit);
  if (last) grouped.warning = ClockWarning(table.clock_stopped, table.experiment.id);
  return MakePrintable(std::move(grouped));
}

template <class Render>
std::string RenderGroups(const StatisticsTable& table, const TimeUnit& unit, const Render& render) {
  std::string text;
  for (const auto& [column, common] : table.columns) {
    text += (text.empty() ? "" : "\n") + render(Group(table, column, unit));
  }
  return text;
}

nlohmann::ordered_json FiniteOrNull(const std::optional<double>& value) {
  return value && std::isfinite(*value) ? nlohmann::ordered_json(*value) : nlohmann::ordered_json();
}

nlohmann::ordered_json CellJson(const CellStatistics& cell, const ColumnStatistics& column) {
  return {{"n", cell.n},
          {"missing", cell.missing},
          {"runs", cell.runs},
          {"solved", cell.solved},
          {"share_lower", cell.share.lower},
          {"share_upper", cell.share.upper},
          {"time_median_ms", FiniteOrNull(cell.time_median_ms)},
          {"time_q95_ms", FiniteOrNull(cell.time_q95_ms)},
          {"par10_ms", FiniteOrNull(cell.par10_ms)},
          {"ert_ms", FiniteOrNull(cell.ert_ms)},
          {"mean_rank", FiniteOrNull(cell.mean_rank)},
          {"cost_median", FiniteOrNull(cell.cost_median)},
          {"cost_q95", FiniteOrNull(cell.cost_q95)},
          {"common", column.common},
          {"common_time_ms", FiniteOrNull(cell.common_time_ms)},
          {"common_cost", FiniteOrNull(cell.common_cost)},
          {"cpu_ms", cell.cpu_ms},
          {"reported", cell.reported},
          {"contended", cell.contended},
          {"stopped", cell.stopped}};
}

nlohmann::ordered_json RowsJson(const StatisticsTable& table) {
  auto rows = nlohmann::ordered_json::array();
  for (const StatisticsRow& row : table.rows) {
    for (const auto& [column, cell] : row.cells) {
      nlohmann::ordered_json line = {{"experiment_id", table.experiment.id},
                                     {"method_id", row.method.method_id},
                                     {"method", row.title},
                                     {"multi_starts", row.method.multi_starts},
                                     {"sample_size", row.method.sample_size},
                                     {"incremental", row.method.incremental},
                                     {"collision", ToString(row.method.collision)},
                                     {"task", ToString(column.task)},
                                     {"initialization", ToString(column.initialization)}};
      line.update(CellJson(cell, table.columns.at(column)));
      rows.push_back(std::move(line));
    }
  }
  return rows;
}

// The rows of the JSON; columns are the same for every experiment.
std::string RenderCsv(const StatisticsTable& table) {
  Listing listing;
  for (const auto& row : RowsJson(table)) {
    auto& line = listing.rows.emplace_back();
    for (const auto& [key, value] : row.items()) {
      if (listing.rows.size() == 1) listing.columns.push_back(key);
      line.emplace_back(value);
    }
  }
  return RenderListing(listing, ListingFormat::kCsv);
}

}  // namespace

nlohmann::ordered_json StatisticsTableJson(const StatisticsTable& table) {
  nlohmann::ordered_json json = {{"experiment_id", table.experiment.id},
                                 {"experiment", table.experiment.name},
                                 {"dataset", table.experiment.dataset_name},
                                 {"split", ToString(table.experiment.split)},
                                 {"dataset_hash", table.experiment.dataset_hash},
                                 {"rule", ToString(table.rule)},
                                 {"seed", table.seed},
                                 {"repetitions", table.repetitions},
                                 {"clock_stopped", table.clock_stopped},
                                 {"origins", OriginsJson(table.origins)}};
  json["columns"] = nlohmann::ordered_json::array();
  for (const auto& [column, common] : table.columns) {
    const auto& test = common.success;
    json["columns"].push_back({{"task", ToString(column.task)},
                               {"initialization", ToString(column.initialization)},
                               {"common", common.common},
                               {"complete", common.complete},
                               {"cochran_q", test ? nlohmann::ordered_json(test->q) : nullptr},
                               {"cochran_p", test ? nlohmann::ordered_json(test->p) : nullptr}});
  }
  json["rows"] = RowsJson(table);
  return json;
}

std::string RenderStatisticsTable(const StatisticsTable& table, TableFormat format, const TableStyle& style) {
  switch (format) {
    case TableFormat::kText:
      return RenderGroups(table, style.time_unit, [&](const GroupedTable& t) { return RenderText(t, style.layout); });
    case TableFormat::kMarkdown:
      return RenderGroups(table, style.time_unit, RenderMarkdown);
    case TableFormat::kLatex:
      return RenderGroups(table, style.time_unit, RenderLatex);
    case TableFormat::kCsv:
      return RenderCsv(table);
    case TableFormat::kJson:
      return JsonText(StatisticsTableJson(table)) + "\n";
  }
  return {};
}

}  // namespace legopt::client

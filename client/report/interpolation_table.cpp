#include "client/report/interpolation_table.h"

#include <algorithm>
#include <utility>

#include "client/report/benchmark_table.h"
#include "client/report/escaped_text.h"
#include "db/named_queries.h"

namespace legopt::client {
namespace {

std::string Note() {
  return "Ten configurations between consecutive waypoints of each solved " +
         std::string(ToString(kInterpolatedTask.task)) +
         ", by the exact meshes: " + std::string(kInterpolatedTask.plural) +
         " free of penetration above 1 mm, mean share of such transitions, largest depths. No part of the verdict.";
}

std::optional<double> OptionalNumber(const nlohmann::json& value) {
  return value.is_number() ? std::optional(value.get<double>()) : std::nullopt;
}

nlohmann::json NumberOrNull(const std::optional<double>& value) {
  return value ? nlohmann::json(*value) : nlohmann::json();
}

TableRow ShownLine(const InterpolationTable& table, const InterpolationRow& row) {
  constexpr double kMillimetresPerMetre = 1e3;
  TableRow line{{TextCell(row.method), CountCell(row.multi_starts), CountCell(row.sample_size)}};
  if (table.shows_collision()) line.cells.push_back(TextCell(std::string(ToString(row.collision))));
  const auto millimetres = [](std::optional<double> depth_m) {
    if (depth_m) *depth_m *= kMillimetresPerMetre;
    return RealCell(depth_m, 1);
  };
  for (const Initialization start : table.Initializations()) {
    const auto found = row.cells.find(start);
    const InterpolationCell cell = found == row.cells.end() ? InterpolationCell{} : found->second;
    line.cells.push_back(cell.scored > 0 ? SuccessCell(cell.free, cell.scored) : MissingCell());
    line.cells.push_back(PercentCell(cell.free_share, 1));
    line.cells.push_back(millimetres(cell.environment_depth_m));
    line.cells.push_back(millimetres(cell.self_depth_m));
  }
  return line;
}

std::string Caption(const InterpolationTable& table) {
  return "Interpolation of the " + std::string(kInterpolatedTask.plural) + " of experiment " +
         std::to_string(table.experiment_id) + " '" + table.experiment + "'" +
         (table.dataset.empty() ? "" : ", dataset " + table.dataset + std::string(SplitCaption(table.split))) + ", " +
         std::string(ToString(table.rule)) + " rule" +
         (table.origins.empty() ? "" : ". " + DescribeOrigins(table.origins)) + ReusedResultsSentence(table.taken_over);
}

Listing Unrounded(const InterpolationTable& table) {
  Listing listing;
  listing.columns = {"experiment_id",
                     "experiment",
                     "dataset",
                     "rule",
                     "method",
                     "multi_starts",
                     "inner_starts",
                     "sample_size",
                     "collision",
                     "initialization",
                     "n",
                     "solved",
                     "scored",
                     "free",
                     "free_share",
                     "environment_depth_m",
                     "self_depth_m",
                     "clock_stopped"};
  for (const auto& row : table.rows) {
    for (const auto& [initialization, cell] : row.cells) {
      listing.rows.push_back({table.experiment_id, table.experiment, table.dataset, ToString(table.rule), row.method,
                              row.multi_starts, row.inner_starts, row.sample_size, ToString(row.collision),
                              ToString(initialization), cell.n, cell.solved, cell.scored, cell.free,
                              NumberOrNull(cell.free_share), NumberOrNull(cell.environment_depth_m),
                              NumberOrNull(cell.self_depth_m), cell.clock_stopped});
    }
  }
  return listing;
}

std::string RenderJson(const InterpolationTable& table) {
  const nlohmann::ordered_json json = {
      {"experiment_id", table.experiment_id},    {"experiment", table.experiment}, {"dataset", table.dataset},
      {"split", ToString(table.split)},          {"rule", ToString(table.rule)},   {"taken_over", table.taken_over},
      {"cells", ListingToJson(Unrounded(table))}};
  return JsonText(json) + "\n";
}

}  // namespace

bool InterpolationTable::shows_collision() const {
  return std::any_of(rows.begin(), rows.end(), [this](const auto& row) { return row.collision != rows[0].collision; });
}

std::vector<Initialization> InterpolationTable::Initializations() const {
  std::vector<Initialization> found;
  for (const auto& start : kEnumNames<Initialization>) {
    if (std::ranges::any_of(rows, [&](const auto& row) { return row.cells.contains(start.value); })) {
      found.push_back(start.value);
    }
  }
  return found;
}

std::string InterpolationCellsSql(std::int64_t experiment_id, Rule rule) {
  return db::Sql(db::Query::kInterpolationOfExperiment,
                 {{"experiment_id", experiment_id}, {"rule", rule}, {"task", kInterpolatedTask.task}});
}

InterpolationTable BuildInterpolationTable(const Listing& cells, std::int64_t experiment_id, Rule rule) {
  InterpolationTable table;
  table.experiment_id = experiment_id;
  table.rule = rule;
  std::vector<std::int64_t> method_ids;  // ids of the rows
  for (std::size_t i = 0; i < cells.rows.size(); ++i) {
    const auto integer = [&](const char* column) { return cells.At(i, column).get<std::int64_t>(); };
    table.experiment = cells.Text(i, "experiment");
    if (method_ids.empty() || method_ids.back() != integer("method_id")) {
      method_ids.push_back(integer("method_id"));
      table.rows.push_back({cells.Text(i, "method"),
                            integer("multi_starts"),
                            integer("sample_size"),
                            cells.EnumAt<SceneRepresentation>(i, "collision"),
                            {},
                            integer("inner_starts"),
                            integer("method_id")});
    }
    table.rows.back().cells[cells.EnumAt<Initialization>(i, "initialization")] = {
        integer("n"),
        integer("solved"),
        integer("scored"),
        integer("free"),
        OptionalNumber(cells.At(i, "free_share")),
        OptionalNumber(cells.At(i, "environment_depth_m")),
        OptionalNumber(cells.At(i, "self_depth_m")),
        integer("clock_stopped")};
  }
  DisambiguateRows(method_ids, &table.rows);
  return table;
}

Table TableOf(const InterpolationTable& table) {
  Table shown;
  shown.title = {Caption(table)};
  shown.columns = MethodColumns();
  if (table.shows_collision()) shown.columns.push_back({"collision", "Collision"});
  for (const Initialization start : table.Initializations()) {
    const std::string name = std::string(ToString(start)) + "_";
    const std::string group = ColumnTitle({kInterpolatedTask.task, start});
    shown.columns.push_back({name + "free", "Free", "", Alignment::kRight, group});
    shown.columns.push_back({name + "share", "Share", "percent", Alignment::kRight, group});
    shown.columns.push_back({name + "scene", "Scene", "mm", Alignment::kRight, group});
    shown.columns.push_back({name + "self", "Self", "mm", Alignment::kRight, group});
  }
  std::int64_t clock_stopped = 0;
  for (const auto& row : table.rows) {
    shown.rows.push_back(ShownLine(table, row));
    for (const auto& [start, cell] : row.cells) clock_stopped += cell.clock_stopped;
  }
  shown.notes.push_back({Note()});
  const std::string warning = ClockWarning(clock_stopped, table.experiment_id);
  if (!warning.empty()) shown.notes.push_back({warning, Emphasis::kBad});
  return shown;
}

std::string RenderInterpolationTable(const InterpolationTable& table, TableFormat format, const TableStyle& style) {
  if (format == TableFormat::kJson && style.columns.empty()) return RenderJson(table);
  const Table shown = IsExact(format) ? TableOf(Unrounded(table)) : TableOf(table);
  return RenderTable(KeepColumns(shown, style.columns), format, style.layout);
}

}  // namespace legopt::client

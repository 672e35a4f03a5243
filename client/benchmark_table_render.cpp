#include <array>

#include "client/benchmark_table.h"
#include "client/grouped_table.h"

namespace legopt::client {
namespace {

constexpr char kMeansNote[] = "Costs and times are averaged over successfully solved problems, per waypoint.";
constexpr char kPaperNote[] =
    " Rows 'paper': Table I of Brandao, Hashimoto, Takanishi, \"SGD for robot motion?\", Humanoids 2017, with the "
    "authors' problems and computer.";
constexpr char kPaperRow[] = "  paper";
constexpr std::size_t kCellColumns = 3;  // success, cost, time

using Cells = std::map<BenchmarkColumn, BenchmarkCell>;

std::string Caption(const BenchmarkTable& table) {
  std::string text = "Experiment " + std::to_string(table.experiment_id) + " '" + table.experiment + "'";
  if (!table.dataset.empty()) text += ", dataset " + table.dataset;
  text += ", " + table.rule + " rule, " + std::to_string(table.num_finished()) + "/" +
          std::to_string(table.num_jobs()) + " jobs finished";
  return text;
}

// One line as it is shown: `name` and what else names the row, then success, cost and time of each column.
std::vector<std::string> ShownLine(const BenchmarkTable& table, const BenchmarkRow& row, const std::string& name,
                                   const Cells& cells, const TimeUnit& unit) {
  std::vector<std::string> line = {name, std::to_string(row.multi_starts), std::to_string(row.sample_size)};
  if (table.shows_collision()) line.push_back(row.collision);
  for (const auto& column : table.columns) {
    const auto found = cells.find(column);
    if (found == cells.end()) {
      line.insert(line.end(), kCellColumns, "-");
      continue;
    }
    line.push_back(FormatSuccess(found->second));
    line.push_back(FormatCost(found->second.cost));
    line.push_back(FormatTime(found->second.time_s, unit));
  }
  return line;
}

GroupedTable Group(const BenchmarkTable& table, const TimeUnit& unit, const std::string& time_title) {
  GroupedTable grouped;
  grouped.caption = Caption(table);
  grouped.key_titles = {"Method", "Multi-starts", "Sample size"};
  if (table.shows_collision()) grouped.key_titles.emplace_back("Collision");
  grouped.column_titles = {"Success", "Cost", time_title};
  grouped.note = kMeansNote;
  for (const auto& [task, initialization] : table.columns) {
    grouped.groups.push_back(TaskTitle(task) + ", " + InitializationTitle(initialization));
  }
  bool compared = false;
  for (const auto& row : table.rows) {
    grouped.rows.push_back(ShownLine(table, row, row.method, row.cells, unit));
    if (row.paper.empty()) continue;
    grouped.rows.push_back(ShownLine(table, row, kPaperRow, row.paper, unit));
    compared = true;
  }
  if (compared) grouped.note += kPaperNote;
  return grouped;
}

nlohmann::ordered_json CellJson(const BenchmarkCell& cell) {
  nlohmann::ordered_json json = {{"n", cell.n}, {"finished", cell.finished}, {"solved", cell.solved}};
  json["cost"] = cell.cost ? nlohmann::ordered_json(*cell.cost) : nlohmann::ordered_json();
  json["time_s"] = cell.time_s ? nlohmann::ordered_json(*cell.time_s) : nlohmann::ordered_json();
  return json;
}

void AddCells(const BenchmarkTable& table, const Cells& cells, nlohmann::ordered_json* line) {
  for (const auto& column : table.columns) {
    const auto found = cells.find(column);
    if (found != cells.end()) (*line)[column.first][column.second] = CellJson(found->second);
  }
}

std::string RenderJson(const BenchmarkTable& table) {
  nlohmann::ordered_json json = {{"experiment_id", table.experiment_id},
                                 {"experiment", table.experiment},
                                 {"dataset", table.dataset},
                                 {"rule", table.rule},
                                 {"jobs", table.num_jobs()},
                                 {"finished", table.num_finished()}};
  json["rows"] = nlohmann::ordered_json::array();
  for (const auto& row : table.rows) {
    nlohmann::ordered_json line = {{"method", row.method},
                                   {"multi_starts", row.multi_starts},
                                   {"sample_size", row.sample_size},
                                   {"collision", row.collision}};
    AddCells(table, row.cells, &line);
    if (!row.paper.empty()) AddCells(table, row.paper, &line["paper"]);
    json["rows"].push_back(std::move(line));
  }
  return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

void AddFigures(const BenchmarkTable& table, const Cells& cells, std::span<const char* const> figures,
                std::vector<nlohmann::json>* line) {
  for (const auto& column : table.columns) {
    const auto found = cells.find(column);
    const nlohmann::ordered_json cell =
        found == cells.end() ? nlohmann::ordered_json::object() : CellJson(found->second);
    for (const auto* figure : figures) {
      line->push_back(cell.contains(figure) ? nlohmann::json(cell[figure]) : nlohmann::json());
    }
  }
}

std::string RenderCsv(const BenchmarkTable& table) {
  constexpr std::array<const char*, 5> kFigures = {"n", "finished", "solved", "cost", "time_s"};
  constexpr std::array<const char*, 4> kPaperFigures = {"n", "solved", "cost", "time_s"};
  const bool compared =
      std::any_of(table.rows.begin(), table.rows.end(), [](const auto& row) { return !row.paper.empty(); });
  const auto add_titles = [&](const char* prefix, std::span<const char* const> figures, Listing* listing) {
    for (const auto& [task, initialization] : table.columns) {
      for (const auto* figure : figures)
        listing->columns.push_back(prefix + task + "_" + initialization + "_" + figure);
    }
  };
  Listing listing;
  listing.columns = {"experiment", "dataset", "rule", "method", "multi_starts", "sample_size"};
  if (table.shows_collision()) listing.columns.emplace_back("collision");
  add_titles("", kFigures, &listing);
  if (compared) add_titles("paper_", kPaperFigures, &listing);
  for (const auto& row : table.rows) {
    auto& line = listing.rows.emplace_back();
    line = {table.experiment, table.dataset, table.rule, row.method, row.multi_starts, row.sample_size};
    if (table.shows_collision()) line.emplace_back(row.collision);
    AddFigures(table, row.cells, kFigures, &line);
    if (compared) AddFigures(table, row.paper, kPaperFigures, &line);
  }
  return RenderListing(listing, ListingFormat::kCsv);
}

}  // namespace

std::string RenderBenchmarkTable(const BenchmarkTable& table, TableFormat format) {
  const TimeUnit unit = ChooseTimeUnit(table);
  switch (format) {
    case TableFormat::kText:
      return RenderText(Group(table, unit, "Time(" + unit.name + ")"));
    case TableFormat::kMarkdown:
      return RenderMarkdown(Group(table, unit, "Time (" + unit.name + ")"));
    case TableFormat::kLatex:
      return RenderLatex(Group(table, unit, "Time (" + (unit.name == "us" ? "$\\mu$s" : unit.name) + ")"));
    case TableFormat::kCsv:
      return RenderCsv(table);
    case TableFormat::kJson:
      return RenderJson(table);
  }
  return {};
}

}  // namespace legopt::client

#include <algorithm>
#include <array>
#include <span>
#include <utility>
#include <vector>

#include "client/report/benchmark_table.h"
#include "client/report/escaped_text.h"
#include "legopt/types/number_text.h"

namespace legopt::client {
namespace {

constexpr char kMeansNote[] = "Costs and times are averaged over successfully solved problems, per waypoint.";
constexpr char kPaperNote[] =
    " Rows 'paper': Table I of Brandao, Hashimoto, Takanishi, \"SGD for robot motion?\", Humanoids 2017, with the "
    "authors' problems and computer.";
constexpr char kNoPaperNote[] = " The paper's Table I has none of these rows.";
constexpr char kPaperRow[] = "  paper";
constexpr std::array<const char*, 12> kFigures = {"n",    "problems", "repetitions", "finished",      "solved",
                                                  "dead", "failed",   "cancelled",   "clock_stopped", "taken_over",
                                                  "cost", "time_s"};
constexpr std::array<const char*, 4> kPaperFigures = {"n", "solved", "cost", "time_s"};

using Cells = std::map<BenchmarkColumn, BenchmarkCell>;
using Figures = std::span<const char* const>;

// Returns e.g. "175/175 jobs finished, of these 1 dead, 40 cancelled".
std::string Progress(const BenchmarkCell& sum) {
  std::string text = std::to_string(sum.finished) + "/" + std::to_string(sum.n) + " jobs finished";
  const char* separator = ", of these ";
  const auto add = [&](std::int64_t count, const char* word) {
    if (count == 0) return;
    text += separator + std::to_string(count) + " " + word;
    separator = ", ";
  };
  add(sum.dead, "dead");
  add(sum.failed, "failed");
  add(sum.cancelled, "cancelled");
  return text;
}

// Describes the jobs of a column, e.g. "10 problems x 3 repetitions"; empty if each problem was solved once.
std::string Repetitions(const BenchmarkTable& table, const BenchmarkColumn& column) {
  std::int64_t problems = 0, repetitions = 1;
  for (const auto& row : table.rows) {
    const auto found = row.cells.find(column);
    if (found == row.cells.end()) continue;
    problems = std::max(problems, found->second.problems);
    repetitions = std::max(repetitions, found->second.repetitions);
  }
  if (repetitions == 1) return {};
  return std::to_string(problems) + (problems == 1 ? " problem x " : " problems x ") + std::to_string(repetitions) +
         " repetitions";
}

// Returns one description for all columns if they are equal, else one per task.
std::string Repetitions(const BenchmarkTable& table) {
  std::vector<std::pair<Task, std::string>> tasks;  // the columns of a task have the same problems
  for (const auto& column : table.columns) {
    if (tasks.empty() || tasks.back().first != column.task) tasks.emplace_back(column.task, Repetitions(table, column));
  }
  const bool equal =
      std::all_of(tasks.begin(), tasks.end(), [&](const auto& task) { return task.second == tasks.front().second; });
  std::string text;
  for (const auto& [task, words] : tasks) {
    if (words.empty() || (equal && !text.empty())) continue;
    text += (text.empty() ? "; " : ", ") + (equal ? "" : std::string(ToString(task)) + " ") + words;
  }
  return text;
}

// Returns "" without a certificate, else e.g. " Feasible problems by certificate 0123456789ab (LegOpt-best's SQP, 10000
// starts per stance; not judged again here) and by what any row solved."
std::string CertificateSentence(const BenchmarkTable& table) {
  if (!table.certificate) return {};
  constexpr std::size_t kShown = 12;
  const CertificateFacts& facts = *table.certificate;
  return " Feasible problems by certificate " + facts.hash.substr(0, kShown) + " (" + std::string(kCertificateFinder) +
         (facts.starts > 0 ? ", " + std::to_string(facts.starts) + " starts per stance" : "") +
         "; not judged again here) and by what any row solved.";
}

std::string Caption(const BenchmarkTable& table) {
  std::string text = "Experiment " + std::to_string(table.experiment_id) + " '" + table.experiment + "'";
  if (!table.dataset.empty()) text += ", dataset " + table.dataset + std::string(SplitCaption(table.split));
  return text + ", " + std::string(ToString(table.rule)) + " rule, " + Progress(table.Sum()) + Repetitions(table) +
         (table.origins.empty() ? "" : ". " + DescribeOrigins(table.origins)) +
         ReusedResultsSentence(table.Sum().taken_over) + CertificateSentence(table);
}

// The best values of a column: the largest share of solved problems and, among the rows with that share, the lowest
// cost and time. Means of other rows are over other problems, so they are not compared.
struct Best {
  double share = 0;
  std::optional<double> cost, time_s;
};

double ShareOf(const JobCounts& counts) {
  return counts.n == 0 ? 0.0 : static_cast<double>(counts.solved) / static_cast<double>(counts.n);
}

void Lower(const std::optional<double>& value, std::optional<double>* lowest) {
  if (value && (!*lowest || *value < **lowest)) *lowest = value;
}

std::map<BenchmarkColumn, Best> FindBest(const BenchmarkTable& table) {
  std::map<BenchmarkColumn, Best> best;
  if (table.rows.size() < 2) return best;
  for (const auto& row : table.rows) {
    for (const auto& [column, cell] : row.cells) {
      Best& found = best[column];
      const double share = ShareOf(table.Counted(cell));
      if (share > found.share) found = {share, std::nullopt, std::nullopt};
      if (share < found.share || cell.solved == 0) continue;
      Lower(cell.cost, &found.cost);
      Lower(cell.time_s, &found.time_s);
    }
  }
  return best;
}

// Returns success, cost and time of a cell; `best` is nullptr for cells that do not compete.
std::array<TableCell, 3> ShownCell(const BenchmarkTable& table, const BenchmarkCell& cell, const TimeUnit& unit,
                                   const Best* best) {
  // The paper's figures have no certificate.
  const bool certified = table.certificate.has_value() && cell.by_feasibility != BenchmarkCell{}.by_feasibility;
  std::array<TableCell, 3> shown = {certified ? ShownCertifiedSuccess(cell) : ShownSuccess(cell),
                                    FigureCell(cell.cost, FormatCost(cell.cost)),
                                    FigureCell(cell.time_s, FormatTime(cell.time_s, unit))};
  if (best != nullptr && cell.solved > 0 && ShareOf(table.Counted(cell)) == best->share) {
    shown[0].emphasis = Emphasis::kBest;
    if (cell.cost && cell.cost == best->cost) shown[1].emphasis = Emphasis::kBest;
    if (cell.time_s && cell.time_s == best->time_s) shown[2].emphasis = Emphasis::kBest;
  }
  if (cell.dead + cell.failed > 0) shown[0].emphasis = Emphasis::kBad;
  return shown;
}

// Returns a displayed line: `name` and the other keys of the row, then success, cost and time of each column.
TableRow ShownLine(const BenchmarkTable& table, const BenchmarkRow& row, const std::string& name, const Cells& cells,
                   const TimeUnit& unit, const std::map<BenchmarkColumn, Best>& best) {
  TableRow line{{TextCell(name), CountCell(row.multi_starts), CountCell(row.sample_size)}};
  if (table.shows_collision()) line.cells.push_back(TextCell(std::string(ToString(row.collision))));
  for (const auto& column : table.columns) {
    const auto found = cells.find(column);
    const auto rival = best.find(column);
    const auto shown = found == cells.end()
                           ? std::array{MissingCell(), MissingCell(), MissingCell()}
                           : ShownCell(table, found->second, unit, rival == best.end() ? nullptr : &rival->second);
    line.cells.insert(line.cells.end(), shown.begin(), shown.end());
  }
  return line;
}

// Returns the name of a row, with its settings if other rows have the same name.
std::string NameInNote(const BenchmarkTable& table, const BenchmarkRow& row) {
  if (std::ranges::count(table.rows, row.method, &BenchmarkRow::method) == 1) return row.method;
  return row.method + " (" + std::to_string(row.multi_starts) + ", " + std::to_string(row.sample_size) + " %" +
         (table.shows_collision() ? ", " + std::string(ToString(row.collision)) : "") + ")";
}

// Returns e.g. "Solved by the solid rule: SQP 49/50, 4/4; Adam 48/50, 4/4." in the order of rows and columns; empty if
// unknown.
std::string OtherRuleNote(const BenchmarkTable& table) {
  if (!table.other_rule) return {};
  std::string text;
  for (const BenchmarkRow& row : table.rows) {
    text += (text.empty() ? "" : "; ") + NameInNote(table, row);
    const char* separator = " ";
    for (const BenchmarkColumn& column : table.columns) {
      const auto cell = row.cells.find(column);
      text += separator;
      text += cell == row.cells.end() || cell->second.finished == 0
                  ? "-"
                  : std::to_string(cell->second.solved_by_other_rule) + "/" + std::to_string(cell->second.n);
      separator = ", ";
    }
  }
  return " Solved by the " + std::string(ToString(*table.other_rule)) + " rule" +
         (table.certificate ? ", of all problems: " : ": ") + text + ".";
}

// Returns how often methods with internal restarts started again; empty without such methods.
std::string RestartNote(const BenchmarkTable& table) {
  std::string text;
  for (const BenchmarkRow& row : table.rows) {
    if (row.inner_starts == 0) continue;
    text += (text.empty() ? "" : "; ") + NameInNote(table, row) + " ";
    text += row.further_starts ? FormatGeneral(row.further_starts->mean, 2) + " on average, at most " +
                                     std::to_string(row.further_starts->largest)
                               : "not counted (option rescues: " + std::to_string(row.inner_starts) + ")";
  }
  return text.empty() ? "" : " Starts within a run beyond the first one of each window: " + text + ".";
}

std::string Note(const BenchmarkTable& table) {
  const bool matched = std::ranges::any_of(table.rows, [](const auto& row) { return !row.paper.empty(); });
  return kMeansNote +
         std::string(!table.compared ? ""
                     : matched       ? kPaperNote
                                     : kNoPaperNote) +
         RestartNote(table) + OtherRuleNote(table);
}

nlohmann::ordered_json CellJson(const BenchmarkCell& cell, Figures figures) {
  const auto number = [](const std::optional<double>& value) {
    return value ? nlohmann::json(*value) : nlohmann::json();
  };
  const nlohmann::json all = {{"n", cell.n},
                              {"problems", cell.problems},
                              {"repetitions", cell.repetitions},
                              {"finished", cell.finished},
                              {"solved", cell.solved},
                              {"dead", cell.dead},
                              {"failed", cell.failed},
                              {"cancelled", cell.cancelled},
                              {"clock_stopped", cell.clock_stopped},
                              {"taken_over", cell.taken_over},
                              {"cost", number(cell.cost)},
                              {"time_s", number(cell.time_s)}};
  nlohmann::ordered_json json;
  for (const auto* figure : figures) json[figure] = all.at(figure);
  return json;
}

nlohmann::ordered_json FurtherStartsJson(const BenchmarkRow& row) {
  if (!row.further_starts) return nullptr;
  return {{"mean", row.further_starts->mean}, {"largest", row.further_starts->largest}};
}

nlohmann::ordered_json FeasibilityJson(const BenchmarkCell& cell) {
  nlohmann::ordered_json json;
  for (const auto& [value, word] : kEnumNames<Feasibility>) {
    const JobCounts& counts = cell.by_feasibility[value];
    json[word] = {{"n", counts.n}, {"solved", counts.solved}};
  }
  return json;
}

void AddCells(const BenchmarkTable& table, const Cells& cells, Figures figures, nlohmann::ordered_json* line) {
  for (const auto& column : table.columns) {
    const auto found = cells.find(column);
    if (found == cells.end()) continue;
    auto& cell = (*line)[ToString(column.task)][ToString(column.initialization)];
    cell = CellJson(found->second, figures);
    if (table.certificate && figures.size() == kFigures.size()) cell["by_feasibility"] = FeasibilityJson(found->second);
  }
}

/// Returns the columns of a CSV file: always the paper's, so that files have equal columns, then further ones of the
/// table.
std::vector<BenchmarkColumn> CsvColumns(const BenchmarkTable& table) {
  std::vector<BenchmarkColumn> columns(kPaperColumns.begin(), kPaperColumns.end());
  for (const BenchmarkColumn& column : table.columns) {
    if (std::ranges::find(kPaperColumns, column) == kPaperColumns.end()) columns.push_back(column);
  }
  return columns;
}

using CsvColumnList = std::span<const BenchmarkColumn>;

void AddTitles(CsvColumnList columns, const std::string& prefix, Figures figures, Listing* listing) {
  for (const auto& column : columns) {
    for (const auto* figure : figures) listing->columns.push_back(prefix + ColumnName(column) + "_" + figure);
  }
}

void AddFigures(CsvColumnList columns, const Cells& cells, Figures figures, std::vector<nlohmann::json>* line) {
  for (const auto& column : columns) {
    const auto found = cells.find(column);
    for (const auto* figure : figures) {
      line->push_back(found == cells.end() ? nlohmann::json()
                                           : nlohmann::json(CellJson(found->second, figures)[figure]));
    }
  }
}

void AddFeasibilityTitles(CsvColumnList columns, Listing* listing) {
  for (const auto& column : columns) {
    for (const auto& [value, word] : kEnumNames<Feasibility>) {
      for (const char* figure : {"_n", "_solved"}) {
        listing->columns.push_back(ColumnName(column) + "_" + std::string(word) + figure);
      }
    }
  }
}

void AddFeasibilityFigures(CsvColumnList columns, const Cells& cells, std::vector<nlohmann::json>* line) {
  for (const auto& column : columns) {
    const auto found = cells.find(column);
    for (const auto& [value, word] : kEnumNames<Feasibility>) {
      const auto counts = found == cells.end() ? JobCounts{} : found->second.by_feasibility[value];
      line->push_back(found == cells.end() ? nlohmann::json() : nlohmann::json(counts.n));
      line->push_back(found == cells.end() ? nlohmann::json() : nlohmann::json(counts.solved));
    }
  }
}

// Returns every figure, unrounded.
Listing Unrounded(const BenchmarkTable& table) {
  Listing listing;
  listing.columns = {"experiment_id", "experiment",   "dataset",     "rule",     "method",
                     "multi_starts",  "inner_starts", "sample_size", "collision"};
  const std::vector<BenchmarkColumn> columns = CsvColumns(table);
  AddTitles(columns, "", kFigures, &listing);
  if (table.compared) AddTitles(kPaperColumns, "paper_", kPaperFigures, &listing);
  if (table.certificate) AddFeasibilityTitles(columns, &listing);
  listing.columns.emplace_back("builds");
  for (const auto& row : table.rows) {
    auto& line = listing.rows.emplace_back();
    line = {table.experiment_id, table.experiment, table.dataset,   ToString(table.rule),   row.method,
            row.multi_starts,    row.inner_starts, row.sample_size, ToString(row.collision)};
    AddFigures(columns, row.cells, kFigures, &line);
    if (table.compared) AddFigures(kPaperColumns, row.paper, kPaperFigures, &line);
    if (table.certificate) AddFeasibilityFigures(columns, row.cells, &line);
    line.emplace_back(BuildIds(table.origins));
  }
  return listing;
}

// Returns the number of jobs solved by the other rule: for each row, in the order of "rows", one number per column.
nlohmann::ordered_json OtherRuleJson(const BenchmarkTable& table) {
  nlohmann::ordered_json json = {{"rule", ToString(*table.other_rule)}};
  json["solved"] = nlohmann::ordered_json::array();
  for (const BenchmarkRow& row : table.rows) {
    nlohmann::ordered_json line = nlohmann::ordered_json::object();
    for (const auto& [column, cell] : row.cells) line[ColumnName(column)] = cell.solved_by_other_rule;
    json["solved"].push_back(std::move(line));
  }
  return json;
}

}  // namespace

nlohmann::ordered_json BenchmarkTableJson(const BenchmarkTable& table) {
  const BenchmarkCell sum = table.Sum();
  nlohmann::ordered_json json = {{"experiment_id", table.experiment_id},
                                 {"experiment", table.experiment},
                                 {"dataset", table.dataset},
                                 {"split", ToString(table.split)},
                                 {"rule", ToString(table.rule)},
                                 {"jobs", sum.n},
                                 {"finished", sum.finished},
                                 {"dead", sum.dead},
                                 {"failed", sum.failed},
                                 {"cancelled", sum.cancelled},
                                 {"clock_stopped", sum.clock_stopped},
                                 {"taken_over", sum.taken_over},
                                 {"origins", OriginsJson(table.origins)}};
  json["rows"] = nlohmann::ordered_json::array();
  for (const auto& row : table.rows) {
    nlohmann::ordered_json line = {{"method", row.method},
                                   {"multi_starts", row.multi_starts},
                                   {"inner_starts", row.inner_starts},
                                   {"further_starts", FurtherStartsJson(row)},
                                   {"sample_size", row.sample_size},
                                   {"collision", ToString(row.collision)}};
    AddCells(table, row.cells, kFigures, &line);
    if (!row.paper.empty()) AddCells(table, row.paper, kPaperFigures, &line["paper"]);
    json["rows"].push_back(std::move(line));
  }
  if (table.other_rule) json["other_rule"] = OtherRuleJson(table);
  if (table.certificate) {
    json["certificate"] = {{"hash", table.certificate->hash},
                           {"finder", kCertificateFinder},
                           {"starts", table.certificate->starts},
                           {"verified", false}};
  }
  return json;
}

Table TableOf(const BenchmarkTable& table, const TimeUnit& unit) {
  Table shown;
  shown.title = {Caption(table)};
  shown.columns = MethodColumns();
  if (table.shows_collision()) shown.columns.push_back({"collision", "Collision"});
  for (const BenchmarkColumn& column : table.columns) {
    const std::string name = ColumnName(column), group = ColumnTitle(column);
    shown.columns.push_back({name + "_success", "Success", "", Alignment::kRight, group});
    shown.columns.push_back({name + "_cost", "Cost", "", Alignment::kRight, group});
    shown.columns.push_back({name + "_time", "Time", unit.name, Alignment::kRight, group});
  }
  const auto best = FindBest(table);
  for (const auto& row : table.rows) {
    shown.rows.push_back(ShownLine(table, row, row.method, row.cells, unit, best));
    if (!row.paper.empty()) shown.rows.push_back(ShownLine(table, row, kPaperRow, row.paper, unit, {}));
  }
  shown.notes.push_back({Note(table)});
  const std::string warning = ClockWarning(table.Sum().clock_stopped, table.experiment_id);
  if (!warning.empty()) shown.notes.push_back({warning, Emphasis::kBad});
  return shown;
}

std::string RenderBenchmarkTable(const BenchmarkTable& table, TableFormat format, const TableStyle& style) {
  if (format == TableFormat::kJson && style.columns.empty()) return JsonText(BenchmarkTableJson(table)) + "\n";
  const Table shown = IsExact(format) ? TableOf(Unrounded(table)) : TableOf(table, style.time_unit);
  return RenderTable(KeepColumns(shown, style.columns), format, style.layout);
}

}  // namespace legopt::client

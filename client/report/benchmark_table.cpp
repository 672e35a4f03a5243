#include "client/report/benchmark_table.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <set>

#include "db/named_queries.h"
#include "legopt/input/text.h"
#include "legopt/types/input_error.h"
#include "legopt/types/job.h"
#include "legopt/types/number_text.h"

namespace legopt::client {

namespace {

// Returns three significant digits, including trailing zeros.
std::string ThreeDigits(double value) {
  constexpr int kDigits = 3, kSmallestExponent = -4;
  std::string scientific = FormatScientific(value, kDigits - 1);
  std::string exponent = scientific.substr(scientific.find('e') + 1);
  if (exponent.starts_with('+')) exponent.erase(0, 1);
  const int power = ParseInteger<int>(exponent).value_or(0);
  return power < kSmallestExponent ? scientific : FormatFixed(value, kDigits - 1 - power);
}

std::optional<double> FiniteNumber(const nlohmann::json& value) {
  if (!value.is_number() || !std::isfinite(value.get<double>())) return std::nullopt;
  return value.get<double>();
}

// Reads a row of the statement's answer.
class CellReader {
 public:
  CellReader(const Listing& cells, std::size_t row) : cells_(cells), row_(row) {}

  std::int64_t Integer(const char* column) const { return cells_.At(row_, column).get<std::int64_t>(); }
  std::string Text(const char* column) const { return cells_.Text(row_, column); }
  BenchmarkColumn Column() const {
    return {cells_.EnumAt<Task>(row_, "task"), cells_.EnumAt<Initialization>(row_, "initialization")};
  }

  BenchmarkRow Row() const {
    BenchmarkRow row;
    row.method = Text("method");
    row.multi_starts = Integer("multi_starts");
    row.sample_size = Integer("sample_size");
    row.collision = cells_.EnumAt<SceneRepresentation>(row_, "collision");
    row.inner_starts = Integer("inner_starts");
    row.method_id = Integer("method_id");
    return row;
  }

  BenchmarkCell Cell() const {
    BenchmarkCell cell;
    cell.n = Integer("n");
    cell.finished = Integer("finished");
    cell.solved = Integer("solved");
    cell.cost = FiniteNumber(cells_.At(row_, "cost"));
    cell.time_s = FiniteNumber(cells_.At(row_, "time_s"));
    cell.dead = Integer("dead");
    cell.failed = Integer("failed");
    cell.cancelled = Integer("cancelled");
    cell.clock_stopped = Integer("clock_stopped");
    cell.taken_over = Integer("taken_over");
    cell.problems = Integer("problems");
    cell.repetitions = Integer("repetitions");
    return cell;
  }

 private:
  const Listing& cells_;
  std::size_t row_;
};

// Returns e.g. "2 failed, 5 left"; empty for normal outcomes.
std::string Remarks(const BenchmarkCell& cell) {
  const std::pair<std::int64_t, const char*> counts[] = {
      {cell.dead, "dead"}, {cell.failed, "failed"}, {cell.cancelled, "cancelled"}, {cell.n - cell.finished, "left"}};
  std::string remarks;
  for (const auto& [count, word] : counts) {
    if (count > 0) remarks += (remarks.empty() ? "" : ", ") + std::to_string(count) + " " + word;
  }
  return remarks;
}

}  // namespace

bool BenchmarkTable::shows_collision() const {
  return std::any_of(rows.begin(), rows.end(),
                     [this](const BenchmarkRow& row) { return row.collision != rows.front().collision; });
}

JobCounts BenchmarkTable::Counted(const BenchmarkCell& cell) const {
  if (!certificate) return {cell.n, cell.solved};
  const JobCounts &certified = cell.by_feasibility[Feasibility::kCertified],
                  &open = cell.by_feasibility[Feasibility::kOpen];
  return {certified.n + open.n, certified.solved + open.solved};
}

BenchmarkCell BenchmarkTable::Sum() const {
  BenchmarkCell sum;
  for (const auto& row : rows) {
    for (const auto& [column, cell] : row.cells) {
      sum.n += cell.n;
      sum.finished += cell.finished;
      sum.solved += cell.solved;
      sum.dead += cell.dead;
      sum.failed += cell.failed;
      sum.cancelled += cell.cancelled;
      sum.clock_stopped += cell.clock_stopped;
      sum.taken_over += cell.taken_over;
      for (const auto& [value, word] : kEnumNames<Feasibility>) {
        sum.by_feasibility[value] += cell.by_feasibility[value];
      }
    }
  }
  return sum;
}

std::string ColumnName(const BenchmarkColumn& column) {
  return std::string(ToString(column.task)) + "_" + std::string(ToString(column.initialization));
}

std::string ColumnTitle(const BenchmarkColumn& column) {
  constexpr EnumArray<Initialization, const char*> kStarts = {{{"good init", "init in collision"}}};
  return std::string(DescriptionOf(column.task).title) + ", " + kStarts[column.initialization];
}

std::vector<TableColumn> MethodColumns() {
  return {{"method", "Method", "", Alignment::kLeft}, {"multi_starts", "Multi-starts"}, {"sample_size", "Sample size"}};
}

std::string BenchmarkCellsSql(std::int64_t experiment_id, Rule rule) {
  return db::Sql(db::Query::kBenchmarkCellsOfExperiment, {{"experiment_id", experiment_id}, {"rule", rule}});
}

BenchmarkTable BuildBenchmarkTable(const Listing& cells, std::int64_t experiment_id, Rule rule) {
  BenchmarkTable table;
  table.experiment_id = experiment_id;
  table.rule = rule;
  std::set<BenchmarkColumn> present;
  std::vector<std::int64_t> method_ids;
  for (std::size_t i = 0; i < cells.rows.size(); ++i) {
    const CellReader reader(cells, i);
    table.experiment = reader.Text("experiment");
    const auto method_id = reader.Integer("method_id");
    auto found = std::find(method_ids.begin(), method_ids.end(), method_id);
    if (found == method_ids.end()) {
      found = method_ids.insert(method_ids.end(), method_id);
      table.rows.push_back(reader.Row());
    }
    const BenchmarkColumn column = reader.Column();
    present.insert(column);
    table.rows[static_cast<std::size_t>(found - method_ids.begin())].cells[column] = reader.Cell();
  }
  for (const auto& column : kTableColumns) {
    if (present.contains(column)) table.columns.push_back(column);
  }
  DisambiguateRows(method_ids, &table.rows);
  return table;
}

std::string FormatCost(const std::optional<double>& cost) {
  if (!cost) return "-";
  constexpr double kSmallestWithTwoDecimals = 0.005;
  if (*cost >= 1.0) return FormatFixed(*cost, 0);
  if (*cost >= kSmallestWithTwoDecimals || *cost == 0.0) return FormatFixed(*cost, 2);
  return FormatScientific(*cost, 1);
}

std::string FormatTime(const std::optional<double>& time_s, const TimeUnit& unit) {
  if (!time_s) return "-";
  const double value = *time_s / unit.seconds;
  // Boundaries at which rounding would add a digit: 0.9995 is shown as 1.00, 9.995 as 10.0, 99.95 as 100.
  constexpr double kAllDecimals = 0.9995, kTwoDecimals = 9.995, kOneDecimal = 99.95;
  if (value < kAllDecimals && value > 0) return ThreeDigits(value);
  if (value < kTwoDecimals) return FormatFixed(value, 2);
  return FormatFixed(value, value < kOneDecimal ? 1 : 0);
}

std::string ClockWarning(std::int64_t clock_stopped, std::int64_t experiment_id) {
  if (clock_stopped == 0) return {};
  return "The clock ended " + std::to_string(clock_stopped) + (clock_stopped == 1 ? " job" : " jobs") +
         " (the wall-time limit, or budget_s of an external method), so the outcome depends on the speed of the "
         "machine: "
         "'legopt retry " +
         std::to_string(experiment_id) + " --time-limit' queues " + (clock_stopped == 1 ? "it" : "them") + " again.";
}

namespace {

// Nothing has been solved or not solved yet.
TableCell NothingFinished(const BenchmarkCell& cell) {
  const std::string remarks = Remarks(cell);
  return TextCell(remarks.empty() ? "-" : "- (" + remarks + ")");
}

}  // namespace

TableCell ShownSuccess(const BenchmarkCell& cell) {
  if (cell.finished == 0) return NothingFinished(cell);
  return SuccessCell(cell.solved, cell.n, Remarks(cell));
}

TableCell ShownCertifiedSuccess(const BenchmarkCell& cell) {
  if (cell.finished == 0) return NothingFinished(cell);
  const JobCounts &certified = cell.by_feasibility[Feasibility::kCertified],
                  &open = cell.by_feasibility[Feasibility::kOpen],
                  &infeasible = cell.by_feasibility[Feasibility::kInfeasible];
  std::string rest;
  if (open.n > 0) rest = std::to_string(open.n) + " open";
  if (infeasible.n > 0) {
    rest += (rest.empty() ? "" : ", ") + std::to_string(infeasible.solved) + " of " + std::to_string(infeasible.n) +
            " infeasible";
  }
  const std::string remarks = Remarks(cell);
  if (!rest.empty() && !remarks.empty()) rest += ", ";
  return SuccessCell(certified.solved + open.solved, certified.n + open.n, rest + remarks);
}

namespace {

const std::vector<std::string> kColumnFigures = {"n", "solved", "cost", "time_s"};

std::vector<std::string> Fields(const std::string& line) {
  std::vector<std::string> fields(1);
  for (const char c : line) {
    if (c == ',') {
      fields.emplace_back();
    } else {
      fields.back() += c;
    }
  }
  return fields;
}

std::vector<std::string> Titles() {
  std::vector<std::string> titles = {"method", "multi_starts", "sample_size"};
  for (const auto& column : kPaperColumns) {
    for (const auto& figure : kColumnFigures) titles.push_back(ColumnName(column) + "_" + figure);
  }
  return titles;
}

// A split line of the file; numbers are parsed on demand so that an error names the column.
class Line {
 public:
  Line(std::string place, const std::string& text) : place_(std::move(place)), fields_(Fields(text)) {
    if (fields_.size() != Titles().size()) {
      throw InputError({place_, "", text, "has not one field per column", "see the line of titles"});
    }
  }

  const std::string& Text(std::size_t column) const { return fields_[column]; }

  std::optional<double> Number(std::size_t column) const {
    const std::string& text = fields_[column];
    if (text.empty()) return std::nullopt;
    double value = 0;
    const auto parsed = std::from_chars(text.data(), text.data() + text.size(), value);
    if (parsed.ec != std::errc() || parsed.ptr != text.data() + text.size()) {
      throw InputError({place_, Titles()[column], text, "is not a number", "leave it empty for a dash"});
    }
    return value;
  }

  std::int64_t Count(std::size_t column) const { return static_cast<std::int64_t>(Number(column).value_or(0)); }

 private:
  std::string place_;
  std::vector<std::string> fields_;
};

BenchmarkRow ReadRow(const Line& line) {
  BenchmarkRow row;
  std::size_t at = 0;
  row.method = line.Text(at++);
  row.multi_starts = line.Count(at++);
  row.sample_size = line.Count(at++);
  for (const auto& column : kPaperColumns) {
    BenchmarkCell& cell = row.cells[column];
    cell.n = cell.finished = line.Count(at++);
    cell.solved = line.Count(at++);
    cell.cost = line.Number(at++);
    cell.time_s = line.Number(at++);
  }
  return row;
}

bool SameName(const std::string& a, const std::string& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](unsigned char x, unsigned char y) { return std::tolower(x) == std::tolower(y); });
}

}  // namespace

std::vector<BenchmarkRow> ReadPaperTable(const std::filesystem::path& file) {
  constexpr std::size_t kMostBytes = std::size_t{1} << 20;
  ClassicInput stream(ReadFileText(file, kMostBytes));
  std::vector<BenchmarkRow> rows;
  bool titles_seen = false;
  int number = 0;
  for (std::string text; std::getline(stream, text);) {
    ++number;
    if (text.empty() || text[0] == '#') continue;
    const std::string place = file.string() + ":" + std::to_string(number);
    if (titles_seen) {
      rows.push_back(ReadRow(Line(place, text)));
    } else if (Fields(text) != Titles()) {
      throw InputError({place, "", text, "does not name the columns of the paper's table", "restore the file"});
    }
    titles_seen = true;
  }
  if (rows.empty())
    throw InputError({file.string(), "", "", "cannot be read as the paper's table", "restore the file"});
  return rows;
}

void AddPaperFigures(const std::vector<BenchmarkRow>& paper, BenchmarkTable* table) {
  table->compared = true;
  for (auto& row : table->rows) {
    const auto found = std::find_if(paper.begin(), paper.end(), [&row](const BenchmarkRow& candidate) {
      return SameName(candidate.method, row.method) && candidate.multi_starts == row.multi_starts &&
             candidate.sample_size == row.sample_size;
    });
    if (found != paper.end()) row.paper = found->cells;
  }
}

}  // namespace legopt::client

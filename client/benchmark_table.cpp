#include "client/benchmark_table.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <set>

namespace legopt::client {
namespace {

const std::array<BenchmarkColumn, 4> kPaperColumns = {
    {{"posture", "good"}, {"posture", "in_collision"}, {"motion", "good"}, {"motion", "in_collision"}}};

std::string Print(const char* format, double value) {
  char text[64];
  std::snprintf(text, sizeof(text), format, value);
  return text;
}

std::optional<double> OptionalNumber(const nlohmann::json& value) {
  if (!value.is_number() || !std::isfinite(value.get<double>())) return std::nullopt;
  return value.get<double>();
}

}  // namespace

bool BenchmarkTable::shows_collision() const {
  return std::any_of(rows.begin(), rows.end(),
                     [this](const BenchmarkRow& row) { return row.collision != rows.front().collision; });
}

std::int64_t BenchmarkTable::num_jobs() const {
  std::int64_t sum = 0;
  for (const auto& row : rows) {
    for (const auto& [column, cell] : row.cells) sum += cell.n;
  }
  return sum;
}

std::int64_t BenchmarkTable::num_finished() const {
  std::int64_t sum = 0;
  for (const auto& row : rows) {
    for (const auto& [column, cell] : row.cells) sum += cell.finished;
  }
  return sum;
}

std::string BenchmarkCellsSql(std::int64_t experiment_id, const std::string& rule) {
  return "SELECT method_id, method, multi_starts, sample_size, collision, task, initialization, n, finished, solved, "
         "cost, "
         "time_s, "
         "experiment FROM benchmark_cells AS b WHERE experiment_id = " +
         std::to_string(experiment_id) + " AND rule = '" + (rule == "strict" ? "strict" : "literal") +
         "' ORDER BY (SELECT min(cell_id) FROM cells AS c WHERE c.experiment_id = b.experiment_id AND "
         "c.method_id = b.method_id), task, initialization";
}

BenchmarkTable BuildBenchmarkTable(const Listing& cells, std::int64_t experiment_id, const std::string& rule) {
  BenchmarkTable table;
  table.experiment_id = experiment_id;
  table.rule = rule;
  std::set<BenchmarkColumn> present;
  std::vector<std::int64_t> method_ids;
  for (std::size_t i = 0; i < cells.rows.size(); ++i) {
    table.experiment = cells.At(i, "experiment").get<std::string>();
    const auto method_id = cells.At(i, "method_id").get<std::int64_t>();
    auto found = std::find(method_ids.begin(), method_ids.end(), method_id);
    if (found == method_ids.end()) {
      found = method_ids.insert(method_ids.end(), method_id);
      table.rows.push_back({cells.At(i, "method").get<std::string>(),
                            cells.At(i, "multi_starts").get<std::int64_t>(),
                            cells.At(i, "sample_size").get<std::int64_t>(),
                            {},
                            cells.At(i, "collision").get<std::string>()});
    }
    const BenchmarkColumn column{cells.At(i, "task").get<std::string>(),
                                 cells.At(i, "initialization").get<std::string>()};
    present.insert(column);
    table.rows[static_cast<std::size_t>(found - method_ids.begin())].cells[column] = {
        cells.At(i, "n").get<std::int64_t>(), cells.At(i, "finished").get<std::int64_t>(),
        cells.At(i, "solved").get<std::int64_t>(), OptionalNumber(cells.At(i, "cost")),
        OptionalNumber(cells.At(i, "time_s"))};
  }
  for (const auto& column : kPaperColumns) {
    if (present.erase(column) > 0) table.columns.push_back(column);
  }
  table.columns.insert(table.columns.end(), present.begin(), present.end());
  return table;
}

TimeUnit ChooseTimeUnit(const BenchmarkTable& table) {
  constexpr double kMilli = 1e-3, kMicro = 1e-6;
  double sum_of_logs = 0;
  int count = 0;
  for (const auto& row : table.rows) {
    for (const auto& [column, cell] : row.cells) {
      if (cell.time_s && *cell.time_s > 0) {
        sum_of_logs += std::log(*cell.time_s);
        ++count;
      }
    }
  }
  const double typical_s = count == 0 ? 1.0 : std::exp(sum_of_logs / count);
  if (typical_s >= 1.0) return {"s", 1.0};
  if (typical_s >= kMilli) return {"ms", kMilli};
  return {"us", kMicro};
}

std::string FormatCost(const std::optional<double>& cost) {
  if (!cost) return "-";
  constexpr double kSmallestWithTwoDecimals = 0.005;
  if (*cost >= 1.0) return Print("%.0f", *cost);
  if (*cost >= kSmallestWithTwoDecimals || *cost == 0.0) return Print("%.2f", *cost);
  return Print("%.1e", *cost);
}

std::string FormatTime(const std::optional<double>& time_s, const TimeUnit& unit) {
  if (!time_s) return "-";
  const double value = *time_s / unit.seconds;
  // The boundaries are where rounding would add a digit: 9.995 reads 10.0, 99.95 reads 100.
  constexpr double kTwoDecimals = 9.995, kOneDecimal = 99.95;
  if (value < 1.0 && value > 0) return Print("%.3g", value);
  if (value < kTwoDecimals) return Print("%.2f", value);
  return Print(value < kOneDecimal ? "%.1f" : "%.0f", value);
}

std::string FormatSuccess(const BenchmarkCell& cell) {
  std::string text = std::to_string(cell.solved) + "/" + std::to_string(cell.n);
  if (cell.finished < cell.n) text += " (" + std::to_string(cell.n - cell.finished) + " left)";
  return text;
}

}  // namespace legopt::client

#include <cmath>
#include <string_view>

#include "client/report/table_writers.h"
#include "legopt/input/json.h"

namespace legopt::client {
namespace {

// Returns a field of RFC 4180, quoted only if needed.
std::string CsvField(std::string_view text) {
  if (text.find_first_of(",\"\r\n") == std::string_view::npos) return std::string(text);
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"') quoted += '"';
    quoted += c;
  }
  return quoted + "\"";
}

std::string CsvCell(const nlohmann::json& value) {
  if (value.is_null()) return {};
  if (const std::string infinity = InfinityText(value); !infinity.empty()) return infinity;
  return CsvField(value.is_string() ? value.get<std::string>() : Dump(value));
}

}  // namespace

std::string InfinityText(const nlohmann::json& value) {
  if (!value.is_number_float() || !std::isinf(value.get<double>())) return {};
  return value.get<double>() > 0 ? "inf" : "-inf";
}

std::string CsvHeader(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i) text += (i == 0 ? "" : ",") + CsvField(names[i]);
  return text + "\n";
}

std::string CsvRow(const std::vector<nlohmann::json>& values) {
  std::string text;
  for (std::size_t i = 0; i < values.size(); ++i) text += (i == 0 ? "" : ",") + CsvCell(values[i]);
  return text + "\n";
}

std::string RenderTableCsv(const Table& table) {
  std::vector<std::string> names;
  for (const TableColumn& column : table.columns) names.push_back(column.name);
  std::string text = CsvHeader(DistinctNames(names));
  for (const TableRow& row : table.rows) {
    std::vector<nlohmann::json> values;
    for (const TableCell& cell : row.cells) values.push_back(cell.value);
    text += CsvRow(values);
  }
  return text;
}

}  // namespace legopt::client

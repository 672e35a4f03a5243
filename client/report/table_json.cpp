#include "client/report/json_text.h"
#include "client/report/table_writers.h"

namespace legopt::client {

nlohmann::ordered_json JsonRow(const std::vector<std::string>& names, const std::vector<nlohmann::json>& values) {
  auto object = nlohmann::ordered_json::object();
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::string infinity = InfinityText(values[i]);
    object[names[i]] = infinity.empty() ? values[i] : nlohmann::json(infinity);
  }
  return object;
}

std::string IndentedJsonRow(const std::vector<std::string>& names, const std::vector<nlohmann::json>& values) {
  std::string text = "  ";
  for (const char c : JsonText(JsonRow(names, values))) {
    text += c;
    if (c == '\n') text += "  ";
  }
  return text;
}

nlohmann::ordered_json RenderTableJson(const Table& table) {
  std::vector<std::string> names;
  for (const TableColumn& column : table.columns) names.push_back(column.name);
  names = DistinctNames(names);
  auto array = nlohmann::ordered_json::array();
  for (const TableRow& row : table.rows) {
    std::vector<nlohmann::json> values;
    for (const TableCell& cell : row.cells) values.push_back(cell.value);
    array.push_back(JsonRow(names, values));
  }
  return array;
}

}  // namespace legopt::client

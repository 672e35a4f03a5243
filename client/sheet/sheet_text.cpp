#include "client/sheet/sheet_text.h"

#include <algorithm>
#include <cmath>

#include "client/report/escaped_text.h"
#include "legopt/input/json.h"
#include "legopt/types/number_text.h"

namespace legopt::client {
namespace {

std::string FormatSheetRow(const std::vector<std::string>& cells) {
  std::string text = "|";
  for (const std::string& cell : cells) text += " " + MarkdownText(app::Printable(cell)) + " |";
  return text + "\n";
}

}  // namespace

std::string FormatSheetTable(const SheetTable& table) {
  if (table.rows.empty()) return {};
  std::string text = FormatSheetRow(table.columns) + "|";
  for (std::size_t i = 0; i < table.columns.size(); ++i) text += " --- |";
  text += "\n";
  for (const std::vector<std::string>& row : table.rows) text += FormatSheetRow(row);
  return text + "\n";
}

std::string SheetSection(const std::string& title, const std::string& body) { return "## " + title + "\n\n" + body; }

std::string SheetNumber(double value) { return std::isfinite(value) ? FormatGeneral(value) : "-"; }

std::string SheetRange(const std::vector<double>& values) {
  if (values.empty()) return "-";
  const auto [least, most] = std::ranges::minmax(values);
  return least == most ? SheetNumber(least) : SheetNumber(least) + " to " + SheetNumber(most);
}

void AddJsonRows(const nlohmann::ordered_json& json, const std::string& prefix, SheetTable* table) {
  for (const auto& [key, value] : json.items()) {
    const std::string name = prefix.empty() ? key : prefix + "." + key;
    if (value.is_object()) {
      AddJsonRows(value, name, table);
    } else {
      table->rows.push_back({name, value.is_string() ? value.get<std::string>() : Dump(value)});
    }
  }
}

}  // namespace legopt::client

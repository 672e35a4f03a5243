#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "client/report/table.h"

namespace legopt::client {

/// The five writers of RenderTable.

/// The texts of a table as displayed: every text is printable, and every cell has its text.
struct ShownTable {
  explicit ShownTable(const Table& from);

  /// Returns the heading of a column with its unit.
  std::string Heading(std::size_t column) const;
  /// Returns whether a group of columns begins at `column`.
  bool GroupBegins(std::size_t column) const;
  /// Returns the number of columns of the group that begins at `column`.
  std::size_t GroupSize(std::size_t column) const;
  bool has_groups() const;

  Table table;
};

std::string RenderTableText(const ShownTable& shown, const TextLayout& layout);
std::string RenderTableMarkdown(const ShownTable& shown);
std::string RenderTableLatex(const ShownTable& shown);
std::string RenderTableCsv(const Table& table);
nlohmann::ordered_json RenderTableJson(const Table& table);

/// Returns a line of CSV including its end.
std::string CsvHeader(const std::vector<std::string>& names);
std::string CsvRow(const std::vector<nlohmann::json>& values);
/// Returns a row of JSON as an object.
nlohmann::ordered_json JsonRow(const std::vector<std::string>& names, const std::vector<nlohmann::json>& values);
/// Returns a row of the printed JSON array, without the following comma and line end.
std::string IndentedJsonRow(const std::vector<std::string>& names, const std::vector<nlohmann::json>& values);

/// Returns "inf" or "-inf"; empty for all other values. JSON cannot represent infinity, and "null" would mean SQL's
/// NULL.
std::string InfinityText(const nlohmann::json& value);

}  // namespace legopt::client

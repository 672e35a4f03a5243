#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace legopt::client {

/// A table of a data sheet; cells are plain text, which is escaped.
struct SheetTable {
  std::vector<std::string> columns;
  std::vector<std::vector<std::string>> rows;  ///< each has columns.size() cells
};

/// Formats a table in Markdown, followed by an empty line; an empty text without rows.
std::string FormatSheetTable(const SheetTable& table);

/// Formats a section with its heading, followed by an empty line.
std::string SheetSection(const std::string& title, const std::string& body);

/// Formats a number with up to six digits; "-" if it is not finite.
std::string SheetNumber(double value);

/// Formats the smallest and the largest value: "0.4 to 0.5", or one number; "-" without values.
std::string SheetRange(const std::vector<double>& values);

/// Appends a row per scalar of a JSON object to a table of keys and values; keys of objects are joined by '.'.
void AddJsonRows(const nlohmann::ordered_json& json, const std::string& prefix, SheetTable* table);

}  // namespace legopt::client

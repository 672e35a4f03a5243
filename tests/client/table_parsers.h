#pragma once

#include <map>
#include <string>
#include <vector>

namespace legopt::client {

/// A rendered benchmark table read back: the shown cells of every row, "-" for none, and the time unit of the header.
struct ParsedTable {
  std::vector<std::vector<std::string>> rows;
  std::string time_unit;
};

ParsedTable ParseTextTable(const std::string& text);
ParsedTable ParseMarkdownTable(const std::string& text);
ParsedTable ParseLatexTable(const std::string& text);

/// Parses CSV by RFC 4180.
std::vector<std::vector<std::string>> ParseCsv(const std::string& text);

/// One line of CSV; key: name of the column.
using CsvRow = std::map<std::string, std::string>;
/// Parses CSV with a line of column names.
std::vector<CsvRow> CsvRows(const std::string& text);

}  // namespace legopt::client

#include "table_parsers.h"

#include <gtest/gtest.h>

#include <regex>
#include <sstream>

namespace legopt::client {
namespace {

std::string Trim(const std::string& text) {
  const auto first = text.find_first_not_of(' ');
  return first == std::string::npos ? "" : text.substr(first, text.find_last_not_of(' ') - first + 1);
}

std::vector<std::string> SplitLines(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

std::vector<std::string> SplitLine(const std::string& text, const std::regex& separator) {
  std::vector<std::string> parts;
  for (std::sregex_token_iterator at(text.begin(), text.end(), separator, -1), end; at != end; ++at) {
    parts.push_back(Trim(at->str()));
  }
  return parts;
}

std::string TimeUnitOf(const std::string& heading) {
  std::smatch match;
  return std::regex_search(heading, match, std::regex(R"([Tt]ime ?\(([^)]*)\))")) ? match[1].str() : "";
}

}  // namespace

ParsedTable ParseTextTable(const std::string& text) {
  ParsedTable table;
  bool in_rows = false;
  for (const auto& line : SplitLines(text)) {
    if (line.rfind("Method", 0) == 0) table.time_unit = TimeUnitOf(line);
    if (line.rfind("---", 0) == 0) {
      in_rows = true;
    } else if (in_rows && line.empty()) {
      break;
    } else if (in_rows) {
      // Columns are separated by two spaces or a bar; a single space belongs to a cell.
      table.rows.push_back(SplitLine(line, std::regex(R"(\s+\|\s+|\s{2,})")));
    }
  }
  return table;
}

ParsedTable ParseMarkdownTable(const std::string& text) {
  ParsedTable table;
  int line_number = 0;
  for (const auto& line : SplitLines(text)) {
    if (line.empty() || line[0] != '|') continue;
    if (line_number == 0) table.time_unit = TimeUnitOf(line);
    if (++line_number <= 2) continue;
    std::string cells = std::regex_replace(line.substr(1, line.size() - 2), std::regex(R"(\\\|)"), "\x01");
    auto row = SplitLine(cells, std::regex(R"(\|)"));
    for (auto& cell : row) {
      cell = std::regex_replace(cell, std::regex("\x01"), "|");
      for (const auto& [entity, letter] : {std::pair("&lt;", "<"), {"&gt;", ">"}, {"&amp;", "&"}}) {
        cell = std::regex_replace(cell, std::regex(entity), letter);
      }
    }
    table.rows.push_back(row);
  }
  return table;
}

ParsedTable ParseLatexTable(const std::string& text) {
  ParsedTable table;
  bool in_rows = false;
  for (const auto& line : SplitLines(text)) {
    if (line.rfind("Method", 0) == 0) table.time_unit = TimeUnitOf(line);
    if (line == "\\midrule") {
      in_rows = true;
    } else if (line == "\\bottomrule") {
      break;
    } else if (in_rows) {
      std::string cells = line.substr(0, line.rfind(" \\\\"));
      cells = std::regex_replace(cells, std::regex(R"(\\&)"), "\x01");
      auto row = SplitLine(cells, std::regex("&"));
      for (auto& cell : row) {
        cell = std::regex_replace(cell, std::regex("\x01"), "&");
        cell = std::regex_replace(cell, std::regex(R"(\\textbar\{\})"), "|");
        cell = std::regex_replace(cell, std::regex(R"(\\([%$#_{}]))"), "$1");
        if (cell == "--") cell = "-";
      }
      table.rows.push_back(row);
    }
  }
  return table;
}

std::vector<std::vector<std::string>> ParseCsv(const std::string& text) {
  std::vector<std::vector<std::string>> rows;
  std::vector<std::string> row;
  std::string field;
  bool quoted = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (quoted) {
      if (c == '"' && i + 1 < text.size() && text[i + 1] == '"') {
        field += text[++i];
      } else if (c == '"') {
        quoted = false;
      } else {
        field += c;
      }
    } else if (c == '"') {
      quoted = true;
    } else if (c == ',' || c == '\n') {
      row.push_back(field);
      field.clear();
      if (c == '\n') {
        rows.push_back(row);
        row.clear();
      }
    } else {
      field += c;
    }
  }
  return rows;
}

std::vector<CsvRow> CsvRows(const std::string& text) {
  const auto lines = ParseCsv(text);
  std::vector<CsvRow> rows;
  for (std::size_t l = 1; l < lines.size(); ++l) {
    EXPECT_EQ(lines[l].size(), lines[0].size());
    auto& row = rows.emplace_back();
    for (std::size_t i = 0; i < lines[l].size(); ++i) row[lines[0][i]] = lines[l][i];
  }
  return rows;
}

}  // namespace legopt::client

#include "client/grouped_table.h"

#include <algorithm>
#include <cctype>

#include "client/listing.h"

namespace legopt::client {
namespace {

std::vector<std::string> Titles(const GroupedTable& table) {
  std::vector<std::string> titles = table.key_titles;
  for (std::size_t group = 0; group < table.groups.size(); ++group) {
    titles.insert(titles.end(), table.column_titles.begin(), table.column_titles.end());
  }
  return titles;
}

std::string Centered(const std::string& text, std::size_t width) {
  const std::size_t length = DisplayWidth(text);
  const std::size_t left = length < width ? (width - length) / 2 : 0;
  return std::string(left, ' ') + text + std::string(width > left + length ? width - left - length : 0, ' ');
}

constexpr std::size_t kGap = 2;

std::vector<std::size_t> ColumnWidths(const std::vector<std::vector<std::string>>& lines) {
  std::vector<std::size_t> widths(lines.front().size(), 0);
  for (const auto& line : lines) {
    for (std::size_t i = 0; i < line.size(); ++i) widths[i] = std::max(widths[i], DisplayWidth(line[i]));
  }
  return widths;
}

// The line of group titles; a long title widens its columns evenly.
std::string GroupLine(const GroupedTable& table, std::vector<std::size_t>* widths) {
  const std::size_t keys = table.key_titles.size(), columns = table.column_titles.size();
  const auto width_of = [&](std::size_t first, std::size_t count) {
    std::size_t width = (count - 1) * kGap;
    for (std::size_t i = first; i < first + count; ++i) width += (*widths)[i];
    return width;
  };
  std::string line(width_of(0, keys), ' ');
  for (std::size_t group = 0; group < table.groups.size(); ++group) {
    const std::size_t first = keys + group * columns;
    const std::size_t width = width_of(first, columns), title = DisplayWidth(table.groups[group]);
    for (std::size_t extra = width; extra < title; ++extra) ++(*widths)[first + extra % columns];
    line += " | " + Centered(table.groups[group], std::max(width, title));
  }
  line.erase(line.find_last_not_of(' ') + 1);
  return line;
}

std::string TextLine(const GroupedTable& table, const std::vector<std::string>& cells,
                     const std::vector<std::size_t>& widths) {
  const std::size_t keys = table.key_titles.size(), columns = table.column_titles.size();
  std::string text;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const std::string padding(widths[i] - DisplayWidth(cells[i]), ' ');
    const bool group_starts = i >= keys && (i - keys) % columns == 0;
    if (i > 0) text += group_starts ? " | " : std::string(kGap, ' ');
    text += i == 0 ? cells[i] + padding : padding + cells[i];
  }
  return text;
}

std::string EscapeMarkdown(std::string text) {
  for (std::size_t at = 0; (at = text.find('|', at)) != std::string::npos; at += 2) text.insert(at, 1, '\\');
  return text;
}

std::string MarkdownLine(const std::vector<std::string>& cells) {
  std::string text = "|";
  for (const auto& cell : cells) text += " " + EscapeMarkdown(cell) + " |";
  return text + "\n";
}

std::string Uncapitalized(std::string text) {
  if (!text.empty()) text[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(text[0])));
  return text;
}

std::string EscapeLatex(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    switch (c) {
      case '\\':
        escaped += "\\textbackslash{}";
        break;
      case '~':
        escaped += "\\textasciitilde{}";
        break;
      case '^':
        escaped += "\\textasciicircum{}";
        break;
      case '&':
      case '%':
      case '$':
      case '#':
      case '_':
      case '{':
      case '}':
        escaped += '\\';
        [[fallthrough]];
      default:
        escaped += c;
    }
  }
  return escaped;
}

std::string LatexLine(const std::vector<std::string>& cells) {
  std::string text;
  for (std::size_t i = 0; i < cells.size(); ++i) text += (i == 0 ? "" : " & ") + cells[i];
  return text + " \\\\\n";
}

// Titles of the groups and the rules below them.
std::string LatexGroups(const GroupedTable& table) {
  const std::size_t keys = table.key_titles.size(), columns = table.column_titles.size();
  std::vector<std::string> groups = {"\\multicolumn{" + std::to_string(keys) + "}{c}{}"};
  std::string rules;
  for (std::size_t group = 0; group < table.groups.size(); ++group) {
    groups.push_back("\\multicolumn{" + std::to_string(columns) + "}{c}{" + EscapeLatex(table.groups[group]) + "}");
    const std::size_t first = keys + group * columns + 1;
    rules += "\\cmidrule(lr){" + std::to_string(first) + "-" + std::to_string(first + columns - 1) + "}";
  }
  return LatexLine(groups) + rules + "\n";
}

}  // namespace

std::string RenderText(const GroupedTable& table) {
  std::vector<std::vector<std::string>> lines = {Titles(table)};
  lines.insert(lines.end(), table.rows.begin(), table.rows.end());
  auto widths = ColumnWidths(lines);
  std::string text = table.caption + "\n\n" + GroupLine(table, &widths) + "\n";
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const std::string line = TextLine(table, lines[i], widths);
    text += line + "\n";
    if (i > 0) continue;
    std::string rule = line;
    for (char& c : rule) c = c == '|' ? '+' : '-';
    text += rule + "\n";
  }
  return text + "\n" + table.note + "\n";
}

std::string RenderMarkdown(const GroupedTable& table) {
  std::vector<std::string> titles = table.key_titles;
  for (const auto& group : table.groups) {
    for (std::size_t i = 0; i < table.column_titles.size(); ++i) {
      const std::string title = Uncapitalized(table.column_titles[i]);
      titles.push_back(i == 0 ? group + ": " + title : title);
    }
  }
  std::string text = "**" + EscapeMarkdown(table.caption) + "**\n\n" + MarkdownLine(titles) + "|";
  for (std::size_t i = 0; i < titles.size(); ++i) text += i == 0 ? " --- |" : " ---: |";
  text += "\n";
  for (const auto& row : table.rows) text += MarkdownLine(row);
  return text + "\n" + table.note + "\n";
}

std::string RenderLatex(const GroupedTable& table) {
  const std::size_t columns = Titles(table).size();
  std::string text = "% needs \\usepackage{booktabs}\n\\begin{table*}\n\\centering\n\\caption{" +
                     EscapeLatex(table.caption) + "}\n\\begin{tabular}{l" + std::string(columns - 1, 'r') +
                     "}\n\\toprule\n" + LatexGroups(table) + LatexLine(Titles(table)) + "\\midrule\n";
  for (const auto& row : table.rows) {
    auto cells = row;
    for (auto& cell : cells) cell = cell == "-" ? "--" : EscapeLatex(cell);
    text += LatexLine(cells);
  }
  return text + "\\bottomrule\n\\end{tabular}\n\n\\smallskip\nNote: " + EscapeLatex(table.note) + "\n\\end{table*}\n";
}

std::string TaskTitle(const std::string& task) {
  if (task == "posture") return "Posture generation";
  return task == "motion" ? "Motion generation" : task;
}

std::string InitializationTitle(const std::string& initialization) {
  if (initialization == "good") return "good init";
  return initialization == "in_collision" ? "init in collision" : initialization;
}

}  // namespace legopt::client

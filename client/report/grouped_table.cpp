#include "client/report/grouped_table.h"

#include <algorithm>
#include <cctype>

#include "app/printable.h"
#include "client/report/markup_text.h"

namespace legopt::client {
namespace {

struct StartTitle {
  const char* full;
  const char* brief;
};
constexpr EnumArray<Initialization, StartTitle> kStartTitles = {
    {{{"good init", "good"}, {"init in collision", "collision"}}}};

std::vector<std::string> Titles(const GroupedTable& table) {
  std::vector<std::string> titles;
  for (const auto& title : table.key_titles) titles.push_back(title.full);
  for (std::size_t group = 0; group < table.groups.size(); ++group) {
    for (const auto& title : table.column_titles) titles.push_back(title.full);
  }
  return titles;
}

std::string TitleOf(const TableGroup& group) { return group.section.full + ", " + group.title.full; }

std::vector<std::string> FullTexts(const std::vector<TableText>& row) {
  std::vector<std::string> texts;
  for (const auto& cell : row) texts.push_back(cell.full);
  return texts;
}

std::string MarkdownLine(const std::vector<std::string>& cells) {
  std::string text = "|";
  for (const auto& cell : cells) text += " " + MarkdownText(cell) + " |";
  return text + "\n";
}

// Abbreviations such as PAR10 or CPU are not changed.
std::string Uncapitalized(std::string text) {
  if (text.size() > 1 && std::isupper(static_cast<unsigned char>(text[1])) != 0) return text;
  if (!text.empty()) text[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(text[0])));
  return text;
}

std::string LatexLine(const std::vector<std::string>& cells) {
  std::string text;
  for (std::size_t i = 0; i < cells.size(); ++i) text += (i == 0 ? "" : " & ") + cells[i];
  return text + " \\\\\n";
}

// Renders the titles of the groups and the rules below them.
std::string LatexGroups(const GroupedTable& table) {
  const std::size_t keys = table.key_titles.size(), columns = table.column_titles.size();
  std::vector<std::string> groups = {"\\multicolumn{" + std::to_string(keys) + "}{c}{}"};
  std::string rules;
  for (std::size_t group = 0; group < table.groups.size(); ++group) {
    groups.push_back("\\multicolumn{" + std::to_string(columns) + "}{c}{" + LatexText(TitleOf(table.groups[group])) +
                     "}");
    const std::size_t first = keys + group * columns + 1;
    rules += "\\cmidrule(lr){" + std::to_string(first) + "-" + std::to_string(first + columns - 1) + "}";
  }
  return LatexLine(groups) + rules + "\n";
}

}  // namespace

std::string RenderMarkdown(const GroupedTable& table) {
  std::vector<std::string> titles = FullTexts(table.key_titles);
  for (const auto& group : table.groups) {
    for (std::size_t i = 0; i < table.column_titles.size(); ++i) {
      const std::string title = Uncapitalized(table.column_titles[i].full);
      titles.push_back(i == 0 ? TitleOf(group) + ": " + title : title);
    }
  }
  std::string text = table.caption.empty() ? "" : "**" + MarkdownText(table.caption) + "**\n\n";
  text += MarkdownLine(titles) + "|";
  for (std::size_t i = 0; i < titles.size(); ++i) text += i == 0 ? " --- |" : " ---: |";
  text += "\n";
  for (const auto& row : table.rows) text += MarkdownLine(FullTexts(row));
  text += "\n" + MarkdownText(table.note) + "\n";
  return text + (table.warning.empty() ? "" : "\n" + MarkdownText(table.warning) + "\n");
}

std::string RenderLatex(const GroupedTable& table) {
  const std::size_t columns = Titles(table).size();
  std::string text = "\\begin{table*}\n\\centering\n\\caption{" + LatexText(table.caption) + "}\n\\begin{tabular}{l" +
                     std::string(columns - 1, 'r') + "}\n\\toprule\n" + LatexGroups(table) + LatexLine(Titles(table)) +
                     "\\midrule\n";
  for (const auto& row : table.rows) {
    auto cells = FullTexts(row);
    for (auto& cell : cells) cell = cell == "-" ? "--" : LatexText(cell);
    text += LatexLine(cells);
  }
  text += "\\bottomrule\n\\end{tabular}\n\n\\smallskip\nNote: " + LatexText(table.note) + "\n";
  if (!table.warning.empty()) text += "\n\\smallskip\n" + LatexText(table.warning) + "\n";
  text += "\\end{table*}\n";
  return LatexNeeds(text) + text;
}

GroupedTable MakePrintable(GroupedTable table) {
  const auto mend = [](TableText& text) {
    text.full = app::Printable(text.full);
    text.brief = app::Printable(text.brief);
  };
  table.caption = app::Printable(table.caption);
  table.note = app::Printable(table.note);
  for (auto& group : table.groups) {
    mend(group.section);
    mend(group.title);
  }
  for (auto& row : table.rows) std::for_each(row.begin(), row.end(), mend);
  return table;
}

TableGroup GroupOf(Task task, Initialization initialization) {
  const auto& [full, brief] = kStartTitles[initialization];
  const TaskDescription& description = DescriptionOf(task);
  return {{std::string(description.title), std::string(description.short_title)}, {full, brief}};
}

}  // namespace legopt::client

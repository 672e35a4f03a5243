#include <cctype>

#include "client/report/markup_text.h"
#include "client/report/table_writers.h"

namespace legopt::client {
namespace {

// Abbreviations such as PAR10 or CPU are not changed.
std::string Uncapitalized(std::string text) {
  if (text.size() > 1 && std::isupper(static_cast<unsigned char>(text[1])) != 0) return text;
  if (!text.empty()) text[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(text[0])));
  return text;
}

std::string HeadingLines(const ShownTable& shown) {
  std::string text = "|", rule = "|";
  for (std::size_t i = 0; i < shown.table.columns.size(); ++i) {
    const TableColumn& column = shown.table.columns[i];
    std::string heading = shown.Heading(i);
    if (!column.group.empty()) {
      heading = Uncapitalized(std::move(heading));
      if (i == 0 || shown.GroupBegins(i)) heading = column.group + ": " + heading;
    }
    text += " " + MarkdownText(heading) + " |";
    rule += column.alignment == Alignment::kRight ? " ---: |" : " --- |";
  }
  return text + "\n" + rule + "\n";
}

}  // namespace

std::string RenderTableMarkdown(const ShownTable& shown) {
  const Table& table = shown.table;
  const std::string headings = HeadingLines(shown);
  const std::string mark = table.title.size() == 1 ? "**" : "";
  std::string text;
  for (const std::string& paragraph : table.title) text += mark + MarkdownText(paragraph) + mark + "\n\n";
  if (table.rows.empty() || table.rows.front().group.empty()) text += headings;
  std::string group;
  for (const TableRow& row : table.rows) {
    if (row.group != group) {
      text += std::string(group.empty() ? "" : "\n") + "**" + MarkdownText(row.group) + "**\n\n" + headings;
      group = row.group;
    }
    text += "|";
    for (const TableCell& cell : row.cells) text += " " + MarkdownText(cell.shown) + " |";
    text += "\n";
  }
  for (const TableNote& note : table.notes) text += "\n" + MarkdownText(note.text) + "\n";
  return text;
}

}  // namespace legopt::client

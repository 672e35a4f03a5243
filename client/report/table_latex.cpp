#include "client/report/markup_text.h"
#include "client/report/table_writers.h"

namespace legopt::client {
namespace {

std::string LatexLine(const std::vector<std::string>& cells) {
  std::string text;
  for (std::size_t i = 0; i < cells.size(); ++i) text += (i == 0 ? "" : " & ") + cells[i];
  return text + " \\\\\n";
}

std::string Spanning(std::size_t columns, const std::string& alignment, const std::string& text) {
  return "\\multicolumn{" + std::to_string(columns) + "}{" + alignment + "}{" + text + "}";
}

// Renders the headings of the groups and the rules below them.
std::string LatexGroups(const ShownTable& shown) {
  std::vector<std::string> groups;
  std::string rules;
  for (std::size_t i = 0; i < shown.table.columns.size(); i += shown.GroupSize(i)) {
    const std::string& group = shown.table.columns[i].group;
    groups.push_back(Spanning(shown.GroupSize(i), "c", LatexText(group)));
    if (group.empty()) continue;
    rules += "\\cmidrule(lr){" + std::to_string(i + 1) + "-" + std::to_string(i + shown.GroupSize(i)) + "}";
  }
  return LatexLine(groups) + rules + "\n";
}

std::string LatexHeading(const TableColumn& column) {
  if (column.unit.empty()) return LatexText(column.heading);
  return LatexText(column.heading) + " (" + (column.unit == "us" ? "$\\mu$s" : LatexText(column.unit)) + ")";
}

}  // namespace

std::string RenderTableLatex(const ShownTable& shown) {
  const Table& table = shown.table;
  std::string alignments;
  std::vector<std::string> headings;
  for (const TableColumn& column : table.columns) {
    alignments += column.alignment == Alignment::kRight ? 'r' : 'l';
    headings.push_back(LatexHeading(column));
  }
  std::string text = "\\begin{table*}\n\\centering\n";
  std::string caption;
  for (const std::string& paragraph : table.title) caption += (caption.empty() ? "" : " ") + LatexText(paragraph);
  if (!caption.empty()) text += "\\caption{" + caption + "}\n";
  text += "\\begin{tabular}{" + alignments + "}\n\\toprule\n" + (shown.has_groups() ? LatexGroups(shown) : "") +
          LatexLine(headings) + "\\midrule\n";
  std::string group;
  for (const TableRow& row : table.rows) {
    if (row.group != group) {
      text += LatexLine({Spanning(table.columns.size(), "l", "\\textbf{" + LatexText(row.group) + "}")});
      group = row.group;
    }
    std::vector<std::string> cells;
    for (const TableCell& cell : row.cells) cells.push_back(cell.shown == "-" ? "--" : LatexText(cell.shown));
    text += LatexLine(cells);
  }
  text += "\\bottomrule\n\\end{tabular}\n";
  for (std::size_t i = 0; i < table.notes.size(); ++i) {
    text += std::string("\n\\smallskip\n") + (i == 0 ? "Note: " : "") + LatexText(table.notes[i].text) + "\n";
  }
  text += "\\end{table*}\n";
  return LatexNeeds(text) + text;
}

}  // namespace legopt::client

#pragma once

#include <string>
#include <vector>

#include "client/report/text_layout.h"
#include "words/task.h"

namespace legopt::client {

/// A piece of a table, with a shorter form for where room is scarce.
struct TableText {
  std::string full;
  std::string brief = {};  ///< empty: as `full`
  Emphasis emphasis = Emphasis::kNone;

  const std::string& shortest() const { return brief.empty() ? full : brief; }
};

/// Title of a group of columns, "Motion generation, good init": what several groups share, and its own part.
struct TableGroup {
  TableText section;
  TableText title;
};

/// A table as the paper prints them: a few columns that name the row, then groups of columns below a common title, e.g.
/// "Motion generation, good init". All groups have the same columns. Cells are finished texts; "-" means nothing.
struct GroupedTable {
  std::string caption;                   ///< empty: none
  std::vector<TableText> key_titles;     ///< the first is aligned to the left, all other columns to the right
  std::vector<TableGroup> groups;        ///< those of one section beside each other
  std::vector<TableText> column_titles;  ///< of one group; LaTeX takes them as they are
  std::vector<std::vector<TableText>> rows;
  std::string note;     ///< below the table; one paragraph
  std::string warning;  ///< below the note, as a paragraph of its own; empty: none
  std::string legend;   ///< what brief cells mean; shown where they are
};

/// The table with its texts made printable (programs::Printable): the names in it are anybody's.
GroupedTable MakePrintable(GroupedTable table);

/// Aligned columns, groups separated by bars; a final line end. Without a limit of width: one line per row, full texts.
/// Else the first of these that fits: that; brief texts; full and brief texts with a table per section, then with one
/// per group; and where even that is too wide one paragraph per row. No line is wider than the limit, numbers are never
/// broken, and nothing is left out; long names of rows take several lines.
std::string RenderText(const GroupedTable& table, const TextLayout& layout);
/// A pipe table; the group's title stands in its first column.
std::string RenderMarkdown(const GroupedTable& table);
/// booktabs; "--" for "-".
std::string RenderLatex(const GroupedTable& table);

/// "Motion generation", "init in collision".
TableGroup GroupOf(Task task, Initialization initialization);

}  // namespace legopt::client

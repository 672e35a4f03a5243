#pragma once

#include <string>
#include <vector>

#include "client/report/text_layout.h"
#include "legopt/types/task.h"

namespace legopt::client {

/// A text of a table, with a shorter form for narrow layouts.
struct TableText {
  std::string full;
  std::string brief = {};  ///< empty: same as `full`
  Emphasis emphasis = Emphasis::kNone;

  const std::string& shortest() const { return brief.empty() ? full : brief; }
};

/// Title of a group of columns, "Motion generation, good init": a part shared by several groups, and its own part.
struct TableGroup {
  TableText section;
  TableText title;
};

/// A table as in the paper: some key columns, then groups of columns below a common title, e.g. "Motion generation,
/// good init". All groups have the same columns. Cells are formatted texts; "-" means no value.
struct GroupedTable {
  std::string caption;                   ///< empty: none
  std::vector<TableText> key_titles;     ///< the first column is left-aligned, all others are right-aligned
  std::vector<TableGroup> groups;        ///< groups of one section are side by side
  std::vector<TableText> column_titles;  ///< columns of one group; LaTeX uses them unescaped
  std::vector<std::vector<TableText>> rows;
  std::string note;     ///< paragraph below the table
  std::string warning;  ///< separate paragraph below the note; empty: none
  std::string legend;   ///< explanation of brief cells; shown only with them
};

/// Returns the table with printable texts (app::Printable), because names in it are untrusted.
GroupedTable MakePrintable(GroupedTable table);

/// Renders aligned columns, with groups separated by bars and a final line end. Without a width limit: one line per
/// row, full texts. Otherwise uses the first layout that fits: full texts; brief texts; full and brief texts with one
/// table per section, then with one per group; finally one paragraph per row. No line exceeds the limit, numbers are
/// never broken, and nothing is omitted; long row names are wrapped.
std::string RenderText(const GroupedTable& table, const TextLayout& layout);
/// Renders a pipe table; the title of a group is in its first column.
std::string RenderMarkdown(const GroupedTable& table);
/// Renders LaTeX with booktabs; "--" for "-".
std::string RenderLatex(const GroupedTable& table);

/// Returns the titles, e.g. "Motion generation" and "init in collision".
TableGroup GroupOf(Task task, Initialization initialization);

}  // namespace legopt::client

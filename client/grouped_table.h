#pragma once

#include <string>
#include <vector>

namespace legopt::client {

/// A table as the paper prints them: a few columns that name the row, then groups of columns below a common title, e.g.
/// "Motion generation, good init". All groups have the same columns. Cells are finished texts; "-" means nothing.
struct GroupedTable {
  std::string caption;
  std::vector<std::string> key_titles;     ///< the first is aligned to the left, all other columns to the right
  std::vector<std::string> groups;         ///< titles
  std::vector<std::string> column_titles;  ///< of one group; LaTeX takes them as they are
  std::vector<std::vector<std::string>> rows;
  std::string note;  ///< below the table; one paragraph
};

/// Aligned columns, groups separated by bars. Each ends with a line end; rows have equal content in all three.
std::string RenderText(const GroupedTable& table);
/// A pipe table; the group's title stands in its first column.
std::string RenderMarkdown(const GroupedTable& table);
/// booktabs; "--" for "-".
std::string RenderLatex(const GroupedTable& table);

/// "Posture generation", "Motion generation"; others as they are.
std::string TaskTitle(const std::string& task);
/// "good init", "init in collision"; others as they are.
std::string InitializationTitle(const std::string& initialization);

}  // namespace legopt::client

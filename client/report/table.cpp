#include "client/report/table.h"

#include <algorithm>
#include <cctype>
#include <set>
#include <utility>

#include "app/printable.h"
#include "app/value_list.h"
#include "client/client_error.h"
#include "client/report/escaped_text.h"
#include "client/report/table_writers.h"
#include "legopt/input/json.h"
#include "legopt/types/nearest_name.h"
#include "legopt/types/number_text.h"

namespace legopt::client {
namespace {

nlohmann::json NumberOrNull(const std::optional<double>& value) {
  return value ? nlohmann::json(*value) : nlohmann::json();
}

std::string LowerCase(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

std::vector<std::string> NamesOf(const Table& table) {
  std::vector<std::string> names;
  for (const TableColumn& column : table.columns) names.push_back(column.name);
  return names;
}

// Splits values of --columns. A column's name may contain a comma.
std::vector<std::string> SplitNames(const std::vector<std::string>& lists, const std::vector<std::string>& known) {
  const auto is_known = [&](const std::string& text) { return std::ranges::find(known, text) != known.end(); };
  std::vector<std::string> names;
  for (const std::string& list : lists) {
    for (std::string& name : app::SplitValues(list, is_known)) names.push_back(std::move(name));
  }
  return names;
}

[[noreturn]] void RefuseColumn(const std::string& column, const std::vector<std::string>& known) {
  throw ClientError(ExitCode::kUsage, "--columns: there is no column '" + column + "'; " + SuggestName(column, known));
}

[[noreturn]] void RefuseRows(const std::string& rows, std::size_t count) {
  throw ClientError(ExitCode::kUsage,
                    "--rows " + rows + ": " +
                        (count == 0 ? "the table has no rows" : "the table has rows 1 to " + std::to_string(count)) +
                        "; give numbers and ranges, e.g. 1-3,5");
}

// Returns the columns of grouped tables named by their headings in lower case, e.g. "cost".
std::vector<std::size_t> ColumnsWithHeading(const Table& table, const std::string& heading) {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < table.columns.size(); ++i) {
    if (!table.columns[i].heading.empty() && LowerCase(table.columns[i].heading) == LowerCase(heading)) {
      found.push_back(i);
    }
  }
  return found;
}

}  // namespace

TableCell TextCell(std::string text) { return {std::move(text), {}, Emphasis::kNone}; }

TableCell CountCell(std::int64_t count) { return {count, {}, Emphasis::kNone}; }

TableCell RealCell(const std::optional<double>& value, int decimals) {
  return FigureCell(value, value ? FormatFixed(*value, decimals) : "-");
}

TableCell FigureCell(const std::optional<double>& value, std::string shown) {
  return {NumberOrNull(value), std::move(shown), Emphasis::kNone};
}

TableCell PercentCell(const std::optional<double>& share, int decimals) {
  constexpr double kPercent = 100.0;
  return FigureCell(share, share ? FormatFixed(kPercent * *share, decimals) : "-");
}

TableCell SuccessCell(std::int64_t solved, std::int64_t n, const std::string& remarks) {
  return TextCell(std::to_string(solved) + "/" + std::to_string(n) + (remarks.empty() ? "" : " (" + remarks + ")"));
}

TableCell MissingCell(std::string reason) { return {nullptr, std::move(reason), Emphasis::kNone}; }

std::string ShownValue(const nlohmann::json& value) {
  if (value.is_null()) return "-";
  if (value.is_number_float()) return FormatGeneral(value.get<double>());
  // A row must be a single line, and untrusted text must not control the terminal.
  return app::Printable(value.is_string() ? value.get<std::string>() : Dump(value));
}

std::string RenderTable(const Table& table, TableFormat format, const TextLayout& layout) {
  switch (format) {
    case TableFormat::kText:
      return RenderTableText(ShownTable(table), layout);
    case TableFormat::kMarkdown:
      return RenderTableMarkdown(ShownTable(table));
    case TableFormat::kLatex:
      return RenderTableLatex(ShownTable(table));
    case TableFormat::kCsv:
      return RenderTableCsv(table);
    case TableFormat::kJson:
      return JsonText(RenderTableJson(table)) + "\n";
  }
  return {};
}

std::string RenderTables(const std::vector<Table>& tables, TableFormat format, const TextLayout& layout) {
  std::string text;
  for (const Table& table : tables) text += (text.empty() ? "" : "\n") + RenderTable(table, format, layout);
  return text;
}

std::vector<std::string> DistinctNames(const std::vector<std::string>& columns) {
  std::set<std::string> taken(columns.begin(), columns.end()), used;
  std::vector<std::string> names;
  for (const std::string& column : columns) {
    std::string name = column;
    for (int count = 2; used.contains(name) || (name != column && taken.contains(name)); ++count) {
      name = column + "_" + std::to_string(count);
    }
    used.insert(name);
    names.push_back(std::move(name));
  }
  return names;
}

std::vector<std::size_t> ColumnPositions(const std::vector<std::string>& columns,
                                         const std::vector<std::string>& kept) {
  const std::vector<std::string> names = DistinctNames(columns);
  std::vector<std::size_t> positions;
  for (const std::string& column : kept.empty() ? names : SplitNames(kept, names)) {
    const auto found = std::ranges::find(names, column);
    if (found == names.end()) RefuseColumn(column, names);
    positions.push_back(static_cast<std::size_t>(found - names.begin()));
  }
  return positions;
}

std::vector<std::size_t> RowPositions(const std::vector<std::string>& rows, std::size_t count) {
  std::vector<bool> kept(count, rows.empty());
  for (const std::string& list : rows) {
    for (const std::string& range : app::SplitValues(list)) {
      const std::size_t dash = range.find('-');
      const auto first = ParseInteger<std::size_t>(range.substr(0, dash));
      const auto last = dash == std::string::npos ? first : ParseInteger<std::size_t>(range.substr(dash + 1));
      if (!first || !last || *first < 1 || *last < *first || *last > count) RefuseRows(range, count);
      for (std::size_t row = *first; row <= *last; ++row) kept[row - 1] = true;
    }
  }
  std::vector<std::size_t> positions;
  for (std::size_t i = 0; i < count; ++i) {
    if (kept[i]) positions.push_back(i);
  }
  return positions;
}

Table KeepColumns(const Table& table, const std::vector<std::string>& columns) {
  if (columns.empty()) return table;
  const std::vector<std::string> names = DistinctNames(NamesOf(table));
  std::vector<std::size_t> positions;
  for (const std::string& column : SplitNames(columns, names)) {
    const auto found = std::ranges::find(names, column);
    if (found != names.end()) {
      positions.push_back(static_cast<std::size_t>(found - names.begin()));
      continue;
    }
    const std::vector<std::size_t> several = ColumnsWithHeading(table, column);
    if (several.empty()) RefuseColumn(column, names);
    positions.insert(positions.end(), several.begin(), several.end());
  }
  // The position of a column's group; columns without a group come first.
  const auto group = [&](std::size_t position) {
    const std::string& of = table.columns[position].group;
    return of.empty() ? -1 : std::ranges::find(table.columns, of, &TableColumn::group) - table.columns.begin();
  };
  std::ranges::stable_sort(positions, {}, group);
  Table kept = table;
  kept.columns.clear();
  for (const std::size_t i : positions) {
    kept.columns.push_back(table.columns[i]);
    kept.columns.back().name = names[i];
  }
  for (std::size_t row = 0; row < table.rows.size(); ++row) {
    kept.rows[row].cells.clear();
    for (const std::size_t i : positions) kept.rows[row].cells.push_back(table.rows[row].cells[i]);
  }
  return kept;
}

ShownTable::ShownTable(const Table& from) : table(from) {
  for (std::string& paragraph : table.title) paragraph = app::Printable(paragraph);
  for (TableColumn& column : table.columns) {
    column.heading = app::Printable(column.heading.empty() ? column.name : column.heading);
    column.group = app::Printable(column.group);
  }
  for (TableRow& row : table.rows) {
    row.group = app::Printable(row.group);
    for (TableCell& cell : row.cells) {
      cell.shown = cell.shown.empty() ? ShownValue(cell.value) : app::Printable(cell.shown);
    }
  }
  for (TableNote& note : table.notes) note.text = app::Printable(note.text);
}

std::string ShownTable::Heading(std::size_t column) const {
  const TableColumn& of = table.columns[column];
  return of.unit.empty() ? of.heading : of.heading + " (" + of.unit + ")";
}

bool ShownTable::GroupBegins(std::size_t column) const {
  return column > 0 && table.columns[column].group != table.columns[column - 1].group;
}

std::size_t ShownTable::GroupSize(std::size_t column) const {
  std::size_t end = column + 1;
  while (end < table.columns.size() && !GroupBegins(end)) ++end;
  return end - column;
}

bool ShownTable::has_groups() const {
  return std::ranges::any_of(table.columns, [](const TableColumn& column) { return !column.group.empty(); });
}

}  // namespace legopt::client

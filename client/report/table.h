#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/report/text_layout.h"

namespace legopt::client {

/// Output formats of all commands that print tables.
enum class TableFormat { kText, kMarkdown, kLatex, kCsv, kJson };

/// Returns whether a format has exact values, for programs: CSV and JSON.
inline bool IsExact(TableFormat format) { return format == TableFormat::kCsv || format == TableFormat::kJson; }

enum class Alignment { kLeft, kRight };

struct TableColumn {
  std::string name;          ///< name in CSV, JSON and --columns
  std::string heading = {};  ///< heading in text, Markdown and LaTeX; empty: `name`
  std::string unit = {};     ///< unit of the values; empty: none
  Alignment alignment = Alignment::kRight;
  std::string group = {};  ///< heading above adjacent columns of the same group; empty: none
};

/// A value of a table. The functions below make cells of each type.
struct TableCell {
  nlohmann::json value;    ///< exact scalar for CSV and JSON; null: missing
  std::string shown = {};  ///< text in text, Markdown and LaTeX; empty: ShownValue(value)
  Emphasis emphasis = Emphasis::kNone;
};

TableCell TextCell(std::string text);
TableCell CountCell(std::int64_t count);
/// A real number with `decimals` digits after the point.
TableCell RealCell(const std::optional<double>& value, int decimals);
/// A real number that is shown as `shown`.
TableCell FigureCell(const std::optional<double>& value, std::string shown);
/// A share in [0, 1], shown in percent without the sign.
TableCell PercentCell(const std::optional<double>& share, int decimals);
/// Successes as "34/35", or with remarks "34/35 (1 dead)".
TableCell SuccessCell(std::int64_t solved, std::int64_t n, const std::string& remarks = {});
/// A missing value, shown as the reason, or as a dash.
TableCell MissingCell(std::string reason = "-");

struct TableRow {
  std::vector<TableCell> cells;  ///< one per column
  std::string group = {};        ///< heading above adjacent rows of the same group; empty: none
  Emphasis group_emphasis = Emphasis::kBest;
};

/// A paragraph below a table.
struct TableNote {
  std::string text;
  Emphasis emphasis = Emphasis::kDim;
};

/// The table of a command, whatever its output format. Texts may be untrusted: the writers make them printable.
struct Table {
  std::vector<std::string> title;  ///< paragraphs above the table
  std::vector<TableColumn> columns;
  std::vector<TableRow> rows;
  std::vector<TableNote> notes;
  bool has_headings = true;  ///< false: the text format has no line of headings
};

/// Renders a table, with a final newline:
/// * text: aligned columns; groups of columns have bars between them. If `layout` limits the width and the table does
///   not fit: first the text of a left-aligned last column is wrapped; otherwise each row becomes a block with one line
///   per value. No line exceeds the limit, no number is broken and nothing is omitted;
/// * Markdown: a pipe table; the heading of a group is in its first column; a title of one paragraph is bold;
/// * LaTeX: booktabs, with "--" for a dash; the title is the caption;
/// * CSV: RFC 4180 with a header line, exact values, empty for null, "inf" or "-inf" for an infinite number;
/// * JSON: an array of objects, exact values, the texts "inf" and "-inf" for infinite numbers.
/// CSV and JSON contain no title, notes or groups; columns are named by DistinctNames.
std::string RenderTable(const Table& table, TableFormat format, const TextLayout& layout = {});

/// Renders tables with an empty line between them; for text, Markdown and LaTeX.
std::string RenderTables(const std::vector<Table>& tables, TableFormat format, const TextLayout& layout = {});

/// Renders the row as lines "heading  value", as text; wraps long values, omits missing and empty ones.
std::string RenderRecord(const Table& table, std::size_t row, const TextLayout& layout = {});

/// Returns a table of only these columns, in this order: values of --columns, separated by commas. A value is the name
/// of a column, or the heading of columns in several groups, which stay together. Throws ClientError (kUsage) with the
/// most similar name for an unknown column. Without values, returns the table as it is.
Table KeepColumns(const Table& table, const std::vector<std::string>& columns);

/// Returns the positions, from 0 and ascending, that values of --rows such as "1-3,5" select among `count` rows; all of
/// them without values. Throws ClientError (kUsage) for a text that is no range of rows.
std::vector<std::size_t> RowPositions(const std::vector<std::string>& rows, std::size_t count);

/// Keeps the elements of RowPositions.
template <class Element>
void KeepRows(const std::vector<std::string>& rows, std::vector<Element>* elements) {
  if (rows.empty()) return;
  std::vector<Element> kept;
  for (const std::size_t row : RowPositions(rows, elements->size())) kept.push_back(std::move((*elements)[row]));
  *elements = std::move(kept);
}

/// Returns the names, with a number appended to repeated ones: x, x_2, x_3.
std::vector<std::string> DistinctNames(const std::vector<std::string>& columns);

/// Returns the positions of the columns `kept` (values of --columns) in `columns`, by distinct name; all of them if
/// `kept` is empty. Throws ClientError (kUsage) like KeepColumns.
std::vector<std::size_t> ColumnPositions(const std::vector<std::string>& columns, const std::vector<std::string>& kept);

/// Returns a value as shown in text and Markdown: at most six significant digits, "-" for null, one line.
std::string ShownValue(const nlohmann::json& value);

}  // namespace legopt::client

#pragma once

#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "client/report/text_layout.h"
#include "legopt/types/enum_names.h"

namespace legopt::client {

/// Output formats of listings.
enum class ListingFormat { kText, kMarkdown, kCsv, kJson };

/// A rectangular query result, printed by commands such as `list`, `status` and `query`. A cell is a JSON scalar: null,
/// boolean, number or string.
struct Listing {
  std::vector<std::string> columns;
  std::vector<std::vector<nlohmann::json>> rows;  ///< each has columns.size() cells
  bool truncated = false;                         ///< more rows exist than were read

  /// Returns the index of a column; throws std::out_of_range with its name if it does not exist.
  std::size_t Column(std::string_view name) const;
  /// Returns the cell of a row by column name.
  const nlohmann::json& At(std::size_t row, std::string_view column) const;
  /// Returns the text of a cell by column name. Throws ClientError (kDatabaseUnusable) if the cell is not a text.
  std::string Text(std::size_t row, std::string_view column) const;
  /// Returns the enumerator named in a cell. Throws ClientError (kDatabaseUnusable) for an unknown name, which
  /// indicates a damaged database or another release.
  template <NamedEnum Enum>
  Enum EnumAt(std::size_t row, std::string_view column) const;

 private:
  [[noreturn]] static void RefuseWord(std::string_view column, const std::string& word);
};

template <NamedEnum Enum>
Enum Listing::EnumAt(std::size_t row, std::string_view column) const {
  const std::string word = Text(row, column);
  if (const auto value = ParseEnum<Enum>(word)) return *value;
  RefuseWord(column, word);
}

/// Renders a listing, with a final newline.
/// * text: aligned columns, numbers right-aligned with at most six significant digits, "-" for null. A row is one line
///   unless `layout` limits the width. Then, as needed: columns with equal values in all rows are listed once above;
///   long texts are wrapped in their column; a row and the titles take up to three lines; each value is on a separate
///   line. Numbers are never broken, nothing is omitted. With colour, dead or failed jobs, and counts of them, are red;
/// * Markdown: the same cells as a pipe table;
/// * CSV: RFC 4180 with a header line, full precision, empty for null, "inf" or "-inf" for an infinite number;
/// * JSON: an array of objects, full precision, the texts "inf" and "-inf" for infinite numbers.
/// In CSV and JSON, columns are named by DistinctNames.
std::string RenderListing(const Listing& listing, ListingFormat format, const TextLayout& layout = {});

/// Renders one row as lines "name  value", with multi-line values indented; null and empty values are omitted.
std::string RenderFields(const Listing& listing, std::size_t row, const TextLayout& layout = {});

/// Returns a listing of only these columns, in this order. Throws ClientError (kUsage) with the most similar name for
/// an unknown column.
Listing KeepColumns(const Listing& listing, const std::vector<std::string>& columns);

/// Returns the names, with a number appended to repeated ones: x, x_2, x_3.
std::vector<std::string> DistinctNames(const std::vector<std::string>& columns);

/// Returns the positions of the columns `kept` in `columns`, by distinct name. Throws ClientError (kUsage) like
/// KeepColumns.
std::vector<std::size_t> ColumnPositions(const std::vector<std::string>& columns, const std::vector<std::string>& kept);

/// Returns a line of CSV including its end.
std::string CsvHeader(const std::vector<std::string>& names);
std::string CsvRow(const std::vector<nlohmann::json>& cells);
/// Returns a row of the JSON array of RenderListing, without the following comma and line end.
std::string IndentedJsonRow(const std::vector<std::string>& names, const std::vector<nlohmann::json>& cells);

/// Returns the rows as an array of JSON objects, as printed by RenderListing.
nlohmann::ordered_json ListingToJson(const Listing& listing);

/// Converts an array of JSON objects to a listing: one column per key, first those of `leading` that occur, in that
/// order, then the others; absent keys are null and nested values become JSON text.
Listing ListingFromJson(const nlohmann::json& array, const std::vector<std::string>& leading = {});

/// Returns a CSV field (RFC 4180), quoted only if needed.
std::string CsvField(std::string_view text);

/// Returns a cell as displayed in text and Markdown.
std::string ShownValue(const nlohmann::json& value);

/// Returns which columns contain only numbers and nulls.
std::vector<bool> NumericColumns(const Listing& listing);

/// Pads columns to equal display width and separates them by two spaces, without trailing spaces. `right_aligned` has
/// one element per column.
std::string AlignColumns(std::span<const std::vector<std::string>> lines, const std::vector<bool>& right_aligned);

/// Aligns lines with equal numbers of columns to the left; the last column is wrapped to `width` (0: no limit), but to
/// no less than half of it.
std::string AlignSentences(std::span<const std::vector<std::string>> lines, std::size_t width);

}  // namespace legopt::client

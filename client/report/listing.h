#pragma once

#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "client/report/text_layout.h"
#include "words/words.h"

namespace legopt::client {

/// The forms in which every listing can be printed.
enum class ListingFormat { kText, kMarkdown, kCsv, kJson };

/// A rectangular query result: what commands such as `list`, `status` and `query` print.
/// A cell is a JSON scalar: null, boolean, number or string.
struct Listing {
  std::vector<std::string> columns;
  std::vector<std::vector<nlohmann::json>> rows;  ///< each as long as `columns`
  bool truncated = false;                         ///< more rows exist than were read

  /// Index of a column; throws std::out_of_range naming it when it does not exist.
  std::size_t Column(std::string_view name) const;
  /// The cell of a row by column name.
  const nlohmann::json& At(std::size_t row, std::string_view column) const;
  /// The same, of a column of texts. Throws ClientError (kDatabaseUnusable) if it is no text.
  std::string Text(std::size_t row, std::string_view column) const;
  /// The value whose word stands there. Throws ClientError (kDatabaseUnusable) for an unknown word:
  /// of a damaged database, or of another release.
  template <Worded Enum>
  Enum WordAt(std::size_t row, std::string_view column) const;

 private:
  [[noreturn]] static void RefuseWord(std::string_view column, const std::string& word);
};

template <Worded Enum>
Enum Listing::WordAt(std::size_t row, std::string_view column) const {
  const std::string word = Text(row, column);
  if (const auto value = ParseWord<Enum>(word)) return *value;
  RefuseWord(column, word);
}

/// Renders a listing, with a final newline.
/// * text: aligned columns, numbers to the right with at most six significant digits, "-" for null. A row is one line
///   unless `layout` limits the width. Then, as far as needed: columns that are the same in all rows are said once,
///   above; long texts take several lines of their column; a row takes up to three lines, as do the titles; each value
///   stands in a line of its own. Numbers are never broken, nothing is left out. With colour, jobs that are dead or
///   failed, and counts of them, are red;
/// * Markdown: the same cells as a pipe table;
/// * CSV: RFC 4180 with a header line, full precision, empty for null, "inf" or "-inf" for an infinite number;
/// * JSON: an array of objects, full precision, the texts "inf" and "-inf" for infinite numbers.
/// In CSV and JSON, columns are named by DistinctNames.
std::string RenderListing(const Listing& listing, ListingFormat format, const TextLayout& layout = {});

/// One row as lines "name  value", values of several lines indented; null and empty values are left out.
std::string RenderFields(const Listing& listing, std::size_t row, const TextLayout& layout = {});

/// Only these columns, in this order. Throws ClientError (kUsage) that names one that does not exist and its nearest.
Listing KeepColumns(const Listing& listing, const std::vector<std::string>& columns);

/// The names with a number behind those that occur again: x, x_2, x_3.
std::vector<std::string> DistinctNames(const std::vector<std::string>& columns);

/// Where the columns `kept` are among `columns`, by distinct name. Throws ClientError (kUsage) as KeepColumns.
std::vector<std::size_t> ColumnPositions(const std::vector<std::string>& columns, const std::vector<std::string>& kept);

/// One line of CSV, with its end.
std::string CsvHeader(const std::vector<std::string>& names);
std::string CsvRow(const std::vector<nlohmann::json>& cells);
/// One row of the JSON array of RenderListing, without the comma and line end behind it.
std::string IndentedJsonRow(const std::vector<std::string>& names, const std::vector<nlohmann::json>& cells);

/// The rows as an array of JSON objects, as RenderListing prints them.
nlohmann::ordered_json ListingToJson(const Listing& listing);

/// A listing from an array of JSON objects: one column per key, first those of `leading` that occur, in that order,
/// then the others; absent keys are null and nested values are shown as JSON text.
Listing ListingFromJson(const nlohmann::json& array, const std::vector<std::string>& leading = {});

/// RFC 4180: quoted only when needed.
std::string CsvField(std::string_view text);

/// A cell as text and Markdown show it.
std::string ShownValue(const nlohmann::json& value);

/// Which columns hold nothing but numbers and nulls.
std::vector<bool> NumericColumns(const Listing& listing);

/// Columns padded to equal width and separated by two spaces; widths are those of the terminal.
/// `right_aligned[i]` tells the side; no space at line ends.
std::string AlignColumns(std::span<const std::vector<std::string>> lines, const std::vector<bool>& right_aligned);

/// Lines of equally many columns, left-aligned; the last column is broken so that `width` holds (0: no limit), but into
/// no less than half of it.
std::string AlignSentences(std::span<const std::vector<std::string>> lines, std::size_t width);

}  // namespace legopt::client

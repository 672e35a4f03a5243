#pragma once

#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

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
};

/// Renders a listing, with a final newline.
/// * text: aligned columns, numbers to the right with at most six significant digits, "-" for null;
/// * Markdown: the same cells as a pipe table;
/// * CSV: RFC 4180 with a header line, full precision, empty for null;
/// * JSON: an array of objects, full precision; a column name that occurs twice gets the suffix "_2".
std::string RenderListing(const Listing& listing, ListingFormat format);

/// The rows as an array of JSON objects, as RenderListing prints them.
nlohmann::ordered_json ListingToJson(const Listing& listing);

/// A listing from an array of JSON objects: one column per key, first those of `leading` that occur, in that order,
/// then the others; absent keys are null and nested values are shown as JSON text.
Listing ListingFromJson(const nlohmann::json& array, const std::vector<std::string>& leading = {});

/// RFC 4180: quoted only when needed.
std::string CsvField(std::string_view text);

/// Columns padded to equal width and separated by two spaces; widths count UTF-8 characters.
/// `right_aligned[i]` tells the side; no space at line ends.
std::string AlignColumns(std::span<const std::vector<std::string>> lines, const std::vector<bool>& right_aligned);

/// Number of characters that UTF-8 `text` shows on a terminal (no wide characters in our texts).
std::size_t DisplayWidth(std::string_view text);

}  // namespace legopt::client

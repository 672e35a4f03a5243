#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "client/report/table.h"
#include "legopt/types/enum_names.h"

namespace legopt::client {

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

/// Returns a listing as a table: numbers are right-aligned, dead or failed jobs and counts of them are red.
Table TableOf(const Listing& listing);

/// Renders the table of a listing (see RenderTable).
std::string RenderListing(const Listing& listing, TableFormat format, const TextLayout& layout = {});

/// Renders one row as lines "name  value" (see RenderRecord).
std::string RenderFields(const Listing& listing, std::size_t row, const TextLayout& layout = {});

/// Returns the rows as an array of JSON objects, as printed by RenderListing.
nlohmann::ordered_json ListingToJson(const Listing& listing);

/// Converts an array of JSON objects to a listing: one column per key, first those of `leading` that occur, in that
/// order, then the others; absent keys are null and nested values become JSON text.
Listing ListingFromJson(const nlohmann::json& array, const std::vector<std::string>& leading = {});

/// Writes a listing as CSV or JSON row by row to standard output, byte-identical to RenderListing, so that memory does
/// not limit its length.
class ListingWriter {
 public:
  /// `format`: CSV or JSON. `columns`: columns to write, in this order; empty: all.
  ListingWriter(TableFormat format, std::vector<std::string> columns) : format_(format), kept_(std::move(columns)) {}

  /// Writes the beginning. Throws ClientError (kUsage) for a column to keep that is not among `columns`.
  void Begin(const std::vector<std::string>& columns);
  /// Writes a row. Throws ClientError (kUsage) if standard output cannot be written.
  void Row(const std::vector<nlohmann::json>& row);
  /// Completes the text, also of a truncated listing.
  void End();

 private:
  TableFormat format_;
  std::vector<std::string> kept_;
  std::vector<std::string> names_;      // column names in the text
  std::vector<std::size_t> positions_;  // index of each kept column in a row
  bool begun_ = false, any_row_ = false;
};

}  // namespace legopt::client

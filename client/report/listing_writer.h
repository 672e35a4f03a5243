#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "client/report/table.h"

namespace legopt::client {

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
